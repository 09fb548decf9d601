// What other programs ask of a running scene: poses, cuts, loads and commands as plain data of
// fixed size, decoded from raw bytes with every check made before generated code sees them. Pure
// functions: any thread but the step thread, which only reads finished Inputs.
#ifndef PLIANT_RUN_INPUT_H
#define PLIANT_RUN_INPUT_H

#include "dynamics/sim.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum InputKind { INPUT_POSE, INPUT_CUT, INPUT_LOAD, INPUT_COMMAND, INPUT_KINDS } InputKind;

// Why an input was refused; status_t.reason holds the names.
typedef enum Refusal {
    ACCEPTED,
    REFUSED_SIZE,         // raw length does not fit the type
    REFUSED_TYPE,         // fingerprint of another type
    REFUSED_STRING,       // string without its end, or with one inside
    REFUSED_NOT_FINITE,   // a NaN or an infinity
    REFUSED_QUATERNION,   // off unit length by more than 1e-3
    REFUSED_TOOL,         // unknown, or not moved by poses
    REFUSED_BODY,         // unknown
    REFUSED_RANGE,        // a value outside its range
    REFUSED_COMMAND,      // unknown kind, or an argument that it does not take
    REFUSED_OWNER,        // the tool belongs to another sender
    REFUSED_LATE,         // a pose that a newer one of its sender has overtaken
    REFUSED_STALE,        // a pose that waited while the daemon was stopped
    REFUSED_FULL,         // too many requests are waiting
    REFUSED_NOT_POSSIBLE, // well formed, but the scene cannot do it
    REFUSAL_COUNT
} Refusal;

enum { INPUT_TEXT_MAX = 128, INPUT_WIRE_MAX = 512, INPUT_WHY_MAX = 192 };

// The sender's values as they came, so that a log can hold them unchanged.
typedef struct Input {
    InputKind kind;
    int index;      // pose: of the tool; cut and load: of the body, -1 for all
    int32_t sender; // number drawn by the client
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
            int32_t lifts; // inactive poses of the tool that came before this one (the bus's count)
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
            double set_value[3]; // SET: the numbers behind "="
            int32_t set_count;   // 1 or 3
        } command;
    };
    char text[INPUT_TEXT_MAX]; // cut and load: name of the body; SET: the key; else the argument
} Input;

// "wrong_size", "not_finite", ...
const char *refusal_name(Refusal refusal);
// "TOOL_POSE", "CUT", "LOAD", "COMMAND": the channel after its prefix.
const char *input_channel(InputKind kind);
// Requests are answered; poses are not.
bool input_is_request(const Input *input);

// Bytes to Input: size, fingerprint and string are checked before anything is read. `why` gets a
// sentence of at most INPUT_WHY_MAX bytes when refused.
Refusal input_decode(InputKind kind, const void *data, size_t size, Input *input, char *why);
// Numbers, names and ranges against the scene; fills `index`. Reads only what is constant in `sim`.
Refusal input_validate(Input *input, Sim *sim, char *why);
// Input to bytes, such that decoding gives the same Input; returns the size, at most
// INPUT_WIRE_MAX.
size_t input_encode(const Input *input, void *data);

// The values as the simulation takes them. Valid inputs only.
ToolPose input_pose(const Input *input);
CutOptions input_cut(const Input *input);
LoadOptions input_load(const Input *input);

#endif
