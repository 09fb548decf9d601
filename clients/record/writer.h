// The writing thread: takes items from the queue and writes recordings, one file at a time. Only
// this thread touches the files.
#ifndef PLIANT_CLIENTS_RECORD_WRITER_H
#define PLIANT_CLIENTS_RECORD_WRITER_H

#include "queue.h"

#include <stdatomic.h>
#include <stdio.h>

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
