// Drag on a body that nothing fixes: f_i = -drag m_i (v_i - V - Omega x (x_i - c)), with the rigid
// motion V, Omega that has the momentum and angular momentum of all vertices. So the forces have
// neither resultant nor moment: the body flies and turns as without, only its deformation is slowed
// down. Bodies that are fixed need none of this: their velocities lose a share in the kick
// (kernel.h, AdvancePass.loss).
#ifndef PLIANT_DYNAMICS_DRAG_H
#define PLIANT_DYNAMICS_DRAG_H

#include "base/memory.h"
#include "base/team.h"
#include "dynamics/kernel.h"

typedef struct Drag {
    RigidSums *part; // [part_count] shares of the vertices
    int part_count;
} Drag;

// For bodies of up to `capacity` vertices.
Drag *drag_create(const char *name, int capacity, Arena *arena);
// Adds the forces to pass->force; sets the rigid motion of the pass. The same bits with and without
// a team (NULL).
void drag_add_forces(Drag *by, const VertexKernels *kernels, SlowPass *pass, int count, Team *team);

#endif
