// SPDX-License-Identifier: MIT
// Private to the kernels: springs that relax (Maxwell branches) and stiffen, beside the linear law.
// With x = l - r the extension of a spring at rest length r, and d that of a branch's dashpot,
//   pull / k = G'(q) x + sum e (x - d),    q = (x / (s r))^2 where x > 0, else 0,    d' = (x - d) /
//   time
// (server/surface/README.md, "Stiffening" and "Relaxation"). All of it is even in the
// direction of the spring, so that both its ends compute the same bits.
#ifndef PLIANT_SURFACE_KERNEL_LAW_H
#define PLIANT_SURFACE_KERNEL_LAW_H

#include "base/vector.h"
#include "body/kernel/stiffening.h"
#include "surface/kernel.h"

// The numbers of a pass as vectors.
typedef struct Law {
    int branch_count;
    Vector stiffness[MAXWELL_BRANCHES]; // e, with what half a step leaves of x - d
    Vector left[MAXWELL_BRANCHES];      // what a step leaves of it
    const Real *from;
    Real *to;
    const Real *inverse; // SpringTable.inverse; NULL: they do not stiffen
    Vector knee, cap;    // s sqrt(q_c), cap
} Law;

// Fills in the numbers of a pass. Returns NULL for linear springs.
INLINE const Law *law_of(const SpringPass *pass, SpringClass kind, Law *law)
{
    if (kind < SPRINGS_LAW)
        return NULL;
    *law = (Law){.branch_count = pass->relaxation.count,
                 .from = pass->relaxation.from,
                 .to = pass->relaxation.to,
                 .inverse = pass->springs->inverse};
    for (int i = 0; i < law->branch_count; i++) {
        const RelaxationBranch *branch = &pass->relaxation.branch[i];
        law->stiffness[i] = vector_set(branch->stiffness * branch->half);
        law->left[i] = vector_set(branch->half * branch->half);
    }
    if (law->inverse != NULL) {
        law->knee = vector_set(pass->stiffening.knee);
        law->cap = vector_set(pass->stiffening.curve.cap);
    }
    return kind == SPRINGS_LAW || law->branch_count > 0 || law->inverse != NULL ? law : NULL;
}

// Returns G' x: beyond the knee a straight line of slope cap.
INLINE Vector law_stiffen(const Law *law, long entry, int lane, Vector x, Vector r)
{
    const Vector near = vector_min(x, law->knee * r), beyond = x - near;
    const Vector u =
        vector_max(near, vector_set(0.0)) * vector_load(law->inverse + entry * LANES + lane);
    const Vector half = stiffening_half_exp(u * u);
    return (half * half) * near + law->cap * beyond;
}

// Returns the pull of WIDTH springs of an entry over their stiffness, and moves their dashpots on.
INLINE Vector law_pull(const Law *law, long entry, int lane, Vector x, Vector r)
{
    Vector pull = law->inverse != NULL ? law_stiffen(law, entry, lane, x, r) : x;
    for (int i = 0; i < law->branch_count; i++) {
        const long at = (entry * law->branch_count + i) * LANES + lane;
        const Vector d = x - vector_load(law->from + at);
        pull += law->stiffness[i] * d;
        vector_store(law->to + at, x - law->left[i] * d);
    }
    return pull;
}

#endif
