#include "queue.h"

#include <errno.h>
#include <time.h>

void queue_create(Queue *queue, size_t limit)
{
    *queue = (Queue){.limit = limit};
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_mutex_init(&queue->lock, NULL);
    pthread_cond_init(&queue->changed, &attributes);
    pthread_condattr_destroy(&attributes);
}

void queue_destroy(Queue *queue)
{
    for (Item *item = queue->first; item;) {
        Item *next = item->next;
        item_destroy(item);
        item = next;
    }
    pthread_cond_destroy(&queue->changed);
    pthread_mutex_destroy(&queue->lock);
}

// True if the item fits, or if it is larger than the limit but the queue is empty.
static bool fits(const Queue *queue, const Item *item)
{
    return queue->bytes == 0 || item->bytes <= queue->limit - queue->bytes;
}

bool queue_push(Queue *queue, Item *item, QueueWhenFull when_full)
{
    pthread_mutex_lock(&queue->lock);
    while (when_full == QUEUE_WAIT && !fits(queue, item))
        pthread_cond_wait(&queue->changed, &queue->lock);
    bool taken = when_full == QUEUE_FORCE || fits(queue, item);
    if (taken) {
        item->next = NULL;
        if (queue->last)
            queue->last->next = item;
        else
            queue->first = item;
        queue->last = item;
        queue->bytes += item->bytes;
        if (queue->bytes > queue->most)
            queue->most = queue->bytes;
        pthread_cond_broadcast(&queue->changed);
    }
    pthread_mutex_unlock(&queue->lock);
    if (!taken)
        item_destroy(item);
    return taken;
}

void queue_close(Queue *queue)
{
    pthread_mutex_lock(&queue->lock);
    queue->closed = true;
    pthread_cond_broadcast(&queue->changed);
    pthread_mutex_unlock(&queue->lock);
}

static struct timespec later(int ms)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    t.tv_sec += ms / 1000;
    t.tv_nsec += (long)(ms % 1000) * 1000000;
    if (t.tv_nsec >= 1000000000) {
        t.tv_sec++;
        t.tv_nsec -= 1000000000;
    }
    return t;
}

Item *queue_take(Queue *queue, int timeout_ms, bool *ended)
{
    const struct timespec deadline = later(timeout_ms);
    pthread_mutex_lock(&queue->lock);
    int waited = 0;
    while (!queue->first && !queue->closed && waited != ETIMEDOUT)
        waited = pthread_cond_timedwait(&queue->changed, &queue->lock, &deadline);
    Item *item = queue->first;
    *ended = !item && queue->closed;
    if (item) {
        queue->first = item->next;
        if (!queue->first)
            queue->last = NULL;
        queue->bytes -= item->bytes;
        pthread_cond_broadcast(&queue->changed);
    }
    pthread_mutex_unlock(&queue->lock);
    return item;
}
