// SPDX-License-Identifier: MIT
// The batches of a cuttable body: like batch.h, but rebuilt window by window while the body is cut.
// Leaves of one kind (plain cubes of one class, or one mask) fill whole batches of their window.
// The rest of a group's windows fills batches of the group: plain ones by class; those with hanging
// vertices again whole batches of one mask, and the remainder mixed ones (kernel.h), sorted by
// number of vertices, mask and number. Partly filled leaves, each with numbers of its own, always
// go to mixed batches, and have a class of their own. Windows and groups own fixed ranges of
// batches, large enough for any outcome, whose content is a pure function of the leaves there and
// of their vertices. So only what changed is packed, and the result equals that of packing
// everything: it does not depend on the history.
//
// A body that adapts has few leaves at a time: its windows and groups take batches from a pool that
// is large enough for as many leaves as the lattice allows. Which ones they have is part of the
// state; the order in which batches are evaluated is that of the windows all the same.
//
// Step thread, except cut_windows_create; does not allocate after that.
#ifndef PLIANT_VOXEL_CUT_CUT_WINDOWS_H
#define PLIANT_VOXEL_CUT_CUT_WINDOWS_H

#include "voxel/batch.h"
#include "voxel/cut/cut_shape.h"
#include "voxel/template.h"

enum { GROUP_WINDOWS = 8, GROUP_ELEMENTS = GROUP_WINDOWS * WINDOW_ELEMENTS };

typedef struct WindowOptions {
    const char *name; // of the body
    const VoxelKernels *kernels;
    const CutLattice *lattice;
    TemplateCache *templates;
    int material_count;
    // [(levels + 1) * material_count], by level, then material - 1, of plain cubes; also used for
    // those with hanging vertices (template.h). With `stiff`, as many again, for elements that are.
    const ElementClass *classes;
    const unsigned char *stiff; // [element] 1: stiffer (cut_heat.h); or NULL
    int branch_count;
    const MaxwellBranch *branch; // [branch_count]
} WindowOptions;

// Batches [low, high) that belong to a window or a group, and those in use. In a body that adapts
// none belong to it; those in use are a list (BatchPool).
typedef struct BatchRange {
    int low[BATCH_KINDS], high[BATCH_KINDS]; // constant
    int first[BATCH_KINDS], used[BATCH_KINDS];
} BatchRange;

// Batches that windows and groups share, numbered as in CutWindows.lane.
typedef struct BatchPool {
    uint64_t *free; // a bit each
    int *next;      // [batch] the next one of its range
    int *place;     // [batch] state: 1 + POOL_PLACES * its range + its place there; 0: free
    int *held;      // [range][kind] first batch while a state is restored; -1: none
    int end[2]; // of plain batches, and of hanging ones, of which mixed ones are taken from above
} BatchPool;
enum { POOL_PLACES = 1024 }; // more than the batches of a range

typedef struct WindowGroup {
    int first, end; // windows, of one level
} WindowGroup;

// The arena owns all arrays; [plain] and [hanging] cover all batches that may be used.
typedef struct CutWindows {
    // --- constant, except the parts of the ranges in use ---
    const CutLattice *lattice;
    TemplateCache *templates;
    int material_count;
    const unsigned char *stiff; // [element] or NULL; as in the options
    int whole_classes;         // those of partly filled leaves come after these, by cut_lattice_row
    int capacity[BATCH_KINDS]; // batches
    int group_count;
    WindowGroup *group;
    int *group_of;      // [window]
    BatchRange *full;   // [window]
    BatchRange *pooled; // [group] full batches of one mask, from the rest of its windows
    BatchRange *mixed;  // [group] of the remainder
    BatchPool *pool;    // of a body that adapts; else NULL

    BatchRuns runs; // what the kernels evaluate; its rotations and dashpots are state
    double (*strain)[RELAXATION_NUMBERS]; // [GROUP_ELEMENTS] scratch; NULL: nothing relaxes

    // --- derived from the lattice ---
    int (*plain_vertex)[NODE_CORNERS][LANES]; // [plain]
    int *plain_class;                         // [plain]
    int (*hanging_vertex)[NODE_COUNT][LANES]; // [hanging]
    int (*hanging_class)[LANES];              // [hanging]
    TemplateKey (*hanging_shape)[LANES]; // [hanging] shape of each lane; in full batches the first
                                         // holds for all
    RestTable *tables;                   // [hanging] with tables of their own
    ElementClass *classes; // those of the options, then those of partly filled leaves; NULL: none
    int *lane; // [cut_lattice_place_of_row] batch * LANES + lane, hanging batches numbered after
               // the plain ones; -1: not a leaf
    // What a window leaves to its group: plain ones, then hanging ones, ascending keys, starting at
    // the window's first element: which of its elements, or (cut_pack.c) packed keys.
    unsigned char *rest_cell;       // [element of level 0]
    uint32_t *rest;                 // [element - level_first[1]]
    int (*rest_count)[BATCH_KINDS]; // [window]
    uint64_t *in_use;               // a bit for each group with batches

    // --- within an update ---
    int *changed; // windows, ascending
    bool *is_changed;
} CutWindows;

// Returns the class of whole elements like this one.
static inline int cut_windows_class_of_whole(const CutWindows *windows, int element)
{
    const CutElement *e = &windows->lattice->element[element];
    const int own = e->level * windows->material_count + e->material - 1;
    const bool stiff = windows->stiff != NULL && windows->stiff[element];
    return stiff ? own + (windows->lattice->levels + 1) * windows->material_count : own;
}

// Returns the class of a leaf.
static inline int cut_windows_class(const CutWindows *windows, int element)
{
    return cut_shape_is_partial(windows->lattice, element)
               ? windows->whole_classes + cut_lattice_row(windows->lattice, element)
               : cut_windows_class_of_whole(windows, element);
}

// Returns the lane of an element; -1: it is no leaf.
static inline int cut_windows_lane(const CutWindows *windows, int element)
{
    const int place = cut_lattice_place_of_row(windows->lattice, element);
    return place < 0 ? -1 : windows->lane[place];
}

// Load time. Packs everything; rotations start at none, and are added to the state.
void cut_windows_create(CutWindows *windows, const WindowOptions *options, Arena *arena,
                        StateList *state);
// Updates the batches from the lattice's list of changes. Elements keep their rotations; children
// inherit that of the divided element; one that merged has none, and the mean strain of its
// children's branches.
void cut_windows_update(CutWindows *windows);
// Rebuilds the batches after the state list was restored and the lattice derived. The state must be
// one that cut_lattice_derive accepts.
void cut_windows_restored(CutWindows *windows);
// Lists the leaves in the lanes that batch_runs_stress found, ascending, in element [leaves];
// returns their number.
int cut_windows_stressed(const CutWindows *windows, const uint16_t *high, int *element);

// --- cut_pack.c, for cut_windows.c ---

// Packs the group's windows whose is_changed is set, and what they and the others leave to the
// group. `turns`: rotations move along with their elements, from their previous lanes; otherwise
// `last` stays. Pack groups with finer elements first, so that leaves still find the rotation of
// the element from which they were divided; after merges those with coarser ones.
void cut_pack(CutWindows *windows, int group, bool turns);
// Frees the batches that ranges had in a restored state and have not taken again.
void cut_pack_free_held(CutWindows *windows);

// Makes the table of a hanging batch of the pool one for each lane (LANES) or for all (1).
void cut_windows_set_stride(CutWindows *windows, int batch, int stride);

// Returns the batch after one of a range of this kind.
static inline int cut_windows_next(const CutWindows *windows, int kind, int batch)
{
    const int first = kind == BATCH_PLAIN ? 0 : windows->capacity[0];
    return windows->pool == NULL ? batch + 1 : windows->pool->next[first + batch] - first;
}

#endif
