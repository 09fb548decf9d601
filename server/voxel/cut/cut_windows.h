// The batches of a cuttable body: like batch.h, but rebuilt window by window while the body is cut.
// Leaves of one kind (plain cubes of one class, or one mask) fill whole batches of their window.
// The rest of a group's windows fills batches of the group: plain ones by class; those with hanging
// vertices again whole batches of one mask, and the remainder mixed ones (kernel.h), sorted by
// number of vertices, mask and number. Windows and groups own fixed ranges of batches, large enough
// for any outcome, whose content is a pure function of the leaves there and of their vertices. So
// only what changed is packed, and the result equals that of packing everything: it does not depend
// on the history.
//
// Step thread, except cut_windows_create; does not allocate after that.
#ifndef PLIANT_VOXEL_CUT_CUT_WINDOWS_H
#define PLIANT_VOXEL_CUT_CUT_WINDOWS_H

#include "voxel/cut/cut_lattice.h"
#include "voxel/cut/template_cache.h"
#include "voxel/kernel.h"

enum { GROUP_WINDOWS = 8, GROUP_ELEMENTS = GROUP_WINDOWS * WINDOW_ELEMENTS };

typedef struct WindowOptions {
    const char *name; // of the body
    const CutLattice *lattice;
    TemplateCache *templates;
    int material_count;
    // [(levels + 1) * material_count], by level, then material - 1, of plain cubes; also used for
    // those with hanging vertices (template_cache.h).
    const ElementClass *classes;
} WindowOptions;

enum { BATCH_PLAIN, BATCH_HANGING, BATCH_KINDS };

// Batches [low, high) that belong to a window or a group, and those in use.
typedef struct BatchRange {
    int low[BATCH_KINDS], high[BATCH_KINDS]; // constant
    int first[BATCH_KINDS], used[BATCH_KINDS];
} BatchRange;

typedef struct WindowGroup {
    int first, end; // windows, of one level
} WindowGroup;

// Consecutive batches in use.
typedef struct BatchRun {
    int first, count;
    bool mixed;
} BatchRun;

// The arena owns all arrays; [plain] and [hanging] cover all batches that may be used.
typedef struct CutWindows {
    // --- constant, except the parts of the ranges in use ---
    const CutLattice *lattice;
    TemplateCache *templates;
    int material_count;
    const ElementClass *classes;
    int capacity[BATCH_KINDS]; // batches
    int group_count;
    WindowGroup *group;
    int *group_of;      // [window]
    BatchRange *full;   // [window]
    BatchRange *pooled; // [group] full batches of one mask, from the rest of its windows
    BatchRange *mixed;  // [group] of the remainder
    int *start;         // [hanging + 1] of HangingBatches
    int *table;         // [hanging] of HangingBatches

    // --- state ---
    double (*last)[LANES][4]; // [plain, then hanging] see VoxelPass; no rotation in lanes without
                              // an element

    // --- derived from the lattice ---
    int (*plain_vertex)[NODE_CORNERS][LANES]; // [plain]
    int *plain_class;                         // [plain]
    int (*hanging_vertex)[NODE_COUNT][LANES]; // [hanging]
    int (*hanging_class)[LANES];              // [hanging]
    unsigned (*hanging_mask)[LANES]; // [hanging] mask of each lane; in full batches the first holds
                                     // for all
    RestTable *tables;               // [hanging] with tables of their own
    int *place; // [element] batch * LANES + lane, hanging batches numbered after the plain ones;
                // -1: not a leaf
    // What a window leaves to its group: plain ones, then hanging ones, ascending keys
    // (cut_pack.c), starting at the window's first element.
    uint64_t *rest;                 // [element]
    int (*rest_count)[BATCH_KINDS]; // [window]
    // Plain ones first, then hanging ones; within each the first half of the batches, then the
    // second.
    BatchRun *run;
    int run_end[BATCH_KINDS][2]; // [kind][half]

    // --- within an update ---
    int *changed; // windows, ascending
    bool *is_changed;
} CutWindows;

// Load time. Packs everything; rotations start at none, and are added to the state.
void cut_windows_create(CutWindows *windows, const WindowOptions *options, Arena *arena,
                        StateList *state);
// Updates the batches from the lattice's list of changes. Elements keep their rotations; children
// inherit that of the divided element.
void cut_windows_update(CutWindows *windows);
// Rebuilds the batches after the state list was restored and the lattice derived. The state must be
// one that cut_lattice_derive accepts.
void cut_windows_restored(CutWindows *windows);
void cut_windows_forget_rotations(CutWindows *windows);
// True if all rotations are valid quaternions.
bool cut_windows_check(const CutWindows *windows);

enum { WINDOWS_ALL = -1 };
// Adds forces as kernels->evaluate does. The caller sets law, damped, rows, force and scales of
// `pass`; the rest is set here. `half`: 0 or 1 for bodies whose forces are summed in two arrays,
// else WINDOWS_ALL. The spare vertex is the one after the lattice's vertex_capacity.
void cut_windows_evaluate(const CutWindows *windows, const VoxelKernels *kernels,
                          const VoxelPass *pass, int half);
double cut_windows_energy(const CutWindows *windows, const VoxelKernels *kernels,
                          const VoxelPass *pass);
// Finds the lanes with more stress than `limit` [Pa], as kernels->stress does, of one half or all;
// high [capacity of both kinds] belongs to the caller. Two halves may run at the same time.
void cut_windows_stress(const CutWindows *windows, const VoxelKernels *kernels,
                        const VoxelPass *pass, double limit, int half, uint16_t *high);
// Lists the leaves in those lanes, ascending, in element [leaves]; returns their number.
int cut_windows_stressed(const CutWindows *windows, const uint16_t *high, int *element);
// Returns the number of batches in use.
int cut_windows_count(const CutWindows *windows, int kind);

#endif
