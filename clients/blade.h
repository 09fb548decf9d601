// SPDX-License-Identifier: MIT
// The path of a blade's edge: given by points on the command line, or read from a file. One thread.
#ifndef PLIANT_CLIENTS_BLADE_H
#define PLIANT_CLIENTS_BLADE_H

#include "program.h"
#include "track.h"

enum { BLADE_EDGES_MAX = 1000000 };

// One position of the edge; between two of them it sweeps a quadrilateral.
typedef struct BladePosition {
    double end[2][3]; // world [m]
    bool lifted;      // nothing is swept between the previous position and this one
} BladePosition;

typedef struct BladePath {
    BladePosition *position; // [count]; owned
    int count, capacity;
} BladePath;

// Appends a position; the path starts zeroed. Returns false without memory, or beyond
// BLADE_EDGES_MAX.
bool blade_add(BladePath *path, const double end[2][3], bool lifted);
// Reads lines "x y z x y z": the two ends of the edge [m]; a line "lift" starts another stroke; '#'
// starts a comment. Errors name file and line. Appends at least one sweep.
bool blade_read(BladePath *path, const char *file, PliantError *error);
// Appends a stroke through the plane at `point` with this normal (not zero): a square of side
// `size` [m] around the point.
void blade_plane(BladePath *path, const double point[3], const double normal[3], double size);
// Returns the sweep after position `at`, or -1: a sweep goes from position [i] to [i + 1].
int blade_next_sweep(const BladePath *path, int at);
int blade_sweeps(const BladePath *path);
// Makes the poses of a tool whose edge extends from its origin along its z axis, from position
// `first` until the blade is lifted, with no end faster than `speed` [m/s]. Returns the position
// after the last.
int blade_track(const BladePath *path, int first, double speed, Track *track);
void blade_destroy(BladePath *path);

#endif
