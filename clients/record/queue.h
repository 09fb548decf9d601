// What waits between the receiving and the writing thread: bounded by its bytes, first in first
// out.
#ifndef PLIANT_CLIENTS_RECORD_QUEUE_H
#define PLIANT_CLIENTS_RECORD_QUEUE_H

#include "item.h"

#include <pthread.h>

// What to do with an item that does not fit.
typedef enum QueueWhenFull {
    QUEUE_REFUSE, // destroy it
    QUEUE_WAIT,   // until the writer has made room
    QUEUE_FORCE,  // take it all the same: few and small ones only
} QueueWhenFull;

typedef struct Queue {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    Item *first, *last;
    size_t bytes, limit;
    size_t most; // bytes that ever waited
    bool closed; // nothing more will come
} Queue;

void queue_create(Queue *queue, size_t limit);
// Destroys what is still in it.
void queue_destroy(Queue *queue);

// Hands the item over. False when it was refused, and counts as gone.
bool queue_push(Queue *queue, Item *item, QueueWhenFull when_full);
// No more pushes; the taker gets what is there, then NULL with `closed`.
void queue_close(Queue *queue);
// The next item, or NULL when none came within `timeout_ms`, or at the end.
Item *queue_take(Queue *queue, int timeout_ms, bool *ended);

#endif
