// SPDX-License-Identifier: MIT
// A published mesh whose nodes lie beside the vertices that carry them: a smooth surface over
// elements. A node with the offset o at rest is published at y = x + F o, with F the mean
// deformation of the elements of its own vertex. All of it is linear in the positions of some
// vertices, the rows; the step thread copies those (BodyOps.snapshot_rows), and the thread that
// writes messages or files computes the nodes. Plain data and pure functions.
#ifndef PLIANT_BODY_FIT_H
#define PLIANT_BODY_FIT_H

#include "base/vec.h"

#include <stdint.h>

enum { FIT_CORNERS = 8 };

// What the place of one node follows from: y = x + sum over axes of o_axis G_axis + shift, with G
// the mean gradient of the cells that have its vertex as a corner.
typedef struct FitNode {
    int cell_count;
    int corner[FIT_CORNERS][FIT_CORNERS]; // vertices, x first
    double offset[3];                     // [edges]
    double rest[3];                       // its place at rest, in some axes of the body [m]
    Vec3 shift;                           // of a fade [m]
} FitNode;

// A vertex that carries a node: the node is at the weighted sum of the positions of its carriers,
// and the shift of its fade. The weights of a node add up to 1, some are negative.
typedef struct FitWeight {
    int vertex;
    double weight;
} FitWeight;

enum {
    FIT_WEIGHTS = 1 + FIT_CORNERS * (FIT_CORNERS - 1), // of a node, at most
    FIT_MEAN_WEIGHTS = 27, // on average at most: corners of the eight cells around a point
};

// A node that a change of topology would let jump: it goes from where it was to where it belongs.
typedef struct FitFade {
    int node;
    int step;      // tick in which it began
    float from[3]; // its place then, from its vertex [m]
} FitFade;

typedef struct BodyFit {
    int row_count, cell_count, fade_count;
    int row_capacity, cell_capacity, fade_capacity;
    double reach;                   // no node is farther from its vertex at rest [m]
    int fade_steps;                 // ticks that a fade takes
    int fade_last;                  // tick in which the newest fade began; 0: none did
    const int *row;                 // [node] row of its vertex
    const float (*offset)[3];       // [row] o in edges of a cell, along its axes at rest
    const int (*cell)[FIT_CORNERS]; // rows of its corners, x first
    const FitFade *fade;            // [fade_count]
} BodyFit;

// Finds the weights of a node, without those that are zero, that of its own vertex first. `mark`:
// by vertex, -1; it is left so. Returns their number.
int fit_weights(const FitNode *node, int vertex, int *mark, FitWeight weight[FIT_WEIGHTS]);

// Returns how much is left of a fade: from 1 to 0, smooth at both ends.
static inline float fit_left(int began, int steps, int64_t step)
{
    const int64_t age = step - began;
    if (age <= 0 || age >= steps)
        return age <= 0 ? 1.0F : 0.0F;
    const float t = (float)age / (float)steps;
    return (1.0F - t) * (1.0F - t) * (1.0F + 2.0F * t);
}

// Numbers of scratch memory per row that fit_nodes needs.
enum { FIT_SCRATCH = 4 };

// Computes `node_count` positions or velocities from those of the rows, [row_count][3].
void fit_nodes(const BodyFit *fit, int node_count, const float *row, double *scratch, float *out);
// Moves positions of nodes that fade, `row` as above; not for velocities. `step`: ticks completed.
void fit_fade(const BodyFit *fit, int64_t step, const float *row, float *out);

#endif
