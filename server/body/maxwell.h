// SPDX-License-Identifier: MIT
// Maxwell branches: what relaxes beside an elastic law (server/voxel/README.md, "Relaxation"). Pure
// functions.
#ifndef PLIANT_BODY_MAXWELL_H
#define PLIANT_BODY_MAXWELL_H

#include <stdbool.h>

enum { MAXWELL_BRANCHES = 3 }; // at most

// A spring and a dashpot in series. The elastic law beside it is what is left after a long time.
typedef struct MaxwellBranch {
    double time;     // in which its stress falls to 1/e [s]
    double share;    // of the stiffness to fast strains, that of all branches and the law
    bool volumetric; // changes of volume relax, too
} MaxwellBranch;

// Returns the stiffness to fast strains over that of the elastic law. Shares add up to less than 1.
double maxwell_rigidity(int count, const MaxwellBranch *branch);

// Finds the branches with which stress and strain have the loss factor `loss` (the tangent of the
// phase between them) at 2, 10 and 50 Hz, and nearly so from 1 to 100 Hz. Returns false if it is
// too large.
bool maxwell_of_loss(double loss, MaxwellBranch branch[MAXWELL_BRANCHES]);

// Returns the loss factor of branches and a damping time [s] at a frequency [Hz].
double maxwell_loss(int count, const MaxwellBranch *branch, double damping_time, double hz);

#endif
