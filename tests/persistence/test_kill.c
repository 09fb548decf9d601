// SPDX-License-Identifier: MIT
// A server that is killed at any moment leaves a whole checkpoint, the former or the newer, from
// which it goes on with the same bits; its log of inputs and its recording are readable as far as
// they were written. How often: PLIANT_KILLS in the environment, half offline and half live.
#include "test.h"
#include "recording_view.h"
#include "session.h"

#include "lcm_client.h"
#include "effort.h"
#include "random.h"

#include <dirent.h>
#include <errno.h>
#include <sys/stat.h>
#include <time.h>

enum { OFFLINE_TICKS = 250, LIVE_TICKS = 1000, AFTER_TICKS = 60, HASH_TEXT = 32 };

// What came of the kills of one scene.
typedef struct Tally {
    int kills, ended, none, former, newer, temporaries;
} Tally;

static uint64_t chance_state = 20;

static int rounds(void)
{
    const char *text = getenv("PLIANT_KILLS");
    int asked = text != NULL ? atoi(text) : EFFORT(12);
    return (asked + 1) / 2;
}

// In a folder of its own, so that whatever else a killed writer leaves is seen.
static const char *path_for(const SessionScene *scene, const char *kind, const char *file)
{
    char name[128];
    snprintf(name, sizeof name, "%s-%s", kind, scene->name);
    if (mkdir(scratch(name), 0700) != 0)
        assert_int_equal(errno, EEXIST);
    snprintf(name, sizeof name, "%s-%s/%s", kind, scene->name, file);
    return scratch(name);
}

// What is beside the checkpoint: the one before it, and at most one temporary file, however many
// writers were killed.
static void look_for_litter(const char *checkpoint, Tally *tally)
{
    char folder[PATH_TEXT * 2];
    snprintf(folder, sizeof folder, "%s", checkpoint);
    *strrchr(folder, '/') = '\0';
    DIR *all = opendir(folder);
    assert_non_null(all);
    for (const struct dirent *entry; (entry = readdir(all)) != NULL;) {
        bool temporary = strcmp(entry->d_name, "kept.h5.tmp") == 0;
        if (entry->d_name[0] != '.' && !temporary && strcmp(entry->d_name, "kept.h5") != 0 &&
            strcmp(entry->d_name, "kept.h5.1") != 0)
            fail_msg("a killed server left %s/%s", folder, entry->d_name);
        tally->temporaries += temporary;
    }
    closedir(all);
}

// Ends the daemon after a random part of `most` seconds. False if it had ended by then.
static bool kill_at_random(Process *daemon, double most)
{
    double s = random_between(&chance_state, 0.0, most);
    const struct timespec pause = {.tv_sec = (time_t)s, .tv_nsec = (long)(fmod(s, 1.0) * 1e9)};
    nanosleep(&pause, NULL);
    process_finish(daemon, SIGKILL);
    if (daemon->code != 0 && daemon->code != 1000 + SIGKILL)
        fail_msg("exit %d: %s", daemon->code, daemon->err);
    return daemon->code != 0;
}

static void count_kill(Tally *tally, bool killed, long long before, long long after)
{
    tally->kills += killed;
    tally->ended += !killed;
    tally->none += after < 0;
    tally->former += after >= 0 && after == before;
    tally->newer += after > before;
}

static void print_tallies(const char *kind, const Tally *tally)
{
    print_message("%-8s %-7s %6s %9s %6s %7s %6s %10s\n", kind, "scene", "killed", "had ended",
                  "none", "former", "newer", "temporary");
    for (int s = 0; s < SESSION_SCENES; s++)
        print_message("%-8s %-7s %6d %9d %6d %7d %6d %10d\n", kind, session_scenes[s].name,
                      tally[s].kills, tally[s].ended, tally[s].none, tally[s].former,
                      tally[s].newer, tally[s].temporaries);
}

// --- offline: nearly always in the middle of writing ---

typedef struct Chain {
    const SessionScene *scene;
    const char *precision;
    char config[PATH_TEXT * 2], log[PATH_TEXT * 2], kept[PATH_TEXT * 2];
    char whole[HASH_TEXT]; // the end of the uninterrupted run
    double run_s;          // how long that takes, with its checkpoints
    Tally *tally;
} Chain;

static void chain_begin(Chain *chain, int index, Tally *tally)
{
    const SessionScene *scene = &session_scenes[index % SESSION_SCENES];
    const char *precision = index / SESSION_SCENES % 2 == 0 ? "single" : "double";
    *chain = (Chain){.scene = scene, .precision = precision, .tally = tally};
    snprintf(chain->config, sizeof chain->config, "%s", session_scene(scene, precision, 1));
    snprintf(chain->log, sizeof chain->log, "%s", scratch("offline.log"));
    snprintf(chain->kept, sizeof chain->kept, "%s", path_for(scene, "offline", "kept.h5"));
    unlink(chain->kept);
    Session session = session_create(scene, 100 + (uint64_t)index, OFFLINE_TICKS);
    session_write_log(&session, scene, chain->log);
    session_destroy(&session);
    double begin = client_now();
    run_daemon_well(&pliantd,
                    "--offline 1000 --checkpoint-every 0.004 --checkpoint %s --input %s %s",
                    chain->kept, chain->log, chain->config);
    chain->run_s = client_now() - begin;
    printed_state(&pliantd, chain->whole);
    unlink(chain->kept);
}

static void expect_same_end(const Chain *chain)
{
    char state[HASH_TEXT];
    run_daemon_well(&pliantd, "--offline 1000 --resume %s --input %s %s", chain->kept, chain->log,
                    chain->config);
    assert_int_equal(printed(&pliantd, "step"), OFFLINE_TICKS);
    printed_state(&pliantd, state);
    assert_string_equal(state, chain->whole);
}

// Killed, gone on with, killed again, until it comes to its end.
static void run_offline_kills(Chain *chain, int count)
{
    enum { TRIES = 8 }; // for each kill: a run may end before it comes
    long long before = -1;
    int kills = 0;
    for (int k = 0; kills < count && k < TRIES * count; k++) {
        double left_s =
            chain->run_s * (double)(OFFLINE_TICKS - (before < 0 ? 0 : before)) / OFFLINE_TICKS;
        daemon_start(&pliantd,
                     "--offline 1000 --checkpoint-every 0.004 --checkpoint %s %s %s "
                     "--input %s %s",
                     chain->kept, before < 0 ? "" : "--resume", before < 0 ? "" : chain->kept,
                     chain->log, chain->config);
        bool killed = kill_at_random(&pliantd, left_s);
        kills += killed;
        look_for_litter(chain->kept, chain->tally);
        long long after = kept_step(chain->kept, chain->config);
        count_kill(chain->tally, killed, before, after);
        assert_true(after >= before);
        if (after >= 0)
            expect_same_end(chain);
        if (after == OFFLINE_TICKS)
            unlink(chain->kept);
        before = after == OFFLINE_TICKS ? -1 : after;
    }
    assert_int_equal(kills, count);
}

TEST(a_run_killed_while_it_writes_goes_on_with_the_same_bits)
{
    Tally tally[SESSION_SCENES] = {0};
    const int all = rounds(), chains = all < 2 * SESSION_SCENES ? all : 2 * SESSION_SCENES;
    for (int c = 0; c < chains; c++) {
        Chain chain;
        chain_begin(&chain, c, &tally[c % SESSION_SCENES]);
        run_offline_kills(&chain, all / chains + (c < all % chains));
    }
    print_tallies("offline", tally);
}

// --- live ---

// What the log of a killed server holds, on top of where it started, leads to the same state as
// its newest checkpoint and the rest of the log.
static void expect_log_leads_on(const char *config, const char *log, const char *base,
                                long long base_step, const char *kept, long long step)
{
    char from_log[HASH_TEXT], from_kept[HASH_TEXT];
    const double after_s = (double)AFTER_TICKS / SESSION_RATE;
    run_daemon_well(&pliantd, "--offline %.3f --input %s %s %s %s",
                    (double)(step - base_step) / SESSION_RATE + after_s, log,
                    base == NULL ? "" : "--resume", base == NULL ? "" : base, config);
    assert_int_equal(printed(&pliantd, "step"), step + AFTER_TICKS);
    printed_state(&pliantd, from_log);
    run_daemon_well(&pliantd, "--offline %.3f --input %s --resume %s %s", after_s, log, kept,
                    config);
    assert_int_equal(printed(&pliantd, "step"), step + AFTER_TICKS);
    printed_state(&pliantd, from_kept);
    assert_string_equal(from_kept, from_log);
}

// Every frame that the file counts is there.
static void expect_recording_readable(const char *path, const char *body)
{
    BodyView view = {0};
    hid_t file = file_exists(path) ? view_open(path, true) : -1;
    if (file < 0)
        return; // killed before it was begun
    view_body(&view, file, body);
    view_free(&view);
    H5Fclose(file);
}

// Sends a session at its pace for a random time, then kills; now and then while it starts.
static void drive_and_kill(Process *daemon, Client *client, const Session *session, double most_s)
{
    int tick = 0, next = 0;
    client->status.count = client->replies = client->events = 0;
    if (random_below(&chance_state, 4) > 0)
        client_wait_for_daemon(client);
    double begin = client_now(), limit = random_between(&chance_state, 0.0, most_s);
    while (client_now() - begin < limit) {
        client_listen(client, 1);
        if (client->status.count > 0 && tick < session->ticks)
            session_send(session, ++tick, &next, client->lcm);
    }
    process_finish(daemon, SIGKILL);
    expect_code(daemon, 1000 + SIGKILL);
}

static void kill_live(const SessionScene *scene, int round, Client *client, Tally *tally)
{
    const char *config = session_scene(scene, "single", 1 + round % 2);
    const char *kept = path_for(scene, "live", "kept.h5");
    const char *base = scratch("base.h5");
    const char *log = scratch("live.log");
    const char *record = scratch("live-record.h5");
    unlink(log);
    unlink(record);
    long long before = kept_step(kept, config);
    bool resumed = before >= 0;
    if (resumed)
        file_copy(kept, base);

    Session session = session_create(scene, 1000 + (uint64_t)round, LIVE_TICKS);
    daemon_start(&pliantd,
                 "--log-inputs %s --record %s --checkpoint-every 0.005 --checkpoint %s "
                 "%s %s %s",
                 log, record, kept, resumed ? "--resume" : "", resumed ? base : "", config);
    drive_and_kill(&pliantd, client, &session, 0.8);
    session_destroy(&session);

    look_for_litter(kept, tally);
    long long after = kept_step(kept, config);
    count_kill(tally, true, before, after);
    assert_true(after >= before);
    expect_recording_readable(record, scene->target[0].body);
    if (after > before)
        expect_log_leads_on(config, log, resumed ? base : NULL, resumed ? before : 0, kept, after);
}

TEST(a_live_server_that_is_killed_goes_on_with_the_same_bits)
{
    Tally tally[SESSION_SCENES] = {0};
    SCOPED_CLIENT Client *client = client_create();
    for (int round = 0; round < rounds(); round++)
        kill_live(&session_scenes[round % SESSION_SCENES], round, client,
                  &tally[round % SESSION_SCENES]);
    print_tallies("live", tally);
}
