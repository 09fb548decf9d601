// SPDX-License-Identifier: MIT
// Live sessions of everything that can be sent - poses, strokes and pulls, cuts, loads, settings,
// resets, pauses and lockstep - and what the governor does meanwhile: their logs repeat them off
// line bit for bit, also on a machine that is kept busy.
#include "test.h"
#include "session.h"

#include "lcm_client.h"
#include "effort.h"

#include <sys/wait.h>

enum { TICKS = 500, HASH_TEXT = 32 };

// Sends the session at its pace, or as the machine lets it; then ends the daemon.
static void drive(Process *daemon, Client *client, const Session *session)
{
    int next = 0;
    client->status.count = client->replies = client->events = 0;
    client_wait_for_daemon(client);
    for (int tick = 1; tick <= session->ticks; tick++) {
        session_send(session, tick, &next, client->lcm);
        client_listen(client, 1);
        client->replies = 0;
    }
    command(client, PLIANT_COMMAND_T_STOP, 0, "");
    process_wait(daemon);
    expect_code(daemon, 0);
}

static void expect_repeated(const SessionScene *scene, const char *precision, uint64_t seed,
                            Client *client)
{
    Process daemon;
    char live[HASH_TEXT], again[HASH_TEXT];
    const char *log = scratch("session.log");
    const char *kept = scratch("session.h5");
    const char *config = session_scene(scene, precision, 1 + (int)(seed % 2));
    unlink(log);
    unlink(kept);
    Session session = session_create(scene, seed, TICKS);
    daemon_start(&daemon, "--log-inputs %s --checkpoint %s %s", log, kept, config);
    drive(&daemon, client, &session);
    session_destroy(&session);
    printed_state(&daemon, live);
    long long step = printed(&daemon, "step"), late = printed(&daemon, "late ticks");
    const char *governor = strstr(daemon.out, "governor: ");
    print_message("%s, %s, seed %d: %lld ticks, %lld late%s%.*s\n", scene->name, precision,
                  (int)seed, step, late, governor != NULL ? ", " : "",
                  governor != NULL ? (int)strcspn(governor, "\n") : 0,
                  governor != NULL ? governor : "");

    run_daemon_well(&daemon, "--offline 1000 --input %s %s", log, config);
    assert_int_equal(printed(&daemon, "step"), step);
    printed_state(&daemon, again);
    assert_string_equal(again, live);
    // The log ends where the checkpoint does: nothing is left of it to apply.
    run_daemon_well(&daemon, "--offline 1000 --resume %s --input %s %s", kept, log, config);
    printed_state(&daemon, again);
    assert_string_equal(again, live);
}

static pid_t busy[8];
static int busy_count;

static int end_load(void **state)
{
    for (int i = 0; i < busy_count; i++)
        if (kill(busy[i], SIGKILL) == 0)
            waitpid(busy[i], NULL, 0);
    busy_count = 0;
    return harness_teardown(state);
}

AROUND_EACH(NULL, end_load)

TEST(sessions_repeat_bit_for_bit)
{
    SCOPED_CLIENT Client *client = client_create();
    for (int s = 0; s < EFFORT(SESSION_SCENES); s++)
        expect_repeated(&session_scenes[s], s % 2 == 0 ? "single" : "double", 40 + (uint64_t)s,
                        client);
}

// As many that only compute as the machine has cores.
static int start_load(pid_t *pid, int most)
{
    int count = (int)sysconf(_SC_NPROCESSORS_ONLN);
    count = count < most ? count : most;
    for (int i = 0; i < count; i++) {
        pid[i] = fork();
        assert_true(pid[i] >= 0);
        if (pid[i] == 0) {
            alarm(120); // also when this test was killed
            for (volatile unsigned x = 0;; x++) {
            }
        }
    }
    return count;
}

TEST(a_busy_machine_changes_nothing)
{
    SCOPED_CLIENT Client *client = client_create();
    busy_count = start_load(busy, 8);
    expect_repeated(&session_scenes[0], "double", 60, client); // with the governor at work
    expect_repeated(&session_scenes[1], "single", 61, client);
}
