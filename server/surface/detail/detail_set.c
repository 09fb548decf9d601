// Queries of the set of refined faces: which exist, which are leaves, which nodes hang.
#include "surface/detail/detail.h"

bool detail_is_refined(const Detail *detail, int level, int face)
{
    return level < detail->finest && detail->refined[detail->face_base[level] + face] != 0;
}

bool detail_exists(const Detail *detail, int level, int face)
{
    return level == 0 || detail_is_refined(detail, level - 1, face / 4);
}

bool detail_is_leaf(const Detail *detail, int level, int face)
{
    return detail_exists(detail, level, face) && !detail_is_refined(detail, level, face);
}

int detail_original(const Detail *detail, int node)
{
    if (detail->cut == NULL || node < detail->cut->base_count)
        return node;
    return detail->cut->origin[node - detail->cut->base_count];
}

const int *detail_uncut(const Detail *detail, int level, int face)
{
    return detail->cut != NULL && level == detail->finest ? detail->cut->base[face]
                                                          : detail->levels.level[level].face[face];
}

// Follows an existing face down to the leaf at the node's corner: child k keeps corner k.
static Leaf descend(const Detail *detail, int level, int face, int node)
{
    const int *corner = detail_uncut(detail, level, face);
    int k = corner[0] == node ? 0 : corner[1] == node ? 1 : 2;
    while (detail_is_refined(detail, level, face)) {
        face = 4 * face + k;
        level++;
    }
    return (Leaf){level, face, k};
}

static int leaves_around_original(const Detail *detail, int node, Leaf *leaf)
{
    const Levels *levels = &detail->levels;
    int count = 0, born = levels_of_node(levels, node);
    if (born == 0) {
        for (int k = detail->root_ring_start[node]; k < detail->root_ring_start[node + 1]; k++)
            leaf[count++] = descend(detail, 0, detail->root_ring[k], node);
        return count;
    }
    // A midpoint belongs to three children of each face at its edge.
    const Level *above = &levels->level[born - 1];
    int edge = node - above->node_count;
    for (int side = 0; side < 2; side++) {
        int face = above->edge_face[edge][side];
        if (face < 0 || !detail_is_refined(detail, born - 1, face))
            continue;
        const int *edges = above->face_edge[face];
        int k = edges[0] == edge ? 0 : edges[1] == edge ? 1 : 2;
        leaf[count++] = descend(detail, born, 4 * face + k, node);
        leaf[count++] = descend(detail, born, 4 * face + (k + 1) % 3, node);
        leaf[count++] = descend(detail, born, 4 * face + 3, node);
    }
    return count;
}

int detail_leaves_around(const Detail *detail, int node, Leaf *leaf)
{
    int count = leaves_around_original(detail, detail_original(detail, node), leaf), kept = 0;
    if (detail->cut == NULL)
        return count;
    for (int i = 0; i < count; i++) // each copy of a node has its own leaves
        if (detail->levels.level[leaf[i].level].face[leaf[i].face][leaf[i].corner] == node)
            leaf[kept++] = leaf[i];
    return kept;
}

int detail_midpoint(const Detail *detail, int level, int edge)
{
    if (level == detail->finest)
        return -1;
    int node = detail->levels.level[level].node_count + edge;
    return detail->status[node] != NODE_OFF ? node : -1;
}

NodeStatus detail_status_of_midpoint(const Detail *detail, int level, int edge)
{
    int refined = 0, sides = 0;
    for (int side = 0; side < 2; side++) {
        int face = detail->levels.level[level].edge_face[edge][side];
        sides += face >= 0;
        refined += face >= 0 && detail_is_refined(detail, level, face);
    }
    if (refined == 0)
        return NODE_OFF;
    return refined < sides && detail->constrained ? NODE_HANGING : NODE_FREE;
}

int detail_place(const Detail *detail, int level, int face)
{
    return face << (2 * (detail->finest - level));
}
