// A latest-value slot between two threads (triple buffer): the writer never waits, the reader gets
// the newest complete value. One writer thread, one reader thread, no lock, no allocation.
#ifndef PLIANT_BASE_SLOT_H
#define PLIANT_BASE_SLOT_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

typedef struct Slot {
    unsigned char *memory; // 3 values of `stride` bytes, owned by the caller of slot_init
    size_t stride;
    atomic_uint middle;   // index of the exchanged buffer, plus SLOT_FRESH when unread
    unsigned back, front; // private to the writer and to the reader
} Slot;

enum { SLOT_FRESH = 4 };

// `memory` holds 3 * stride bytes and outlives the slot.
void slot_init(Slot *slot, void *memory, size_t stride);
// Writer: slot_back returns the buffer to fill, slot_publish hands it over.
void *slot_back(Slot *slot);
void slot_publish(Slot *slot);
// Reader: returns the newest published value, or NULL if nothing was published since the last call.
// The value stays valid until the next call.
const void *slot_take(Slot *slot);

#endif
