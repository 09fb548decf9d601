// The order of nodes in memory: breadth first, then by valence within windows
// (server/PERFORMANCE.md, "Rows and order").
#ifndef PLIANT_SURFACE_ORDER_H
#define PLIANT_SURFACE_ORDER_H

#include "geometry/winged_edge.h"

// Fills slot[node] with a permutation of 0 .. node_count - 1 that puts neighbours close in memory
// and nodes of equal valence into one chunk. A pure function of the mesh.
void order_nodes(const WingedMesh *winged, int *slot);

#endif
