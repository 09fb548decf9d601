// SPDX-License-Identifier: MIT
// What a closed wall encloses: a constant pressure, a gas or a fluid.
//
// The pressure p acts along the gradient of the enclosed volume V, which is exact for a mesh of
// triangles, with hanging nodes as well (they lie in the middle of an edge and pass their share to
// its ends):
//
//   dV/dx_i = 1/6 sum over the faces (i, j, k) of (x_j - x_i) x (x_k - x_i)
//   V       = 1/3 sum over the nodes of x_i . dV/dx_i
//
// The kernel sums both together with the springs, so an evaluation knows the volume only after it
// has used the pressure: it takes the volume of the evaluation before, moved on by its gradient and
// by what that last missed. The error is of third order in the step; with rk4, of second.
#ifndef PLIANT_SURFACE_CAVITY_H
#define PLIANT_SURFACE_CAVITY_H

#include "surface/model.h"

// Most faces around a node of a body that changes.
enum { CAVITY_RING = 64 };

// The volume from evaluation to evaluation; of gas and fluid only, but for the time.
typedef struct CavityFlow {
    double volume; // of the present rows [m3]
    double more;   // by which it last grew in a whole step beyond its gradient [m3]
    double rate;   // at the end of a tick: of its change by drifting on [m3/s]
    double due;    // and what of `more` then comes to it [m3]
    double time;   // since the end of the last tick [s]
    double tick;   // that one's duration [s]
} CavityFlow;

// Part of the state.
typedef struct CavityState {
    // What is inside: p itself while a supply keeps it [Pa]; of a gas that is sealed (ambient + p)
    // V [J], of a fluid its volume without pressure [m3]. `wanted`: as SET asked for it.
    double content, wanted;
    int64_t supplied; // 1: a supply keeps the pressure
    CavityFlow flow;
    double opening;  // area of the holes in a cut wall [m2]
    double cap;      // volume that cones over them add [m3]
    double cap_rate; // its change while the borders move [m3/s]
    double held;   // pressure at the end of the last tick, which an open wall does not exceed [Pa]
    int64_t known; // 0: the volume must be measured first
} CavityState;

// One border of a cut wall: the sums over its edges.
typedef struct CavityBorder {
    Vec3 area; // vector area [m2]
    Vec3 sum;  // of its nodes [m]
    int count;
} CavityBorder;

typedef struct Cavity {
    SurfaceCavity options;
    double bulk_modulus;   // of a fluid [Pa]
    double rest_volume;    // [m3]
    double lambda;         // part of the bound of M^-1 K [1/s2]
    double pressure_limit; // for which that has room [Pa]
    CavityState *state;
    CavityFlow committed; // at the end of the last tick
    bool measured;        // since then: what is known of the volume is of a step that may be undone
    CavityPass pass;
    void *place; // of `pass`
    // Bodies that can be cut: edges without a second face, and for each node the lowest one of its
    // border. NULL: none can come.
    int (*edge)[2]; // [edge_count] nodes, in the order of the edge's face
    int edge_count;
    int *root;            // [node_count]
    CavityBorder *border; // [node_count] by root
    int node_count;
} Cavity;

// --- load time ---
// False with `status` if the body cannot have the cavity that its options ask for.
bool cavity_fits(const SurfaceOptions *options, const TriMesh *mesh, const WingedMesh *winged,
                 Status *status);
// Fills in the constants of a cavity and the bound that it adds to that of the network (README.md,
// "What a wall encloses").
void cavity_start(Cavity *cavity, const SurfaceOptions *options, const TriMesh *mesh,
                  const SpringNetwork *network);
// Creates a cavity and its state, before the tables of the springs.
Cavity *cavity_create(const Cavity *start, const char *name, Arena *arena, StateList *state);
// Creates what has the size of those tables, once there are rest positions and lanes; those of a
// body that changes are filled as its nodes are packed.
void cavity_create_tables(SurfaceModel *model, const char *name, Arena *arena);

// --- tables ---
// Lists the neighbours of a node in the order of the faces around it: side[count] are the other
// corners of each face, counter-clockwise seen from outside. Writes at most 3 count to `ring` and
// returns how many; `own` stands where a face is missing, so that a ring without it is closed.
int cavity_ring(int own, int count, const int (*side)[2], int *ring);
// Sets the place of a node in the tables.
void cavity_put_place(SurfaceModel *model, int lane, int slot);
// Returns what fills up the table of a node with such a ring.
static inline int cavity_padding(int own, int count, const int *ring)
{
    return count > 0 && ring[count - 1] != own ? ring[0] : own;
}

// --- step thread ---
// Follows the rows as they drift before the first evaluation, before each one, and after it.
void cavity_drift(Cavity *cavity, double dt);
void cavity_begin(SurfaceModel *model, const Evaluation *evaluation, double h);
void cavity_end(SurfaceModel *model, const SpringPass *pass);
// True if the volume of the present rows can be: a tick that ends beyond is a bad one.
bool cavity_can_flow(const Cavity *cavity);
// Ends a tick; what is inside leaks.
void cavity_commit(SurfaceModel *model);
// Goes back to the end of the last tick.
void cavity_abandon(Cavity *cavity);
// The rows or the faces are others now; the body is back in its rest shape, with what was in it
// there; the whole state is another.
void cavity_forget(Cavity *cavity);
void cavity_refill(Cavity *cavity);
void cavity_restored(Cavity *cavity);
// Lists the borders of a cut wall.
void cavity_find_borders(SurfaceModel *model);
// True if the state may come from a run.
bool cavity_check(const Cavity *cavity);

// Returns the pressure above that outside [Pa].
double cavity_pressure(const Cavity *cavity);
// Measures the volume at the end of a tick [m3], holes closed.
double cavity_volume(const SurfaceModel *model);
// Returns the energy of what is inside at the end of a tick, up to a constant [J].
double cavity_energy(const SurfaceModel *model);
// Connects a supply of this pressure [Pa], or seals the cavity and sets the volume that its gas or
// fluid has without pressure [m3], within the limits that are published; most of it comes within a
// tenth of a second. BODY_SUPPLY 0: seals it as it is.
void cavity_set(SurfaceModel *model, BodyParameter parameter, double value);
// Reads the pressure [Pa] that is supplied, or that it has where it is sealed, or the volume of its
// gas or fluid without pressure [m3]; returns false for other parameters.
bool cavity_get(const SurfaceModel *model, BodyParameter parameter, double *value);
// As BodyOps.range.
bool cavity_range(const Cavity *cavity, BodyParameter parameter, double *low, double *high);
void cavity_explain(const SurfaceModel *model, FILE *out);

#endif
