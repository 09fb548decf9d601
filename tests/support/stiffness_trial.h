// What the stiffness that a contact tells is worth: against what the body's own dynamics answers
// when the tool that presses it moves a little, slowly.
#ifndef PLIANT_TESTS_STIFFNESS_TRIAL_H
#define PLIANT_TESTS_STIFFNESS_TRIAL_H

#include "dynamics/sim.h"

// What told and measured stiffness have to do with each other.
typedef struct StiffnessVerdict {
    double told_least, told_most; // eigenvalues [N/m]
    double error;                 // Frobenius norm of the difference over that of the measured
    double normal;                // told over measured, along the force
    double short_by; // most negative eigenvalue of told - measured, over the largest measured; or 0
} StiffnessVerdict;

// Of tool 0, which presses a body at rest: by 20 um in 0.5 s, in six directions. Fails the test
// when what is told is not positive.
StiffnessVerdict stiffness_judge(Sim *sim, StateList *state);

#endif
