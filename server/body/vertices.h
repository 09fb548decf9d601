// SPDX-License-Identifier: MIT
// The vertices of a body of elements, in space or in the plane: their rows, their motion by kicks
// and drifts, and the body operations that involve vertices only. The body model adds the forces of
// its elements. Step thread, except what comes before vertices_create.
//
// Vertices have rows of displacements (body/rows.h) in the axes at rest, in both precisions;
// one spare row at the end receives the writes of batch padding. Forces are summed in an array of
// their own, four numbers per vertex, to which contacts, loads and elements add and which the
// advance clears.
#ifndef PLIANT_BODY_VERTICES_H
#define PLIANT_BODY_VERTICES_H

#include "base/check.h"
#include "body/body.h"
#include "body/drag.h"
#include "body/kernel.h"
#include "body/rows.h"

// Look-up of vertices by id, for files and scenes that refer to them. Load time only.
typedef struct VertexId {
    int id, vertex; // id first, for compare_ints
} VertexId;

// Returns [count] entries in ascending order of id; malloc'ed, the caller frees.
VertexId *vertex_ids_sort(const int *id, int count);
// Returns the vertex of an id; -1: none.
int vertex_ids_find(const VertexId *sorted, int count, int id);
// Returns the vertex that a scene fixes by its id; -1 with a status: the body has none of this id.
int vertex_ids_find_fixed(const VertexId *sorted, int count, int id, Status *status);

typedef struct Vertices {
    // --- constant after creation, except for bodies that are cut ---
    int count;          // without the spare one; grows in bodies that are cut
    int capacity;       // row of the spare one; equals count unless the body can be cut
    Rows rows;          // memory for capacity + 1 rows; its count is that of rows in use
    double *mass;       // [capacity] of every vertex, also of fixed ones [kg]
    void *inverse_mass; // Real [capacity + 1] [1/kg]; 0: fixed
    int *id;            // [capacity]
    const VertexKernels *kernels;
    double damping_time; // of the elements: damping over stiffness [s]; 0: they have none
    double drag;         // on the vertices, per mass [1/s] (drag.h); 0: none
    // Of a body most of whose rows do not move by themselves: those that do, as ascending runs
    // [first, end); what others hold stays in each of both arrays. NULL: all rows move.
    const int (*run)[2];
    int run_count;
    double position_limit; // [m] a displacement beyond it counts as a bad number
    // Bodies of many elements sum forces in two arrays, `force` and `more`, one for each half of
    // their batches, so that two threads can work on them; with one thread as well, so that the
    // result does not depend on the number of threads.
    bool halved; // set before vertices_create
    Team *team;  // shares the work; NULL: one thread

    // --- state: `current` is the index of the current rows ---
    void *row[2]; // Real [capacity + 1][ROW]
    int current;
    BodyParameters *parameters;

    // --- within a tick ---
    void *present; // rows to be evaluated next
    void *force;   // Real [capacity + 1][4]; zero between evaluations
    void *more;    // likewise; NULL unless halved
    bool bad;      // the last rows of the tick were out of bounds
    Drag *drags;   // NULL unless drag acts on a floating body

    // --- constant loads; NULL: disabled ---
    double (*load)[3]; // [loadable_count] of the first vertices, in the world frame [N]; state
    int *loaded;       // [loaded_count] those with a load, ascending; derived from `load`
    int loadable_count, loaded_count; // -1: must be listed again
} Vertices;

// --- load time ---
// False with `status`: no kernels for options->isa, or an initial state with another number of
// vertices.
bool vertices_can_create(const BodyOptions *options, bool has_kernels, int count, Status *status);
// Marks the vertices that the options fix, in `fixed` [count]; `place` returns the rest position of
// a vertex [m]. False with a status.
typedef Vec3 VertexPlace(const void *context, int vertex);
bool vertices_mark_fixed(const BodyOptions *options, const VertexId *by_id, int count,
                         VertexPlace *place, const void *context, bool *fixed, Status *status);
// Creates all other fields after count, capacity (0: count), kernels, damping_time, drag,
// rows.rest and .rest_origin, .rest_turn, .longest_edge, mass and id are set. `by_id` is the order
// of the initial state; `extent` [m]: size of the body at rest.
void vertices_create(Vertices *vertices, const BodyOptions *options, const VertexId *by_id,
                     const bool *fixed, int loadable_count, double extent, Arena *arena,
                     StateList *state);

// Updates a vertex after its mass has changed, or after it was created.
void vertices_put_mass(Vertices *vertices, int vertex, double mass, bool fixed);
// Takes a vertex without elements out of the motion: it has no mass, and its row is zero.
void vertices_retire(Vertices *vertices, int vertex);
// Clears a row, in both arrays: it is at rest, at no place.
void vertices_clear(Vertices *vertices, int vertex);
// Sets the number of vertices in use.
void vertices_set_count(Vertices *vertices, int count);

// --- a tick: drift (leapfrog), then begin, element forces and advance for each substep, then end
// or commit ---
// Adds the constant loads to the forces.
void vertices_begin(Vertices *vertices);
void vertices_advance(Vertices *vertices, const Evaluation *evaluation, double h, Vec3 gravity);
// Ends a tick: true if all numbers are good; the result is then the current state.
bool vertices_end(Vertices *vertices);
void vertices_restore(Vertices *vertices, RestoreMode mode);
bool vertices_check(const Vertices *vertices);

// In the world frame [N].
void vertices_add_force(Vertices *vertices, int vertex, Vec3 force);
// Adds an impulse [N s] to a vertex that has been advanced; its position follows by `drift` [s].
void vertices_kick(Vertices *vertices, int vertex, Vec3 impulse, double drift);
// After the state list was restored: lists the loads again.
void vertices_restored(Vertices *vertices);

// --- operations of body/body.h, of models that begin with their Vertices; nodes are vertices
// ---
void vertices_drift(void *model, double dt);
bool vertices_commit(void *model); // ends a tick, then follows
void vertices_follow(
    Vertices *vertices); // lets the frame of a body in space follow it, after a tick
void vertices_abandon(void *model);
bool vertices_is_fixed(const void *model, int vertex);
void vertices_read_nodes(const void *model, const int *vertex, int count, Vec3 *position,
                         Vec3 *velocity);
void vertices_add_forces(void *model, const int *vertex, int count, const Vec3 *force);
void vertices_add_load(void *model, int vertex, Vec3 force);
void vertices_clear_loads(void *model);
int vertices_read_state(const void *model, int *id, Vec3 *position, Vec3 *velocity);
bool vertices_set(void *model, BodyParameter parameter, double value);
bool vertices_get(const void *model, BodyParameter parameter, double *value);

// --- parts of other operations ---
static inline const void *vertices_row(const Vertices *vertices)
{
    return vertices->row[vertices->current];
}
void vertices_bound_motion(const void *model, double *displacement, double *speed);
// Fills in kinetic energy [J] and largest displacement [m]; other fields are unchanged.
void vertices_measure(const Vertices *vertices, BodyMeasure *measure);
// Prints kernel, elements by level [levels], damping, base frame.
void vertices_explain(const Vertices *vertices, int lanes, const int *element_at_level, int levels,
                      FILE *out);

#endif
