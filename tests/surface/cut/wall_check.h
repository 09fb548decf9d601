// SPDX-License-Identifier: MIT
// What must hold of a surface body that has been cut, re-derived from the published mesh alone, and
// of its locks and sums.
#ifndef PLIANT_TESTS_WALL_CHECK_H
#define PLIANT_TESTS_WALL_CHECK_H

#include "detail_bench.h"

// What the published triangles are, by node ids.
typedef struct WallShape {
    int nodes, edges, faces, pieces, borders, border_edges;
} WallShape;

// Fails the cmocka test unless: every edge lies in at most two triangles, of opposite directions;
// the triangles of each node are one fan joined by edges; border edges form closed chains that pass
// each node once; every live node is used; the published piece is the same within a connected part
// and differs between parts; V - E + F = 2 pieces - borders - 2 handles.
WallShape wall_expect_manifold(const BodyMesh *mesh, int handles);
// Fails the test unless the locks hold (server/surface/cut/README.md, "Levels and locks"): finest
// faces with a broken edge are leaves, coarser leaves have neither broken edges nor copies anywhere
// inside or on their border.
void wall_expect_locked(const DetailBench *bench);
// Sum of the stiffness of all springs [N/m], and what the leaves' own shares at their present rest
// places sum up to.
double wall_stiffness(const DetailBench *bench);
double wall_expected_stiffness(const DetailBench *bench);

#endif
