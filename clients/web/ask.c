// Requests of a page: JSON text to plain numbers, all of them validated. Pure functions, any
// thread.
#include "ask.h"

#include <math.h>
#include <string.h>

#include <jansson.h>

#include "pliant_command_t.h"

// The daemon's own limits.
static const double POSITION_MAX = 1e3; // [m]
static const double FORCE_MAX = 1e6;    // [N]
static const double DURATION_MAX = 3600.0;
static const double STEPS_MAX = 1e7;
static const double UNIT_SLACK = 1e-3; // tolerance of a quaternion's length

// --- numbers ---

static bool take_number(const json_t *value, const char *name, double low, double high, double *out,
                        ClientError *error)
{
    double number = json_number_value(value);
    if (!json_is_number(value) || !isfinite(number) || number < low || number > high)
        return client_fail(error, "%s: expected a number in [%g, %g]", name, low, high);
    *out = number;
    return true;
}

static bool take_integer(const json_t *object, const char *name, int64_t low, int64_t high,
                         int64_t *out, ClientError *error)
{
    const json_t *value = json_object_get(object, name);
    json_int_t number = json_integer_value(value);
    if (!json_is_integer(value) || number < low || number > high)
        return client_fail(error, "%s: expected an integer in [%lld, %lld]", name, (long long)low,
                           (long long)high);
    *out = number;
    return true;
}

static bool take_vector(const json_t *array, const char *name, size_t count, double limit,
                        double *out, ClientError *error)
{
    if (!json_is_array(array) || json_array_size(array) != count)
        return client_fail(error, "%s: expected %zu numbers", name, count);
    for (size_t k = 0; k < count; k++) {
        if (!take_number(json_array_get(array, k), name, -limit, limit, out + k, error))
            return false;
    }
    return true;
}

static bool take_edge(const json_t *object, const char *name, double out[2][3], ClientError *error)
{
    const json_t *array = json_object_get(object, name);
    if (!json_is_array(array) || json_array_size(array) != 2)
        return client_fail(error, "%s: expected two points", name);
    return take_vector(json_array_get(array, 0), name, 3, POSITION_MAX, out[0], error) &&
           take_vector(json_array_get(array, 1), name, 3, POSITION_MAX, out[1], error);
}

static bool take_id(const json_t *object, Ask *ask, ClientError *error)
{
    int64_t id = 0;
    if (!take_integer(object, "id", 0, INT32_MAX, &id, error))
        return false;
    ask->id = (int32_t)id;
    return true;
}

// Reads an optional string: "" if missing.
static bool take_text(const json_t *object, const char *name, char out[ASK_TEXT_MAX],
                      ClientError *error)
{
    const json_t *value = json_object_get(object, name);
    if (!value)
        return true;
    const char *text = json_string_value(value);
    if (!text || strlen(text) >= ASK_TEXT_MAX)
        return client_fail(error, "%s: expected a text of less than %d bytes", name, ASK_TEXT_MAX);
    for (const char *c = text; *c; c++) {
        if ((unsigned char)*c < 0x20 || (unsigned char)*c > 0x7e)
            return client_fail(error, "%s: expected printable ASCII", name);
    }
    strcpy(out, text);
    return true;
}

static bool take_body(const json_t *object, Ask *ask, ClientError *error)
{
    if (!take_text(object, "body", ask->text, error))
        return false;
    if (ask->text[0] && !client_name_valid(ask->text, 31))
        return client_fail(error, "body: expected the name of a body, or \"\" for all");
    return true;
}

// --- messages ---

static bool take_drawn(const json_t *object, Ask *ask, ClientError *error)
{
    ask->kind = ASK_DRAWN;
    return take_integer(object, "round", 0, INT64_MAX, &ask->round, error);
}

static bool take_tool(const json_t *object, Ask *ask, ClientError *error)
{
    ask->kind = ASK_TOOL;
    int64_t tool = 0;
    const json_t *active = json_object_get(object, "active");
    const json_t *grip = json_object_get(object, "grip");
    if (!take_integer(object, "tool", 0, INT32_MAX, &tool, error) ||
        !take_vector(json_object_get(object, "position"), "position", 3, POSITION_MAX,
                     ask->pose.position, error) ||
        !take_vector(json_object_get(object, "orientation"), "orientation", 4, 1.0 + UNIT_SLACK,
                     ask->pose.orientation, error))
        return false;
    if (grip && !take_number(grip, "grip", 0.0, 1.0, &ask->pose.grip, error))
        return false;
    if (!json_is_boolean(active))
        return client_fail(error, "active: expected true or false");
    double *q = ask->pose.orientation, length = 0.0;
    for (int k = 0; k < 4; k++)
        length += q[k] * q[k];
    length = sqrt(length);
    if (!(fabs(length - 1.0) <= UNIT_SLACK))
        return client_fail(error, "orientation: length %g, expected a unit quaternion w x y z",
                           length);
    for (int k = 0; k < 4; k++)
        q[k] /= length;
    ask->pose.tool = (int32_t)tool;
    ask->pose.active = json_is_true(active);
    return true;
}

static bool take_cut(const json_t *object, Ask *ask, ClientError *error)
{
    ask->kind = ASK_CUT;
    return take_id(object, ask, error) && take_body(object, ask, error) &&
           take_edge(object, "before", ask->cut.before, error) &&
           take_edge(object, "after", ask->cut.after, error);
}

static bool take_load(const json_t *object, Ask *ask, ClientError *error)
{
    ask->kind = ASK_LOAD;
    return take_id(object, ask, error) && take_body(object, ask, error) &&
           take_vector(json_object_get(object, "center"), "center", 3, POSITION_MAX,
                       ask->load.center, error) &&
           take_vector(json_object_get(object, "force"), "force", 3, FORCE_MAX, ask->load.force,
                       error) &&
           take_number(json_object_get(object, "radius"), "radius", 1e-9, POSITION_MAX,
                       &ask->load.radius, error) &&
           take_number(json_object_get(object, "duration"), "duration", 0.0, DURATION_MAX,
                       &ask->load.duration, error);
}

static bool take_command(const json_t *object, Ask *ask, ClientError *error)
{
    static const struct {
        const char *name;
        int32_t kind;
    } kinds[] = {
        {"pause", PLIANT_COMMAND_T_PAUSE},
        {"resume", PLIANT_COMMAND_T_RESUME},
        {"step", PLIANT_COMMAND_T_STEP},
        {"reset", PLIANT_COMMAND_T_RESET},
        {"checkpoint", PLIANT_COMMAND_T_CHECKPOINT},
        {"describe", PLIANT_COMMAND_T_DESCRIBE},
        {"set", PLIANT_COMMAND_T_SET},
        {"stop", PLIANT_COMMAND_T_STOP},
    };
    ask->kind = ASK_COMMAND;
    if (!take_id(object, ask, error) || !take_text(object, "argument", ask->text, error))
        return false;
    if (json_object_get(object, "value")) { // for `step`; optional
        double value = 0.0;
        if (!take_number(json_object_get(object, "value"), "value", 0.0, STEPS_MAX, &value, error))
            return false;
        ask->command.value = (int64_t)value;
    }
    const char *kind = json_string_value(json_object_get(object, "kind"));
    for (size_t k = 0; kind && k < sizeof kinds / sizeof *kinds; k++) {
        if (strcmp(kind, kinds[k].name) == 0) {
            ask->command.kind = kinds[k].kind;
            return true;
        }
    }
    char words[128] = "";
    for (size_t k = 0, length = 0; k < sizeof kinds / sizeof *kinds && length < sizeof words; k++)
        length += (size_t)snprintf(words + length, sizeof words - length, "%s%s", k > 0 ? ", " : "",
                                   kinds[k].name);
    return client_fail(error, "kind: expected one of %s", words);
}

static bool take_message(const json_t *object, Ask *ask, ClientError *error)
{
    static const struct {
        const char *type;
        bool (*take)(const json_t *, Ask *, ClientError *);
    } types[] = {{"drawn", take_drawn},
                 {"tool", take_tool},
                 {"cut", take_cut},
                 {"load", take_load},
                 {"command", take_command}};
    const char *type = json_string_value(json_object_get(object, "type"));
    for (size_t k = 0; type && k < sizeof types / sizeof *types; k++) {
        if (strcmp(type, types[k].type) != 0)
            continue;
        ClientError why;
        return types[k].take(object, ask, &why) || client_fail(error, "%s: %s", type, why.text);
    }
    return client_fail(error, "type: expected drawn, tool, cut, load or command");
}

bool ask_parse(const char *text, size_t size, Ask *ask, ClientError *error)
{
    *ask = (Ask){0};
    if (size > ASK_BYTES_MAX)
        return client_fail(error, "a message of %zu bytes, more than %d", size, ASK_BYTES_MAX);
    json_error_t where;
    json_t *object = json_loadb(text, size, JSON_REJECT_DUPLICATES, &where);
    if (!object)
        return client_fail(error, "not JSON: %s", where.text);
    bool ok = json_is_object(object) ? take_message(object, ask, error)
                                     : client_fail(error, "expected a JSON object");
    json_decref(object);
    return ok;
}
