// The step thread allocates nothing, locks nothing and asks nothing of the kernel but the clock,
// the sleep and, while contacts are published, one eventfd write a tick.
#include "client.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>

static const char *library;

static long counted(const char *path, const char *name)
{
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    char key[32];
    long value = -1, found = -1;
    while (fscanf(file, "%31s %ld", key, &value) == 2)
        if (strcmp(key, name) == 0)
            found = value;
    fclose(file);
    assert_true(found >= 0);
    return found;
}

// Runs the daemon with poses and loads for about a second; returns the sleeps, that is its ticks.
static long run_watched(const char *counts, double contact_hz, const char *options, Daemon *daemon)
{
    char head[256], preload[1024];
    snprintf(head, sizeof head,
             "publish = { nodes_hz = 60.0; contact_hz = %.1f; status_hz = 20.0; };", contact_hz);
    // env sets both variables for the daemon alone.
    snprintf(preload, sizeof preload, "%s", library);
    setenv("PLIANT_COUNT_CALLS", counts, 1);
    static char assignment[1100];
    snprintf(assignment, sizeof assignment, "LD_PRELOAD=%s", preload);
    daemon_environment(assignment);
    Client *client = client_create();
    daemon_start(daemon, "%s %s", options, write_scene("silence.cfg", head, PROBE_TOOL));
    daemon_environment(NULL);
    client_wait_for_daemon(client);
    const double top[3] = {0.0, 0.0, 0.05}, down[3] = {0.0, 0.0, -0.1};
    send_load(client, top, 0.03, down, 0.2, "");
    send_command(client, PLIANT_COMMAND_T_SET, 0, "gravity_z=-1");
    for (int i = 0; i < 500; i++) {
        const double position[3] = {0.0, 0.0, 0.06 - 2e-5 * i};
        pliant_tool_pose_t pose = make_pose(client, position);
        send_pose(client, &pose);
        client_listen(client, 2);
    }
    daemon_signal(daemon, SIGTERM);
    daemon_wait(daemon);
    client_destroy(client);
    assert_int_equal(daemon->code, 0);
    long sleeps = counted(counts, "sleep");
    // The end may fall between a sleep and its tick.
    assert_in_range(sleeps - printed(daemon, "ticks"), 0, 1);
    return sleeps;
}

static void expect_silence(const char *counts)
{
    assert_int_equal(counted(counts, "allocate"), 0);
    assert_int_equal(counted(counts, "free"), 0);
    assert_int_equal(counted(counts, "lock"), 0);
    assert_int_equal(counted(counts, "read"), 0);
    assert_int_equal(counted(counts, "poll"), 0);
    assert_int_equal(counted(counts, "syscall"), 0);
}

static void with_contacts_a_tick_writes_one_eventfd(void **state)
{
    (void)state;
    Daemon daemon;
    const char *counts = scratch("contacts.txt");
    long ticks = run_watched(counts, 1000.0, "", &daemon);
    expect_silence(counts);
    expect_at_most((double)counted(counts, "write"), (double)ticks);
    expect_at_least((double)counted(counts, "write"), 1.0); // the counting works
}

static void without_contacts_a_tick_writes_nothing(void **state)
{
    (void)state;
    Daemon daemon;
    const char *counts = scratch("quiet.txt");
    run_watched(counts, 0.0, "", &daemon);
    expect_silence(counts);
    assert_int_equal(counted(counts, "write"), 0);
}

static void files_add_nothing_to_a_tick(void **state)
{
    (void)state;
    if (!WITH_HDF5)
        skip();
    Daemon daemon;
    const char *counts = scratch("files.txt");
    char options[2500];
    snprintf(options, sizeof options,
             "--record %s --checkpoint %s --checkpoint-every 0.1 --log-inputs %s",
             scratch("silence.h5"), scratch("checkpoint.h5"), scratch("inputs.log"));
    run_watched(counts, 0.0, options, &daemon);
    expect_silence(counts);
    assert_int_equal(counted(counts, "write"), 0);
    assert_non_null(strstr(daemon.out, "recorded frames: "));
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        daemon_test(with_contacts_a_tick_writes_one_eventfd),
        daemon_test(without_contacts_a_tick_writes_nothing),
        daemon_test(files_add_nothing_to_a_tick),
    };
    if (argc < 3)
        return 2;
    library = argv[2];
    harness_start(argc, argv);
    return harness_end(cmocka_run_group_tests(tests, NULL, NULL));
}
