// SPDX-License-Identifier: MIT
// Hinges of a body with levels: at every unbroken edge between two leaves, and, where one side is
// finer, at each half of the coarse leaf's edge (README.md, "Bending across levels"). A window owns
// those of its slots, so that a change packs only the windows that it touches. Step thread, when
// the topology changes; detail_bend_create at load.
#include "surface/detail/detail.h"

#include "base/check.h"
#include "surface/bending.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// The hinges of a node

// Returns the corner of a face that is neither of two others.
static int third_corner(const int corner[3], int a, int b)
{
    return corner[0] + corner[1] + corner[2] - a - b;
}

// Finds the hinge at the edge of a leaf that leaves the node `leaf->corner` counter-clockwise: the
// node, the other end, the third nodes of the left and of the right face. False if there is none,
// or if the other end owns it.
static bool find_hinge(const SurfaceModel *model, const Leaf *leaf, int node[4])
{
    const LeafSet *set = &model->detail->set;
    const Level *at = &set->levels.level[leaf->level];
    const int *corner = at->face[leaf->face];
    const int k = leaf->corner, edge = at->face_edge[leaf->face][k];
    const int across = levels_beyond(at, edge, leaf->face);
    if (across < 0 || detail_is_broken(set, leaf->level, leaf->face, k))
        return false;
    node[0] = corner[k];
    node[1] = corner[(k + 1) % 3];
    node[2] = corner[(k + 2) % 3];
    // A leaf of the same level: the end with the lower slot owns the hinge.
    if (detail_is_leaf(set, leaf->level, across)) {
        node[3] = third_corner(at->face[across], node[0], node[1]);
        return model->slot[node[0]] < model->slot[node[1]];
    }
    // A finer side: this is the half up to the midpoint, and the child at this node the face.
    if (detail_is_refined(set, leaf->level, across)) {
        const Level *fine = &set->levels.level[leaf->level + 1];
        const int *whole = at->face[across];
        const int q = whole[0] == node[0] ? 0 : whole[1] == node[0] ? 1 : 2;
        node[1] = at->node_count + edge;
        node[3] = third_corner(fine->face[4 * across + q], node[0], node[1]);
        return true;
    }
    // A coarser side: the edge is half of its edge, and the end that is not the midpoint owns it.
    const Level *coarse = &set->levels.level[leaf->level - 1];
    if (node[0] >= coarse->node_count)
        return false;
    const int *end = coarse->edge[node[1] - coarse->node_count];
    node[3] = third_corner(coarse->face[across / 4], end[0], end[1]);
    return true;
}

// Lists the hinges that a node owns, in the order of the leaves around it; returns their number.
static int list_hinges(const SurfaceModel *model, int node, int (*slot)[4])
{
    const LeafSet *set = &model->detail->set;
    Leaf *leaf = set->ring[0];
    int leaves = detail_leaves_around(set, node, leaf), count = 0;
    for (int i = 0; i < leaves; i++) {
        int hinge[4];
        if (!find_hinge(model, &leaf[i], hinge))
            continue;
        for (int k = 0; k < 4; k++)
            slot[count][k] = model->slot[hinge[k]];
        count++;
    }
    return count;
}

// ---------------------------------------------------------------------------------------------
// Windows

void detail_bend_create(SurfaceModel *model, double stiffness, const char *name, Arena *arena)
{
    const Detail *detail = model->detail;
    const DetailPack *pack = &detail->pack;
    // A node owns at most one hinge for each leaf around it.
    int groups = 0, largest = 0;
    int *start = ALLOCATE(ARENA_TOPOLOGY, pack->window_count + 1, int, "first hinges");
    for (int w = 0; w < pack->window_count; w++) {
        int most = 0;
        for (int s = w * pack->width; s < (w + 1) * pack->width; s++)
            if (pack->of_slot[s] >= 0)
                most += detail_most_leaves(&detail->set, pack->of_slot[s]);
        start[w] = groups;
        groups += (most + LANES - 1) / LANES;
        largest = most > largest ? most : largest;
    }
    start[pack->window_count] = groups;
    Bending *bending = bending_allocate(model, groups, stiffness, name, arena);
    bending->window_start = start;
    bending->window_hinges = ALLOCATE(ARENA_TOPOLOGY, pack->window_count, int, "hinges of windows");
    bending->first = ALLOCATE(ARENA_TOPOLOGY, model->basis.count, int, "hinges of slots");
    bending->count = ALLOCATE(ARENA_TOPOLOGY, model->basis.count, int, "hinge counts");
    bending->scratch = ALLOCATE(ARENA_TOPOLOGY, largest + 1, *bending->scratch, "hinges found");
    bending->force = detail->lists.handed;
    for (int l = 0; l <= detail->set.levels.finest; l++)
        bending->lambda[l] = bending_level_bound(&detail->rules, l, stiffness, detail->fixed);
    model->bending = bending;
}

void detail_bend_pack(SurfaceModel *model, int w)
{
    const Detail *detail = model->detail;
    const DetailPack *pack = &detail->pack;
    Bending *bending = model->bending;
    const int first = bending->window_start[w], old_count = bending->window_hinges[w];
    int count = 0;
    for (int s = w * pack->width; s < (w + 1) * pack->width; s++) {
        const int node = pack->of_slot[s], old = bending->first[s],
                  old_end = old + bending->count[s];
        bending->first[s] = count;
        if (node >= 0 && detail->set.status[node] != NODE_OFF) {
            if (pack->is_dirty[node])
                count += list_hinges(model, node, bending->scratch + count);
            // Those of an unchanged node are read back, which is cheaper than finding them.
            for (int i = old; i < old_end && !pack->is_dirty[node]; i++, count++) {
                const int *slot = bending_slots(bending, first, old_count, i);
                for (int k = 0; k < 4; k++)
                    bending->scratch[count][k] = slot[k * LANES];
            }
        }
        bending->count[s] = count - bending->first[s];
    }
    bending_put(model, bending, first, (const int(*)[4])bending->scratch, count);
    bending->window_hinges[w] = count;
}

void detail_bend_list(SurfaceModel *model)
{
    const Detail *detail = model->detail;
    Bending *bending = model->bending;
    bending->group_count = bending->hinge_count = 0;
    for (int w = 0; w < detail->pack.window_count; w++) {
        for (int k = 0; k < bending->window_hinges[w]; k += LANES)
            bending->group[bending->group_count++] = bending->window_start[w] + k / LANES;
        bending->hinge_count += bending->window_hinges[w];
    }
    // Forces of hinges come to all chunks in the rows of those that hanging nodes hand over.
    for (int k = 0; k < detail->lists.free_chunk_count; k++)
        detail->lists.carries[detail->lists.free_chunk[k]] = 1;
}
