// SPDX-License-Identifier: MIT
// The Maxwell branches of a body: the strains of their dashpots, of any number for each element or
// spring (server/voxel/README.md and server/surface/README.md, "Relaxation").
#ifndef PLIANT_BODY_RELAXATION_H
#define PLIANT_BODY_RELAXATION_H

#include "base/isa.h"
#include "base/memory.h"
#include "body/maxwell.h"

// A Maxwell branch in one pass of a kernel.
typedef struct RelaxationBranch {
    double stiffness; // over that of the elastic law
    double half;      // what half of a step leaves of its strain
    bool volumetric;
} RelaxationBranch;

// Branches, and the strains of their dashpots, Real [group][branch][strains][lanes]: before a pass
// and after it (NULL where nothing is changed). May be the same.
typedef struct RelaxationPass {
    int count;
    RelaxationBranch branch[MAXWELL_BRANCHES];
    const void *from;
    void *to;
} RelaxationPass;

// How the strains lie in memory.
typedef struct RelaxationLayout {
    int groups, lanes; // lanes of a group: elements or springs that a kernel treats side by side
    int strains;       // numbers of each: 6 of an element, 1 of a spring
    Precision precision;
} RelaxationLayout;

typedef struct Relaxation {
    int count;
    MaxwellBranch branch[MAXWELL_BRANCHES];
    double rigidity; // stiffness to fast strains over that of the elastic law
    RelaxationLayout layout;
    int current;     // which of `strain` is that after the last tick
    bool begun;      // the other one is that after the last evaluation of this tick
    void *strain[2]; // as RelaxationPass.from; state
} Relaxation;

// Load time. Starts relaxed at rest.
Relaxation *relaxation_create(int count, const MaxwellBranch *branch,
                              const RelaxationLayout *layout, const char *name, Arena *arena,
                              StateList *state);

// Sets the branches of a pass that moves the dashpots on by h [s]. Step thread, as all below.
void relaxation_begin(Relaxation *relaxation, double h, RelaxationPass *pass);
// Sets the branches of a pass that measures the present state.
void relaxation_measure(const Relaxation *relaxation, RelaxationPass *pass);
// Sets the dashpots of a pass to those of another from a group on.
void relaxation_skip(const Relaxation *relaxation, int group, const RelaxationPass *from,
                     RelaxationPass *to);
// End a tick: its result is kept, or not.
void relaxation_commit(Relaxation *relaxation);
void relaxation_abandon(Relaxation *relaxation);
// Relaxes all at the rest shape.
void relaxation_forget(Relaxation *relaxation);
// True if all strains are finite.
bool relaxation_check(const Relaxation *relaxation);

// Between ticks: copies the strains of an element or spring by group * lanes + lane, all branches.
// Numbers of one: RELAXATION_NUMBERS at most.
enum { RELAXATION_NUMBERS = 6 * MAXWELL_BRANCHES };
void relaxation_take(const Relaxation *relaxation, int lane, double strain[RELAXATION_NUMBERS]);
void relaxation_put(Relaxation *relaxation, int lane, const double strain[RELAXATION_NUMBERS]);

#endif
