// The visible parts of a cut plane body: its outline as a strip, for tools and loads, and the mesh
// for clients. Rebuilt after every change, in the order of the outline's edges: a strip has no
// stored sides (BodySurface.solid), so that no face must be traced to an earlier one.
#include "plane/cut.h"

#include <string.h>

enum { FACES_OF_NODE = 4 }; // a vertex ends at most two edges per component, two triangles each

#define ALLOCATE_ROWS(count, row, label)                                                           \
    arena_allocate(arena, ARENA_TOPOLOGY, (size_t)(count), sizeof *(row), "%s/%s", name, label)

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
        .longest_edge = cut->forms.size * hypot(1.0, (double)(1 << cut->layout.levels)),
        .solid = true,
    };
    plane_create_firmness(body, &options->body, arena);
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
        hypot(rows->rest[b][0] - rows->rest[a][0], rows->rest[b][1] - rows->rest[a][1]);
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
    strip->neighbor[2 * k][2] = 2 * k + 1;
    strip->neighbor[2 * k + 1][0] = 2 * k;
    strip->edge_from[a] = k;
}

static void show_strip(PlaneModel *model, Body *body)
{
    const PlaneCut *cut = model->cut;
    const PlaneStrip *strip = &cut->strip;
    clear_nodes(model, &body->surface);
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
