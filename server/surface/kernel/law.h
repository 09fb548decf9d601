// Private to the kernels: springs that relax (Maxwell branches) and stiffen, beside the linear law.
// With x = l - r the extension of a spring at rest length r, and d that of a branch's dashpot,
//   pull / k = G'(q) x + sum e (x - d),    q = (x / (s r))^2 where x > 0, else 0,    d' = (x - d) /
//   time
// (dynamics/stiffening.h; README.md, "Stiffening" and "Relaxation"). All of it is even in the
// direction of the spring, so that both its ends compute the same bits.
#ifndef PLIANT_SURFACE_KERNEL_LAW_H
#define PLIANT_SURFACE_KERNEL_LAW_H

#include "base/vector.h"
#include "surface/kernel.h"

// The numbers of a pass as vectors.
typedef struct Law {
    int branch_count;
    Vector stiffness[MAXWELL_BRANCHES]; // e, with what half a step leaves of x - d
    Vector left[MAXWELL_BRANCHES];      // what a step leaves of it
    const Real *from;
    Real *to;
    Vector strain, knee, root, at_knee, rise; // s, q_c, sqrt(q_c), exp(q_c), cap - exp(q_c)
} Law;

INLINE Law law_of(const SpringPass *pass, int kind)
{
    Law law = {.branch_count = 0};
    if (kind & SPRINGS_RELAX) {
        law.branch_count = pass->relaxation.count;
        law.from = pass->relaxation.from;
        law.to = pass->relaxation.to;
        for (int i = 0; i < law.branch_count; i++) {
            const RelaxationBranch *branch = &pass->relaxation.branch[i];
            law.stiffness[i] = vector_set(branch->stiffness * branch->half);
            law.left[i] = vector_set(branch->half * branch->half);
        }
    }
    if (kind & SPRINGS_STIFFEN) {
        const SpringStiffening *stiffening = &pass->stiffening;
        law.strain = vector_set(stiffening->strain);
        law.knee = vector_set(stiffening->curve.knee);
        law.root = vector_set(stiffening->root);
        law.at_knee = vector_set(stiffening->curve.at_knee);
        law.rise = vector_set(stiffening->curve.cap - stiffening->curve.at_knee);
    }
    return law;
}

// Returns exp(q) for 0 <= q <= 3, within 1e-15 (single: 2e-7): a polynomial for exp - 1 of a part
// of q, the largest error of which is as small as it can be, then (1 + y)^2 - 1 as y (2 + y).
INLINE Vector law_exp(Vector q)
{
#if KERNEL_SINGLE
    enum { DOUBLINGS = 3, TERMS = 5 };
    static const double TERM[TERMS] = {1.0000000230280277, 0.49999693283086571, 0.16673173773526934,
                                       0.041186732869267516, 0.0097562981810516251};
#else
    enum { DOUBLINGS = 4, TERMS = 8 };
    static const double TERM[TERMS] = {0.99999999999999989,   0.50000000000009459,
                                       0.16666666665608612,   0.041666667117452975,
                                       0.0083333239110482907, 0.0013889956668529729,
                                       0.0001977443860978738, 2.6963386205129481e-05};
#endif
    const Vector part = q * REAL(1.0 / (1 << DOUBLINGS));
    Vector y = vector_set(TERM[TERMS - 1]);
    for (int i = TERMS - 2; i >= 0; i--)
        y = y * part + REAL(TERM[i]);
    y *= part;
    for (int i = 0; i < DOUBLINGS; i++)
        y *= REAL(2.0) + y;
    return REAL(1.0) + y;
}

// Returns G': beyond the knee exp(q_c) + (cap - exp(q_c)) (1 - sqrt(q_c / q)).
INLINE Vector law_factor(const Law *law, Vector x, Vector r)
{
    const Vector zero = vector_set(0.0), tiny = vector_set(1e-12); // [m]; padding has r = 0
    Vector unit = law->strain * r;
    unit = vector_select_greater(unit, tiny, unit, tiny);
    const Vector knee = law->root * unit; // the extension there
    const Vector pulled = vector_select_greater(x, zero, x, zero),
                 far = vector_select_greater(x, knee, x, knee);
    // One division for x / unit and knee / far.
    const Vector below = vector_select_greater(far, tiny, far, tiny);
    const Vector inverse = REAL(1.0) / (unit * below);
    const Vector u = pulled * (below * inverse), q = u * u;
    return law_exp(vector_select_greater(q, law->knee, law->knee, q)) +
           law->rise * ((far - knee) * (unit * inverse));
}

// Returns the pull of WIDTH springs of an entry over their stiffness, and moves their dashpots on.
INLINE Vector law_pull(const Law *law, int kind, long entry, int lane, Vector x, Vector r)
{
    Vector pull = kind & SPRINGS_STIFFEN ? law_factor(law, x, r) * x : x;
    for (int i = 0; i < law->branch_count; i++) {
        const long at = (entry * law->branch_count + i) * LANES + lane;
        const Vector d = x - vector_load(law->from + at);
        pull += law->stiffness[i] * d;
        vector_store(law->to + at, x - law->left[i] * d);
    }
    return pull;
}

#endif
