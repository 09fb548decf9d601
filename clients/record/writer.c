// SPDX-License-Identifier: MIT
// What waits on its way to the file, and the thread that writes it.
#include "writer.h"

#include "client.h"

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

// Bytes of a column, such that the next one is aligned.
static size_t aligned(size_t bytes)
{
    return (bytes + 3) / 4 * 4;
}

Item *item_topology(int body, const RecordingTopology *topology)
{
    size_t ids = (size_t)topology->node_count * sizeof *topology->node_id;
    size_t triangles = (size_t)topology->triangle_count * sizeof *topology->triangle;
    size_t later = 0;
#define LATER_BYTES(name, type, width, of, empty, sent, recorded)                                  \
    MESH_IF_LATER(recorded,                                                                        \
                  later += aligned((size_t)topology->node_count * sizeof *topology->node_##name);)
    MESH_COLUMNS(LATER_BYTES)
    Item *item = create(ITEM_TOPOLOGY, body, ids + triangles + later);
    char *at = behind(item);
    item->as.topology = *topology;
    item->as.topology.node_id = put(&at, topology->node_id, ids);
    item->as.topology.triangle = put(&at, topology->triangle, triangles);
#define PUT_LATER(name, type, width, of, empty, sent, recorded)                                    \
    MESH_IF_LATER(recorded, size = (size_t)topology->node_count * sizeof *topology->node_##name;   \
                  item->as.topology.node_##name = put(&at, topology->node_##name, size);           \
                  at += aligned(size) - size;)
    size_t size;
    MESH_COLUMNS(PUT_LATER)
    return item;
}

Item *item_look(int body, const RecordingLook *look)
{
    const size_t ids = (size_t)look->count * sizeof *look->id;
    const size_t colours = (size_t)look->count * sizeof *look->colour;
    Item *item = create(ITEM_LOOK, body, ids + colours);
    char *at = behind(item);
    item->as.look = *look;
    item->as.look.id = put(&at, look->id, ids);
    item->as.look.colour = put(&at, look->colour, colours);
    return item;
}

Item *item_map(int body, RecordingMapKind kind, const RecordingMap *map, const void *const column[],
               size_t bytes)
{
    Item *item = create(ITEM_MAP, body, bytes);
    char *at = behind(item);
    const char *first = put(&at, column[0], bytes);
    item->as.map.kind = kind;
    item->as.map.map = *map;
    for (int k = 0; k < RECORDING_MAP_COLUMNS; k++)
        if (column[k] != NULL)
            item->as.map.column[k] = first + ((const char *)column[k] - (const char *)column[0]);
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

Item *item_lines(RecordingList list, const RecordingLedger *line, int count)
{
    const size_t bytes = (size_t)count * sizeof *line;
    Item *item = create(ITEM_LINES, (int)list, bytes);
    char *at = behind(item);
    item->as.lines.line = put(&at, line, bytes);
    item->as.lines.count = count;
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
    // A log's reader waits; a network does not.
    while (when_full == QUEUE_WAIT && !fits(queue, item))
        pthread_cond_wait(&queue->changed, &queue->lock);
    bool taken = when_full == QUEUE_FORCE || fits(queue, item);
    // Behind the last one.
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
    // An item that was refused is nobody's.
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
    // The oldest frames make room.
    while (waiting->first &&
           (waiting->count == WAITING_FRAMES || waiting->bytes + bytes > WAITING_BYTES)) {
        free(waiting_pop(waiting));
        gone++;
    }
    WaitingFrame *frame = malloc(bytes);
    if (!frame)
        abort(); // waiting frames are bounded: the machine itself is out of memory
    // Positions lie behind it in the same block.
    *frame = (WaitingFrame){.frame = *from, .bytes = bytes};
    memcpy(frame->position, from->position, values * sizeof *from->position);
    frame->frame.position = frame->position;
    // Behind the last one.
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

// --- the writing thread --------------------------------------------------------------------------

enum { LOOK_EVERY_MS = 200 };

static void fail(Writer *writer, const Status *status)
{
    if (atomic_load(&writer->failed))
        return;
    writer->status = *status;
    atomic_store(&writer->failed, true);
}

// --- a file ---

static void begin(Writer *writer, Item *item)
{
    Status status = {0};
    writer->recording = recording_create(item->as.begin.path, &item->as.begin.options, &status);
    if (!writer->recording) {
        fail(writer, &status);
        item_destroy(item);
        return;
    }
    // A new file counts from 0.
    writer->begin = item;
    memset(writer->frames, 0, sizeof writer->frames);
    memset(writer->rows, 0, sizeof writer->rows);
    writer->events = writer->all_frames = 0;
    writer->first_time = writer->last_time = 0.0;
}

static void tell(const Writer *writer, const RecordingCounts *counts)
{
    const RecordingOptions *options = &writer->begin->as.begin.options;
    if (!writer->told)
        return;
    fprintf(writer->told, "recorded: %s, %.3f s\n", writer->begin->as.begin.path,
            writer->last_time - writer->first_time);
    // What is there of each body, and what is missing.
    for (int i = 0; i < options->body_count; i++) {
        const RecordingCounts none = {0}, *of = counts ? &counts[i] : &none;
        fprintf(writer->told,
                "body %s: frames %lld, lost %lld, dropped %lld, without mesh %lld, refused %lld\n",
                options->body[i].name, (long long)writer->frames[i], (long long)of->lost,
                (long long)of->dropped, (long long)of->without_mesh, (long long)of->refused);
    }
    // Tools and events have nothing that gets lost on the way.
    for (int i = 0; i < options->tool_count; i++)
        fprintf(writer->told, "tool %d: rows %lld\n", options->tool[i], (long long)writer->rows[i]);
    fprintf(writer->told, "events: %lld\n", (long long)writer->events);
    fprintf(writer->told, "waited at most: %.1f MB\n", (double)writer->queue.most * 1e-6);
    fflush(writer->told);
}

static void end(Writer *writer, const RecordingCounts *counts)
{
    Status status = {0};
    if (!writer->recording)
        return;
    // Counts first, since closing marks the file as complete.
    for (int i = 0; i < writer->begin->as.begin.options.body_count && counts; i++)
        recording_set_counts(writer->recording, i, &counts[i]);
    if (!recording_close(writer->recording, &status))
        fail(writer, &status);
    writer->recording = NULL;
    tell(writer, counts);
    item_destroy(writer->begin);
    writer->begin = NULL;
}

// --- items of a file ---

static void add_frame(Writer *writer, const Item *item)
{
    const RecordingFrame *frame = &item->as.frame;
    if (!recording_add_frame(writer->recording, item->index, frame))
        return;
    writer->frames[item->index]++;
    if (writer->all_frames++ == 0)
        writer->first_time = frame->time;
    writer->last_time = frame->time;
}

static void add(Writer *writer, const Item *item)
{
    Recording *recording = writer->recording;
    switch (item->kind) {
    case ITEM_TOPOLOGY:
        recording_add_topology(recording, item->index, &item->as.topology);
        break;
    case ITEM_LOOK:
        recording_add_look(recording, item->index, &item->as.look);
        break;
    case ITEM_MAP:
        recording_add_map(recording, item->index, item->as.map.kind, &item->as.map.map,
                          item->as.map.column);
        break;
    case ITEM_FRAME:
        add_frame(writer, item);
        break;
    case ITEM_TOOL:
        writer->rows[item->index] +=
            recording_add_tool(recording, item->index, item->as.tool.time, &item->as.tool.sample);
        break;
    case ITEM_EVENT:
        writer->events += recording_add_event(recording, &item->as.event);
        break;
    case ITEM_LINES:
        recording_add_lines(recording, item->index, item->as.lines.line, item->as.lines.count);
        break;
    default:
        break;
    }
}

static void take(Writer *writer, Item *item)
{
    bool failed = atomic_load(&writer->failed);
    // After a failure items are only thrown away.
    if (item->kind == ITEM_BEGIN && !failed) {
        begin(writer, item);
        return;
    }
    if (item->kind == ITEM_END)
        end(writer, item->as.counts);
    else if (writer->recording && !failed)
        add(writer, item);
    item_destroy(item);
}

// --- the thread ---

static void *writer_main(void *user)
{
    Writer *writer = user;
    bool ended = false;
    while (!ended) {
        // Write what has come, and make it permanent once a second.
        Item *item = queue_take(&writer->queue, LOOK_EVERY_MS, &ended);
        if (item)
            take(writer, item);
        if (!writer->recording)
            continue;
        recording_flush_if_due(writer->recording, client_now_ns());
        // The first failure ends the writing, not the thread.
        const Status *said = recording_status(writer->recording);
        if (said->code != STATUS_OK)
            fail(writer, said);
    }
    end(writer, NULL);
    return NULL;
}

bool writer_start(Writer *writer, size_t limit, FILE *told, Status *status)
{
    *writer = (Writer){.told = told};
    queue_create(&writer->queue, limit);
    int error = pthread_create(&writer->thread, NULL, writer_main, writer);
    if (error == 0)
        return true;
    queue_destroy(&writer->queue);
    return status_fail(status, STATUS_FAILED, "cannot start the writing thread: %s",
                       strerror(error));
}

bool writer_failed(Writer *writer)
{
    return atomic_load(&writer->failed);
}

bool writer_finish(Writer *writer, Status *status)
{
    queue_close(&writer->queue);
    pthread_join(writer->thread, NULL);
    queue_destroy(&writer->queue);
    return !atomic_load(&writer->failed) ||
           status_fail(status, writer->status.code, "%s", writer->status.text);
}
