// SPDX-License-Identifier: MIT
// Requests of pages: read from their JSON, and sent to the daemon.
#include "requests.h"

#include "texts.h"

#include "pliant_command_t.h"
#include "pliant_cut_t.h"
#include "pliant_load_t.h"
#include "pliant_tie_t.h"
#include "pliant_tool_pose_t.h"

#include <jansson.h>
#include <math.h>
#include <string.h>

// --- as a page sends them: every value is checked; pure functions, any thread --------------------

// The daemon's own limits.
static const double POSITION_MAX = 1e3; // [m]
static const double FORCE_MAX = 1e6;    // [N]
static const double DURATION_MAX = 3600.0;
static const double STEPS_MAX = 1e7;
static const double TIME_MAX = 1e9;    // [s]
static const double UNIT_SLACK = 1e-3; // tolerance of a quaternion's length

// --- numbers ---

static bool take_number(const json_t *value, const char *name, double low, double high, double *out,
                        PliantError *error)
{
    double number = json_number_value(value);
    if (!json_is_number(value) || !isfinite(number) || number < low || number > high)
        return client_fail(error, "%s: expected a number in [%g, %g]", name, low, high);
    *out = number;
    return true;
}

static bool take_integer(const json_t *object, const char *name, int64_t low, int64_t high,
                         int64_t *out, PliantError *error)
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
                        double *out, PliantError *error)
{
    if (!json_is_array(array) || json_array_size(array) != count)
        return client_fail(error, "%s: expected %zu numbers", name, count);
    for (size_t k = 0; k < count; k++) {
        if (!take_number(json_array_get(array, k), name, -limit, limit, out + k, error))
            return false;
    }
    return true;
}

static bool take_edge(const json_t *object, const char *name, double out[2][3], PliantError *error)
{
    const json_t *array = json_object_get(object, name);
    if (!json_is_array(array) || json_array_size(array) != 2)
        return client_fail(error, "%s: expected two points", name);
    return take_vector(json_array_get(array, 0), name, 3, POSITION_MAX, out[0], error) &&
           take_vector(json_array_get(array, 1), name, 3, POSITION_MAX, out[1], error);
}

static bool take_id(const json_t *object, Ask *ask, PliantError *error)
{
    int64_t id = 0;
    if (!take_integer(object, "id", 0, INT32_MAX, &id, error))
        return false;
    ask->id = (int32_t)id;
    return true;
}

// Reads an optional string: "" if missing.
static bool take_text(const json_t *object, const char *name, char out[ASK_TEXT_MAX],
                      PliantError *error)
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

static bool take_body(const json_t *object, Ask *ask, PliantError *error)
{
    if (!take_text(object, "body", ask->text, error))
        return false;
    if (ask->text[0] && !argument_is_name(ask->text, ARGUMENT_NAME_MOST))
        return client_fail(error, "body: expected the name of a body, or \"\" for all");
    return true;
}

// --- messages ---

static bool take_drawn(const json_t *object, Ask *ask, PliantError *error)
{
    ask->kind = ASK_DRAWN;
    return take_integer(object, "round", 0, INT64_MAX, &ask->round, error);
}

static bool take_tool(const json_t *object, Ask *ask, PliantError *error)
{
    ask->kind = ASK_TOOL;
    int64_t tool = 0;
    const json_t *active = json_object_get(object, "active");
    const json_t *grip = json_object_get(object, "grip");
    // Which tool, where, and how it is turned.
    if (!take_integer(object, "tool", 0, INT32_MAX, &tool, error) ||
        !take_vector(json_object_get(object, "position"), "position", 3, POSITION_MAX,
                     ask->pose.position, error) ||
        !take_vector(json_object_get(object, "orientation"), "orientation", 4, 1.0 + UNIT_SLACK,
                     ask->pose.orientation, error))
        return false;
    // The grip is for graspers.
    if (grip && !take_number(grip, "grip", 0.0, 1.0, &ask->pose.grip, error))
        return false;
    if (!json_is_boolean(active))
        return client_fail(error, "active: expected true or false");
    const json_t *time = json_object_get(object, "time");
    ask->pose.time = -1.0;
    if (time && !take_number(time, "time", 0.0, TIME_MAX, &ask->pose.time, error))
        return false;
    // Slightly off is put right; more is an error of the page.
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

static bool take_cut(const json_t *object, Ask *ask, PliantError *error)
{
    ask->kind = ASK_CUT;
    return take_id(object, ask, error) && take_body(object, ask, error) &&
           take_edge(object, "before", ask->cut.before, error) &&
           take_edge(object, "after", ask->cut.after, error);
}

static bool take_load(const json_t *object, Ask *ask, PliantError *error)
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

// Finds a word in a list that begins with 1; NULL ends it.
static bool take_word(const json_t *object, const char *name, const char *const *words,
                      int32_t *out, PliantError *error)
{
    const char *word = json_string_value(json_object_get(object, name));
    char list[128] = "";
    for (int32_t k = 1; words[k]; k++) {
        if (word && strcmp(word, words[k]) == 0) {
            *out = k;
            return true;
        }
        const size_t length = strlen(list); // a list that is longer is cut
        snprintf(list + length, sizeof list - length, "%s%s", k > 1 ? ", " : "", words[k]);
    }
    return client_fail(error, "%s: expected one of %s", name, list);
}

// The springs of a tie, which are the usual ones where the page does not say.
static bool take_springs(const json_t *object, Ask *ask, PliantError *error)
{
    const struct {
        const char *name;
        double low, high, usual, *out;
    } numbers[] = {{"stiffness", 1e-9, 4.0, 0.3, &ask->tie.stiffness},
                   {"damping_ratio", 0.0, 2.0, 0.5, &ask->tie.damping_ratio},
                   {"break_force", 0.0, FORCE_MAX, 0.0, &ask->tie.break_force}};
    for (int k = 0; k < 3; k++) {
        const json_t *value = json_object_get(object, numbers[k].name);
        *numbers[k].out = numbers[k].usual;
        if (value && !take_number(value, numbers[k].name, numbers[k].low, numbers[k].high,
                                  numbers[k].out, error))
            return false;
    }
    return true;
}

static bool take_tie(const json_t *object, Ask *ask, PliantError *error)
{
    static const char *const ACTIONS[] = {"", "make", "change", "release", NULL};
    static const char *const KINDS[] = {"", "pin", "tie", "clip", "carry", NULL};
    ask->kind = ASK_TIE;
    int64_t number = 0, tool = 0;
    if (!take_id(object, ask, error) ||
        !take_word(object, "action", ACTIONS, &ask->tie.action, error))
        return false;
    // Its number: the lowest free one where a new tie has none.
    const bool made = ask->tie.action == PLIANT_TIE_T_MAKE;
    if ((!made || json_object_get(object, "tie")) &&
        !take_integer(object, "tie", made ? 0 : 1, INT32_MAX, &number, error))
        return false;
    ask->tie.number = (int32_t)number;
    if (!take_springs(object, ask, error))
        return false;
    if (!made)
        return true;
    // What is tied to what.
    char to[ASK_TEXT_MAX] = "";
    if (!take_word(object, "kind", KINDS, &ask->tie.kind, error) ||
        !take_body(object, ask, error) || !take_text(object, "to_body", to, error) ||
        !take_vector(json_object_get(object, "center"), "center", 3, POSITION_MAX, ask->tie.center,
                     error) ||
        !take_number(json_object_get(object, "radius"), "radius", 1e-9, POSITION_MAX,
                     &ask->tie.radius, error))
        return false;
    if (to[0] && !argument_is_name(to, ARGUMENT_NAME_MOST))
        return client_fail(error, "to_body: expected the name of a body");
    snprintf(ask->tie.to_body, sizeof ask->tie.to_body, "%.*s", ARGUMENT_NAME_MOST, to);
    if (ask->tie.kind == PLIANT_TIE_T_CARRY &&
        !take_integer(object, "tool", 0, INT32_MAX, &tool, error))
        return false;
    ask->tie.tool = (int32_t)tool;
    return true;
}

static bool take_command(const json_t *object, Ask *ask, PliantError *error)
{
    static const char *const kinds[] = {[PLIANT_COMMAND_T_PAUSE] = "pause",
                                        [PLIANT_COMMAND_T_RESUME] = "resume",
                                        [PLIANT_COMMAND_T_STEP] = "step",
                                        [PLIANT_COMMAND_T_RESET] = "reset",
                                        [PLIANT_COMMAND_T_CHECKPOINT] = "checkpoint",
                                        [PLIANT_COMMAND_T_DESCRIBE] = "describe",
                                        [PLIANT_COMMAND_T_SET] = "set",
                                        [PLIANT_COMMAND_T_STOP] = "stop",
                                        NULL};
    ask->kind = ASK_COMMAND;
    if (!take_id(object, ask, error) || !take_text(object, "argument", ask->text, error))
        return false;
    if (json_object_get(object, "value")) { // for `step`; optional
        double value = 0.0;
        if (!take_number(json_object_get(object, "value"), "value", 0.0, STEPS_MAX, &value, error))
            return false;
        ask->command.value = (int64_t)value;
    }
    return take_word(object, "kind", kinds, &ask->command.kind, error);
}

// --- messages for the workbench ---

static bool take_file(const json_t *object, Ask *ask, PliantError *error)
{
    if (!take_id(object, ask, error) || !take_text(object, "name", ask->text, error))
        return false;
    return ask->text[0] || client_fail(error, "name: expected the name of a file");
}

static bool take_start(const json_t *object, Ask *ask, PliantError *error)
{
    static const char *const folders[] = {NULL, "scenes", "uploads", "recordings", NULL};
    int32_t folder = 1;
    ask->kind = ASK_START;
    if (!take_file(object, ask, error) || !take_word(object, "folder", folders, &folder, error))
        return false;
    ask->folder = (AskFolder)(folder - 1);
    return true;
}

static bool take_end(const json_t *object, Ask *ask, PliantError *error)
{
    ask->kind = ASK_END;
    return take_id(object, ask, error);
}

static bool take_record(const json_t *object, Ask *ask, PliantError *error)
{
    const json_t *on = json_object_get(object, "on");
    ask->kind = ASK_RECORD;
    ask->record = json_is_true(on);
    return take_id(object, ask, error) &&
           (json_is_boolean(on) || client_fail(error, "on: expected true or false"));
}

// Reads an optional word.
static bool take_choice(const json_t *object, const char *name, const char *const *words,
                        const char **out, PliantError *error)
{
    int32_t word = 0;
    if (json_object_get(object, name) && !take_word(object, name, words, &word, error))
        return false;
    *out = words[word];
    return true;
}

// Reads an optional positive integer.
static bool take_count(const json_t *object, const char *name, int32_t *out, PliantError *error)
{
    int64_t count = 0;
    if (json_object_get(object, name) && !take_integer(object, name, 1, INT32_MAX, &count, error))
        return false;
    *out = (int32_t)count;
    return true;
}

static bool take_propose(const json_t *object, Ask *ask, PliantError *error)
{
    const json_t *even = json_object_get(object, "even");
    const json_t *together = json_object_get(object, "together");
    static const char *const units[] = {NULL, "m", "dm", "cm", "mm", "um", NULL};
    static const char *const models[] = {NULL, "surface", "filled", "voxel", NULL};
    static const char *const cuttable[] = {NULL, "yes", "no", NULL};
    ask->kind = ASK_PROPOSE;
    ask->propose.even = json_is_true(even);
    if (even && !json_is_boolean(even))
        return client_fail(error, "even: expected true or false");
    ask->propose.together = json_is_true(together);
    if (together && !json_is_boolean(together))
        return client_fail(error, "together: expected true or false");
    return take_file(object, ask, error) &&
           take_choice(object, "units", units, &ask->propose.units, error) &&
           take_choice(object, "model", models, &ask->propose.model, error) &&
           take_choice(object, "cuttable", cuttable, &ask->propose.cuttable, error) &&
           take_count(object, "label", &ask->propose.label, error) &&
           take_count(object, "layer", &ask->propose.layer, error);
}

static bool take_message(const json_t *object, Ask *ask, PliantError *error)
{
    static const char *const types[] = {"",        "drawn", "tool", "cut",    "load",    "tie",
                                        "command", "start", "end",  "record", "propose", NULL};
    static bool (*const take[])(const json_t *, Ask *, PliantError *) = {
        NULL,         take_drawn, take_tool, take_cut,    take_load,   take_tie,
        take_command, take_start, take_end,  take_record, take_propose};
    int32_t type = 0;
    PliantError why;
    return take_word(object, "type", types, &type, error) &&
           (take[type](object, ask, &why) || client_fail(error, "%s: %s", types[type], why.text));
}

bool ask_parse(const char *text, size_t size, Ask *ask, PliantError *error)
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

// --- to the daemon -------------------------------------------------------------------------------

static const int64_t PATIENCE_NS = 400000000; // before a request is repeated

void requests_init(Requests *requests, Client *client, const char *prefix)
{
    *requests = (Requests){.client = client};
    snprintf(requests->prefix, sizeof requests->prefix, "%s", prefix ? prefix : client->prefix);
    pthread_mutex_init(&requests->lock, NULL);
    // The generated code computes these at first use, which threads of pages must not do
    // concurrently.
    __pliant_tool_pose_t_get_hash();
    __pliant_cut_t_get_hash();
    __pliant_load_t_get_hash();
    __pliant_tie_t_get_hash();
    __pliant_command_t_get_hash();
}

void requests_destroy(Requests *requests)
{
    pthread_mutex_destroy(&requests->lock);
}

void requests_channel(const Requests *requests, const char *name, char channel[CLIENT_CHANNEL_MAX])
{
    snprintf(channel, CLIENT_CHANNEL_MAX, "%s_%s", requests->prefix, name);
}

static void publish(const Requests *requests, const Request *request)
{
    static const char *const NAMES[] = {
        [ASK_CUT] = "CUT", [ASK_LOAD] = "LOAD", [ASK_TIE] = "TIE", [ASK_COMMAND] = "COMMAND"};
    lcm_t *lcm = requests->client->lcm;
    Ask ask = request->ask; // generated messages have no constant strings
    char channel[CLIENT_CHANNEL_MAX];
    if ((size_t)ask.kind >= sizeof NAMES / sizeof *NAMES || NAMES[ask.kind] == NULL)
        return;
    requests_channel(requests, NAMES[ask.kind], channel);
#define SENT .utime = request->utime, .sender = request->sender, .id = ask.id
    if (ask.kind == ASK_CUT) {
        pliant_cut_t message = {SENT, .body = ask.text};
        memcpy(message.before, ask.cut.before, sizeof message.before);
        memcpy(message.after, ask.cut.after, sizeof message.after);
        pliant_cut_t_publish(lcm, channel, &message);
    } else if (ask.kind == ASK_LOAD) {
        pliant_load_t message = {SENT, .radius = ask.load.radius, .duration = ask.load.duration,
                                 .body = ask.text};
        memcpy(message.center, ask.load.center, sizeof message.center);
        memcpy(message.force, ask.load.force, sizeof message.force);
        pliant_load_t_publish(lcm, channel, &message);
    } else if (ask.kind == ASK_TIE) {
        pliant_tie_t message = {SENT,
                                .action = ask.tie.action,
                                .tie = ask.tie.number,
                                .kind = ask.tie.kind,
                                .tool = ask.tie.tool,
                                .radius = ask.tie.radius,
                                .stiffness = ask.tie.stiffness,
                                .damping_ratio = ask.tie.damping_ratio,
                                .break_force = ask.tie.break_force,
                                .body = ask.text};
        memcpy(message.center, ask.tie.center, sizeof message.center);
        memcpy(message.to_body, ask.tie.to_body, sizeof ask.tie.to_body);
        pliant_tie_t_publish(lcm, channel, &message);
    } else {
        const pliant_command_t message = {SENT, .kind = ask.command.kind,
                                          .value = ask.command.value, .argument = ask.text};
        pliant_command_t_publish(lcm, channel, &message);
    }
#undef SENT
}

bool requests_send(Requests *requests, int32_t sender, const Ask *ask)
{
    Request *free_slot = NULL;
    const int64_t now = client_now_ns();
    // The request as it will be repeated.
    Request request = {.used = true,
                       .sender = sender,
                       .ask = *ask,
                       .tries = 1,
                       .utime = client_utime(),
                       .again_ns = now + PATIENCE_NS};
    pthread_mutex_lock(&requests->lock);
    // A free slot, or none: then the page hears of it.
    for (int k = 0; k < REQUESTS_MAX && !free_slot; k++) {
        if (!requests->request[k].used)
            free_slot = &requests->request[k];
    }
    // It is for the daemon that answers now; without one it waits.
    request.daemon = requests->daemon;
    request.waits = requests->daemon == 0 || now >= requests->sure_until_ns;
    if (free_slot)
        *free_slot = request;
    pthread_mutex_unlock(&requests->lock);
    // Sent outside the lock.
    if (free_slot && !request.waits)
        publish(requests, &request);
    return free_slot != NULL;
}

void requests_answered(Requests *requests, int32_t sender, int32_t id)
{
    pthread_mutex_lock(&requests->lock);
    for (int k = 0; k < REQUESTS_MAX; k++) {
        Request *request = &requests->request[k];
        if (request->sender == sender && request->ask.id == id)
            request->used = false;
    }
    pthread_mutex_unlock(&requests->lock);
}

void requests_forget(Requests *requests, int32_t sender)
{
    pthread_mutex_lock(&requests->lock);
    for (int k = 0; k < REQUESTS_MAX; k++) {
        if (requests->request[k].sender == sender)
            requests->request[k].used = false;
    }
    pthread_mutex_unlock(&requests->lock);
}

static void tell(Board *board, const Request *request, const char *format)
{
    static const char *const names[] = {
        [ASK_CUT] = "cut", [ASK_LOAD] = "load", [ASK_TIE] = "tie", [ASK_COMMAND] = "command"};
    char what[32], text[192];
    snprintf(what, sizeof what, "%s %d", names[request->ask.kind], (int)request->ask.id);
    snprintf(text, sizeof text, format, what);
    board_send(board, request->sender, text_error(request->ask.id, text));
}

void requests_follow(Requests *requests)
{
    pthread_mutex_lock(&requests->lock);
    requests->daemon = requests->session.daemon;
    requests->sure_until_ns = requests->session.sure_until_ns;
    pthread_mutex_unlock(&requests->lock);
}

// The next action for a request, decided under the lock and done without it; `due` is a copy of it.
typedef enum Due { DUE_NOTHING, DUE_ASK, DUE_SEND, DUE_GONE, DUE_LOST } Due;

static Due look_at(Requests *requests, Request *request, int64_t now_ns, Request *due)
{
    // One look under the lock at what is due; the work is done without it.
    Due what = DUE_NOTHING;
    pthread_mutex_lock(&requests->lock);
    if (request->used && request->daemon != requests->daemon) {
        request->used = false;
        what = DUE_GONE;
    } else if (request->used && now_ns >= request->again_ns) {
        request->used = ++request->tries < REQUEST_TRIES;
        request->again_ns = now_ns + PATIENCE_NS;
        request->waits = true;
        what = request->used ? DUE_NOTHING : DUE_LOST;
    }
    // Send only while the daemon is known to be the same.
    if (request->used && request->waits) {
        const bool sure = requests->daemon != 0 && now_ns < requests->sure_until_ns;
        request->waits = !sure;
        what = sure ? DUE_SEND : DUE_ASK;
    }
    *due = *request;
    pthread_mutex_unlock(&requests->lock);
    return what;
}

void requests_repeat(Requests *requests, Board *board, int64_t now_ns)
{
    // First learn which daemon answers.
    requests_follow(requests);
    for (int k = 0; k < REQUESTS_MAX; k++) {
        Request due;
        switch (look_at(requests, &requests->request[k], now_ns, &due)) {
        case DUE_ASK:
            session_ask(&requests->session);
            break;
        case DUE_SEND:
            publish(requests, &due);
            break;
        case DUE_GONE:
            tell(board, &due,
                 due.daemon != 0 ? "%s: " SESSION_GONE "; another one runs, which did not get it"
                                 : "%s: no daemon ran when it was made");
            break;
        case DUE_LOST:
            tell(board, &due, "no daemon answers %s: is it running?");
            break;
        case DUE_NOTHING:
            break;
        }
    }
}
