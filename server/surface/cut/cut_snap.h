// SPDX-License-Identifier: MIT
// Moves the vertices of a fresh cut onto the blade's path, as far as the mesh allows (README.md,
// "Snapping"): at most 0.2 h along the blade's normal projected into the surface, at rest. The move
// is halved twice, then dropped, while an angle of an adjacent face at rest would fall below 0.75
// min(that face's smallest angle as built, 45 degrees). All copies of a vertex move alike, so that
// lips that coincide still do.
//
// A vertex moves only if all its links were intact before this cut: at most once in its life, so
// that the limits hold for any number of cuts. And only if all faces around it are listed: these
// must stay at the finest level from now on, so lock them. The distance to the blade is measured in
// the deformed surface and transferred to the rest shape through the triangle into which the vertex
// moves: the same fractions along its two edges, and the same distance out of it. So a body at rest
// stays at rest.
#ifndef PLIANT_SURFACE_CUT_CUT_SNAP_H
#define PLIANT_SURFACE_CUT_CUT_SNAP_H

#include "surface/cut/cut_smooth.h"

#define CUT_SNAP_MOST  0.2  // [h]
#define CUT_SNAP_GUARD 0.75 // of the smallest angle as built, or of 45 degrees if that is smaller
#define CUT_SNAP_FLOOR 0.7  // of the smallest angle as built

// How a vertex of the uncut finest mesh moves.
typedef struct CutSnap {
    int vertex;
    Vec3 rest; // added to its rest position [m]
    Vec3 move; // added to the deformed position of each of its copies [m]; velocities stay
} CutSnap;

typedef struct CutSnapInput {
    CutFinder *finder;       // result of cut_find_whole and cut_smooth: finder->edge
    const CutTissue *tissue; // as in that call: before the links were broken and nodes copied
    const BladeEdge *edge;   // the same command
    int edges;
    const Vec3 *built; // [vertices of the finest level] rest positions of the uncut mesh [m]
    const Vec3 *rest;  // [the same] current ones, after earlier snaps [m]
    const bool *fixed; // [the same] vertices that must not move; NULL: none
} CutSnapInput;

// Lists the vertices that move, each once, in the order in which finder->edge first names them;
// call it before the links are broken. `moved` must hold 2 * finder->count entries. Returns their
// number. `work`: [vertices of the finest level] scratch, zero before and after. The caller then
// adds the moves to its rest positions and rows, and recomputes the rest lengths of all edges at
// those vertices; rest areas, and so masses, stay as built.
int cut_snap(const CutSnapInput *input, int *work, CutSnap *moved);

#endif
