// SPDX-License-Identifier: MIT
// The outer faces of a voxel body for tools and loads, and the mesh for clients. Load time only.
#include "voxel/cut/cut_body.h"

#include <math.h>
#include <string.h>

// Lists faces by node: those of node i are list[start[i] .. start[i + 1]), ascending.
static void list_faces(const LatticeMesh *mesh, int nodes, int *start, int *list)
{
    for (int f = 0; f < mesh->face_count; f++)
        for (int c = 0; c < 3; c++)
            start[mesh->face[f][c] + 1]++;
    for (int i = 0; i < nodes; i++)
        start[i + 1] += start[i];
    for (int f = 0; f < mesh->face_count; f++)
        for (int c = 0; c < 3; c++)
            list[start[mesh->face[f][c]]++] = f;
    memmove(start + 1, start, (size_t)nodes * sizeof *start);
    start[0] = 0;
}

void voxel_create_surface(VoxelModel *model, Body *body, const LatticeMesh *mesh,
                          const VoxelOptions *options, Arena *arena)
{
    const char *name = options->body.name;
    const double size = options->lattice->size;
    const int nodes = mesh->surface_count, faces = mesh->face_count;
    int(*face)[3] =
        arena_allocate(arena, ARENA_TOPOLOGY, (size_t)faces, sizeof *face, "%s/%s", name, "faces");
    int(*neighbor)[3] = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)faces, sizeof *neighbor,
                                       "%s/%s", name, "face neighbours");
    double *area = ALLOCATE(ARENA_TOPOLOGY, 1, double, "area of a face");
    double *node_area = ALLOCATE(ARENA_TOPOLOGY, nodes, double, "node areas");
    int *start = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, int, "node face start");
    int *list = ALLOCATE(ARENA_TOPOLOGY, 3 * faces, int, "node faces");
    memcpy(face, mesh->face, (size_t)faces * sizeof *face);
    memcpy(neighbor, mesh->face_neighbor, (size_t)faces * sizeof *neighbor);
    list_faces(mesh, nodes, start, list);
    *area = 0.5 * size * size; // half a square
    for (int f = 0; f < faces; f++)
        for (int c = 0; c < 3; c++)
            node_area[face[f][c]] += *area / 3.0;
    body->surface = (BodySurface){
        .node_count = nodes,
        .face_count = faces,
        .node_used = nodes,
        .face_used = faces,
        .face = (const int(*)[3])face,
        .face_area = area,
        .finest_area = area,
        .face_neighbor = (const int(*)[3])neighbor,
        .node_face_start = start,
        .node_face_end = start + 1,
        .node_face = list,
        .node_area = node_area,
        .node_mass = model->vertices.mass,
        .longest_edge = sqrt(2.0) * size,
        .solid = true,
        .alike = true,
    };
    if (options->body.without_contacts)
        return;
    // A corner of the body is a sixth as stiff as the middle of a face: contacts need the firmness.
    body->surface.face_firmness = arena_allocate(arena, ARENA_CONTACT, (size_t)faces,
                                                 sizeof(double), "%s/face firmness", name);
    body->surface.node_firmness = arena_allocate(arena, ARENA_CONTACT, (size_t)nodes,
                                                 sizeof(double), "%s/node firmness", name);
}

void voxel_create_mesh(VoxelModel *model, Body *body, const LatticeMesh *mesh, bool all,
                       const char *name, Arena *arena)
{
    const int nodes = all ? mesh->vertex_count : mesh->surface_count;
    int *piece = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node pieces");
    int(*parent)[2] = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)nodes, sizeof *parent, "%s/%s",
                                     name, "node parents");
    signed char *level = ALLOCATE(ARENA_TOPOLOGY, nodes, signed char, "node levels");
    int *node = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "published vertices");
    int64_t *count = ALLOCATE(ARENA_TOPOLOGY, 1, int64_t, "published count");
    model->node = node;
    model->node_count = count;
    *count = nodes;
    for (int i = 0; i < nodes; i++) {
        node[i] = i;
        piece[i] = mesh->piece[i];
        parent[i][0] = parent[i][1] = mesh->id[i];
    }
    body->mesh = (BodyMesh){
        .topology = 1,
        .node_count = nodes,
        .triangle_count = mesh->face_count,
        .node_capacity = nodes,
        .triangle_capacity = mesh->face_count,
        .triangle = body->surface.face,
        .id = model->vertices.id,
        .origin = model->vertices.id,
        .parent = (const int(*)[2])parent,
        .piece = piece,
        .level = level,
    };
}

// Writes the cell of an outer square of a body that cannot be cut, from the lattice points of its
// corners: counter-clockwise from outside.
static void find_cell(const Body *body, int square, int cell[3])
{
    const VoxelModel *model = body->model;
    const int(*triangle)[3] = (const int(*)[3])body->surface.face + 2 * square;
    const int *n = model->points;
    int point[3][3];
    for (int k = 0; k < 3; k++) {
        const int index = model->vertices.id[triangle[0][k]] % (n[0] * n[1] * n[2]);
        point[k][0] = index % n[0];
        point[k][1] = index / n[0] % n[1];
        point[k][2] = index / (n[0] * n[1]);
    }
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        cell[d] = point[0][d];
        for (int k = 1; k < 3; k++)
            cell[d] = point[k][d] < cell[d] ? point[k][d] : cell[d];
        // Twice the area along d: towards +d the cell is below its square.
        const int area = (point[1][e] - point[0][e]) * (point[2][f] - point[0][f]) -
                         (point[1][f] - point[0][f]) * (point[2][e] - point[0][e]);
        cell[d] -= area > 0;
    }
}

// Elements that touch are 2^5 cells apart along each axis at most, so their lowest cells differ
// modulo TAGS.
enum { TAGS = 40 };
_Static_assert(1 << VOXEL_LEVELS_MAX < TAGS, "elements that touch may have the same tag");
_Static_assert(TAGS *TAGS *TAGS <= UINT16_MAX, "tags have 16 bits");

void voxel_snapshot_elements(const Body *body, int first, int end, unsigned char *level,
                             uint16_t *tag)
{
    const VoxelModel *model = body->model;
    for (int q = first; q < end; q++) {
        // The surface of other bodies has single cells.
        int cell[3] = {0};
        const CutElement *leaf = NULL;
        if (model->cuts != NULL)
            leaf = cut_faces_element(&model->cuts->faces, q);
        else
            find_cell(body, q, cell);
        for (int d = 0; d < 3 && leaf != NULL; d++)
            cell[d] = leaf->cell[d];
        level[q - first] = leaf != NULL ? leaf->level : 0;
        tag[q - first] =
            (uint16_t)(cell[0] % TAGS + TAGS * (cell[1] % TAGS + TAGS * (cell[2] % TAGS)));
    }
}
