// SPDX-License-Identifier: MIT
#include "voxel/skin.h"

#include <math.h>
#include <string.h>

struct Skin {
    int node_count;
    double (*place)[3];            // [node] at rest, in the rows' coordinates [m]
    int (*vertex)[NODE_CORNERS];   // [node] corners of the element that carries it
    float (*weight)[NODE_CORNERS]; // [node] sum 1; trilinear, extrapolated outside
};

// Converts a point to cells from the lattice's low corner.
static void to_cells(const Lattice *lattice, Vec3 x, double cell[3])
{
    Vec3 p = quat_rotate(quat_conjugate(lattice->turn), vec3_sub(x, lattice->origin));
    cell[0] = p.x / lattice->size, cell[1] = p.y / lattice->size, cell[2] = p.z / lattice->size;
}

// Returns the squared distance from a point to a cell [cells2].
static double square_to_cell(const double at[3], const int cell[3])
{
    double sum = 0.0;
    for (int c = 0; c < 3; c++) {
        double d = fmax(fmax(cell[c] - at[c], at[c] - cell[c] - 1.0), 0.0);
        sum += d * d;
    }
    return sum;
}

// Returns the leaf of the cell nearest to a point; of equally near ones the first in z, y, x. -1:
// none within reach.
static int nearest_leaf(const Layout *layout, const double at[3])
{
    int low[3], found = -1;
    for (int c = 0; c < 3; c++)
        low[c] = (int)floor(fmin(fmax(at[c], -1e6), 1e6));
    found = layout_leaf_at(layout, low[0], low[1], low[2]);
    if (found >= 0)
        return found;
    double best = (double)SKIN_REACH * SKIN_REACH;
    for (int k = -SKIN_REACH; k <= SKIN_REACH; k++)
        for (int j = -SKIN_REACH; j <= SKIN_REACH; j++)
            for (int i = -SKIN_REACH; i <= SKIN_REACH; i++) {
                const int cell[3] = {low[0] + i, low[1] + j, low[2] + k};
                double square = square_to_cell(at, cell);
                int leaf = square < best ? layout_leaf_at(layout, cell[0], cell[1], cell[2]) : -1;
                if (leaf >= 0)
                    best = square, found = leaf;
            }
    return found;
}

static void tie(Skin *skin, int node, const double at[3], const Leaf *leaf, const int *corner)
{
    double t[3]; // position in the leaf, 0 to 1; outside at most one edge away
    for (int c = 0; c < 3; c++) {
        double edge = (double)(1 << leaf->level);
        t[c] = fmin(fmax((at[c] - leaf->cell[c]) / edge, -1.0), 2.0);
    }
    for (int i = 0; i < NODE_CORNERS; i++) {
        double weight = ((i & 1) != 0 ? t[0] : 1.0 - t[0]) * ((i & 2) != 0 ? t[1] : 1.0 - t[1]) *
                        ((i & 4) != 0 ? t[2] : 1.0 - t[2]);
        skin->vertex[node][i] = corner[i];
        skin->weight[node][i] = (float)weight;
    }
}

// Creates the mesh for clients: ids as those of a surface body made from the same file.
static void show(Body *body, const TriMesh *mesh, const Skin *skin, const int *piece_of_vertex,
                 Arena *arena)
{
    const char *name = body->name;
    const int nodes = mesh->node_count;
    int *id = ALLOCATE(ARENA_OUTPUT, nodes, int, "node ids");
    int *origin = ALLOCATE(ARENA_OUTPUT, nodes, int, "node origins");
    int *piece = ALLOCATE(ARENA_OUTPUT, nodes, int, "node pieces");
    int(*parent)[2] = arena_allocate(arena, ARENA_OUTPUT, (size_t)nodes, sizeof *parent, "%s/%s",
                                     body->name, "node parents");
    signed char *level = ALLOCATE(ARENA_OUTPUT, nodes, signed char, "node levels");
    int(*triangle)[3] = arena_allocate(arena, ARENA_OUTPUT, (size_t)mesh->triangle_count,
                                       sizeof *triangle, "%s/%s", body->name, "skin triangles");
    memcpy(triangle, mesh->triangle, (size_t)mesh->triangle_count * sizeof *triangle);
    for (int i = 0; i < nodes; i++) {
        id[i] = origin[i] = parent[i][0] = parent[i][1] = mesh->file_index[i];
        piece[i] = piece_of_vertex[skin->vertex[i][0]];
    }
    // Copies that the repair made have the origin of the node from which they were split.
    for (int i = nodes - mesh->copy_count; i < nodes; i++)
        origin[i] = mesh->file_index[mesh_node_of_file(mesh, mesh_file_row(mesh, i))];
    body->mesh = (BodyMesh){
        .topology = 1,
        .node_count = nodes,
        .triangle_count = mesh->triangle_count,
        .node_capacity = nodes,
        .triangle_capacity = mesh->triangle_count,
        .triangle = (const int(*)[3])triangle,
        .id = id,
        .origin = origin,
        .parent = (const int(*)[2])parent,
        .piece = piece,
        .level = level,
    };
}

Skin *skin_create(Body *body, const TriMesh *mesh, const Lattice *lattice, const Layout *layout,
                  const LatticeMesh *elements, const Rows *rows, Arena *arena, Status *status)
{
    const char *name = body->name;
    const size_t nodes = (size_t)mesh->node_count;
    Skin *skin = ALLOCATE(ARENA_OUTPUT, 1, Skin, "skin");
    skin->node_count = mesh->node_count;
    skin->place = arena_allocate(arena, ARENA_OUTPUT, nodes, sizeof *skin->place, "%s/%s",
                                 body->name, "skin places");
    skin->vertex = arena_allocate(arena, ARENA_OUTPUT, nodes, sizeof *skin->vertex, "%s/%s",
                                  body->name, "skin vertices");
    skin->weight = arena_allocate(arena, ARENA_OUTPUT, nodes, sizeof *skin->weight, "%s/%s",
                                  body->name, "skin weights");
    const Quat back = quat_conjugate(rows->rest_turn);
    for (int i = 0; i < mesh->node_count; i++) {
        double at[3];
        to_cells(lattice, mesh->position[i], at);
        int leaf = nearest_leaf(layout, at);
        if (leaf < 0) {
            status_fail(
                status, STATUS_INVALID,
                "skin: node %d at (%g, %g, %g) m lies more than %d cells (%g m) outside the "
                "elements: are scale and place the same?",
                mesh->file_index[i], mesh->position[i].x, mesh->position[i].y, mesh->position[i].z,
                SKIN_REACH, SKIN_REACH * lattice->size);
            return NULL;
        }
        tie(skin, i, at, &layout->leaf[leaf], elements->vertex[leaf]);
        // The node keeps its own rest position: the element only gives its displacement.
        Vec3 place = quat_rotate(back, vec3_sub(mesh->position[i], rows->rest_origin));
        skin->place[i][0] = place.x, skin->place[i][1] = place.y, skin->place[i][2] = place.z;
    }
    show(body, mesh, skin, elements->piece, arena);
    return skin;
}

// A point's displacement is the weighted mean of its corners'; single precision is sufficient for
// data that is published in it.
typedef float Four __attribute__((vector_size(4 * sizeof(float))));

static inline Four blend(const Skin *skin, const Rows *rows, const void *row, int node, int first)
{
    const int *vertex = skin->vertex[node];
    const float *weight = skin->weight[node];
    Four sum = {0.0F};
    for (int i = 0; i < NODE_CORNERS; i++) {
        Four v;
        if (rows->precision == PRECISION_SINGLE) {
            memcpy(&v, (const float *)row + (long)vertex[i] * ROW + first, sizeof v);
        } else {
            const double *from = (const double *)row + (long)vertex[i] * ROW + first;
            v = (Four){(float)from[0], (float)from[1], (float)from[2], 0.0F};
        }
        sum += weight[i] * v;
    }
    return sum;
}

void skin_snapshot(const Skin *skin, const Rows *rows, const void *row, float *position,
                   float *velocity)
{
    Vec3 axis[3]; // the rows' axes in the world
    for (int c = 0; c < 3; c++)
        axis[c] = quat_rotate(rows->frame->turn, (Vec3){c == 0, c == 1, c == 2});
    const Vec3 origin = rows->frame->origin, speed = rows_velocity(rows);
    for (int i = 0; i < skin->node_count; i++) {
        Four u = blend(skin, rows, row, i, 0);
        double p[3];
        for (int c = 0; c < 3; c++)
            p[c] = skin->place[i][c] + (double)u[c];
        float *x = position + 3L * i;
        x[0] = (float)(origin.x + axis[0].x * p[0] + axis[1].x * p[1] + axis[2].x * p[2]);
        x[1] = (float)(origin.y + axis[0].y * p[0] + axis[1].y * p[1] + axis[2].y * p[2]);
        x[2] = (float)(origin.z + axis[0].z * p[0] + axis[1].z * p[1] + axis[2].z * p[2]);
        if (velocity == NULL)
            continue;
        Four v = blend(skin, rows, row, i, 4);
        float *to = velocity + 3L * i;
        to[0] = (float)(speed.x + axis[0].x * (double)v[0] + axis[1].x * (double)v[1] +
                        axis[2].x * (double)v[2]);
        to[1] = (float)(speed.y + axis[0].y * (double)v[0] + axis[1].y * (double)v[1] +
                        axis[2].y * (double)v[2]);
        to[2] = (float)(speed.z + axis[0].z * (double)v[0] + axis[1].z * (double)v[1] +
                        axis[2].z * (double)v[2]);
    }
}

int skin_vertex(const Skin *skin, int node)
{
    int most = 0;
    for (int c = 1; c < NODE_CORNERS; c++)
        if (skin->weight[node][c] > skin->weight[node][most])
            most = c;
    return skin->vertex[node][most];
}

int skin_node_count(const Skin *skin)
{
    return skin->node_count;
}

void skin_snapshot_rest(const Skin *skin, const Rows *rows, float *position)
{
    for (long i = 0; i < skin->node_count; i++) {
        const double *place = skin->place[i];
        Vec3 turned = quat_rotate(rows->rest_turn, (Vec3){place[0], place[1], place[2]});
        Vec3 x = vec3_add(rows->rest_origin, turned);
        position[3 * i] = (float)x.x;
        position[3 * i + 1] = (float)x.y;
        position[3 * i + 2] = (float)x.z;
    }
}
