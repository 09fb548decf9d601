// The rotation that fits a deformation best: argmax of tr(R^T A) over rotations, in every state.
#ifndef PLIANT_VOXEL_ROTATION_H
#define PLIANT_VOXEL_ROTATION_H

#include "base/vec.h"

#include <stdbool.h>

// One element, double precision: what the kernels' fast path leaves over, and the reference. A by
// rows, of any magnitude. `last` (any quaternion) is the rotation of the step before and decides
// where A alone does not (a line, a point, a mirror image): of all best rotations the one nearest
// to it. It is replaced by the result. FOAM (Markley 1993) with 12 Newton steps where zeta > 0.01
// lambda^3; otherwise the eigenvector of Davenport's 4 x 4 matrix by Jacobi's method, which is
// exact in every state (tried instead: Mueller et al. 2016, whose steps stop short of the best
// rotation in nearly flat and inverted states and then leave a moment). Whatever A, the result is a
// rotation to rounding and A R^T symmetric to rounding. An A that is not finite counts as zero.
void rotation_fit(const double a[3][3], double rotation[3][3], Quat *last);

// FOAM alone, as the kernels have it, with so many Newton steps; tr(R^T A) for free. Entries of A
// must be of a size whose fourth powers neither overflow nor vanish. False when zeta < 0.1
// lambda^3: too near to a flat or inverted state for it to be exact.
bool rotation_foam(const double a[3][3], int steps, double rotation[3][3], double *trace);

// The plane: closed form; keeps `last` (cos, sin) where a says nothing.
void rotation_fit_plane(const double a[2][2], double scale, double cos_sin[2]);

#endif
