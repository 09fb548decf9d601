// RK4 that chooses its own step: each tick is done with n substeps and again with 2 n from the same
// state; their difference is about 15 times the error of the finer one, which is kept (Press et
// al., Numerical Recipes in C, 2nd ed., 16.2; Choi et al. 2005, section 5, use it). Here only, to
// be compared: the daemon has no such thing, its ticks cost what they cost.
#ifndef PLIANT_STUDY_STEP_DOUBLING_H
#define PLIANT_STUDY_STEP_DOUBLING_H

#include "files/build.h"

typedef struct StepDoubling {
    World *world;
    int body;
    double tolerance;               // of the difference, in metres
    int substeps;                   // of the coarse pass in the next tick
    unsigned char *before;          // the state before the tick
    Vec3 *coarse, *fine, *velocity; // rows of read_state
    int rows;
    int most_substeps;
    long passes, refused; // refused: ticks done again with more substeps
    double worst;         // largest difference of an accepted tick [m]
    int64_t resets;       // of accepted passes
} StepDoubling;

// `tolerance` [m]. False: out of memory.
bool step_doubling_create(StepDoubling *doubling, World *world, int body, double tolerance);
void step_doubling_destroy(StepDoubling *doubling);
// One tick; returns the CPU time of its passes without the copying [ns].
int64_t step_doubling_step(StepDoubling *doubling);

#endif
