// Bending of a wall: an elastic hinge at every edge between two faces (Grinspun et al. 2003).
// Bodies that stay at one level, explicit steps. Derived in README.md, "Bending".
//
// The energy of a hinge is k (theta - theta_0)^2 / 2 with theta the angle between the normals of
// its faces, and k = D l^2 / (A_1 + A_2) of its rest shape: on equilateral triangles exactly that
// of a plate of stiffness D which bends into a cylinder. Forces are the exact gradient, except
// that the moment of a hinge fades where a face has less than 1 / sqrt(2) of its rest area: there
// the gradient grows without bound. Their sum and their moment vanish always.
#ifndef PLIANT_SURFACE_BENDING_H
#define PLIANT_SURFACE_BENDING_H

#include "geometry/edges.h"
#include "surface/surface.h"

struct SurfaceModel;
struct SpringPass;

// Returns D of the material [N m]: as given, or E2D t^2 / (12 (1 - nu^2)) with the Poisson ratio
// 1/3 of the springs.
double bending_stiffness(const SurfaceMaterial *material);

// Returns a bound of the bending part of M^-1 K [1/s2] near the rest shape, by blocks of its rows,
// twice over for faces that are smaller than at rest. mass [node_count] [kg]; fixed nodes do not
// count, unless all are.
double bending_bound(const TriMesh *mesh, const WingedMesh *winged, double stiffness,
                     const double *mass, const bool *fixed);

// Adds hinges to a body of one level after its rows: model->bending.
void bending_create(struct SurfaceModel *model, const TriMesh *mesh, const WingedMesh *winged,
                    double stiffness, const char *name, Arena *arena);

// Evaluates the hinges at pass->present and lets the pass add their forces to the external ones,
// which count only if `external`.
void bending_evaluate(const struct SurfaceModel *model, struct SpringPass *pass, bool external);

// Returns the energy of the hinges [J], not scaled.
double bending_energy(const struct SurfaceModel *model, const void *rows);
int bending_hinges(const struct SurfaceModel *model);

#endif
