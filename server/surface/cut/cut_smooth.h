// SPDX-License-Identifier: MIT
// Smooths the path of a cut command before its links break (README.md, "Smoothing"). The path
// follows edges of the mesh; where it goes around a face along two or three of its edges although
// it could take the others, the face changes sides. This adds the border of a face to the set of
// met links, so that the set still separates what it separated (every closed loop of links keeps
// its parity); it removes teeth and chips of single faces.
//
// All met links take part, including those that were broken before, and sides that are already
// broken cost nothing: a repeated command ends with the same path and breaks nothing.
#ifndef PLIANT_SURFACE_CUT_CUT_SMOOTH_H
#define PLIANT_SURFACE_CUT_CUT_SMOOTH_H

#include "surface/cut/cut_find.h"

enum { CUT_SMOOTH_PASSES = 6 };
#define CUT_SMOOTH_WEIGHT 4.0

// Returns the distance of a point to the blade's path over edge[0] .. edge[edges - 1], as triangles
// [m].
double cut_sweep_distance(const BladeEdge *edge, int edges, Vec3 point);

// Changes finder->edge and count after cut_find_whole with the same arguments returned CUT_DONE. A
// face changes sides while this lowers the sum of |e| (1 + weight ((d_a + d_b) / h)^2) over its
// edges e on the path, with d the distances of the edge's ends to the sweep, both deformed; faces
// in index order. Returns CUT_DONE, CUT_WAS_CUT, or CUT_MET_NOTHING if all of it was a chip.
CutVerdict cut_smooth(CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge, int edges);

#endif
