// The one list of arrays that change while a scene runs. Each owner adds its arrays once, at load;
// checkpoint, resume, reset and hash all walk this list, so that none can forget an array.
#ifndef PLIANT_BASE_STATE_H
#define PLIANT_BASE_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct StateArray {
    char name[64]; // unique, "body/array"
    void *memory[2];
    const int *current; // which of the two holds the state now; NULL: the first, always
    size_t bytes;
    bool rare; // not in the hash while all of it is 0
} StateArray;

typedef struct StateList {
    StateArray *array; // [count]
    int count, capacity;
} StateList;

// Load time. `memory` must stay where it is; the name is unique and at most 63 bytes.
void state_add(StateList *list, void *memory, size_t bytes, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// The same for an array whose owner writes two buffers in turn: *current (0 or 1) says which is
// valid.
void state_add_pair(StateList *list, void *first, void *second, const int *current, size_t bytes,
                    const char *format, ...) __attribute__((format(printf, 6, 7)));
// The same for an array that is all 0 unless something out of the common has happened: while it is,
// the hash does not know of it.
void state_add_rare(StateList *list, void *memory, size_t bytes, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// The memory that holds an array's state now.
void *state_memory(const StateArray *array);
size_t state_bytes(const StateList *list);
// Copies every array to or from one block of state_bytes(); into both buffers of a pair. No
// allocation: fit for the step thread.
void state_copy_out(const StateList *list, void *block);
void state_copy_in(const StateList *list, const void *block);
// FNV-1a over all arrays in their order, but for rare ones that are 0: equal states have equal
// hashes.
uint64_t state_hash(const StateList *list);
void state_destroy(StateList *list);

#endif
