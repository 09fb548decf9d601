// SPDX-License-Identifier: MIT
#include "geometry/edges.h"
#include "random.h"
#include "toy_parts.h"
#include "scoped.h"

#include <string.h>

int toy_midpoint(const Toy *toy, int edge)
{
    return toy->base_nodes + edge;
}

// ---------------------------------------------------------------------------------------------
// How a face is drawn: its corners are 0 1 2, the midpoint of its edge k is 3 + k

static int draw(const bool split[3], int out[4][3])
{
    int count = split[0] + split[1] + split[2];
    for (int k = 0; k < 3; k++) {
        int a = k, b = (k + 1) % 3, c = (k + 2) % 3;
        const int one[2][3] = {{a, 3 + k, c}, {3 + k, b, c}};
        const int two[3][3] = {{a, b, 3 + b}, {a, 3 + b, 3 + c}, {3 + c, 3 + b, c}};
        if (count == 1 && split[k])
            memcpy(out, one, sizeof one);
        if (count == 2 && !split[k])
            memcpy(out, two, sizeof two);
    }
    static const int none[1][3] = {{0, 1, 2}};
    static const int three[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
    if (count == 0)
        memcpy(out, none, sizeof none);
    if (count == 3)
        memcpy(out, three, sizeof three);
    return count + 1;
}

// Whether a point of a face, by its weights of corners 0 and 1, lies inside a triangle drawn.
static bool covers(const int triangle[3], double u, double v)
{
    static const double at[6][2] = {{1, 0}, {0, 1}, {0, 0}, {0.5, 0.5}, {0, 0.5}, {0.5, 0}};
    for (int k = 0; k < 3; k++) {
        const double *p = at[triangle[k]], *q = at[triangle[(k + 1) % 3]];
        if ((q[0] - p[0]) * (v - p[1]) - (q[1] - p[1]) * (u - p[0]) < 0.0)
            return false;
    }
    return true;
}

// By points that lie on no edge of any drawing.
static bool overlap(const int a[3], const int b[3])
{
    enum { N = 16 };
    for (int i = 0; i < N; i++)
        for (int j = 0; i + j < N; j++) {
            double u = (i + 0.31) / N, v = (j + 0.27) / N;
            if (u + v < 1.0 && covers(a, u, v) && covers(b, u, v))
                return true;
        }
    return false;
}

static void splits_of(const Toy *toy, const bool *split, int base, bool out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = split[toy->splits->face_edge[base][k]];
}

// ---------------------------------------------------------------------------------------------
// Derived from the split edges

static void list_faces(Toy *toy)
{
    for (int base = 0; base < toy->base_faces; base++) {
        bool split[3];
        int drawn[4][3];
        splits_of(toy, toy->splits->split, base, split);
        int count = draw(split, drawn);
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 3; k++) {
                int c = i < count ? drawn[i][k] : 0;
                int node = c < 3 ? toy->splits->corner[base][c]
                                 : toy_midpoint(toy, toy->splits->face_edge[base][c - 3]);
                toy->face[4 * base + i][k] = i < count ? node : 0;
            }
        for (int i = 0; i < 4; i++)
            toy->face_area[4 * base + i] =
                i < count ? toy_area(toy->splits->rest, toy->face[4 * base + i]) : 0.0;
    }
}

static bool is_used(const Toy *toy, int face)
{
    return toy->face_area[face] > 0.0;
}

static void list_neighbors(Toy *toy)
{
    for (int f = 0; f < 4 * toy->base_faces; f++)
        for (int k = 0; k < 3; k++) {
            int a = toy->face[f][k], b = toy->face[f][(k + 1) % 3];
            toy->neighbor[f][k] = -1;
            for (int i = toy->face_start[a]; i < toy->face_end[a] && is_used(toy, f); i++)
                for (int c = 0; c < 3; c++) {
                    const int *other = toy->face[toy->around[i]];
                    if (other[c] == b && other[(c + 1) % 3] == a)
                        toy->neighbor[f][k] = toy->around[i];
                }
        }
}

void toy_splits_rebuild(Body *body)
{
    Toy *toy = body->model;
    list_faces(toy);
    toy_list_around(toy);
    list_neighbors(toy);
    bool any = false;
    for (int e = 0; e < toy->splits->edges; e++)
        any |= toy->splits->split[e];
    body->lambda = any ? 4.0 * TOY_LAMBDA : TOY_LAMBDA;
    body->damping = any ? 4.0 * TOY_DAMPING : TOY_DAMPING;
    body->finest_level = any;
}

// ---------------------------------------------------------------------------------------------
// A change

static int change_faces(Toy *toy, int base, FaceChange *out)
{
    bool before[3], after[3];
    int old[4][3], drawn[4][3], written = 0;
    splits_of(toy, toy->splits->split, base, before);
    splits_of(toy, toy->splits->wanted, base, after);
    if (memcmp(before, after, sizeof before) == 0)
        return 0;
    int old_count = draw(before, old), count = draw(after, drawn);
    for (int i = 0; i < 4 && (i < count || i < old_count); i++) {
        if (i >= count)
            out[written++] = (FaceChange){4 * base + i, -1};
        for (int j = 0; j < old_count && i < count; j++)
            if (overlap(drawn[i], old[j]))
                out[written++] = (FaceChange){4 * base + i, 4 * base + j};
    }
    return written;
}

bool toy_adapt(Body *body, int64_t step, double tick, TopologyChange *change)
{
    (void)step, (void)tick;
    Toy *toy = body->model;
    if (toy->splits->decide != NULL)
        toy->splits->decide(toy);
    *change = (TopologyChange){.face = toy->splits->change,
                               .born = toy->born,
                               .gone = toy->splits->gone,
                               .gone_parent = (const int(*)[2])toy->splits->gone_parent};
    if (memcmp(toy->splits->split, toy->splits->wanted, (size_t)toy->splits->edges) == 0)
        return false;
    for (int base = 0; base < toy->base_faces; base++)
        change->face_count += change_faces(toy, base, toy->splits->change + change->face_count);
    for (int e = 0; e < toy->splits->edges; e++) {
        const int *parent = toy->splits->parent[e];
        int node = toy_midpoint(toy, e);
        if (toy->splits->wanted[e] && !toy->splits->split[e]) {
            toy->born[change->born_count++] = (NodeBirth){node, {parent[0], parent[1]}};
            toy->position[node] =
                vec3_scale(0.5, vec3_add(toy->position[parent[0]], toy->position[parent[1]]));
        } else if (!toy->splits->wanted[e] && toy->splits->split[e]) {
            toy->splits->gone[change->gone_count] = node;
            memcpy(toy->splits->gone_parent[change->gone_count++], parent, 2 * sizeof *parent);
            toy->position[node] = (Vec3){0.0, 0.0, 0.0};
        }
        toy->splits->split[e] = toy->splits->wanted[e];
    }
    toy_rebuild(body);
    toy->changes++;
    return true;
}

// ---------------------------------------------------------------------------------------------
// Commands

void toy_want(Toy *toy, int edge, bool split)
{
    toy->splits->wanted[edge] = split;
}

void toy_want_all(Toy *toy, bool split)
{
    memset(toy->splits->wanted, split, (size_t)toy->splits->edges);
}

void toy_want_some(Toy *toy, int odds, uint64_t *random)
{
    for (int e = 0; e < toy->splits->edges; e++)
        if (random_below(random, odds) == 0)
            toy->splits->wanted[e] = random_below(random, 2) == 0;
}

// ---------------------------------------------------------------------------------------------
// Creation

static void take_mesh(Toy *toy, const char *name, const TriMesh *mesh, Arena *arena)
{
    ToySplits *splits = toy->splits;
    SCOPED(winged_destroy) WingedMesh winged;
    winged_create(&winged, mesh);
    splits->edges = winged.edge_count;
    toy->nodes = toy->base_nodes + splits->edges;
    toy->faces = 4 * toy->base_faces;
    TOY_ARRAY(toy->base_faces, splits->corner);
    TOY_ARRAY(toy->base_faces, splits->face_edge);
    TOY_ARRAY(splits->edges, splits->parent);
    TOY_ARRAY(toy->nodes, splits->rest);
    memcpy(splits->corner, mesh->triangle, (size_t)toy->base_faces * sizeof *splits->corner);
    memcpy(splits->face_edge, winged.face_edge,
           (size_t)toy->base_faces * sizeof *splits->face_edge);
    memcpy(splits->rest, mesh->position, (size_t)toy->base_nodes * sizeof *splits->rest);
    for (int e = 0; e < splits->edges; e++) {
        const int *parent = memcpy(splits->parent[e], winged.edge[e].node, sizeof *splits->parent);
        splits->rest[toy_midpoint(toy, e)] =
            vec3_scale(0.5, vec3_add(splits->rest[parent[0]], splits->rest[parent[1]]));
    }
}

void toy_splits_create(Toy *toy, const char *name, const TriMesh *mesh, Arena *arena,
                       StateList *state)
{
    ToySplits *splits = TOY_ARRAY(1, toy->splits);
    take_mesh(toy, name, mesh, arena);
    TOY_ARRAY(splits->edges, splits->split);
    TOY_ARRAY(splits->edges, splits->wanted);
    state_add(state, splits->split, (size_t)splits->edges, "%s/split", name);
    state_add(state, splits->wanted, (size_t)splits->edges, "%s/wanted", name);
    TOY_ARRAY(16 * toy->base_faces, splits->change);
    TOY_ARRAY(splits->edges, splits->gone);
    TOY_ARRAY(splits->edges, splits->gone_parent);
    TOY_ARRAY(toy->faces, toy->face);
    TOY_ARRAY(toy->faces, toy->face_area);
    TOY_ARRAY(toy->faces, toy->finest_area);
    TOY_ARRAY(splits->edges, toy->born);
    for (int f = 0; f < toy->faces; f++)
        toy->finest_area[f] = 0.25 * toy_area(toy->splits->rest, splits->corner[f / 4]);
}
