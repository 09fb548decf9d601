// SPDX-License-Identifier: MIT
// The recorded colours of one body's nodes, by their ids. One thread.
#ifndef PLIANT_PLAY_COLOURS_H
#define PLIANT_PLAY_COLOURS_H

#include "timeline.h"

typedef struct Colours {
    int part; // of the timeline that the rows are of, from 1; 0: none yet
    int rows; // 0: the body has no colours
    int *topology, *id;
    unsigned char (*colour)[RECORDING_COLOURS];
    int *order; // rows by id, those of one id as in the file
    unsigned char own[RECORDING_COLOURS];
} Colours;

// Reads the rows of the part that a frame is in, unless they are there. False with `status`.
bool colours_read(Colours *colours, Timeline *timeline, const TimelineFrame *at, int body,
                  Status *status);
void colours_destroy(Colours *colours);

// True if nodes have colours of their own.
bool colours_vary(const Colours *colours);
// Returns the colours of a node in a topology: those of the newest row that is not of a later one,
// or else of the first one, which came too late; those of the body if the node has none.
const unsigned char *colours_of(const Colours *colours, int id, int topology);

#endif
