// SPDX-License-Identifier: MIT
// How good the stiffness is that a contact reports: against what the body's own dynamics answers
// when the tool that presses it moves a little, slowly.
#ifndef PLIANT_TESTS_STIFFNESS_TRIAL_H
#define PLIANT_TESTS_STIFFNESS_TRIAL_H

#include "sim/sim.h"

// Reported against measured stiffness.
typedef struct StiffnessVerdict {
    double reported_least, reported_most; // eigenvalues [N/m]
    double error;    // Frobenius norm of the difference over that of the measured
    double normal;   // reported over measured, along the force
    double short_by; // most negative eigenvalue of reported - measured, over the largest measured;
                     // or 0
} StiffnessVerdict;

// Of tool 0, which presses a body at rest: by 20 um in 0.5 s, in six directions. Fails the test
// when the reported one is not positive.
StiffnessVerdict stiffness_judge(Sim *sim, StateList *state);

#endif
