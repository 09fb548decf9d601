// SPDX-License-Identifier: MIT
// The memory of a scene: the arena that owns all of it, and the list of those of its arrays that
// change while the scene runs.
#ifndef PLIANT_BASE_MEMORY_H
#define PLIANT_BASE_MEMORY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// --- arena ---
// All memory of a scene: allocated before the first tick, listed by name so that --explain can
// print what each feature costs. Load time only; the step thread never calls this.

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
// ends the program with a sentence and exit code 2 when memory is short (the caller validates
// sizes). The name is "body/array", truncated at 47 bytes.
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

// --- state ---
// The one list of all arrays that change while a scene runs. Each owner adds its arrays once, at
// load; checkpoint, resume, reset and hash walk this list, so that none of them can miss an array.

typedef struct StateArray {
    char name[64]; // unique, "body/array"
    void *memory[2];
    const int *current; // which of the two holds the state now; NULL: always the first
    size_t bytes;
    bool rare;  // excluded from the hash while all bytes are 0
    bool aside; // never in the hash
} StateArray;

typedef struct StateList {
    StateArray *array; // [count]
    int count, capacity;
} StateList;

// Adds an array, at load time. `memory` must not move; the name is unique and at most 63 bytes.
void state_add(StateList *list, void *memory, size_t bytes, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// Adds an array whose owner writes two buffers alternately: *current (0 or 1) is the valid one.
void state_add_pair(StateList *list, void *first, void *second, const int *current, size_t bytes,
                    const char *format, ...) __attribute__((format(printf, 6, 7)));
// Adds an array that is all 0 except in rare situations; while it is 0 it does not enter the hash,
// so that scenes without the feature keep their hashes.
void state_add_rare(StateList *list, void *memory, size_t bytes, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// Adds an array that the motion does not depend on, such as statistics; it never enters the hash.
void state_add_aside(StateList *list, void *memory, size_t bytes, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// Adds an array that only what is shown depends on: likewise, and a file may lack it; it is then 0.
void state_add_shown(StateList *list, void *memory, size_t bytes, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// Returns the memory that holds an array's state now.
void *state_memory(const StateArray *array);
// Returns the total size of all arrays.
size_t state_bytes(const StateList *list);
// Copies all arrays to or from one block of state_bytes() bytes; copying in fills both buffers of a
// pair. Does not allocate: safe on the step thread.
void state_copy_out(const StateList *list, void *block);
void state_copy_in(const StateList *list, const void *block);
// The same with a block in which what repeats is stored once. Packing returns the bytes of it;
// NULL: only that.
size_t state_pack(const StateList *list, void *block);
void state_unpack(const StateList *list, const void *block);
// Returns FNV-1a over all arrays in list order, without rare ones that are 0 and those aside: equal
// states have equal hashes.
uint64_t state_hash(const StateList *list);
void state_destroy(StateList *list);

#endif
