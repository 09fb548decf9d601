#include "base/ring.h"

#include "base/check.h"

#include <string.h>

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

bool ring_push(Ring *ring, const void *entry)
{
    unsigned head = atomic_load_explicit(&ring->head, memory_order_relaxed);
    unsigned tail = atomic_load_explicit(&ring->tail, memory_order_acquire);
    unsigned waiting = head - tail;
    if (waiting == ring->capacity)
        return false;
    memcpy(ring->memory + (head & (ring->capacity - 1)) * ring->stride, entry, ring->stride);
    atomic_store_explicit(&ring->head, head + 1, memory_order_release);
    if (waiting + 1 > ring->high_water)
        ring->high_water = waiting + 1;
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
