// Builds the hierarchy from the coarsest level down, once at load; then it is only read.
#include "geometry/levels.h"

#include "base/check.h"
#include "geometry/butterfly.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

// Whether all levels can be counted; nodes of the finest.
static bool count_nodes(const TriMesh *mesh, int edge_count, int finest, size_t *node_count,
                        Status *status)
{
    int64_t nodes = mesh->node_count, edges = edge_count, faces = mesh->triangle_count;
    for (int l = 1; l <= finest; l++) {
        nodes += edges;
        edges = 2 * edges + 3 * faces;
        faces *= 4;
        if (nodes > MESH_COUNT_MAX || faces > MESH_COUNT_MAX)
            return status_fail(status, STATUS_INVALID,
                               "level %d has %lld nodes and %lld faces, more than %d", l,
                               (long long)nodes, (long long)faces, MESH_COUNT_MAX);
    }
    *node_count = (size_t)nodes;
    return true;
}

#define ALLOCATE(count, array, label)                                                              \
    ((array) = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)(count), sizeof *(array),             \
                              "%s/level %d " label, name, l))

static void create_faces(Level *level, const int (*face)[3], int face_count, int l,
                         const char *name, Arena *arena)
{
    level->face_count = face_count;
    ALLOCATE(face_count, level->face, "faces");
    if (face != NULL)
        memcpy(level->face, face, (size_t)face_count * sizeof *level->face);
}

// Edges of a level whose faces are there, in the order of its winged-edge table.
static void create_edges(Level *level, const WingedMesh *winged, int l, const char *name,
                         Arena *arena)
{
    level->node_count = winged->node_count;
    level->edge_count = winged->edge_count;
    ALLOCATE(level->face_count, level->face_edge, "face edges");
    ALLOCATE(level->edge_count, level->edge, "edges");
    ALLOCATE(level->edge_count, level->edge_face, "edge faces");
    memcpy(level->face_edge, winged->face_edge,
           (size_t)level->face_count * sizeof *level->face_edge);
    for (int e = 0; e < level->edge_count; e++)
        for (int k = 0; k < 2; k++) {
            level->edge[e][k] = winged->edge[e].node[k];
            level->edge_face[e][k] = winged->edge[e].face[k];
        }
}

// Four children of every face, from the midpoints of its edges.
static void divide_faces(const Level *coarse, int (*fine)[3])
{
    for (int f = 0; f < coarse->face_count; f++) {
        const int *corner = coarse->face[f];
        int mid[3];
        for (int k = 0; k < 3; k++)
            mid[k] = coarse->node_count + coarse->face_edge[f][k];
        const int child[4][3] = {{corner[0], mid[0], mid[2]},
                                 {mid[0], corner[1], mid[1]},
                                 {mid[2], mid[1], corner[2]},
                                 {mid[0], mid[1], mid[2]}};
        memcpy(fine[4 * f], child, sizeof child);
    }
}

// Smooth as the butterfly is, it can fold the faces of a very irregular mesh down to nothing.
static bool check_faces(const Levels *levels, int l, const TriMesh *mesh, Status *status)
{
    const Level *level = &levels->level[l];
    for (int f = 0; f < level->face_count; f++) {
        if (mesh_relative_height(levels->position, level->face[f]) >= MESH_SMALLEST_HEIGHT)
            continue;
        const int *corner = mesh->triangle[f >> 2 * l];
        return status_fail(status, STATUS_INVALID,
                           "the triangle of nodes %d, %d and %d is divided into one without area "
                           "at level %d",
                           mesh->file_index[corner[0]], mesh->file_index[corner[1]],
                           mesh->file_index[corner[2]], l);
    }
    return true;
}

bool levels_create(Levels *levels, const TriMesh *mesh, int finest, const char *name, Arena *arena,
                   Status *status)
{
    *levels = (Levels){.finest = finest};
    if (finest < 0 || finest > LEVELS_MAX)
        return status_fail(status, STATUS_INVALID, "levels %d outside [0, %d]", finest, LEVELS_MAX);
    WingedMesh winged;
    winged_create(&winged, mesh);
    size_t nodes = 0;
    bool ok = count_nodes(mesh, winged.edge_count, finest, &nodes, status);
    if (ok) {
        levels->position = arena_allocate(arena, ARENA_TOPOLOGY, nodes, sizeof *levels->position,
                                          "%s/level positions", name);
        memcpy(levels->position, mesh->position,
               (size_t)mesh->node_count * sizeof *levels->position);
        create_faces(&levels->level[0], (const int(*)[3])mesh->triangle, mesh->triangle_count, 0,
                     name, arena);
        create_edges(&levels->level[0], &winged, 0, name, arena);
    }
    for (int l = 1; l <= finest && ok; l++) {
        const Level *coarse = &levels->level[l - 1];
        Level *fine = &levels->level[l];
        butterfly_midpoints(&winged, (const int(*)[3])coarse->face, levels->position,
                            levels->position + coarse->node_count);
        create_faces(fine, NULL, 4 * coarse->face_count, l, name, arena);
        divide_faces(coarse, fine->face);
        TriMesh view = {.node_count = coarse->node_count + coarse->edge_count,
                        .triangle_count = fine->face_count,
                        .triangle = fine->face};
        winged_destroy(&winged);
        winged_create(&winged, &view);
        create_edges(fine, &winged, l, name, arena);
        ok = check_faces(levels, l, mesh, status);
    }
    winged_destroy(&winged);
    return ok;
}

int levels_of_node(const Levels *levels, int node)
{
    int l = 0;
    while (node >= levels->level[l].node_count)
        l++;
    return l;
}

void levels_parents(const Levels *levels, int node, int parent[2])
{
    int l = levels_of_node(levels, node);
    parent[0] = parent[1] = node;
    if (l > 0)
        memcpy(parent, levels->level[l - 1].edge[node - levels->level[l - 1].node_count],
               2 * sizeof *parent);
}

void levels_halves(const Levels *levels, int level, int edge, int half[2])
{
    // Edge k of a face is edge k of its child at corner k and of the one at corner k + 1. It runs
    // from its first to its second end in the left face, the other way in the right one.
    const Level *coarse = &levels->level[level];
    int side = coarse->edge_face[edge][0] >= 0 ? 0 : 1;
    int face = coarse->edge_face[edge][side], k = 0;
    while (coarse->face_edge[face][k] != edge)
        k++;
    const int(*face_edge)[3] = (const int(*)[3])levels->level[level + 1].face_edge;
    half[side] = face_edge[4 * face + k][k];
    half[1 - side] = face_edge[4 * face + (k + 1) % 3][k];
}

void levels_spread(const Levels *levels, int level, Vec3 *row)
{
    for (int l = 0; l < level; l++) {
        const Level *coarse = &levels->level[l];
        for (int e = 0; e < coarse->edge_count; e++) {
            const int *end = coarse->edge[e];
            row[coarse->node_count + e] = vec3_scale(0.5, vec3_add(row[end[0]], row[end[1]]));
        }
    }
}

static int *copy_ints(const int *from, int count)
{
    if (from == NULL)
        return NULL;
    int *to = malloc(((size_t)count + 1) * sizeof *to);
    ASSERT(to != NULL);
    memcpy(to, from, (size_t)count * sizeof *to);
    return to;
}

void levels_mesh(const Levels *levels, int level, const TriMesh *mesh, TriMesh *out)
{
    const Level *of = &levels->level[level];
    mesh_create(out, of->node_count, of->face_count);
    memcpy(out->position, levels->position, (size_t)of->node_count * sizeof *out->position);
    memcpy(out->triangle, of->face, (size_t)of->face_count * sizeof *out->triangle);
    out->file_node_count = mesh->file_node_count;
    out->file_node = copy_ints(mesh->file_node, mesh->file_node_count);
    out->copy_count = mesh->copy_count;
    out->copy_of = copy_ints(mesh->copy_of, mesh->copy_count);
    int next = mesh->file_node_count + mesh->copy_count - mesh->node_count;
    for (int i = 0; i < of->node_count; i++)
        out->file_index[i] = i < mesh->node_count ? mesh->file_index[i] : next + i;
}
