// SPDX-License-Identifier: MIT
// Processes that are stopped: the daemon itself, and those that listen to it.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "figure.h"

#include "effort.h"

static void stop_for(Client *client, const Process *daemon, double seconds)
{
    process_signal(daemon, SIGSTOP);
    for (double end = client_now() + seconds; client_now() < end;)
        client_listen(client, 10);
    process_signal(daemon, SIGCONT);
}

// --- the daemon ---

static void pose_at(Client *client, double z)
{
    send_pose_at(client, (const double[]){0.0, 0.0, z});
}

// Presses until contact is reported.
static void press(Client *client)
{
    for (double limit = client_now() + 30.0; !client->contact.contact && client_now() < limit;) {
        pose_at(client, 0.053);
        client_listen(client, 10);
    }
    assert_true(client->contact.contact != 0);
}

// While the daemon is stopped the hand goes through where the body is, to its other side. Nothing
// of that must be reported, and nothing that was due may be made up for.
TEST(a_stopped_daemon_skips_its_ticks_and_lets_go_of_its_tools)
{
    SCOPED_CLIENT Client *client = client_create();
    daemon_start(&pliantd, "%s",
                 write_scene("stop.cfg",
                             "rate_hz = 1000.0; publish = { nodes_hz = 50.0; contact_hz = 250.0; "
                             "status_hz = 20.0; };",
                             PROBE_TOOL));
    client_wait_for_daemon(client);
    press(client);
    int64_t late = client->status.late_ticks;
    process_signal(&pliantd, SIGSTOP);
    for (int i = 0; i <= 100; i++) {
        pose_at(client, 0.053 - 0.0025 * i);
        client_listen(client, 10);
    }
    client_listen(client, 100); // what came before the stop
    client->contact.contact = 0;
    int64_t step = client->contact.step;
    int frames = client->frames.whole;
    process_signal(&pliantd, SIGCONT);
    int touching = 0;
    for (double limit = client_now() + 30.0;
         client_now() < limit && client->contact.step < step + 400;) {
        pose_at(client, 0.053 - 0.25);
        client_listen(client, 5);
        touching += client->contact.contact != 0;
    }
    assert_int_equal(touching, 0);
    wait_until(client, saw_event(client, "stopped"));
    client_fresh_status(client);
    // Nearly all deadlines of the second.
    expect_at_least((double)(client->status.late_ticks - late), 900.0);
    // A frame each 20 ticks that were run, and one that was on its way.
    double due = (double)(client->frames.step - step) / 20.0 + 2.0;
    expect_at_most((double)(client->frames.whole - frames), due);
    assert_true(client->frames.ordered);
    figure("daemon stopped for 1.0 s with a tool in contact: %lld ticks skipped, %d of %lld steps "
           "after it felt the tool that had passed through, %lld stale poses refused",
           (long long)(client->status.late_ticks - late), touching,
           (long long)(client->contact.step - step), (long long)refused(client, "stale"));
    // Another touch is reported again.
    press(client);
    process_end(&pliantd);
    assert_int_equal(printed(&pliantd, "resets"), 0);
}

TEST(a_daemon_stopped_many_times_keeps_its_accounts)
{
    SCOPED_CLIENT Client *client = client_create();
    daemon_start(&pliantd, "--duration 2 %s",
                 write_scene("often.cfg", "publish = { status_hz = 20.0; };", PROBE_TOOL));
    client_wait_for_daemon(client);
    for (int i = 0; i < 8; i++) {
        stop_for(client, &pliantd, 0.01 * i);
        client_listen(client, 20);
    }
    process_wait_for(&pliantd, 0);
    expect_at_least((double)(printed(&pliantd, "ticks") + printed(&pliantd, "late ticks")), 2000.0);
}

// --- who listens ---

static long resident_kb(const Process *daemon)
{
    char path[64], line[256];
    long kb = 0;
    snprintf(path, sizeof path, "/proc/%d/status", (int)daemon->pid);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file) != NULL)
        if (sscanf(line, "VmRSS: %ld", &kb) == 1)
            break;
    fclose(file);
    return kb;
}

// Pages that a program touches for the first time: none of them for a queue, which would keep some
// kilobytes a frame. The thread sanitizer keeps four bytes of its own for each.
#ifdef __SANITIZE_THREAD__
static const double GROWTH_KB = 5.0 * 512.0;
#else
static const double GROWTH_KB = 512.0;
#endif

TEST(subscribers_that_read_nothing_hold_up_nobody)
{
    Process daemon, monitor;
    SCOPED_CLIENT Client *client = client_create(), *deaf = client_create();
    daemon_start(&daemon, "%s",
                 write_scene("stalled.cfg",
                             "rate_hz = 500.0; publish = { nodes_hz = 100.0; status_hz = 20.0; "
                             "contact_hz = 500.0; };",
                             PROBE_TOOL));
    process_start(&monitor, program_path("pliant-monitor"), "--nodes sphere --write %s",
                  scratch("curve.tsv"));
    client_wait_for_daemon(client);
    wait_until(client, client->frames.whole >= 20);
    process_signal(&monitor, SIGSTOP);
    long before = resident_kb(&daemon);
    client->frames.gaps = 0;
    int seen = client->frames.whole;
    // Nobody reads what `deaf` has subscribed to: liblcm's queue of it fills, then the kernel's.
    wait_until(client, client->frames.whole >= seen + EFFORT(150));
    // The daemon sends all frames (see below); a busy machine may lose some on their way.
    expect_at_most(client->frames.gaps, 0.05 * (client->frames.whole - seen));
    long grown = resident_kb(&daemon) - before;
    expect_at_most((double)grown, GROWTH_KB); // nothing is kept for them
    figure("two stalled subscribers (one SIGSTOP, one that reads nothing): %d frames to a third, "
           "%d missing, daemon %+ld kB",
           client->frames.whole - seen, client->frames.gaps, grown);
    process_signal(&monitor, SIGCONT);
    process_end(&monitor);
    process_end(&daemon);
    assert_null(strstr(daemon.out, "not published"));
}
