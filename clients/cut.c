// pliant-cut: cuts tissue, either by messages, each of which sweeps a blade and is answered, or
// (--stroke) by moving a blade tool along the same path. One thread. A request without answer is
// repeated with the same number, so that the daemon executes it once.
#include "blade.h"
#include "client.h"
#include "program.h"
#include "track.h"
#include "wire.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "pliant_command_t.h"
#include "pliant_cut_t.h"
#include "pliant_event_t.h"
#include "pliant_tool_pose_t.h"

enum { PENDING_MOST = 64 }; // requests in progress; the daemon queues 128

typedef struct Options {
    PliantOptions client;
    BladePath path;
    bool has_before, stroke, quiet;
    double given[6];             // of the newest option that has numbers
    double blade[3], plane_size; // blade: x NaN: not given
    const char *file, *body;
    double rate_hz, speed, timeout_s; // rate 0: each sweep waits for the answer to the last one
    int tool, tries, repeat;
} Options;

typedef struct Pending {
    bool used;
    int32_t id;
    long number; // of the sweep, from 1
    int place;   // index of its first position
    long tries;
    bool waits;                 // to be sent as soon as the daemon is known to be there
    int64_t utime;              // of the request, kept by repeats
    int64_t first_us, again_ns; // when it was first sent; when it is repeated
} Pending;

typedef struct Cut {
    Options options;
    Client client;
    Pending pending[PENDING_MOST];
    Session session;
    int64_t daemon; // the daemon that all of this is for; 0: not known yet
    int under_way;
    int32_t next_id;
    bool lost;   // some request has no answer
    bool change; // something arrived: check again
    long sent, answered, made, resent;
    long long separated, nodes_added;
    int pieces;
    int64_t longest_us;
    // strokes
    long events, cuts;
    char refusal[256];
    uint32_t sequence;
} Cut;

// --- options ---

static bool add_place(Options *options, const double end[2][3], bool lifted, Status *why)
{
    return blade_add(&options->path, end, lifted) ||
           status_fail(why, STATUS_INVALID, "is one more than %d positions of the blade",
                       BLADE_EDGES_MAX);
}

static bool take_before(void *target, const char *text, Status *why)
{
    (void)text;
    Options *options = target;
    options->has_before = true;
    return add_place(options, (const double(*)[3])options->given, true, why);
}

static bool take_after(void *target, const char *text, Status *why)
{
    (void)text;
    Options *options = target;
    if (!options->has_before)
        return status_fail(why, STATUS_INVALID, "needs --before ahead of it");
    return add_place(options, (const double(*)[3])options->given, false, why);
}

static bool take_point(void *target, const char *text, Status *why)
{
    (void)text;
    Options *options = target;
    double *end = options->given;
    if (isnan(options->blade[0]))
        return status_fail(why, STATUS_INVALID, "needs --blade X,Y,Z ahead of it");
    for (int k = 0; k < 3; k++)
        end[3 + k] = end[k] + options->blade[k];
    return add_place(options, (const double(*)[3])end, options->path.count == 0, why);
}

static bool take_plane(void *target, const char *text, Status *why)
{
    (void)text;
    Options *options = target;
    const double *n = options->given + 3;
    if (!(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 1e-18))
        return status_fail(why, STATUS_INVALID, "is no plane: its normal has no length");
    blade_plane(&options->path, options->given, n, options->plane_size);
    return true;
}

#define AT(member) offsetof(Options, member)
#define REACH      -TRACK_REACH, TRACK_REACH

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_HEADING, .help = "Path of the blade (one of):"},
    {"before", 'B', ARGUMENT_NUMBERS, "X,Y,Z,X,Y,Z", AT(given), REACH, .handler = take_before,
     .help = "the two ends of its edge before the sweep [m] ..."},
    {"after", 'A', ARGUMENT_NUMBERS, "X,Y,Z,X,Y,Z", AT(given), REACH, .handler = take_after,
     .help = "... and after the sweep; repeated: a polyline"},
    {"blade", 'e', ARGUMENT_NUMBERS, "X,Y,Z", AT(blade), REACH,
     .help = "with --point: vector from the edge's tip to its other end [m]"},
    {"point", 'p', ARGUMENT_NUMBERS, "X,Y,Z", AT(given), REACH, .handler = take_point,
     .help = "a point on the path of its tip, at least twice"},
    {"plane", 'P', ARGUMENT_NUMBERS, "X,Y,Z,NX,NY,NZ", AT(given), REACH, .handler = take_plane,
     .help = "sweep the plane through a point with this normal"},
    {"size", 'S', ARGUMENT_NUMBER, "M", AT(plane_size), 1e-6, TRACK_REACH, .preset = 1.0,
     .help = "side of the square that --plane sweeps; give it before --plane"},
    {"file", 'f', ARGUMENT_TEXT, "FILE", AT(file),
     .help = "lines 'x y z x y z': successive positions of the edge's two ends; 'lift' starts a "
             "new path"},
    {.type = ARGUMENT_HEADING, .help = "What to cut, and how:"},
    {"body", 'b', ARGUMENT_NAME, "NAME", AT(body), .help = "only this body (default: all)"},
    {"rate", 'r', ARGUMENT_NUMBER, "HZ", AT(rate_hz), 0.01, 10000.0,
     .help = "sweeps per second (default: each after the reply to the last one); of --stroke: "
             "poses (default: 1000)"},
    {"repeat", 'n', ARGUMENT_INTEGER, "N", AT(repeat), 1, 1000000, .preset = 1,
     .help = "cut the whole path N times"},
    {"timeout", 'T', ARGUMENT_NUMBER, "S", AT(timeout_s), 0.01, 3600.0, .preset = 0.5,
     .help = "repeat a request when no reply arrives within this time"},
    {"tries", 'N', ARGUMENT_INTEGER, "N", AT(tries), 1, 1000, .preset = 6,
     .help = "send a request at most N times"},
    {"quiet", 'q', ARGUMENT_FLAG, NULL, AT(quiet), .help = "print only the summary"},
    {"stroke", 's', ARGUMENT_FLAG, NULL, AT(stroke),
     .help = "move a blade tool along the path instead of sending cuts"},
    {"tool", 't', ARGUMENT_INTEGER, "ID", AT(tool), INT32_MIN, INT32_MAX, .preset = 1,
     .help = "its id; its edge goes from its origin along its z axis"},
    {"speed", 'v', ARGUMENT_NUMBER, "M/S", AT(speed), 1e-5, 100.0, .preset = 0.05,
     .help = "of --stroke"},
    {.type = ARGUMENT_HEADING, .help = "Where:"},
    {.type = ARGUMENT_ROWS, .rows = PROGRAM_WHERE, .offset = AT(client)},
    {0}};

static bool check(void *target, Status *why)
{
    const Options *options = target;
    if (options->file != NULL && options->path.count > 0)
        return status_fail(why, STATUS_INVALID, "give either --file or positions of the blade");
    return options->file != NULL || blade_sweeps(&options->path) > 0 ||
           status_fail(why, STATUS_INVALID,
                       "nothing to cut: give --before and --after, --blade and two --point, "
                       "--plane, or --file");
}

static const ArgumentTable TABLE = {
    .program = "pliant-cut",
    .about = "Cuts the bodies of a running pliantd and prints what was severed.",
    .end = "To join another cut, a cut must overlap it by half an edge of the finest mesh. Exit "
           "status: 0 something was cut, 1 nothing was cut or no reply arrived, 2 bad usage.",
    .rows = ROWS,
    .check = check};

// --- what comes back ---

static void take_reply(Cut *cut, Pending *pending, const pliant_reply_t *reply)
{
    // It is answered: count what it did.
    int64_t trip_us = client_now_ns() / 1000 - pending->first_us;
    pending->used = false;
    cut->under_way--;
    cut->answered++;
    cut->made += reply->ok;
    cut->separated += reply->separated;
    cut->nodes_added += reply->nodes_added;
    cut->pieces = reply->pieces;
    cut->longest_us = trip_us > cut->longest_us ? trip_us : cut->longest_us;
    if (cut->options.quiet)
        return;
    // Texts come from the network: print what can be printed.
    printf("sweep %ld: %s", pending->number, reply->ok ? "" : "refused: ");
    program_print_text(stdout, reply->text, false);
    putchar('\n');
}

static void on_reply(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Cut *cut = user;
    pliant_reply_t reply;
    if (!wire_check(&WIRE_REPLY, buffer->data, buffer->data_size) ||
        pliant_reply_t_decode(buffer->data, 0, (int)buffer->data_size, &reply) < 0)
        return;
    // The answer of one of ours, however late.
    for (int k = 0; k < PENDING_MOST && reply.sender == cut->client.sender; k++) {
        Pending *pending = &cut->pending[k];
        if (pending->used && pending->id == reply.id) {
            take_reply(cut, pending, &reply);
            cut->change = true;
        }
    }
    pliant_reply_t_decode_cleanup(&reply);
}

static void on_event(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Cut *cut = user;
    pliant_event_t event;
    if (!wire_check(&WIRE_EVENT, buffer->data, buffer->data_size) ||
        pliant_event_t_decode(buffer->data, 0, (int)buffer->data_size, &event) < 0)
        return;
    // Events that a stroke may cause.
    bool ours = strcmp(event.kind, "cut") == 0 || strcmp(event.kind, "piece") == 0 ||
                strcmp(event.kind, "cut_refused") == 0 || strcmp(event.kind, "tear") == 0;
    cut->events++;
    cut->cuts += strcmp(event.kind, "cut") == 0;
    // A refusal may be the reason why nothing is cut.
    if (strcmp(event.kind, "refused") == 0 || strcmp(event.kind, "cut_refused") == 0)
        snprintf(cut->refusal, sizeof cut->refusal, "%s", event.text);
    if (ours && !cut->options.quiet) {
        printf("%s: ", event.kind);
        program_print_text(stdout, event.text, false);
        putchar('\n');
    }
    cut->change = true;
    pliant_event_t_decode_cleanup(&event);
}

// --- cuts by message ---

static void send_sweep(Cut *cut, Pending *pending)
{
    char channel[CLIENT_CHANNEL_MAX], body[CLIENT_CHANNEL_MAX] = "";
    const BladePosition *place = &cut->options.path.position[pending->place];
    if (cut->options.body != NULL)
        snprintf(body, sizeof body, "%s", cut->options.body);
    pliant_cut_t message = {
        .utime = pending->utime, .sender = cut->client.sender, .id = pending->id, .body = body};
    // The edge before and after.
    memcpy(message.before, place[0].end, sizeof message.before);
    memcpy(message.after, place[1].end, sizeof message.after);
    client_channel(&cut->client, "CUT", NULL, channel);
    pliant_cut_t_publish(cut->client.lcm, channel, &message);
    // The round trip counts from the first try.
    if (pending->first_us == 0)
        pending->first_us = client_now_ns() / 1000;
    else
        cut->resent++;
    pending->waits = false;
}

static void begin_sweep(Cut *cut, int place)
{
    // A free slot; the caller has waited for one.
    for (int k = 0; k < PENDING_MOST; k++) {
        Pending *pending = &cut->pending[k];
        if (pending->used)
            continue;
        *pending = (Pending){.used = true,
                             .id = ++cut->next_id,
                             .number = ++cut->sent,
                             .place = place,
                             .utime = client_utime()};
        cut->under_way++;
        return;
    }
}

// True if a message sent now reaches the daemon that this is for, and no other.
static bool is_there(Cut *cut, int64_t now)
{
    session_ask(&cut->session);
    return cut->session.daemon == cut->daemon && session_is_sure(&cut->session, now);
}

static bool is_gone(const Cut *cut, PliantError *error)
{
    if (cut->daemon == 0 || cut->session.daemon == cut->daemon)
        return false;
    client_fail(error, SESSION_GONE ", another one runs: nothing more is cut");
    return true;
}

// Finds the daemon to send to; waits for one that is just starting.
static bool find_daemon(Cut *cut, PliantError *error)
{
    const double patience = cut->options.timeout_s * cut->options.tries;
    const int64_t end = client_now_ns() + (int64_t)(patience * 1e9);
    if (!session_open(&cut->session, &cut->client, &cut->change))
        return client_fail(error, "LCM refuses to subscribe to %s_CLAIM", cut->client.prefix);
    // Ask until a daemon says who it is.
    while (cut->session.daemon == 0 && client_now_ns() < end) {
        session_ask(&cut->session);
        cut->change = false;
        int64_t next = client_now_ns() + 50000000;
        if (!client_wait(&cut->client, next < end ? next : end, &cut->change))
            return client_fail(error,
                               cut->client.broken ? "the LCM connection failed" : "interrupted");
    }
    cut->daemon = cut->session.daemon;
    return cut->daemon != 0 ||
           client_fail(error, "no reply on %s_CLAIM within %g s: is pliantd running on %s?",
                       cut->client.prefix, patience, cut->client.url);
}

// Sends what is due and gives up after the last try; returns the time of the next call.
static int64_t look_after(Cut *cut)
{
    int64_t now = client_now_ns(), next = now + 1000000000;
    for (int k = 0; k < PENDING_MOST; k++) {
        Pending *pending = &cut->pending[k];
        // No answer in time: once more, or give up.
        if (pending->used && pending->again_ns <= now) {
            if (pending->tries >= cut->options.tries) {
                pending->used = false;
                cut->under_way--;
                cut->lost = true;
                continue;
            }
            pending->tries++;
            pending->waits = true;
            pending->again_ns = now + (int64_t)(cut->options.timeout_s * 1e9);
        }
        // Only to the daemon that the cuts are for.
        if (pending->used && pending->waits) {
            if (is_there(cut, now))
                send_sweep(cut, pending);
            else
                next = now + 20000000 < next ? now + 20000000 : next;
        }
        if (pending->used && pending->again_ns < next)
            next = pending->again_ns;
    }
    return next;
}

// Waits until `until_ns`, and until at most `under_way` requests lack their answer.
static bool wait_for(Cut *cut, int64_t until_ns, int under_way, PliantError *error)
{
    for (;;) {
        // Send what is due, then see whether it can go on.
        int64_t next = look_after(cut);
        if (is_gone(cut, error))
            return false;
        if (cut->lost)
            return client_fail(error, "no reply on %s_REPLY within %g s: is pliantd running on %s?",
                               cut->client.prefix, cut->options.timeout_s * cut->options.tries,
                               cut->client.url);
        // Enough have been answered, and it is time.
        if (client_now_ns() >= until_ns && cut->under_way <= under_way)
            return true;
        if (cut->under_way <= under_way && until_ns < next)
            next = until_ns;
        cut->change = false;
        if (!client_wait(&cut->client, next, &cut->change))
            return client_fail(error,
                               cut->client.broken ? "the LCM connection failed" : "interrupted");
    }
}

static bool cut_all(Cut *cut, PliantError *error)
{
    const Options *options = &cut->options;
    const int64_t start = client_now_ns();
    // With a rate of its own, a sweep does not wait for earlier answers.
    const int most = options->rate_hz > 0.0 ? PENDING_MOST - 1 : 0;
    // Each sweep when it is due and when there is room for it.
    for (long n = 0; n < options->repeat; n++)
        for (int i = blade_next_sweep(&options->path, -1); i >= 0;
             i = blade_next_sweep(&options->path, i)) {
            int64_t due = options->rate_hz > 0.0
                              ? start + (int64_t)((double)cut->sent * 1e9 / options->rate_hz)
                              : 0;
            if (!wait_for(cut, due, most, error))
                return false;
            begin_sweep(cut, i);
        }
    return wait_for(cut, 0, 0, error);
}

static void print_summary(const Cut *cut)
{
    printf("%ld sweep%s, %ld of them cut: %lld links severed, %lld nodes added, %d piece%s now; "
           "longest answer %.1f ms",
           cut->answered, cut->answered == 1 ? "" : "s", cut->made, cut->separated,
           cut->nodes_added, cut->pieces, cut->pieces == 1 ? "" : "s",
           1e-3 * (double)cut->longest_us);
    if (cut->resent > 0)
        printf(", %ld sent again", cut->resent);
    putchar('\n');
}

// No sweep cut anything: checks whether a body of that name exists.
static bool explain_nothing(Cut *cut, PliantError *error)
{
    const Options *options = &cut->options;
    cut->client.last_id = cut->next_id; // a sender uses each id once
    if (options->body != NULL &&
        client_request(&cut->client, PLIANT_COMMAND_T_DESCRIBE, 0, "", options->timeout_s,
                       options->tries, error) &&
        !client_described_body(&cut->client, options->body, error))
        return false;
    return client_fail(error, "nothing was cut");
}

static bool send_cuts(Cut *cut, PliantError *error)
{
    if (!client_subscribe(&cut->client, "REPLY", NULL, 256, on_reply, cut))
        return client_fail(error, "LCM refuses to subscribe to %s_REPLY", cut->client.prefix);
    bool ok = find_daemon(cut, error) && cut_all(cut, error);
    if (cut->answered > 0)
        print_summary(cut);
    if (ok && cut->made == 0)
        return explain_nothing(cut, error);
    return ok;
}

// --- strokes of a tool ---

static void send_pose(Cut *cut, const TrackPose *pose, bool active)
{
    char channel[CLIENT_CHANNEL_MAX];
    pliant_tool_pose_t message = {.utime = client_utime(),
                                  .sender = cut->client.sender,
                                  .sequence = (int32_t)cut->sequence++,
                                  .tool = cut->options.tool,
                                  .active = active};
    memcpy(message.position, pose->position, sizeof message.position);
    memcpy(message.orientation, pose->orientation, sizeof message.orientation);
    client_channel(&cut->client, "TOOL_POSE", NULL, channel);
    pliant_tool_pose_t_publish(cut->client.lcm, channel, &message);
}

// Moves from place `first` until the blade is lifted; *next is the start of the following stroke.
static bool move_stroke(Cut *cut, int first, int *next, PliantError *error)
{
    const Options *options = &cut->options;
    const double rate = options->rate_hz > 0.0 ? options->rate_hz : 1000.0;
    Track track;
    *next = blade_track(&options->path, first, options->speed, &track);
    const int64_t start = client_now_ns();
    const double end = track_duration(&track) + 2.0 / rate; // time to reach the last pose
    TrackPose pose;
    bool going = true;
    for (int64_t k = 0; going; k++) {
        double time = (double)(client_now_ns() - start) * 1e-9; // skips poses that are late
        if (time > end)
            break;
        track_at(&track, fmin(time, track_duration(&track)), &pose);
        if (is_there(cut, client_now_ns()))
            send_pose(cut, &pose, true);
        if (cut->session.daemon != cut->daemon)
            break;
        int64_t due = start + (int64_t)((double)(k + 1) * 1e9 / rate);
        going = client_wait(&cut->client, due, NULL);
    }
    track_at(&track, track_duration(&track), &pose);
    for (int k = 0; k < 3;
         k++) // repeated, so that a lost datagram does not leave the blade in the tissue
        send_pose(cut, &pose, false);
    track_destroy(&track);
    if (is_gone(cut, error))
        return false;
    return going ||
           client_fail(error, cut->client.broken ? "the LCM connection failed" : "interrupted");
}

static bool move_tool(Cut *cut, PliantError *error)
{
    const Options *options = &cut->options;
    if (!client_subscribe(&cut->client, "EVENT", NULL, 256, on_event, cut))
        return client_fail(error, "LCM refuses to subscribe to %s_EVENT", cut->client.prefix);
    const double patience = options->timeout_s * options->tries; // as with messages
    if (!client_hear_daemon(&cut->client, patience, error) || !find_daemon(cut, error))
        return false;
    // One stroke after the other, each until the daemon has told of it.
    for (long n = 0; n < options->repeat; n++)
        for (int next, i = 0; i < options->path.count; i = next) {
            long before = cut->cuts;
            if (!move_stroke(cut, i, &next, error))
                return false;
            // Until the event of the stroke, or until none can be in transit any more.
            int64_t until = client_now_ns() + (int64_t)(options->timeout_s * 1e9);
            while (cut->cuts == before && client_now_ns() < until) {
                cut->change = false;
                if (!client_wait(&cut->client, until, &cut->change))
                    return client_fail(error, "interrupted");
            }
        }
    if (cut->cuts > 0)
        return true;
    return client_fail(error,
                       "no stroke was reported on %s_EVENT: tool %d met no cuttable tissue, "
                       "is not a blade, or its edge is not along its z axis%s%s",
                       cut->client.prefix, options->tool,
                       cut->refusal[0] ? "; the daemon said: " : "", cut->refusal);
}

int main(int argc, char **argv)
{
    static Cut cut = {.options.blade = {(double)NAN}};
    Status status = {0};
    if (!arguments_parse(&TABLE, argc, argv, &cut.options, &status))
        return arguments_exit(&status);
    program_catch_signals();

    PliantError error = {0};
    // A path that cannot be read is bad usage.
    Options *options = &cut.options;
    if (options->file != NULL && !blade_read(&options->path, options->file, &error)) {
        program_print_error("pliant-cut", &error);
        blade_destroy(&options->path);
        return 2;
    }
    bool ok = client_connect(&cut.client, &options->client, &error) &&
              program_stops(client_stop, &cut.client) &&
              (options->stroke ? move_tool(&cut, &error) : send_cuts(&cut, &error));
    if (!ok)
        program_print_error("pliant-cut", &error);
    client_disconnect(&cut.client);
    blade_destroy(&options->path);
    return ok ? 0 : 1;
}
