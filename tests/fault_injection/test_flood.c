// SPDX-License-Identifier: MIT
// Misbehaving clients: poses at 10 kHz, requests and garbage as fast as they go, requests that take
// long. The daemon keeps its beat, counts what it refuses, and still answers a well-behaved client.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "figure.h"

#include <pthread.h>
#include <stdatomic.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>

static const char HEAD[] = "rate_hz = 500.0; publish = { nodes_hz = 20.0; contact_hz = 100.0; "
                           "status_hz = 10.0; };";
static const char TIES_HEAD[] =
    "rate_hz = 500.0; max_ties = 4; start = \"paused\"; publish = { nodes_hz = 20.0; "
    "contact_hz = 100.0; status_hz = 10.0; };";
static const double SECONDS = 1.5; // that a flood lasts, at least

typedef struct Flood {
    void (*pour)(struct Flood *flood); // one message, or a few
    lcm_t *lcm;
    pthread_t thread;
    atomic_bool finish;
    atomic_llong sent;
    int32_t sender, sequence;
    double start; // [s]
} Flood;

static void *flood_main(void *argument)
{
    Flood *flood = argument;
    while (!atomic_load(&flood->finish))
        flood->pour(flood);
    return NULL;
}

static void flood_begin(Flood *flood, void (*pour)(Flood *flood))
{
    *flood = (Flood){.pour = pour, .lcm = lcm_create(NULL), .sender = 66, .start = client_now()};
    assert_non_null(flood->lcm);
    assert_int_equal(pthread_create(&flood->thread, NULL, flood_main, flood), 0);
}

static long long flood_end(Flood *flood)
{
    atomic_store(&flood->finish, true);
    pthread_join(flood->thread, NULL);
    lcm_destroy(flood->lcm);
    return atomic_load(&flood->sent);
}

// A daemon under the flood: it steps on, answers a polite request at last, and its accounts add up.
static void endure(void (*pour)(Flood *flood), const char *name, const char *reason)
{
    Process daemon;
    Flood flood;
    SCOPED_CLIENT Client *client =
        server_start(&daemon, "%s", write_scene("flood.cfg", HEAD, PROBE_TOOL));
    double start = client_now();
    flood_begin(&flood, pour);
    int64_t step = client->status.step;
    double end = start + SECONDS;
    wait_until(client, client_now() > end && client->status.step > step + 100 &&
                           (reason == NULL || refused(client, reason) > 0));
    // While it goes on.
    int64_t before = client->status.step;
    int asked = insist(client, NULL, PLIANT_COMMAND_T_SET, 0, "gravity_x=0.5");
    wait_until(client, client->status.step > before + 50);
    double seconds = client_now() - start;
    long long sent = flood_end(&flood);
    client_fresh_status(client);
    server_stop(client, &daemon);
    assert_int_equal(printed(&daemon, "resets"), 0);
    long long ticks = printed(&daemon, "ticks"), late = printed(&daemon, "late ticks");
    expect_at_least((double)(ticks + late), 500.0 * seconds); // of 500 a second none is missing
    const char *line = strstr(daemon.out, "messages: in ");
    long long in = 0, out = 0, rejected = 0;
    assert_non_null(line);
    assert_int_equal(
        sscanf(line, "messages: in %lld, out %lld, rejected %lld", &in, &out, &rejected), 3);
    expect_at_least((double)in, 1000.0);
    expect_at_most((double)in, (double)sent + 100.0);
    figure(
        "%s: %.0f a second, %lld of %lld read, %lld refused and counted, %lld of %lld ticks late, "
        "a polite request answered after %d tries",
        name, (double)sent / seconds, in, sent, rejected, late, ticks + late, asked);
}

// --- poses ---

static void pour_poses(Flood *flood)
{
    const struct timespec pause = {.tv_nsec = 500000};
    // As many as are due, however late we wake.
    for (int due = (int)(1e4 * (client_now() - flood->start)); flood->sequence < due;) {
        int32_t k = ++flood->sequence;
        pliant_tool_pose_t pose = {.utime = k,
                                   .sender = flood->sender,
                                   .sequence = k,
                                   .tool = 1,
                                   .position = {0.01 * sin(0.01 * k), 0.0, 0.053},
                                   .orientation = {1.0, 0.0, 0.0, 0.0},
                                   .active = 1};
        pliant_tool_pose_t_publish(flood->lcm, "PLIANT_TOOL_POSE", &pose);
        atomic_fetch_add(&flood->sent, 1);
    }
    nanosleep(&pause, NULL);
}

TEST(poses_at_10_khz_move_the_tool_and_hold_up_nothing)
{
    endure(pour_poses, "poses at 10 kHz", NULL);
}

// --- requests ---

// Each is a new one.
static void pour_requests(Flood *flood)
{
    char argument[] = "gravity_x=0.5";
    pliant_command_t request = {.sender = flood->sender,
                                .id = ++flood->sequence,
                                .kind = PLIANT_COMMAND_T_SET,
                                .argument = argument};
    pliant_command_t_publish(flood->lcm, "PLIANT_COMMAND", &request);
    atomic_fetch_add(&flood->sent, 1);
}

TEST(a_flood_of_requests_is_refused_when_the_queue_is_full)
{
    endure(pour_requests, "requests as fast as they go", "queue_full");
}

// --- garbage ---

static void pour_garbage(Flood *flood)
{
    static const char *const CHANNELS[] = {"PLIANT_TOOL_POSE", "PLIANT_CUT", "PLIANT_LOAD",
                                           "PLIANT_COMMAND",   "PLIANT_TIE", "PLIANT_CLAIM"};
    static unsigned char data[2048];
    static uint64_t random = 5;
    for (size_t i = 0; i < sizeof data; i += 8) {
        random = random * UINT64_C(6364136223846793005) + 1442695040888963407;
        memcpy(data + i, &random, 8);
    }
    // Now and then what looks like a pose or a request of the right size.
    const pliant_tool_pose_t pose = {.tool = 1};
    unsigned size = (unsigned)(random >> 40) % sizeof data;
    if (random % 5 == 0)
        pliant_tool_pose_t_encode(data, 0, sizeof data, &pose);
    if (random % 5 <= 1)
        size = (unsigned)pliant_tool_pose_t_encoded_size(&pose);
    const char *channel = CHANNELS[flood->sequence++ % 6];
    lcm_publish(flood->lcm, channel, data, size);
    atomic_fetch_add(&flood->sent, 1);
}

TEST(garbage_on_all_channels_is_refused_and_counted)
{
    endure(pour_garbage, "garbage on all channels as fast as it goes", "wrong_size");
}

// --- ties ---

// 10 000 a second, none of which can be.
static void pour_ties(Flood *flood)
{
    const struct timespec pause = {.tv_nsec = 500000};
    static const double BAD[] = {(double)NAN, (double)INFINITY, -1.0, 1e300, 1e-300};
    for (int due = (int)(1e4 * (client_now() - flood->start)); flood->sequence < due;) {
        const int32_t k = ++flood->sequence;
        char body[] = "sphere";
        pliant_tie_t tie = {.sender = 81 + k % 4,
                            .id = k,
                            .action = 1,
                            .kind = 1 + k % 4,
                            .center = {0.0, 0.0, 0.05},
                            .radius = 0.02,
                            .stiffness = 0.3,
                            .damping_ratio = 0.5,
                            .tool = 99,
                            .to_body = "nobody",
                            .body = body};
        // One member at a time; an unknown action, kind, number, body or tool; too many nodes.
        double *fields[] = {&tie.center[0], &tie.radius, &tie.stiffness, &tie.damping_ratio,
                            &tie.break_force};
        const double bad = BAD[k / 16 % 4];
        const int what = k % 16;
        if (what < 5)
            *fields[what] = what == 0 && bad == -1.0 ? 1e4 : bad; // -1 m is a good place
        else if (what < 8)
            tie.action = (int32_t[]){0, 4, INT32_MIN}[what - 5];
        else if (what < 10)
            tie.kind = what == 8 ? 0 : INT32_MAX;
        else if (what < 12)
            tie.tie = what == 10 ? -1 : INT32_MIN;
        else if (what < 14)
            tie.node_count = what == 12 ? -1 : 17;
        else if (what == 14)
            memset(tie.to_body, 'x', sizeof tie.to_body), tie.kind = 2;
        else
            tie.action = 2, tie.tie = 1 + k % 1000; // none exists
        pliant_tie_t_publish(flood->lcm, "PLIANT_TIE", &tie);
        atomic_fetch_add(&flood->sent, 1);
    }
    nanosleep(&pause, NULL);
}

// So many ticks in lockstep, beside the flood or without it; the state at their end.
static void run_ticks(bool flooded, char state[32])
{
    Process daemon;
    Flood flood;
    SCOPED_CLIENT Client *client =
        server_start(&daemon, "%s", write_scene("ties.cfg", TIES_HEAD, PROBE_TOOL));
    if (flooded)
        flood_begin(&flood, pour_ties);
    const double end = client_now() + SECONDS;
    step_daemon(client, 100);
    while (flooded && client_now() < end)
        client_listen(client, 20);
    if (flooded)
        wait_until(client,
                   refused(client, "out_of_range") > 0 && refused(client, "not_finite") > 0 &&
                       refused(client, "unknown_command") > 0 &&
                       refused(client, "bad_string") > 0 && refused(client, "not_possible") > 0);
    step_daemon(client, 200);
    if (flooded)
        figure("hostile ties at 10 kHz: %lld sent, %lld refused and counted", flood_end(&flood),
               (long long)client->status.rejected);
    assert_false(saw_event(client, "tie"));
    process_end(&daemon);
    assert_int_equal(printed(&daemon, "ticks"), 300);
    assert_int_equal(printed(&daemon, "resets"), 0);
    printed_state(&daemon, state);
}

TEST(hostile_ties_at_10_khz_change_nothing_but_counters)
{
    char flooded[32], quiet[32];
    run_ticks(true, flooded);
    run_ticks(false, quiet);
    assert_string_equal(flooded, quiet);
}

// --- requests that cost something ---

// Four senders, 2000 a second in all: each RESET copies the whole state, each CUT tries 7680 edges,
// each LOAD looks for its nodes, each DESCRIBE requests the mesh.
static void pour_work(Flood *flood)
{
    const struct timespec pause = {.tv_nsec = 500000};
    for (int due = (int)(2e3 * (client_now() - flood->start)); flood->sequence < due;) {
        int32_t k = ++flood->sequence;
        char nothing[] = "", body[] = "sphere";
        const double place = 0.1 * sin(0.1 * k);
        pliant_command_t command = {.sender = 71 + k % 4,
                                    .id = k,
                                    .kind = k % 4 == 0 ? PLIANT_COMMAND_T_RESET
                                                       : PLIANT_COMMAND_T_DESCRIBE,
                                    .argument = nothing};
        pliant_cut_t cut = {.sender = 71 + k % 4,
                            .id = k,
                            .before = {{-1.0, place, -1.0}, {-1.0, place, 1.0}},
                            .after = {{1.0, place, -1.0}, {1.0, place, 1.0}},
                            .body = body};
        pliant_load_t load = {.sender = 71 + k % 4,
                              .id = k,
                              .center = {0.0, 0.0, 0.05},
                              .radius = 0.03,
                              .force = {0.0, 0.0, -0.01},
                              .duration = 0.01,
                              .body = body};
        if (k % 4 == 1)
            pliant_cut_t_publish(flood->lcm, "PLIANT_CUT", &cut);
        else if (k % 4 == 2)
            pliant_load_t_publish(flood->lcm, "PLIANT_LOAD", &load);
        else
            pliant_command_t_publish(flood->lcm, "PLIANT_COMMAND", &command);
        atomic_fetch_add(&flood->sent, 1);
    }
    nanosleep(&pause, NULL);
}

static const char *heavy_scene(void)
{
    return write_body_scene(
        "heavy.cfg", &(SceneParts){.head = "rate_hz = 500.0; publish = { nodes_hz = 20.0; "
                                           "contact_hz = 0.0; status_hz = 10.0; };",
                                   .source = ICO_SPHERE(2562, 0.05),
                                   .material = "youngs_modulus_2d = 80.0; areal_density = 4.2;",
                                   .body = SMALL_SHAPE "cuttable = true;"});
}

// A service manager with a watchdog of 2 s, which expects a ping every 0.5 s.
static int watch(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    assert_true(fd >= 0);
    assert_int_equal(bind(fd, (struct sockaddr *)&address, sizeof address), 0);
    setenv("NOTIFY_SOCKET", path, 1);
    setenv("WATCHDOG_USEC", "2000000", 1);
    return fd;
}

// How many "WATCHDOG=1" have come since the last look.
static int pings(int fd)
{
    char text[2048];
    int count = 0;
    for (ssize_t size; (size = recv(fd, text, sizeof text - 1, 0)) > 0;) {
        text[size] = '\0';
        count += strstr(text, "WATCHDOG=1") != NULL;
    }
    return count;
}

static double ticks_a_second(Client *client, double seconds)
{
    client_fresh_status(client);
    const int64_t step = client->status.step;
    const double start = client_now();
    while (client_now() < start + seconds)
        client_listen(client, 20);
    client_fresh_status(client);
    return (double)(client->status.step - step) / (client_now() - start);
}

// The daemon gives requests at most half of the clock. A tenth leaves room for what the flood costs
// its other threads, on a machine that does something else too.
TEST(requests_that_take_long_leave_ticks_their_time)
{
    const double LEAST_SHARE = 0.1;
    static Process daemon, again;
    Flood flood;
    SCOPED_CLIENT Client *client = client_create();
    const int manager = watch(scratch("manager"));
    const char *scene = heavy_scene(), *log = scratch("flood.log");
    daemon_start(&daemon, "--log-inputs %s %s", log, scene);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    client_wait_for_daemon(client);
    const double start = client_now(), calm = ticks_a_second(client, SECONDS);
    flood_begin(&flood, pour_work);
    wait_until(client, refused(client, "queue_full") > 0);
    pings(manager); // those of before
    const double during = ticks_a_second(client, SECONDS);
    int alive = 0;
    wait_until(client, (alive += pings(manager)) >= 3);
    const int asked = insist(client, NULL, PLIANT_COMMAND_T_SET, 0, "gravity_x=0.5");
    const double seconds = client_now() - start;
    process_signal(&daemon, SIGTERM); // looked at between two requests
    process_wait(&daemon);
    const long long sent = flood_end(&flood);
    assert_int_equal(daemon.code, 0);
    expect_at_least(during, LEAST_SHARE * calm);
    // Each tick that the flood took is counted as late. Two may be neither run nor late: the period
    // that has begun at the end, and a tick whose time had come when the end did. And what was done
    // can be repeated.
    const long long ticks = printed(&daemon, "ticks"), late = printed(&daemon, "late ticks");
    expect_at_least((double)(ticks + late), 500.0 * seconds - 2.0);
    char state_live[32], state_again[32];
    run_daemon(&again, "--offline %.17g --input %s %s", (double)ticks / 500.0, log, scene);
    printed_state(&daemon, state_live);
    printed_state(&again, state_again);
    assert_string_equal(state_live, state_again);
    figure("cuts, loads, resets and describes: %lld sent, %.0f ticks a second, %.0f before, %lld "
           "late, a polite request answered after %d tries",
           sent, during, calm, late, asked);
    close(manager);
}
