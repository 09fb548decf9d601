// A piece of a body around a contact, as a linear system: what its free nodes resist when they are
// moved a little and all around them is held. The body's model fills it (BodyOps.gather_patch), a
// little at a time, so that no tick is spent on it; stiffness.c solves it. Knows neither springs
// nor elements, only 3 x 3 blocks between nodes. Step thread.
#ifndef PLIANT_DYNAMICS_PATCH_H
#define PLIANT_DYNAMICS_PATCH_H

#include "base/arena.h"
#include "base/vec.h"
#include "dynamics/region.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    PATCH_NODES = 384,   // more: gathered anew from a smaller region
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

// A node that is no unknown of its own: it moves as its carriers do, by their shares. Carriers that
// are not in the patch are held.
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
    // --- asked for: patch_begin ---
    Region region; // whose free nodes are in the patch [m], world
    double time;   // t: masses count with 1 / t^2, damping with 1 / t [s]
    bool tensed;   // what is compressed does not give way sideways: positive in every state

    // --- where gathering goes on; the model's ---
    int pass;
    int64_t next;

    // --- gathered so far ---
    bool full;         // something did not fit
    double relaxation; // damping over stiffness of what connects nodes, at most [s]
    int node_count, tie_count, block_count;
    int node[PATCH_NODES];           // the model's numbers; those of BodySurface come first in them
    double mass[PATCH_NODES];        // of m / t^2 + c / t + k of the node alone [N/m]
    double drag[PATCH_NODES];        // c of the node alone [N s/m]
    double diagonal[PATCH_NODES][6]; // xx yy zz yz zx xy [N/m], with all of it
    int first[PATCH_NODES];          // block of a row; -1: none
    PatchTie tie[PATCH_TIES];
    PatchBlock block[PATCH_BLOCKS];

    int place_count; // numbers that nodes may have
    short *local;    // [place_count] -1: not in the patch; else the node here, or -2 - its tie
} Patch;

// Load time.
Patch *patch_create(int place_count, const char *name, Arena *arena);
// Forgets what was gathered.
void patch_begin(Patch *patch, const Region *region, double time, bool tensed);

// --- for models ---
// A free node: its mass [kg], and the drag [N s/m] and stiffness [N/m] that hold it to where it is.
// False when it does not fit.
bool patch_add_node(Patch *patch, int node, double mass, double drag, double stiffness);
// A node that hangs on others, once all nodes are there.
bool patch_add_tie(Patch *patch, int node, int count, const int *carrier, const double *share);
// The unknowns that carry a node, at most PATCH_CARRIERS; 0 for one that is held.
int patch_carriers(const Patch *patch, int node, short *local, double *share);
// Stiffness `m` (3 x 3, by rows) between the nodes at two local numbers: what node a feels when b
// moves; a != b counts for both, a == b has to be symmetric.
void patch_add_block(Patch *patch, int a, int b, const double m[9]);
// A symmetric stiffness against sum_k share_k u_k; local numbers may come twice.
void patch_add_form(Patch *patch, int count, const short *local, const double *share,
                    const double m[9]);

// --- for the solver ---
// Adds blocks first to last - 1 of y = A x; from the first on also what precedes them: the
// diagonal. Each [node_count].
void patch_multiply(const Patch *patch, const PatchColumns *x, PatchColumns *y, int first,
                    int last);

#endif
