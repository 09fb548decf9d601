// The batches of a cuttable body: what batch.h is to others, but made anew, window by window, while
// the body is cut. Each window of the lattice owns a fixed range of batches, enough for whatever
// may come of it, and what they hold is a pure function of the leaves that the window has and of
// their vertices: plain cubes by class, then by number; those with hanging vertices by how many
// vertices they have, then by mask and number, in mixed batches (kernel.h). So only the windows
// with changed elements are packed anew, and the result is that of packing all: bits do not depend
// on the way that led to a state.
//
// Step thread, but for cut_windows_create; no allocation after that.
#ifndef PLIANT_VOXEL_CUT_CUT_WINDOWS_H
#define PLIANT_VOXEL_CUT_CUT_WINDOWS_H

#include "voxel/cut/cut_lattice.h"
#include "voxel/cut/template_cache.h"
#include "voxel/kernel.h"

typedef struct WindowOptions {
    const char *name; // of the body
    const CutLattice *lattice;
    TemplateCache *templates;
    int material_count;
    // [(levels + 1) * material_count], by level, then material - 1, of plain cubes, and used for
    // those with hanging vertices too (template_cache.h)
    const ElementClass *classes;
} WindowOptions;

// Neighbouring batches in use.
typedef struct BatchRun {
    int first, count;
} BatchRun;

// All arrays belong to the arena. `plain` and `hanging` below count all batches that may be used.
typedef struct CutWindows {
    // --- constant ---
    const CutLattice *lattice;
    TemplateCache *templates;
    int material_count;
    const ElementClass *classes;
    int plain_capacity, hanging_capacity; // batches
    int *first_plain, *first_hanging;     // [window + 1]
    int *start;                           // [hanging + 1] of HangingBatches
    int *table;                           // [hanging] of HangingBatches

    // --- state ---
    double (*last)[LANES][4]; // [plain, then hanging] see VoxelPass; of lanes without an element:
                              // no rotation

    // --- follows from the lattice ---
    unsigned char *plain_used, *hanging_used; // [window] batches
    int (*plain_vertex)[NODE_CORNERS][LANES]; // [plain]
    int *plain_class;                         // [plain]
    int (*hanging_vertex)[NODE_COUNT][LANES]; // [hanging]
    int (*hanging_class)[LANES];              // [hanging]
    unsigned (*hanging_mask)[LANES];          // [hanging] whose numbers the lane holds
    RestTable *tables;                        // [hanging] with numbers of their own
    int *place;                               // [element] batch * LANES + lane, hanging batches
                                              // counted on from the plain ones; -1: no leaf
    // Plain ones first, then hanging ones; of each the first half's, about half of the batches,
    // come first. A function of the used batches of each window.
    BatchRun *run;
    int run_end[2][2]; // [hanging][half]

    // --- within an update ---
    int *changed; // windows
    unsigned char *is_changed;
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
// Batches in use.
int cut_windows_count(const CutWindows *windows, bool hanging);

#endif
