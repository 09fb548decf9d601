// SPDX-License-Identifier: MIT
// Programs that pliant-web runs: what they say is kept, they end when they must, and leave nothing.
#include "child.h"
#include "effort.h"
#include "program.h"
#include "test.h"

#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static Child child;
static PliantError why;
static char how[CHILD_HOW_MAX];

static void start(const char *script, const ChildOptions *options)
{
    const char *const argv[] = {"/bin/sh", "-c", script, NULL};
    expect_ok(child_start(&child, argv, options, &why), why);
}

static void pause_ms(int ms)
{
    nanosleep(&(struct timespec){.tv_nsec = ms * 1000000L}, NULL);
}

// Waits for its end; only a failure takes half a minute.
static void wait_for_end(void)
{
    for (int k = 0; k < 15000 && !child_turn(&child, client_now_ns()); k++)
        pause_ms(2);
    if (child.pid != 0) {
        child_end(&child);
        fail_msg("it does not end");
    }
    child_how(&child, how);
}

static void wait_for_text(const char *text)
{
    for (int k = 0; k < 15000 && !strstr(child.text, text); k++) {
        child_turn(&child, client_now_ns());
        pause_ms(2);
    }
    expect_in(child.text, text);
}

static int open_files(void)
{
    DIR *files = opendir("/proc/self/fd");
    assert_non_null(files);
    int count = 0;
    while (readdir(files))
        count++;
    closedir(files);
    return count;
}

TEST(words_and_status_of_a_program_are_kept)
{
    start("echo out; echo err >&2; exit 7", &(ChildOptions){.folder = "/"});
    wait_for_end();
    assert_string_equal(child.text, "out\nerr\n");
    assert_string_equal(how, "exit status 7");
    assert_false(child_turn(&child, client_now_ns())); // its end is reported once
    start("pwd; kill -SEGV $$", &(ChildOptions){.folder = "/"});
    wait_for_end();
    assert_string_equal(child.text, "/\n");
    expect_in(how, "signal 11");
}

TEST(a_program_that_is_not_there_says_so)
{
    const char *const argv[] = {"/nowhere/pliantd", "a.cfg", NULL};
    assert_true(child_start(&child, argv, &(ChildOptions){0}, &why));
    wait_for_end();
    assert_string_equal(child.text, "/nowhere/pliantd: there is no such program\n");
    assert_string_equal(how, "exit status 127");
}

TEST(of_a_program_that_talks_without_end_the_last_is_kept)
{
    start("i=0; while [ $i -lt 20000 ]; do echo line $i; i=$((i+1)); done", &(ChildOptions){0});
    wait_for_end();
    assert_true(child.cut);
    assert_int_equal(child.size, CHILD_TEXT_MAX);
    assert_string_equal(child.text + child.size - 11, "line 19999\n");
}

TEST(a_program_inherits_neither_files_nor_blocked_signals)
{
    int leaky[2];
    sigset_t blocked, before;
    assert_int_equal(pipe(leaky), 0); // not closed on exec
    sigemptyset(&blocked);
    sigaddset(&blocked, SIGTERM);
    sigprocmask(SIG_BLOCK, &blocked, &before);
    signal(SIGPIPE, SIG_IGN);
    start("exec ls /proc/self/fd", &(ChildOptions){0});
    wait_for_end();
    assert_string_equal(child.text, "0\n1\n2\n3\n"); // the last one is the folder that it lists
    start("wc -c; exec grep -E 'SigBlk|SigIgn' /proc/self/status", &(ChildOptions){0});
    wait_for_end();
    signal(SIGPIPE, SIG_DFL);
    sigprocmask(SIG_SETMASK, &before, NULL);
    close(leaky[0]);
    close(leaky[1]);
    expect_in(child.text, "SigBlk:\t0000000000000000");
    // SIGPIPE is bit 12; whoever runs the test may ignore others.
    const char *ignored = strstr(child.text, "SigIgn:\t");
    assert_non_null(ignored);
    assert_int_equal(strtoull(ignored + 8, NULL, 16) >> 12 & 1, 0);
    assert_int_equal(strncmp(child.text, "0\n", 2), 0); // nothing to read
}

// As in pliant-web, which catches SIGTERM: it mostly comes before the program runs.
TEST(a_program_that_is_ended_at_once_ends_at_once)
{
    program_catch_signals();
    for (int k = 0; k < EFFORT(30); k++) {
        start("exec sleep 1000", &(ChildOptions){0});
        child_end(&child);
        child_how(&child, how);
        assert_string_equal(how, "signal 15 (Terminated)"); // not killed after a while
    }
    // The test itself can be ended again.
    sigset_t none;
    sigemptyset(&none);
    for (int k = 0; k < 3; k++)
        signal((const int[]){SIGINT, SIGTERM, SIGHUP}[k], SIG_DFL);
    sigprocmask(SIG_SETMASK, &none, NULL);
}

TEST(a_program_that_takes_too_long_is_killed)
{
    start("exec sleep 1000", &(ChildOptions){.seconds = 0.05});
    wait_for_end();
    expect_in(how, "signal 9");
}

TEST(a_program_that_does_not_end_when_asked_is_killed)
{
    for (int k = 0; k < 2; k++) {
        const int64_t second = 1000000000, given = k == 0 ? 5 : 60;
        start("trap '' TERM; echo ready; while :; do sleep 0.01; done",
              &(ChildOptions){.patience_s = k == 0 ? 0.0 : 60.0});
        wait_for_text("ready");
        int64_t asked = client_now_ns();
        child_stop(&child, asked);
        // As if the time had passed: not before its end,
        assert_false(child_turn(&child, asked + (given - 1) * second));
        pause_ms(20);
        assert_false(child_turn(&child, asked));
        // and after it.
        while (!child_turn(&child, asked + (given + 1) * second)) // ctest's limit ends a failure
            pause_ms(2);
        child_how(&child, how);
        expect_in(how, "signal 9");
    }
}

TEST(limits_of_memory_hold)
{
    start("ulimit -v; ulimit -t", &(ChildOptions){.memory_bytes = 64 << 20, .seconds = 100.0});
    wait_for_end();
    assert_string_equal(child.text, "65536\n101\n");
}

TEST(starting_and_ending_many_times_leaves_nothing)
{
    int before = open_files();
    for (int k = 0; k < 15; k++) {
        start("exec sleep 1000", &(ChildOptions){0});
        child_end(&child);
        assert_int_equal(child.pid, 0);
    }
    assert_int_equal(open_files(), before);
    assert_int_equal(waitpid(-1, NULL, WNOHANG), -1); // no zombie either
    assert_int_equal(errno, ECHILD);
}

// A process that starts a program and is killed before it can end it.
TEST(a_program_ends_with_whoever_has_started_it)
{
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    assert_int_equal(prctl(PR_SET_CHILD_SUBREAPER, 1), 0); // orphans become our children
    pid_t parent = fork();
    if (parent == 0) {
        start("exec sleep 1000", &(ChildOptions){0});
        ssize_t sent = write(ends[1], &child.pid, sizeof child.pid);
        while (sent > 0)
            pause();
        _exit(1);
    }
    pid_t orphan = 0;
    assert_int_equal(read(ends[0], &orphan, sizeof orphan), sizeof orphan);
    kill(parent, SIGKILL);
    assert_int_equal(waitpid(parent, NULL, 0), parent);
    assert_int_equal(waitpid(orphan, NULL, 0), orphan); // ctest's limit ends a failure
    prctl(PR_SET_CHILD_SUBREAPER, 0);
    close(ends[0]);
    close(ends[1]);
}
