// SPDX-License-Identifier: MIT
// How one thread hands values to another, without a lock and without allocation: a slot for the
// newest value, a ring for every value. One thread writes, one reads.
#ifndef PLIANT_BASE_HANDOVER_H
#define PLIANT_BASE_HANDOVER_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

// --- slot ---
// The latest value (triple buffer): the writer never waits, the reader gets the newest complete
// value.

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

// --- ring ---
// A bounded queue. A push to a full ring fails; the producer counts what it could not send.

typedef struct Ring {
    unsigned char *memory; // capacity * stride bytes, owned by the caller of ring_init
    size_t stride;
    unsigned capacity;                // a power of two
    _Alignas(64) atomic_uint head;    // next to write; only the producer changes it
    _Alignas(64) atomic_uint tail;    // next to read; only the consumer changes it
    _Alignas(64) unsigned high_water; // most entries ever waiting; written by the producer
} Ring;

// `memory` holds capacity * stride bytes and outlives the ring; `capacity` is a power of two.
void ring_init(Ring *ring, void *memory, unsigned capacity, size_t stride);
// Producer: copies one entry in; false when the ring is full.
bool ring_push(Ring *ring, const void *entry);
// Producer, without a copy: ring_back returns the next entry to fill, or NULL when the ring is
// full; ring_publish hands it over.
void *ring_back(Ring *ring);
void ring_publish(Ring *ring);
// Consumer: returns the oldest entry or NULL; it stays valid until ring_pop.
const void *ring_peek(Ring *ring);
void ring_pop(Ring *ring);

#endif
