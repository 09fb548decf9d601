// SPDX-License-Identifier: MIT
// Friction with a memory (server/sim/README.md, "Friction"): a bristle, a spring between two
// surfaces that grows with their slip and slides where it would pull harder than Coulomb's law
// allows (Cundall and Strack 1979, A discrete numerical model for granular assemblies).
#ifndef PLIANT_SIM_BRISTLE_H
#define PLIANT_SIM_BRISTLE_H

#include "base/vec.h"

// Advances a bristle by `dt`, in place, and returns its force on the surface that slips at `slip`
// [m/s] over the other. With the bristle's stretch s, kept across `normal` (unit),
//   s <- s + slip dt,  s <- s min(1, cap / (k |s|)),
// the force is -k (s + b slip), at most `cap`, mu times the push [N]; of one that slides -k s.
// `k`: stiffness [N/m]. `b`: damping time [s].
static inline Vec3 bristle_force(Vec3 *bristle, Vec3 slip, Vec3 normal, double k, double b,
                                 double cap, double dt)
{
    Vec3 s = vec3_madd(*bristle, dt, slip);
    s = vec3_madd(s, -vec3_dot(s, normal), normal);
    const double stretch = k * vec3_length(s);
    if (stretch > cap) { // it slides
        *bristle = vec3_scale(cap / stretch, s);
        return vec3_scale(-k, *bristle);
    }
    *bristle = s;
    const Vec3 force = vec3_scale(-k, vec3_madd(s, b, slip));
    const double size = vec3_length(force);
    return size > cap ? vec3_scale(cap / size, force) : force;
}

#endif
