// SPDX-License-Identifier: MIT
// Where recordings come from: a running daemon, or an event log.
#include "live.h"

#include "io/event_log.h"
#include "program.h"
#include "writer.h"

#include "pliant_command_t.h"

#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

// --- a running daemon ----------------------------------------------------------------------------

enum { LOOK_MS = 20, PATIENCE_S = 2, SILENCE_S = 3, QUEUE_MESSAGES = 4096, URGENT = -10 };
static const int64_t SECOND_NS = 1000000000;

typedef struct Live {
    const LiveOptions *options;
    Client client;
    Intake intake;
    Writer writer;
    int64_t start_ns, begun_ns; // of the first file; 0: none yet
    int64_t heard_ns;           // first message of the current daemon; 0: none yet
    int64_t asked_ns, reported_ns;
    int64_t mesh_chunks, mesh_ns; // chunks received, and arrival of the last one
    bool warned, hinted;
    int restarts;
    RecordingCounts told; // missing frames reported so far
} Live;

static void on_message(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    Live *live = user;
    intake_take(&live->intake, channel, buffer->data, buffer->data_size);
}

static bool subscribe_bodies(Live *live)
{
    static const char *const names[] = {"NODES", "POINTS",    "MESH",     "WALLS",
                                        "LOOK",  "ERROR_MAP", "ELEMENTS", "MESH_DELTA"};
    enum { NAMES = sizeof names / sizeof *names };
    const LiveOptions *options = live->options;
    bool ok = true;
    // All, of which MESH has the deltas already, or the named ones alone.
    const bool all = options->body_count == 0;
    for (int i = 0; i < (all ? 1 : options->body_count); i++)
        for (int k = 0; k < NAMES - all && ok; k++)
            ok = client_subscribe(&live->client, names[k], all ? ".+" : options->body[i],
                                  QUEUE_MESSAGES, on_message, live) != NULL;
    return ok;
}

static bool subscribe(Live *live, PliantError *error)
{
    static const char *const names[] = {"STATUS", "EVENT", "CONTACT", "REPLY", "LEDGER", "ERROR"};
    Client *client = &live->client;
    char poses[CLIENT_CHANNEL_MAX];
    bool ok = true;
    for (size_t i = 0; i < sizeof names / sizeof *names && ok; i++)
        ok = client_subscribe(client, names[i], NULL, QUEUE_MESSAGES, on_message, live) != NULL;
    // Poses come on a prefix of their own.
    snprintf(poses, sizeof poses, "%s_TOOL_POSE", live->options->intake.input_prefix);
    ok = ok && receiver_subscribe(client->receiver, poses, QUEUE_MESSAGES, on_message, live);
    return (ok && subscribe_bodies(live)) ||
           client_fail(error, "LCM refuses to subscribe to %s_*", client->prefix);
}

// --- periodic work -------------------------------------------------------------------------------

// True if DESCRIBE is needed: at first, to learn about the daemon; later for whole meshes, unless
// one is in transit, which a request would restart.
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
    // Ask once before anything is heard. A client with another input prefix gets no answer and need
    // not go on asking.
    if (intake->survey.described || live->heard_ns == 0)
        return live->asked_ns == 0;
    return since >= SECOND_NS && now_ns - live->heard_ns < PATIENCE_S * SECOND_NS;
}

// Requests a description, which lists the tools and brings the whole meshes.
static void ask(Live *live, int64_t now_ns)
{
    if (!is_wanted(live, now_ns))
        return;
    char channel[CLIENT_CHANNEL_MAX];
    // DESCRIBE makes the daemon send its meshes.
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

// True if the kernel's buffer, where frames are lost, can be enlarged.
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

static void report_missing(Live *live, int64_t now_ns)
{
    const RecordingCounts now = intake_counts(&live->intake), *told = &live->told;
    // Only what is new, once a second.
    bool more = now.lost > told->lost || now.dropped > told->dropped ||
                now.without_mesh > told->without_mesh || now.refused > told->refused;
    if (!more || !live->intake.open || now_ns - live->reported_ns < SECOND_NS)
        return;
    fprintf(stderr,
            "pliant-record: missing so far: %lld frames lost on the way, %lld dropped because the "
            "disk is slow, %lld without their mesh; %lld messages refused\n",
            (long long)now.lost, (long long)now.dropped, (long long)now.without_mesh,
            (long long)now.refused);
    live->told = now;
    live->reported_ns = now_ns;
    hint(live);
}

static void report_restart(Live *live)
{
    if (live->restarts == live->intake.restarts)
        return;
    live->restarts = live->intake.restarts;
    live->heard_ns = live->asked_ns = 0;
    live->told = (RecordingCounts){0};
    char *next = intake_path(live->options->intake.path, live->intake.files + 1);
    fprintf(stderr, "pliant-record: the daemon restarted: continuing in %s\n", next);
    free(next);
}

static bool begin(Live *live, int64_t now_ns, PliantError *error)
{
    // Messages tell that somebody is there.
    Intake *intake = &live->intake;
    bool known = intake->open;
    if (live->heard_ns == 0 && (intake->survey.status_come || intake->survey.body_count > 0))
        live->heard_ns = now_ns;
    // A name that no body has.
    const char *missing = survey_missing(&intake->survey);
    if (missing && !known)
        return client_fail(error, "--body %s: the daemon has no body of this name, only: %s",
                           missing, intake->survey.listed);
    // The file begins when all is known, or after some patience.
    bool patient = now_ns - live->heard_ns < PATIENCE_S * SECOND_NS;
    if (!intake_begin(intake, patient))
        return client_fail(error, "%s", intake->status.text);
    if (intake->open && !known) {
        fprintf(stderr, "pliant-record: recording to %s\n", intake->path);
        live->begun_ns = live->begun_ns == 0 ? now_ns : live->begun_ns;
    }
    // Say once that nothing comes.
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

static bool receive(Live *live, PliantError *error)
{
    live->start_ns = client_now_ns();
    // Look a few times a second at what the messages have brought.
    for (int64_t now = live->start_ns; now < end_ns(live); now = client_now_ns()) {
        bool waited = client_wait(&live->client, now + LOOK_MS * (SECOND_NS / 1000), NULL);
        if (writer_failed(&live->writer))
            return true; // it says why
        now = client_now_ns();
        report_restart(live);
        if (!begin(live, now, error))
            return false;
        ask(live, now);
        report_missing(live, now);
        if (live->client.broken)
            return client_fail(error, "the LCM connection failed");
        if (!waited)
            break;
    }
    return live->intake.files > 0 ||
           client_fail(error, "no message on %s_...: is pliantd running on %s?",
                       live->client.prefix, live->client.url);
}

static bool record(Live *live, PliantError *error)
{
    Status status = {0};
    if (!writer_start(&live->writer, live->options->queue_bytes, stdout, &status))
        return client_fail(error, "%s", status.text);
    // This thread only copies, and data that it misses is lost: raise its priority over the
    // writer's, if that is permitted.
    int usual = getpriority(PRIO_PROCESS, 0);
    bool raised = usual > URGENT && setpriority(PRIO_PROCESS, 0, URGENT) == 0;
    bool ok = subscribe(live, error) && receive(live, error);
    if (raised)
        setpriority(PRIO_PROCESS, 0, usual);
    intake_end(&live->intake);
    if (!writer_finish(&live->writer, &status))
        ok = client_fail(error, "%s", status.text);
    return ok;
}

bool live_record(const LiveOptions *options, PliantError *error)
{
    Live *live = calloc(1, sizeof *live);
    if (!live)
        return client_fail(error, "out of memory");
    live->options = options;
    // One thread receives, the other writes.
    intake_create(&live->intake, &options->intake, &live->writer.queue);
    live->intake.survey.wanted = options->body;
    live->intake.survey.wanted_count = options->body_count;
    bool ok = program_await_network(options->client.url, error) &&
              client_connect(&live->client, &options->client, error) &&
              program_stops(client_stop, &live->client) && record(live, error);
    program_stops(NULL, NULL);
    client_disconnect(&live->client);
    intake_destroy(&live->intake);
    free(live);
    return ok;
}

// --- an event log --------------------------------------------------------------------------------

typedef struct Convert {
    Intake survey, intake;
    Writer writer;
    Queue nothing; // output of the first reading, unused
    LogEvent event;
} Convert;

// Says where the clock of a log has gaps and steps, of many the first ones.
static void report_jump(const EventLog *log, int *jumps)
{
    enum { MOST = 8 };
    if (log->jump_us == 0 || ++*jumps > MOST)
        return;
    fprintf(stderr, "pliant-record: %s: %.1f s after its start the clock goes %s by %.1f s%s\n",
            log->path, 1e-6 * (double)(log->last_us - log->jump_us - log->first_us),
            log->jump_us > 0 ? "on" : "back", 1e-6 * fabs((double)log->jump_us),
            *jumps == MOST ? "; others are not reported" : "");
}

// Reads the log to its end or to its first damage.
static void read_log(Convert *convert, const char *path, Intake *intake, bool writes,
                     Status *status)
{
    EventLog log;
    if (!event_log_open(&log, path, status))
        return;
    LogEvent *event = &convert->event;
    int jumps = 0;
    while (!program_stopped() && event_log_next(&log, event, status)) {
        if (!writes)
            report_jump(&log, &jumps);
        if (event->size > EVENT_LOG_DATA_MAX) // larger than any of ours
            continue;
        intake_take(intake, event->channel, event->data, event->size);
        if (writes && (!intake_begin(intake, false) || writer_failed(&convert->writer)))
            break;
    }
    event_log_close(&log);
}

// Surveys the whole log: a recording begins with all bodies and tools.
static bool take_survey(Convert *convert, const char *log, const LiveOptions *options,
                        PliantError *error)
{
    Survey *survey = &convert->survey.survey;
    int bodies = 0;
    // Bodies of which there is all that a recording needs.
    for (int i = 0; i < survey->body_count; i++) {
        SurveyBody *body = &survey->body[i];
        body->listed = body->seen && body->nodes > 0;
        bodies += body->listed;
        if (body->seen && !body->listed)
            fprintf(stderr, "pliant-record: %s: no mesh of body %s in it: skipped\n", log,
                    body->name);
    }
    // The log has all that will ever be known.
    survey->status_come = true;
    if (bodies == 0)
        return client_fail(error, "%s: no nodes and mesh of a body on %s_... in it", log,
                           options->intake.prefix);
    const char *missing = survey_missing(survey);
    if (missing)
        return client_fail(error, "--body %s: not in %s", missing, log);
    // The second pass begins with what the first one found.
    convert->intake.survey = *survey;
    *survey = (Survey){0};
    return true;
}

static bool record_log(Convert *convert, const char *log, const LiveOptions *options,
                       PliantError *error)
{
    Status damage = {0}, status = {0};
    // What is in the log decides what the file has.
    read_log(convert, log, &convert->survey, false, &status);
    if (!take_survey(convert, log, options, error))
        return status.code == STATUS_OK ? false : client_fail(error, "%s", status.text);
    status = (Status){0};
    if (!writer_start(&convert->writer, options->queue_bytes, stdout, &status))
        return client_fail(error, "%s", status.text);
    // Then the data, up to the first damage.
    read_log(convert, log, &convert->intake, true, &damage);
    intake_end(&convert->intake);
    bool ok = convert->intake.status.code == STATUS_OK ||
              client_fail(error, "%s", convert->intake.status.text);
    // The first cause is the one that is told.
    if (damage.code != STATUS_OK)
        ok = client_fail(error, "%s", damage.text);
    if (!writer_finish(&convert->writer, &status))
        ok = client_fail(error, "%s", status.text);
    if (convert->intake.restarts > 0)
        fprintf(stderr, "pliant-record: %s: the daemon restarted %d times: %d files\n", log,
                convert->intake.restarts, convert->intake.files);
    return ok;
}

bool convert_log(const char *log, const LiveOptions *options, PliantError *error)
{
    Convert *convert = calloc(1, sizeof *convert);
    if (!convert)
        return client_fail(error, "out of memory");
    // One intake only surveys, the other one records.
    IntakeOptions all = options->intake;
    all.when_full = QUEUE_WAIT;
    queue_create(&convert->nothing, 0);
    all.survey_only = true;
    intake_create(&convert->survey, &all, &convert->nothing);
    all.survey_only = false;
    intake_create(&convert->intake, &all, &convert->writer.queue);
    // Both look for the bodies that were asked for.
    convert->survey.survey.wanted = options->body;
    convert->survey.survey.wanted_count = options->body_count;
    bool ok = record_log(convert, log, options, error);
    intake_destroy(&convert->survey);
    intake_destroy(&convert->intake);
    queue_destroy(&convert->nothing);
    free(convert);
    return ok;
}
