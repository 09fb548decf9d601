// SPDX-License-Identifier: MIT
// The same bits on every instruction-set level of this machine, with one thread and with two, and
// as they were when golden.tsv was written: a change of them is made on purpose or not at all.
#include "test.h"
#include "session.h"

#include "effort.h"

enum { TICKS = 300, HASH_TEXT = 32 };
static const uint64_t SEED = 8;
static const char *const PRECISIONS[] = {"single", "double"};
static const char *const LEVELS[] = {"baseline", "x86-64-v3", "x86-64-v4"};
static const char HEADER[] = "scene\tprecision\tticks\tstate\n";

static char state_of[SESSION_SCENES][2][HASH_TEXT]; // found by the first test

// The highest level whose kernels this machine runs.
static int highest(void)
{
    const SessionScene *scene = &session_scenes[0];
    int level = 0;
    for (int k = 1; k < 3; k++) {
        Process daemon;
        run_daemon(&daemon, "--check --isa %s %s", LEVELS[k],
                   session_scene(scene, PRECISIONS[0], 1));
        if (daemon.code == 0) {
            level = k;
        } else {
            expect_in(daemon.err, LEVELS[k]); // and for no other reason
            print_message("this machine does not run %s\n", LEVELS[k]);
        }
    }
    return level;
}

static void run_session(const SessionScene *scene, const char *precision, const char *level,
                        int threads, char hash[HASH_TEXT])
{
    Process daemon;
    run_daemon_well(&daemon, "--offline 1000 --isa %s --input %s %s", level, scratch("golden.log"),
                    session_scene(scene, precision, threads));
    assert_int_equal(printed(&daemon, "step"), TICKS);
    printed_state(&daemon, hash);
}

static void write_session(const SessionScene *scene)
{
    SCOPED(session_destroy) Session session = session_create(scene, SEED, TICKS);
    session_write_log(&session, scene, scratch("golden.log"));
}

// Of the levels above the baseline the highest runs with two threads, the others with one.
TEST(every_level_and_number_of_threads_gives_the_same_bits)
{
    const int top = highest();
    for (int s = 0; s < EFFORT(SESSION_SCENES); s++) {
        const SessionScene *scene = &session_scenes[s];
        write_session(scene);
        for (int p = 0; p < 2; p++) {
            char *first = state_of[s][p], other[HASH_TEXT];
            run_session(scene, PRECISIONS[p], LEVELS[0], 1, first);
            for (int k = top > 0 ? 1 : 0; k <= top; k++) {
                run_session(scene, PRECISIONS[p], LEVELS[k], k < top ? 1 : 2, other);
                assert_string_equal(other, first);
            }
        }
    }
}

// The state that the table has, or "none".
static void find_golden(const char *scene, const char *precision, char hash[HASH_TEXT])
{
    char line[256], name[64], kind[64];
    int ticks;
    FILE *file = fopen(test_argument(2), "r");
    assert_non_null(file);
    strcpy(hash, "none");
    while (fgets(line, sizeof line, file) != NULL) {
        char found[HASH_TEXT];
        if (sscanf(line, "%63s %63s %d %31s", name, kind, &ticks, found) == 4 &&
            strcmp(name, scene) == 0 && strcmp(kind, precision) == 0 && ticks == TICKS)
            strcpy(hash, found);
    }
    fclose(file);
}

// After the other test, which has run them.
TEST(states_are_those_of_the_table)
{
    int differ = 0;
    for (int s = 0; s < EFFORT(SESSION_SCENES); s++) {
        for (int p = 0; p < 2; p++) {
            const char *now = state_of[s][p];
            char golden[HASH_TEXT];
            find_golden(session_scenes[s].name, PRECISIONS[p], golden);
            if (strcmp(now, golden) != 0) {
                print_error("%s, %s: %s instead of %s\n", session_scenes[s].name, PRECISIONS[p],
                            now, golden);
                differ++;
            }
        }
    }
    if (differ > 0)
        fail_msg("%d states differ from %s; if that is meant: ./dev golden --write", differ,
                 test_argument(2));
}

// test_persistence --write_golden PLIANTD TABLE
WRITER(write_golden)
{
    FILE *file = fopen(test_argument(2), "w");
    assert_non_null(file);
    fputs(HEADER, file);
    for (int s = 0; s < SESSION_SCENES; s++) {
        write_session(&session_scenes[s]);
        for (int p = 0; p < 2; p++) {
            char hash[HASH_TEXT];
            run_session(&session_scenes[s], PRECISIONS[p], "baseline", 1, hash);
            fprintf(file, "%s\t%s\t%d\t%s\n", session_scenes[s].name, PRECISIONS[p], TICKS, hash);
        }
    }
    assert_int_equal(fclose(file), 0);
}
