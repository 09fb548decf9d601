// Broken edges of a body that can be cut (cutting.md sections 2 and 3). Bits, one for each side of
// each face of the finest level, say which edges are broken; who shares which node is a function of
// them: the faces around a node of the uncut mesh, joined across unbroken edges, fall into
// components, and each component has a node of its own. The one with the lowest face keeps the node
// that was there, the others get copies, whose numbers follow those of the finest level. So ends,
// crossings, loops and borders need no rule of their own.
//
// Faces at the ends of broken edges are locked: they are leaves of the finest level for good. So
// coarser leaves never meet a copy, and what hangs has none.
#ifndef PLIANT_SURFACE_DETAIL_DETAIL_CUT_H
#define PLIANT_SURFACE_DETAIL_DETAIL_CUT_H

#include "base/arena.h"
#include "base/state.h"
#include "dynamics/cut.h"
#include "surface/cut/cut_snap.h"
#include "surface/surface.h"

struct SurfaceModel;
struct Detail;

// A face, and which of its corners a node is.
typedef struct Leaf {
    int level, face, corner;
} Leaf;

typedef struct DetailCut {
    // --- constant ---
    int base_count;       // nodes of the finest level; copies follow
    int copy_capacity;    // most copies
    int most_around;      // most faces of the finest level around a node
    Level uncut;          // the finest level, with the corners of the uncut mesh:
    const int (*base)[3]; // [finest faces] these
    const Vec3 *built;    // [base_count] rest places of the uncut mesh [m]
    double bulge;         // by which nodes of finer levels may stick out of a leaf [m]

    // --- part of the state ---
    unsigned char *broken; // [finest faces] bit k: the edge between corners k and k + 1
    int (*node)[3];        // [finest faces] the nodes that its corners have now: these are the
                           // corners of the finest level that all of the body's code reads
    int64_t *copies;       // in use
    Vec3 *rest;            // [base_count] rest places [m]: cuts move some onto the blade; likewise
                           // levels.position

    float *stretch; // [finest edges] of bodies that tear, smoothed; NULL of others

    // --- follows from it ---
    int *origin;           // [copy_capacity] the node of the uncut mesh that a copy stands for
    unsigned char *locked; // [faces above the finest level]
    bool *is_end;          // [base_count] of a broken edge
    int *piece;            // [finest faces] the lowest face that is joined with it
    int *node_piece;       // [base_count + copy_capacity] that of the faces there
    int piece_count, small_count; // pieces, and of them those of a single face

    // --- where the tissue is; by a look ---
    CutFinder finder;
    int64_t looks, *seen;   // [nodes] look at which `position` was found out
    Vec3 *position;         // [nodes] in the world [m]
    unsigned char *sides;   // [nodes] of the box around a sweep, a bit for each
    unsigned char *is_near; // [finest faces]
    int *near;              // [finest faces]

    // --- the cut under way ---
    int *vertex; // [vertex_count] ends of the edges that break, ascending
    int vertex_count;
    unsigned char *wanted; // [faces above the finest level] to be refined; zero between cuts
    Leaf *want;            // [faces above the finest level] those
    int want_count;
    Leaf *ring;   // [most_around]
    int *part;    // [most_around] component of each face of the ring
    int *fresh;   // [most_around] components that get a copy
    bool *is_tip; // [nodes] of bodies that tear: a crack can go on there
    int *torn;    // [finest edges] of bodies that tear
    CutSnap *snap;
    int *snap_work; // [base_count] zero between cuts
} DetailCut;

// Load time, before anything is sized: takes over the corners of the finest level.
void detail_cut_create(struct Detail *detail, const SurfaceOptions *options, Arena *arena,
                       StateList *state);
// Faces of the finest level around a node of the uncut mesh, in an order that depends on the
// hierarchy alone.
int detail_cut_ring(const struct Detail *detail, int node, Leaf *ring);
// Of the bits: what is locked; whether around each node the components are those of its copies.
void detail_cut_lock(const struct Detail *detail);
bool detail_cut_parts_match(const struct Detail *detail);
// Everything that follows from the state.
void detail_cut_rebuild(struct Detail *detail);
// Breaks edges of the finest level (ascending, unbroken, inner ones), within a change: refines the
// faces around their ends, copies nodes, marks what has to be packed and drawn. False, with what is
// needed in `outcome`, when it does not fit: then nothing was changed.
bool detail_cut_break(struct SurfaceModel *model, const int *edge, int edge_count,
                      CutOutcome *outcome);

// --- detail_blade.c ---
bool detail_blade_cut(Body *body, const CutSweep *sweep, CutOutcome *outcome,
                      TopologyChange *change);
void detail_blade_reserve(void *self, int blades, Arena *arena, StateList *state);

// --- detail_tear.c ---
void detail_tear_create(struct Detail *detail, const SurfaceOptions *options, Arena *arena,
                        StateList *state);
bool detail_tear_check(const struct Detail *detail);
// Nothing has been stretched so far.
void detail_tear_forget(struct Detail *detail);
bool detail_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change);

// --- detail_cut_check.c ---
// After the state was overwritten: whether it is one that cuts can have led to. What follows from
// it may be overwritten.
bool detail_cut_check(const struct Detail *detail);

// --- detail_pieces.c ---
// Pieces of the body: faces joined across unbroken edges.
void detail_pieces_label(struct Detail *detail);

#endif
