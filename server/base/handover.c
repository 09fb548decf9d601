// SPDX-License-Identifier: MIT
#include "base/handover.h"

#include "base/check.h"

#include <string.h>

// --- slot ---

void slot_init(Slot *slot, void *memory, size_t stride)
{
    slot->memory = memory;
    slot->stride = stride;
    slot->back = 0;
    slot->front = 2;
    atomic_init(&slot->middle, 1);
}

void *slot_back(Slot *slot)
{
    return slot->memory + slot->back * slot->stride;
}

void slot_publish(Slot *slot)
{
    // Release: the reader sees our writes before the index. Acquire: we do not write a buffer that
    // is still being read.
    unsigned old =
        atomic_exchange_explicit(&slot->middle, slot->back | SLOT_FRESH, memory_order_acq_rel);
    slot->back = old & 3;
}

const void *slot_take(Slot *slot)
{
    if ((atomic_load_explicit(&slot->middle, memory_order_relaxed) & SLOT_FRESH) == 0)
        return NULL;
    unsigned old = atomic_exchange_explicit(&slot->middle, slot->front, memory_order_acq_rel);
    slot->front = old & 3;
    return slot->memory + slot->front * slot->stride;
}

// --- ring ---

void ring_init(Ring *ring, void *memory, unsigned capacity, size_t stride)
{
    ASSERT(capacity > 0 && (capacity & (capacity - 1)) == 0);
    ring->memory = memory;
    ring->stride = stride;
    ring->capacity = capacity;
    ring->high_water = 0;
    atomic_init(&ring->head, 0);
    atomic_init(&ring->tail, 0);
}

void *ring_back(Ring *ring)
{
    unsigned head = atomic_load_explicit(&ring->head, memory_order_relaxed);
    unsigned tail = atomic_load_explicit(&ring->tail, memory_order_acquire);
    if (head - tail == ring->capacity)
        return NULL;
    return ring->memory + (head & (ring->capacity - 1)) * ring->stride;
}

void ring_publish(Ring *ring)
{
    unsigned head = atomic_load_explicit(&ring->head, memory_order_relaxed) + 1;
    unsigned waiting = head - atomic_load_explicit(&ring->tail, memory_order_relaxed);
    atomic_store_explicit(&ring->head, head, memory_order_release);
    if (waiting > ring->high_water)
        ring->high_water = waiting;
}

bool ring_push(Ring *ring, const void *entry)
{
    void *back = ring_back(ring);
    if (back == NULL)
        return false;
    memcpy(back, entry, ring->stride);
    ring_publish(ring);
    return true;
}

const void *ring_peek(Ring *ring)
{
    unsigned tail = atomic_load_explicit(&ring->tail, memory_order_relaxed);
    unsigned head = atomic_load_explicit(&ring->head, memory_order_acquire);
    return head == tail ? NULL : ring->memory + (tail & (ring->capacity - 1)) * ring->stride;
}

void ring_pop(Ring *ring)
{
    unsigned tail = atomic_load_explicit(&ring->tail, memory_order_relaxed);
    atomic_store_explicit(&ring->tail, tail + 1, memory_order_release);
}
