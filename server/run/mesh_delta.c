#include "run/mesh_delta.h"

#include "run/pace.h"

#include <string.h>

static bool node_differs(const BodyMesh *before, const BodyMesh *after, int i)
{
    int id = i < before->node_count ? before->id[i] : -1;
    if (id != after->id[i] || id < 0)
        return id != after->id[i];
    return before->origin[i] != after->origin[i] || before->parent[i][0] != after->parent[i][0] ||
           before->parent[i][1] != after->parent[i][1] || before->piece[i] != after->piece[i] ||
           before->level[i] != after->level[i];
}

static bool triangle_differs(const BodyMesh *before, const BodyMesh *after, int t)
{
    static const int free_slot[3] = {0, 0, 0};
    const int *old = t < before->triangle_count ? before->triangle[t] : free_slot;
    return memcmp(old, after->triangle[t], sizeof free_slot) != 0;
}

void mesh_delta_find(MeshDelta *delta, const BodyMesh *before, const BodyMesh *after)
{
    delta->from_topology = before->topology;
    delta->node_count = delta->triangle_count = 0;
    for (int i = 0; i < after->node_count; i++)
        if (node_differs(before, after, i))
            delta->node[delta->node_count++] = i;
    for (int t = 0; t < after->triangle_count; t++)
        if (triangle_differs(before, after, t))
            delta->triangle[delta->triangle_count++] = t;
}

int mesh_delta_chunks(const MeshDelta *delta)
{
    int by_nodes = chunks_of(delta->node_count, DELTA_NODES_IN_CHUNK);
    int by_triangles = chunks_of(delta->triangle_count, DELTA_TRIANGLES_IN_CHUNK);
    return by_nodes > by_triangles ? by_nodes : by_triangles;
}

pliant_mesh_delta_t mesh_delta_chunk(const MeshDelta *delta, const BodyMesh *after, int chunk,
                                     MeshDeltaChunk *memory)
{
    // This chunk's share of the changed triangles and nodes, gathered into the message's arrays.
    int count = mesh_delta_chunks(delta);
    int triangle = chunk_begin(delta->triangle_count, chunk, count);
    int node = chunk_begin(delta->node_count, chunk, count);
    int triangles = chunk_begin(delta->triangle_count, chunk + 1, count) - triangle;
    int nodes = chunk_begin(delta->node_count, chunk + 1, count) - node;
    for (int k = 0; k < triangles; k++) {
        int slot = memory->triangle_slot[k] = delta->triangle[triangle + k];
        memcpy(memory->triangle + 3 * k, after->triangle[slot], sizeof *after->triangle);
    }
    for (int k = 0; k < nodes; k++) {
        int slot = memory->node_slot[k] = delta->node[node + k];
        memory->id[k] = after->id[slot];
        memory->origin[k] = after->origin[slot];
        memcpy(memory->parent + 2 * k, after->parent[slot], sizeof *after->parent);
        memory->piece[k] = after->piece[slot];
        memory->level[k] = after->level[slot];
    }
    return (pliant_mesh_delta_t){.from_topology = delta->from_topology,
                                 .topology = after->topology,
                                 .node_count = after->node_count,
                                 .triangle_count = after->triangle_count,
                                 .chunk = chunk,
                                 .chunk_count = count,
                                 .num_triangles = triangles,
                                 .num_indices = 3 * triangles,
                                 .triangle_slot = memory->triangle_slot,
                                 .triangle = memory->triangle,
                                 .num_nodes = nodes,
                                 .num_parents = 2 * nodes,
                                 .node_slot = memory->node_slot,
                                 .id = memory->id,
                                 .origin = memory->origin,
                                 .parent = memory->parent,
                                 .piece = memory->piece,
                                 .level = memory->level};
}
