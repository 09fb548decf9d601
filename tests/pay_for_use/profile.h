// SPDX-License-Identifier: MIT
// What a run of the daemon executes, counted by valgrind's callgrind, and in which source file each
// of its functions stands.
#ifndef PLIANT_TESTS_PAY_FOR_USE_PROFILE_H
#define PLIANT_TESTS_PAY_FOR_USE_PROFILE_H

#include <stdbool.h>

enum { PROFILE_FUNCTIONS = 4096 };

typedef struct ProfileFunction {
    char name[120];
    bool ours; // of the daemon itself, not of a library
    long long instructions;
} ProfileFunction;

typedef struct Profile {
    int count;
    ProfileFunction function[PROFILE_FUNCTIONS]; // with what they executed themselves
    long long instructions;                      // all, libraries too
} Profile;

// Reads which file defines which function, from the modules' libraries in the folder of the build
// and the project's sources. False: there is none.
bool profile_read_symbols(const char *build, const char *sources);
// Runs "PLIANTD ARGUMENTS" and counts what happens inside `function`, calls included. Fails the
// test when it does not end well.
void profile_run(Profile *profile, const char *valgrind, const char *pliantd, const char *function,
                 const char *arguments);
// A file that defines the function ("surface/detail/refine.c"), or "?".
const char *profile_file(const char *function);
// Whether a file that defines the function begins with one of these, up to NULL. Of several that
// define static functions of one name, each counts.
bool profile_is_in(const char *function, const char *const *beginnings);

#endif
