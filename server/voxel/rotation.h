// The rotation that fits a deformation best: argmax of tr(R^T A) over rotations, in every state.
#ifndef PLIANT_VOXEL_ROTATION_H
#define PLIANT_VOXEL_ROTATION_H

#include "base/vec.h"

#include <stdbool.h>

// One element, double precision: what the kernels' fast path leaves over, and the reference. A by
// rows. `last` is the rotation of the step before and the start where A alone does not decide (a
// line, a point, a mirror image); it is replaced by the result.
// FOAM (Markley 1993) with up to 12 Newton steps where zeta > 1e-6 lambda^3; otherwise up to 30
// steps of R <- R exp(axial(skew(R^T A)) / (|tr R^T A| + eps)), each turn limited to 1 rad (Mueller
// et al. 2016). Whatever A, the result is a rotation to rounding, and finite when A is.
void rotation_fit(const double a[3][3], double rotation[3][3], Quat *last);

// FOAM alone, as the kernels have it, with so many Newton steps. False when zeta < 0.1 lambda^3:
// too near to a flat or inverted state for it to be exact.
bool rotation_foam(const double a[3][3], int steps, double rotation[3][3], double *trace);

// The plane: closed form; keeps `last` (cos, sin) where a says nothing.
void rotation_fit_plane(const double a[2][2], double scale, double cos_sin[2]);

#endif
