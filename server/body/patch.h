// SPDX-License-Identifier: MIT
// A part of a body around a contact as a linear system: the resistance of its free nodes against
// small displacements while all surrounding nodes are fixed. The body's model fills it
// (BodyOps.gather_patch) in small steps that each fit a tick; stiffness.c solves it. Independent of
// springs and elements: only 3 x 3 blocks between nodes. Step thread.
#ifndef PLIANT_BODY_PATCH_H
#define PLIANT_BODY_PATCH_H

#include "base/memory.h"
#include "base/sym3.h"
#include "body/region.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    PATCH_NODES = 384,   // more: gathered again from a smaller region
    PATCH_BLOCKS = 6144, // between two nodes each
    PATCH_CARRIERS = 4,  // of a node that others carry
    PATCH_TIES = 256,
};

// The block between two nodes: f_row += m u_column, f_column += m^T u_row.
typedef struct PatchBlock {
    short row, column; // row < column
    int next;          // block of the same row; -1: last
    double m[9];       // by rows [N/m]
} PatchBlock;

// A node without unknowns of its own: it moves with its carriers, by their shares. Carriers outside
// the patch are fixed.
typedef struct PatchTie {
    int node, count;
    short local[PATCH_CARRIERS];
    double share[PATCH_CARRIERS];
} PatchTie;

// A node's rows of three columns.
typedef struct PatchColumns {
    Vec3 of[3];
} PatchColumns;

typedef struct Patch {
    // --- the request: patch_begin ---
    Region region; // its free nodes are in the patch [m], world frame
    double time;   // t: masses count with 1 / t^2, damping with 1 / t [s]
    bool tensed; // compressed links do not yield sideways: keeps the system positive in every state

    // --- progress of gathering; used by the model ---
    int pass;
    int64_t next;

    // --- gathered so far ---
    bool full;         // something exceeded the capacity
    double relaxation; // largest ratio of damping to stiffness of the links between nodes [s]
    int node_count, tie_count, block_count;
    int node[PATCH_NODES];      // the model's numbers; those of BodySurface come first
    double mass[PATCH_NODES];   // of m / t^2 + c / t + k of the node alone [N/m]
    double drag[PATCH_NODES];   // c of the node alone [N s/m]
    Sym3 diagonal[PATCH_NODES]; // [N/m], with all of it
    int first[PATCH_NODES];     // block of a row; -1: none
    PatchTie tie[PATCH_TIES];
    PatchBlock block[PATCH_BLOCKS];

    int slot_count; // largest number of nodes
    short *local;   // [slot_count] -1: not in the patch; else the local number, or -2 - its tie
} Patch;

// Allocates a patch. Load time.
Patch *patch_create(int slot_count, const char *name, Arena *arena);
// Discards what was gathered and starts a request.
void patch_begin(Patch *patch, const Region *region, double time, bool tensed);

// --- for models ---
// Adds a free node: its mass [kg], and the drag [N s/m] and stiffness [N/m] relative to space.
// Returns false beyond the capacity.
bool patch_add_node(Patch *patch, int node, double mass, double drag, double stiffness);
// Adds a hanging node, once all other nodes are there.
bool patch_add_tie(Patch *patch, int node, int count, const int *carrier, const double *share);
// Finds the unknowns that carry a node, at most PATCH_CARRIERS; returns 0 for a fixed one.
int patch_carriers(const Patch *patch, int node, short *local, double *share);
// Adds the stiffness `m` (3 x 3, by rows) between two local nodes: the force on node a when b
// moves; a != b counts for both, a == b must be symmetric.
void patch_add_block(Patch *patch, int a, int b, const double m[9]);
// Adds a symmetric stiffness against sum_k share_k u_k; local numbers may repeat.
void patch_add_form(Patch *patch, int count, const short *local, const double *share,
                    const double m[9]);

// --- for the solver ---
// Adds blocks first to last - 1 of y = A x; if first is 0, also the diagonal before them. Each
// [node_count].
void patch_multiply(const Patch *patch, const PatchColumns *x, PatchColumns *y, int first,
                    int last);

#endif
