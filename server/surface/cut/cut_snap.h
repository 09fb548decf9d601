// Moves the vertices of a fresh cut onto the blade's way, as far as the mesh bears it: at most 0.2
// h along the blade's normal projected into the surface, at rest; halved twice, then dropped, while
// an angle of an adjacent face at rest would fall below 0.75 min(that face's smallest angle as
// built, 45 degrees). All copies of a vertex move alike, so lips that lay on each other still do.
//
// Only vertices whose links all were whole before this cut move: each at most once in its life, so
// limits hold for any number of cuts. And only those with nothing but listed faces around: these
// must stay at the finest level from now on, so lock them. The distance to the blade is measured in
// the deformed surface and goes to the rest shape through the triangle into which the vertex moves:
// the same share of the way along its two edges.
#ifndef PLIANT_SURFACE_CUT_CUT_SNAP_H
#define PLIANT_SURFACE_CUT_CUT_SNAP_H

#include "surface/cut/cut_smooth.h"

#define CUT_SNAP_MOST  0.2  // [h]
#define CUT_SNAP_GUARD 0.75 // of the smallest angle as built, or of 45 degrees if that is less
#define CUT_SNAP_FLOOR 0.7  // of the smallest angle as built

// What becomes of a vertex of the uncut finest mesh.
typedef struct CutSnap {
    int vertex;
    Vec3 rest; // add to its rest position [m]
    Vec3 move; // add to the deformed position of each of its copies [m]; velocities stay
} CutSnap;

typedef struct CutSnapInput {
    CutFinder *finder;       // what cut_find_whole and cut_smooth found: finder->edge
    const CutTissue *tissue; // as then: before the links were broken and nodes copied
    const BladeEdge *edge;   // the same command
    int edges;
    const Vec3 *built; // [vertices of the finest level] rest positions of the uncut mesh [m]
    const Vec3 *rest;  // [the same] present ones, after earlier snaps [m]
    const bool *fixed; // [the same] those that must not move; NULL: none
} CutSnapInput;

// Before the caller breaks the links: which vertices move, each once, in the order in which
// finder->edge first names them; `moved` must hold 2 * finder->count entries. Returns how many.
// `work`: [vertices of the finest level] scratch, zero before and after. The caller then adds the
// moves to its rest positions and rows, and derives the rest lengths of all edges at those vertices
// anew; rest areas, and so masses, stay as built.
int cut_snap(const CutSnapInput *input, int *work, CutSnap *moved);

#endif
