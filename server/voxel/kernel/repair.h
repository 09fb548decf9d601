// SPDX-License-Identifier: MIT
// Private to the kernels: elements that are too flat, inverted, thin or small for the fast path,
// one by one in double precision. Rare, so never inlined: the fast path keeps its registers.
#ifndef PLIANT_VOXEL_KERNEL_REPAIR_H
#define PLIANT_VOXEL_KERNEL_REPAIR_H

#include "voxel/kernel/foam.h"
#include "voxel/rotation.h"

// The vectors of one call, in memory.
typedef struct Repair {
    Real g[3][3][WIDTH];
    Real spread[SYMMETRIC][WIDTH], momentum[3][WIDTH];
    Bits wanted[WIDTH];
    Real turn[3][3][WIDTH], inverse[WIDTH], stretch[WIDTH], spin[3][WIDTH];
} Repair;

// Solves for omega. Where the element is a line or a point, only the part of omega counts that
// moves something. A fraction of tr I on the diagonal, above rounding, keeps the rest finite; the
// second iteration corrects the error that it causes.
static void repair_spin(Repair *by, int lane)
{
    double s[SYMMETRIC], l[3], spin[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < SYMMETRIC; i++)
        s[i] = (double)by->spread[i][lane];
    for (int i = 0; i < 3; i++)
        l[i] = (double)by->momentum[i][lane];
    const double size = s[XX] + s[YY] + s[ZZ], share = (KERNEL_SINGLE ? 2e-6 : 2e-13) * size;
    if (size > 0.0) {
        const double x = size - s[XX], y = size - s[YY], z = size - s[ZZ];
        const double a = x + share, b = y + share, c = z + share;
        const double xx = b * c - s[YZ] * s[YZ], yy = c * a - s[ZX] * s[ZX],
                     zz = a * b - s[XY] * s[XY], yz = s[ZX] * s[XY] + a * s[YZ],
                     zx = s[XY] * s[YZ] + b * s[ZX], xy = s[YZ] * s[ZX] + c * s[XY];
        const double inverse = 1.0 / (a * xx - s[XY] * xy - s[ZX] * zx);
        for (int round = 0; round < 2; round++) {
            const double rest[3] = {l[0] - (x * spin[0] - s[XY] * spin[1] - s[ZX] * spin[2]),
                                    l[1] - (y * spin[1] - s[XY] * spin[0] - s[YZ] * spin[2]),
                                    l[2] - (z * spin[2] - s[ZX] * spin[0] - s[YZ] * spin[1])};
            spin[0] += (xx * rest[0] + xy * rest[1] + zx * rest[2]) * inverse;
            spin[1] += (xy * rest[0] + yy * rest[1] + yz * rest[2]) * inverse;
            spin[2] += (zx * rest[0] + yz * rest[1] + zz * rest[2]) * inverse;
        }
    }
    for (int i = 0; i < 3; i++)
        by->spin[i][lane] = (Real)spin[i];
}

static __attribute__((noinline, cold)) void repair_lanes(Repair *by, bool damped, double (*last)[4])
{
    for (int lane = 0; lane < WIDTH; lane++) {
        double f[3][3], rotation[3][3], stretch = -3.0;
        bool finite = true;
        for (int i = 0; i < 9; i++) {
            f[i / 3][i % 3] = (double)by->g[i / 3][i % 3][lane] + (i % 4 == 0 ? 1.0 : 0.0);
            finite = finite && isfinite(f[i / 3][i % 3]);
        }
        // Bad numbers are left: the check after the step must find them.
        if (by->wanted[lane] == 0 || !finite)
            continue;
        Quat q = {last[lane][0], last[lane][1], last[lane][2], last[lane][3]};
        rotation_fit((const double(*)[3])f, rotation, &q);
        last[lane][0] = q.w, last[lane][1] = q.x, last[lane][2] = q.y, last[lane][3] = q.z;
        for (int i = 0; i < 9; i++) {
            stretch += rotation[i / 3][i % 3] * f[i / 3][i % 3];
            by->turn[i / 3][i % 3][lane] =
                (Real)(rotation[i / 3][i % 3] - (i % 4 == 0 ? 1.0 : 0.0));
        }
        by->inverse[lane] = REAL(1.0);
        by->stretch[lane] = (Real)stretch;
        if (damped)
            repair_spin(by, lane);
    }
}

// Replaces the lanes in `wanted` of `polar` and `spin`. `last` as in VoxelPass, from the first lane
// on.
INLINE void repair(const Deformation *by, const Motion *motion, Vector wanted, bool damped,
                   double (*last)[4], Polar *polar, Vector spin[3])
{
    // The slow path works on arrays in memory, lane by lane.
    Repair all;
    memcpy(all.wanted, &wanted, sizeof wanted);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            vector_store(all.g[i][k], by->g[i][k]);
            vector_store(all.turn[i][k], polar->turn[i][k]);
        }
    }
    vector_store(all.inverse, polar->inverse);
    vector_store(all.stretch, polar->stretch);
    if (damped) {
        for (int i = 0; i < SYMMETRIC; i++)
            vector_store(all.spread[i], motion->spread[i]);
        for (int i = 0; i < 3; i++) {
            vector_store(all.momentum[i], motion->momentum[i]);
            vector_store(all.spin[i], spin[i]);
        }
    }
    repair_lanes(&all, damped, last);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            polar->turn[i][k] = vector_load(all.turn[i][k]);
        if (damped)
            spin[i] = vector_load(all.spin[i]);
    }
    polar->inverse = vector_load(all.inverse);
    polar->stretch = vector_load(all.stretch);
}

#endif
