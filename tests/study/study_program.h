// SPDX-License-Identifier: MIT
// pliant-study as a user runs it.
#ifndef PLIANT_TESTS_STUDY_PROGRAM_H
#define PLIANT_TESTS_STUDY_PROGRAM_H

#include "harness.h"

#include <sys/stat.h>

static Process result;

static inline void run(const char *arguments)
{
    process_run(&result, program_path("pliant-study"), "%s", arguments);
}

static inline void run_well(const char *arguments)
{
    run(arguments);
    expect_code(&result, 0);
}

static inline bool is_there(const char *name)
{
    struct stat info;
    return stat(scratch(name), &info) == 0 && info.st_size > 0;
}

#endif
