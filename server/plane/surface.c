// SPDX-License-Identifier: MIT
// The visible parts of a plane body: its outline as a strip for tools and loads, and the mesh for
// clients. Load time; plane_cut_show on the step thread.
#include "plane/model.h"

#include "base/check.h"
#include "geometry/edges.h"
#include "plane/cut.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ALLOCATE_ROWS(count, row, label)                                                           \
    arena_allocate(arena, ARENA_TOPOLOGY, (size_t)(count), sizeof *(row), "%s/%s", name, label)

static double diagonal(double x, double y)
{
    return sqrt(x * x + y * y);
}

// Numbers the vertices of the outline: node[v] is the lower of a vertex's two nodes, or -1.
static int *number_nodes(PlaneModel *model, const PlaneMesh *mesh, const char *name, Arena *arena)
{
    int *node = malloc(((size_t)mesh->vertex_count + 1) * sizeof *node);
    ASSERT(node != NULL);
    for (int v = 0; v < mesh->vertex_count; v++)
        node[v] = -1;
    for (int e = 0; e < mesh->edge_count; e++)
        node[mesh->edge[e][0]] = 0; // each vertex of the outline starts one edge
    for (int v = 0; v < mesh->vertex_count; v++)
        if (node[v] == 0) {
            node[v] = model->node_count;
            model->node_count += 2;
        }
    model->node_vertex = ALLOCATE(ARENA_TOPOLOGY, model->node_count, int, "vertices of nodes");
    for (int v = 0; v < mesh->vertex_count; v++)
        if (node[v] >= 0)
            model->node_vertex[node[v]] = model->node_vertex[node[v] + 1] = v;
    return node;
}

// Makes two triangles for each edge of the outline; the body is on the left from a to b, so that
// the strip seen from outside goes from a to b and up.
static void make_strip(TriMesh *strip, const PlaneModel *model, const PlaneMesh *mesh,
                       const int *node)
{
    mesh_create(strip, model->node_count, 2 * mesh->edge_count);
    for (int n = 0; n < model->node_count; n++) {
        const double *rest = model->vertices.rows.rest[model->node_vertex[n]];
        strip->position[n] = vec3(rest[0], rest[1], n % 2 == 0 ? -model->half : model->half);
    }
    for (int e = 0; e < mesh->edge_count; e++) {
        int a = node[mesh->edge[e][0]], b = node[mesh->edge[e][1]];
        const int corner[2][3] = {{a, b, b + 1}, {a, b + 1, a + 1}};
        memcpy(strip->triangle[2 * e], corner, sizeof corner);
    }
}

// A corner of the outline is a third as stiff as a notch.
void plane_create_firmness(Body *body, const BodyOptions *options, Arena *arena)
{
    BodySurface *surface = &body->surface;
    if (options->without_contacts)
        return;
    surface->face_firmness = arena_allocate(arena, ARENA_CONTACT, (size_t)surface->face_count,
                                            sizeof(double), "%s/face firmness", options->name);
    surface->node_firmness = arena_allocate(arena, ARENA_CONTACT, (size_t)surface->node_count,
                                            sizeof(double), "%s/node firmness", options->name);
}

void plane_create_surface(PlaneModel *model, Body *body, const PlaneMesh *mesh,
                          const PlaneOptions *options, Arena *arena)
{
    const char *name = options->body.name;
    // The strip as a mesh, which gives the neighbours.
    int *node = number_nodes(model, mesh, name, arena);
    TriMesh strip;
    make_strip(&strip, model, mesh, node);
    WingedMesh winged;
    winged_create(&winged, &strip);
    const int nodes = strip.node_count, faces = strip.triangle_count;
    // Copies for the life of the body.
    int(*face)[3] = ALLOCATE_ROWS(faces, face, "faces");
    int(*neighbor)[3] = ALLOCATE_ROWS(faces, neighbor, "face neighbours");
    double *area = ALLOCATE(ARENA_TOPOLOGY, faces, double, "face areas");
    double *node_area = ALLOCATE(ARENA_TOPOLOGY, nodes, double, "node areas");
    double *node_mass = ALLOCATE(ARENA_TOPOLOGY, nodes, double, "node masses");
    int *start = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, int, "node face start");
    int *list = ALLOCATE(ARENA_TOPOLOGY, 3 * faces, int, "node faces");
    memcpy(face, strip.triangle, (size_t)faces * sizeof *face);
    memcpy(neighbor, winged.face_neighbor, (size_t)faces * sizeof *neighbor);
    memcpy(start, winged.node_face_start, (size_t)(nodes + 1) * sizeof *start);
    memcpy(list, winged.node_face, (size_t)(3 * faces) * sizeof *list);
    // Areas, of nodes a third of those around.
    double longest = 0.0;
    for (int f = 0; f < faces; f++) {
        Vec3 side[3];
        for (int k = 0; k < 3; k++) {
            side[k] = vec3_sub(strip.position[face[f][(k + 1) % 3]], strip.position[face[f][k]]);
            longest = fmax(longest, vec3_length(side[k]));
        }
        area[f] = 0.5 * vec3_length(vec3_cross(side[0], side[1]));
        for (int k = 0; k < 3; k++)
            node_area[face[f][k]] += area[f] / 3.0;
    }
    // Half each: a force on both nodes acts on the one vertex, and the bound of contact holds for
    // it.
    for (int n = 0; n < nodes; n++)
        node_mass[n] = 0.5 * model->vertices.mass[model->node_vertex[n]];
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
        .node_mass = node_mass,
        .longest_edge = longest,
    };
    model->node_face_start = body->surface.node_face_start;
    model->node_face_end = body->surface.node_face_end;
    plane_create_firmness(body, &options->body, arena);
    winged_destroy(&winged);
    mesh_destroy(&strip);
    free(node);
}

void plane_create_mesh(PlaneModel *model, Body *body, const PlaneMesh *mesh, const char *name,
                       Arena *arena)
{
    const int nodes = mesh->vertex_count, triangles = mesh->triangle_count;
    int(*triangle)[3] = ALLOCATE_ROWS(triangles, triangle, "triangles");
    int(*parent)[2] = ALLOCATE_ROWS(nodes, parent, "vertex parents");
    int *piece = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "vertex pieces");
    signed char *level = ALLOCATE(ARENA_TOPOLOGY, nodes, signed char, "vertex levels");
    model->vertices.id = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "vertex ids");
    model->vertex = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "published vertices");
    memcpy(triangle, mesh->triangle, (size_t)triangles * sizeof *triangle);
    memcpy(piece, mesh->piece, (size_t)nodes * sizeof *piece);
    // All vertices are published, in their order.
    for (int v = 0; v < nodes; v++) {
        model->vertex[v] = v;
        model->vertices.id[v] = parent[v][0] = parent[v][1] = mesh->id[v];
    }
    body->mesh = (BodyMesh){
        .topology = 1,
        .node_count = nodes,
        .triangle_count = triangles,
        .node_capacity = nodes,
        .triangle_capacity = triangles,
        .triangle = (const int(*)[3])triangle,
        .id = model->vertices.id,
        .origin = model->vertices.id,
        .parent = (const int(*)[2])parent,
        .piece = piece,
        .level = level,
    };
}

// ---------------------------------------------------------------------------------------------
// Of bodies that can be cut: the same, rebuilt after every change, in the order of the outline's
// edges: a strip has no stored sides (BodySurface.solid), so that no face must be traced to an
// earlier one

enum { FACES_OF_NODE = 4 }; // a vertex ends at most two edges per component, two triangles each

void plane_cut_create_surface(PlaneModel *model, Body *body, const PlaneOptions *options,
                              Arena *arena)
{
    PlaneCut *cut = model->cut;
    const char *name = options->body.name;
    const int nodes = 2 * cut->vertex_capacity, faces = 2 * cut->room.sides;
    model->node_count = nodes;
    model->node_vertex = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "vertices of nodes");
    model->vertex = ALLOCATE(ARENA_TOPOLOGY, cut->vertex_capacity, int, "published vertices");
    for (int n = 0; n < nodes; n++)
        model->node_vertex[n] = n / 2;
    for (int v = 0; v < cut->vertex_capacity; v++)
        model->vertex[v] = v;
    // Room for the outline of any mesh.
    PlaneStrip *strip = &cut->strip;
    strip->face = ALLOCATE_ROWS(faces, strip->face, "faces");
    strip->neighbor = ALLOCATE_ROWS(faces, strip->neighbor, "face neighbours");
    strip->area = ALLOCATE(ARENA_TOPOLOGY, faces, double, "face areas");
    strip->finest_area = ALLOCATE(ARENA_TOPOLOGY, faces, double, "least face areas");
    strip->start = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node face start");
    strip->end = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node face end");
    strip->list = ALLOCATE(ARENA_TOPOLOGY, nodes * FACES_OF_NODE, int, "node faces");
    strip->node_area = ALLOCATE(ARENA_TOPOLOGY, nodes, double, "node areas");
    strip->node_mass = ALLOCATE(ARENA_TOPOLOGY, nodes, double, "node masses");
    strip->edge_from = ALLOCATE(ARENA_TOPOLOGY, cut->vertex_capacity, int, "edges from vertices");
    for (int n = 0; n < nodes; n++)
        strip->start[n] = strip->end[n] = n * FACES_OF_NODE;
    model->node_face_start = strip->start;
    model->node_face_end = strip->end;
    // The least area is that of a finest edge.
    for (int f = 0; f < faces; f++)
        strip->finest_area[f] = 0.5 * cut->forms.size * cut->forms.size;
    body->surface = (BodySurface){
        .node_count = nodes,
        .face_count = faces,
        .face = (const int(*)[3])strip->face,
        .face_area = strip->area,
        .finest_area = strip->finest_area,
        .face_neighbor = (const int(*)[3])strip->neighbor,
        .node_face_start = strip->start,
        .node_face_end = strip->end,
        .node_face = strip->list,
        .node_area = strip->node_area,
        .node_mass = strip->node_mass,
        // The diagonal of the longest edge of the largest square at the outline.
        .longest_edge = cut->forms.size * diagonal(1.0, (double)(1 << cut->layout.levels)),
        .solid = true,
    };
    plane_create_firmness(body, &options->body, arena);
    // For clients, likewise.
    cut->triangle = ALLOCATE_ROWS(cut->room.sides, cut->triangle, "triangles");
    body->mesh = (BodyMesh){
        .topology = 1,
        .node_capacity = cut->vertex_capacity,
        .triangle_capacity = cut->room.sides,
        .triangle = (const int(*)[3])cut->triangle,
        .id = cut->id,
        .origin = cut->origin_id,
        .parent = (const int(*)[2])cut->parent,
        .piece = cut->piece,
        .level = cut->level,
    };
}

// Also clears those that were in use before a reset.
static void clear_nodes(const PlaneModel *model, BodySurface *surface)
{
    const PlaneStrip *strip = &model->cut->strip;
    const int nodes = 2 * model->vertices.count;
    surface->node_used = surface->node_used > nodes ? surface->node_used : nodes;
    for (int n = 0; n < surface->node_used; n++) {
        strip->end[n] = strip->start[n];
        strip->node_area[n] = 0.0;
        // A force on both nodes acts on the one vertex.
        strip->node_mass[n] = n < nodes ? 0.5 * model->vertices.mass[n / 2] : 0.0;
    }
}

// Adds two triangles per edge of the outline; the body is on the left from a to b, so that the
// strip seen from outside goes from a to b and up. A vertex has one edge that starts at it and one
// that ends there: where the outline touches itself the components have vertices of their own.
static void put_edge(PlaneModel *model, int k, int a, int b)
{
    PlaneStrip *strip = &model->cut->strip;
    const Rows *rows = &model->vertices.rows;
    const int corner[2][3] = {{2 * a, 2 * b, 2 * b + 1}, {2 * a, 2 * b + 1, 2 * a + 1}};
    const double length =
        diagonal(rows->rest[b][0] - rows->rest[a][0], rows->rest[b][1] - rows->rest[a][1]);
    // Two triangles with half of the rectangle each.
    for (int t = 0; t < 2; t++) {
        const int f = 2 * k + t;
        memcpy(strip->face[f], corner[t], sizeof corner[t]);
        strip->area[f] = 0.5 * length * model->cut->forms.size;
        for (int c = 0; c < 3; c++) {
            const int n = corner[t][c];
            strip->list[strip->end[n]++] = f;
            strip->node_area[n] += strip->area[f] / 3.0;
            strip->neighbor[f][c] = -1;
        }
    }
    // They meet in the diagonal; the edges before and after join them later.
    strip->neighbor[2 * k][2] = 2 * k + 1;
    strip->neighbor[2 * k + 1][0] = 2 * k;
    strip->edge_from[a] = k;
}

static void show_strip(PlaneModel *model, Body *body)
{
    const PlaneCut *cut = model->cut;
    const PlaneStrip *strip = &cut->strip;
    clear_nodes(model, &body->surface);
    // Draw all edges, then join each with the one that starts where it ends.
    for (int v = 0; v < model->vertices.count; v++)
        strip->edge_from[v] = -1;
    for (int k = 0; k < cut->mesh.edge_count; k++)
        put_edge(model, k, cut->row_of[cut->mesh.edge[k][0]], cut->row_of[cut->mesh.edge[k][1]]);
    for (int k = 0; k < cut->mesh.edge_count; k++) {
        const int b = cut->row_of[cut->mesh.edge[k][1]], next = strip->edge_from[b];
        if (next >= 0) {
            strip->neighbor[2 * k][1] = 2 * next + 1; // across the vertical edge at b
            strip->neighbor[2 * next + 1][2] = 2 * k;
        }
    }
    body->surface.face_used = 2 * cut->mesh.edge_count > body->surface.face_used
                                  ? 2 * cut->mesh.edge_count
                                  : body->surface.face_used;
}

void plane_cut_show(PlaneModel *model, Body *body)
{
    PlaneCut *cut = model->cut;
    show_strip(model, body);
    for (int t = 0; t < cut->mesh.triangle_count; t++)
        for (int c = 0; c < 3; c++)
            cut->triangle[t][c] = cut->row_of[cut->mesh.triangle[t][c]];
    for (int v = 0; v < model->vertices.count; v++)
        cut->parent[v][0] = cut->parent[v][1] = cut->id[v];
    body->mesh.node_count = model->vertices.count;
    body->mesh.triangle_count = cut->mesh.triangle_count;
}
