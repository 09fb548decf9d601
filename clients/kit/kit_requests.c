// SPDX-License-Identifier: MIT
// Requests of libpliant-client, each answered by one reply. A request keeps number and time when it
// is repeated, so that the server executes it once, and none that starts later executes it.
#include "kit.h"

#include "base/arguments.h"

#include "pliant_command_t.h"
#include "pliant_cut_t.h"
#include "pliant_load_t.h"
#include "pliant_tie_t.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NAME = ARGUMENT_NAME_MOST + 1, IDS = 16 };

_Static_assert(sizeof((pliant_tie_t *)NULL)->node == IDS * sizeof(int32_t), "ids of a tie");
_Static_assert((int)PLIANT_STOP == PLIANT_COMMAND_T_STOP, "commands as on the wire");
_Static_assert((int)PLIANT_CARRY == PLIANT_TIE_T_CARRY, "ties as on the wire");

typedef struct Request {
    PliantClient *kit;
    const char *channel;
    void (*publish)(lcm_t *lcm, const char *channel, int32_t sender, int32_t id, void *message);
    void *message;
} Request;

static void publish(Client *client, const char *channel, const void *message)
{
    (void)channel; // that of the output prefix
    const Request *request = message;
    if (!kit_may_send(request->kit))
        return; // it is repeated
    request->publish(client->lcm, request->channel, client->sender, client->last_id,
                     request->message);
}

static const PliantReply *ask(PliantClient *kit, const char *name, Request request)
{
    char channel[CLIENT_CHANNEL_MAX];
    kit_input_channel(kit, name, channel);
    request.channel = channel;
    request.kit = kit;
    if (!pliant_bound(kit))
        return NULL;
    if (!client_ask(&kit->client, name, publish, &request, kit->try_s, kit->tries, &kit->error)) {
        // A server that does not hear this host does not answer either.
        const Client *client = &kit->client;
        const char *refusal = pliant_refusal(kit);
        if (!client->reply_come && !client->broken && !client->stopped && refusal)
            client_fail(&kit->error, "no reply on %s_REPLY within %g s: %s", client->prefix,
                        kit->try_s * kit->tries, refusal);
        return NULL;
    }
    const pliant_reply_t *reply = kit->client.reply;
    kit->reply = (PliantReply){.step = reply->step,
                               .separated = reply->separated,
                               .nodes_added = reply->nodes_added,
                               .pieces = reply->pieces,
                               .text = reply->text};
    return &kit->reply;
}

void pliant_patience(PliantClient *kit, double seconds, int tries)
{
    if (seconds > 0.0)
        kit->try_s = fmin(seconds, 1e6);
    if (tries > 0)
        kit->tries = tries;
}

const PliantReply *pliant_reply(const PliantClient *kit)
{
    return kit->client.reply && kit->client.reply->ok ? &kit->reply : NULL;
}

// Copies the name of a body; NULL is "". Returns false with a sentence if it is none.
static bool copy_name(PliantClient *kit, char to[NAME], const char *name)
{
    const size_t length = name ? strlen(name) : 0;
    if (length >= NAME)
        return client_fail(&kit->error, "body '%.64s': a name has at most %d characters", name,
                           NAME - 1);
    memset(to, 0, NAME);
    if (name)
        memcpy(to, name, length);
    return true;
}

// --- commands ------------------------------------------------------------------------------------

static void send_command(lcm_t *lcm, const char *channel, int32_t sender, int32_t id, void *message)
{
    pliant_command_t *command = message;
    command->sender = sender;
    command->id = id;
    // A question changes nothing: a server that starts while it is repeated may answer it.
    if (command->kind == PLIANT_COMMAND_T_DESCRIBE)
        command->utime = client_utime();
    pliant_command_t_publish(lcm, channel, command);
}

const PliantReply *pliant_command(PliantClient *kit, PliantCommand kind, int64_t value,
                                  const char *argument)
{
    char text[256] = "";
    if (argument && strlen(argument) >= sizeof text) {
        client_fail(&kit->error, "the argument '%.32s...' is longer than %zu characters", argument,
                    sizeof text - 1);
        return NULL;
    }
    snprintf(text, sizeof text, "%s", argument ? argument : "");
    pliant_command_t command = {
        .utime = client_utime(), .kind = (int32_t)kind, .value = value, .argument = text};
    return ask(kit, "COMMAND", (Request){.publish = send_command, .message = &command});
}

const char *pliant_describe(PliantClient *kit)
{
    const PliantReply *reply = pliant_command(kit, PLIANT_DESCRIBE, 0, NULL);
    return reply ? reply->text : NULL;
}

// --- cuts and loads ------------------------------------------------------------------------------

static void send_cut(lcm_t *lcm, const char *channel, int32_t sender, int32_t id, void *message)
{
    pliant_cut_t *cut = message;
    cut->sender = sender;
    cut->id = id;
    pliant_cut_t_publish(lcm, channel, cut);
}

const PliantReply *pliant_cut(PliantClient *kit, const double before[2][3],
                              const double after[2][3], const char *body)
{
    char name[NAME];
    if (!copy_name(kit, name, body))
        return NULL;
    pliant_cut_t cut = {.utime = client_utime(), .body = name};
    memcpy(cut.before, before, sizeof cut.before);
    memcpy(cut.after, after, sizeof cut.after);
    return ask(kit, "CUT", (Request){.publish = send_cut, .message = &cut});
}

static void send_load(lcm_t *lcm, const char *channel, int32_t sender, int32_t id, void *message)
{
    pliant_load_t *load = message;
    load->sender = sender;
    load->id = id;
    pliant_load_t_publish(lcm, channel, load);
}

const PliantReply *pliant_load(PliantClient *kit, const double center[3], double radius,
                               const double force[3], double duration, const char *body)
{
    char name[NAME];
    if (!copy_name(kit, name, body))
        return NULL;
    pliant_load_t load = {
        .utime = client_utime(), .radius = radius, .duration = duration, .body = name};
    memcpy(load.center, center, sizeof load.center);
    memcpy(load.force, force, sizeof load.force);
    return ask(kit, "LOAD", (Request){.publish = send_load, .message = &load});
}

// --- ties ----------------------------------------------------------------------------------------

static void send_tie(lcm_t *lcm, const char *channel, int32_t sender, int32_t id, void *message)
{
    pliant_tie_t *tie = message;
    tie->sender = sender;
    tie->id = id;
    pliant_tie_t_publish(lcm, channel, tie);
}

static const PliantReply *ask_tie(PliantClient *kit, int action, int32_t number,
                                  const PliantTie *from)
{
    const double USUAL = 0.3;
    char name[NAME];
    if (from->node_count < 0 || from->node_count > IDS || (from->node_count > 0 && !from->node)) {
        client_fail(&kit->error, "a tie of %d nodes: 0 to %d, and their ids", from->node_count,
                    IDS);
        return NULL;
    }
    pliant_tie_t tie = {.utime = client_utime(),
                        .action = action,
                        .tie = number,
                        .kind = (int32_t)from->kind,
                        .tool = from->tool,
                        .node_count = from->node_count,
                        .radius = from->radius,
                        .stiffness = from->stiffness != 0.0 ? from->stiffness : USUAL,
                        .damping_ratio = from->damping_ratio,
                        .break_force = from->break_force,
                        .body = name};
    if (!copy_name(kit, (char *)tie.to_body, from->to_body) || !copy_name(kit, name, from->body))
        return NULL;
    memcpy(tie.center, from->center, sizeof tie.center);
    if (from->node_count > 0)
        memcpy(tie.node, from->node, sizeof *tie.node * (size_t)from->node_count);
    return ask(kit, "TIE", (Request){.publish = send_tie, .message = &tie});
}

int32_t pliant_tie(PliantClient *kit, const PliantTie *tie)
{
    return pliant_tie_as(kit, 0, tie);
}

int32_t pliant_tie_as(PliantClient *kit, int32_t number, const PliantTie *tie)
{
    const PliantReply *reply = ask_tie(kit, PLIANT_TIE_T_MAKE, number, tie);
    int made = 0;
    // The reply names it: "tie 3: pin of ...".
    if (reply && (sscanf(reply->text, "tie %9d", &made) != 1 || made < 1)) {
        client_fail(&kit->error, "the reply names no tie: %s", reply->text);
        made = 0;
    }
    return made;
}

bool pliant_tie_change(PliantClient *kit, int32_t number, const PliantTie *tie)
{
    const PliantTie springs = {.stiffness = tie->stiffness,
                               .damping_ratio = tie->damping_ratio,
                               .break_force = tie->break_force};
    return ask_tie(kit, PLIANT_TIE_T_CHANGE, number, &springs) != NULL;
}

bool pliant_tie_release(PliantClient *kit, int32_t number)
{
    return ask_tie(kit, PLIANT_TIE_T_RELEASE, number, &(const PliantTie){0}) != NULL;
}
