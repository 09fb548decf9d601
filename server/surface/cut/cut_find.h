// SPDX-License-Identifier: MIT
// Finds the links of a triangle surface that a blade breaks (README.md, "Links"). A link joins two
// faces of the finest level across an edge: the bent line from the centroid of one over the middle
// of the edge to the centroid of the other, which stays in the surface; a shallow blade would miss
// a straight chord. Each half, centroid to middle, is offered to the finder of body/cut.h; the
// counts of both, in all quadrilaterals of a command, add up.
//
// Pure except for the memory of strokes: the body is not changed. Step thread; does not allocate
// after creation.
#ifndef PLIANT_SURFACE_CUT_CUT_FIND_H
#define PLIANT_SURFACE_CUT_CUT_FIND_H

#include "base/memory.h"
#include "body/cut.h"
#include "geometry/levels.h"

#define CUT_FIND_UNITS     2048.0 // h / q: units of the integer points per mean finest edge
#define CUT_FIND_TOLERANCE 0.05   // [h] deviation of a sub-sweep's triangles from a twisted patch
// [h] around a stroke's sweep within which a body remembers its links. A face that becomes a leaf
// inside this range, or enters it, in the tick in which it is met, is treated as at rest during
// that tick. So refine at least this far ahead, by CUT_FIND_MARGIN * finder->h.
#define CUT_FIND_MARGIN 4.0

// The tissue that the finder reads, filled by the caller for each call.
typedef struct CutTissue {
    const int *face; // [face_count] finest faces that may be cut, ascending: those that are leaves.
    int face_count;  // A link is tested when both its faces are listed.
    const int (*corner)[3];      // [finest faces] node of each corner; read of listed faces only
    const Vec3 *position;        // [nodes] deformed, world [m]; read at those corners only
    const unsigned char *broken; // [finest faces] bit k: the link across side k, the edge of
                                 // corners k and k + 1, is broken; on both faces of the edge
} CutTissue;

// The end points of a face's half links: its centroid, and the middles of its sides.
typedef struct CutFacePoints {
    CutPoint centroid, middle[3];
} CutFacePoints;

// Positions of the links around a blade in the last tick of its stroke; part of the state.
typedef struct CutMemory {
    uint64_t *clock;       // {calls so far, calls in this stroke}
    CutPoint *edge;        // [2] the blade's edge, with the shift of that call
    int64_t *tries;        // shift in use
    uint64_t *seen;        // [finest faces] call in which `points` was written
    CutFacePoints *points; // [finest faces]
} CutMemory;

typedef struct CutFinder {
    // --- constant ---
    const Level *level; // finest
    double h;           // mean edge of the finest level at rest [m]
    int blades;
    CutMemory *memory; // [blades]
    // --- results of the last call ---
    LinkFinder links; // its links are the edges of the finest level; met ones may be broken already
    int count;        // links that break now, each once
    int *edge;        // [edges of the finest level] by edge, in (face, side) order
    // --- scratch ---
    int near_count, *near;    // [finest faces] faces near the sweep
    CutFacePoints (*path)[2]; // [near_count] before and after
    unsigned char *listed;    // [finest faces] zero between calls
} CutFinder;

// Returns the side of a face that an edge is.
static inline int cut_side_of(const Level *level, int face, int edge)
{
    int k = 0;
    while (level->face_edge[face][k] != edge)
        k++;
    return k;
}

// Returns corner k of a face in the uncut mesh: a body may write copies into the level's table of
// corners, but edges keep their ends, and side k begins at corner k.
static inline int cut_vertex_at(const Level *level, int face, int k)
{
    const int e = level->face_edge[face][k];
    return level->edge[e][level->edge_face[e][0] != face];
}

// True if the link across an edge with two listed faces is broken.
static inline bool cut_find_is_broken(const Level *level, const CutTissue *tissue, int edge)
{
    const int face = level->edge_face[edge][0];
    return tissue->broken[face] >> cut_side_of(level, face, edge) & 1;
}

// Load time. Keeps `level` (the finest one) by reference; `origin` [m]: any constant point near the
// body; `h`: mean edge length of that level at rest [m]. The arena owns the arrays, named
// "name/...".
void cut_find_create(CutFinder *finder, const Level *level, Vec3 origin, double h, const char *name,
                     Arena *arena);
// Load time, once: allocates the memory for strokes of this many blades and adds it to the state.
void cut_find_reserve_blades(CutFinder *finder, int blades, const char *name, Arena *arena,
                             StateList *state);
// After the state was overwritten: true if all numbers of the memory are in range.
bool cut_find_check(const CutFinder *finder);

// Handles one command: the blade passes through still tissue over edge[0] .. edge[edges - 1], edges
// >= 2, as one batch (a last edge equal to the first closes the loop). CUT_DONE: finder->edge
// breaks. CUT_MET_NOTHING, CUT_WAS_CUT, CUT_TOO_TWISTED, CUT_TOO_LARGE, CUT_UNRESOLVED: nothing
// breaks.
CutVerdict cut_find_whole(CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge,
                          int edges);
// Handles one tick of a stroke, by sweep->phase: CUT_BEGINS stores where links and edge are and
// finds nothing; CUT_GOES_ON finds what the edge met since the last call while both moved in
// straight lines, and stores; CUT_ENDS forgets. Call it in every tick of the stroke, even when no
// face is near. sweep->before is only read when nothing was stored: the edge continues exactly from
// where the last call left it.
CutVerdict cut_find_tick(CutFinder *finder, const CutTissue *tissue, const CutSweep *sweep);

// Lists in `edge` the links met that are unbroken.
CutVerdict cut_find_unbroken(CutFinder *finder, const CutTissue *tissue);

#endif
