// SPDX-License-Identifier: MIT
// Broken edges of a body that can be cut (server/surface/cut/README.md, "Broken edges and nodes").
// Bits, one for each side of each face of the finest level, mark the broken edges; which faces
// share a node follows from them: the faces around a node of the uncut mesh, joined across unbroken
// edges, form components, and each component has a node of its own. The one with the lowest face
// keeps the original node, the others get copies, whose numbers follow those of the finest level.
// So ends, crossings, loops and borders need no special rules.
//
// Removed faces (detail_remove.c) have a bit of their own beside those of their edges, all of which
// are broken. Such a face is no leaf and has no nodes; a node whose faces are all gone is off.
//
// Faces at the ends of broken edges are locked ("Levels and locks" there): they stay leaves of the
// finest level for ever. So coarser leaves never meet a copy, and hanging nodes have none.
#ifndef PLIANT_SURFACE_DETAIL_DETAIL_CUT_H
#define PLIANT_SURFACE_DETAIL_DETAIL_CUT_H

#include "base/memory.h"
#include "body/cut.h"
#include "surface/cut/cut_lips.h"
#include "surface/cut/cut_smooth.h"
#include "surface/detail/detail_pieces.h"
#include "surface/detail/detail_set.h"
#include "surface/surface.h"

struct SurfaceModel;
struct Detail;

// The nodes that are shown beside where they are.
typedef struct DetailLips {
    int count;
    int *node, *index; // [count] the node of a lip; [base_count + copy_capacity] its lip, or -1
    Lip *lip;          // [count]
    double *mass; // [base_count + copy_capacity] that what is shown of a node resists with [kg]
} DetailLips;

// Of bodies that diathermy can act on; part of the state.
typedef struct DetailHeat {
    double *energy; // [finest faces] above body temperature [J]
    int64_t *step;  // when they were last cooled
} DetailHeat;

typedef struct DetailCut {
    // --- constant ---
    int base_count;       // nodes of the finest level; copies follow
    int copy_capacity;    // most copies
    int most_around;      // most faces of the finest level around a node
    Level uncut;          // the finest level, with the corners of the uncut mesh:
    const int (*base)[3]; // [finest faces] these
    double bulge;         // distance by which nodes of finer levels may stick out of a leaf [m]

    // --- part of the state ---
    unsigned char *broken; // [finest faces] bit k: the edge between corners k and k + 1; CutFaceBit
    int (*node)[3];  // [finest faces] the current nodes of its corners: all code of the body reads
                     // these as the corners of the finest level; of a removed face as uncut
    int64_t *copies; // number in use
    LipCrossing *crossing; // [finest edges] of broken edges; zero otherwise
    DetailHeat *heat;      // NULL: nothing heats the body
    float *stretch;        // [finest edges] bodies that tear: smoothed stretch; NULL otherwise

    // --- derived from the state ---
    int *origin;           // [copy_capacity] the node of the uncut mesh from which a copy was made
    unsigned char *locked; // [faces above the finest level]
    bool *is_end;    // [base_count] true at the ends of broken edges, corners of removed faces
    int gone_count;  // removed faces
    int *piece;      // [finest faces] the lowest face that is connected with it
    int *node_piece; // [base_count + copy_capacity] piece of the faces there
    int piece_count, small_count; // pieces, and those of a single face among them
    DetailLips lips;

    // --- deformed positions; for one call ---
    CutFinder finder;
    int64_t looks, *seen; // [nodes] call in which `position` was computed
    Vec3 *position;       // [nodes] in the world frame [m]
    unsigned char *sides; // [nodes] outside which sides of the box around a sweep, one bit per side
    unsigned char *is_near; // [finest faces]
    int *near;              // [finest faces]

    // --- the cut in progress ---
    int *vertex; // [vertex_count] ends of the edges that break, ascending
    int vertex_count;
    unsigned char *wanted; // [faces above the finest level] to be refined; zero between cuts
    Leaf *want;            // [faces above the finest level] the same as a list
    int want_count;
    Leaf *ring;   // [most_around]
    int *part;    // [most_around] component of each face of the ring
    int *fresh;   // [most_around] components that get a copy
    bool *is_tip; // [nodes] bodies that tear: a crack can continue there
    int *torn;    // [finest edges] bodies that tear
} DetailCut;

// Further bits of `broken`.
enum CutFaceBit {
    CUT_GONE = 1 << 3,       // the face is removed
    CUT_COAGULATED = 1 << 4, // it was too hot once
};

// True if a face of the finest level is removed; with cut != NULL.
static inline bool detail_cut_is_gone(const DetailCut *cut, int face)
{
    return (cut->broken[face] & CUT_GONE) != 0;
}

// True if the edge between corners k and k + 1 of a leaf is broken.
static inline bool detail_is_broken(const LeafSet *set, int level, int face, int k)
{
    return set->cut != NULL && level == set->levels.finest &&
           (set->cut->broken[face] >> k & 1) != 0;
}

// Load time, before anything is sized: takes over the corners of the finest level.
void detail_cut_create(struct Detail *detail, const SurfaceOptions *options, Arena *arena,
                       StateList *state);
// Lists the faces of the finest level around a node of the uncut mesh, in an order that depends on
// the hierarchy alone; returns their number.
int detail_cut_ring(const LeafSet *set, int node, Leaf *ring);
// detail_cut_lock derives the locks from the bits; detail_cut_parts_match is true if around each
// node the components are those of its copies.
void detail_cut_lock(const LeafSet *set);
bool detail_cut_parts_match(const LeafSet *set);
// Rebuilds everything that is derived from the state.
void detail_cut_rebuild(struct Detail *detail);
// Breaks edges of the finest level (ascending, unbroken, inner ones), within a change: refines the
// faces around their ends, copies nodes, marks what must be packed and drawn. False if the capacity
// is too small, with what is needed in `outcome`; then nothing is changed.
bool detail_cut_break(struct SurfaceModel *model, const int *edge, int edge_count,
                      CutOutcome *outcome);

// --- detail_blade.c ---
bool detail_blade_cut(Body *body, const CutSweep *sweep, CutOutcome *outcome,
                      TopologyChange *change);
void detail_blade_reserve(void *self, int blades, Arena *arena, StateList *state);

// A change begins with a fit of the body's frame. If the change comes to nothing, the next fit
// starts from where this one did, so that the attempt has no effect on the state.
typedef struct FrameStart {
    double rotation[4], piece[PIECE_FRAMES][4];
} FrameStart;

FrameStart detail_cut_begin(struct SurfaceModel *model);
void detail_cut_take_back(struct SurfaceModel *model, const FrameStart *start);
// Finds the faces within `margin` [m] of where an edge passes, and their neighbours: a link needs
// both its faces.
void detail_cut_look(struct SurfaceModel *model, const BladeEdge *edge, int edges, double margin,
                     CutTissue *tissue);

// --- detail_remove.c ---
// As BodyOps.remove and BodyOps.account.
bool detail_remove(Body *body, const Removal *removal, RemovalOutcome *outcome,
                   TopologyChange *change);
int detail_account(const void *self, TissueAccount *account, int capacity);

// --- detail_lips.c ---
// Load time.
void detail_lips_create(struct Detail *detail, Arena *arena, StateList *state);
// After edges were broken: updates the lips around. Rebuilt: all lips, from the state.
void detail_lips_follow(struct Detail *detail, const int *edge, int count);
void detail_lips_rebuild(struct Detail *detail);
// Forgets the lip of a node that goes.
void detail_lips_forget(DetailLips *lips, int node);
// After the state was overwritten: true if cuts can have produced the crossings.
bool detail_lips_check(const LeafSet *set);
// After masses or lips changed: finds the masses that tools and ties reckon with.
void detail_lips_weigh(struct SurfaceModel *model);
// Moves what was read of a node (velocity may be NULL) to where it is shown. `rows` as in
// rows_read.
void detail_lips_read(const struct SurfaceModel *model, const void *rows, int node, Vec3 *position,
                      Vec3 *velocity);
// Moves the lips among nodes written for clients, by slot of the mesh.
void detail_lips_show(const struct SurfaceModel *model, const void *rows, float *position,
                      float *velocity);
void detail_lips_show_rest(const struct SurfaceModel *model, float *position);
// Finds the nodes that carry a node that is a lip, and their shares; false: it is none.
bool detail_lips_carriers(const struct SurfaceModel *model, int node, int carrier[3],
                          double share[3]);

// --- detail_heat.c ---
// Load time, of bodies that diathermy can act on.
void detail_heat_create(struct Detail *detail, Arena *arena, StateList *state);
// Gives a diathermy's heat to faces, by their masses, at the end of so many ticks. Returns what
// they took [J].
double detail_heat_give(struct Detail *detail, int64_t step, const Removal *removal,
                        const int *face, int count);
// True if all its water is gone.
bool detail_heat_boils_away(const struct Detail *detail, int face);
bool detail_heat_check(const struct Detail *detail);

// --- detail_tear.c ---
void detail_tear_create(struct Detail *detail, const SurfaceOptions *options, Arena *arena,
                        StateList *state);
bool detail_tear_check(const LeafSet *set);
// Resets the smoothed stretch: nothing has been stretched so far.
void detail_tear_forget(LeafSet *set);
bool detail_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change);

// --- detail_cut_check.c ---
// After the state was overwritten: true if cuts can have produced it. May overwrite what is derived
// from it.
bool detail_cut_check(const struct Detail *detail);

// --- detail_pieces.c ---
// Labels the pieces of the body: faces connected across unbroken edges.
void detail_pieces_label(LeafSet *set);

#endif
