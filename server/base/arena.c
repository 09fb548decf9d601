#include "base/arena.h"

#include "base/check.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *arena_allocate(Arena *arena, ArenaUse use, size_t count, size_t size, const char *format, ...)
{
    if (arena->count == arena->capacity) {
        arena->capacity = arena->capacity == 0 ? 64 : 2 * arena->capacity;
        arena->block = realloc(arena->block, (size_t)arena->capacity * sizeof *arena->block);
        ASSERT(arena->block != NULL);
    }
    ASSERT(size == 0 || count <= (SIZE_MAX - 64) / size);
    size_t bytes = count * size;
    size_t rounded = bytes == 0 ? 64 : (bytes + 63) / 64 * 64;
    void *memory = aligned_alloc(64, rounded);
    ASSERT(memory != NULL);
    memset(memory, 0, rounded);

    ArenaBlock *block = &arena->block[arena->count++];
    *block = (ArenaBlock){.memory = memory, .bytes = bytes, .use = use};
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(block->name, sizeof block->name, format, arguments);
    va_end(arguments);
    return memory;
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
