// SPDX-License-Identifier: MIT
// Servers in libpliant-client: which ones there are, to which one a client is bound, which bodies
// its scene has, and whether it refuses this host.
#include "kit.h"

#include "wire.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// --- bound to one ---

bool kit_may_send(PliantClient *kit)
{
    if (kit->bound == 0)
        return true;
    session_ask(&kit->session);
    return kit->session.daemon == kit->bound && session_is_sure(&kit->session, client_now_ns());
}

bool pliant_bound(PliantClient *kit)
{
    return kit->bound == 0 || kit->session.daemon == kit->bound ||
           client_fail(&kit->error, SESSION_GONE ", another one runs");
}

bool pliant_bind(PliantClient *kit, double seconds)
{
    enum { AGAIN_NS = 50000000 };
    const int64_t end = kit_deadline(seconds);
    if (!kit->session.client && !session_open(&kit->session, &kit->client, NULL))
        return client_fail(&kit->error, "LCM refuses to subscribe to %s_CLAIM", kit->client.prefix);
    // Ask until one says who it is.
    while (!session_is_sure(&kit->session, client_now_ns()) && client_now_ns() < end) {
        session_ask(&kit->session);
        const int64_t next = client_now_ns() + AGAIN_NS;
        if (!kit_wait(kit, next < end ? next : end, &kit->session.daemon, kit->session.daemon))
            return false;
    }
    kit->bound = kit->session.daemon;
    return kit->bound != 0 ||
           client_fail(&kit->error, "no reply on %s_CLAIM within %g s: is pliantd running on %s?",
                       kit->client.prefix, seconds, kit->client.url);
}

// --- what it says ---

const char *pliant_network(const PliantClient *kit)
{
    return kit->client.url;
}

const char *pliant_refusal(PliantClient *kit)
{
    if (client_tell_foreign(&kit->client, kit->refusal, sizeof kit->refusal))
        return kit->refusal;
    if (kit->refused <= kit->refused_first)
        return NULL;
    snprintf(kit->refusal, sizeof kit->refusal,
             "the server on %s has refused %lld messages of other hosts since: if this host is "
             "another one, remote = true in the scene, or pliantd --remote, permits it",
             kit->client.prefix, (long long)(kit->refused - kit->refused_first));
    return kit->refusal;
}

int pliant_scene_bodies(PliantClient *kit, const char **name, int most)
{
    int count = 0;
    char *to = kit->described;
    const char *line = pliant_describe(kit);
    if (!line)
        return -1;
    // Its lines "body NAME: ...".
    for (; line; line = strchr(line, '\n')) {
        char found[CLIENT_CHANNEL_MAX];
        line += *line == '\n';
        if (sscanf(line, "body %63[^: \n]", found) != 1)
            continue;
        const size_t bytes = strlen(found) + 1;
        if (count < most && bytes <= sizeof kit->described - (size_t)(to - kit->described)) {
            name[count] = memcpy(to, found, bytes);
            to += bytes;
        }
        count++;
    }
    return count;
}

static bool check(PliantClient *kit, const char *wanted, const char *const *name, int count)
{
    char list[900] = "";
    for (int k = 0; k < count; k++) {
        const size_t used = strlen(list);
        if (strcmp(name[k], wanted) == 0)
            return true;
        snprintf(list + used, sizeof list - used, "%s%s", k ? ", " : "", name[k]);
    }
    return count == 0 ||
           client_fail(&kit->error, "the daemon has no body '%s', only: %s", wanted, list);
}

bool pliant_find_body(PliantClient *kit, const char *wanted)
{
    const char *name[KIT_BODIES];
    const PliantStatus *status = pliant_status(kit);
    int count = 0;
    for (; status && count < status->body_count && count < KIT_BODIES; count++)
        name[count] = status->body[count].name;
    if (!status)
        count = pliant_scene_bodies(kit, name, KIT_BODIES);
    return count >= 0 && check(kit, wanted, name, count < KIT_BODIES ? count : KIT_BODIES);
}

// --- on a network ---

typedef struct Listing {
    PliantServer *server;
    int most, count;
} Listing;

// Returns the entry of a channel "<PREFIX>_<name>", made if it is new, or NULL.
static PliantServer *add(Listing *listing, const char *channel, const char *name)
{
    const size_t length = strlen(channel), tail = strlen(name);
    if (length <= tail || strcmp(channel + length - tail, name) != 0 ||
        length - tail >= CLIENT_PREFIX_MAX)
        return NULL;
    PliantServer server = {0};
    memcpy(server.prefix, channel, length - tail);
    for (int k = 0; k < listing->count; k++) {
        if (strcmp(listing->server[k].prefix, server.prefix) == 0)
            return &listing->server[k];
    }
    if (listing->count == listing->most)
        return NULL;
    listing->server[listing->count] = server;
    return &listing->server[listing->count++];
}

static void on_anything(const lcm_recv_buf_t *buffer, const char *channel, void *listing)
{
    if (wire_check(&WIRE_CONTACT, buffer->data, buffer->data_size))
        add(listing, channel, "_CONTACT");
    pliant_status_t status;
    if (!wire_check(&WIRE_STATUS, buffer->data, buffer->data_size) ||
        pliant_status_t_decode(buffer->data, 0, (int)buffer->data_size, &status) < 0)
        return;
    PliantServer *server = add(listing, channel, "_STATUS");
    if (server) {
        snprintf(server->scene, sizeof server->scene, "%s", status.scene);
        snprintf(server->state, sizeof server->state, "%s", status.state);
        server->rate_hz = status.rate_hz;
        server->time = status.time;
    }
    pliant_status_t_decode_cleanup(&status);
}

static int compare(const void *a, const void *b)
{
    return strcmp(((const PliantServer *)a)->prefix, ((const PliantServer *)b)->prefix);
}

int pliant_servers(const char *url, double seconds, PliantServer *server, int most,
                   PliantError *error)
{
    enum { QUEUE = 10000 };
    Client client;
    PliantError why = {0};
    Listing listing = {.server = server, .most = most};
    bool ok = client_connect(&client, &(const PliantOptions){.url = url}, &why);
    if (ok && !receiver_subscribe(client.receiver, ".+", QUEUE, on_anything, &listing))
        ok = client_fail(&why, "LCM refuses to subscribe to all channels");
    const int64_t end = kit_deadline(seconds);
    for (int64_t now; ok && (now = client_now_ns()) < end;) {
        const ClientTurn turn = client_turn(&client, end - now);
        if (turn == CLIENT_TURN_SIGNAL)
            break;
        ok = turn != CLIENT_TURN_OVER || client_fail_over(&client, &why);
    }
    client_disconnect(&client);
    if (error)
        *error = why;
    if (ok)
        qsort(server, (size_t)listing.count, sizeof *server, compare);
    return ok ? listing.count : -1;
}
