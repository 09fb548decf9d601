// What is let in: decoding, values, ownership of tools, and requests that were answered before.
// Live the bus thread holds the one Gate; off line whoever replays a log of plain messages does.
#ifndef PLIANT_RUN_GATE_H
#define PLIANT_RUN_GATE_H

#include "run/input.h"

// The answer to one request, as reply_t without its envelope.
typedef struct Answer {
    InputKind kind;  // channel on which the request came
    int32_t command; // kind of a command, else 0
    int32_t sender, id;
    bool ok;
    bool after_frame;               // STEP: the nodes and contacts of the last tick go out first
    int64_t step;                   // ticks completed when it was executed
    int32_t separated, nodes_added; // of a cut
    int32_t pieces;
    char text[INPUT_WHY_MAX];
} Answer;

enum { GATE_ANSWERS = 1024 }; // several seconds of a hundred cuts a second

typedef enum Passage {
    PASSAGE_OPEN,     // execute it
    PASSAGE_REFUSED,  // count, and answer if it is a request whose sender is known
    PASSAGE_ANSWERED, // executed before: send the stored answer again
    PASSAGE_PENDING,  // being executed: its answer will come
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
    Sim *sim; // only what is constant in it is read
    int64_t timeout_us;
    ToolOwner *owner;              // [tool_count], of the arena
    GateEntry entry[GATE_ANSWERS]; // the newest requests
    int64_t requests;
    int64_t refused[REFUSAL_COUNT];
} Gate;

// What happened to one message.
typedef struct GateResult {
    Passage passage;
    Refusal refusal;
    bool known; // sender and id could be read
    Input input;
    char why[INPUT_WHY_MAX];
    const Answer *answer; // PASSAGE_ANSWERED; valid until the next call
} GateResult;

// Load time. A tool is stale `timeout_s` after the newest pose of its owner.
void gate_init(Gate *gate, Sim *sim, double timeout_s, Arena *arena);
// One raw message that arrived at now_us (any monotonic clock). A request let in is remembered as
// pending until gate_answer.
void gate_pass(Gate *gate, InputKind kind, const void *data, size_t size, int64_t now_us,
               GateResult *result);
// Keeps the answer of a request for repeats of it.
void gate_answer(Gate *gate, const Answer *answer);
// Forgets a request that was let in and then not executed for want of room: a repeat of it is tried
// again.
void gate_forget(Gate *gate, const Input *input);
// How many requests of a sender are being executed.
int gate_pending(const Gate *gate, int32_t sender);
// Counts a refusal that was found later: a full queue, a request that the scene could not do.
void gate_count(Gate *gate, Refusal refusal);
int64_t gate_refused(const Gate *gate);

#endif
