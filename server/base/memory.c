// SPDX-License-Identifier: MIT
#include "base/memory.h"

#include "base/check.h"
#include "base/fnv.h"
#include "base/log.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Ends the program where memory is short: at load time nothing could go on without it, and it is no
// fault of the program.
static void *have(void *memory, size_t bytes, const char *what)
{
    if (memory != NULL)
        return memory;
    log_line(LOG_ERROR,
             "%.3g MB of memory for %s are not to be had: raise the limit (ulimit -v, MemoryMax), "
             "or take fewer nodes or cells",
             (double)bytes * 1e-6, what);
    exit(STATUS_INVALID);
}

// --- arena ---

void *arena_allocate(Arena *arena, ArenaUse use, size_t count, size_t size, const char *format, ...)
{
    // The list of blocks doubles, so that adding stays cheap.
    if (arena->count == arena->capacity) {
        arena->capacity = arena->capacity == 0 ? 64 : 2 * arena->capacity;
        const size_t list = (size_t)arena->capacity * sizeof *arena->block;
        arena->block = have(realloc(arena->block, list), list, "a list of arrays");
    }
    // Blocks begin at cache lines and have at least one; zero, so that runs repeat.
    ASSERT(size == 0 || count <= (SIZE_MAX - 64) / size);
    size_t bytes = count * size;
    size_t rounded = bytes == 0 ? 64 : (bytes + 63) / 64 * 64;
    // Remember the block under its name.
    ArenaBlock *block = &arena->block[arena->count];
    *block = (ArenaBlock){.bytes = bytes, .use = use};
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(block->name, sizeof block->name, format, arguments);
    va_end(arguments);
    block->memory = have(aligned_alloc(64, rounded), rounded, block->name);
    arena->count++;
    return memset(block->memory, 0, rounded);
}

size_t arena_bytes(const Arena *arena)
{
    size_t bytes = 0;
    for (int i = 0; i < arena->count; i++)
        bytes += arena->block[i].bytes;
    return bytes;
}

size_t arena_bytes_of(const Arena *arena, ArenaUse use)
{
    size_t bytes = 0;
    for (int i = 0; i < arena->count; i++)
        if (arena->block[i].use == use)
            bytes += arena->block[i].bytes;
    return bytes;
}

void arena_destroy(Arena *arena)
{
    for (int i = 0; i < arena->count; i++)
        free(arena->block[i].memory);
    free(arena->block);
    *arena = (Arena){0};
}

// --- state ---

static StateArray *append(StateList *list, void *memory, size_t bytes, const char *format,
                          va_list arguments)
{
    if (list->count == list->capacity) {
        list->capacity = list->capacity == 0 ? 32 : 2 * list->capacity;
        const size_t size = (size_t)list->capacity * sizeof *list->array;
        list->array = have(realloc(list->array, size), size, "a list of arrays");
    }
    // The name comes last: only a name that is new makes it part of the list.
    StateArray *array = &list->array[list->count];
    *array = (StateArray){.memory = {memory}, .bytes = bytes};
    int length = vsnprintf(array->name, sizeof array->name, format, arguments);
    ASSERT(length > 0 && length < (int)sizeof array->name);
    for (int i = 0; i < list->count; i++)
        ASSERT(strcmp(list->array[i].name, array->name) != 0);
    list->count++;
    return array;
}

void state_add(StateList *list, void *memory, size_t bytes, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    append(list, memory, bytes, format, arguments);
    va_end(arguments);
}

void state_add_pair(StateList *list, void *first, void *second, const int *current, size_t bytes,
                    const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    StateArray *array = append(list, first, bytes, format, arguments);
    va_end(arguments);
    array->memory[1] = second;
    array->current = current;
}

void state_add_rare(StateList *list, void *memory, size_t bytes, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    append(list, memory, bytes, format, arguments)->rare = true;
    va_end(arguments);
}

void state_add_aside(StateList *list, void *memory, size_t bytes, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    append(list, memory, bytes, format, arguments)->aside = true;
    va_end(arguments);
}

void state_add_shown(StateList *list, void *memory, size_t bytes, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    StateArray *array = append(list, memory, bytes, format, arguments);
    va_end(arguments);
    array->aside = array->rare = true;
}

void *state_memory(const StateArray *array)
{
    return array->memory[array->current == NULL ? 0 : *array->current];
}

size_t state_bytes(const StateList *list)
{
    size_t bytes = 0;
    for (int i = 0; i < list->count; i++)
        bytes += list->array[i].bytes;
    return bytes;
}

void state_copy_out(const StateList *list, void *block)
{
    unsigned char *to = block;
    for (int i = 0; i < list->count; i++) {
        memcpy(to, state_memory(&list->array[i]), list->array[i].bytes);
        to += list->array[i].bytes;
    }
}

void state_copy_in(const StateList *list, const void *block)
{
    const unsigned char *from = block;
    for (int i = 0; i < list->count; i++) {
        // Fill both buffers: an owner may skip unused slots when it writes, and their content must
        // not depend on what was there before.
        memcpy(list->array[i].memory[0], from, list->array[i].bytes);
        if (list->array[i].memory[1] != NULL)
            memcpy(list->array[i].memory[1], from, list->array[i].bytes);
        from += list->array[i].bytes;
    }
}

// ---------------------------------------------------------------------------------------------
// Packed copies: units, each of which is often equal to the one before

enum { UNIT = 32, LEAST = 2 }; // bytes; units that are worth a run

// Units of their own, then repetitions of the last of them.
typedef struct Run {
    size_t own, same;
} Run;

static Run find_run(const unsigned char *from, size_t units)
{
    size_t end = 1, same = 0;
    for (; end < units; end++) {
        if (memcmp(from + end * UNIT, from + (end - 1) * UNIT, UNIT) == 0)
            same++;
        else if (same >= LEAST)
            break;
        else
            same = 0;
    }
    return (Run){end - same, same};
}

// Packs an array, if `to` is not NULL. Returns the bytes that it takes.
static size_t pack(const unsigned char *from, size_t bytes, unsigned char *to)
{
    size_t at = 0;
    for (size_t left = bytes / UNIT; left > 0;) {
        const Run run = find_run(from, left);
        if (to != NULL) {
            memcpy(to + at, &run, sizeof run);
            memcpy(to + at + sizeof run, from, run.own * UNIT);
        }
        at += sizeof run + run.own * UNIT;
        from += (run.own + run.same) * UNIT;
        left -= run.own + run.same;
    }
    if (to != NULL)
        memcpy(to + at, from, bytes % UNIT);
    return at + bytes % UNIT;
}

// Unpacks an array of so many bytes. Returns what follows it.
static const unsigned char *unpack(const unsigned char *from, unsigned char *to, size_t bytes)
{
    for (size_t left = bytes / UNIT; left > 0;) {
        Run run;
        memcpy(&run, from, sizeof run);
        from += sizeof run;
        memcpy(to, from, run.own * UNIT);
        from += run.own * UNIT;
        to += run.own * UNIT;
        for (size_t k = 0; k < run.same; k++, to += UNIT)
            memcpy(to, from - UNIT, UNIT);
        left -= run.own + run.same;
    }
    memcpy(to, from, bytes % UNIT);
    return from + bytes % UNIT;
}

size_t state_pack(const StateList *list, void *block)
{
    size_t bytes = 0;
    for (int i = 0; i < list->count; i++)
        bytes += pack(state_memory(&list->array[i]), list->array[i].bytes,
                      block != NULL ? (unsigned char *)block + bytes : NULL);
    return bytes;
}

void state_unpack(const StateList *list, const void *block)
{
    const unsigned char *from = block;
    for (int i = 0; i < list->count; i++) {
        const StateArray *array = &list->array[i];
        const unsigned char *end = unpack(from, array->memory[0], array->bytes);
        if (array->memory[1] != NULL) // as in state_copy_in
            unpack(from, array->memory[1], array->bytes);
        from = end;
    }
}

static bool is_zero(const unsigned char *byte, size_t bytes)
{
    for (size_t k = 0; k < bytes; k++)
        if (byte[k] != 0)
            return false;
    return true;
}

uint64_t state_hash(const StateList *list)
{
    uint64_t hash = FNV_START;
    for (int i = 0; i < list->count; i++) {
        const unsigned char *byte = state_memory(&list->array[i]);
        if (list->array[i].aside || (list->array[i].rare && is_zero(byte, list->array[i].bytes)))
            continue;
        hash = fnv_bytes(hash, byte, list->array[i].bytes);
    }
    return hash;
}

void state_destroy(StateList *list)
{
    free(list->array);
    *list = (StateList){0};
}
