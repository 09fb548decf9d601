// Finds which links of a triangle surface a blade breaks. A link joins two faces of the finest
// level across an edge: the kinked line from the centroid of the one over the middle of the edge to
// the centroid of the other, which stays in the surface where a straight chord would leave it and
// be missed by a shallow blade. Each half of it, centroid to middle, goes through the exact test of
// dynamics/cut_exact.h; a link breaks when all halves, quadrilaterals and sub-ticks of a batch
// together meet it an odd number of times: then its ends lie on two sides.
//
// Pure but for the memory of strokes: nothing of the body is changed. Step thread; no allocation
// after creation.
#ifndef PLIANT_SURFACE_CUT_CUT_FIND_H
#define PLIANT_SURFACE_CUT_CUT_FIND_H

#include "base/arena.h"
#include "base/state.h"
#include "dynamics/cut.h"
#include "geometry/levels.h"

#define CUT_FIND_UNITS     2048.0 // h / q: units of the integer points in a mean finest edge
#define CUT_FIND_TOLERANCE 0.05   // [h] by which a sub-sweep's triangles may leave a twisted patch
// [h] around a stroke's sweep within which a body remembers its links. A face that becomes a leaf
// inside of it, or comes into it, in the tick in which it is met, is taken to have been at rest in
// that tick: so refine at least this far ahead, by CUT_FIND_MARGIN * finder->h.
#define CUT_FIND_MARGIN 4.0

// What the finder reads of a body, filled by the caller for each call.
typedef struct CutTissue {
    const int *face; // [face_count] finest faces that may be cut, ascending: those that are leaves.
    int face_count;  // A link is looked at when both its faces are among them.
    const int (*corner)[3];      // [finest faces] node of each corner; read of listed faces only
    const Vec3 *position;        // [nodes] deformed, world [m]; read at those corners only
    const unsigned char *broken; // [finest faces] bit k: the link across side k, the edge of
                                 // corners k and k + 1, is broken; on both faces of the edge
} CutTissue;

// The points of a face's half links: its centroid, and the middles of its sides.
typedef struct CutFacePoints {
    CutPoint centroid, middle[3];
} CutFacePoints;

// Where the links around a blade were in the last tick of its stroke; part of the state.
typedef struct CutMemory {
    uint64_t *clock;       // {looks so far, looks in this stroke}
    CutPoint *edge;        // [2] where the blade's edge was, shifted as it was
    int64_t *tries;        // shift in use
    uint64_t *seen;        // [finest faces] look at which `points` was written
    CutFacePoints *points; // [finest faces]
} CutMemory;

typedef struct CutFinder {
    // --- constant ---
    const Level *level; // finest
    Vec3 origin;        // of the integer points [m]
    double h, q;        // mean edge of the finest level at rest, unit of the points [m]
    int blades;
    CutMemory *memory; // [blades]
    // --- what the last call found ---
    int count; // links that break now, each once,
    int *edge; // [edges of the finest level] by edge, in (face, side) order
    int met;   // links met an odd number of times, broken before or not
    int tries; // shifts that did not do
    // --- scratch ---
    int parts;                           // sub-ticks of the last quadrilateral,
    CutPath piece[CUT_SUBTICKS_MOST][2]; // and the edge in each
    int *met_edge;                       // [edges of the finest level]
    int near_count, *near;               // [finest faces] faces within reach of the sweep
    CutFacePoints (*path)[2];            // [near_count] before and after
    unsigned char *odd;    // [edges of the finest level] parity, and whether it is in met_edge
    unsigned char *listed; // [finest faces] zero between calls
} CutFinder;

// Whether the link across an edge with two listed faces is broken.
static inline bool cut_find_is_broken(const Level *level, const CutTissue *tissue, int edge)
{
    int face = level->edge_face[edge][0], k = 0;
    while (level->face_edge[face][k] != edge)
        k++;
    return tissue->broken[face] >> k & 1;
}

// Load time. Keeps `level` (the finest one) by reference; `origin` [m] any constant point near the
// body, `h` the mean edge of that level at rest [m]. Arrays belong to the arena, named "name/...".
void cut_find_create(CutFinder *finder, const Level *level, Vec3 origin, double h, const char *name,
                     Arena *arena);
// Load time, once: memory for strokes of so many blades, added to the state.
void cut_find_reserve_blades(CutFinder *finder, int blades, const char *name, Arena *arena,
                             StateList *state);
// After the state was overwritten: whether all numbers of the memory are in range.
bool cut_find_check(const CutFinder *finder);

// One command: the blade passes through still tissue over edge[0] .. edge[edges - 1], edges >= 2,
// all of it one batch (a last edge equal to the first closes the loop). CUT_DONE: finder->edge
// breaks; CUT_MET_NOTHING, CUT_WAS_CUT, CUT_TOO_TWISTED, CUT_TOO_LARGE, CUT_UNRESOLVED: nothing
// does.
CutVerdict cut_find_whole(CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge,
                          int edges);
// A tick of a stroke, by sweep->phase: CUT_BEGINS remembers where links and edge are and finds
// nothing; CUT_GOES_ON finds what the edge met since the last call while both moved in straight
// lines, and remembers; CUT_ENDS forgets. Call it in every tick of the stroke, also when no face is
// near. sweep->before is only read when nothing was remembered: the edge goes on from where the
// last call left it, bit by bit.
CutVerdict cut_find_tick(CutFinder *finder, const CutTissue *tissue, const CutSweep *sweep);

// For cut_snap: how often the last command, given again, meets the half link between two places
// [m]; CUT_DEGENERATE: not known.
int cut_find_half(const CutFinder *finder, const BladeEdge *edge, int edges, Vec3 centroid,
                  Vec3 middle);
// For cut_smooth: of the edges in met_edge[met] keeps those whose parity in `odd` (bit 0) is odd,
// and of them the unbroken ones in `edge`; clears `odd`.
CutVerdict cut_find_keep_odd(CutFinder *finder, const CutTissue *tissue);

#endif
