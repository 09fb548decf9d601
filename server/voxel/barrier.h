// SPDX-License-Identifier: MIT
// What keeps elements from collapsing (README.md, "The barrier"): an element whose volume has
// fallen below BARRIER_VOLUME of that at rest, a *crushed* one, is pulled to the nearest
// deformation that has this volume.
#ifndef PLIANT_VOXEL_BARRIER_H
#define PLIANT_VOXEL_BARRIER_H

// det F below which an element is crushed.
#define BARRIER_VOLUME 0.3
// Stiffness over the largest of the element's own, 2 mu + 3 lambda. 1/0.9^2 - 1 = 0.23 is what the
// safety factor of the time step leaves (body/integrator.h): below it the barrier costs no
// step.
#define BARRIER_SHARE 0.1

// Returns the stiffness of the barrier [Pa].
static inline double barrier_stiffness(double mu, double lambda)
{
    return BARRIER_SHARE * (2.0 * mu + 3.0 * lambda);
}

// Computes F - N, N being the nearest matrix to F with det N >= BARRIER_VOLUME, from the best
// rotation of F (rotation.h). Returns |F - N|^2 / 2, 0 if F is not crushed.
double barrier_gap(const double f[3][3], const double rotation[3][3], double gap[3][3]);

#endif
