// The mesh of a surface body as clients see it: ids, parents, pieces and levels of its nodes. Load
// time only.
#include "surface/model.h"

#include "base/sets.h"

#include <string.h>

// Labels the piece of each node: connected parts of the mesh, numbered by their lowest node.
void model_label_pieces(const TriMesh *mesh, int *piece)
{
    union_find_reset(piece, mesh->node_count);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int c = 1; c < 3; c++)
            union_find_join(piece, mesh->triangle[t][0], mesh->triangle[t][c]);
    union_find_number(piece, mesh->node_count);
}

void model_create_mesh(SurfaceModel *model, Body *body, const TriMesh *mesh,
                       const SurfaceOptions *options, Arena *arena)
{
    const char *name = options->body.name;
    int nodes = mesh->node_count, faces = mesh->triangle_count;
    int *id = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node ids");
    int(*parents)[2] = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)nodes, sizeof *parents,
                                      "%s/node parents", name);
    int *piece = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node pieces");
    signed char *level = ALLOCATE(ARENA_TOPOLOGY, nodes, signed char, "node levels");
    const Levels *levels = options->hierarchy;
    int file_nodes = levels != NULL ? levels->level[0].node_count : nodes;
    // Nodes of the file are their own parents; midpoints have the two ends of their edge.
    for (int i = 0; i < nodes; i++) {
        int parent[2] = {i, i};
        if (i >= file_nodes)
            levels_parents(levels, i, parent);
        id[i] = mesh->file_index[i];
        for (int k = 0; k < 2; k++)
            parents[i][k] = mesh->file_index[parent[k]];
        level[i] = (signed char)(levels != NULL ? levels_of_node(levels, i) : 0);
    }
    const int *origin = id;
    // Copies that the repair made have the origin of the node from which they were split.
    if (mesh->copy_count > 0) {
        int *row = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node origins");
        memcpy(row, id, (size_t)nodes * sizeof *row);
        for (int i = file_nodes - mesh->copy_count; i < file_nodes; i++)
            row[i] = mesh->file_index[mesh_node_of_file(mesh, mesh_file_row(mesh, i))];
        origin = row;
    }
    model_label_pieces(mesh, piece);
    body->state_capacity = nodes;
    body->mesh = (BodyMesh){
        .topology = 1,
        .node_count = nodes,
        .triangle_count = faces,
        .node_capacity = nodes,
        .triangle_capacity = faces,
        .triangle = body->surface.face,
        .id = id,
        .origin = origin,
        .parent = (const int(*)[2])parents,
        .piece = piece,
        .level = level,
    };
    model->piece = piece;
    model->shown = (SurfaceShown){.row = model->slot, .id = id, .count = nodes};
}
