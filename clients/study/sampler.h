// SPDX-License-Identifier: MIT
// Samples a world into a trace, and the errors of traces.
#ifndef PLIANT_STUDY_SAMPLER_H
#define PLIANT_STUDY_SAMPLER_H

#include "scene/build.h"
#include "study/context.h"
#include "study/study.h"

// --- samples -------------------------------------------------------------------------------------

typedef struct Sampler {
    const StudyContext *context;
    const Body *body;
    const Sim *sim;
    bool halved;           // the lattice has half the cell size
    int topology;          // topology for which `row` is valid; -1: none
    int row[STUDY_POINTS]; // of read_state; -1: the point is gone
    int *id;
    Vec3 *position, *velocity;
    float *mesh;  // positions in the order of BodyMesh
    Vec3 impulse; // on tools since the last sample [N s]
    double since; // [s]
    double moved; // largest displacement of any point so far [m]
    int nodes_least, nodes_most, links_most;
    double error2[2], size2[2]; // of displacements [m2], and of forces on tools [N2], summed
} Sampler;

// Returns false if memory runs out.
bool sampler_create(Sampler *sampler, const StudyContext *context, const World *world, bool halved);
void sampler_destroy(Sampler *sampler);
// Adds the forces on tools; call after every tick.
void sampler_feel(Sampler *sampler);
// Takes a sample; returns false if a number is not finite. With `trace` NULL it only measures sizes
// and displacements.
bool sampler_take(Sampler *sampler, StudyTrace *trace);

// Adds what the body tells of its own error now.
void sampler_estimate(Sampler *sampler);
// Returns the sums of that: relative errors of displacements and of forces on tools; NAN: none.
void sampler_estimated(const Sampler *sampler, double *displacement, double *force);

// Returns the volume that the faces of a mesh enclose [m3]; NAN: the mesh is not closed.
double sampler_volume(const BodyMesh *mesh, const float *position, double extent);

// --- errors of a run relative to its reference ---------------------------------------------------

// Compares two traces sampled at the same times, over the length of the shorter. NAN if there is
// nothing to compare.
StudyErrors study_errors(const StudyTrace *trace, const StudyTrace *reference);
// Returns all NAN.
StudyErrors study_no_errors(void);

// Estimates the error of the finest of three solutions, each twice as fine as the one before, from
// the differences between neighbours (Richardson 1911; Roache 1994, eq 3): order p =
// log2(difference[0] / difference[1]), error = difference[1] / (2^min(p, expected) - 1). Sets order
// and own_error. If the differences do not decrease (order NAN) or hardly do (order below 1/2),
// own_error is the larger one. Sets `known` if both differences are finite.
void study_richardson(StudyReference *reference, double expected);

#endif
