// SPDX-License-Identifier: MIT
// Records the motion of a body from its frames: its largest displacement over time, and its
// triangles in one frame for gnuplot. One thread.
#ifndef PLIANT_CLIENTS_CURVE_H
#define PLIANT_CLIENTS_CURVE_H

#include "program.h"

typedef enum CurveFrame { CURVE_LAST, CURVE_PEAK, CURVE_FRAMES } CurveFrame;

// One frame with all data to draw it.
typedef struct CurveShape {
    const PliantBody *body; // kept; NULL: none
    float *first;           // [3 node_count]
    double displacement;    // largest of all nodes [m]
} CurveShape;

typedef struct Curve {
    const PliantBody *before;       // the last frame, kept; NULL: none yet
    float *first;                   // [3 node_count] reference positions of the displacements
    CurveShape shape[CURVE_FRAMES]; // the last frame, and that of the largest displacement
    int64_t frames;                 // since the start
    FILE *out;                      // or NULL; not owned
} Curve;

// Takes a frame of the body; the curve starts zeroed. Adds a row to `out`: simulated time [s],
// largest displacement [m], and the slot of the node that has it. Displacements are relative to the
// first frame. Across a change of topology nodes are identified by their ids. A node created
// between two others starts with the mean of their displacements, an unrelated one with none.
void curve_take(Curve *curve, const PliantBody *body);
// First bytes of a file of a shape; only such files are replaced.
#define CURVE_SHAPE_MARK "# x_m y_m z_m displacement_m"
// Writes the triangles of a frame for gnuplot's pm3d: per triangle two lines of two corners "x y z
// displacement" [m]. Returns false if there is no frame.
bool curve_write_shape(const Curve *curve, CurveFrame which, const char *path, PliantError *error);
void curve_destroy(Curve *curve);

#endif
