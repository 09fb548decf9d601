// SPDX-License-Identifier: MIT
#include "run/input.h"

#include "base/check.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double POSITION_MAX = 1e3;  // [m]
static const double SPEED_MAX = 1e3;     // [m/s]
static const double SPIN_MAX = 1e4;      // [rad/s]
static const double FORCE_MAX = 1e6;     // [N]
static const double DURATION_MAX = 3600; // [s]
static const int64_t STEPS_MAX = 10000000;

static const char *const refusal_names[REFUSAL_COUNT] = {
    [ACCEPTED] = "accepted",
    [REFUSED_SIZE] = "wrong_size",
    [REFUSED_TYPE] = "wrong_type",
    [REFUSED_STRING] = "bad_string",
    [REFUSED_NOT_FINITE] = "not_finite",
    [REFUSED_QUATERNION] = "not_unit_quaternion",
    [REFUSED_TOOL] = "unknown_tool",
    [REFUSED_BODY] = "unknown_body",
    [REFUSED_RANGE] = "out_of_range",
    [REFUSED_COMMAND] = "unknown_command",
    [REFUSED_OWNER] = "tool_owned_by_other",
    [REFUSED_LATE] = "overtaken",
    [REFUSED_STALE] = "stale",
    [REFUSED_FULL] = "queue_full",
    [REFUSED_NOT_POSSIBLE] = "not_possible",
    [REFUSED_PACKET] = "not_a_packet",
    [REFUSED_FRAGMENT] = "fragment",
    [REFUSED_REMOTE] = "other_host",
    [REFUSED_SWITCHED_OFF] = "switched_off",
};

const char *refusal_name(Refusal refusal)
{
    return refusal_names[refusal];
}

#define REFUSE(refusal, ...) (snprintf(why, INPUT_WHY_MAX, __VA_ARGS__), (refusal))

// --- the wire ---

// What this file knows of each kind of input.
typedef struct InputType {
    const char *channel; // without its prefix
    const char *event;   // of a request that was executed; NULL: the command says
    size_t string;       // where the message has its last member, a string; 0: it has none
    int (*decode)(const void *data, int size, void *message);
    int (*encode)(void *data, int size, const void *message); // returns the size
    void (*clean)(void *message);                             // frees what decode allocated
    Refusal (*validate)(Input *input, Sim *sim, char *why);
} InputType;

// The generated functions of a type, for any message by its address.
#define WIRE(kind, member, type)                                                                   \
    static int decode_##type(const void *data, int size, void *message)                            \
    {                                                                                              \
        return pliant_##type##_decode(data, 0, size, message);                                     \
    }                                                                                              \
    static int encode_##type(void *data, int size, const void *message)                            \
    {                                                                                              \
        return pliant_##type##_encode(data, 0, size, message);                                     \
    }                                                                                              \
    static void clean_##type(void *message)                                                        \
    {                                                                                              \
        pliant_##type##_decode_cleanup(message);                                                   \
    }                                                                                              \
    _Static_assert(offsetof(pliant_##type, utime) == 0 && offsetof(pliant_##type, sender) == 8,    \
                   "every message begins alike");
INPUT_LIST(WIRE)

// Where the string of a message is.
static char **string_of(const InputType *type, void *message)
{
    return (char **)(void *)((char *)message + type->string);
}

static const char TRY[] = "try "; // before the text of a SET that is only to be tried

// SET was split into key and numbers: joins them again, as 17 digits, which read back as the same
// doubles.
static void join_setting(const Input *input, char *text, size_t size)
{
    const Setting *setting = &input->setting;
    int length = snprintf(text, size, "%s%s", setting->tries ? TRY : "", input->text);
    for (int i = 0; i < setting->count; i++)
        length += snprintf(text + length, size - (size_t)length, "%s%.17g", i == 0 ? "= " : " ",
                           setting->value[i]);
}

// --- the values ---

static bool all_finite(const double *value, int count)
{
    for (int i = 0; i < count; i++)
        if (!isfinite(value[i]))
            return false;
    return true;
}

static bool all_within(const double *value, int count, double limit)
{
    for (int i = 0; i < count; i++)
        if (!(fabs(value[i]) <= limit))
            return false;
    return true;
}

static Refusal check_pose(Input *input, Sim *sim, char *why)
{
    // The tool must exist and be moved by poses.
    int tool = input->pose.tool;
    for (int i = 0; i < sim_tool_count(sim); i++)
        if (sim_tool(sim, i)->id == tool)
            input->index = i;
    if (input->index < 0)
        return REFUSE(REFUSED_TOOL, "pose of tool %d, which is not in the scene", tool);
    if (sim_tool(sim, input->index)->kind == TOOL_STATIC)
        return REFUSE(REFUSED_TOOL, "pose of tool %d, which is static", tool);

    // Finite numbers first, then their ranges; the comparisons below rely on it.
    const double *q = input->pose.orientation;
    if (!all_finite(input->pose.position, 3) || !all_finite(q, 4) ||
        !all_finite(input->pose.twist, 6) || !isfinite(input->pose.grip))
        return REFUSE(REFUSED_NOT_FINITE, "pose of tool %d holds a number that is not finite",
                      tool);
    // Ranges that no sensible client leaves.
    if (!all_within(input->pose.position, 3, POSITION_MAX))
        return REFUSE(REFUSED_RANGE, "pose of tool %d is farther than %g m from the origin", tool,
                      POSITION_MAX);
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(fabs(length - 1.0) <= 1e-3))
        return REFUSE(REFUSED_QUATERNION, "orientation of tool %d has length %g, not 1 within 1e-3",
                      tool, length);
    if (!all_within(input->pose.twist, 3, SPEED_MAX) ||
        !all_within(input->pose.twist + 3, 3, SPIN_MAX))
        return REFUSE(REFUSED_RANGE, "twist of tool %d is beyond %g m/s or %g rad/s", tool,
                      SPEED_MAX, SPIN_MAX);
    if (!(input->pose.grip >= 0.0 && input->pose.grip <= 1.0))
        return REFUSE(REFUSED_RANGE, "grip %g of tool %d outside [0, 1]", input->pose.grip, tool);
    return ACCEPTED;
}

// "" means all bodies. The message shows the name truncated and without control characters.
static Refusal find_body(Input *input, Sim *sim, char *why)
{
    input->index = -1;
    if (input->text[0] == '\0')
        return ACCEPTED;
    // By name: an index is for this run only.
    for (int i = 0; i < sim_body_count(sim); i++)
        if (strcmp(sim_body(sim, i)->name, input->text) == 0)
            input->index = i;
    if (input->index >= 0)
        return ACCEPTED;
    // The name goes into a sentence: print what can be printed.
    for (char *c = input->text; *c != '\0'; c++)
        if (*c < ' ' || *c > '~')
            *c = '?';
    return REFUSE(REFUSED_BODY, "body '%.40s' is not in the scene", input->text);
}

static Refusal check_cut(Input *input, Sim *sim, char *why)
{
    if (!all_finite(&input->cut.before[0][0], 6) || !all_finite(&input->cut.after[0][0], 6))
        return REFUSE(REFUSED_NOT_FINITE, "cut holds a number that is not finite");
    if (!all_within(&input->cut.before[0][0], 6, POSITION_MAX) ||
        !all_within(&input->cut.after[0][0], 6, POSITION_MAX))
        return REFUSE(REFUSED_RANGE, "cut is farther than %g m from the origin", POSITION_MAX);
    return find_body(input, sim, why);
}

static Refusal check_load(Input *input, Sim *sim, char *why)
{
    if (!all_finite(input->load.center, 3) || !all_finite(input->load.force, 3) ||
        !isfinite(input->load.radius) || !isfinite(input->load.duration))
        return REFUSE(REFUSED_NOT_FINITE, "load holds a number that is not finite");
    // Where it may act, and how strongly.
    if (!all_within(input->load.center, 3, POSITION_MAX))
        return REFUSE(REFUSED_RANGE, "load is farther than %g m from the origin", POSITION_MAX);
    if (!(input->load.radius > 0.0 && input->load.radius <= POSITION_MAX))
        return REFUSE(REFUSED_RANGE, "load radius %g outside (0, %g] m", input->load.radius,
                      POSITION_MAX);
    const double *f = input->load.force;
    if (!(sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]) <= FORCE_MAX))
        return REFUSE(REFUSED_RANGE, "load force beyond %g N", FORCE_MAX);
    // For a time that ends.
    if (!(input->load.duration > 0.0 && input->load.duration <= DURATION_MAX))
        return REFUSE(REFUSED_RANGE, "load duration %g outside (0, %g] s", input->load.duration,
                      DURATION_MAX);
    return find_body(input, sim, why);
}

// Finds the other body of a tie. CLIP may have none: two walls of one body.
static Refusal find_other_body(Input *input, Sim *sim, char *why)
{
    const char *name = (const char *)input->tie.to_body;
    if (memchr(name, 0, BODY_NAME_MAX) == NULL)
        return REFUSE(REFUSED_STRING, "to_body of a tie does not end within its %d bytes",
                      BODY_NAME_MAX);
    if (name[0] == '\0' && input->tie.kind == PLIANT_TIE_T_CLIP) {
        input->to_body_index = input->index;
        return ACCEPTED;
    }
    // By name, as the body itself.
    for (int i = 0; i < sim_body_count(sim); i++)
        if (strcmp(sim_body(sim, i)->name, name) == 0)
            input->to_body_index = i;
    if (input->to_body_index == input->index && input->tie.kind == PLIANT_TIE_T_TIE)
        return REFUSE(REFUSED_BODY, "to_body '%s' of a tie is the body itself",
                      sim_body(sim, input->index)->name);
    return input->to_body_index >= 0 ? ACCEPTED
                                     : REFUSE(REFUSED_BODY, "to_body of a tie is not in the scene");
}

// Checks what MAKE ties to what.
static Refusal check_new_tie(Input *input, Sim *sim, char *why)
{
    // Which body, which must be one.
    Refusal refusal = find_body(input, sim, why);
    if (refusal != ACCEPTED)
        return refusal;
    if (input->index < 0 && sim_body_count(sim) > 1)
        return REFUSE(REFUSED_BODY, "body of a tie: name one of the %d", sim_body_count(sim));
    input->index = input->index < 0 ? 0 : input->index;
    // Which of its nodes.
    const int count = input->tie.node_count;
    if (count < 0 || count > TIE_IDS)
        return REFUSE(REFUSED_RANGE, "node_count %d of a tie outside [0, %d]", count, TIE_IDS);
    if (!all_finite(input->tie.center, 3) || !isfinite(input->tie.radius))
        return REFUSE(REFUSED_NOT_FINITE, "center or radius of a tie is not finite");
    if (count == 0 && !all_within(input->tie.center, 3, POSITION_MAX))
        return REFUSE(REFUSED_RANGE, "center of a tie is farther than %g m from the origin",
                      POSITION_MAX);
    if (count == 0 && !(input->tie.radius > 0.0 && input->tie.radius <= POSITION_MAX))
        return REFUSE(REFUSED_RANGE, "radius %g of a tie outside (0, %g] m", input->tie.radius,
                      POSITION_MAX);
    // To what.
    if (input->tie.kind == PLIANT_TIE_T_TIE || input->tie.kind == PLIANT_TIE_T_CLIP)
        return find_other_body(input, sim, why);
    if (input->tie.kind != PLIANT_TIE_T_PIN && input->tie.kind != PLIANT_TIE_T_CARRY)
        return REFUSE(REFUSED_COMMAND, "kind %d of a tie is unknown", input->tie.kind);
    for (int i = 0; i < sim_tool_count(sim) && input->tie.kind == PLIANT_TIE_T_CARRY; i++)
        if (sim_tool(sim, i)->id == input->tie.tool)
            input->tool_index = i;
    if (input->tie.kind == PLIANT_TIE_T_CARRY && input->tool_index < 0)
        return REFUSE(REFUSED_TOOL, "tool %d of a tie is not in the scene", input->tie.tool);
    return ACCEPTED;
}

static Refusal check_tie(Input *input, Sim *sim, char *why)
{
    input->tool_index = input->to_body_index = -1;
    const int32_t action = input->tie.action;
    // Is it one, and is there room for any?
    if (action != PLIANT_TIE_T_MAKE && action != PLIANT_TIE_T_CHANGE &&
        action != PLIANT_TIE_T_RELEASE)
        return REFUSE(REFUSED_COMMAND, "action %d of a tie is unknown", action);
    if (sim_tie_capacity(sim) == 0)
        return REFUSE(REFUSED_NOT_POSSIBLE, "this scene has no ties by message (max_ties)");
    if (input->tie.tie < (action == PLIANT_TIE_T_MAKE ? 0 : 1))
        return REFUSE(REFUSED_RANGE, "tie %d: numbers begin with 1", input->tie.tie);
    if (action == PLIANT_TIE_T_RELEASE)
        return ACCEPTED;
    // Its springs.
    const double g = input->tie.stiffness, zeta = input->tie.damping_ratio,
                 most = input->tie.break_force;
    if (!isfinite(g) || !isfinite(zeta) || !isfinite(most))
        return REFUSE(REFUSED_NOT_FINITE,
                      "stiffness, damping_ratio or break_force of a tie is not finite");
    if (!(g > 0.0 && g <= TIE_STIFFNESS_MOST))
        return REFUSE(REFUSED_RANGE, "stiffness %g of a tie outside (0, %g]", g,
                      TIE_STIFFNESS_MOST);
    if (!(zeta >= 0.0 && zeta <= TIE_DAMPING_MOST))
        return REFUSE(REFUSED_RANGE, "damping_ratio %g of a tie outside [0, %g]", zeta,
                      TIE_DAMPING_MOST);
    if (!(most >= 0.0 && most <= FORCE_MAX))
        return REFUSE(REFUSED_RANGE, "break_force %g of a tie outside [0, %g] N", most, FORCE_MAX);
    return action == PLIANT_TIE_T_MAKE ? check_new_tie(input, sim, why) : ACCEPTED;
}

// Whether a key leaves space for its numbers, of at most 25 bytes each, when it is written back as
// text.
static Refusal check_key(size_t length, int count, char *why)
{
    const size_t most = INPUT_TEXT_MAX - strlen(TRY) - (size_t)(25 * count) - 2; // "=" and the end
    return length <= most ? ACCEPTED
                          : REFUSE(REFUSED_COMMAND, "SET with a key longer than %zu bytes", most);
}

// Splits "key=value" into the key, left in `text`, and the numbers; a "try " goes first.
static Refusal split_setting(Input *input, char *why)
{
    const size_t word = strlen(TRY);
    input->setting.tries = strncmp(input->text, TRY, word) == 0;
    if (input->setting.tries)
        memmove(input->text, input->text + word, strlen(input->text + word) + 1);
    char *equals = strchr(input->text, '=');
    input->setting.count = 0;
    // A key alone: what is it now?
    if (input->setting.tries && equals == NULL && input->text[0] != '\0')
        return check_key(strlen(input->text), 0, why);
    if (equals == NULL || equals == input->text)
        return REFUSE(REFUSED_COMMAND, "SET wants \"key=number\"");
    // Accepts one number, or a vector of three: "0 0 -9.81", "0, 0, -9.81" or "[0, 0, -9.81]".
    static const char between[] = " ,[]";
    double value[3] = {0.0, 0.0, 0.0};
    int count = 0;
    const char *at = equals + 1;
    for (at += strspn(at, between); *at != '\0'; at += strspn(at, between)) {
        char *end;
        double number = strtod(at, &end);
        if (end == at || count == 3)
            return REFUSE(REFUSED_COMMAND, "SET wants \"key=number\" or three numbers");
        if (!isfinite(number))
            return REFUSE(REFUSED_NOT_FINITE, "SET to a number that is not finite");
        value[count++] = number;
        at = end;
    }
    if (count != 1 && count != 3)
        return REFUSE(REFUSED_COMMAND, "SET wants \"key=number\" or three numbers");
    const Refusal refusal = check_key((size_t)(equals - input->text), count, why);
    if (refusal != ACCEPTED)
        return refusal;
    *equals = '\0';
    memcpy(input->setting.value, value, sizeof value);
    input->setting.count = count;
    return ACCEPTED;
}

static Refusal check_command(Input *input, Sim *sim, char *why)
{
    (void)sim;
    switch (input->command.kind) {
    case PLIANT_COMMAND_T_STEP:
        if (input->command.value < 1 || input->command.value > STEPS_MAX)
            return REFUSE(REFUSED_RANGE, "STEP %lld outside [1, %lld]",
                          (long long)input->command.value, (long long)STEPS_MAX);
        return ACCEPTED;
    case PLIANT_COMMAND_T_CHECKPOINT:
        if (input->text[0] != '\0')
            return REFUSE(REFUSED_COMMAND,
                          "CHECKPOINT takes no argument: the file is given on the command line");
        return ACCEPTED;
    case PLIANT_COMMAND_T_SET:
        return split_setting(input, why);
    case PLIANT_COMMAND_T_PAUSE:
    case PLIANT_COMMAND_T_RESUME:
    case PLIANT_COMMAND_T_RESET:
    case PLIANT_COMMAND_T_DESCRIBE:
    case PLIANT_COMMAND_T_STOP:
        return ACCEPTED;
    default:
        return REFUSE(REFUSED_COMMAND, "command of unknown kind %d", input->command.kind);
    }
}

_Static_assert(sizeof((pliant_tie_t *)NULL)->to_body == BODY_NAME_MAX, "a name fits");
_Static_assert(sizeof((pliant_tie_t *)NULL)->node == TIE_IDS * sizeof(int32_t), "its ids");

// --- all kinds ---

#define GENERATED(type) decode_##type, encode_##type, clean_##type

static const InputType TYPES[INPUT_KINDS] = {
    [INPUT_POSE] = {"TOOL_POSE", NULL, 0, GENERATED(tool_pose_t), check_pose},
    [INPUT_CUT] = {"CUT", "cut", offsetof(pliant_cut_t, body), GENERATED(cut_t), check_cut},
    [INPUT_LOAD] = {"LOAD", "load", offsetof(pliant_load_t, body), GENERATED(load_t), check_load},
    [INPUT_COMMAND] = {"COMMAND", NULL, offsetof(pliant_command_t, argument), GENERATED(command_t),
                       check_command},
    [INPUT_TIE] = {"TIE", "tie", offsetof(pliant_tie_t, body), GENERATED(tie_t), check_tie},
};

const char *input_foreign_name(InputKind kind)
{
#define FOREIGN_NAME(kind, member, type) [INPUT_##kind] = "wrong_type_" #type,
    static const char *const names[INPUT_KINDS] = {INPUT_LIST(FOREIGN_NAME)};
    return names[kind];
}

const char *input_channel(InputKind kind)
{
    return TYPES[kind].channel;
}

bool input_is_request(const Input *input)
{
    return input->kind != INPUT_POSE;
}

bool input_is_urgent(InputKind kind, int32_t command)
{
    return kind == INPUT_COMMAND &&
           (command == PLIANT_COMMAND_T_PAUSE || command == PLIANT_COMMAND_T_STOP);
}

const char *input_event(const Input *input)
{
    const char *event = TYPES[input->kind].event;
    return event != NULL ? event : input->command.kind == PLIANT_COMMAND_T_SET ? "set" : "reset";
}

static uint64_t read_big_endian(const unsigned char *byte, int count)
{
    uint64_t value = 0;
    for (int i = 0; i < count; i++)
        value = value << 8 | byte[i];
    return value;
}

// The generated decoder trusts counts: a corrupt one makes it read or copy out of bounds. The raw
// length must therefore match the type and its only string before the decoder runs.
static Refusal check_wire(InputKind kind, const unsigned char *data, size_t size, char *why)
{
    // An empty message tells fingerprint and size.
    const InputType *type = &TYPES[kind];
    unsigned char empty[INPUT_WIRE_MAX];
    const size_t whole = input_encode(&(Input){.kind = kind}, empty);
    // Is it this type, as far as its first bytes tell?
    if (size < 8)
        return REFUSE(REFUSED_SIZE, "%s of %zu bytes, shorter than a fingerprint", type->channel,
                      size);
    if (memcmp(data, empty, 8) != 0)
        return REFUSE(REFUSED_TYPE,
                      "%s with the fingerprint of another type: its sender is of another version "
                      "than pliantd " PLIANT_VERSION,
                      type->channel);
    // Without a string the size is fixed.
    if (type->string == 0)
        return size == whole
                   ? ACCEPTED
                   : REFUSE(REFUSED_SIZE, "%s of %zu bytes, not %zu", type->channel, size, whole);

    // The string is last: its stated length must be what is left, with one NUL at the end.
    if (size < whole)
        return REFUSE(REFUSED_SIZE, "%s of %zu bytes, at least %zu needed", type->channel, size,
                      whole);
    const unsigned char *string = data + whole - 1;
    size_t length = size - (whole - 1); // with the closing NUL
    uint64_t stated = read_big_endian(string - 4, 4);
    if (stated != length)
        return REFUSE(REFUSED_SIZE, "%s whose string states %llu bytes and has %zu", type->channel,
                      (unsigned long long)stated, length);
    if (length > INPUT_TEXT_MAX)
        return REFUSE(REFUSED_STRING, "%s with a string of %zu bytes, at most %d", type->channel,
                      length, INPUT_TEXT_MAX);
    if (memchr(string, 0, length) != data + size - 1)
        return REFUSE(REFUSED_STRING, "%s whose string does not end at its last byte",
                      type->channel);
    return ACCEPTED;
}

Refusal input_decode(InputKind kind, const void *data, size_t size, Input *input, char *why)
{
    *input = (Input){.kind = kind, .index = -1};
    const InputType *type = &TYPES[kind];
    const Refusal refusal = check_wire(kind, data, size, why);
    if (refusal != ACCEPTED)
        return refusal;
    const int used = type->decode(data, (int)size, &input->pose);
    ASSERT(used == (int)size);
    // The string stays in `text`; what was decoded to the heap is freed.
    if (type->string > 0)
        snprintf(input->text, sizeof input->text, "%s", *string_of(type, &input->pose));
    type->clean(&input->pose);
    if (type->string > 0)
        *string_of(type, &input->pose) = NULL;
    return ACCEPTED;
}

size_t input_encode(const Input *input, void *data)
{
    const InputType *type = &TYPES[input->kind];
    Input copy = *input;
    char text[2 * INPUT_TEXT_MAX];
    if (type->string > 0)
        *string_of(type, &copy.pose) = copy.text;
    if (copy.kind == INPUT_COMMAND && copy.command.kind == PLIANT_COMMAND_T_SET) {
        join_setting(input, text, sizeof text);
        copy.command.argument = text;
    }
    const int size = type->encode(data, INPUT_WIRE_MAX, &copy.pose);
    ASSERT(size > 0);
    return (size_t)size;
}

Refusal input_check(Input *input, Sim *sim, char *why)
{
    return TYPES[input->kind].validate(input, sim, why);
}

// --- conversion to the simulation's types ---

static Vec3 vec3_of(const double v[3])
{
    return vec3(v[0], v[1], v[2]);
}

ToolPose input_pose(const Input *input)
{
    const double *q = input->pose.orientation;
    return (ToolPose){.utime = input->utime,
                      .position = vec3_of(input->pose.position),
                      .orientation = quat_unit((Quat){q[0], q[1], q[2], q[3]}),
                      .linear = vec3_of(input->pose.twist),
                      .angular = vec3_of(input->pose.twist + 3),
                      .twist_valid = input->pose.twist_valid,
                      .active = input->pose.active,
                      .grip = input->pose.grip};
}

CutOptions input_cut(const Input *input)
{
    CutOptions cut = {.body = input->index};
    for (int k = 0; k < 2; k++) {
        cut.before.end[k] = vec3_of(input->cut.before[k]);
        cut.after.end[k] = vec3_of(input->cut.after[k]);
    }
    return cut;
}

LoadOptions input_load(const Input *input)
{
    return (LoadOptions){.body = input->index,
                         .center = vec3_of(input->load.center),
                         .radius = input->load.radius,
                         .force = vec3_of(input->load.force),
                         .duration = input->load.duration,
                         .sender = input->sender,
                         .id = input->id};
}

_Static_assert((int)TIE_MAKE == PLIANT_TIE_T_MAKE && (int)TIE_CHANGE == PLIANT_TIE_T_CHANGE &&
                   (int)TIE_RELEASE == PLIANT_TIE_T_RELEASE && (int)TIE_PIN == PLIANT_TIE_T_PIN &&
                   (int)TIE_BODIES == PLIANT_TIE_T_TIE && (int)TIE_CLIP == PLIANT_TIE_T_CLIP &&
                   (int)TIE_CARRY == PLIANT_TIE_T_CARRY,
               "the numbers of the message");

TieOptions input_tie(const Input *input)
{
    TieOptions tie = {.action = (TieAction)input->tie.action,
                      .kind = (TieKind)input->tie.kind,
                      .number = input->tie.tie,
                      .body = input->index,
                      .to_body = input->to_body_index,
                      .tool = input->tool_index,
                      .node_count = input->tie.node_count,
                      .center = vec3_of(input->tie.center),
                      .radius = input->tie.radius,
                      .stiffness = input->tie.stiffness,
                      .damping_ratio = input->tie.damping_ratio,
                      .break_force = input->tie.break_force};
    for (int i = 0; i < TIE_IDS; i++)
        tie.node[i] = input->tie.node[i];
    return tie;
}
