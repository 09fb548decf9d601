// SPDX-License-Identifier: MIT
// pliant-cut: cuts tissue, either by messages, each of which sweeps a blade and is answered, or
// (--stroke) by moving a blade tool along the same path. One thread.
#include "blade.h"
#include "program.h"
#include "track.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PENDING_MOST = 64 }; // requests in progress, as many as the client has room for

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

typedef struct Cut {
    Options options;
    PliantClient *client;
    bool lost; // some request has no answer
    long sent, answered, made, resent;
    int32_t first; // number of the first request
    long long separated, nodes_added;
    int pieces;
    double longest; // [s]
    // strokes
    long cuts;
    char refusal[256];
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

static void take_answer(Cut *cut, const PliantAnswer *answer)
{
    const PliantReply *reply = &answer->reply;
    cut->lost |= !answer->answered;
    cut->resent += answer->sent > 1 ? answer->sent - 1 : 0;
    if (!answer->answered)
        return;
    cut->answered++;
    cut->made += answer->done;
    cut->separated += reply->separated;
    cut->nodes_added += reply->nodes_added;
    cut->pieces = reply->pieces;
    cut->longest = fmax(cut->longest, answer->seconds);
    if (cut->options.quiet)
        return;
    // Texts come from the network: print what can be printed.
    printf("sweep %d: %s", answer->request - cut->first + 1, answer->done ? "" : "refused: ");
    program_print_text(stdout, reply->text, false);
    putchar('\n');
}

static void take_event(Cut *cut, const PliantEvent *event)
{
    // Events that a stroke may cause.
    bool ours = strcmp(event->kind, "cut") == 0 || strcmp(event->kind, "piece") == 0 ||
                strcmp(event->kind, "cut_refused") == 0 || strcmp(event->kind, "tear") == 0;
    cut->cuts += strcmp(event->kind, "cut") == 0;
    // A refusal may be the reason why nothing is cut.
    if (strcmp(event->kind, "refused") == 0 || strcmp(event->kind, "cut_refused") == 0)
        snprintf(cut->refusal, sizeof cut->refusal, "%s", event->text);
    if (!ours || cut->options.quiet)
        return;
    printf("%s: ", event->kind);
    program_print_text(stdout, event->text, false);
    putchar('\n');
}

// Handles messages for so long at most, until one has brought something; false if that is over.
static bool turn(Cut *cut, double seconds, PliantError *error)
{
    if (pliant_wait_next(cut->client, seconds) < 0 || !pliant_bound(cut->client))
        return program_fail(error, "%s", pliant_error(cut->client));
    for (const PliantAnswer *answer; (answer = pliant_next_answer(cut->client)) != NULL;)
        take_answer(cut, answer);
    for (const PliantEvent *event; (event = pliant_next_event(cut->client)) != NULL;) {
        if (cut->options.stroke)
            take_event(cut, event);
    }
    return true;
}

// --- cuts by message ---

// Waits until then, and until at most `in_progress` requests lack their answer.
static bool wait_for(Cut *cut, double until, int in_progress, PliantError *error)
{
    const Options *options = &cut->options;
    for (double wait = 0.0;; wait = 1.0) {
        const double left = until - pliant_now();
        const bool enough = pliant_in_progress(cut->client) <= in_progress;
        if (!turn(cut, enough ? fmin(fmax(left, 0.0), wait) : wait, error))
            return false;
        if (cut->lost) {
            const double patience = options->timeout_s * options->tries;
            const char *prefix = options->client.prefix, *refusal = pliant_refusal(cut->client);
            if (refusal)
                return program_fail(error, "no reply on %s_REPLY within %g s: %s", prefix, patience,
                                    refusal);
            return program_fail(error,
                                "no reply on %s_REPLY within %g s: is pliantd running on %s?",
                                prefix, patience, pliant_network(cut->client));
        }
        if (pliant_now() >= until && pliant_in_progress(cut->client) <= in_progress)
            return true;
    }
}

static bool cut_all(Cut *cut, PliantError *error)
{
    const Options *options = &cut->options;
    const double start = pliant_now();
    // With a rate of its own, a sweep does not wait for earlier answers.
    const int most = options->rate_hz > 0.0 ? PENDING_MOST - 1 : 0;
    // Each sweep when it is due and when there is room for it.
    for (long n = 0; n < options->repeat; n++)
        for (int i = blade_next_sweep(&options->path, -1); i >= 0;
             i = blade_next_sweep(&options->path, i)) {
            const BladePosition *place = &options->path.position[i];
            const double due =
                options->rate_hz > 0.0 ? start + (double)cut->sent / options->rate_hz : 0.0;
            if (!wait_for(cut, due, most, error))
                return false;
            const int32_t request =
                pliant_cut_begin(cut->client, place[0].end, place[1].end, options->body);
            if (request == 0)
                return program_fail(error, "%s", pliant_error(cut->client));
            if (cut->sent++ == 0)
                cut->first = request;
        }
    return wait_for(cut, 0.0, 0, error);
}

static void print_summary(const Cut *cut)
{
    printf("%ld sweep%s, %ld of them cut: %lld links severed, %lld nodes added, %d piece%s now; "
           "longest answer %.1f ms",
           cut->answered, cut->answered == 1 ? "" : "s", cut->made, cut->separated,
           cut->nodes_added, cut->pieces, cut->pieces == 1 ? "" : "s", 1e3 * cut->longest);
    if (cut->resent > 0)
        printf(", %ld sent again", cut->resent);
    putchar('\n');
}

static bool send_cuts(Cut *cut, PliantError *error)
{
    const Options *options = &cut->options;
    const bool ok = cut_all(cut, error);
    if (cut->answered > 0)
        print_summary(cut);
    if (!ok || cut->made > 0)
        return ok;
    // No sweep cut anything: is there a body of that name?
    if (options->body && !pliant_find_body(cut->client, options->body))
        return program_fail(error, "%s", pliant_error(cut->client));
    return program_fail(error, "nothing was cut");
}

// --- strokes of a tool ---

static bool send_pose(Cut *cut, const TrackPose *pose, bool active)
{
    PliantPose message = {.tool = cut->options.tool, .active = active};
    memcpy(message.position, pose->position, sizeof message.position);
    memcpy(message.orientation, pose->orientation, sizeof message.orientation);
    return pliant_pose(cut->client, &message);
}

// Moves from place `first` until the blade is lifted; *next is the start of the following stroke.
static bool move_stroke(Cut *cut, int first, int *next, PliantError *error)
{
    const Options *options = &cut->options;
    const double rate = options->rate_hz > 0.0 ? options->rate_hz : 1000.0;
    Track track;
    *next = blade_track(&options->path, first, options->speed, &track);
    const double start = pliant_now();
    const double end = track_duration(&track) + 2.0 / rate; // time to reach the last pose
    TrackPose pose;
    bool ok = true;
    for (int64_t k = 0; ok; k++) {
        double time = pliant_now() - start; // skips poses that are late
        if (time > end)
            break;
        track_at(&track, fmin(time, track_duration(&track)), &pose);
        ok = send_pose(cut, &pose, true);
        if (!ok)
            program_fail(error, "%s", pliant_error(cut->client));
        const double due = start + (double)(k + 1) / rate;
        for (double left; ok && (left = due - pliant_now()) > 0.0;)
            ok = turn(cut, left, error);
    }
    track_at(&track, track_duration(&track), &pose);
    for (int k = 0; k < 3; k++) // a lost datagram would leave the blade in the tissue
        send_pose(cut, &pose, false);
    track_destroy(&track);
    return ok;
}

static bool move_tool(Cut *cut, PliantError *error)
{
    const Options *options = &cut->options;
    // One stroke after the other, each until the server has reported it.
    for (long n = 0; n < options->repeat; n++)
        for (int next, i = 0; i < options->path.count; i = next) {
            const long before = cut->cuts;
            if (!move_stroke(cut, i, &next, error))
                return false;
            // Until the event of the stroke, or until none can be in transit any more.
            const double until = pliant_now() + options->timeout_s;
            for (double left; cut->cuts == before && (left = until - pliant_now()) > 0.0;) {
                if (!turn(cut, left, error))
                    return false;
            }
        }
    if (cut->cuts > 0)
        return true;
    return program_fail(
        error,
        "no stroke was reported on %s_EVENT: tool %d met no cuttable tissue, is not "
        "a blade, or its edge is not along its z axis%s%s",
        options->client.prefix, options->tool, cut->refusal[0] ? "; the daemon said: " : "",
        cut->refusal);
}

static bool run(Cut *cut, PliantError *error)
{
    const Options *options = &cut->options;
    const double patience = options->timeout_s * options->tries;
    pliant_patience(cut->client, options->timeout_s, options->tries);
    // All of it is for the server that runs now.
    if (!pliant_hear_bodies(cut->client, false))
        return program_fail(error, "%s", pliant_error(cut->client));
    if ((options->stroke &&
         !program_await_server(cut->client, pliant_wait_server, patience, error)) ||
        !program_await_server(cut->client, pliant_bind, patience, error))
        return false;
    return options->stroke ? move_tool(cut, error) : send_cuts(cut, error);
}

int main(int argc, char **argv)
{
    static Cut cut;
    cut.options.blade[0] = (double)NAN;
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
    cut.client = program_open(&options->client, &error);
    const bool ok = cut.client && run(&cut, &error);
    if (!ok)
        program_print_error("pliant-cut", &error);
    program_close(cut.client);
    blade_destroy(&options->path);
    return ok ? 0 : 1;
}
