// The writing thread: takes items from the queue and makes recordings of them, one file at a time.
// It alone touches the files.
#ifndef PLIANT_CLIENTS_RECORD_WRITER_H
#define PLIANT_CLIENTS_RECORD_WRITER_H

#include "queue.h"

#include <stdatomic.h>
#include <stdio.h>

typedef struct Writer {
    Queue queue;
    pthread_t thread;
    FILE *told; // where it says what was recorded, or NULL
    atomic_bool failed;
    Status status; // the first failure; to be read once `failed`, or after the end
    // of the file under way; the thread's own
    Recording *recording;
    Item *begin; // its name and bodies
    int64_t frames[ITEM_BODIES], rows[ITEM_TOOLS], events;
    int64_t all_frames;
    double first_time, last_time; // of its frames [s]
} Writer;

// `limit`: bytes that may wait.
bool writer_start(Writer *writer, size_t limit, FILE *told, Status *status);
// Has failed: a file could not be made, or not all could be written. What comes then is thrown
// away.
bool writer_failed(Writer *writer);
// Writes what waits, ends the file under way and the thread. False with the first failure.
bool writer_finish(Writer *writer, Status *status);

#endif
