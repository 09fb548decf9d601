// The batches of a body in the order in which the kernels evaluate them, as runs of consecutive
// ones: one run of each kind in bodies that cannot be cut, some for each window in others
// (cut/cut_windows.h). Bodies whose forces are summed in two arrays evaluate one half of each kind
// for each.
#ifndef PLIANT_VOXEL_BATCH_RUNS_H
#define PLIANT_VOXEL_BATCH_RUNS_H

#include "base/memory.h"
#include "voxel/kernel.h"

enum { BATCH_PLAIN, BATCH_HANGING, BATCH_KINDS };
enum { BATCHES_ALL = -1 }; // both halves

// Consecutive batches in use.
typedef struct BatchRun {
    int first, count;
    bool mixed;
} BatchRun;

typedef struct BatchRuns {
    // --- set by whoever creates the batches ---
    const VoxelKernels *kernels;
    PlainBatches plain;     // all of them, also those that are not in use
    HangingBatches hanging; // likewise; runs say which are mixed
    const RestTable *tables;
    const ElementClass *classes;
    // --- batch_runs_create ---
    // [plain, then hanging] see VoxelPass; state. No rotation in lanes without an element.
    double (*last)[LANES][4];

    // --- listed below ---
    BatchRun *run;               // plain ones first, then hanging ones
    int run_end[BATCH_KINDS][2]; // [kind][half]
} BatchRuns;

// Load time, once the batches are there. Allocates room for `most` runs, and rotations, which start
// at none and are added to the state.
void batch_runs_create(BatchRuns *runs, int most, const char *name, Arena *arena, StateList *state);

// Lists the batches in use again: begin a kind, add its runs, end it; plain ones before hanging
// ones. Batches that continue the last run join it.
void batch_runs_begin(BatchRuns *runs, int kind);
void batch_runs_add(BatchRuns *runs, int kind, BatchRun more);
void batch_runs_end(BatchRuns *runs, int kind); // splits them in two halves

// Returns the number of batches in use.
int batch_runs_count(const BatchRuns *runs, int kind);
// Returns the number of all batches, the length of `last`.
static inline int batch_runs_capacity(const BatchRuns *runs)
{
    return runs->plain.batch_count + runs->hanging.batch_count;
}

// Resets all rotations to none.
void batch_runs_forget_rotations(BatchRuns *runs);
// True if all rotations are valid quaternions.
bool batch_runs_check(const BatchRuns *runs);

// Adds forces as kernels->evaluate does. The caller sets law, damped, rows, force and scales of
// `pass`; the rest is set here. `half`: 0 or 1, or BATCHES_ALL.
void batch_runs_evaluate(const BatchRuns *runs, const VoxelPass *pass, int half);
double batch_runs_energy(const BatchRuns *runs, const VoxelPass *pass);
// Finds the lanes with more stress than `limit` [Pa], as kernels->stress does, of one half or all;
// high [batch_runs_capacity] belongs to the caller. Two halves may run at the same time.
void batch_runs_stress(const BatchRuns *runs, const VoxelPass *pass, double limit, int half,
                       uint16_t *high);

#endif
