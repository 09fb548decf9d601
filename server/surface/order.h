// The order of nodes in memory: breadth first, then by valence within windows (performance.md).
#ifndef PLIANT_SURFACE_ORDER_H
#define PLIANT_SURFACE_ORDER_H

#include "geometry/winged_edge.h"

// Fills slot[node] with a permutation of 0 .. node_count - 1: neighbours close in memory, and
// chunks of consecutive slots alike in valence. A pure function of the mesh.
void order_nodes(const WingedMesh *winged, int *slot);

#endif
