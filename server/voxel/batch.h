// SPDX-License-Identifier: MIT
// Elements in the batches that the kernels process (kernel.h). Batches: how elements are grouped;
// load time, a pure function of its input: the same elements give the same batches. BatchRuns: the
// order in which they are evaluated.
#ifndef PLIANT_VOXEL_BATCH_H
#define PLIANT_VOXEL_BATCH_H

#include "base/memory.h"
#include "body/relaxation.h"
#include "voxel/template.h"

typedef struct BatchOptions {
    const char *name; // of the body, for the arena
    int element_count;
    const int (
        *vertex)[NODE_COUNT];    // [element] vertices by node; -1: absent. All corners are present.
    const int *element_class;    // [element] index into `classes`
    const ElementClass *classes; // duplicates and unused ones are allowed
    int vertex_count;            // also the row of the spare vertex, for lanes without an element
} BatchOptions;

// The arena owns all arrays.
typedef struct Batches {
    PlainBatches plain; // by class, then in the order of the elements
    // By template, then in the order of the elements. Where the last batch of a template would be
    // less than three quarters full, its elements go to the mixed batches: sorted by their number
    // of vertices, template, and order.
    HangingBatches hanging;
    int mixed_count;       // of hanging batches, the last
    int template_count;    // of hanging elements
    Template *templates;   // [template_count] ascending masks
    int (*mixture)[LANES]; // [mixed batch] templates of its lanes; -1: no element
    int class_count;
    ElementClass *classes; // [class_count] classes in use, each once, in the order of the options
    int element_count;
    // [element] batch * LANES + lane, hanging batches numbered after the plain ones, as in
    // VoxelPass.last.
    int *lane;
} Batches;

void batches_create(Batches *out, const BatchOptions *options, Arena *arena);
static inline int batches_total(const Batches *batches)
{
    return batches->plain.batch_count + batches->hanging.batch_count;
}

// The batches of a body in the order in which the kernels evaluate them, as runs of consecutive
// ones: one run of each kind in bodies that cannot be cut, some for each window in others
// (cut/cut_windows.h). Bodies whose forces are summed in two arrays evaluate one half of each kind
// for each.
enum { BATCH_PLAIN, BATCH_HANGING, BATCH_KINDS };
enum { BATCHES_ALL = -1 }; // both halves

// Consecutive batches in use.
typedef struct BatchRun {
    int first, count;
} BatchRun;

typedef struct BatchRuns {
    // --- set by whoever creates the batches ---
    const VoxelKernels *kernels;
    PlainBatches plain;     // all of them, also those that are not in use
    HangingBatches hanging; // likewise
    const RestTable *tables;
    const ElementClass *classes;
    // --- batch_runs_create ---
    // [plain, then hanging] see VoxelPass; state. No rotation in lanes without an element.
    double (*last)[LANES][4];
    Relaxation *relaxation; // NULL: none; see batch_runs_relax

    // --- listed below ---
    BatchRun *run;               // plain ones first, then hanging ones
    int run_end[BATCH_KINDS][2]; // [kind][half]
} BatchRuns;

// Load time, once the batches are there. Allocates room for `most` runs, and rotations, which start
// at none and are added to the state.
void batch_runs_create(BatchRuns *runs, int most, const char *name, Arena *arena, StateList *state);

// Load time, after batch_runs_create: adds Maxwell branches.
void batch_runs_relax(BatchRuns *runs, int count, const MaxwellBranch *branch, Precision precision,
                      const char *name, Arena *arena, StateList *state);

// Lists the batches in use again: begin a kind, add its runs, end it; plain ones before hanging
// ones. Batches that continue the last run join it.
void batch_runs_begin(BatchRuns *runs, int kind);
void batch_runs_add(BatchRuns *runs, int kind, BatchRun more);
void batch_runs_end(BatchRuns *runs, int kind); // splits them in two halves

// Returns the number of batches in use.
int batch_runs_count(const BatchRuns *runs, int kind);
// Returns the first batch in use from number `next` on, hanging ones counted after the plain ones,
// and where its run ends; -1: there is none. Runs come in any order.
int batch_runs_next(const BatchRuns *runs, int next, int *end);
// Returns the number of all batches, the length of `last`.
static inline int batch_runs_capacity(const BatchRuns *runs)
{
    return runs->plain.batch_count + runs->hanging.batch_count;
}

// Resets all rotations to none, and relaxes all branches.
void batch_runs_forget(BatchRuns *runs);
// True if all rotations are valid quaternions, and what branches remember is finite.
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
