// The batches of a cuttable body: what batch.h is to others, but made anew, window by window, while
// the body is cut. Leaves of one kind (plain cubes of one class, or one mask) fill whole batches of
// their window; what is left over of the windows of a group fills batches of the group: plain ones
// by class; those with hanging vertices again whole batches of one mask, and what is left then
// mixed ones (kernel.h), by the number of their vertices, mask and number. Windows and groups own
// fixed ranges of batches, enough for whatever may come of them, and what these hold is a pure
// function of the leaves there and of their vertices. So only what changed is packed anew, and the
// result is that of packing all: bits do not depend on the way that led to a state.
//
// Step thread, but for cut_windows_create; no allocation after that.
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
    // [(levels + 1) * material_count], by level, then material - 1, of plain cubes, and used for
    // those with hanging vertices too (template_cache.h)
    const ElementClass *classes;
} WindowOptions;

enum { BATCH_PLAIN, BATCH_HANGING, BATCH_KINDS };

// Batches [low, high) that belong to a window or a group; those in use.
typedef struct BatchRange {
    int low[BATCH_KINDS], high[BATCH_KINDS]; // constant
    int first[BATCH_KINDS], used[BATCH_KINDS];
} BatchRange;

typedef struct WindowGroup {
    int first, end; // windows, of one level
} WindowGroup;

// Neighbouring batches in use.
typedef struct BatchRun {
    int first, count;
    bool mixed;
} BatchRun;

// All arrays belong to the arena; [plain] and [hanging] are all batches that may be used.
typedef struct CutWindows {
    // --- constant, but for what of the ranges is in use ---
    const CutLattice *lattice;
    TemplateCache *templates;
    int material_count;
    const ElementClass *classes;
    int capacity[BATCH_KINDS]; // batches
    int group_count;
    WindowGroup *group;
    int *group_of;      // [window]
    BatchRange *full;   // [window]
    BatchRange *pooled; // [group] full of one mask, of what its windows leave over
    BatchRange *mixed;  // [group] of what is left then
    int *start;         // [hanging + 1] of HangingBatches
    int *table;         // [hanging] of HangingBatches

    // --- state ---
    double (*last)[LANES][4]; // [plain, then hanging] see VoxelPass; of lanes without an element:
                              // no rotation

    // --- follows from the lattice ---
    int (*plain_vertex)[NODE_CORNERS][LANES]; // [plain]
    int *plain_class;                         // [plain]
    int (*hanging_vertex)[NODE_COUNT][LANES]; // [hanging]
    int (*hanging_class)[LANES];              // [hanging]
    unsigned (*hanging_mask)[LANES];          // [hanging] whose numbers the lane holds; of full
                                              // batches the first stands for all
    RestTable *tables;                        // [hanging] with numbers of their own
    int *place;                               // [element] batch * LANES + lane, hanging batches
                                              // counted on from the plain ones; -1: no leaf
    // What a window leaves to its group: plain ones, then hanging ones, ascending keys
    // (cut_pack.c), from the window's first element on.
    uint64_t *rest;                 // [element]
    int (*rest_count)[BATCH_KINDS]; // [window]
    // Plain ones first, then hanging ones; of each the first half of the batches, then the second.
    BatchRun *run;
    int run_end[BATCH_KINDS][2]; // [kind][half]

    // --- within an update ---
    int *changed; // windows, ascending
    bool *is_changed;
} CutWindows;

// Load time. Packs all; rotations start at none, and are listed as state.
void cut_windows_create(CutWindows *windows, const WindowOptions *options, Arena *arena,
                        StateList *state);
// After the lattice changed, by its list of changes. Elements keep their rotations; those that
// came of a divided one have its.
void cut_windows_update(CutWindows *windows);
// After the state list was restored and the lattice derived anew. The state must be one that
// cut_lattice_derive calls sound.
void cut_windows_restored(CutWindows *windows);
void cut_windows_forget_rotations(CutWindows *windows);
// Whether all rotations are such.
bool cut_windows_check(const CutWindows *windows);

enum { WINDOWS_ALL = -1 };
// Adds forces as kernels->evaluate does. `pass` says law, damped, rows, force and scales; the rest
// is set here. `half`: 0 or 1 of bodies whose forces gather in two arrays, else WINDOWS_ALL. The
// spare vertex is the one after the lattice's vertex_capacity.
void cut_windows_evaluate(const CutWindows *windows, const VoxelKernels *kernels,
                          const VoxelPass *pass, int half);
double cut_windows_energy(const CutWindows *windows, const VoxelKernels *kernels,
                          const VoxelPass *pass);
// Which lanes are under more stress than `limit` [Pa], as kernels->stress tells them, of one half
// or all; high [capacity of both kinds] belongs to the caller. Halves may be done at a time.
void cut_windows_stress(const CutWindows *windows, const VoxelKernels *kernels,
                        const VoxelPass *pass, double limit, int half, uint16_t *high);
// The leaves in those lanes, ascending, into element [leaves]; returns how many.
int cut_windows_stressed(const CutWindows *windows, const uint16_t *high, int *element);
// Batches in use.
int cut_windows_count(const CutWindows *windows, int kind);

#endif
