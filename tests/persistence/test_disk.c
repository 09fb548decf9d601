// SPDX-License-Identifier: MIT
// What a checkpoint survives besides a kill at any moment: a kill at each of the system calls that
// write it, a machine that stops (by the order of those calls), a full disk, two writers of one
// file. With strace and a small file system of its own, where they are permitted.
#include "test.h"
#include "session.h"

#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

static const char STRACE[] = "/usr/bin/strace";

// Runs the daemon under strace; false where there is none or it may not trace.
static bool run_traced(Process *daemon, const char *options, const char *arguments)
{
    static int permitted = -1;
    if (permitted < 0 && access(STRACE, X_OK) != 0)
        permitted = 0;
    // The address sanitizer's search for leaks traces, too.
    static const char ALONE[] = "ASAN_OPTIONS=detect_leaks=0";
    if (permitted < 0) {
        process_run(daemon, STRACE, "%s -o /dev/null /bin/true", ALONE);
        permitted = daemon->code == 0;
    }
    if (permitted)
        process_run(daemon, STRACE, "%s -f -qq %s %s %s", ALONE, options, program_path("pliantd"),
                    arguments);
    if (!permitted)
        print_message("skipped: no strace here, or it may not trace\n");
    return permitted;
}

// --- the order of the calls ---

// The end of the first line in [from, until) that holds both texts, or NULL.
static const char *look_for(const char *from, const char *until, const char *call, const char *what)
{
    for (const char *line = from; line < until;) {
        size_t length = strcspn(line, "\n");
        char text[1024];
        snprintf(text, sizeof text, "%.*s", (int)(length < 1000 ? length : 1000), line);
        if (strstr(text, call) != NULL && strstr(text, what) != NULL)
            return line + length;
        line += length + (line[length] == '\n');
    }
    return NULL;
}

static const char *find_call(const char *from, const char *call, const char *what)
{
    const char *found = look_for(from, from + strlen(from), call, what);
    if (found == NULL)
        fail_msg("no %s of %s where it belongs, in: %.2000s", call, what, from);
    return found;
}

// The name is changed when the content is on the disk, and the run goes on when the name is.
TEST(a_checkpoint_is_on_the_disk_before_it_has_its_name)
{
    char arguments[2048], options[1024];
    const char *trace = scratch("trace");
    snprintf(options, sizeof options, "-y -o %s -e trace=openat,write,fsync,rename,close", trace);
    snprintf(arguments, sizeof arguments, "--offline 0.01 --checkpoint %s %s", scratch("order.h5"),
             session_scene(&session_scenes[2], "single", 1));
    if (!run_traced(&pliantd, options, arguments))
        skip();
    assert_int_equal(pliantd.code, 0);
    FREED char *text = file_text(trace);
    assert_true(text[0] != '\0');
    char folder[PATH_TEXT];
    snprintf(folder, sizeof folder, "%s", scratch("x"));
    *strrchr(folder, '/') = '\0';
    const char *at = find_call(text, "openat(", "order.h5.tmp");
    at = find_call(at, "write(", "order.h5.tmp>");
    at = find_call(at, "fsync(", "order.h5.tmp>");
    const char *renamed = find_call(at, "rename(", "order.h5.tmp\", ");
    assert_null(look_for(at, renamed, "write(", "order.h5.tmp>"));
    at = find_call(renamed, "openat(", "O_DIRECTORY");
    at = find_call(at, "fsync(", folder);
}

// --- killed at each of them ---

TEST(a_kill_at_any_call_leaves_a_checkpoint)
{
    static const char *const calls[] = {"openat", "flock", "ftruncate", "write", "fsync", "rename"};
    const char *scene = session_scene(&session_scenes[2], "single", 1);
    const char *kept = scratch("calls.h5");
    char arguments[2048], options[1024], former[32];
    run_daemon_well(&pliantd, "--offline 0.02 --checkpoint %s %s", kept, scene);
    printed_state(&pliantd, former);
    snprintf(arguments, sizeof arguments,
             "--offline 0.1 --checkpoint-every 0.02 --resume %s "
             "--checkpoint %s %s",
             kept, kept, scene);
    int seen = 0;
    for (size_t k = 0; k < sizeof calls / sizeof *calls; k++) {
        // -P: only calls on this file count.
        snprintf(options, sizeof options,
                 "-o /dev/null -P %s.tmp -e trace=%s -e inject=%s:signal=KILL:when=2", kept,
                 calls[k], calls[k]);
        if (!run_traced(&pliantd, options, arguments))
            skip();
        bool killed = pliantd.code == 1000 + SIGKILL;
        seen += killed;
        print_message("%s: %s\n", calls[k], killed ? "killed" : "not called twice");
        run_daemon(&pliantd, "--offline 0 --resume %s %s", kept, scene);
        if (pliantd.code != 0)
            fail_msg("killed in %s: %s", calls[k], pliantd.err);
        assert_true(printed(&pliantd, "step") >= 20);
    }
    assert_true(seen >= 5);
    // Whatever they left is used by the next writer.
    run_daemon_well(&pliantd, "--offline 0.01 --resume %s --checkpoint %s %s", kept, kept, scene);
    char temporary[PATH_TEXT * 2 + 8];
    snprintf(temporary, sizeof temporary, "%s.tmp", kept);
    assert_false(file_exists(temporary));
}

// --- the disk ---

TEST(a_full_disk_leaves_the_former_checkpoint)
{
    const char *scene = session_scene(&session_scenes[2], "single", 1), *disk = scratch("disk");
    char former[32], now[32];
    assert_int_equal(mkdir(disk, 0700), 0);
    if (unshare(CLONE_NEWNS) != 0 || mount(NULL, "/", NULL, MS_REC | MS_PRIVATE, NULL) != 0 ||
        mount("none", disk, "tmpfs", 0, "size=4m") != 0) {
        print_message("skipped: no file system of its own: %s\n", strerror(errno));
        skip();
    }
    const char *kept = scratch("disk/kept.h5");
    const char *filler = scratch("disk/filler");
    run_daemon_well(&pliantd, "--offline 0.02 --checkpoint %s %s", kept, scene);
    printed_state(&pliantd, former);
    static const char zero[4096];
    int fd = open(filler, O_WRONLY | O_CREAT, 0600);
    while (write(fd, zero, sizeof zero) > 0) {
    }
    // Some space, less than a checkpoint takes.
    assert_int_equal(ftruncate(fd, lseek(fd, 0, SEEK_END) - 65536), 0);
    close(fd);

    run_daemon(&pliantd, "--offline 0.1 --checkpoint-every 0.02 --resume %s --checkpoint %s %s",
               kept, kept, scene);
    expect_ended(&pliantd, 1, "kept.h5: No space left on device");
    assert_false(file_exists(scratch("disk/kept.h5.tmp")));
    run_daemon_well(&pliantd, "--offline 0 --resume %s %s", kept, scene);
    printed_state(&pliantd, now);
    assert_string_equal(now, former);

    // With space again it is replaced.
    unlink(filler);
    run_daemon_well(&pliantd, "--offline 0.1 --resume %s --checkpoint %s %s", kept, kept, scene);
    run_daemon(&pliantd, "--offline 0 --resume %s %s", kept, scene);
    assert_int_equal(printed(&pliantd, "step"), 120);
    umount(disk);
}

// --- two writers ---

TEST(a_file_that_another_program_writes_is_left_to_it)
{
    const char *scene = session_scene(&session_scenes[2], "single", 1), *kept = scratch("two.h5");
    const char *temporary = scratch("two.h5.tmp");
    int fd = open(temporary, O_WRONLY | O_CREAT, 0600);
    assert_int_equal(flock(fd, LOCK_EX), 0);
    run_daemon(&pliantd, "--offline 0.01 --checkpoint %s %s", kept, scene);
    expect_ended(&pliantd, 2, "two.h5: another program that runs writes there");
    assert_true(file_exists(temporary));
    close(fd); // as one that was killed
    run_daemon_well(&pliantd, "--offline 0.01 --checkpoint %s %s", kept, scene);
    assert_false(file_exists(temporary));
}
