// SPDX-License-Identifier: MIT
// Scenes of voxel bodies at rest under tools and loads, by which the estimate of the error of the
// elements (server/voxel/error.h) is held against the truth: the same body with all cells divided.
#ifndef PLIANT_TESTS_VOXEL_ERROR_H
#define PLIANT_TESTS_VOXEL_ERROR_H

#include "voxel_world.h"

typedef enum ErrorShape { SHAPE_BLOCK, SHAPE_BALL, SHAPE_ORGAN } ErrorShape;
typedef enum ErrorHold { HOLD_BOTTOM, HOLD_LEFT, HOLD_LOW_CAP, HOLD_BOTH_ENDS } ErrorHold;

typedef struct ErrorTool {
    double radius, length; // of a capsule along x; 0: none
    bool grasps;
    double from[3], to[3],
        on[3]; // [m] it goes from the first to the second place, then to the third
} ErrorTool;

typedef struct ErrorScene {
    const char *name;
    ErrorShape shape;
    int count[3];
    double size; // of a cell [m]
    int levels;
    double poisson;
    ErrorHold hold;
    double gravity; // along -z [m/s2]
    ErrorTool tool[2];
    double friction;
    double load[7]; // center, radius [m], force [N]
    double cut[4];  // x of a blade along y that comes from above to z; from y to y. 0: none
    double stiffening;
    // Of the study (tests/accuracy/errors.md): what the estimate should be.
    double truth;       // relative error of the outer displacements
    double force_truth; // of the first tool's force, signed: what is missing
    bool slow;          // its body needs more than a second to come to rest
} ErrorScene;

extern const ErrorScene ERROR_SCENES[];
extern const int ERROR_SCENE_COUNT;
const ErrorScene *error_scene(const char *name); // NULL: none

typedef struct ErrorRun {
    VoxelWorld world;
    int count;
    int nodes;   // outer
    int *id;     // [nodes] ascending with
    Vec3 *moved; // [nodes] displacement
    double force[2];
    int points[3];
    double kinetic;
} ErrorRun;

// Runs a scene until it rests, its cells divided so many times.
void error_run(ErrorRun *run, const ErrorScene *scene, int divided);
void error_run_end(ErrorRun *run);
// Root mean square of what differs at the points of the coarsest; `ratio` >= 1: how many times
// finer b is.
double error_run_differ(const ErrorRun *grid, int grid_divided, const ErrorRun *a, int a_divided,
                        const ErrorRun *b, int b_divided);
// Estimates its error, with so much budget a call.
BodyError error_run_estimate(const ErrorRun *run, const ErrorScene *scene, int budget);
double error_run_rms(const ErrorRun *run);

#endif
