// All memory of a scene: allocated before the first tick, listed by name so that --explain can
// print what each feature costs. Load time only; the step thread never calls this.
#ifndef PLIANT_BASE_ARENA_H
#define PLIANT_BASE_ARENA_H

#include <stddef.h>

typedef enum ArenaUse {
    ARENA_STEP,     // read or written by every step
    ARENA_CONTACT,  // read or written while a tool is near
    ARENA_TOPOLOGY, // meshes and tables of connectivity
    ARENA_OUTPUT,   // snapshots, message buffers, checkpoint buffers
} ArenaUse;

typedef struct ArenaBlock {
    void *memory;
    size_t bytes;
    ArenaUse use;
    char name[48];
} ArenaBlock;

typedef struct Arena {
    ArenaBlock *block; // [count], in the order of allocation
    int count, capacity;
} Arena;

// Returns `count` zeroed elements of `size` bytes, 64-byte aligned, owned by the arena. Never NULL:
// aborts when the machine is out of memory (the caller validates sizes). The name is "body/array",
// truncated at 47 bytes.
void *arena_allocate(Arena *arena, ArenaUse use, size_t count, size_t size, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
// Returns `count` zeroed elements of `type` (a type, or an expression of it) as the array
// "name/label"; for functions that have an `arena` and the `name` of a body.
#define ALLOCATE(use, count, type, label)                                                          \
    arena_allocate(arena, (use), (size_t)(count), sizeof(type), "%s/%s", name, label)
// Returns the bytes of all blocks.
size_t arena_bytes(const Arena *arena);
// Returns the bytes of the blocks of one use.
size_t arena_bytes_of(const Arena *arena, ArenaUse use);
// Frees all blocks and leaves the arena empty ({0}).
void arena_destroy(Arena *arena);

#endif
