// SPDX-License-Identifier: MIT
// pliant-play: publishes recordings on LCM as the server did, at any speed and from any time. One
// thread, but for a child that reads each file.
#include "log.h"
#include "play.h"
#include "program.h"
#include "score.h"
#include "wire.h"

#include "pliant_command_t.h"
#include "pliant_cut_t.h"
#include "pliant_load_t.h"
#include "pliant_tie_t.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NAME "pliant-play"

static const int64_t MILLISECOND_NS = 1000000;
static const double GAP_S = 2.0; // without a frame
enum {
    STATUS_MS = 200,
    PLAYBACK_MS = 100,
    TOOLS_MS = 50, // viewers hide a tool that is silent for longer
    WHOLE_MS = 1000,
    EVENTS_AT_ONCE = 64,
    STEPS_MOST = 100000,
    DESCRIBE_MOST = 50000,
};

// --- options -------------------------------------------------------------------------------------

typedef struct Options {
    PliantOptions client;
    char *file[TIMELINE_PARTS];
    int files;
    double speed, from, to;
    bool loop, paused, once, skip_gaps;
    const char *score, *score_scene;
} Options;

static bool add_file(void *target, const char *text, Status *why)
{
    Options *options = target;
    if (options->files == TIMELINE_PARTS)
        return status_fail(why, STATUS_INVALID, "at most %d recordings", TIMELINE_PARTS);
    options->file[options->files++] = (char *)(uintptr_t)text; // a word of the command line
    return true;
}

#define SPEED_LEAST 0.01
#define SPEED_MOST  100.0

#define AT(member) offsetof(Options, member)

static const ArgumentRow ROWS[] = {
    {NULL, 0, ARGUMENT_OPERAND, NULL, .handler = add_file},
    {.type = ARGUMENT_HEADING, .help = "How to play:"},
    {"speed", 's', ARGUMENT_NUMBER, "X", AT(speed), SPEED_LEAST, SPEED_MOST, .preset = 1.0,
     .help = "X times as fast as it was recorded"},
    {"from", 0, ARGUMENT_NUMBER, "S", AT(from), -1e9, 1e9, .preset = -(double)INFINITY,
     .help = "begin at this simulated time (default: the start)"},
    {"to", 0, ARGUMENT_NUMBER, "S", AT(to), -1e9, 1e9, .preset = (double)INFINITY,
     .help = "stop at this simulated time (default: the end)"},
    {"loop", 0, ARGUMENT_FLAG, NULL, AT(loop), .help = "begin again at the end"},
    {"paused", 0, ARGUMENT_FLAG, NULL, AT(paused), .help = "wait for RESUME, STEP or a seek"},
    {"once", 0, ARGUMENT_FLAG, NULL, AT(once),
     .help = "exit at the end (default: stay there, so that a page can go back)"},
    {"skip-gaps", 0, ARGUMENT_FLAG, NULL, AT(skip_gaps),
     .help = "go on at once where nothing was recorded for more than 2 s"},
    {.type = ARGUMENT_HEADING, .help = "Where:"},
    {.type = ARGUMENT_ROWS, .rows = PROGRAM_WHERE, .offset = AT(client)},
    {.type = ARGUMENT_HEADING, .help = "Instead of playing:"},
    {"score", 0, ARGUMENT_TEXT, "BASE", AT(score),
     .help = "write the score sheet of the session: BASE.json, BASE.csv and BASE.html, to print"},
    {"score-scene", 0, ARGUMENT_TEXT, "SCENE.cfg", AT(score_scene),
     .help = "for --score: the scene that names force limit and regions (default: the recorded "
             "one)"},
    {0}};

static bool check(void *target, Status *why)
{
    const Options *options = target;
    if (options->files == 0)
        return status_fail(why, STATUS_INVALID, "a recording is missing: FILE.h5");
    if (options->once && options->loop)
        return status_fail(why, STATUS_INVALID, "--once does not go with --loop");
    if (options->score_scene != NULL && options->score == NULL)
        return status_fail(why, STATUS_INVALID, "--score-scene needs --score");
    return options->from < options->to ||
           status_fail(why, STATUS_INVALID, "--from must be before --to");
}

static const ArgumentTable TABLE = {
    .program = NAME,
    .usage = "FILE...",
    .about =
        "Plays recordings (HDF5, of pliantd --record and pliant-record) or logs of lcm-logger: "
        "publishes bodies, tools and events on LCM as the server did. pliant-web shows them "
        "with a timeline.",
    .end = "Several files are parts of one session: one that begins within the one before takes "
           "over there, one that begins no later follows it.\n"
           "Commands on <PREFIX>_COMMAND: PAUSE, RESUME, STEP (frames), RESET (to the start of the "
           "range), DESCRIBE, STOP, and SET speed=X, seek=S, step=N, loop=0 or 1, range=S S.\n"
           "Exit status: 0 done, 1 a file could not be read to its end or a server took the "
           "prefix, 2 bad usage, a file that cannot be used, or a server is on the prefix.",
    .rows = ROWS,
    .check = check};

// --- the position --------------------------------------------------------------------------------

static void seek(Play *play, double time)
{
    int count;
    int64_t left_out;
    const TimelineEvent *event = timeline_events(play->timeline, &count, &left_out);
    play->time = fmin(fmax(time, play->from), play->to);
    // Events before it are not reported.
    int below = -1, above = count;
    while (above - below > 1) {
        const int middle = below + (above - below) / 2;
        if (event[middle].time < play->time)
            below = middle;
        else
            above = middle;
    }
    play->event = above;
}

// Moves by whole frames, back if negative.
static void step(Play *play, long frames)
{
    double time = play->time, next;
    for (long i = 0; i < labs(frames); i++) {
        if (!(frames > 0 ? timeline_next(play->timeline, time, &next)
                         : timeline_previous(play->timeline, time, &next)))
            break;
        time = next;
    }
    seek(play, time);
}

// Publishes the events up to the time now, a bounded number at once.
static void pass_events(Play *play)
{
    int count;
    int64_t left_out;
    const TimelineEvent *event = timeline_events(play->timeline, &count, &left_out);
    for (int i = 0; i < EVENTS_AT_ONCE && play->event < count; i++) {
        if (event[play->event].time > play->time)
            break;
        play_publish_event(play, &event[play->event++].event);
    }
}

// The least time between frames, at any speed.
static int64_t least_frame_ns(const Play *play)
{
    return (int64_t)(0.75e9 * fmin(timeline_frame_time(play->timeline), 1.0 / 60.0));
}

// Returns true once everything up to the end has been published, and its last frame was seen.
static bool is_over(const Play *play, int64_t now_ns)
{
    int count;
    int64_t left_out;
    const TimelineEvent *event = timeline_events(play->timeline, &count, &left_out);
    const bool events = play->event < count && event[play->event].time <= play->time;
    return play->time >= play->to && play->shown >= play->to && !events && !play->wanted &&
           sender_waiting(&play->sender, false) == 0 && now_ns >= play->frame_ns;
}

static void turn(Play *play, int64_t now_ns)
{
    const double passed = (double)(now_ns - play->turned_ns) * 1e-9;
    play->turned_ns = now_ns;
    if (!play->playing)
        return;
    play->time += passed * play->speed;
    double next;
    if (play->skip_gaps && timeline_next(play->timeline, play->shown, &next) &&
        next - play->shown > GAP_S)
        play->time = fmax(play->time, next);
    play->time = fmin(play->time, play->to);
    pass_events(play);
    if (!is_over(play, now_ns))
        return;
    // At the end again from the start, or it stays there.
    if (play->loop)
        seek(play, play->from);
    else
        play->playing = false;
    // A range of one frame takes its time, too.
    play->frame_ns = now_ns + least_frame_ns(play);
    play->changed = play->wanted = true;
}

// --- requests ------------------------------------------------------------------------------------

static bool refuse(Answered *answer, const char *text)
{
    snprintf(answer->text, sizeof answer->text, "%s", text);
    return false;
}

static bool set_range(Play *play, const double *value, Answered *answer)
{
    const double start = timeline_start(play->timeline), end = timeline_end(play->timeline);
    if (!(value[0] < value[1] && value[0] < end && value[1] > start))
        return refuse(answer, "range must be two rising times of the recording");
    play->from = fmax(value[0], start);
    play->to = fmin(value[1], end);
    seek(play, play->time);
    return true;
}

static bool set(Play *play, const char *argument, Answered *answer)
{
    enum { SEEK, SPEED, LOOP, STEP, RANGE, KEYS };
    static const char *const keys[KEYS] = {"seek", "speed", "loop", "step", "range"};
    char name[16];
    double value[2];
    int length = 0, key = 0;
    // "key=numbers"
    if (sscanf(argument, "%15[a-z]=%n", name, &length) != 1 || length == 0)
        key = KEYS;
    while (key < KEYS && strcmp(name, keys[key]) != 0)
        key++;
    if (key == KEYS)
        return refuse(answer, "a recording takes seek=S, speed=X, loop=0 or 1, step=N, range=S S");
    if (program_read_numbers(argument + length, value, 2) != (key == RANGE ? 2 : 1))
        return refuse(answer,
                      key == RANGE ? "range takes two times [s]" : "expected one finite number");
    snprintf(answer->text, sizeof answer->text, "%.100s", argument);
    switch (key) {
    case SEEK:
        seek(play, value[0]);
        return true;
    case SPEED:
        if (!(value[0] >= SPEED_LEAST && value[0] <= SPEED_MOST))
            return refuse(answer, "speed outside [0.01, 100]");
        play->speed = value[0];
        return true;
    case LOOP:
        if (value[0] != 0.0 && value[0] != 1.0)
            return refuse(answer, "loop is 0 or 1");
        play->loop = value[0] == 1.0;
        return true;
    case STEP:
        if (!(fabs(value[0]) <= STEPS_MOST))
            return refuse(answer, "step outside [-100000, 100000] frames");
        play->playing = false;
        step(play, (long)value[0]);
        return true;
    default:
        return set_range(play, value, answer);
    }
}

static bool run_command(Play *play, const pliant_command_t *command, Answered *answer)
{
    switch (command->kind) {
    case PLIANT_COMMAND_T_PAUSE:
        play->playing = false;
        snprintf(answer->text, sizeof answer->text, "paused at %.6g s", play->time);
        return true;
    case PLIANT_COMMAND_T_RESUME:
        if (play->time >= play->to)
            seek(play, play->from);
        play->playing = true;
        snprintf(answer->text, sizeof answer->text, "playing from %.6g s", play->time);
        return true;
    case PLIANT_COMMAND_T_STEP:
        if (command->value < 1 || command->value > STEPS_MOST)
            return refuse(answer, "STEP takes 1 to 100000 frames");
        play->playing = false;
        step(play, (long)command->value);
        snprintf(answer->text, sizeof answer->text, "at %.6g s", play->time);
        return true;
    case PLIANT_COMMAND_T_RESET:
        seek(play, play->from);
        snprintf(answer->text, sizeof answer->text, "at the start, %.6g s", play->time);
        return true;
    case PLIANT_COMMAND_T_DESCRIBE:
        answer->describes = true;
        sender_repeat(&play->sender, true);
        play->whole_ns = 0;
        return true;
    case PLIANT_COMMAND_T_SET:
        return set(play, command->argument, answer);
    case PLIANT_COMMAND_T_STOP:
        play->stop = true;
        snprintf(answer->text, sizeof answer->text, "the player ends");
        return true;
    default:
        return refuse(answer, "a recording is played: it takes PAUSE, RESUME, STEP, RESET, SET, "
                              "DESCRIBE and STOP");
    }
}

// Returns the answer to a request that came before, or NULL.
static const Answered *find_answer(const Play *play, int32_t sender, int32_t id,
                                   const char *channel)
{
    for (int i = 0; i < PLAY_ANSWERS; i++) {
        const Answered *answer = &play->answered[i];
        if (answer->channel[0] != '\0' && answer->sender == sender && answer->id == id &&
            strcmp(answer->channel, channel) == 0)
            return answer;
    }
    return NULL;
}

static void answer_request(Play *play, int32_t sender, int32_t id, const char *channel,
                           const pliant_command_t *command)
{
    const Answered *before = find_answer(play, sender, id, channel);
    Answered answer = {.sender = sender, .id = id};
    if (before != NULL) {
        if (!before->waits)
            play_publish_reply(play, before);
        return;
    }
    snprintf(answer.channel, sizeof answer.channel, "%.*s", CLIENT_CHANNEL_MAX - 1, channel);
    answer.ok = command != NULL
                    ? run_command(play, command, &answer)
                    : refuse(&answer, "a recording is played: nothing can be changed in it");
    // A client that seeks or steps has the frame before the reply; a description takes no waiting.
    answer.waits = !answer.describes;
    Answered *slot = &play->answered[play->answers++ % PLAY_ANSWERS];
    if (slot->waits)
        play_publish_reply(play, slot);
    *slot = answer;
    play->changed = play->wanted = true;
    if (!answer.waits)
        play_publish_reply(play, &answer);
}

static void publish_waiting(Play *play)
{
    for (unsigned i = 0; i < PLAY_ANSWERS; i++) {
        Answered *answer = &play->answered[(play->answers + i) % PLAY_ANSWERS]; // the oldest first
        if (answer->waits)
            play_publish_reply(play, answer);
        answer->waits = false;
    }
}

static void on_command(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    pliant_command_t command;
    if (!wire_check(&WIRE_COMMAND, buffer->data, buffer->data_size) ||
        pliant_command_t_decode(buffer->data, 0, (int)buffer->data_size, &command) < 0)
        return;
    answer_request(user, command.sender, command.id, channel, &command);
    pliant_command_t_decode_cleanup(&command);
}

// What would act on a simulation is refused, by the numbers that every request begins with.
static void on_request(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    enum { BEHIND = 8 + 8 }; // the fingerprint and utime
    const unsigned char *at = (const unsigned char *)buffer->data + BEHIND;
    if (buffer->data_size < BEHIND + 8)
        return;
    int32_t number[2];
    for (int i = 0; i < 2; i++, at += 4)
        number[i] =
            (int32_t)((uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3]);
    answer_request(user, number[0], number[1], channel, NULL);
}

static bool subscribe(Play *play, PliantError *error)
{
    Client *client = &play->client;
    return (client_subscribe(client, "COMMAND", NULL, 64, on_command, play) &&
            client_subscribe(client, "CUT", NULL, 64, on_request, play) &&
            client_subscribe(client, "LOAD", NULL, 64, on_request, play) &&
            client_subscribe(client, "TIE", NULL, 64, on_request, play)) ||
           client_fail(error, "LCM refuses to subscribe to %s_COMMAND", client->prefix);
}

// --- the loop ------------------------------------------------------------------------------------

static bool is_due(int64_t *next_ns, int64_t now_ns, int every_ms)
{
    if (now_ns < *next_ns)
        return false;
    *next_ns = now_ns + every_ms * MILLISECOND_NS;
    return true;
}

// The time to show: no frame is left out up to the recorded speed, also when this program ran late.
static double time_to_show(const Play *play)
{
    const double late_s = 1.0;
    double next;
    const bool all = play->playing && !play->wanted && play->speed <= 1.0;
    return all && timeline_next(play->timeline, play->shown, &next) && next < play->time &&
                   play->time - next < late_s
               ? next
               : play->time;
}

static bool publish(Play *play, int64_t now_ns, Status *status)
{
    // A new frame when the one before has left: at once after a request, else no faster than frames
    // were recorded, or than 80 per second.
    if (sender_waiting(&play->sender, false) == 0 &&
        (play->wanted || (play->playing && now_ns >= play->frame_ns))) {
        const int64_t frames = play->sender.frames;
        play->shown = time_to_show(play);
        play->wanted = false;
        if (!sender_show(&play->sender, play->shown, status))
            return false;
        if (play->sender.frames > frames) {
            play->frame_ns = now_ns + least_frame_ns(play);
            play->tools_ns = 0;
        }
    }
    // Chunks leave evenly over a frame's time, at most a millisecond apart.
    const double frame_s = timeline_frame_time(play->timeline) / fmax(play->speed, 1.0);
    const double interval = fmin(1e6, 1e9 * frame_s / (sender_waiting(&play->sender, true) + 1));
    sender_send(&play->sender, now_ns, (int64_t)fmax(interval, 5e4));
    if (sender_waiting(&play->sender, false) == 0 && !play->wanted)
        publish_waiting(play);
    if (is_due(&play->tools_ns, now_ns, TOOLS_MS) &&
        !sender_tools(&play->sender, play->shown, status))
        return false;
    // Then what there is to say about it.
    if (play->changed)
        play->status_ns = play->playback_ns = 0;
    if (is_due(&play->status_ns, now_ns, STATUS_MS))
        play_publish_status(play);
    const bool whole = is_due(&play->whole_ns, now_ns, WHOLE_MS);
    if (!play_publish_lines(play, whole, status))
        return false;
    if (whole) {
        sender_repeat(&play->sender, false);
        play_publish_playback(play, true);
        play->playback_ns = now_ns + PLAYBACK_MS * MILLISECOND_NS;
    } else if (is_due(&play->playback_ns, now_ns, PLAYBACK_MS)) {
        play_publish_playback(play, false);
    }
    play->changed = false;
    return true;
}

static int64_t least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

// When there is something to do next.
static int64_t next_ns(const Play *play, int64_t now_ns)
{
    int64_t next =
        least(least(play->status_ns, play->playback_ns), least(play->tools_ns, play->whole_ns));
    if (sender_waiting(&play->sender, true) > 0)
        next = least(next, play->sender.due_ns);
    // The next frame, or the end of the range.
    double time = play->to;
    if (play->playing) {
        timeline_next(play->timeline, play->shown, &time);
        const double wait_s = fmax(fmin(time, play->to) - play->time, 0.0) / play->speed;
        const int64_t due = now_ns + (int64_t)(fmin(wait_s, 1.0) * 1e9);
        next = least(next, due > play->frame_ns ? due : play->frame_ns);
    }
    return next;
}

static bool run(Play *play, PliantError *error)
{
    Status status = {0};
    play->turned_ns = client_now_ns();
    play->changed = play->wanted = true;
    while (!play->stop && !play->hold.lost) {
        const int64_t now = client_now_ns();
        turn(play, now);
        if (!publish(play, now, &status))
            return client_fail(error, "%s", status.text);
        if (play->once && !play->playing && play->time >= play->to && !play->wanted &&
            sender_waiting(&play->sender, true) == 0)
            break;
        if (!client_wait(&play->client, next_ns(play, now), &play->changed))
            break;
    }
    if (play->hold.lost)
        return client_fail(error, "a server publishes on %s_STATUS, too: the player gives way",
                           play->client.prefix);
    return !play->client.broken || client_fail(error, "the LCM connection failed");
}

// --- the start -----------------------------------------------------------------------------------

// The daemon's description, and what is played of it; without one, what is known.
static char *write_description(Play *play, const Options *options)
{
    const Timeline *timeline = play->timeline;
    const char *described = timeline_describe(timeline);
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    ASSERT(out != NULL);
    if (*described != '\0')
        fprintf(out, "%.*s", DESCRIBE_MOST, described);
    else {
        fprintf(out, "scene recording: not described in the file\n");
        for (int i = 0; i < timeline_bodies(timeline); i++)
            fprintf(out, "body %s: model surface, recorded\n", timeline_body(timeline, i));
        for (int i = 0; i < timeline_tools(timeline); i++)
            fprintf(out, "tool %d: probe, 0 capsules\n", timeline_tool_id(timeline, i));
    }
    fprintf(out, "played from %s%s: %.6g to %.6g s\n", options->file[0],
            options->files > 1 ? " and its other parts" : "", timeline_start(timeline),
            timeline_end(timeline));
    fclose(out);
    ASSERT(text != NULL);
    return text;
}

static bool read_forces(Play *play, Status *status)
{
    const int tools = timeline_tools(play->timeline);
    play->force_parts = tools > 0 ? PLAY_FORCE_VALUES / tools : 0;
    play->force_parts = play->force_parts < PLAY_FORCE_PARTS ? play->force_parts : PLAY_FORCE_PARTS;
    play->force = calloc((size_t)tools * (size_t)play->force_parts + 1, sizeof *play->force);
    ASSERT(play->force != NULL);
    for (int i = 0; i < tools; i++)
        if (!timeline_forces(play->timeline, i, play->force_parts,
                             play->force + (size_t)i * (size_t)play->force_parts, status))
            return false;
    return true;
}

static bool open_files(Play *play, const Options *options, Status *status)
{
    play->whole = true;
    play->timeline =
        log_is_one(options->file[0])
            ? log_open(options->file, options->files, &options->client, &play->whole, status)
            : timeline_open(options->file, options->files, status);
    return play->timeline != NULL;
}

static bool prepare(Play *play, const Options *options, Status *status)
{
    if (!open_files(play, options, status) || !read_forces(play, status))
        return false;
    // The range, within what there is.
    const double start = timeline_start(play->timeline), end = timeline_end(play->timeline);
    play->from = fmax(options->from, start);
    play->to = fmin(options->to, end);
    if (play->from > end || play->to < start)
        return status_fail(status, STATUS_INVALID, "--from and --to: %s has %.6g to %.6g s",
                           options->file[0], start, end);
    play->speed = options->speed;
    play->loop = options->loop;
    play->once = options->once;
    play->skip_gaps = options->skip_gaps;
    play->playing = !options->paused;
    seek(play, play->from);
    // What is said of the scene.
    play->describe = write_description(play, options);
    if (sscanf(play->describe, "scene %63[^:\n]: %lf Hz", play->scene, &play->rate_hz) < 2 ||
        !isfinite(play->rate_hz))
        play->rate_hz = 0.0;
    return true;
}

static void report(const Play *play)
{
    int count;
    int64_t left_out;
    timeline_events(play->timeline, &count, &left_out);
    printf("%d recording%s, %.6g to %.6g s, %d bodies, %d tools, %lld events: on %s_...\n",
           timeline_parts(play->timeline), timeline_parts(play->timeline) == 1 ? "" : "s",
           timeline_start(play->timeline), timeline_end(play->timeline),
           timeline_bodies(play->timeline), timeline_tools(play->timeline),
           (long long)count + (long long)left_out, play->client.prefix);
    double next;
    for (double time = timeline_start(play->timeline); timeline_next(play->timeline, time, &next);
         time = next)
        if (next - time > GAP_S)
            printf("nothing for %.1f s from %.6g s on%s\n", next - time, time,
                   play->skip_gaps ? ": skipped" : " (--skip-gaps)");
    fflush(stdout);
}

static int fail(const PliantError *error, int code)
{
    program_print_error(NAME, error);
    return code;
}

static int play_files(Play *play, const Options *options)
{
    Status status = {0};
    PliantError error = {0};
    program_catch_signals();
    // The children that read the files are started before there is a connection.
    if (!prepare(play, options, &status)) {
        client_fail(&error, "%s", status.text);
        return fail(&error, 2);
    }
    if (!program_await_network(options->client.url, &error) ||
        !client_connect(&play->client, &options->client, &error) ||
        !program_stops(client_stop, &play->client) ||
        !hold_take(&play->hold, &play->client, &error) || !subscribe(play, &error))
        return fail(&error, 2);
    sender_create(&play->sender, &play->client, play->timeline);
    report(play);
    const bool ok = run(play, &error);
    publish_waiting(play); // of STOP
    if (play->sender.failed > 0)
        fprintf(stderr, NAME ": LCM did not take %lld messages\n", (long long)play->sender.failed);
    sender_destroy(&play->sender);
    return !ok ? fail(&error, 1) : !play->whole;
}

static int score_files(Play *play, const Options *options)
{
    Status status = {0};
    Score score;
    bool ok = open_files(play, options, &status) &&
              score_read(play->timeline, options->score_scene, &score, &status);
    if (ok) {
        ok = score_write(&score, options->score, &status);
        if (ok)
            score_print(&score, stdout);
        score_destroy(&score);
    }
    if (!ok)
        fprintf(stderr, NAME ": %s\n", status.text);
    return ok ? !play->whole : (int)status.code;
}

int main(int argc, char **argv)
{
    static Options options;
    static Play play;
    Status status = {0};
    if (!arguments_parse(&TABLE, argc, argv, &options, &status))
        return arguments_exit(&status);
    const int code =
        options.score != NULL ? score_files(&play, &options) : play_files(&play, &options);
    client_disconnect(&play.client);
    timeline_close(play.timeline);
    free(play.describe);
    free(play.force);
    return code;
}
