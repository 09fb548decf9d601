// The queue between the receiving and the writing thread: first in, first out, bounded by its
// bytes.
#ifndef PLIANT_CLIENTS_RECORD_QUEUE_H
#define PLIANT_CLIENTS_RECORD_QUEUE_H

#include "item.h"

#include <pthread.h>

// What happens to an item that does not fit.
typedef enum QueueWhenFull {
    QUEUE_REFUSE, // destroy it
    QUEUE_WAIT,   // wait until the writer has freed space
    QUEUE_FORCE,  // accept it all the same: for few and small ones only
} QueueWhenFull;

typedef struct Queue {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    Item *first, *last;
    size_t bytes, limit;
    size_t most; // largest number of bytes so far
    bool closed; // no more items follow
} Queue;

void queue_create(Queue *queue, size_t limit);
// Destroys the queue and its items.
void queue_destroy(Queue *queue);

// Hands the item over. Returns false if it was refused; it is destroyed then.
bool queue_push(Queue *queue, Item *item, QueueWhenFull when_full);
// Ends pushing; the reader gets the remaining items, then NULL with `ended`.
void queue_close(Queue *queue);
// Returns the next item, or NULL if none came within `timeout_ms`, or at the end.
Item *queue_take(Queue *queue, int timeout_ms, bool *ended);

#endif
