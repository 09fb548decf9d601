// Requests of pages to the daemon over LCM.
#include "requests.h"
#include "texts.h"

#include <string.h>

#include "pliant_command_t.h"
#include "pliant_cut_t.h"
#include "pliant_load_t.h"
#include "pliant_tool_pose_t.h"

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

static void publish_cut(const Requests *requests, int32_t sender, int64_t utime, Ask *ask)
{
    char channel[CLIENT_CHANNEL_MAX];
    requests_channel(requests, "CUT", channel);
    pliant_cut_t message = {.utime = utime, .sender = sender, .id = ask->id, .body = ask->text};
    memcpy(message.before, ask->cut.before, sizeof message.before);
    memcpy(message.after, ask->cut.after, sizeof message.after);
    pliant_cut_t_publish(requests->client->lcm, channel, &message);
}

static void publish_load(const Requests *requests, int32_t sender, int64_t utime, Ask *ask)
{
    char channel[CLIENT_CHANNEL_MAX];
    requests_channel(requests, "LOAD", channel);
    pliant_load_t message = {.utime = utime,
                             .sender = sender,
                             .id = ask->id,
                             .radius = ask->load.radius,
                             .duration = ask->load.duration,
                             .body = ask->text};
    memcpy(message.center, ask->load.center, sizeof message.center);
    memcpy(message.force, ask->load.force, sizeof message.force);
    pliant_load_t_publish(requests->client->lcm, channel, &message);
}

static void publish_command(const Requests *requests, int32_t sender, int64_t utime, Ask *ask)
{
    char channel[CLIENT_CHANNEL_MAX];
    requests_channel(requests, "COMMAND", channel);
    pliant_command_t message = {.utime = utime,
                                .sender = sender,
                                .id = ask->id,
                                .kind = ask->command.kind,
                                .value = ask->command.value,
                                .argument = ask->text};
    pliant_command_t_publish(requests->client->lcm, channel, &message);
}

static void publish(const Requests *requests, const Request *request)
{
    Ask copy = request->ask; // generated messages have no constant strings
    if (copy.kind == ASK_CUT)
        publish_cut(requests, request->sender, request->utime, &copy);
    else if (copy.kind == ASK_LOAD)
        publish_load(requests, request->sender, request->utime, &copy);
    else if (copy.kind == ASK_COMMAND)
        publish_command(requests, request->sender, request->utime, &copy);
}

bool requests_send(Requests *requests, int32_t sender, const Ask *ask)
{
    Request *free_slot = NULL;
    const int64_t now = client_now_ns();
    Request request = {.used = true,
                       .sender = sender,
                       .ask = *ask,
                       .tries = 1,
                       .utime = client_utime(),
                       .again_ns = now + PATIENCE_NS};
    pthread_mutex_lock(&requests->lock);
    for (int k = 0; k < REQUESTS_MAX && !free_slot; k++) {
        if (!requests->request[k].used)
            free_slot = &requests->request[k];
    }
    request.daemon = requests->daemon;
    request.waits = requests->daemon == 0 || now >= requests->sure_until_ns;
    if (free_slot)
        *free_slot = request;
    pthread_mutex_unlock(&requests->lock);
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
        [ASK_CUT] = "cut", [ASK_LOAD] = "load", [ASK_COMMAND] = "command"};
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
