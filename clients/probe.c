// SPDX-License-Identifier: MIT
// pliant-probe: drives one tool along a path, by a press that finds the body, or from the keyboard,
// and shows the force on the tool. One thread, poses at absolute deadlines; withdraws the tool at
// the end.
#include "aim.h"
#include "device.h"
#include "hand_run.h"
#include "keys.h"
#include "program.h"
#include "track.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define AUTO_BEGINS 0.05  // --auto that touches sooner begins in the body [s]
#define AUTO_APART  1e-3  // so does one that the server leads out by more than this [m]
#define STALE_US    10000 // in which the server follows a step back [us]
#define AUTO_REACH  0.1   // how far --auto searches beyond the body's nearest node [m]

typedef enum Mode { MODE_NONE, MODE_POSES, MODE_PRESS, MODE_AUTO, MODE_KEYS } Mode;

typedef struct Options {
    PliantOptions client;
    Mode mode;
    bool keys, aim;
    bool hand, hand_table; // a hand on a device, after the approach
    HandOptions by;        // the hand
    int tool, repeat;
    const char *poses, *body, *log;
    double start[3], direction[3];      // [m] (x NaN: not given), unit
    double rate_hz, depth, speed, hold; // [Hz], [m], [m/s], [s]
    double clearance, step, timeout_s;  // [m], [m], [s]
    Grip grip;
    bool devised; // a device spoils what is sent
    DeviceOptions device;
} Options;

typedef struct Probe {
    Options options;
    PliantClient *client;
    Track track;
    FILE *log;
    int64_t start_ns; // of the path
    // what is sent
    TrackPose pose;
    bool active;
    int64_t poses, missed; // missed: deadlines that had passed
    Device device;
    int64_t device_ns, device_utime; // time 0 of the device; 0: it has not begun [ns], [us]
    // what comes back
    double received;           // of the last contact that was taken
    PliantContact contact;     // the last one computed for a pose of ours
    int64_t contact_ns;        // its arrival; 0: none yet
    int64_t contacts, foreign; // foreign: of our tool, but for another client's pose
    double begun;              // --auto: when what is felt counts [s]
    double apart;              // of the tool from our pose [m]
    int64_t stale;             // contacts of poses up to this utime are of before it stepped back
    bool touched, deepened;    // --auto deepens its press at the first contact
    double force_max, force_sum, depth_max;
    int64_t touching;
    char refusal[256];
    // a hand
    HandRun run;
    bool no_twist;
    // keyboard
    double target[3];
    bool leave;
} Probe;

// --- options ---

static bool take_grip(void *target, const char *text, Status *why)
{
    return grip_parse(text, &((Options *)target)->grip) ||
           status_fail(why, STATUS_INVALID,
                       "is not G or T:G,T:G,... with G inside [0, 1] and seconds T that do not "
                       "fall");
}

static bool take_device(void *target, const char *text, Status *why)
{
    Options *options = target;
    options->devised = true;
    return device_parse(text, &options->device, why);
}

#define AT(member) offsetof(Options, member)
#define REACH      -TRACK_REACH, TRACK_REACH

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_HEADING, .help = "What to do (one of):"},
    {"auto", 'a', ARGUMENT_FLAG, NULL, AT(aim),
     .help = "press the first body at its nearest point along --direction (a flat side: at its "
             "middle)"},
    {"press", 'p', ARGUMENT_NUMBERS, "X,Y,Z", AT(start), REACH,
     .help = "press from this point [m] along --direction"},
    {"poses", 'f', ARGUMENT_TEXT, "FILE", AT(poses),
     .help = "follow the lines 't x y z [qw qx qy qz]' of a text file"},
    {"keys", 'k', ARGUMENT_FLAG, NULL, AT(keys),
     .help = "w/s, a/d, q/e or arrows move the tool by --step, g closes or opens jaws, space "
             "withdraws it, x exits; starts at --press or --auto"},
    {"hand", 0, ARGUMENT_FLAG, NULL, AT(hand),
     .help = "with --press (from there) or --auto (from the first contact): simulate a hand that "
             "moves in and out sinusoidally, on a 1 kHz device that renders F - K (x - x of F) "
             "between messages; prints the work of the hand and how much of it was dissipated "
             "(negative: the loop was active)"},
    {"hand-table", 0, ARGUMENT_FLAG, NULL, AT(hand_table),
     .help = "the same for a table of rates, latencies and losses"},
    {.type = ARGUMENT_HEADING, .help = "How:"},
    {"tool", 't', ARGUMENT_INTEGER, "ID", AT(tool), INT32_MIN, INT32_MAX, .preset = 1,
     .help = "id of the tool in the scene"},
    {"rate", 'r', ARGUMENT_NUMBER, "HZ", AT(rate_hz), 1.0, 10000.0, .preset = 1000.0,
     .help = "poses per second"},
    {"direction", 'd', ARGUMENT_NUMBERS, "X,Y,Z", AT(direction), REACH, .preset_text = "0,0,-1",
     .help = "of the press; the tool's z axis points the other way"},
    {"depth", 'D', ARGUMENT_NUMBER, "M", AT(depth), 0.0, 10.0, .preset = -1.0,
     .help = "of the press; with --auto from the first contact (default: 0.01, of --hand 0.006)"},
    {"speed", 's', ARGUMENT_NUMBER, "M/S", AT(speed), 1e-5, 10.0, .preset = 0.02,
     .help = "of the tool"},
    {"hold", 'H', ARGUMENT_NUMBER, "S", AT(hold), 0.0, 1e5, .preset = 1.0,
     .help = "time at the deepest point"},
    {"repeat", 'n', ARGUMENT_INTEGER, "N", AT(repeat), 1, 100000,
     .help = "number of presses (default: 1); of --hand: of measured cycles (default: 3)"},
    {"clearance", 'c', ARGUMENT_NUMBER, "M", AT(clearance), 0.0, 10.0, .preset = 0.01,
     .help = "of --auto: distance from the body at the start"},
    {"body", 'b', ARGUMENT_NAME, "NAME", AT(body),
     .help = "of --auto: the body (default: the first that replies)"},
    {"step", 'S', ARGUMENT_NUMBER, "MM", AT(step), 0.01, 100.0, .factor = 1e-3, .preset = 1.0,
     .help = "of --keys, in millimetres"},
    {"grip", 'g', ARGUMENT_OTHER, "G|T:G,...", .handler = take_grip,
     .help = "of a grasper: 0 open, 1 closed (from 0.5 on), or points in seconds since the start"},
    {"device", 0, ARGUMENT_OTHER, "ITEM,...", .handler = take_device,
     .help = "send what arrives of a real device: noise=S (Gaussian, on each coordinate [m]), "
             "quantum=S (encoder step [m]), rate=HZ, gap=LENGTH/EVERY (no poses [s]), "
             "wrong=D/EVERY (one pose off by D [m]), late=S, jitter=S (|N(0, S)| later), reorder=S "
             "(up to S later, so that poses overtake [s]), loss=SHARE, duplicate, seed=N"},
    {"frequency", 'F', ARGUMENT_NUMBER, "HZ", AT(by.frequency), 0.01, 100.0, .preset = 2.0,
     .help = "of --hand"},
    {"latency", 'L', ARGUMENT_NUMBER, "MS", AT(by.latency), 0.0, 500.0, .factor = 1e-3,
     .help = "of --hand: added latency of the round trip, in milliseconds"},
    {"loss", 0, ARGUMENT_NUMBER, "PERCENT", AT(by.loss), 0.0, 90.0, .factor = 1e-2,
     .help = "of --hand: share of poses that are lost"},
    {"no-stiffness", 'K', ARGUMENT_FLAG, NULL, AT(by.stiffness), .preset = 1,
     .help = "of --hand: render forces as they arrive, K = 0"},
    {"no-twist", 'W', ARGUMENT_FLAG, NULL, AT(by.twist), .preset = 1,
     .help = "send poses without velocity"},
    {"max-force", 'M', ARGUMENT_NUMBER, "N", AT(by.max_force), 0.0, 1e6, .preset = 3.3,
     .help = "of --hand: largest force of the device"},
    {"log", 'o', ARGUMENT_TEXT, "FILE", AT(log),
     .help = "write pose, force, torque, depth and round-trip time as a table"},
    {"timeout", 'T', ARGUMENT_NUMBER, "S", AT(timeout_s), 0.1, 3600.0, .preset = 3.0,
     .help = "give up when no force arrives for this long"},
    {.type = ARGUMENT_HEADING, .help = "Where:"},
    {.type = ARGUMENT_ROWS, .rows = PROGRAM_WHERE, .offset = AT(client)},
    {0}};

static bool choose_mode(Options *options, Status *why)
{
    const bool press = !isnan(options->start[0]);
    // One way to drive the tool.
    const int ways = (options->poses != NULL) + press + options->aim;
    if (ways > 1 || (options->poses && options->keys))
        return status_fail(why, STATUS_INVALID,
                           "give one of --auto, --press, --poses (--keys goes with the first two)");
    if (ways == 0 && !options->keys)
        return status_fail(why, STATUS_INVALID,
                           "give one of --auto, --press X,Y,Z, --poses FILE, --keys");
    // What was given decides the mode.
    options->mode = options->keys    ? MODE_KEYS
                    : options->poses ? MODE_POSES
                    : options->aim   ? MODE_AUTO
                                     : MODE_PRESS;
    options->hand |= options->hand_table;
    if (!press)
        options->start[0] = 0.0;
    return !options->hand || options->mode == MODE_AUTO || options->mode == MODE_PRESS ||
           status_fail(why, STATUS_INVALID, "--hand goes with --auto or --press");
}

static bool check(void *target, Status *why)
{
    Options *options = target;
    if (!choose_mode(options, why))
        return false;
    // What was not given depends on whether a hand presses.
    if (options->depth < 0.0)
        options->depth = options->hand ? 0.006 : 0.01;
    if (options->repeat == 0)
        options->repeat = options->hand ? 3 : 1;
    // The ideal motion is known at least as often as the device asks.
    options->rate_hz = fmax(options->rate_hz, options->device.rate_hz);
    options->by.depth = options->depth;
    options->by.rate_hz = options->rate_hz;
    // The direction as a unit vector.
    double *d = options->direction, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (!(length > 1e-9))
        return status_fail(why, STATUS_INVALID, "--direction %g,%g,%g has no length", d[0], d[1],
                           d[2]);
    for (int k = 0; k < 3; k++)
        d[k] /= length;
    return true;
}

static const ArgumentTable TABLE = {
    .program = "pliant-probe",
    .about = "Moves one tool of a running pliantd and shows the force on it.",
    .end = "Exit status: 0 done, 1 no answer from the daemon, 2 bad usage.",
    .rows = ROWS,
    .check = check};

// --- what comes back ---

static double length_of(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void write_log_row(Probe *probe, double trip)
{
    const PliantContact *c = &probe->contact;
    const double *x = probe->pose.position;
    fprintf(probe->log,
            "%.6f\t%.6f\t%.9g\t%.9g\t%.9g\t%.9g\t%.9g\t%.9g\t%.9g\t%.9g\t%.9g\t%.9g\t%d\t%.0f\n",
            (double)(probe->contact_ns - probe->start_ns) * 1e-9, c->time, x[0], x[1], x[2],
            c->force[0], c->force[1], c->force[2], c->torque[0], c->torque[1], c->torque[2],
            c->depth, c->contact, trip > 0.0 ? 1e6 * trip : (double)NAN);
}

static void take_contact(Probe *probe, const PliantContact *contact)
{
    const double trip = pliant_contact_trip(probe->client, contact->tool);
    probe->received = contact->received;
    if (trip < 0.0) { // computed for another client's pose
        probe->foreign++;
        return;
    }
    probe->contact = *contact;
    probe->contact_ns = program_now_ns();
    probe->contacts++;
    double way[3];
    for (int k = 0; k < 3; k++)
        way[k] = contact->position[k] - probe->pose.position[k];
    probe->apart = length_of(way);
    // Its figures for the summary.
    double force = length_of(contact->force);
    if (contact->contact) {
        probe->touched = true;
        probe->touching++;
        probe->force_sum += force;
        probe->force_max = fmax(probe->force_max, force);
        probe->depth_max = fmax(probe->depth_max, contact->depth);
    }
    hand_run_hear(&probe->run, contact);
    if (probe->log)
        write_log_row(probe, trip);
}

// Takes what the last message has brought.
static void take(Probe *probe)
{
    const PliantContact *contact = pliant_contact(probe->client, probe->options.tool);
    if (contact && contact->received != probe->received)
        take_contact(probe, contact);
    for (const PliantEvent *event; (event = pliant_next_event(probe->client)) != NULL;) {
        if (strcmp(event->kind, "refused") == 0)
            snprintf(probe->refusal, sizeof probe->refusal, "%s", event->text);
    }
}

// --- what is sent ---

// Sends what the device has delivered by now.
static void deliver(Probe *probe)
{
    DevicePose came;
    const double now = (double)(program_now_ns() - probe->device_ns) * 1e-9;
    for (; device_take(&probe->device, now, &came); probe->poses++)
        pliant_pose_as(probe->client, &came.pose, came.number + 1,
                       probe->device_utime + llround(1e6 * came.time));
}

// Handles messages, and sends, until then; false if it was stopped, or the connection is broken.
static bool wait_until(void *user, int64_t until_ns)
{
    Probe *probe = user;
    for (;;) {
        deliver(probe);
        const int64_t now = program_now_ns(), left = until_ns - now;
        const double due = device_next(&probe->device) - (double)(now - probe->device_ns) * 1e-9;
        const int news = pliant_wait_next(probe->client, fmin(1e-9 * (double)left, due));
        if (news > 0)
            take(probe);
        if (news < 0 || left <= 0 || (news == 0 && program_now_ns() >= until_ns))
            return news >= 0;
    }
}

static PliantPose make_pose(const Probe *probe)
{
    const TrackPose *pose = &probe->pose;
    PliantPose message = {
        .tool = probe->options.tool, .moving = !probe->no_twist, .active = probe->active};
    // The grip follows its own course from the start.
    if (probe->active && probe->start_ns > 0)
        message.grip =
            grip_at(&probe->options.grip, (double)(program_now_ns() - probe->start_ns) * 1e-9);
    memcpy(message.position, pose->position, sizeof message.position);
    memcpy(message.orientation, pose->orientation, sizeof message.orientation);
    memcpy(message.linear, pose->linear, sizeof message.linear);
    memcpy(message.angular, pose->angular, sizeof message.angular);
    return message;
}

// Sends the pose of this time, through the device if there is one.
static void send_pose(Probe *probe, int64_t time_ns)
{
    const PliantPose pose = make_pose(probe);
    if (!probe->options.devised) {
        pliant_pose(probe->client, &pose);
        probe->poses++;
        return;
    }
    if (probe->device_ns == 0) {
        struct timespec now;
        clock_gettime(CLOCK_REALTIME, &now);
        probe->device_ns = time_ns;
        probe->device_utime = (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
    }
    device_send(&probe->device, (double)(time_ns - probe->device_ns) * 1e-9, &pose);
    deliver(probe);
}

// Waits until all has arrived.
static void drain(Probe *probe)
{
    for (double due; isfinite(due = device_next(&probe->device));) {
        if (!wait_until(probe, probe->device_ns + (int64_t)ceil(1e9 * due)))
            return;
    }
}

// Repeats it, because a lost datagram would leave the tool in the tissue until its time-out.
static void withdraw(Probe *probe)
{
    probe->active = false;
    memset(probe->pose.linear, 0, sizeof probe->pose.linear);
    memset(probe->pose.angular, 0, sizeof probe->pose.angular);
    const PliantPose pose = make_pose(probe);
    for (int k = 0; k < 3; k++)
        pliant_pose(probe->client, &pose);
    probe->poses += 3;
}

// --- paths ---

// --auto, of a tool that is wider than its clearance, and so begins in the body: begins farther
// away.
static void step_back(Probe *probe, double begun)
{
    Options *options = &probe->options;
    const double back = options->clearance + fmax(probe->contact.depth, probe->apart);
    for (int k = 0; k < 3; k++)
        options->start[k] -= back * options->direction[k];
    track_destroy(&probe->track);
    track_press(&probe->track, options->start, options->direction,
                options->clearance + back + AUTO_REACH, options->speed, 0.0, 1);
    probe->begun = begun;
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now); // as poses are stamped
    probe->stale = now.tv_sec * INT64_C(1000000) + now.tv_nsec / 1000 + STALE_US;
    printf("the tool begins in the body; starting %.1f mm farther away\n", 1e3 * back);
}

// --auto, at the first contact: extends the current press to the required depth from here. Start
// and speed stay the same, so the tool does not jump.
static void deepen(Probe *probe, double time)
{
    const Options *options = &probe->options;
    double gone = time * options->speed;
    track_destroy(&probe->track);
    track_press(&probe->track, options->start, options->direction, gone + options->depth,
                options->speed, options->hold, options->repeat);
    probe->deepened = true;
    printf("touched after %.1f mm; pressing %.1f mm deeper\n", 1e3 * gone, 1e3 * options->depth);
}

static void handle_key(Probe *probe, int key)
{
    static const struct {
        int key, arrow, axis, sign;
    } MOVES[] = {{'w', KEY_UP, 1, 1},    {'s', KEY_DOWN, 1, -1}, {'a', KEY_LEFT, 0, -1},
                 {'d', KEY_RIGHT, 0, 1}, {'e', KEY_NONE, 2, 1},  {'q', KEY_NONE, 2, -1}};
    // Keys move the target; the tool follows at its speed.
    for (size_t k = 0; k < sizeof MOVES / sizeof MOVES[0]; k++) {
        if (key == MOVES[k].key || (key == MOVES[k].arrow && key != KEY_NONE)) {
            double *x = &probe->target[MOVES[k].axis];
            *x = fmax(-TRACK_REACH, fmin(TRACK_REACH, *x + MOVES[k].sign * probe->options.step));
        }
    }
    // Others lift the tool, close its jaws, or end the program.
    if (key == ' ')
        probe->active = !probe->active;
    if (key == 'g')
        probe->options.grip =
            (Grip){.count = 1, .value = {probe->options.grip.value[0] < 0.5 ? 1.0 : 0.0}};
    probe->leave |= key == 'x';
}

// Moves the tool to the point chosen by keys, at most with --speed.
static void follow_keys(Probe *probe, double period)
{
    for (int key = keys_read(); key != KEY_NONE; key = keys_read())
        handle_key(probe, key);
    double way[3], *x = probe->pose.position;
    for (int k = 0; k < 3; k++)
        way[k] = probe->target[k] - x[k];
    double left = length_of(way), move = fmin(left, probe->options.speed * period);
    for (int k = 0; k < 3; k++) {
        double share = left > 0.0 ? way[k] / left : 0.0;
        x[k] += move * share;
        probe->pose.linear[k] = move * share / period;
    }
}

// Returns the pose at `time`; false after the end of the path.
static bool next_pose(Probe *probe, double time, double period)
{
    if (probe->options.mode == MODE_KEYS) {
        follow_keys(probe, period);
        return !probe->leave;
    }
    // Before a quarter of its way to the body a tool should not feel it. What it felt before it
    // stepped back is still on the way for as long.
    const double soon = fmin(AUTO_BEGINS, 0.25 * probe->options.clearance / probe->options.speed);
    // Since its start it has gone no farther than this, which the last contact need not know.
    const double gone = probe->options.speed * time;
    const bool led_out = probe->begun == 0.0 && probe->apart > AUTO_APART + gone;
    // A slow server still tells of poses from before.
    const bool stale = probe->begun > 0.0 && probe->contact.pose_utime <= probe->stale;
    if (probe->options.mode == MODE_AUTO && (probe->touched || led_out) && !probe->deepened &&
        (time < probe->begun + soon || stale)) {
        probe->touched = false;
        if (time >= probe->begun && !stale)
            step_back(probe, time + soon);
    }
    if (probe->options.mode == MODE_AUTO && probe->touched && probe->options.hand)
        return false; // the keyboard takes over here
    if (probe->options.mode == MODE_AUTO && probe->touched && !probe->deepened)
        deepen(probe, time);
    track_at(&probe->track, time, &probe->pose);
    return time <= track_duration(&probe->track);
}

static bool prepare_path(Probe *probe, PliantError *error)
{
    Options *options = &probe->options;
    if (options->mode == MODE_POSES)
        return true; // read before connecting
    if (options->aim) {
        Aim aim = {.body = ""};
        snprintf(aim.body, sizeof aim.body, "%s", options->body ? options->body : "");
        if (!aim_find(probe->client, options->direction, &aim, error))
            return false;
        for (int k = 0; k < 3; k++)
            options->start[k] = aim.node[k] - options->clearance * options->direction[k];
        printf("body '");
        program_print_text(stdout, aim.body, false);
        printf("': nearest node at %.4f %.4f %.4f m, starting %.1f mm before it\n", aim.node[0],
               aim.node[1], aim.node[2], 1e3 * options->clearance);
    }
    bool automatic = options->mode == MODE_AUTO; // depth counts from the first contact
    track_press(&probe->track, options->start, options->direction,
                automatic ? options->clearance + AUTO_REACH : options->depth, options->speed,
                automatic ? 0.0 : options->hold, automatic ? 1 : options->repeat);
    memcpy(probe->target, options->start, sizeof probe->target);
    track_at(&probe->track, 0.0, &probe->pose);
    if (options->mode == MODE_KEYS && !keys_open())
        return program_fail(error, "--keys: standard input is not a terminal");
    return true;
}

// --- the loop ---

static void print_line(const Probe *probe, double time, const char *end)
{
    const PliantContact *c = &probe->contact;
    const double *x = probe->pose.position;
    printf("%7.2f s  pose %8.4f %8.4f %8.4f m  force %7.3f %7.3f %7.3f N  |F| %6.3f N  depth %6.2f "
           "mm  %s%s",
           time, x[0], x[1], x[2], c->force[0], c->force[1], c->force[2], length_of(c->force),
           1e3 * c->depth,
           !probe->active ? "withdrawn"
           : c->contact   ? "contact  "
                          : "free     ",
           end);
    fflush(stdout);
}

// Explains from the other messages why no contact of ours arrives.
static bool explain_silence(Probe *probe, PliantError *error)
{
    const int tool = probe->options.tool, tools = pliant_tool_count(probe->client);
    const char *refusal = pliant_refusal(probe->client);
    const char *prefix = probe->options.client.prefix;
    const PliantStatus *status = pliant_status(probe->client);
    char others[128] = "";
    for (int k = 0; k < tools; k++) {
        size_t used = strlen(others);
        snprintf(others + used, sizeof others - used, "%s%d", k ? ", " : "",
                 pliant_tool(probe->client, k)->tool);
    }
    // What was heard tells what is missing; the surest sign comes first.
    if (probe->foreign && refusal)
        return program_fail(error, "the daemon has tool %d, but does not use our poses: %s", tool,
                            refusal);
    if (probe->foreign)
        return program_fail(error,
                            "the daemon has tool %d, but does not use our poses: another sender "
                            "drives it, or they are refused%s%s",
                            tool, probe->refusal[0] ? ": " : "", probe->refusal);
    if (tools > 0)
        return program_fail(error, "no %s_CONTACT of tool %d: the daemon has tools %s (--tool ID)",
                            prefix, tool, others);
    if (refusal)
        return program_fail(error, "no %s_CONTACT: %s", prefix, refusal);
    if (probe->refusal[0])
        return program_fail(error, "the daemon refuses the poses: %s", probe->refusal);
    if (status)
        return program_fail(error,
                            "the daemon (%s) sends %s_STATUS but no %s_CONTACT: has its scene tool "
                            "%d, is publish.contact_hz 0, or is it paused?",
                            status->state, prefix, prefix, tool);
    return program_fail(error,
                        "no %s_CONTACT within %g s: no pliantd on %s, or one with another prefix "
                        "(--prefix)?",
                        prefix, probe->options.timeout_s, pliant_network(probe->client));
}

static bool drive(Probe *probe, PliantError *error)
{
    const Options *options = &probe->options;
    const double period = 1.0 / options->rate_hz;
    const int64_t period_ns = (int64_t)llround(period * 1e9);
    const bool live = options->mode == MODE_KEYS;
    const double print_every = live ? 0.1 : 1.0;
    double printed = 0.0;
    probe->active = true;
    probe->no_twist = !options->by.twist;
    probe->start_ns = program_now_ns();
    // Poses at absolute deadlines; between them, messages.
    for (int64_t tick = 0;; tick++) {
        const int64_t now = program_now_ns(), behind = (now - probe->start_ns) / period_ns - tick;
        if (behind > 1) { // the process was stopped: continue from now, without a burst
            probe->missed += behind;
            tick += behind;
        }
        double time = (double)tick * (double)period_ns * 1e-9;
        if (!next_pose(probe, time, period))
            break;
        send_pose(probe, probe->start_ns + tick * period_ns);
        if (time >= printed + print_every) {
            print_line(probe, time, live ? "\r" : "\n");
            printed = time;
        }
        // No contact for too long: the daemon is gone, or the tool is not ours.
        int64_t heard = probe->contact_ns ? probe->contact_ns : probe->start_ns;
        if ((double)(now - heard) * 1e-9 > options->timeout_s)
            return explain_silence(probe, error);
        if (!wait_until(probe, probe->start_ns + (tick + 1) * period_ns))
            break;
    }
    // The last line stays.
    if (live)
        putchar('\n');
    // What the whole run tells.
    if (!program_stopped() && pliant_wait_next(probe->client, 0.0) < 0)
        return program_fail(error, "%s", pliant_error(probe->client));
    if (!probe->contacts)
        return explain_silence(probe, error);
    if (options->mode == MODE_AUTO && !probe->touched && !program_stopped())
        return program_fail(error, "the tool went %.0f mm and never touched the body",
                            1e3 * (options->clearance + AUTO_REACH));
    return true;
}

static void print_summary(const Probe *probe)
{
    printf("poses sent %lld (%lld deadlines missed), contacts received %lld, touching %lld\n",
           (long long)probe->poses, (long long)probe->missed, (long long)probe->contacts,
           (long long)probe->touching);
    const Device *device = &probe->device;
    if (probe->options.devised)
        printf("device: %d samples, %d in gaps; %lld messages lost, %lld arrived, %lld overtaken\n",
               device->samples, device->silent, (long long)device->lost, (long long)device->arrived,
               (long long)device->overtaken);
    printf("force max %.4f N, mean while touching %.4f N, depth max %.2f mm\n", probe->force_max,
           probe->touching ? probe->force_sum / (double)probe->touching : 0.0,
           1e3 * probe->depth_max);
    const PliantClient *client = probe->client;
    if (pliant_round_trips(client) > 0)
        printf("round trip min %.0f us, p50 %.0f us, p99 %.0f us (%lld measured)\n",
               1e6 * pliant_round_trip(client, 0.0), 1e6 * pliant_round_trip(client, 0.5),
               1e6 * pliant_round_trip(client, 0.99), (long long)pliant_round_trips(client));
}

#define LOG_MARK "# time_s\tsimulated_s\t"

static bool open_log(Probe *probe, PliantError *error)
{
    const char *path = probe->options.log;
    if (!path)
        return true;
    probe->log = program_open_output(path, LOG_MARK, error);
    if (!probe->log)
        return false;
    fputs(LOG_MARK "x_m\ty_m\tz_m\tfx_n\tfy_n\tfz_n\ttx_nm\tty_nm\ttz_nm\tdepth_m\t"
                   "contact\tround_trip_us\n",
          probe->log);
    return true;
}

static bool close_log(Probe *probe, PliantError *error)
{
    bool failed = probe->log && ferror(probe->log);
    if (probe->log && fclose(probe->log) != 0)
        failed = true;
    probe->log = NULL;
    return failed ? program_fail(error, "%s: not all could be written", probe->options.log) : true;
}

static void send_hand(void *user, int64_t now_ns, const double position[3], const double linear[3],
                      bool twist)
{
    Probe *probe = user;
    memcpy(probe->pose.position, position, sizeof probe->pose.position);
    memcpy(probe->pose.linear, linear, sizeof probe->pose.linear);
    probe->no_twist = !twist;
    send_pose(probe, now_ns);
}

// Starts the hand where the approach ended, or at --press.
static bool feel(Probe *probe, PliantError *error)
{
    const Options *options = &probe->options;
    HandRun *hand = &probe->run;
    // The run sends poses and hears forces through this program's tool.
    probe->active = true;
    hand->send = send_hand;
    hand->wait = wait_until;
    hand->user = probe;
    hand->cycles = options->repeat;
    memcpy(hand->touch, probe->pose.position, sizeof hand->touch);
    memcpy(hand->direction, options->direction, sizeof hand->direction);
    memset(probe->pose.angular, 0, sizeof probe->pose.angular);
    // One stream, or a table of many.
    bool ok = options->hand_table ? hand_run_table(hand, &options->by, error)
                                  : hand_run(hand, &options->by, error);
    if (ok && probe->contacts == 0)
        return explain_silence(probe, error);
    if (ok && !options->hand_table)
        hand_run_print(hand);
    return ok;
}

static bool describe(PliantClient *client, double seconds)
{
    (void)seconds; // as often as any request
    return pliant_describe(client) != NULL;
}

static bool run(Probe *probe, PliantError *error)
{
    const char *log = probe->options.log;
    // Refuse files before the tool moves.
    if (log && !program_may_write(log, LOG_MARK, error))
        return false;
    if (!pliant_hear_bodies(probe->client, false))
        return program_fail(error, "%s", pliant_error(probe->client));
    // --auto asks; a server that publishes no status answers, too.
    if (!program_await_server(probe->client, probe->options.aim ? describe : pliant_wait_server,
                              probe->options.timeout_s, error))
        return false;
    // Find the place, then touch the body and move.
    if (!prepare_path(probe, error) || !open_log(probe, error))
        return false;
    const bool hand = probe->options.hand, approach = !hand || probe->options.mode == MODE_AUTO;
    bool ok = (!approach || drive(probe, error)) && (!hand || feel(probe, error));
    if (ok)
        drain(probe);
    // Withdraw the tool whatever happened.
    withdraw(probe);
    keys_close();
    if (ok)
        print_summary(probe);
    PliantError late;
    if (!close_log(probe, &late) && ok)
        ok = program_fail(error, "%s", late.text);
    return ok;
}

int main(int argc, char **argv)
{
    static Probe probe; // large, and all zero: no space in the file
    Status status = {0};
    probe.options.start[0] = (double)NAN;
    if (!arguments_parse(&TABLE, argc, argv, &probe.options, &status))
        return arguments_exit(&status);
    program_catch_signals();
    device_begin(&probe.device, &probe.options.device);

    PliantError error = {0};
    // A path that cannot be read is bad usage.
    const char *poses = probe.options.poses;
    if (poses && !track_read(&probe.track, poses, &error)) {
        program_print_error("pliant-probe", &error);
        return 2;
    }
    probe.client = program_open(&probe.options.client, &error);
    const bool ok = probe.client && run(&probe, &error);
    if (!ok)
        program_print_error("pliant-probe", &error);
    program_close(probe.client);
    track_destroy(&probe.track);
    return ok ? 0 : 1;
}
