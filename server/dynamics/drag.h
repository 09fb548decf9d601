// Drag on a body that nothing fixes: f_i = -drag m_i (v_i - V - Omega x (x_i - c)), with the rigid
// motion V, Omega that has the momentum and angular momentum of all vertices. So the forces have
// neither resultant nor moment: the body flies and turns as without, only its deformation is slowed
// down. Bodies that are fixed need none of this: their velocities lose a share in the kick
// (kernel.h, AdvancePass.loss).
#ifndef PLIANT_DYNAMICS_DRAG_H
#define PLIANT_DYNAMICS_DRAG_H

#include "base/memory.h"
#include "base/team.h"
#include "dynamics/rows.h"

// Sums over some vertices, about the origin of the rows' coordinates.
typedef struct RigidSums {
    double mass;                 // [kg]
    double first[3], spread[6];  // sum m x, sum m x x^T as xx yy zz yz zx xy
    double momentum[3], spin[3]; // sum m v, sum m x X v
} RigidSums;

typedef struct Drag {
    RigidSums *part; // [part_count] shares of the vertices
    int part_count;
    double velocity[3], turn[3]; // V - Omega x c, Omega
} Drag;

// For bodies of up to `capacity` vertices.
Drag *drag_create(const char *name, int capacity, Arena *arena);
// Adds the forces of `drag` [1/s] to `force` (Real [vertex][4]). `row`: the vertices' present rows
// [count]. The same bits with and without a team (NULL).
void drag_add_forces(Drag *by, double drag, const Rows *rows, const void *row, const double *mass,
                     int count, void *force, Team *team);

#endif
