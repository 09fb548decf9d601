// SPDX-License-Identifier: MIT
#include "patch.h"

#include "base/check.h"

Body *patch_body(World *world)
{
    return sim_body(world->sim, 0);
}

const Detail *patch_detail(World *world)
{
    return ((const SurfaceModel *)patch_body(world)->model)->detail;
}

// Leaves around a node: at most these at three levels of meshes with some eight faces a node.
enum { LEAVES_MOST = 64 };

void patch_refine_around(World *world, const int *node, int count, int level)
{
    const Detail *detail = patch_detail(world);
    SurfaceModel *model = patch_body(world)->model;
    for (int l = 0; l < level; l++) {
        detail_begin_change(model);
        for (int i = 0; i < count; i++) {
            Leaf leaf[LEAVES_MOST];
            int leaves = detail_leaves_around(&detail->set, node[i], leaf);
            ASSERT(leaves <= LEAVES_MOST);
            for (int k = 0; k < leaves; k++)
                if (leaf[k].level <= l && detail_is_leaf(&detail->set, leaf[k].level, leaf[k].face))
                    ASSERT(detail_refine(model, leaf[k].level, leaf[k].face));
        }
        detail_end_change(patch_body(world));
    }
}

void patch_clear(World *world)
{
    const Detail *detail = patch_detail(world);
    SurfaceModel *model = patch_body(world)->model;
    for (int l = detail->set.levels.finest - 1; l >= 0; l--) {
        detail_begin_change(model);
        for (int f = 0; f < detail->set.levels.level[l].face_count; f++)
            if (detail_is_refined(&detail->set, l, f))
                detail_coarsen(model, l, f);
        detail_end_change(patch_body(world));
    }
}

int patch_node_count(World *world)
{
    return patch_detail(world)->set.levels.level[0].node_count;
}

int patch_valence(World *world, int node)
{
    const int *start = patch_detail(world)->set.root_ring_start;
    return start[node + 1] - start[node];
}

void patch_refine_two_faces(World *world, int node)
{
    const Detail *detail = patch_detail(world);
    const Level *roots = &detail->set.levels.level[0];
    const int *ring = &detail->set.root_ring[detail->set.root_ring_start[node]];
    int beside = -1;
    for (int k = 1; k < patch_valence(world, node); k++)
        for (int e = 0; e < 9; e++)
            if (roots->face_edge[ring[0]][e / 3] == roots->face_edge[ring[k]][e % 3])
                beside = ring[k];
    ASSERT(beside >= 0);
    detail_begin_change(patch_body(world)->model);
    ASSERT(detail_refine(patch_body(world)->model, 0, ring[0]));
    ASSERT(detail_refine(patch_body(world)->model, 0, beside));
    detail_end_change(patch_body(world));
}

bool patch_find_pair(World *world, int pair[2])
{
    const Detail *detail = patch_detail(world);
    const Level *roots = &detail->set.levels.level[0];
    for (int e = 0; e < roots->edge_count; e++) {
        const int a = roots->edge[e][0], b = roots->edge[e][1];
        if (patch_valence(world, a) != 6 || patch_valence(world, b) != 6)
            continue;
        pair[0] = a, pair[1] = b;
        return true;
    }
    return false;
}
