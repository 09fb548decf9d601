// Takes samples of a world into a trace.
#ifndef PLIANT_STUDY_SAMPLER_H
#define PLIANT_STUDY_SAMPLER_H

#include "study/context.h"

#include "files/build.h"

typedef struct Sampler {
    const StudyContext *context;
    const Body *body;
    const Sim *sim;
    bool halved;           // the lattice has half the cells
    int topology;          // for which `row` holds; -1: none
    int row[STUDY_POINTS]; // of read_state; -1: not there (any more)
    int *id;
    Vec3 *position, *velocity;
    float *mesh;  // positions in the order of BodyMesh
    Vec3 impulse; // on tools since the last sample [N s]
    double since; // [s]
    double moved; // largest displacement of any point so far [m]
    int nodes_least, nodes_most, links_most;
} Sampler;

// False: out of memory.
bool sampler_create(Sampler *sampler, const StudyContext *context, const World *world, bool halved);
void sampler_destroy(Sampler *sampler);
// After every tick: what the tools felt.
void sampler_feel(Sampler *sampler);
// Takes a sample; false when a number is not finite. `trace` may be NULL, then it only looks at
// sizes and at how far points have moved.
bool sampler_take(Sampler *sampler, StudyTrace *trace);

// The volume that the faces of a mesh enclose [m3]; NAN: they do not.
double sampler_volume(const BodyMesh *mesh, const float *position, double extent);

#endif
