// Frames of a body that wait for their mesh or for the file to begin. Bounded; the oldest are
// dropped first.
#ifndef PLIANT_CLIENTS_RECORD_WAITING_H
#define PLIANT_CLIENTS_RECORD_WAITING_H

#include "io/recording.h"

#include <stddef.h>

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

#endif
