// SPDX-License-Identifier: MIT
// Private to the surface module: the arrays of one surface body. Constant after creation unless
// noted.
//
// Layout (server/PERFORMANCE.md, "Rows and order"): nodes have slots in breadth-first order, sorted
// by valence within windows, so that the neighbours of 16 consecutive slots (a chunk) are close in
// memory and equally many. Each node has a row of 8 numbers (x y z 0 vx vy vz 0) that neighbours
// read whole. Every spring is stored at both ends, so that a chunk's forces are sums in registers,
// without scatter. The springs of a chunk are slot-major: entry e holds the e-th neighbour of its
// 16 nodes; nodes with fewer springs are padded with springs of stiffness 0 to themselves.
//
// Real is float or double, depending on the body's precision. A row holds the position in double
// precision, the displacement from the node's rest position in single (body/rows.h).
#ifndef PLIANT_SURFACE_MODEL_H
#define PLIANT_SURFACE_MODEL_H

#include "base/team.h"
#include "body/rows.h"
#include "body/body.h"
#include "surface/kernel.h"
#include "surface/network.h"
#include "surface/surface.h"

// Nodes in the order in which clients get them, that of BodyMesh. Without levels it is the order of
// the mesh.
typedef struct SurfaceShown {
    const int *row; // [count] slot of a node's row; of a free slot any
    const int *id;  // [count] -1: free
    int count, free_count;
} SurfaceShown;

typedef struct SurfaceModel {
    int node_count, edge_count;
    // The coordinates of rows, one row per slot: basis.count is node_count rounded up to whole
    // chunks. frame = "body" needs the fit `rigid` as well.
    Rows basis;
    int *slot;      // [node_count] slot of a node
    int *node;      // [slots] node of a slot; -1 for padding
    int lane_count; // of the tables by chunk and lane: the number of slots, unless there is `lane`
    int *lane;      // [slots] bodies with levels: index in the tables; else NULL: the slot itself
    struct Detail *detail;      // bodies with levels, else NULL
    struct Bending *bending;    // of bodies with bending stiffness (bending.h), else NULL
    struct Cavity *cavity;      // of bodies with a cavity (cavity.h), else NULL
    struct Implicit *implicit;  // of bodies with integrator = "implicit", else NULL
    struct SurfaceError *error; // of bodies whose error is asked for (error.h), else NULL

    // --- springs; by entry and lane ---
    SpringTable springs;
    double damping_time; // beta: k_d = beta k [s], as loaded
    bool damped, prestressed;
    double prestress; // the fraction by which rest lengths are shorter
    SpringClass kind; // which kernels
    SpringStiffening stiffening;
    Relaxation *relaxation; // extensions of dashpots by entry (law.h); NULL: none

    // --- nodes; by slot ---
    NodeTable nodes;
    double *mass; // [node_count] of every node, also of fixed ones [kg]
    ShapeVariant shape;

    // --- rows, of which some ranges of slots are in use; `current` is the index of the current
    // state ---
    int (*run)[2]; // [run_count] first slot and end of each range
    int run_count;
    void *rows[2]; // Real [slots][ROW]
    int current;
    void *stage[2];      // Real rows between stages
    void *sum;           // RK4 only: Real [slots / LANES][6][LANES]
    const void *base;    // rows at the start of the substep
    const void *present; // rows to be evaluated next
    int next_stage;      // index of the free one of `stage`

    // --- external forces ---
    void *external;   // Real [chunk][3][LANES] constant loads in the base frame [N]; part of the
                      // state between ticks
    int64_t *loaded;  // 1 while there are constant loads; part of the state
    int *touched;     // [touched_count] lanes of `external` with contact forces
    void *untouched;  // Real [touched_count][3] their values without them
    bool *is_touched; // [slots]
    int touched_count, touched_capacity;

    // --- parameters that SET can change; part of the state ---
    BodyParameters *parameters;
    double *rigid_weight;    // [slots] of basis.rigid
    double (*world_load)[3]; // [slots] floating bodies: constant loads in the world frame [N]

    double position_limit; // [m] a coordinate beyond it counts as a bad number
    bool bad;              // the last pass wrote a number out of bounds

    SurfaceShown shown; // as body->mesh
    const int *piece;   // [node_count] connected part of the mesh; NULL: bodies with levels

    const SpringKernels *kernels;
    Team *team; // shares the passes; NULL: one thread
} SurfaceModel;

// Read and write elements of arrays of Real.
static inline double model_get(const SurfaceModel *model, const void *array, long index)
{
    return rows_get(&model->basis, array, index);
}

static inline void model_put(const SurfaceModel *model, void *array, long index, double value)
{
    rows_put(&model->basis, array, index, value);
}

static inline size_t model_real_size(const SurfaceModel *model)
{
    return rows_real_size(&model->basis);
}

// Index of component 0 of a slot in an array [chunk][3][LANES]; the next components follow at steps
// of LANES.
static inline long model_lane(int slot)
{
    return (long)(slot / LANES) * 3 * LANES + slot % LANES;
}

// Returns the rest position of a slot relative to rest_origin [m].
static inline Vec3 model_rest(const SurfaceModel *model, int slot)
{
    return (Vec3){model->basis.rest[slot][0], model->basis.rest[slot][1],
                  model->basis.rest[slot][2]};
}

static inline int model_lane_of(const SurfaceModel *model, int slot)
{
    return model->lane == NULL ? slot : model->lane[slot];
}

// --- loads.c: external forces ---

// Rotates constant loads with the base frame after it has moved. Starts from the loads in the world
// frame, so that rounding does not accumulate.
void model_turn_loads(SurfaceModel *model);

// The operations on forces.
void surface_add_forces(void *self, const int *node, int count, const Vec3 *force);
void surface_kick_nodes(void *self, const int *node, int count, const Vec3 *impulse, double h,
                        double drift);
void surface_reserve_forces(void *self, const char *name, int count, Arena *arena);
void surface_add_load(void *self, int node, Vec3 force);
void surface_clear_loads(void *self);

// --- create_mesh.c ---

// Load time: builds the tables behind body->mesh, once body->surface has its faces.
void model_create_mesh(SurfaceModel *model, Body *body, const TriMesh *mesh,
                       const SurfaceOptions *options, Arena *arena);
// Labels the piece of each node: connected parts of the mesh, numbered by their lowest node.
void model_label_pieces(const TriMesh *mesh, int *piece);
// Creates body->surface, the faces of a body of one level, with the areas of its network.
void model_create_surface(Body *body, const TriMesh *mesh, const WingedMesh *winged,
                          const SpringNetwork *network, const char *name, Arena *arena);
// Fills slot[node] with a permutation of 0 .. node_count - 1 that puts neighbours close in memory
// and nodes of equal valence into one chunk: breadth first, then by valence within windows
// (server/PERFORMANCE.md, "Rows and order"). A pure function of the mesh.
void order_nodes(const WingedMesh *winged, int *slot);

// --- surface.c ---

// Returns the operations that the options require.
const BodyOps *surface_ops(const SurfaceOptions *options);

// --- patch.c: BodyOps.gather_patch, also for bodies with levels ---
bool model_gather_patch(const void *self, Patch *patch, int budget);

// --- model.c ---

// Creates rest positions and rows of the nodes of a mesh, which come first in model->slot, and
// memory for all slots.
void model_create_rest(SurfaceModel *model, const TriMesh *mesh, const char *name, Arena *arena,
                       StateList *state);
void model_create_rows(SurfaceModel *model, const TriMesh *mesh, const bool *fixed,
                       const SurfaceOptions *options, Arena *arena, StateList *state);
// Sets model->shape and model->basis.floating, and allocates the node constants of the kernel.
void model_create_node_table(SurfaceModel *model, const SurfaceOptions *options, bool all_free,
                             Arena *arena);
void *model_allocate_reals(const SurfaceModel *model, size_t count, const char *name,
                           const char *label, Arena *arena);
// Allocates this many entries of the spring table, in the model's precision.
void model_allocate_springs(SurfaceModel *model, size_t entries, const char *name, Arena *arena);
// Fills entry `at` of the spring table: a spring of the node in `slot` to the one in `other`; rest
// length [m], stiffness [N/m].
void model_put_spring(SurfaceModel *model, long at, int slot, int other, double rest_length,
                      double stiffness);
// Moves the rows by the time `dt` [s] at their velocities: how schemes of kicks, and implicit
// steps, begin.
void model_drift(SurfaceModel *model, double dt);
// Runs the kernel over all chunks of the pass, on all threads that share the step.
void model_run_kernel(SurfaceModel *model, SpringKernel *evaluate, const SpringPass *pass);
// Removes the contact forces of one evaluation and restores the constant loads bit by bit.
void model_clear_touched(SurfaceModel *model);

#endif
