// What waits on its way to the file.
#include "queue.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

// --- items ---------------------------------------------------------------------------------------

// Creates an item with `extra` bytes after it.
static Item *create(ItemKind kind, int index, size_t extra)
{
    Item *item = malloc(sizeof *item + extra);
    if (!item)
        abort();
    *item = (Item){.kind = kind, .index = index, .bytes = sizeof *item + extra};
    return item;
}

static void *behind(Item *item)
{
    return item + 1;
}

// Copies `size` bytes to *at and advances it; returns the copy.
static void *put(char **at, const void *from, size_t size)
{
    char *to = *at;
    if (size)
        memcpy(to, from, size);
    *at += size;
    return to;
}

Item *item_begin(const char *path, const RecordingOptions *options)
{
    // Everything in one block: arrays and texts follow the item.
    size_t bodies = (size_t)options->body_count, tools = (size_t)options->tool_count;
    size_t extra = bodies * sizeof(RecordingBody) + tools * sizeof(int) + strlen(path) +
                   strlen(options->scene) + strlen(options->created_by) + 3;
    for (size_t i = 0; i < bodies; i++)
        extra += strlen(options->body[i].name) + 1;
    Item *item = create(ITEM_BEGIN, 0, extra);
    RecordingOptions *to = &item->as.begin.options;
    char *at = behind(item);
    *to = *options;
    RecordingBody *body = put(&at, options->body, bodies * sizeof *body); // strictest alignment
    to->tool = put(&at, options->tool, tools * sizeof *options->tool);
    for (size_t i = 0; i < bodies; i++)
        body[i].name = put(&at, body[i].name, strlen(body[i].name) + 1);
    to->body = body;
    to->scene = put(&at, options->scene, strlen(options->scene) + 1);
    to->created_by = put(&at, options->created_by, strlen(options->created_by) + 1);
    item->as.begin.path = put(&at, path, strlen(path) + 1);
    return item;
}

Item *item_topology(int body, const RecordingTopology *topology)
{
    size_t ids = (size_t)topology->node_count * sizeof *topology->node_id;
    size_t triangles = (size_t)topology->triangle_count * sizeof *topology->triangle;
    Item *item = create(ITEM_TOPOLOGY, body, ids + triangles);
    char *at = behind(item);
    item->as.topology = *topology;
    item->as.topology.node_id = put(&at, topology->node_id, ids);
    item->as.topology.triangle = put(&at, topology->triangle, triangles);
    return item;
}

Item *item_frame(int body, const RecordingFrame *frame, const RecordingMesh *mesh)
{
    size_t live = (size_t)mesh->live_count;
    Item *item = create(ITEM_FRAME, body, 3 * live * sizeof *frame->position);
    float *position = behind(item);
    recording_mesh_positions(mesh, frame->position, position);
    item->as.frame = *frame;
    item->as.frame.node_count = mesh->live_count;
    item->as.frame.position = position;
    return item;
}

Item *item_tool(int tool, double time, const RecordingTool *sample)
{
    Item *item = create(ITEM_TOOL, tool, 0);
    item->as.tool.time = time;
    item->as.tool.sample = *sample;
    return item;
}

Item *item_event(const RecordingEvent *event)
{
    Item *item = create(ITEM_EVENT, 0, 0);
    item->as.event = *event;
    return item;
}

Item *item_end(const RecordingCounts *counts, int body_count)
{
    size_t bytes = (size_t)body_count * sizeof *counts;
    Item *item = create(ITEM_END, 0, bytes);
    char *at = behind(item);
    item->as.counts = put(&at, counts, bytes);
    return item;
}

void item_destroy(Item *item)
{
    free(item);
}

// --- the queue -----------------------------------------------------------------------------------

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
    // Wait for an item, for the end, or until it is time to look elsewhere.
    while (!queue->first && !queue->closed && waited != ETIMEDOUT)
        waited = pthread_cond_timedwait(&queue->changed, &queue->lock, &deadline);
    Item *item = queue->first;
    *ended = !item && queue->closed;
    // Room for those that wait to push.
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

// --- frames that wait for their mesh -------------------------------------------------------------

WaitingFrame *waiting_pop(Waiting *waiting)
{
    WaitingFrame *frame = waiting->first;
    if (!frame)
        return NULL;
    waiting->first = frame->next;
    if (!waiting->first)
        waiting->last = NULL;
    waiting->count--;
    waiting->bytes -= frame->bytes;
    return frame;
}

int waiting_push(Waiting *waiting, const RecordingFrame *from)
{
    size_t values = 3 * (size_t)from->node_count;
    size_t bytes = sizeof(WaitingFrame) + values * sizeof *from->position;
    int gone = 0;
    while (waiting->first &&
           (waiting->count == WAITING_FRAMES || waiting->bytes + bytes > WAITING_BYTES)) {
        free(waiting_pop(waiting));
        gone++;
    }
    WaitingFrame *frame = malloc(bytes);
    if (!frame)
        abort(); // waiting frames are bounded: the machine itself is out of memory
    *frame = (WaitingFrame){.frame = *from, .bytes = bytes};
    memcpy(frame->position, from->position, values * sizeof *from->position);
    frame->frame.position = frame->position;
    if (waiting->last)
        waiting->last->next = frame;
    else
        waiting->first = frame;
    waiting->last = frame;
    waiting->count++;
    waiting->bytes += bytes;
    return gone;
}

int waiting_drop(Waiting *waiting)
{
    int gone = waiting->count;
    for (WaitingFrame *frame; (frame = waiting_pop(waiting));)
        free(frame);
    return gone;
}
