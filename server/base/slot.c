#include "base/slot.h"

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
