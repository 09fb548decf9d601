// How stiff the bodies feel to the tools that touch them: for hands behind a network, which show
// F - K (x - x_of_F) until the next force comes and give no work that way (a delayed force alone is
// that of a spring with negative damping).
//
// A body is 20 to 70 times softer over half a second than over a millisecond; what a hand needs is
// the slow figure. With the springs of the contact Kc = sum k n n^T, which move with the faces'
// points W u, and a patch of the body around them (patch.h) that has K_p, M and C, all around it
// held, and t = 0.1 s:
//   K = Kc - B^T A^-1 B,   A = M / t^2 + C / t + K_p + sum k W^T n n^T W,   B = sum k W^T n n^T.
// That is the Schur complement of a positive matrix: symmetric and positive; and as the patch's rim
// is held, rather too stiff than too soft, which is the passive side.
//
// The work is spread over ticks: one contact at a time, in turn, each at most 60 times a second.
// What it gives is told to clients and never enters the motion: it is no part of the state. Step
// thread.
#ifndef PLIANT_DYNAMICS_STIFFNESS_H
#define PLIANT_DYNAMICS_STIFFNESS_H

#include "dynamics/contact.h"

// What a tool that moves by dx feels more, -K dx, and against a speed v, -b (n . v) n.
typedef struct ContactStiffness {
    double k[6];    // xx yy zz yz zx xy, world [N/m]
    double damping; // b, along the mean normal n [N s/m]
} ContactStiffness;

typedef struct StiffnessEstimator StiffnessEstimator;

// Load time, after the contacts: of those whose bodies can tell (BodyOps.gather_patch) and whose
// tools are moved by poses. NULL: there is none.
StiffnessEstimator *stiffness_create(Contact *const *contact, int count, double tick, Arena *arena);
// Once a tick, after all bodies have moved.
void stiffness_step(StiffnessEstimator *estimator, int64_t step);
// The last estimate of a contact, as long as it has not ended since; NULL: none yet. `index` as in
// stiffness_create.
const ContactStiffness *stiffness_get(const StiffnessEstimator *estimator, int index);
// After the state has been replaced.
void stiffness_forget(StiffnessEstimator *estimator);

// The largest eigenvalue of a symmetric matrix xx yy zz yz zx xy, and the smallest.
void stiffness_eigenvalues(const double k[6], double *least, double *most);

#endif
