// SPDX-License-Identifier: MIT
// What a running server keeps in memory, and the libraries that it loads for files alone.
#include "harness.h"
#include "test.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

// Reads the number of kB behind `key` in /proc/<pid>/status.
static long status_kb(const Process *daemon, const char *key)
{
    char path[64], line[256];
    long kb = -1;
    snprintf(path, sizeof path, "/proc/%d/status", (int)daemon->pid);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file) != NULL)
        if (strncmp(line, key, strlen(key)) == 0)
            sscanf(line + strlen(key), ": %ld", &kb);
    fclose(file);
    return kb;
}

// Waits until the server has its threads, and memory locked where that is permitted: it has then
// all that it will ever have.
static long resident_kb(const Process *daemon)
{
    const struct timespec moment = {.tv_nsec = 20000000};
    long seen = 0, again = 0;
    for (int i = 0; i < 1500 && (again < 25 || status_kb(daemon, "Threads") < 3); i++) {
        long now = status_kb(daemon, "VmRSS");
        again = now == seen ? again + 1 : 0;
        seen = now;
        nanosleep(&moment, NULL);
    }
    return seen;
}

// The program itself (with kernels for three instruction sets) takes 5.5 MB, the C library, GLib
// and what LCM and libconfig are 5, two stacks 1, heap and scene 1.5, and all of it may be locked.
// A library of file formats is 4 MB or more with those that it needs, the default stacks 15.
static const long SMALLEST_KB = 14000;

TEST(the_smallest_scene_keeps_no_library_or_stack_that_it_does_not_need)
{
    Process daemon;
    if (!WITH_SURFACE || !AS_INSTALLED)
        skip();
    daemon_start(&daemon, "--lcm-url memq:// %s/config/minimal.cfg", test_argument(2));
    long resident = resident_kb(&daemon);
    process_end(&daemon);
    printf("minimal.cfg: %ld kB resident\n", resident);
    expect_at_most((double)resident, (double)SMALLEST_KB);
}

TEST(a_library_that_is_missing_is_named_with_the_file_that_needs_it)
{
    Process daemon;
    if (!WITH_SURFACE || HDF5_SONAME[0] == '\0')
        skip();
    // The dynamic linker takes the first file of the name, which is no library.
    write_text(scratch(HDF5_SONAME), "");
    run_daemon(&daemon,
               "LD_LIBRARY_PATH=%s --offline 0.01 --checkpoint saved.h5 %s/config/minimal.cfg",
               scratch("."), test_argument(2));
    expect_refusal(&daemon, 1, "saved.h5: its format needs ");
    expect_refusal(&daemon, 1, HDF5_SONAME);
    // Without a file of the format it is not missed.
    run_daemon(&daemon, "LD_LIBRARY_PATH=%s --offline 0.01 %s/config/minimal.cfg", scratch("."),
               test_argument(2));
    assert_int_equal(daemon.code, 0);
}
