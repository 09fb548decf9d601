// SPDX-License-Identifier: MIT
// The connection, tools, status and events of libpliant-client.
#include "kit.h"

#include "wire.h"

#include "pliant_command_t.h"
#include "pliant_contact_t.h"
#include "pliant_tool_pose_t.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *pliant_version(void)
{
    return PLIANT_VERSION;
}

// --- messages ------------------------------------------------------------------------------------

static double seconds_of(int64_t ns)
{
    return 1e-9 * (double)ns;
}

double pliant_now(void)
{
    return seconds_of(client_now_ns());
}

// Returns the entry of a tool, made if it is new; NULL: there is room for no more.
static KitTool *add_tool(PliantClient *kit, int32_t id)
{
    for (int i = 0; i < kit->tools; i++) {
        if (kit->tool[i].contact.tool == id)
            return &kit->tool[i];
    }
    if (kit->tools == KIT_TOOLS)
        return NULL;
    kit->tool[kit->tools].contact.tool = id;
    return &kit->tool[kit->tools++];
}

enum { STALE_CONTACTS = 1000 }; // of a second, more than a network holds back

void kit_take_contact(PliantClient *kit, const void *data, size_t size)
{
    pliant_contact_t m;
    kit->servers++;
    if (!wire_check(&WIRE_CONTACT, data, size) ||
        pliant_contact_t_decode(data, 0, (int)size, &m) < 0)
        return;
    KitTool *tool = add_tool(kit, m.tool);
    // One that was overtaken is dropped; a restarted server counts from 0 with a later clock.
    if (!tool || (tool->count > 0 && frames_stale(m.sequence, m.utime, tool->contact.sequence,
                                                  tool->contact.utime, STALE_CONTACTS)))
        return;
    tool->count++;
    kit->news++;
    int64_t us;
    tool->trip = !round_trip_received(&kit->trips, m.pose_utime, client_now_ns() / 1000, &us) ? -1.0
                 : us < 0                                                                     ? 0.0
                          : fmax(1e-6 * (double)us, 1e-9); // measured, however short
    PliantContact *contact = &tool->contact;
    // As a duration, its validity is the same on every clock.
    *contact = (PliantContact){.tool = m.tool,
                               .sequence = m.sequence,
                               .step = m.step,
                               .time = m.time,
                               .utime = m.utime,
                               .pose_utime = m.pose_utime,
                               .received = pliant_now(),
                               .valid = 1e-6 * ((double)m.valid_until - (double)m.utime),
                               .contact = m.contact != 0,
                               .depth = m.depth,
                               .damping = m.damping};
    memcpy(contact->position, m.position, sizeof m.position);
    memcpy(contact->force, m.force, sizeof m.force);
    memcpy(contact->torque, m.torque, sizeof m.torque);
    memcpy(contact->point, m.point, sizeof m.point);
    memcpy(contact->normal, m.normal, sizeof m.normal);
    memcpy(contact->stiffness, m.stiffness, sizeof m.stiffness);
}

static PliantBodyStatus *copy_bodies(const pliant_status_t *s)
{
    PliantBodyStatus *body = frames_allocate((size_t)s->num_bodies, sizeof *body);
    for (int k = 0; k < s->num_bodies && body; k++) {
        const pliant_body_status_t *b = &s->body[k];
        body[k] = (PliantBodyStatus){.name = b->name,
                                     .model = b->model,
                                     .integrator = b->integrator,
                                     .topology = b->topology,
                                     .nodes = b->nodes,
                                     .springs = b->springs,
                                     .elements = b->elements,
                                     .pieces = b->pieces,
                                     .finest_level = b->finest_level,
                                     .time_step = b->time_step,
                                     .kinetic = b->kinetic,
                                     .elastic = b->elastic,
                                     .mass = b->mass,
                                     .max_displacement = b->max_displacement,
                                     .estimated_error = b->estimated_error};
    }
    return body;
}

static void forget_status(PliantClient *kit)
{
    if (kit->status_message)
        pliant_status_t_destroy(kit->status_message);
    kit->status_message = NULL;
    free(kit->body_status);
    kit->body_status = NULL;
}

void kit_take_status(PliantClient *kit, const void *data, size_t size)
{
    pliant_status_t m;
    kit->servers++;
    if (!wire_check(&WIRE_STATUS, data, size) || pliant_status_t_decode(data, 0, (int)size, &m) < 0)
        return;
    forget_status(kit);
    kit->status_message = pliant_status_t_copy(&m);
    pliant_status_t_decode_cleanup(&m);
    const pliant_status_t *s = kit->status_message;
    if (!s)
        return;
    kit->statuses++;
    kit->news++;
    kit->body_status = copy_bodies(s);
    kit->status = (PliantStatus){.scene = s->scene,
                                 .state = s->state,
                                 .step = s->step,
                                 .time = s->time,
                                 .rate_hz = s->rate_hz,
                                 .real_time_factor = s->real_time_factor,
                                 .late_ticks = s->late_ticks,
                                 .resets = s->resets,
                                 .rejected = s->rejected,
                                 .received = pliant_now(),
                                 .stage_count = s->num_stages,
                                 .stage = (const char *const *)s->stage,
                                 .stage_us = s->stage_us,
                                 .body_count = kit->body_status ? s->num_bodies : 0,
                                 .body = kit->body_status,
                                 .reason_count = s->num_reasons,
                                 .reason = (const char *const *)s->reason,
                                 .times = s->count};
    for (int k = 0; k < s->num_reasons; k++) {
        if (strcmp(s->reason[k], "other_host") == 0)
            kit->refused = s->count[k];
    }
    if (kit->statuses == 1 || kit->refused < kit->refused_first) // also a restarted server's
        kit->refused_first = kit->refused;
    memcpy(kit->status.step_us, s->step_us, sizeof s->step_us);
    memcpy(kit->status.wake_us, s->wake_us, sizeof s->wake_us);
}

static pliant_event_t *pop_event(PliantClient *kit)
{
    return kit->event_first == kit->event_end ? NULL : kit->event[kit->event_first++ % KIT_EVENTS];
}

void kit_take_event(PliantClient *kit, const void *data, size_t size)
{
    pliant_event_t m;
    if (!wire_check(&WIRE_EVENT, data, size) || pliant_event_t_decode(data, 0, (int)size, &m) < 0)
        return;
    // The newest ones stay.
    if (kit->event_end - kit->event_first == KIT_EVENTS)
        pliant_event_t_destroy(pop_event(kit));
    kit->event[kit->event_end++ % KIT_EVENTS] = pliant_event_t_copy(&m);
    kit->news++;
    pliant_event_t_decode_cleanup(&m);
}

void kit_forget(PliantClient *kit)
{
    for (pliant_event_t *event; (event = pop_event(kit)) != NULL;)
        pliant_event_t_destroy(event);
    if (kit->taken)
        pliant_event_t_destroy(kit->taken);
    kit->taken = NULL;
    forget_status(kit);
    kit_forget_ledger(kit);
    kit_forget_errors(kit);
}

static void on_contact(const lcm_recv_buf_t *buffer, const char *channel, void *kit)
{
    (void)channel;
    kit_take_contact(kit, buffer->data, buffer->data_size);
}

static void on_status(const lcm_recv_buf_t *buffer, const char *channel, void *kit)
{
    (void)channel;
    kit_take_status(kit, buffer->data, buffer->data_size);
}

static void on_event(const lcm_recv_buf_t *buffer, const char *channel, void *kit)
{
    (void)channel;
    kit_take_event(kit, buffer->data, buffer->data_size);
}

static void on_ledger(const lcm_recv_buf_t *buffer, const char *channel, void *kit)
{
    (void)channel;
    kit_take_ledger(kit, buffer->data, buffer->data_size);
}

static void on_errors(const lcm_recv_buf_t *buffer, const char *channel, void *kit)
{
    (void)channel;
    kit_take_errors(kit, buffer->data, buffer->data_size);
}

// --- connection ----------------------------------------------------------------------------------

static bool valid_prefix(const char *prefix, PliantError *error)
{
    const size_t length = strlen(prefix);
    bool valid = length > 0 && length < CLIENT_PREFIX_MAX;
    for (const char *at = prefix; *at && valid; at++)
        valid = (*at >= 'a' && *at <= 'z') || (*at >= 'A' && *at <= 'Z') ||
                (*at >= '0' && *at <= '9') || *at == '_' || *at == '-';
    return valid || client_fail(error, "prefix '%.64s' is not 1 to %d letters, digits, _ or -",
                                prefix, CLIENT_PREFIX_MAX - 1);
}

static bool connect(PliantClient *kit, const PliantOptions *options)
{
    const PliantOptions where = {.url = options->url, .prefix = options->prefix};
    const char *input = options->input_prefix ? options->input_prefix : options->prefix;
    if ((options->prefix && !valid_prefix(options->prefix, &kit->error)) ||
        (input && !valid_prefix(input, &kit->error)) ||
        !client_connect(&kit->client, &where, &kit->error))
        return false;
    snprintf(kit->input_prefix, sizeof kit->input_prefix, "%s", input ? input : "PLIANT");
    return (client_subscribe(&kit->client, "CONTACT", NULL, 1000, on_contact, kit) &&
            client_subscribe(&kit->client, "STATUS", NULL, 4, on_status, kit) &&
            client_subscribe(&kit->client, "EVENT", NULL, 64, on_event, kit) &&
            client_subscribe(&kit->client, "LEDGER", NULL, 4, on_ledger, kit) &&
            client_subscribe(&kit->client, "ERROR", NULL, 4, on_errors, kit) &&
            pliant_hear_bodies(kit, true)) ||
           client_fail(&kit->error, "LCM refuses to subscribe to %s_*", kit->client.prefix);
}

PliantClient *pliant_open(const PliantOptions *options, PliantError *error)
{
    PliantClient *kit = calloc(1, sizeof *kit);
    if (!kit)
        abort(); // the machine is out of memory
    kit->try_s = 0.5;
    kit->tries = 6;
    if (connect(kit, options ? options : &(const PliantOptions){0}))
        return kit;
    if (error)
        snprintf(error->text, sizeof error->text, "%s", kit->error.text);
    pliant_close(kit);
    return NULL;
}

void pliant_close(PliantClient *kit)
{
    if (!kit)
        return;
    // Tools would stay where they are until their timeout.
    while (kit->drives > 0)
        pliant_pose(kit, &(const PliantPose){.tool = kit->driven[kit->drives - 1]});
    kit_forget(kit);
    kit_bodies_destroy(kit);
    kit_pending_destroy(kit);
    client_disconnect(&kit->client);
    free(kit);
}

const char *pliant_error(const PliantClient *kit)
{
    return kit->error.text;
}

void pliant_stop(PliantClient *kit)
{
    client_stop(&kit->client);
}

int pliant_file(const PliantClient *kit)
{
    return receiver_file(kit->client.receiver);
}

void kit_input_channel(const PliantClient *kit, const char *name, char channel[CLIENT_CHANNEL_MAX])
{
    snprintf(channel, CLIENT_CHANNEL_MAX, "%s_%s", kit->input_prefix, name);
}

void pliant_only_listen(PliantClient *kit)
{
    kit->only_listens = true;
}

// --- waiting -------------------------------------------------------------------------------------

enum { SECOND_NS = 1000000000 };

int64_t kit_deadline(double seconds)
{
    const double most = 1e9; // thirty years
    const double wait = seconds > 0.0 ? fmin(seconds, most) : 0.0;
    return client_now_ns() + (int64_t)(1e9 * wait);
}

// Requests whole meshes if one was missed; not while one arrives, which would start again.
static void ask_for_meshes(PliantClient *kit)
{
    const int64_t now = client_now_ns();
    if (!kit->wants_mesh || kit->only_listens || now - kit->asked_ns < SECOND_NS ||
        now - kit->mesh_ns < SECOND_NS / 2)
        return;
    char channel[CLIENT_CHANNEL_MAX], none[] = "";
    const pliant_command_t command = {.utime = client_utime(),
                                      .sender = kit->client.sender,
                                      .id = ++kit->client.last_id,
                                      .kind = PLIANT_COMMAND_T_DESCRIBE,
                                      .argument = none};
    kit_input_channel(kit, "COMMAND", channel);
    pliant_command_t_publish(kit->client.lcm, channel, &command);
    kit->asked_ns = now;
    kit->wants_mesh = false;
}

bool kit_wait(PliantClient *kit, int64_t deadline_ns, const int64_t *count, int64_t before)
{
    enum { TURN_NS = 250000000, LATE_NS = 10000000 };
    while (!(count && *count != before)) {
        ask_for_meshes(kit);
        // Wait for at most a turn, after which meshes may be asked for again.
        const int64_t now = client_now_ns(), left = deadline_ns - now;
        const int64_t due = kit_pending_turn(kit, now) - now, turn = due < TURN_NS ? due : TURN_NS;
        switch (client_turn(&kit->client, left < turn ? left : turn)) {
        case CLIENT_TURN_OVER:
            return client_fail_over(&kit->client, &kit->error);
        case CLIENT_TURN_SIGNAL:
            return true;
        case CLIENT_TURN_QUIET:
            if (left <= turn)
                return true;
            break;
        case CLIENT_TURN_MESSAGE: // what is there is handled, but a flood ends, too
            if (left < -LATE_NS)
                return true;
            break;
        }
    }
    return true;
}

bool kit_wait_for(PliantClient *kit, const char *what, double seconds, const int64_t *count)
{
    const int64_t before = *count, deadline = kit_deadline(seconds);
    if (!kit_wait(kit, deadline, count, before))
        return false;
    if (*count != before)
        return true;
    if (client_now_ns() < deadline)
        return client_fail(&kit->error, "a signal ended the wait for %s", what);
    if (client_tell_foreign(&kit->client, kit->error.text, sizeof kit->error.text))
        return false;
    const char *state = kit->statuses > 0 ? kit->status.state : "running";
    if (strcmp(state, "running") != 0)
        return client_fail(&kit->error, "no %s within %g s: the server is %s (RESUME, or STEP)",
                           what, seconds, strcmp(state, "lockstep") == 0 ? "in lockstep" : state);
    return client_fail(&kit->error, "no %s on %s_* within %g s: no such one, or no pliantd on %s",
                       what, kit->client.prefix, seconds, kit->client.url);
}

bool kit_wait_published(PliantClient *kit, const char *type, double seconds, const int64_t *count,
                        const char *or_else)
{
    const int64_t before = *count, deadline = kit_deadline(seconds);
    const bool waited = kit_wait(kit, deadline, count, before);
    if (*count != before)
        return true;
    char within[40] = ""; // nothing of a caller who has waited by other means
    if (seconds > 0.0)
        snprintf(within, sizeof within, " within %g s", seconds);
    if (waited && !client_tell_foreign(&kit->client, kit->error.text, sizeof kit->error.text))
        client_fail(&kit->error, "no %s_%s%s: no pliantd on %s, or %s?", kit->client.prefix, type,
                    within, kit->client.url, or_else);
    return false;
}

bool pliant_wait(PliantClient *kit, double seconds)
{
    return kit_wait(kit, kit_deadline(seconds), NULL, 0);
}

int pliant_wait_next(PliantClient *kit, double seconds)
{
    const int64_t before = kit->news;
    const bool waited = kit_wait(kit, kit_deadline(seconds), &kit->news, before);
    return kit->news != before ? 1 : waited ? 0 : -1;
}

bool pliant_wait_server(PliantClient *kit, double seconds)
{
    const int64_t before = kit->servers, deadline = kit_deadline(seconds);
    if (!kit_wait(kit, deadline, &kit->servers, before))
        return false;
    if (kit->servers != before)
        return true;
    if (client_now_ns() < deadline)
        return client_fail(&kit->error, "a signal ended the wait for a server");
    if (client_tell_foreign(&kit->client, kit->error.text, sizeof kit->error.text))
        return false;
    return client_fail(&kit->error,
                       "no message on %s_CONTACT and %s_STATUS within %g s: no pliantd on %s, or "
                       "one with another prefix (--prefix)?",
                       kit->client.prefix, kit->client.prefix, seconds, kit->client.url);
}

// --- tools ---------------------------------------------------------------------------------------

const PliantContact *pliant_contact(const PliantClient *kit, int32_t tool)
{
    for (int i = 0; i < kit->tools; i++) {
        if (kit->tool[i].contact.tool == tool && kit->tool[i].count > 0)
            return &kit->tool[i].contact;
    }
    return NULL;
}

double pliant_contact_trip(const PliantClient *kit, int32_t tool)
{
    for (int i = 0; i < kit->tools; i++) {
        if (kit->tool[i].contact.tool == tool && kit->tool[i].count > 0)
            return kit->tool[i].trip;
    }
    return -1.0;
}

int64_t pliant_round_trips(const PliantClient *kit)
{
    return kit->trips.count;
}

double pliant_round_trip(const PliantClient *kit, double share)
{
    const double within = isfinite(share) ? fmax(0.0, fmin(share, 1.0)) : 0.0;
    return kit->trips.count > 0 ? 1e-6 * (double)round_trip_quantile(&kit->trips, within) : -1.0;
}

// Entries that are only waited for are skipped.
const PliantContact *pliant_tool(const PliantClient *kit, int k)
{
    for (int i = 0; i < kit->tools; i++) {
        if (kit->tool[i].count > 0 && k-- == 0)
            return &kit->tool[i].contact;
    }
    return NULL;
}

int pliant_tool_count(const PliantClient *kit)
{
    int count = 0;
    for (int i = 0; i < kit->tools; i++)
        count += kit->tool[i].count > 0;
    return count;
}

const PliantContact *pliant_wait_contact(PliantClient *kit, int32_t tool, double seconds)
{
    char what[64];
    snprintf(what, sizeof what, "contact of tool %d", tool);
    const KitTool *entry = add_tool(kit, tool);
    if (!entry) {
        client_fail(&kit->error, "more than %d tools", KIT_TOOLS);
        return NULL;
    }
    return kit_wait_for(kit, what, seconds, &entry->count) ? &entry->contact : NULL;
}

static bool all_finite(const double *number, int count)
{
    for (int k = 0; k < count; k++) {
        if (!isfinite(number[k]))
            return false;
    }
    return true;
}

// Remembers which tools are to be withdrawn at the end; false if they are too many.
static bool note_driven(PliantClient *kit, int32_t tool, bool active)
{
    int at = 0;
    while (at < kit->drives && kit->driven[at] != tool)
        at++;
    if (active && at == KIT_TOOLS)
        return false;
    if (active && at == kit->drives)
        kit->driven[kit->drives++] = tool;
    else if (!active && at < kit->drives)
        kit->driven[at] = kit->driven[--kit->drives];
    return true;
}

static bool check_pose(PliantClient *kit, const PliantPose *pose)
{
    const double *q = pose->orientation;
    if (!all_finite(pose->position, 3) || !all_finite(q, 4) || !isfinite(pose->grip) ||
        (pose->moving && (!all_finite(pose->linear, 3) || !all_finite(pose->angular, 3))))
        return client_fail(&kit->error, "pose of tool %d: a number is not finite", pose->tool);
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (length != 0.0 && !(fabs(length - 1.0) <= 1e-3)) // the server's own limit
        return client_fail(&kit->error, "pose of tool %d: orientation has length %g, not 1",
                           pose->tool, length);
    return note_driven(kit, pose->tool, pose->active) ||
           client_fail(&kit->error, "more than %d active tools", KIT_TOOLS);
}

bool pliant_pose(PliantClient *kit, const PliantPose *pose)
{
    const int64_t utime = client_utime();
    return pliant_pose_as(kit, pose, (int32_t)(kit->pose_sequence + 1),
                          utime > kit->pose_utime ? utime : kit->pose_utime + 1);
}

bool pliant_pose_as(PliantClient *kit, const PliantPose *pose, int32_t sequence, int64_t utime)
{
    if (!check_pose(kit, pose))
        return false;
    if (utime <= 0 || utime == INT64_MAX)
        return client_fail(&kit->error, "pose of tool %d: utime %lld is not above 0", pose->tool,
                           (long long)utime);
    if (!kit_may_send(kit))
        return pliant_bound(kit); // for a moment it is not known who would get it
    pliant_tool_pose_t m = {.utime = utime,
                            .sender = kit->client.sender,
                            .sequence = sequence,
                            .tool = pose->tool,
                            .twist_valid = pose->moving,
                            .grip = pose->grip,
                            .active = pose->active};
    const double *q = pose->orientation;
    const bool turned = q[0] != 0.0 || q[1] != 0.0 || q[2] != 0.0 || q[3] != 0.0;
    memcpy(m.position, pose->position, sizeof m.position);
    memcpy(m.orientation, turned ? q : (const double[4]){1.0}, sizeof m.orientation);
    for (int k = 0; k < 3 && pose->moving; k++) {
        m.twist[k] = pose->linear[k];
        m.twist[3 + k] = pose->angular[k];
    }
    char channel[CLIENT_CHANNEL_MAX];
    kit_input_channel(kit, "TOOL_POSE", channel);
    // What was overtaken or came before is not answered.
    if ((int32_t)((uint32_t)sequence - kit->pose_sequence) > 0)
        kit->pose_sequence = (uint32_t)sequence;
    if (utime > kit->pose_utime) {
        kit->pose_utime = utime;
        round_trip_sent(&kit->trips, utime, client_now_ns() / 1000); // before it can be answered
    }
    return pliant_tool_pose_t_publish(kit->client.lcm, channel, &m) >= 0 ||
           client_fail(&kit->error, "LCM cannot send on %s", channel);
}

// --- status and events ---------------------------------------------------------------------------

const PliantStatus *pliant_status(const PliantClient *kit)
{
    return kit->status_message ? &kit->status : NULL;
}

const PliantStatus *pliant_wait_status(PliantClient *kit, double seconds)
{
    return kit_wait_published(kit, "STATUS", seconds, &kit->statuses, "one with another prefix")
               ? &kit->status
               : NULL;
}

const PliantEvent *pliant_next_event(PliantClient *kit)
{
    pliant_event_t *event = pop_event(kit);
    if (!event)
        return NULL;
    // What was handed out before is no longer needed.
    if (kit->taken)
        pliant_event_t_destroy(kit->taken);
    kit->taken = event;
    kit->event_taken = (PliantEvent){
        .step = event->step, .body = event->body, .kind = event->kind, .text = event->text};
    return &kit->event_taken;
}
