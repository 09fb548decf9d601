// SPDX-License-Identifier: MIT
// Clocks that are set while they are in use: by an hour forward and back, of the daemon and of a
// client. Nothing that waits, times out or measures may rest on them. And a machine that was
// suspended for an hour.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "figure.h"
#include "shown.h"

#include <fcntl.h>
#include <sys/mman.h>

// Of what is started by start_with_clock: the setting of its clock, and how long it was suspended.
static volatile int64_t *offset_us;

static const int64_t HOUR_US = INT64_C(3600000000);

// A long time-out: on a busy machine the poses come seldom, and this is not about that.
static const char HEAD[] =
    "rate_hz = 500.0; tool_timeout_s = 30.0; publish = { nodes_hz = 50.0; mesh_hz = 5.0; "
    "contact_hz = 100.0; status_hz = 20.0; };";

static int open_clock(void **state)
{
    (void)state;
    const char *path = scratch("clock");
    int fd = open(path, O_RDWR | O_CREAT, 0600);
    assert_true(fd >= 0 && ftruncate(fd, 2 * sizeof *offset_us) == 0);
    void *memory = mmap(NULL, 2 * sizeof *offset_us, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    assert_true(memory != MAP_FAILED);
    offset_us = memory;
    close(fd);
    setenv("PLIANT_SET_CLOCK", path, 1);
    return 0;
}

// `program`: NULL for the server.
static void start_with_clock(Process *process, const char *program, const char *arguments)
{
    process_start(process, program, "LD_PRELOAD=%s %s", test_argument(2), arguments);
}

// Presses with poses of our own clock until so many more contacts were reported; false when the
// contact broke off meanwhile.
static bool feel(Client *client, int contacts)
{
    const double position[3] = {0.0, 0.0, 0.053};
    bool unbroken = true;
    for (int wanted = client->contacts + contacts; client->contacts < wanted;) {
        send_pose_at(client, position);
        int before = client->contacts;
        wait_until(client, client->contacts > before);
        unbroken &= client->contact.contact != 0;
    }
    return unbroken;
}

AROUND_ALL(open_clock, NULL)

TEST(a_daemon_whose_clock_is_set_goes_on_as_before)
{
    static const int64_t OFFSETS[] = {HOUR_US, -HOUR_US, 0};
    *offset_us = 0;
    SCOPED_CLIENT Client *client = client_create();
    Shown *shown = shown_create(client->lcm, "sphere");
    start_with_clock(&pliantd, NULL, write_scene("clock.cfg", HEAD, PROBE_TOOL));
    client_wait_for_daemon(client);
    feel(client, 20);
    for (int i = 0; i < 3; i++) {
        const int64_t before = client->contact.utime;
        *offset_us = OFFSETS[i];
        int64_t frames = shown->count, meshes = shown->meshes;
        int statuses = client->status.count;
        feel(client, 2);
        // It was set: by an hour, give or take a minute.
        const double jump = (double)(client->contact.utime - before) / (double)HOUR_US;
        const double wanted[] = {1.0, -2.0, 1.0};
        expect_near(jump, wanted[i], 1.0 / 60.0);
        assert_true(feel(client, 30));
        wait_until(client, shown->count > frames + 10 && shown->meshes > meshes &&
                               client->status.count > statuses + 5);
        const double valid = (double)(client->contact.valid_until - client->contact.utime);
        assert_true(valid > 0.0 && valid < 1e6);
    }
    assert_int_equal(client->status.rejected, 0);
    process_end(&pliantd);
    figure("clock of the daemon set by +1 h, -2 h, +1 h: contact unbroken, %lld frames shown, %lld "
           "late ticks, nothing refused",
           (long long)shown->count, printed(&pliantd, "late ticks"));
    shown_destroy(shown);
}

// The monotonic clock stands in a suspend, and the hand does not.
TEST(a_suspended_machine_skips_its_ticks_and_withdraws_its_tools)
{
    offset_us[0] = offset_us[1] = 0;
    SCOPED_CLIENT Client *client = client_create();
    const char *scene = write_scene("suspend.cfg", HEAD, PROBE_TOOL), *log = scratch("suspend.log");
    char arguments[2 * PATH_TEXT];
    snprintf(arguments, sizeof arguments, "--log-inputs %s %s", log, scene);
    start_with_clock(&pliantd, NULL, arguments);
    client_wait_for_daemon(client);
    feel(client, 20);
    client_fresh_status(client);
    const int64_t late = client->status.late_ticks;
    offset_us[1] = HOUR_US;
    wait_until(client, saw_event(client, "stopped"));
    // Without another pose: the time-out of tools is longer than this test waits.
    wait_until(client, client->contact.contact == 0);
    client_fresh_status(client);
    // An hour at 500 Hz; less what the clock of the process lagged behind, and that is in `late`.
    expect_at_least((double)(client->status.late_ticks - late), 500.0 * 3600.0);
    feel(client, 20); // it goes on with the next pose
    process_end(&pliantd);
    assert_int_equal(printed(&pliantd, "resets"), 0);
    offset_us[1] = 0;
    // Its log of inputs repeats it, and says where it stood still and for how long.
    char live[32], repeated[32];
    printed_state(&pliantd, live);
    run_daemon_well(&pliantd, "--input %s %s", log, scene);
    static const char says[] = "the logged run stood still for ";
    expect_in(pliantd.err, says);
    // Its deadline was at most a tick ahead.
    expect_at_least(strtod(strstr(pliantd.err, says) + sizeof says - 1, NULL), 3600.0 - 0.002);
    printed_state(&pliantd, repeated);
    assert_string_equal(live, repeated);
}

// A viewer that has seen the first one must not take the second one's frames for old ones.
TEST(a_daemon_that_restarts_with_an_earlier_clock_is_shown)
{
    *offset_us = 0;
    SCOPED_CLIENT Client *client = client_create();
    Shown *shown = shown_create(client->lcm, "sphere");
    const char *scene = write_scene("restart.cfg", HEAD, PROBE_TOOL);
    for (int run = 0; run < 2; run++) {
        start_with_clock(&pliantd, NULL, scene);
        int64_t meshes = shown->meshes;
        memset(shown->hash, 0, SHOWN_MOST * sizeof *shown->hash);
        shown->count = 0;
        wait_until(client, shown->meshes > meshes + 8 && shown->count >= 20);
        process_end(&pliantd);
        *offset_us = -HOUR_US;
    }
    shown_destroy(shown);
}

TEST(a_client_whose_clock_is_set_keeps_its_tool_and_its_measures)
{
    Process daemon, probe;
    char arguments[PATH_TEXT * 3];
    *offset_us = 0;
    SCOPED_CLIENT Client *client =
        server_start(&daemon, "%s", write_scene("client.cfg", HEAD, PROBE_TOOL));
    const char *log = scratch("probe.tsv");
    snprintf(arguments, sizeof arguments,
             "--press 0,0,0.058 --depth 0.008 --speed 0.05 --hold 1.5 --rate 200 --log %s", log);
    start_with_clock(&probe, program_path("pliant-probe"), arguments);
    wait_until(client, client->contact.contact);
    static const int64_t OFFSETS[] = {HOUR_US, -HOUR_US, 0};
    for (int i = 0; i < 3; i++) {
        *offset_us = OFFSETS[i];
        int64_t step = client->contact.step;
        wait_until(client, client->contact.step > step + 100);
        assert_true(client->contact.contact != 0);
    }
    process_wait(&probe);
    if (probe.code != 0)
        fail_msg("it said: %s%s", probe.out, probe.err);
    assert_int_equal(refused(client, "overtaken"), 0);
    // No trip took an hour, and none took no time.
    FILE *file = fopen(log, "r");
    assert_non_null(file);
    char line[1024];
    int trips = 0;
    double longest = 0.0;
    while (fgets(line, sizeof line, file) != NULL) {
        char *last = strrchr(line, '\t');
        double us = last != NULL ? strtod(last + 1, NULL) : (double)NAN;
        if (line[0] == '#' || !(us == us))
            continue;
        trips++;
        longest = us > longest ? us : longest;
        assert_true(us > 0.0 && us < 60e6);
    }
    fclose(file);
    expect_at_least(trips, 50.0);
    figure("clock of a client set by +1 h, -2 h, +1 h: its tool stays in contact, round trips of "
           "%d poses at most %.1f ms",
           trips, 1e-3 * longest);
    server_stop(client, &daemon);
}

TEST(time_stamps_of_poses_mean_nothing_to_the_daemon)
{
    static const int64_t UTIMES[] = {0, -1, INT64_MIN, INT64_MAX, 1, INT64_MAX - 1, -HOUR_US};
    SCOPED_CLIENT Client *client =
        server_start(&pliantd, "%s", write_scene("stamps.cfg", HEAD, PROBE_TOOL));
    while (!feel(client, 5)) { // until what came before the first pose has been read
    }
    const double position[3] = {0.0, 0.0, 0.053};
    for (size_t i = 0; i < sizeof UTIMES / sizeof *UTIMES; i++)
        for (int again = 0; again < 3; again++) {
            pliant_tool_pose_t pose = make_pose(client, position);
            pose.utime = UTIMES[i];
            send_pose(client, &pose);
            wait_until(client, client->contact.pose_utime == UTIMES[i]);
            assert_true(client->contact.contact != 0);
        }
    assert_int_equal(client->status.rejected, 0);
    server_stop(client, &pliantd);
}
