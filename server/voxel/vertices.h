// Private to the voxel room: the vertices of a body, in space or in the plane: their rows, what
// moves them, and what of a body's operations is theirs alone. Step thread, but for
// vertices_create.
//
// Vertices have rows of displacements (dynamics/rows.h) in the lattice's axes, in both precisions;
// one spare row at the end takes what the padding of batches writes. Forces gather in an array of
// their own, four numbers a vertex, which contacts, loads and elements add to and which the advance
// clears.
#ifndef PLIANT_VOXEL_VERTICES_H
#define PLIANT_VOXEL_VERTICES_H

#include "base/team.h"
#include "dynamics/body_parameters.h"
#include "dynamics/rows.h"
#include "voxel/kernel.h"
#include "voxel/vertex_ids.h"
#include "voxel/voxel.h"

typedef struct Vertices {
    // --- constant after creation, but for bodies that are cut ---
    int count;                   // without the spare one; of bodies that are cut it grows
    int capacity;                // row of the spare one; count, unless the body can be cut
    Rows rows;                   // room for capacity + 1; its count is that of those in use
    double *mass;                // [capacity] of every vertex, fixed ones too [kg]
    void *inverse_mass;          // Real [capacity + 1] [1/kg]; 0: fixed
    int *id;                     // [capacity]
    const VoxelKernels *kernels; // that advance them
    bool damped;                 // elements have damping
    double position_limit;       // [m] a displacement beyond it is a bad number
    // Bodies of many elements gather forces in two arrays, `force` and `more`, one for each half of
    // their batches, so that two threads can share them; with one thread too, so that the bits do
    // not depend on it.
    bool halved; // set before vertices_create
    Team *team;  // shares the work; NULL: one thread

    // --- state: `current` says which of the two is the present one ---
    void *row[2]; // Real [capacity + 1][ROW]
    int current;
    BodyParameters *parameters;

    // --- within a tick ---
    const void *present; // rows to be evaluated next
    void *force;         // Real [capacity + 1][4]; zero between evaluations
    void *more;          // likewise; NULL unless halved
    bool bad;            // the tick's last rows were out of bounds

    // --- constant loads; NULL: none can act ---
    double (*load)[3]; // [loadable_count] of the first vertices, in the world [N]; state
    int *loaded;       // [loaded_count] those that are not zero, ascending; follows from `load`
    int loadable_count, loaded_count; // -1: to be listed anew
} Vertices;

// After count, capacity (0: count), rows.place and .rest_origin, .rest_turn, .longest_edge, mass
// and id: everything else. `by_id` is the order of the initial state; `extent` [m] of the body at
// rest.
void vertices_create(Vertices *vertices, const VoxelOptions *options, const VertexId *by_id,
                     const bool *fixed, int loadable_count, double extent, Arena *arena,
                     StateList *state);

// After the mass of a vertex has changed, or it came.
void vertices_put_mass(Vertices *vertices, int vertex, double mass, bool fixed);
// So many vertices are in use from now on.
void vertices_set_count(Vertices *vertices, int count);

// --- a tick: drift (leapfrog), then begin, elements' forces and advance for each substep, end ---
void vertices_drift(Vertices *vertices, double dt);
// Adds the constant loads to the forces.
void vertices_begin(Vertices *vertices);
void vertices_advance(Vertices *vertices, const Stage *stage, double h, Vec3 gravity);
// Whether all numbers are good; then the result is the present state.
bool vertices_end(Vertices *vertices);
// The same of a body in space, whose frame then follows it.
bool vertices_commit(Vertices *vertices);
void vertices_abandon(Vertices *vertices); // BodyOps.abandon
void vertices_restore(Vertices *vertices, RestoreMode mode);
bool vertices_check(const Vertices *vertices);

// --- forces, by vertex, in the world [N] ---
void vertices_add_force(Vertices *vertices, int vertex, Vec3 force);
void vertices_add_forces(Vertices *vertices, const int *vertex, int count, const Vec3 *force);
void vertices_add_load(Vertices *vertices, int vertex, Vec3 force);
void vertices_clear_loads(Vertices *vertices);
// After the state list was restored.
void vertices_restored(Vertices *vertices);

// --- as the operations of dynamics/body.h ---
static inline const void *vertices_row(const Vertices *vertices)
{
    return vertices->row[vertices->current];
}
bool vertices_is_fixed(const Vertices *vertices, int vertex);
void vertices_read_nodes(const Vertices *vertices, const int *vertex, int count, Vec3 *position,
                         Vec3 *velocity);
int vertices_read_state(const Vertices *vertices, int *id, Vec3 *position, Vec3 *velocity);
bool vertices_set(Vertices *vertices, BodyParameter parameter, double value);
// Kinetic energy and largest displacement; the rest stays.
void vertices_measure(const Vertices *vertices, BodyMeasure *measure);
// Kernel, elements by level [VOXEL_LEVELS_MAX + 1], damping, base frame.
void vertices_explain(const Vertices *vertices, int lanes, const int *element_at_level, FILE *out);

#endif
