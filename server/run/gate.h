// Admission of messages: decoding, validation, ownership of tools, and recognition of requests that
// were already answered. In a live run the bus thread owns the only Gate; offline, each replay of a
// plain log owns one.
#ifndef PLIANT_RUN_GATE_H
#define PLIANT_RUN_GATE_H

#include "run/input.h"

// The answer to one request, as reply_t without its envelope.
typedef struct Answer {
    InputKind kind;  // channel on which the request came
    int32_t command; // kind of a command, else 0
    int32_t sender, id;
    bool ok;
    bool after_frame;               // STEP: the nodes and contacts of the last tick are sent first
    int64_t step;                   // ticks completed when it was executed
    int32_t separated, nodes_added; // of a cut
    int32_t pieces;
    char text[INPUT_WHY_MAX];
} Answer;

enum { GATE_ANSWERS = 1024 }; // several seconds of a hundred cuts per second

typedef enum Passage {
    PASSAGE_OPEN,     // execute it
    PASSAGE_REFUSED,  // count it, and answer if it is a request whose sender is known
    PASSAGE_ANSWERED, // executed before: send the stored answer again
    PASSAGE_PENDING,  // being executed: its answer follows
} Passage;

typedef struct ToolOwner {
    bool owned;
    int32_t sender;
    int64_t last_us;  // arrival of the newest accepted pose
    int32_t sequence; // of that pose
    int64_t utime;    // of that pose, the sender's
} ToolOwner;

typedef struct GateEntry {
    bool used, pending;
    int64_t number; // counts requests: the smallest is the oldest
    Answer answer;
} GateEntry;

typedef struct Gate {
    Sim *sim; // only its constant members are read
    int64_t timeout_us;
    ToolOwner *owner;              // [tool_count], of the arena
    GateEntry entry[GATE_ANSWERS]; // the newest requests
    int64_t requests;
    int64_t refused[REFUSAL_COUNT];
} Gate;

// The result of one message.
typedef struct GateResult {
    Passage passage;
    Refusal refusal;
    bool known; // sender and id were readable
    Input input;
    char why[INPUT_WHY_MAX];
    const Answer *answer; // PASSAGE_ANSWERED; valid until the next call
} GateResult;

// Initialises the gate at load time. A tool is stale `timeout_s` after the newest pose of its
// owner.
void gate_init(Gate *gate, Sim *sim, double timeout_s, Arena *arena);
// Checks one raw message that arrived at now_us (any monotonic clock). An admitted request counts
// as pending until gate_answer.
void gate_pass(Gate *gate, InputKind kind, const void *data, size_t size, int64_t now_us,
               GateResult *result);
// Stores the answer of a request, for repeats of the request.
void gate_answer(Gate *gate, const Answer *answer);
// Forgets a request that was admitted but found a full queue, so that a repeat is tried again.
void gate_forget(Gate *gate, const Input *input);
// Returns how many requests of a sender are pending.
int gate_pending(const Gate *gate, int32_t sender);
// Counts a refusal that was found later: a full queue, or a request that the scene cannot execute.
void gate_count(Gate *gate, Refusal refusal);
int64_t gate_refused(const Gate *gate);

#endif
