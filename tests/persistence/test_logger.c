// SPDX-License-Identifier: MIT
// LCM's own logger and player with our channels: what a client sees of a session it sees again when
// the log is played; the inputs of the log, alone, move the tissue of another server once more; and
// a log serves as --input, whatever else is in it.
#include "test.h"
#include "session.h"

#include "lcm_client.h"

#include "pliant_event_t.h"
#include "pliant_status_t.h"

#include <sys/wait.h>

enum { TICKS = 700, MESSAGES_MOST = 60000 };

static const char LOGGER[] = "/usr/bin/lcm-logger", PLAYER[] = "/usr/bin/lcm-logplayer";
// Frames come in bursts; a kernel's own buffer may be too small for those of large bodies.
static const char URL[] = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152";

static bool installed(void)
{
    bool there = access(LOGGER, X_OK) == 0 && access(PLAYER, X_OK) == 0;
    if (!there)
        print_message("skipped: lcm-logger and lcm-logplayer (liblcm-bin) are not installed\n");
    return there;
}

// --- a log as we read it ---

typedef struct Logged {
    int count, nodes, inputs, self_tests, others;
    uint64_t hash[MESSAGES_MOST]; // of channel and data of our messages
} Logged;

static uint64_t hash_message(const char *channel, const void *data, size_t size)
{
    uint64_t hash = 14695981039346656037u;
    const unsigned char *byte = data;
    for (; *channel != '\0'; channel++)
        hash = (hash ^ (unsigned char)*channel) * 1099511628211u;
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ byte[i]) * 1099511628211u;
    return hash;
}

static bool is_input(const char *channel)
{
    return strcmp(channel, "PLIANT_TOOL_POSE") == 0 || strcmp(channel, "PLIANT_CUT") == 0 ||
           strcmp(channel, "PLIANT_LOAD") == 0 || strcmp(channel, "PLIANT_COMMAND") == 0 ||
           strcmp(channel, "PLIANT_TIE") == 0;
}

static Logged *read_log(const char *path)
{
    Logged *logged = calloc(1, sizeof *logged);
    lcm_eventlog_t *log = lcm_eventlog_create(path, "r");
    assert_non_null(log);
    for (lcm_eventlog_event_t *event; (event = lcm_eventlog_read_next_event(log)) != NULL;) {
        char channel[64];
        snprintf(channel, sizeof channel, "%.*s", event->channellen, event->channel);
        logged->self_tests += strcmp(channel, "LCM_SELF_TEST") == 0;
        logged->inputs += is_input(channel);
        logged->nodes += strncmp(channel, "PLIANT_NODES_", 13) == 0;
        if (strncmp(channel, "PLIANT_", 7) != 0)
            logged->others++;
        else if (logged->count < MESSAGES_MOST)
            logged->hash[logged->count++] =
                hash_message(channel, event->data, (size_t)event->datalen);
        lcm_eventlog_free_event(event);
    }
    lcm_eventlog_destroy(log);
    return logged;
}

// The middle one of the log's inputs: how long after the log's first message it came, for a log
// begins when its logger does, and where in the file it ends.
typedef struct Middle {
    double seconds;
    long end; // [bytes]
} Middle;

static Middle middle_input(const char *path, int inputs)
{
    Middle middle = {0.0, 0};
    int64_t first = 0;
    lcm_eventlog_t *log = lcm_eventlog_create(path, "r");
    assert_non_null(log);
    for (int before = inputs / 2; before > 0;) {
        lcm_eventlog_event_t *event = lcm_eventlog_read_next_event(log);
        assert_non_null(event);
        char channel[64];
        snprintf(channel, sizeof channel, "%.*s", event->channellen, event->channel);
        if (first == 0 && strcmp(channel, "LCM_SELF_TEST") != 0) // which a replay leaves out
            first = event->timestamp;
        before -= is_input(channel);
        middle = (Middle){1e-6 * (double)(event->timestamp - first), ftell(log->f)};
        lcm_eventlog_free_event(event);
    }
    lcm_eventlog_destroy(log);
    return middle;
}

static int compare_hashes(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

// --- what a client hears ---

typedef struct Heard {
    const Logged *logged; // sorted
    int nodes, known, strange;
} Heard;

static void hear(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    Heard *heard = user;
    uint64_t hash = hash_message(channel, buffer->data, buffer->data_size);
    bool known = bsearch(&hash, heard->logged->hash, (size_t)heard->logged->count, sizeof hash,
                         compare_hashes) != NULL;
    heard->known += known;
    heard->strange += !known;
    heard->nodes += strncmp(channel, "PLIANT_NODES_", 13) == 0;
}

// Of another server, which hears the same inputs.
typedef struct Again {
    int statuses, loads;
    double moved; // [m]
} Again;

HANDLER(see_status, pliant_status_t, status)
{
    Again *again = user;
    again->statuses++;
    for (int b = 0; b < status->num_bodies; b++)
        if (status->body[b].max_displacement > again->moved)
            again->moved = status->body[b].max_displacement;
}

HANDLER(see_event, pliant_event_t, event)
{
    ((Again *)user)->loads += strcmp(event->kind, "load") == 0;
}

// --- the session ---

static const SessionScene *scene = &session_scenes[1];

static void start_monitor(Process *monitor, const char *table)
{
    process_start(monitor, program_path("pliant-monitor"), "--nodes block --write %s",
                  scratch(table));
}

static void end_monitor(Process *monitor)
{
    process_finish(monitor, SIGINT);
    expect_code(monitor, 0);
}

// How many lines with numbers of a table are in another one too, which has them in the same order.
static int count_same_lines(const char *one_path, const char *other_path, int *lines)
{
    char line[512], other[512] = "";
    int same = 0;
    FILE *one = fopen(one_path, "r"), *others = fopen(other_path, "r");
    assert_non_null(one);
    assert_non_null(others);
    for (*lines = 0; fgets(line, sizeof line, one) != NULL;) {
        if (line[0] == '#')
            continue;
        ++*lines;
        // Times ascend, and stand first.
        while ((other[0] == '\0' || other[0] == '#' || atof(other) < atof(line)) &&
               fgets(other, sizeof other, others) != NULL) {
        }
        same += strcmp(line, other) == 0;
    }
    fclose(one);
    fclose(others);
    return same;
}

// A session with the logger listening, among messages of others.
static void record_session(const char *path)
{
    Process logger, daemon, monitor;
    process_start(&logger, LOGGER, "--lcm-url=%s -f -q %s", URL, path);
    start_monitor(&monitor, "live.tsv");
    SCOPED_CLIENT Client *client = server_start(&daemon, "%s", session_scene(scene, "single", 1));
    Session session = session_create(scene, 70, TICKS);
    int next = 0;
    for (int tick = 1; tick <= TICKS; tick++) {
        session_send(&session, tick, &next, client->lcm);
        if (tick % 50 == 0) {
            send_bytes(client, "CAMERA", "no message of ours", 18);
            send_bytes(client, "PLIANT_TOOL_POSE", "garbage", 7);
            send_bytes(client, "PLIANTS_LOAD", "not our channel", 15);
        }
        client_listen(client, 1);
        client->replies = 0;
    }
    session_destroy(&session);
    wait_until(client, client->frames.whole >= 20); // however slowly it ticks
    process_end(&daemon);
    process_finish(&logger, SIGINT);
    end_monitor(&monitor);
}

static bool has_ended(const Process *daemon)
{
    siginfo_t info = {0};
    return waitid(P_PID, (id_t)daemon->pid, &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == daemon->pid;
}

static void play(Process *player, const char *arguments, const char *path)
{
    process_start(player, PLAYER, "--lcm-url=udpm://239.255.76.67:7667?ttl=0 %s %s", arguments,
                  path);
}

TEST(a_logged_session_is_shown_again_by_the_player)
{
    if (!installed())
        skip();
    const char *path = scratch("session.lcmlog");
    record_session(path);
    FREED Logged *logged = read_log(path);
    print_message("%d messages, %d of nodes, %d inputs, %d of others\n", logged->count,
                  logged->nodes, logged->inputs, logged->others);
    assert_true(logged->nodes >= 10);
    assert_true(logged->inputs >= 100);
    assert_true(logged->others >= 10);
    qsort(logged->hash, (size_t)logged->count, sizeof *logged->hash, compare_hashes);

    Heard heard = {.logged = logged};
    lcm_t *lcm = lcm_create(URL);
    assert_non_null(lcm);
    lcm_subscription_t *on = lcm_subscribe(lcm, "PLIANT_.*", hear, &heard);
    lcm_subscription_set_queue_capacity(on, 0);
    Process player, monitor;
    start_monitor(&monitor, "again.tsv");
    play(&player, "", path);
    double limit = client_now() + 60.0;
    while (!has_ended(&player) && client_now() < limit)
        lcm_handle_timeout(lcm, 10);
    process_wait(&player);
    while (lcm_handle_timeout(lcm, 200) > 0) {
    }
    end_monitor(&monitor);
    print_message("heard %d of them again, %d of nodes\n", heard.known, heard.nodes);
    assert_int_equal(heard.strange, 0);
    // Datagrams may get lost on a busy machine; most do not.
    assert_true(2 * heard.known > logged->count);
    assert_true(2 * heard.nodes > logged->nodes);
    lcm_unsubscribe(lcm, on);
    lcm_destroy(lcm);

    int lines, same = count_same_lines(scratch("live.tsv"), scratch("again.tsv"), &lines);
    print_message("pliant-monitor: %d of %d lines again\n", same, lines);
    assert_true(lines >= 10);
    assert_true(2 * same > lines);
}

// A server with an output of its own hears the inputs of the log, and nothing else is played.
TEST(logged_inputs_move_the_tissue_of_another_server)
{
    if (!installed())
        skip();
    char text[8192];
    FREED char *from = file_text(session_scene(scene, "single", 1));
    int size =
        snprintf(text, sizeof text, "prefix = \"AGAIN\";  input_prefix = \"PLIANT\";\n%s", from);
    assert_true(size < (int)sizeof text);
    const char *config = scratch("again.cfg");
    write_text(config, text);

    Again again = {0};
    lcm_t *lcm = lcm_create(NULL);
    assert_non_null(lcm);
    pliant_status_t_subscription_t *status =
        pliant_status_t_subscribe(lcm, "AGAIN_STATUS", see_status, &again);
    pliant_event_t_subscription_t *event =
        pliant_event_t_subscribe(lcm, "AGAIN_EVENT", see_event, &again);
    Heard none = {.logged = &(Logged){0}};
    lcm_subscription_t *outputs = lcm_subscribe(lcm, "PLIANT_(NODES|STATUS).*", hear, &none);
    Process daemon, player;
    daemon_start(&daemon, "%s", config);
    double limit = client_now() + 30.0;
    while (again.statuses == 0 && client_now() < limit)
        lcm_handle_timeout(lcm, 20);
    assert_true(again.moved < 1e-3);

    play(&player, "--regexp=PLIANT_(TOOL_POSE|CUT|LOAD|COMMAND)", scratch("session.lcmlog"));
    limit = client_now() + 60.0;
    while (!(again.moved > 2e-3 && again.loads > 0) && client_now() < limit)
        lcm_handle_timeout(lcm, 20);
    print_message("moved by %.1f mm, %d loads\n", 1e3 * again.moved, again.loads);
    assert_true(again.moved > 2e-3);
    assert_true(again.loads > 0);
    assert_int_equal(none.strange, 0);
    process_finish(&player, SIGTERM);
    process_end(&daemon);
    pliant_status_t_unsubscribe(lcm, status);
    pliant_event_t_unsubscribe(lcm, event);
    lcm_unsubscribe(lcm, outputs);
    lcm_destroy(lcm);
}

TEST(a_log_of_the_logger_is_input_off_line)
{
    if (!installed())
        skip();
    const char *config = session_scene(scene, "single", 1), *path = scratch("session.lcmlog");
    FREED Logged *logged = read_log(path);
    const Middle middle = middle_input(path, logged->inputs);
    const int ticks = (int)ceil(middle.seconds * SESSION_RATE);
    char still[32], moved[32];
    run_daemon(&pliantd, "--offline %.3f %s", (double)ticks / SESSION_RATE, config);
    printed_state(&pliantd, still);
    run_daemon_well(&pliantd, "--offline %.3f --input %s %s", (double)ticks / SESSION_RATE, path,
                    config);
    assert_null(strstr(pliantd.err, "cut off"));
    assert_true(printed(&pliantd, "step") == ticks);
    printed_state(&pliantd, moved);
    assert_string_not_equal(moved, still);

    // Its writer was killed: the last event is not whole.
    assert_int_equal(truncate(path, middle.end - 10), 0);
    run_daemon_well(&pliantd, "--offline %.3f --input %s %s", (double)ticks / SESSION_RATE, path,
                    config);
    expect_in(pliantd.err, "cut off after");
    assert_null(strstr(pliantd.out, "applied 0,"));
}
