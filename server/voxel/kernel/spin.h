// Private to the kernels: the rigid rotation of WIDTH elements' velocities, omega = I^-1 L.
#ifndef PLIANT_VOXEL_KERNEL_SPIN_H
#define PLIANT_VOXEL_KERNEL_SPIN_H

#include "voxel/kernel/foam.h"

// Its input: S = sum w r r^T, so that I = tr(S) 1 - S, and L = sum w r x v.
typedef struct Motion {
    Vector spread[SYMMETRIC];
    Vector momentum[3];
} Motion;

INLINE void add_cross(const Vector a[3], const Vector b[3], Vector sum[3])
{
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        sum[i] += a[j] * b[k] - a[k] * b[j];
    }
}

// Solves by the adjugate. Elements that polar_fit rejects may be needles, whose I is singular:
// repair.h replaces their result. In all others the smallest eigenvalue of I is above 1/400 of the
// largest.
INLINE void spin_solve(const Motion *motion, Vector spin[3])
{
    const Vector *s = motion->spread, *l = motion->momentum;
    Vector x = s[YY] + s[ZZ], y = s[ZZ] + s[XX], z = s[XX] + s[YY]; // I; off the diagonal -S
    Vector xx = y * z - s[YZ] * s[YZ], yy = z * x - s[ZX] * s[ZX], zz = x * y - s[XY] * s[XY];
    Vector yz = s[ZX] * s[XY] + x * s[YZ], zx = s[XY] * s[YZ] + y * s[ZX],
           xy = s[YZ] * s[ZX] + z * s[XY];
    Vector inverse = REAL(1.0) / (x * xx - s[XY] * xy - s[ZX] * zx);
    spin[0] = (xx * l[0] + xy * l[1] + zx * l[2]) * inverse;
    spin[1] = (xy * l[0] + yy * l[1] + yz * l[2]) * inverse;
    spin[2] = (zx * l[0] + yz * l[1] + zz * l[2]) * inverse;
}

#endif
