// Queries of the set of refined faces: which exist, which are leaves, which nodes hang.
#include "surface/detail/detail_cut.h"

bool detail_is_refined(const LeafSet *set, int level, int face)
{
    return level < set->levels.finest && set->refined[set->face_base[level] + face] != 0;
}

bool detail_exists(const LeafSet *set, int level, int face)
{
    return level == 0 || detail_is_refined(set, level - 1, face / 4);
}

bool detail_is_leaf(const LeafSet *set, int level, int face)
{
    return detail_exists(set, level, face) && !detail_is_refined(set, level, face);
}

int detail_original(const LeafSet *set, int node)
{
    if (set->cut == NULL || node < set->cut->base_count)
        return node;
    return set->cut->origin[node - set->cut->base_count];
}

const int *detail_uncut(const LeafSet *set, int level, int face)
{
    return set->cut != NULL && level == set->levels.finest ? set->cut->base[face]
                                                           : set->levels.level[level].face[face];
}

// Follows an existing face down to the leaf at the node's corner: child k keeps corner k.
static Leaf descend(const LeafSet *set, int level, int face, int node)
{
    const int *corner = detail_uncut(set, level, face);
    int k = corner[0] == node ? 0 : corner[1] == node ? 1 : 2;
    while (detail_is_refined(set, level, face)) {
        face = 4 * face + k;
        level++;
    }
    return (Leaf){level, face, k};
}

static int leaves_around_original(const LeafSet *set, int node, Leaf *leaf)
{
    const Levels *levels = &set->levels;
    int count = 0, born = levels_of_node(levels, node);
    if (born == 0) {
        for (int k = set->root_ring_start[node]; k < set->root_ring_start[node + 1]; k++)
            leaf[count++] = descend(set, 0, set->root_ring[k], node);
        return count;
    }
    // A midpoint belongs to three children of each face at its edge.
    const Level *above = &levels->level[born - 1];
    int edge = node - above->node_count;
    for (int side = 0; side < 2; side++) {
        int face = above->edge_face[edge][side];
        if (face < 0 || !detail_is_refined(set, born - 1, face))
            continue;
        const int *edges = above->face_edge[face];
        int k = edges[0] == edge ? 0 : edges[1] == edge ? 1 : 2;
        leaf[count++] = descend(set, born, 4 * face + k, node);
        leaf[count++] = descend(set, born, 4 * face + (k + 1) % 3, node);
        leaf[count++] = descend(set, born, 4 * face + 3, node);
    }
    return count;
}

int detail_leaves_around(const LeafSet *set, int node, Leaf *leaf)
{
    int count = leaves_around_original(set, detail_original(set, node), leaf), kept = 0;
    if (set->cut == NULL)
        return count;
    for (int i = 0; i < count; i++) // each copy of a node has its own leaves
        if (set->levels.level[leaf[i].level].face[leaf[i].face][leaf[i].corner] == node)
            leaf[kept++] = leaf[i];
    return kept;
}

int detail_midpoint(const LeafSet *set, int level, int edge)
{
    if (level == set->levels.finest)
        return -1;
    int node = set->levels.level[level].node_count + edge;
    return set->status[node] != NODE_OFF ? node : -1;
}

NodeStatus detail_status_of_midpoint(const LeafSet *set, int level, int edge)
{
    int refined = 0, sides = 0;
    for (int side = 0; side < 2; side++) {
        int face = set->levels.level[level].edge_face[edge][side];
        sides += face >= 0;
        refined += face >= 0 && detail_is_refined(set, level, face);
    }
    if (refined == 0)
        return NODE_OFF;
    return refined < sides && set->constrained ? NODE_HANGING : NODE_FREE;
}

int detail_place(const LeafSet *set, int level, int face)
{
    return face << (2 * (set->levels.finest - level));
}

int detail_most_leaves(const LeafSet *set, int node)
{
    enum { AROUND_MIDPOINT = 6 };
    if (set->cut != NULL && node >= set->cut->base_count)
        return set->cut->most_around;
    return node < set->levels.level[0].node_count
               ? set->root_ring_start[node + 1] - set->root_ring_start[node]
               : AROUND_MIDPOINT;
}
