// SPDX-License-Identifier: MIT
// pliant-monitor: shows the state of a running server, in place on a terminal and line by line
// elsewhere, and records the motion of a body. One thread.
#include "curve.h"
#include "program.h"
#include "view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MONITOR_PATIENCE_S = 3 }; // limit for a daemon's first status

typedef struct Options {
    PliantOptions client;
    bool once, list, ledger;
    double duration; // [s]; 0: until a signal
    const char *body, *write, *shape, *peak;
} Options;

typedef struct Monitor {
    Options options;
    PliantClient *client;
    View view;
    Curve curve;
    bool terminal; // redraw in place
    bool unknown;  // the first status lists no body of the name to be recorded
    double status; // `received` of the last status
    PliantError why;
} Monitor;

// --- options ---

#define AT(member) offsetof(Options, member)

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_HEADING, .help = "What to show:"},
    {"once", '1', ARGUMENT_FLAG, NULL, AT(once),
     .help = "print one status and exit (status 1 if none arrives within 3 s)"},
    {"list", 0, ARGUMENT_FLAG, NULL, AT(list),
     .help =
         "list the servers on the network (prefix, scene, state, rate) that are heard within 3 s, "
         "or --duration, and exit (status 1 if none is)"},
    {"ledger", 0, ARGUMENT_FLAG, NULL, AT(ledger),
     .help = "print what became of the tissue of bodies that can be cut, and exit (status 1 if no "
             "ledger arrives within 3 s)"},
    {"duration", 'd', ARGUMENT_NUMBER, "S", AT(duration), 0.01, 1e7,
     .help = "exit after S seconds"},
    {"nodes", 'n', ARGUMENT_NAME, "BODY", AT(body), .help = "record this body, with:"},
    {"write", 'w', ARGUMENT_TEXT, "FILE", AT(write),
     .help = "its largest displacement over time, as a table"},
    {"shape", 's', ARGUMENT_TEXT, "FILE", AT(shape),
     .help = "its triangles in the last frame, for gnuplot's pm3d"},
    {"peak", 'p', ARGUMENT_TEXT, "FILE", AT(peak),
     .help = "the same for the frame of the largest displacement"},
    {.type = ARGUMENT_HEADING, .help = "Where:"},
    {.type = ARGUMENT_ROWS, .rows = PROGRAM_WHERE, .offset = AT(client)},
    {0}};

static bool check(void *target, Status *why)
{
    const Options *options = target;
    if (options->list && (options->once || options->body))
        return status_fail(why, STATUS_INVALID, "--list goes with neither --once nor --nodes");
    if (options->ledger && (options->list || options->once || options->body))
        return status_fail(why, STATUS_INVALID,
                           "--ledger goes with none of --once, --list and --nodes");
    return !options->body == !(options->write || options->shape || options->peak) ||
           status_fail(why, STATUS_INVALID,
                       "--nodes BODY goes with --write, --shape or --peak, and they with it");
}

static const ArgumentTable TABLE = {
    .program = "pliant-monitor",
    .about = "Shows the status of a running pliantd and records the motion of a body.",
    .end = "Exit status: 0 done, 1 no status arrived or a file could not be written, 2 bad usage.",
    .rows = ROWS,
    .check = check};

// --- what comes ---

// A server with other bodies will not get this one: reports it at once and ends the recording.
static void find_body(Monitor *monitor)
{
    monitor->unknown = !pliant_find_body(monitor->client, monitor->options.body);
    if (monitor->unknown)
        program_fail(&monitor->why, "%s", pliant_error(monitor->client));
}

// Takes what the last message has brought; prints a line for each elsewhere than on a terminal.
static void take(Monitor *monitor)
{
    View *view = &monitor->view;
    const bool print = !monitor->terminal && !monitor->options.once;
    const PliantStatus *status = pliant_status(monitor->client);
    if (status && status->received != monitor->status) {
        if (monitor->options.body && view->statuses == 0)
            find_body(monitor);
        view_take_status(view, status);
        monitor->status = status->received;
        if (print)
            view_print_line(view, monitor->client, stdout);
    }
    for (const PliantEvent *event; (event = pliant_next_event(monitor->client)) != NULL;) {
        view_take_event(view, event);
        if (print)
            view_print_last_event(view, stdout);
    }
    const PliantBody *body = pliant_body(monitor->client, monitor->options.body);
    if (body && (!monitor->curve.before || body->count != monitor->curve.before->count))
        curve_take(&monitor->curve, body);
    fflush(stdout);
}

// --- terminal ---

static void redraw(const Monitor *monitor)
{
    char *text = NULL;
    size_t size = 0;
    FILE *memory = open_memstream(&text, &size);
    if (!memory)
        return;
    // The text first, so that it reaches the terminal in one go.
    view_print(&monitor->view, monitor->client, memory);
    fclose(memory);
    // Go home; clear each line's end and the rest of the screen: no flicker.
    fputs("\033[H", stdout);
    for (const char *c = text; c && *c; c++) {
        if (*c == '\n')
            fputs("\033[K", stdout);
        putchar(*c);
    }
    fputs("\033[J", stdout);
    fflush(stdout);
    free(text);
}

// Truncates long lines at the margin, since wrapping would shift the text drawn in place.
static void terminal_begin(void)
{
    fputs("\033[2J\033[?7l\033[?25l", stdout);
}

static void terminal_end(void)
{
    fputs("\033[?7h\033[?25h", stdout);
    fflush(stdout);
}

// --- the loop ---

static bool client_fails(const Monitor *monitor, PliantError *error)
{
    return program_fail(error, "%s", pliant_error(monitor->client));
}

static bool watch_once(Monitor *monitor, PliantError *error)
{
    if (!pliant_wait_status(monitor->client, MONITOR_PATIENCE_S))
        return client_fails(monitor, error);
    take(monitor);
    if (monitor->unknown)
        return program_fail(error, "%s", monitor->why.text);
    view_print(&monitor->view, monitor->client, stdout);
    return true;
}

static bool print_ledger(Monitor *monitor, PliantError *error)
{
    const PliantLedger *ledger = pliant_wait_ledger(monitor->client, MONITOR_PATIENCE_S);
    if (!ledger)
        return client_fails(monitor, error);
    view_print_ledger(ledger, stdout);
    return true;
}

static bool watch(Monitor *monitor, PliantError *error)
{
    const Options *options = &monitor->options;
    const double start = pliant_now(), redraw_every = 0.2;
    const double end = start + (options->duration > 0.0 ? options->duration : HUGE_VAL);
    double drawn = start;
    bool warned = false;
    if (monitor->terminal)
        terminal_begin();
    while (!monitor->unknown && !program_stopped() && pliant_now() < end) {
        const double now = pliant_now(), next = fmin(drawn + redraw_every, end);
        if (pliant_wait_next(monitor->client, next - now) < 0)
            break;
        take(monitor);
        if (monitor->terminal && pliant_now() >= next)
            redraw(monitor);
        if (pliant_now() >= next)
            drawn = pliant_now();
        // Keeps waiting: the server may start later.
        if (!warned && monitor->view.statuses == 0 && drawn - start > MONITOR_PATIENCE_S) {
            warned = true;
            if (!pliant_wait_status(monitor->client, 0.0)) {
                client_fails(monitor, error);
                program_print_error("pliant-monitor", error);
            }
        }
    }
    if (monitor->terminal)
        terminal_end();
    // What the run ended with.
    if (monitor->unknown)
        return program_fail(error, "%s", monitor->why.text);
    if (!program_stopped() && !pliant_wait(monitor->client, 0.0))
        return client_fails(monitor, error);
    return monitor->view.statuses > 0 || pliant_wait_status(monitor->client, 0.0) ||
           client_fails(monitor, error);
}

static bool open_curve(Monitor *monitor, PliantError *error)
{
    const Options *options = &monitor->options;
    // Refuse files before anything is received.
    if ((options->shape && !program_may_write(options->shape, CURVE_SHAPE_MARK, error)) ||
        (options->peak && !program_may_write(options->peak, CURVE_SHAPE_MARK, error)))
        return false;
    if (options->write) {
        static const char head[] = "# simulated_s\tlargest_displacement_m\tnode\n";
        monitor->curve.out = program_open_output(options->write, head, error);
        if (!monitor->curve.out)
            return false;
        fputs(head, monitor->curve.out);
    }
    return true;
}

// Writes the requested files; keeps the first failure and still tries the others.
static bool close_curve(Monitor *monitor, PliantError *error)
{
    const Options *options = &monitor->options;
    const char *path[CURVE_FRAMES] = {[CURVE_LAST] = options->shape, [CURVE_PEAK] = options->peak};
    bool ok = true;
    PliantError why;
    // The curve is complete only if the disk took all of it.
    if (monitor->curve.out) {
        bool failed = ferror(monitor->curve.out) != 0;
        if (fclose(monitor->curve.out) != 0 || failed)
            ok = program_fail(error, "%s: not all could be written", options->write);
        else if (!monitor->curve.frames)
            ok = program_fail(error, "no whole frame came of body '%s'", options->body);
    }
    // A picture of the last frame and of the peak.
    for (int k = 0; k < CURVE_FRAMES; k++) {
        if (path[k] && !curve_write_shape(&monitor->curve, (CurveFrame)k, path[k], &why) && ok)
            ok = program_fail(error, "%s", why.text);
    }
    return ok;
}

static bool run(Monitor *monitor, PliantError *error)
{
    // A table of displacements can wait for the next mesh.
    if (!monitor->options.shape && !monitor->options.peak)
        pliant_only_listen(monitor->client);
    if (!pliant_hear_bodies(monitor->client, monitor->options.body != NULL))
        return client_fails(monitor, error);
    if (monitor->options.ledger)
        return print_ledger(monitor, error);
    if (!open_curve(monitor, error))
        return false;
    bool ok = monitor->options.once ? watch_once(monitor, error) : watch(monitor, error);
    PliantError late;
    if (!close_curve(monitor, &late) && ok)
        ok = program_fail(error, "%s", late.text);
    return ok;
}

// --- servers on the network ---

static bool list(const Options *options, PliantError *error)
{
    enum { MOST = 256 };
    static PliantServer server[MOST];
    const double seconds = options->duration > 0.0 ? options->duration : MONITOR_PATIENCE_S;
    const int count = pliant_servers(options->client.url, seconds, server, MOST, error);
    for (int k = 0; k < count; k++) {
        const PliantServer *s = &server[k];
        printf("%-24s ", s->prefix);
        if (s->state[0]) {
            program_print_text(stdout, s->scene, false);
            fputs("  ", stdout);
            program_print_text(stdout, s->state, false);
            printf("  %g Hz  simulated %.2f s\n", s->rate_hz, s->time);
        } else {
            puts("publishes no status");
        }
    }
    return count > 0 ||
           (count == 0 && program_fail(error, "no server was heard within %g s", seconds));
}

int main(int argc, char **argv)
{
    static Monitor monitor;
    Status status = {0};
    if (!arguments_parse(&TABLE, argc, argv, &monitor.options, &status))
        return arguments_exit(&status);
    monitor.terminal = isatty(STDOUT_FILENO) && !monitor.options.once;
    program_catch_signals();

    PliantError error;
    bool ok = false;
    if (monitor.options.list)
        ok = list(&monitor.options, &error);
    else if ((monitor.client = program_open(&monitor.options.client, &error)) != NULL)
        ok = run(&monitor, &error);
    if (!ok)
        program_print_error("pliant-monitor", &error);
    curve_destroy(&monitor.curve);
    program_close(monitor.client);
    return ok ? 0 : 1;
}
