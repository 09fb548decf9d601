// The Maxwell branches of a body: the strains of their dashpots (README.md, "Relaxation").
#ifndef PLIANT_VOXEL_RELAXATION_H
#define PLIANT_VOXEL_RELAXATION_H

#include "voxel/kernel.h"

typedef struct Relaxation {
    int count;
    MaxwellBranch branch[MAXWELL_BRANCHES];
    double rigidity; // stiffness to fast strains over that of the elastic law
    Precision precision;
    int batches;
    int current;     // which of `strain` is that after the last tick
    bool begun;      // the other one is that after the last evaluation of this tick
    void *strain[2]; // as VoxelPass.dashpot; state
} Relaxation;

// Load time. Starts relaxed at rest.
Relaxation *relaxation_create(int count, const MaxwellBranch *branch, Precision precision,
                              int batches, const char *name, Arena *arena, StateList *state);

// Sets the branches of a pass that moves the dashpots on by h [s]. Step thread, as all below.
void relaxation_begin(Relaxation *relaxation, double h, VoxelPass *pass);
// Sets the branches of a pass that measures the present state.
void relaxation_measure(const Relaxation *relaxation, VoxelPass *pass);
// Sets the dashpots of a pass to those of another from a batch on.
void relaxation_skip(const Relaxation *relaxation, int batch, const VoxelPass *from, VoxelPass *to);
// End a tick: its result is kept, or not.
void relaxation_commit(Relaxation *relaxation);
void relaxation_abandon(Relaxation *relaxation);
// Relaxes all at the rest shape.
void relaxation_forget(Relaxation *relaxation);
// True if all strains are finite.
bool relaxation_check(const Relaxation *relaxation);

// Between ticks: copies the strains of an element by batch * LANES + lane, all branches. Numbers of
// an element: RELAXATION_NUMBERS at most.
enum { RELAXATION_NUMBERS = 6 * MAXWELL_BRANCHES };
void relaxation_take(const Relaxation *relaxation, int lane, double strain[RELAXATION_NUMBERS]);
void relaxation_put(Relaxation *relaxation, int lane, const double strain[RELAXATION_NUMBERS]);

#endif
