// Inputs from other programs (poses, cuts, loads and commands) as plain data of fixed size. They
// are decoded from raw bytes, and every check comes before generated code reads them. Pure
// functions for any thread but the step thread, which only reads finished Inputs.
#ifndef PLIANT_RUN_INPUT_H
#define PLIANT_RUN_INPUT_H

#include "dynamics/sim.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum InputKind { INPUT_POSE, INPUT_CUT, INPUT_LOAD, INPUT_COMMAND, INPUT_KINDS } InputKind;

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

// The sender's values, unchanged, so that a log can store them as they came.
typedef struct Input {
    InputKind kind;
    int index;      // pose: of the tool; request: of the body, -1 for all or none
    int32_t sender; // random number drawn by the client
    int32_t id;     // of a request; the sequence of a pose
    int64_t utime;  // sender's clock [us]
    union {
        struct {
            int32_t tool;          // id in the scene
            double position[3];    // [m]
            double orientation[4]; // w x y z, nearly unit
            double twist[6];       // [m/s], [rad/s]
            double grip;
            bool twist_valid, active;
            int32_t lifts; // inactive poses of the tool before this one (counted by the bus)
        } pose;
        struct {
            double before[2][3], after[2][3]; // [m]
        } cut;
        struct {
            double center[3]; // [m]
            double radius;    // [m]
            double force[3];  // [N]
            double duration;  // [s]
        } load;
        struct {
            int32_t kind; // PLIANT_COMMAND_T_...
            int64_t value;
            double set_value[3]; // SET: the numbers after "="
            int32_t set_count;   // 1 or 3
        } command;
    };
    char text[INPUT_TEXT_MAX]; // cut and load: name of the body; SET: the key; else the argument
} Input;

// Returns "wrong_size", "not_finite" and so on.
const char *refusal_name(Refusal refusal);
// Returns the channel without its prefix: "TOOL_POSE", "CUT", "LOAD", "COMMAND".
const char *input_channel(InputKind kind);
// True if the input is a request, which is answered; poses are not.
bool input_is_request(const Input *input);
// Returns the kind of the event that tells of a request executed on the scene: "cut", "load",
// "set", "reset".
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

#endif
