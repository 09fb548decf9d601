// SPDX-License-Identifier: MIT
// What tests ask of a winged-edge mesh beyond what the server does.
#ifndef PLIANT_TESTS_WINGED_H
#define PLIANT_TESTS_WINGED_H

#include "scoped.h"
#include "base/sets.h"
#include "geometry/edges.h"

#include <stdlib.h>

// Returns the edge between two nodes, or -1.
static inline int winged_find_edge(const WingedMesh *winged, int a, int b)
{
    int start = a < b ? a : b, end = a < b ? b : a;
    int low = 0, high = winged->edge_count; // the edge is in [low, high)
    while (low < high) {
        int middle = low + (high - low) / 2;
        const int *node = winged->edge[middle].node;
        if (node[0] == start && node[1] == end)
            return middle;
        if (node[0] < start || (node[0] == start && node[1] < end))
            low = middle + 1;
        else
            high = middle;
    }
    return -1;
}

// Counts the trees left after joining nodes along all edges, or only border nodes along border
// edges.
static inline int count_trees(const WingedMesh *winged, bool boundary_only)
{
    FREED int *parent = malloc(((size_t)winged->node_count + 1) * sizeof *parent);
    int trees = 0;
    union_find_reset(parent, winged->node_count);
    for (int i = 0; i < winged->node_count; i++)
        trees += !boundary_only || winged_is_boundary_node(winged, i);
    for (int e = 0; e < winged->edge_count; e++)
        if (!boundary_only || winged_is_boundary_edge(winged, e))
            trees -= union_find_join(parent, winged->edge[e].node[0], winged->edge[e].node[1]);
    return trees;
}

static inline int winged_boundary_loops(const WingedMesh *winged)
{
    // In a valid mesh a border node has exactly two border edges: each tree of them is one loop.
    return count_trees(winged, true);
}

static inline int winged_components(const WingedMesh *winged)
{
    return count_trees(winged, false);
}

// V - E + F.
static inline int winged_euler(const WingedMesh *winged)
{
    return winged->node_count - winged->edge_count + winged->face_count;
}

#endif
