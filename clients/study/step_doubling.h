// RK4 with adaptive steps: each tick is computed with n substeps and again with 2 n from the same
// state. The difference is about 15 times the error of the finer one, which is kept (Press et al.,
// Numerical Recipes in C, 2nd ed., 16.2; used by Choi et al. 2005, section 5). For comparison only:
// the daemon, whose ticks must have a bounded cost, does not have it.
#ifndef PLIANT_STUDY_STEP_DOUBLING_H
#define PLIANT_STUDY_STEP_DOUBLING_H

#include "scene/build.h"

typedef struct StepDoubling {
    World *world;
    int body;
    double tolerance;               // of the difference, in metres
    int substeps;                   // of the coarse pass in the next tick
    unsigned char *before;          // the state before the tick
    Vec3 *coarse, *fine, *velocity; // rows of read_state
    int rows;
    int most_substeps;
    long passes, refused; // refused: ticks repeated with more substeps
    double worst;         // largest difference of an accepted tick [m]
    int64_t resets;       // of accepted passes
} StepDoubling;

// `tolerance` [m]. Returns false if memory runs out.
bool step_doubling_create(StepDoubling *doubling, World *world, int body, double tolerance);
void step_doubling_destroy(StepDoubling *doubling);
// Computes one tick; returns the CPU time of its passes without copying [ns].
int64_t step_doubling_step(StepDoubling *doubling);

#endif
