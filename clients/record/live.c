#include "live.h"

#include "writer.h"

#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#include "pliant_command_t.h"

enum { LOOK_MS = 20, PATIENCE_S = 2, SILENCE_S = 3, QUEUE_MESSAGES = 4096, URGENT = -10 };
static const int64_t SECOND_NS = 1000000000;

typedef struct Live {
    const LiveOptions *options;
    Client client;
    Intake intake;
    Writer writer;
    int64_t start_ns, begun_ns; // of the first file; 0: none yet
    int64_t heard_ns;           // the first message of the daemon that runs now; 0: none yet
    int64_t asked_ns, told_ns;
    int64_t mesh_chunks, mesh_ns; // that came, and when the last one did
    bool warned, hinted;
    int restarts;
    RecordingCounts told; // what was said of what is missing
} Live;

static void on_message(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    Live *live = user;
    intake_take(&live->intake, channel, buffer->data, buffer->data_size);
}

static bool subscribe_bodies(Live *live)
{
    const LiveOptions *options = live->options;
    Client *client = &live->client;
    if (options->body_count == 0) // the second pattern also means deltas
        return client_subscribe(client, "NODES", ".+", QUEUE_MESSAGES, on_message, live) &&
               client_subscribe(client, "MESH", ".+", QUEUE_MESSAGES, on_message, live);
    bool ok = true;
    for (int i = 0; i < options->body_count && ok; i++) {
        const char *body = options->body[i];
        ok = client_subscribe(client, "NODES", body, QUEUE_MESSAGES, on_message, live) &&
             client_subscribe(client, "MESH", body, QUEUE_MESSAGES, on_message, live) &&
             client_subscribe(client, "MESH_DELTA", body, QUEUE_MESSAGES, on_message, live);
    }
    return ok;
}

static bool subscribe(Live *live, ClientError *error)
{
    static const char *const names[] = {"STATUS", "EVENT", "CONTACT", "REPLY"};
    Client *client = &live->client;
    char poses[CLIENT_CHANNEL_MAX];
    bool ok = true;
    for (int i = 0; i < 4 && ok; i++)
        ok = client_subscribe(client, names[i], NULL, QUEUE_MESSAGES, on_message, live) != NULL;
    snprintf(poses, sizeof poses, "%s_TOOL_POSE", live->options->intake.input_prefix);
    lcm_subscription_t *subscription =
        ok ? lcm_subscribe(client->lcm, poses, on_message, live) : NULL;
    if (subscription)
        lcm_subscription_set_queue_capacity(subscription, QUEUE_MESSAGES);
    return (subscription && subscribe_bodies(live)) ||
           client_fail(error, "LCM refuses to subscribe to %s_*", client->prefix);
}

// LCM's receiving thread inherits this thread's urgency when it starts, with the first
// subscription: it only copies, and what it is late for is lost. Where that is not permitted it
// goes without.
static bool subscribe_urgently(Live *live, ClientError *error)
{
    int usual = getpriority(PRIO_PROCESS, 0);
    bool raised = usual > URGENT && setpriority(PRIO_PROCESS, 0, URGENT) == 0;
    bool ok = subscribe(live, error);
    if (raised)
        setpriority(PRIO_PROCESS, 0, usual);
    return ok;
}

// --- now and then --------------------------------------------------------------------------------

// To be asked for: who the daemon is, at first; and whole meshes, unless one is under way, which
// asking would send from its beginning.
static bool is_wanted(Live *live, int64_t now_ns)
{
    const Intake *intake = &live->intake;
    if (intake->mesh_chunks != live->mesh_chunks) {
        live->mesh_chunks = intake->mesh_chunks;
        live->mesh_ns = now_ns;
    }
    int64_t since = now_ns - live->asked_ns;
    if (intake->wants_mesh)
        return since >= SECOND_NS && now_ns - live->mesh_ns >= SECOND_NS / 2;
    // Once before anything is heard. Nobody answers those who speak of another input prefix: no
    // need to go on asking.
    if (intake->survey.described || live->heard_ns == 0)
        return live->asked_ns == 0;
    return since >= SECOND_NS && now_ns - live->heard_ns < PATIENCE_S * SECOND_NS;
}

// A description says which tools there are, and brings the whole meshes.
static void ask(Live *live, int64_t now_ns)
{
    if (!is_wanted(live, now_ns))
        return;
    char channel[CLIENT_CHANNEL_MAX];
    snprintf(channel, sizeof channel, "%s_COMMAND", live->options->intake.input_prefix);
    pliant_command_t command = {.utime = client_utime(),
                                .sender = live->client.sender,
                                .id = ++live->client.last_id,
                                .kind = PLIANT_COMMAND_T_DESCRIBE,
                                .argument = (char *)(uintptr_t) ""};
    pliant_command_t_publish(live->client.lcm, channel, &command);
    live->asked_ns = now_ns;
    live->intake.wants_mesh = false;
}

// Frames are lost in the kernel's buffer, which can be made larger.
static bool buffer_is_small(void)
{
    FILE *file = fopen("/proc/sys/net/core/rmem_max", "r");
    long bytes = CLIENT_RECEIVE_BYTES;
    if (file) {
        if (fscanf(file, "%ld", &bytes) != 1)
            bytes = CLIENT_RECEIVE_BYTES;
        fclose(file);
    }
    return bytes < CLIENT_RECEIVE_BYTES;
}

static void hint(Live *live)
{
    if (live->hinted || live->told.lost == 0)
        return;
    live->hinted = true;
    if (buffer_is_small())
        fprintf(stderr,
                "pliant-record: a larger receive buffer loses less; as root: "
                "sysctl -w net.core.rmem_max=%d\n",
                CLIENT_RECEIVE_BYTES);
}

static void tell_missing(Live *live, int64_t now_ns)
{
    const RecordingCounts now = intake_counts(&live->intake), *told = &live->told;
    bool more = now.lost > told->lost || now.dropped > told->dropped ||
                now.without_mesh > told->without_mesh || now.refused > told->refused;
    if (!more || !live->intake.open || now_ns - live->told_ns < SECOND_NS)
        return;
    fprintf(stderr,
            "pliant-record: missing so far: %lld frames lost on the way, %lld dropped because the "
            "disk is slow, %lld without their mesh; %lld messages refused\n",
            (long long)now.lost, (long long)now.dropped, (long long)now.without_mesh,
            (long long)now.refused);
    live->told = now;
    live->told_ns = now_ns;
    hint(live);
}

static void tell_restart(Live *live)
{
    if (live->restarts == live->intake.restarts)
        return;
    live->restarts = live->intake.restarts;
    live->heard_ns = live->asked_ns = 0;
    live->told = (RecordingCounts){0};
    char *next = intake_path(live->options->intake.path, live->intake.files + 1);
    fprintf(stderr, "pliant-record: the daemon was started anew: goes on in %s\n", next);
    free(next);
}

static bool begin(Live *live, int64_t now_ns, ClientError *error)
{
    Intake *intake = &live->intake;
    bool known = intake->open;
    if (live->heard_ns == 0 && (intake->survey.status_come || intake->survey.body_count > 0))
        live->heard_ns = now_ns;
    const char *missing = survey_missing(&intake->survey);
    if (missing && !known)
        return client_fail(error, "--body %s: the daemon has no body of this name", missing);
    bool patient = now_ns - live->heard_ns < PATIENCE_S * SECOND_NS;
    if (!intake_begin(intake, patient))
        return client_fail(error, "%s", intake->status.text);
    if (intake->open && !known) {
        fprintf(stderr, "pliant-record: records to %s\n", intake->path);
        live->begun_ns = live->begun_ns == 0 ? now_ns : live->begun_ns;
    }
    if (!intake->open && !live->warned && now_ns - live->start_ns > SILENCE_S * SECOND_NS) {
        live->warned = true;
        fprintf(stderr,
                "pliant-record: waits for a daemon that publishes nodes and meshes on "
                "%s_...\n",
                live->client.prefix);
    }
    return true;
}

// --- the loop ------------------------------------------------------------------------------------

static int64_t end_ns(const Live *live)
{
    const LiveOptions *options = live->options;
    if (live->begun_ns != 0)
        return options->duration > 0.0 ? live->begun_ns + (int64_t)(options->duration * 1e9)
                                       : INT64_MAX;
    return options->wait > 0.0 ? live->start_ns + (int64_t)(options->wait * 1e9) : INT64_MAX;
}

static bool receive(Live *live, ClientError *error)
{
    live->start_ns = client_now_ns();
    for (int64_t now = live->start_ns; now < end_ns(live); now = client_now_ns()) {
        bool waited = client_wait(&live->client, now + LOOK_MS * (SECOND_NS / 1000), NULL);
        if (writer_failed(&live->writer))
            return true; // it says why
        now = client_now_ns();
        tell_restart(live);
        if (!begin(live, now, error))
            return false;
        ask(live, now);
        tell_missing(live, now);
        if (live->client.broken)
            return client_fail(error, "the LCM connection failed");
        if (!waited)
            break;
    }
    return live->intake.files > 0 ||
           client_fail(error, "nothing came on %s_...: is pliantd running on %s?",
                       live->client.prefix, live->client.url);
}

static bool record(Live *live, ClientError *error)
{
    Status status = {0};
    if (!writer_start(&live->writer, live->options->queue_bytes, stdout, &status))
        return client_fail(error, "%s", status.text);
    bool ok = subscribe_urgently(live, error) && receive(live, error);
    intake_end(&live->intake);
    if (!writer_finish(&live->writer, &status))
        ok = client_fail(error, "%s", status.text);
    return ok;
}

bool live_record(const LiveOptions *options, ClientError *error)
{
    Live *live = calloc(1, sizeof *live);
    if (!live)
        return client_fail(error, "out of memory");
    live->options = options;
    intake_create(&live->intake, &options->intake, &live->writer.queue);
    live->intake.survey.wanted = options->body;
    live->intake.survey.wanted_count = options->body_count;
    bool ok = client_connect(&live->client, &options->client, error) && record(live, error);
    client_disconnect(&live->client);
    intake_destroy(&live->intake);
    free(live);
    return ok;
}
