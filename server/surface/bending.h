// SPDX-License-Identifier: MIT
// Bending of a wall: an elastic hinge at every edge between two faces (Grinspun et al. 2003), of
// bodies of one level and of several. Derived in README.md, "Bending".
//
// The energy of a hinge is k (theta - theta_0)^2 / 2 with theta the angle between the normals of
// its faces, and k = D l^2 / (A_1 + A_2) of its rest shape: on equilateral triangles exactly that
// of a plate of stiffness D which bends into a cylinder. Forces are the exact gradient, except
// that the moment of a hinge fades where a face has less than 1 / sqrt(2) of its rest area: there
// the gradient grows without bound. Their sum and their moment vanish always.
#ifndef PLIANT_SURFACE_BENDING_H
#define PLIANT_SURFACE_BENDING_H

#include "geometry/edges.h"
#include "surface/kernel.h"
#include "surface/network.h"
#include "surface/surface.h"

struct SurfaceModel;

typedef struct Bending {
    double stiffness; // D [N m]
    HingeTable hinges;
    int *group; // [group_count] in use, ascending
    int group_count, hinge_count;
    int capacity; // most hinges
    void *force;  // Real [slots][ROW], half of it used: forces of hinges [N]
    // bodies of one level: what the kernel reads, Real [chunk][3][LANES] [N]
    void *external;
    // bodies with levels: the hinges of each window of slots, by the slot that owns them
    int *window_start;             // [windows + 1] first group of each window
    int *window_hinges;            // [windows] in use
    int *first, *count;            // [slots] in the list of the window
    int (*scratch)[4];             // [most hinges of a window] slots
    double lambda[LEVELS_MAX + 1]; // bound by the finest level in use [1/s2]
} Bending;

// Returns D of the material [N m]: as given, or E2D t^2 / (12 (1 - nu^2)) with the Poisson ratio
// 1/3 of the springs.
double bending_stiffness(const SurfaceMaterial *material);

// Return a bound of the bending part of M^-1 K [1/s2] near the rest shape, by blocks of its rows,
// twice over for faces that are smaller than at rest: of a mesh, with mass [node_count] [kg], and
// of a body all of whose faces are of one level. Fixed nodes do not count, unless all are.
double bending_bound(const TriMesh *mesh, const WingedMesh *winged, double stiffness,
                     const double *mass, const bool *fixed);
double bending_level_bound(const LevelRules *rules, int level, double stiffness, const bool *fixed);

// Adds hinges to a body of one level after its rows: model->bending.
void bending_create(struct SurfaceModel *model, const TriMesh *mesh, const WingedMesh *winged,
                    double stiffness, const char *name, Arena *arena);
// Allocates a table of that many groups and the list of those in use.
Bending *bending_allocate(const struct SurfaceModel *model, int groups, double stiffness,
                          const char *name, Arena *arena);
// Fills the groups from `first` on with hinges between these slots, as they are at rest; returns
// how many it takes. Neighbours in the list go to different groups: their sums then do not wait for
// one another.
int bending_put(const struct SurfaceModel *model, Bending *bending, int first, const int (*slot)[4],
                int count);
// Returns where the slots of hinge i of such a list are, LANES apart.
const int *bending_slots(const Bending *bending, int first, int count, int i);

// Adds the forces of the hinges at pass->present to bending->force, before the stiffness scale.
void bending_add(const struct SurfaceModel *model, const SpringPass *pass);
// The same for a body of one level: makes them the external forces of the pass, with those that it
// has.
void bending_evaluate(const struct SurfaceModel *model, SpringPass *pass);

// Returns the energy of the hinges [J], not scaled.
double bending_energy(const struct SurfaceModel *model, const void *rows);

#endif
