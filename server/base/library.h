// SPDX-License-Identifier: MIT
// Shared libraries that are loaded when they are needed. server/on_demand.cmake writes their
// tables, and macros by which code calls the functions of a library under their own names.
#ifndef PLIANT_BASE_LIBRARY_H
#define PLIANT_BASE_LIBRARY_H

#include "base/check.h"

#include <stdint.h>

typedef struct Library {
    const char *soname;
    const char *const *name;
    uintptr_t *symbol; // [count] functions and variables, or 0
    int count;
    bool loaded;
} Library;

// Loads the library if it is not loaded yet; call before any of its symbols is used. Returns false
// with a sentence that names the file that needs it, and the library. Any thread but the step
// thread.
bool library_load(Library *library, const char *path, Status *status);

#endif
