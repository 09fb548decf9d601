// A bounded queue between two threads: one producer, one consumer, no lock, no allocation. A push
// to a full ring fails; the producer counts what it could not send.
#ifndef PLIANT_BASE_RING_H
#define PLIANT_BASE_RING_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

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
