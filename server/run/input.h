// SPDX-License-Identifier: MIT
// Messages in: decoding and checks of one message, then the admission of messages.
#ifndef PLIANT_RUN_INPUT_H
#define PLIANT_RUN_INPUT_H

#include "sim/sim.h"

#include "pliant_lcmtypes.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// --- one message ---------------------------------------------------------------------------------

// Inputs from other programs (poses, cuts, loads, commands and ties) as plain data of fixed size.
// They are decoded from raw bytes, and every check comes before generated code reads them. Pure
// functions for any thread but the step thread, which only reads finished Inputs. A new message is
// an InputKind, a member of Input and a row of TYPES (input.c).

// All of them: X(kind, member, type). TYPES (input.c) has the rest of each.
#define INPUT_LIST(X)                                                                              \
    X(POSE, pose, tool_pose_t)                                                                     \
    X(CUT, cut, cut_t)                                                                             \
    X(LOAD, load, load_t)                                                                          \
    X(COMMAND, command, command_t)                                                                 \
    X(TIE, tie, tie_t)

#define INPUT_KIND(kind, member, type) INPUT_##kind,
typedef enum InputKind { INPUT_LIST(INPUT_KIND) INPUT_KINDS } InputKind;

// Reasons for refusing an input; status_t.reason holds their names.
typedef enum Refusal {
    ACCEPTED,
    REFUSED_SIZE,         // raw length does not match the type
    REFUSED_TYPE,         // fingerprint of another type
    REFUSED_STRING,       // string without terminator, or with a NUL inside
    REFUSED_NOT_FINITE,   // a NaN or an infinity
    REFUSED_QUATERNION,   // length differs from 1 by more than 1e-3
    REFUSED_TOOL,         // unknown, or not moved by poses
    REFUSED_BODY,         // unknown
    REFUSED_RANGE,        // a value outside its range
    REFUSED_COMMAND,      // unknown kind, or an argument that the kind does not allow
    REFUSED_OWNER,        // the tool belongs to another sender
    REFUSED_LATE,         // a pose older than one already taken from its sender
    REFUSED_STALE,        // a pose that waited while the daemon was stopped, or a request
                          // older than the daemon
    REFUSED_FULL,         // too many requests are waiting
    REFUSED_NOT_POSSIBLE, // well formed, but the scene cannot do it
    REFUSED_PACKET,       // not an LCM packet
    REFUSED_FRAGMENT,     // longer than a packet, on a channel of this daemon
    REFUSED_REMOTE,       // from another host
    REFUSED_SWITCHED_OFF, // a STOP, which the scene has disabled
    REFUSAL_COUNT
} Refusal;

enum { INPUT_TEXT_MAX = 128, INPUT_WIRE_MAX = 512, INPUT_WHY_MAX = 192 };

// What SET is to set: its argument as input_check reads it.
typedef struct Setting {
    double value[3];
    int32_t count; // of `value`, 1 or 3; of a try also 0: only what it is now
    bool tries;    // report what it would do
} Setting;

// The message itself, as the sender filled it, so that a log can store it as it came; but its
// string is in `text`.
#define INPUT_MEMBER(kind, member, type) pliant_##type member;
typedef struct Input {
    InputKind kind;
    int index; // pose: of the tool; request: of the body, -1 for all or none
    union {
        struct {            // the first members of every message
            int64_t utime;  // sender's clock [us]
            int32_t sender; // random number drawn by the client
            int32_t id;     // of a request; the sequence of a pose
        };
        INPUT_LIST(INPUT_MEMBER)
    };
    int32_t lifts; // inactive poses of the tool before this one: the bus counts
    // Of a request: how many came before; of a pose: when it came, by the clock [ns]. The bus
    // writes it.
    int64_t arrival;
    Setting setting;               // of SET
    int tool_index, to_body_index; // of a tie; -1: none
    char text[INPUT_TEXT_MAX]; // cut, load, tie: name of the body; SET: the key; else the argument
} Input;

// Returns "wrong_size", "not_finite" and so on.
const char *refusal_name(Refusal refusal);
// Returns "wrong_type_cut_t" and so on: the name of a count of messages of another type on the
// channel of a kind.
const char *input_foreign_name(InputKind kind);
// Returns the channel without its prefix: "TOOL_POSE", "CUT", "LOAD", "COMMAND", "TIE".
const char *input_channel(InputKind kind);
// True if the input is a request, which is answered; poses are not.
bool input_is_request(const Input *input);
// True for the commands PAUSE and STOP, which overtake all other requests: an operator needs them
// most when others flood the server.
bool input_is_urgent(InputKind kind, int32_t command);
// Returns the kind of the event that tells of a request executed on the scene: "cut", "load",
// "tie", "set", "reset".
const char *input_event(const Input *input);

// Decodes bytes to an Input. Checks size, fingerprint and string before reading any value. If it
// refuses, `why` gets a sentence of at most INPUT_WHY_MAX bytes.
Refusal input_decode(InputKind kind, const void *data, size_t size, Input *input, char *why);
// Validates numbers, names and ranges against the scene and sets `index`. Reads only constant
// members of `sim`.
Refusal input_check(Input *input, Sim *sim, char *why);
// Encodes an Input so that decoding returns the same Input. Returns the size, at most
// INPUT_WIRE_MAX.
size_t input_encode(const Input *input, void *data);

// Convert a valid input to the form that the simulation takes.
ToolPose input_pose(const Input *input);
CutOptions input_cut(const Input *input);
LoadOptions input_load(const Input *input);
TieOptions input_tie(const Input *input);

// --- admission -----------------------------------------------------------------------------------

// Admission of messages: decoding, validation, ownership of tools, and recognition of requests that
// were already answered. In a live run the bus thread owns the only Gate; offline, each replay of a
// plain log owns one.

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
    bool tries;    // to a SET that was only tried
    double longer; // the factor by which it would prolong ticks
    char text[INPUT_WHY_MAX];
} Answer;

enum {
    GATE_REPEAT_US = 4000000, // clients give up after 3 s
    GATE_ANSWERS = 2048,      // 500 requests per second for that time
    GATE_URGENT = 64,         // of them for urgent ones only
};

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
    bool used, pending, urgent;
    InputKind kind;
    int32_t sender, id;
    int64_t time_us; // of the request, then of its answer
    int64_t number;  // counts requests: the smallest is the oldest
} GateEntry;

typedef struct Gate {
    Sim *sim; // only its constant members are read
    int64_t timeout_us;
    ToolOwner *owner;              // [tool_count], of the arena
    int64_t now_us;                // of the newest message
    GateEntry entry[GATE_ANSWERS]; // admitted requests that may be repeated
    Answer answer[GATE_ANSWERS];   // of each, unless it is pending
    int64_t requests;
    int64_t refused[REFUSAL_COUNT];
    int64_t foreign[INPUT_KINDS]; // of REFUSED_TYPE, by channel
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
// as pending until gate_answer. While GATE_ANSWERS requests may be repeated, more are refused.
void gate_pass(Gate *gate, InputKind kind, const void *data, size_t size, int64_t now_us,
               GateResult *result);
// Stores the answer of a request, for repeats of the request.
void gate_answer(Gate *gate, const Answer *answer);
// Forgets a request that was admitted and then refused, so that a repeat is tried again.
void gate_forget(Gate *gate, const Input *input);
// Returns how many requests of a sender are pending, urgent or others.
int gate_pending(const Gate *gate, int32_t sender, bool urgent);
// Counts a refusal that was found later: a full queue, or a request that the scene cannot execute.
void gate_count(Gate *gate, Refusal refusal);
int64_t gate_refused(const Gate *gate);

#endif
