// SPDX-License-Identifier: MIT
// What the sweep over the refinement criteria keeps (detail_sweep.c). Private to the surface
// module.
#ifndef PLIANT_SURFACE_DETAIL_SWEEP_H
#define PLIANT_SURFACE_DETAIL_SWEEP_H

#include "base/memory.h"
#include "base/vec.h"
#include "surface/detail/detail_set.h"

#include <stdint.h>

enum { SKIP_MOST = 3 }; // sweeps that a quiet face of level 0 is not looked at

// Progress of the sweep over the criteria; plain data, part of the state.
typedef struct Sweep {
    int64_t root;                        // next face of level 0
    int64_t count;                       // completed sweeps
    int64_t urgent;                      // roots to sweep at once, after a new load
    double credit;                       // number of roots that may be swept by now
    double thresholds[3];                // force, speed, curvature
    double scale;                        // multiplies all three
    int64_t level;                       // finest level that may be used
    int64_t topology;                    // number of changes since the start
    int64_t refined, coarsened, refused; // faces, since the start
} Sweep;

// A force of a tool on a node in the last evaluation of a tick; part of the state.
typedef struct Felt {
    int64_t node;
    Vec3 force; // [N]
} Felt;

// What a sweep has computed for a node.
typedef struct NodeLook {
    int64_t pass;    // number of the pass; 0: never
    Vec3 position;   // [m]
    Vec3 moved;      // displacement from the rest position [m]
    double slip2;    // square of the speed relative to the body's rigid motion [m2/s2]
    double traction; // external force over its area [N/m2]
} NodeLook;

// Of a body that is driven by its error; plain data, then part of the state.
typedef struct SweepDrive {
    double error;    // BODY_ADAPT_ERROR; 0: it is not
    double fineness; // BODY_ADAPT_FINENESS: divides all three thresholds
} SweepDrive;

typedef struct DetailAdapt {
    // --- constant ---
    double modulus;     // E2D [N/m]
    double edge_length; // mean of level 0 [m]
    double wave_speed;  // sqrt(E2D / rho_A) [m/s]

    // --- part of the state ---
    int64_t *calm_since; // [faces above the finest level] tick since which a face's children are
                         // calm, plus 1; 0: not calm
    Sweep *sweep;
    SweepDrive *drive;
    unsigned char *skip; // [faces of level 0] sweeps in which it need not be looked at
    Felt *felt;          // [felt_capacity]
    int64_t *felt_count;
    int felt_capacity;

    // --- of the change in progress ---
    Leaf *calm; // [calm_capacity] refined faces whose four children have been calm for long
    int calm_count, calm_capacity;
    Leaf *want; // [want_capacity] leaves to be divided
    int want_count, want_capacity;
    bool again; // of TopologyChange
    int again_count;

    // --- scratch ---
    NodeLook *look; // [node_count]
    int64_t look_passes;
    double *felt_force; // [node_count] zero except during a sweep [N]
} DetailAdapt;

// Load time: allocates memory for the forces of one evaluation, and adds it to the state.
void detail_reserve_felt(DetailAdapt *adapt, const char *name, int count, Arena *arena,
                         StateList *state);
// Records a force of a tool on a node [N].
void detail_feel(DetailAdapt *adapt, int node, Vec3 force);

// Angles between the faces at an edge, at rest: for the criterion of curvature.
typedef struct DetailFolds {
    const LeafSet *set;
    double least_height[LEVELS_MAX + 1]; // smallest height of the faces of a level at rest [m]
    float (*rest_fold)[2]; // [edges of all levels] cosine and sine of the angle between the faces
} DetailFolds;

// Load time: measures all edges. Keeps `set` by reference.
void detail_folds_create(DetailFolds *folds, const LeafSet *set, const char *name, Arena *arena);
// Recomputes one edge, after rest positions have changed.
void detail_measure_fold(DetailFolds *folds, int level, int edge);

#endif
