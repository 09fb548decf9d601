// Smooths the path of a cut command before its links are broken. The path runs along edges of the
// mesh; where it goes round a face by two or three of its edges although it could take the rest of
// them, the face changes sides. That adds the border of a face to the set of met links, so that it
// still separates whatever it did (every closed loop of links keeps its parity), and it takes away
// teeth and chips of single faces.
//
// All links that were met take part, also those that were broken before, and sides that are broken
// already cost nothing: so a command that is repeated ends with the same path and breaks nothing.
#ifndef PLIANT_SURFACE_CUT_CUT_SMOOTH_H
#define PLIANT_SURFACE_CUT_CUT_SMOOTH_H

#include "surface/cut/cut_find.h"

enum { CUT_SMOOTH_PASSES = 6 };
#define CUT_SMOOTH_WEIGHT 4.0

// Distance of a point to the blade's way over edge[0] .. edge[edges - 1], as triangles [m].
double cut_sweep_distance(const BladeEdge *edge, int edges, Vec3 point);

// After cut_find_whole with the same arguments said CUT_DONE: changes finder->edge, count. A face
// changes sides while the sum of |e| (1 + weight ((d_a + d_b) / h)^2) over its edges e on the path
// falls, d the distance of the edge's ends to the sweep, both deformed; faces in index order. Gives
// what is left: CUT_DONE, CUT_WAS_CUT, or CUT_MET_NOTHING when all was a chip.
CutVerdict cut_smooth(CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge, int edges);

#endif
