// SPDX-License-Identifier: MIT
// What a surface body keeps of its mesh: the faces that tools touch, the nodes as clients see them,
// and their order in memory. Load time only.
#include "surface/model.h"

#include "base/check.h"
#include "base/sets.h"

#include <stdlib.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// Faces

// Returns a copy of an array that is freed after creation.
static void *keep(const void *array, size_t size, size_t count, const char *name, const char *label,
                  Arena *arena)
{
    void *copy = arena_allocate(arena, ARENA_TOPOLOGY, count, size, "%s/%s", name, label);
    return memcpy(copy, array, count * size);
}
#define KEEP(array, count, label) keep(array, sizeof *(array), (size_t)(count), name, label, arena)

void model_create_surface(Body *body, const TriMesh *mesh, const WingedMesh *winged,
                          const SpringNetwork *network, const char *name, Arena *arena)
{
    const int nodes = mesh->node_count, faces = mesh->triangle_count;
    body->surface = (BodySurface){
        .node_count = nodes,
        .face_count = faces,
        .node_used = nodes,
        .face_used = faces,
        .face = KEEP(mesh->triangle, faces, "faces"),
        .face_neighbor = KEEP(winged->face_neighbor, faces, "face neighbours"),
        .face_area = KEEP(network->face_area, faces, "face areas"),
        .node_area = KEEP(network->node_area, nodes, "node areas"),
        .node_face_start = KEEP(winged->node_face_start, nodes + 1, "node face start"),
        .node_face = KEEP(winged->node_face, 3 * faces, "node faces"),
    };
    // No face is ever divided here: these are the least areas, too.
    body->surface.finest_area = body->surface.face_area;
    body->surface.node_face_end = body->surface.node_face_start + 1;
}

// ---------------------------------------------------------------------------------------------
// Nodes as clients see them: ids, parents, pieces and levels

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
    // What clients get of each node.
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
    // Nothing of it changes: capacities are counts.
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

// ---------------------------------------------------------------------------------------------
// The order of nodes in memory

enum {
    WINDOW = 256,     // sorting by valence moves a node at most this far: 16 kB of rows
    MAX_VALENCE = 32, // larger valences are sorted as one
};

// Orders breadth first from the lowest node of each component, neighbours counter-clockwise: the
// oriented Cuthill-McKee order, whose fronts run around the body.
static void breadth_first(const WingedMesh *winged, int *order)
{
    bool *seen = calloc((size_t)winged->node_count + 1, sizeof *seen);
    ASSERT(seen != NULL);
    int read = 0, written = 0;
    // Each component from its lowest node.
    for (int seed = 0; seed < winged->node_count; seed++) {
        if (seen[seed])
            continue;
        seen[seed] = true;
        order[written++] = seed;
        // Nodes are numbered when they are first seen.
        for (; read < written; read++) {
            int node = order[read];
            for (int k = winged->node_edge_start[node]; k < winged->node_edge_start[node + 1];
                 k++) {
                int other = winged_other(winged, winged->node_edge[k], node);
                if (!seen[other]) {
                    seen[other] = true;
                    order[written++] = other;
                }
            }
        }
    }
    free(seen);
}

void order_nodes(const WingedMesh *winged, int *slot)
{
    int *order = calloc((size_t)winged->node_count + 1, sizeof *order);
    ASSERT(order != NULL);
    breadth_first(winged, order);
    // Within each window by valence: chunks get little padding.
    for (int first = 0; first < winged->node_count; first += WINDOW) {
        int end = first + WINDOW < winged->node_count ? first + WINDOW : winged->node_count;
        int next = first;
        for (int valence = 0; valence <= MAX_VALENCE; valence++) // a stable counting sort
            for (int k = first; k < end; k++) {
                int v = winged_valence(winged, order[k]);
                if ((v < MAX_VALENCE ? v : MAX_VALENCE) == valence)
                    slot[order[k]] = next++;
            }
    }
    free(order);
}
