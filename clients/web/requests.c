// What pages ask of the daemon on LCM.
#include "requests.h"
#include "texts.h"

#include <string.h>

#include "pliant_command_t.h"
#include "pliant_cut_t.h"
#include "pliant_load_t.h"

static const int64_t PATIENCE_NS = 400000000; // before a request is sent again

void requests_init(Requests *requests, Client *client, const char *prefix)
{
    *requests = (Requests){.client = client};
    snprintf(requests->prefix, sizeof requests->prefix, "%s", prefix ? prefix : client->prefix);
    pthread_mutex_init(&requests->lock, NULL);
}

void requests_destroy(Requests *requests)
{
    pthread_mutex_destroy(&requests->lock);
}

void requests_channel(const Requests *requests, const char *name, char channel[CLIENT_CHANNEL_MAX])
{
    snprintf(channel, CLIENT_CHANNEL_MAX, "%s_%s", requests->prefix, name);
}

static void publish_cut(const Requests *requests, int32_t sender, Ask *ask)
{
    char channel[CLIENT_CHANNEL_MAX];
    requests_channel(requests, "CUT", channel);
    pliant_cut_t message = {
        .utime = client_utime(), .sender = sender, .id = ask->id, .body = ask->text};
    memcpy(message.before, ask->cut.before, sizeof message.before);
    memcpy(message.after, ask->cut.after, sizeof message.after);
    pliant_cut_t_publish(requests->client->lcm, channel, &message);
}

static void publish_load(const Requests *requests, int32_t sender, Ask *ask)
{
    char channel[CLIENT_CHANNEL_MAX];
    requests_channel(requests, "LOAD", channel);
    pliant_load_t message = {.utime = client_utime(),
                             .sender = sender,
                             .id = ask->id,
                             .radius = ask->load.radius,
                             .duration = ask->load.duration,
                             .body = ask->text};
    memcpy(message.center, ask->load.center, sizeof message.center);
    memcpy(message.force, ask->load.force, sizeof message.force);
    pliant_load_t_publish(requests->client->lcm, channel, &message);
}

static void publish_command(const Requests *requests, int32_t sender, Ask *ask)
{
    char channel[CLIENT_CHANNEL_MAX];
    requests_channel(requests, "COMMAND", channel);
    pliant_command_t message = {.utime = client_utime(),
                                .sender = sender,
                                .id = ask->id,
                                .kind = ask->command.kind,
                                .value = ask->command.value,
                                .argument = ask->text};
    pliant_command_t_publish(requests->client->lcm, channel, &message);
}

static void publish(const Requests *requests, int32_t sender, const Ask *ask)
{
    Ask copy = *ask; // generated messages hold no constant strings
    if (copy.kind == ASK_CUT)
        publish_cut(requests, sender, &copy);
    else if (copy.kind == ASK_LOAD)
        publish_load(requests, sender, &copy);
    else if (copy.kind == ASK_COMMAND)
        publish_command(requests, sender, &copy);
}

bool requests_send(Requests *requests, int32_t sender, const Ask *ask)
{
    Request *free_place = NULL;
    pthread_mutex_lock(&requests->lock);
    for (int k = 0; k < REQUESTS_MAX && !free_place; k++) {
        if (!requests->request[k].used)
            free_place = &requests->request[k];
    }
    if (free_place)
        *free_place = (Request){.used = true,
                                .sender = sender,
                                .ask = *ask,
                                .tries = 1,
                                .again_ns = client_now_ns() + PATIENCE_NS};
    pthread_mutex_unlock(&requests->lock);
    if (free_place)
        publish(requests, sender, ask);
    return free_place != NULL;
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

static void give_up(Board *board, const Request *request)
{
    static const char *const names[] = {
        [ASK_CUT] = "cut", [ASK_LOAD] = "load", [ASK_COMMAND] = "command"};
    char text[128];
    snprintf(text, sizeof text, "no daemon answers %s %d: is it running?", names[request->ask.kind],
             (int)request->ask.id);
    board_tell(board, request->sender, text_error(text));
}

void requests_repeat(Requests *requests, Board *board, int64_t now_ns)
{
    for (int k = 0; k < REQUESTS_MAX; k++) {
        Request *request = &requests->request[k], due = {0};
        pthread_mutex_lock(&requests->lock);
        if (request->used && now_ns >= request->again_ns) {
            due = *request;
            request->used = ++request->tries <= REQUEST_TRIES;
            request->again_ns = now_ns + PATIENCE_NS;
        }
        pthread_mutex_unlock(&requests->lock);
        if (due.used && due.tries < REQUEST_TRIES)
            publish(requests, due.sender, &due.ask);
        else if (due.used)
            give_up(board, &due);
    }
}
