// SPDX-License-Identifier: MIT
// What waits on its way to the file, and the thread that writes it: items, the queue of them,
// frames that wait for their mesh.
#ifndef PLIANT_CLIENTS_RECORD_WRITER_H
#define PLIANT_CLIENTS_RECORD_WRITER_H

#include "io/recording.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdio.h>

// --- items ---------------------------------------------------------------------------------------

// A part of a recording that the receiving thread hands to the writing one, in one block of memory
// owned by the thread that has it.

enum { ITEM_BODIES = 64, ITEM_TOOLS = 32 }; // most in a file: as many as in a scene

typedef enum ItemKind {
    ITEM_BEGIN, // a file
    ITEM_TOPOLOGY,
    ITEM_LOOK,
    ITEM_MAP,
    ITEM_FRAME,
    ITEM_TOOL,
    ITEM_EVENT,
    ITEM_LINES,
    ITEM_END, // of the file
} ItemKind;

typedef struct Item {
    ItemKind kind;
    int index;    // of the body or the tool in the file, or the list
    size_t bytes; // of the whole item
    struct Item *next;
    union {
        struct {
            const char *path;
            RecordingOptions options;
        } begin;
        RecordingTopology topology;
        RecordingLook look;
        struct {
            RecordingMapKind kind;
            RecordingMap map;
            const void *column[RECORDING_MAP_COLUMNS];
        } map;
        RecordingFrame frame;
        struct {
            double time; // [s]
            RecordingTool sample;
        } tool;
        RecordingEvent event;
        struct {
            const RecordingLedger *line;
            int count;
        } lines;
        const RecordingCounts *counts; // [body_count]
    } as;
} Item;

// Each copies its arguments; aborts without memory, since the waiting items are bounded.
Item *item_begin(const char *path, const RecordingOptions *options);
Item *item_topology(int body, const RecordingTopology *topology);
Item *item_look(int body, const RecordingLook *look);
// `column`: behind each other, `bytes` in all.
Item *item_map(int body, RecordingMapKind kind, const RecordingMap *map, const void *const column[],
               size_t bytes);
// Makes a frame from the positions of all slots; the item has those of live nodes.
Item *item_frame(int body, const RecordingFrame *frame, const RecordingMesh *mesh);
Item *item_tool(int tool, double time, const RecordingTool *sample);
Item *item_event(const RecordingEvent *event);
Item *item_lines(RecordingList list, const RecordingLedger *line, int count);
Item *item_end(const RecordingCounts *counts, int body_count);
void item_destroy(Item *item);

// --- the queue -----------------------------------------------------------------------------------

// The queue between the receiving and the writing thread: first in, first out, bounded by its
// bytes.

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

// --- frames that wait for their mesh -------------------------------------------------------------

// Frames of a body that wait for their mesh or for the file to begin. Bounded; the oldest are
// dropped first.

enum { WAITING_FRAMES = 256, WAITING_BYTES = 128 << 20 }; // at most

typedef struct WaitingFrame {
    struct WaitingFrame *next;
    RecordingFrame frame; // its positions follow
    size_t bytes;
    float position[];
} WaitingFrame;

typedef struct Waiting {
    WaitingFrame *first, *last;
    int count;
    size_t bytes;
} Waiting;

// Copies a frame to the end. Returns the number of frames dropped for it.
int waiting_push(Waiting *waiting, const RecordingFrame *frame);
// Returns the oldest, which the caller frees, or NULL.
WaitingFrame *waiting_pop(Waiting *waiting);
// Drops all of them; returns how many.
int waiting_drop(Waiting *waiting);

// --- the writing thread --------------------------------------------------------------------------

// The writing thread: takes items from the queue and writes recordings, one file at a time. Only
// this thread touches the files.

typedef struct Writer {
    Queue queue;
    pthread_t thread;
    FILE *told; // where it reports what was recorded, or NULL
    atomic_bool failed;
    Status status; // the first failure; read it once `failed`, or after the end
    // of the current file; used by the thread alone
    Recording *recording;
    Item *begin; // its name and bodies
    int64_t frames[ITEM_BODIES], rows[ITEM_TOOLS], events;
    int64_t all_frames;
    double first_time, last_time; // of the file's frames [s]
} Writer;

// `limit`: largest number of waiting bytes.
bool writer_start(Writer *writer, size_t limit, FILE *told, Status *status);
// True if a file could not be made or not completely written. Later items are discarded.
bool writer_failed(Writer *writer);
// Writes the waiting items, ends the current file and the thread. Returns false with the first
// failure.
bool writer_finish(Writer *writer, Status *status);

#endif
