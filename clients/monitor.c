// pliant-monitor: shows the state of a running daemon, in place on a terminal and line by line
// elsewhere, and records the motion of a body. One thread; only listens, except for one DESCRIBE
// when it needs a mesh.
#include "client.h"
#include "program.h"
#include "curve.h"
#include "view.h"
#include "wire.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "pliant_command_t.h"

enum { MONITOR_PATIENCE_S = 3 }; // limit for a daemon's first status

typedef struct Options {
    PliantOptions client;
    bool once;
    double duration; // [s]; 0: until a signal
    const char *body, *write, *shape, *peak;
} Options;

typedef struct Monitor {
    Options options;
    Client client;
    View view;
    Curve curve;
    bool terminal; // redraw in place
    bool come;     // the first status has arrived
    bool unknown;  // it lists no body of the name to be recorded
    PliantError why;
} Monitor;

// --- options ---

#define AT(member) offsetof(Options, member)

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_HEADING, .help = "What to show:"},
    {"once", '1', ARGUMENT_FLAG, NULL, AT(once),
     .help = "print one status and exit (status 1 if none arrives within 3 s)"},
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

// A daemon with other bodies will not get this one: reports it at once and ends the recording.
static void find_body(Monitor *monitor, const pliant_status_t *status)
{
    ClientBodies bodies = {.wanted = monitor->options.body};
    for (int i = 0; i < status->num_bodies; i++)
        client_bodies_add(&bodies, status->body[i].name);
    monitor->unknown = bodies.count > 0 && !client_bodies_check(&bodies, &monitor->why);
}

static void on_status(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Monitor *monitor = user;
    pliant_status_t status;
    if (!wire_check(&WIRE_STATUS, buffer->data, buffer->data_size) ||
        pliant_status_t_decode(buffer->data, 0, (int)buffer->data_size, &status) < 0)
        return;
    // Show it; the first one says whether the body is there.
    view_take_status(&monitor->view, &status, client_now_ns());
    if (monitor->options.body != NULL && !monitor->come)
        find_body(monitor, &status);
    pliant_status_t_decode_cleanup(&status);
    monitor->come = true;
    // Elsewhere than on a terminal a line for each status.
    if (!monitor->terminal && !monitor->options.once) {
        view_print_line(&monitor->view, stdout);
        fflush(stdout);
    }
}

static void on_event(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Monitor *monitor = user;
    pliant_event_t event;
    if (!wire_check(&WIRE_EVENT, buffer->data, buffer->data_size) ||
        pliant_event_t_decode(buffer->data, 0, (int)buffer->data_size, &event) < 0)
        return;
    view_take_event(&monitor->view, &event);
    pliant_event_t_decode_cleanup(&event);
    if (!monitor->terminal && !monitor->options.once) {
        view_print_last_event(&monitor->view, stdout);
        fflush(stdout);
    }
}

static void on_contact(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Monitor *monitor = user;
    pliant_contact_t contact;
    if (wire_check(&WIRE_CONTACT, buffer->data, buffer->data_size) &&
        pliant_contact_t_decode(buffer->data, 0, (int)buffer->data_size, &contact) >= 0)
        view_take_contact(&monitor->view, &contact, client_now_ns());
}

static void on_nodes(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    curve_take_nodes(&((Monitor *)user)->curve, buffer->data, buffer->data_size);
}

static void on_mesh(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    curve_take_mesh(&((Monitor *)user)->curve, buffer->data, buffer->data_size);
}

static void on_delta(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    curve_take_delta(&((Monitor *)user)->curve, buffer->data, buffer->data_size);
}

static bool subscribe(Monitor *monitor, PliantError *error)
{
    Client *client = &monitor->client;
    const char *body = monitor->options.body;
    bool ok = client_subscribe(client, "STATUS", NULL, 16, on_status, monitor) &&
              client_subscribe(client, "EVENT", NULL, 256, on_event, monitor) &&
              client_subscribe(client, "CONTACT", NULL, 1024, on_contact, monitor);
    // Only a curve needs the body itself.
    if (ok && body)
        ok = client_subscribe(client, "NODES", body, 4096, on_nodes, monitor) &&
             client_subscribe(client, "POINTS", body, 4096, on_nodes, monitor) &&
             client_subscribe(client, "MESH", body, 4096, on_mesh, monitor) &&
             client_subscribe(client, "MESH_DELTA", body, 4096, on_delta, monitor);
    return ok ? true : client_fail(error, "LCM refuses to subscribe to %s_*", client->prefix);
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
    view_print(&monitor->view, memory, client_now_ns());
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

static bool none_came(const Monitor *monitor, PliantError *error)
{
    return client_fail(error,
                       "no %s_STATUS within %d s: no pliantd on %s, or one with another prefix?",
                       monitor->client.prefix, MONITOR_PATIENCE_S, monitor->client.url);
}

static bool watch_once(Monitor *monitor, PliantError *error)
{
    int64_t deadline = client_now_ns() + (int64_t)MONITOR_PATIENCE_S * 1000000000;
    client_wait(&monitor->client, deadline, &monitor->come);
    if (!monitor->come)
        return none_came(monitor, error);
    if (monitor->unknown)
        return client_fail(error, "%s", monitor->why.text);
    view_print(&monitor->view, stdout, client_now_ns());
    return true;
}

static bool watch(Monitor *monitor, PliantError *error)
{
    const Options *options = &monitor->options;
    const int64_t start = client_now_ns();
    const int64_t end =
        options->duration > 0.0 ? start + (int64_t)(options->duration * 1e9) : INT64_MAX;
    if (monitor->terminal)
        terminal_begin();
    bool waited = true, warned = false;
    // Look five times a second at what the messages have brought.
    for (int64_t next = start; waited && !monitor->unknown && client_now_ns() < end;) {
        next += 200000000;
        waited = client_wait(&monitor->client, next < end ? next : end, &monitor->unknown);
        if (monitor->terminal)
            redraw(monitor);
        bool silent = !monitor->come && client_now_ns() - start > MONITOR_PATIENCE_S * 1000000000LL;
        if (silent && !warned) { // keep waiting: the daemon may start later
            none_came(monitor, error);
            warned = true;
            program_print_error("pliant-monitor", error);
        }
    }
    if (monitor->terminal)
        terminal_end();
    // What the run ended with.
    if (monitor->client.broken)
        return client_fail(error, "the LCM connection failed");
    if (monitor->unknown)
        return client_fail(error, "%s", monitor->why.text);
    return monitor->come ? true : none_came(monitor, error);
}

static bool open_curve(Monitor *monitor, PliantError *error)
{
    const Options *options = &monitor->options;
    // Refuse files before anything is received.
    if ((options->shape && !program_may_write(options->shape, CURVE_SHAPE_MARK, error)) ||
        (options->peak && !program_may_write(options->peak, CURVE_SHAPE_MARK, error)))
        return false;
    PliantError ignored; // the daemon may start later, and sends its mesh every second too
    if (options->write) {
        static const char head[] = "# simulated_s\tlargest_displacement_m\tnode\n";
        monitor->curve.out = program_open_output(options->write, head, error);
        if (!monitor->curve.out)
            return false;
        fputs(head, monitor->curve.out);
    }
    if (options->shape || options->peak)
        client_request(&monitor->client, PLIANT_COMMAND_T_DESCRIBE, 0, "", 0.5, 2, &ignored);
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
            ok = client_fail(error, "%s: not all could be written", options->write);
        else if (!monitor->curve.frames)
            ok = client_fail(error, "no whole frame came on %s_NODES_%s", monitor->client.prefix,
                             options->body);
    }
    // A picture of the last frame and of the peak.
    for (int k = 0; k < CURVE_FRAMES; k++) {
        if (path[k] && !curve_write_shape(&monitor->curve, (CurveFrame)k, path[k], &why) && ok)
            ok = client_fail(error, "%s", why.text);
    }
    return ok;
}

static bool run(Monitor *monitor, PliantError *error)
{
    if (!subscribe(monitor, error) || !open_curve(monitor, error))
        return false;
    bool ok = monitor->options.once ? watch_once(monitor, error) : watch(monitor, error);
    PliantError late;
    if (!close_curve(monitor, &late) && ok)
        ok = client_fail(error, "%s", late.text);
    return ok;
}

int main(int argc, char **argv)
{
    static Monitor monitor;
    Status status = {0};
    if (!arguments_parse(&TABLE, argc, argv, &monitor.options, &status))
        return arguments_exit(&status);
    monitor.terminal = isatty(STDOUT_FILENO) && !monitor.options.once;
    program_catch_signals();

    PliantError error = {0};
    bool ok = client_connect(&monitor.client, &monitor.options.client, &error) &&
              program_stops(client_stop, &monitor.client) && run(&monitor, &error);
    if (!ok)
        program_print_error("pliant-monitor", &error);
    client_disconnect(&monitor.client);
    view_destroy(&monitor.view);
    curve_destroy(&monitor.curve);
    return ok ? 0 : 1;
}
