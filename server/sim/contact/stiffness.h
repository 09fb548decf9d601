// SPDX-License-Identifier: MIT
// The stiffness of bodies against the tools that touch them, for haptic clients behind a network:
// they show F - K (x - x_of_F) until the next force arrives, which does no work on the hand
// (server/sim/README.md, "Stiffness for clients").
// With the springs of the contact Kc = sum T, which move with the faces' points W u, and a
// patch of the body around them (patch.h) with K_p, M and C, fixed all around, and t = 0.1 s:
//   K = Kc - B^T A^-1 B,   A = M / t^2 + C / t + K_p + sum W^T T W,   B = sum W^T T,   T = k n n^T
// and, without friction, what the turning of the springs adds; of the size that the force shows as
// the tool moves in or out. The work is spread over ticks: one contact at a time, in turn,
// each at most 60 times per second. The result is published and never affects the motion: it is no
// part of the state. Step thread.
#ifndef PLIANT_SIM_STIFFNESS_H
#define PLIANT_SIM_STIFFNESS_H

#include "base/sym3.h"
#include "sim/contact/contact.h"

// Additional force on a tool that moves by dx: -K dx; against a speed v: -b (n . v) n.
typedef struct ContactStiffness {
    Sym3 k;         // world frame [N/m]
    double damping; // b, along the mean normal n [N s/m]
} ContactStiffness;

typedef struct StiffnessEstimator StiffnessEstimator;

// Creates the estimator for contacts of bodies with BodyOps.gather_patch and tools moved by poses.
// Load time, after the contacts. Returns NULL if there are none.
StiffnessEstimator *stiffness_create(Contact *const *contact, int count, double tick, Arena *arena);
// Call once per tick, after all bodies have moved.
void stiffness_step(StiffnessEstimator *estimator, int64_t step);
// Returns the last estimate of a contact that has not ended since; NULL: none yet. `index` as in
// stiffness_create.
const ContactStiffness *stiffness_get(const StiffnessEstimator *estimator, int index);
// Call after the state has been replaced.
void stiffness_forget(StiffnessEstimator *estimator);

// Finds the smallest and the largest eigenvalue of a symmetric matrix.
void stiffness_eigenvalues(Sym3 k, double *least, double *most);

#endif
