// SPDX-License-Identifier: MIT
// Local variables that are destroyed where their scope ends, in a loop in each round, the last one
// first:
//
//     SCOPED(fixture_destroy) Fixture fixture;
//     FREED Vec3 *x = malloc(bytes);
//     CLOSED FILE *out = fopen(path, "w");
//
// Nothing may leave the scope before what creates them. A claim that fails leaves its scopes by a
// jump, and their memory to the end of the program. Includes stdio.h, stdlib.h and string.h.
#ifndef PLIANT_TESTS_SCOPED_H
#define PLIANT_TESTS_SCOPED_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// By a function of a pointer to the variable.
#define SCOPED(destroy) __attribute__((cleanup(destroy), unused))
// By free, and by fclose.
#define FREED  SCOPED(scoped_free)
#define CLOSED SCOPED(scoped_close)

// Memory for so many, at least one; ends the program if there is none.
static inline void *zeroed(size_t count, size_t size)
{
    void *memory = calloc(count > 0 ? count : 1, size);
    if (memory == NULL)
        abort();
    return memory;
}

static inline void scoped_free(void *variable)
{
    void *memory;
    memcpy(&memory, variable, sizeof memory);
    free(memory);
}

static inline void scoped_close(FILE **file)
{
    fclose(*file);
}

#endif
