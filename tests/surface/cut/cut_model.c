// SPDX-License-Identifier: MIT
#include "cut_model.h"

#include "expect.h"
#include "geometry/generator.h"

const char *const CUT_SHAPE_NAME[CUT_ORGANS] = {"sphere", "sheet", "tube", "stomach",
                                                "gallbladder"};

// --- shapes ---

enum { TUBE_AROUND = 12, TUBE_ALONG = 7 };

static void make_tube(TriMesh *mesh)
{
    const double pi = 3.14159265358979323846;
    mesh_create(mesh, TUBE_AROUND * (TUBE_ALONG + 1), 2 * TUBE_AROUND * TUBE_ALONG);
    for (int j = 0; j <= TUBE_ALONG; j++)
        for (int i = 0; i < TUBE_AROUND; i++) {
            // A quarter of a ring of radius 0.12 m: edges along it are twice those around.
            double bend = 1.8 * j / TUBE_ALONG, turn = 2.0 * pi * i / TUBE_AROUND;
            double out = 0.12 + 0.03 * cos(turn);
            mesh->position[j * TUBE_AROUND + i] =
                vec3(out * cos(bend), out * sin(bend), 0.03 * sin(turn));
        }
    for (int j = 0, t = 0; j < TUBE_ALONG; j++)
        for (int i = 0; i < TUBE_AROUND; i++) {
            int a = j * TUBE_AROUND + i, b = j * TUBE_AROUND + (i + 1) % TUBE_AROUND;
            const int two[2][3] = {{a, a + TUBE_AROUND, b}, {b, a + TUBE_AROUND, b + TUBE_AROUND}};
            memcpy(mesh->triangle[t], two, sizeof two);
            t += 2;
        }
}

static void make_mesh(TriMesh *mesh, CutShape shape)
{
    bool ok = true;
    if (shape == CUT_SPHERE)
        ok = generate_ico_sphere(mesh, 1, 0.05, &(Status){0});
    else if (shape == CUT_SHEET)
        ok = generate_sheet(mesh, 9, 9, 0.1, 0.1, &(Status){0});
    else if (shape == CUT_TUBE)
        make_tube(mesh);
    else
        ok = generate_stomach(mesh, shape == CUT_STOMACH ? 188 : 258,
                              shape == CUT_STOMACH ? 0.25 : 0.06, &(Status){0});
    if (!ok)
        abort();
}

// --- creation ---

static void make_rings(CutModel *model)
{
    const Level *level = model->level;
    int *start = calloc((size_t)model->vertices + 1, sizeof *start);
    int *ring = calloc(3 * (size_t)model->faces, sizeof *ring);
    FREED int *fill = calloc((size_t)model->vertices, sizeof *fill);
    for (int f = 0; f < model->faces; f++)
        for (int k = 0; k < 3; k++)
            start[level->face[f][k] + 1]++;
    for (int v = 0; v < model->vertices; v++)
        start[v + 1] += start[v];
    for (int f = 0; f < model->faces; f++)
        for (int k = 0; k < 3; k++) {
            int v = level->face[f][k];
            ring[start[v] + fill[v]++] = f;
        }
    model->ring_start = start;
    model->ring = ring;
}

void cut_model_create(CutModel *model, CutShape shape)
{
    memset(model, 0, sizeof *model);
    model->shape = shape;
    make_mesh(&model->mesh, shape);
    MeshFault fault;
    if (!mesh_check(&model->mesh, &fault))
        abort();
    const int finest = shape == CUT_GALLBLADDER ? 0 : 2;
    if (!levels_create(&model->levels, &model->mesh, finest, "body", &model->arena, &(Status){0}))
        abort();
    model->level = &model->levels.level[finest];
    model->faces = model->level->face_count;
    model->vertices = model->level->node_count;
    double sum = 0.0;
    for (int e = 0; e < model->level->edge_count; e++)
        sum += vec3_length(vec3_sub(model->levels.position[model->level->edge[e][0]],
                                    model->levels.position[model->level->edge[e][1]]));
    model->h = sum / model->level->edge_count;
    cut_find_create(&model->finder, model->level, vec3(0.01, 0.02, 0.03), model->h, "body",
                    &model->arena);
    cut_find_reserve_blades(&model->finder, 1, "body", &model->arena, &model->state);
    make_rings(model);
    size_t faces = (size_t)model->faces;
    model->all = calloc(faces, sizeof *model->all);
    for (int f = 0; f < model->faces; f++)
        model->all[f] = f;
    model->broken = calloc(faces, 1);
    model->corner = calloc(faces, sizeof *model->corner);
    model->old_corner = calloc(faces, sizeof *model->corner);
    model->origin = calloc(3 * faces, sizeof *model->origin);
    model->x = calloc(3 * faces, sizeof *model->x);
    model->old_x = calloc(3 * faces, sizeof *model->x);
    model->shown = calloc(3 * faces, sizeof *model->shown);
    model->crossing = calloc((size_t)model->level->edge_count, sizeof *model->crossing);
    model->root = calloc(3 * faces, sizeof *model->root);
    model->id = calloc(3 * faces, sizeof *model->id);
    model->piece = calloc(3 * faces, sizeof *model->piece);
    cut_model_reset(model, 0.0);
    print_message("%s\n", CUT_SHAPE_NAME[shape]);
}

void cut_model_destroy(CutModel *model)
{
    void *all[] = {model->ring_start, model->ring,   model->all, model->broken, model->corner,
                   model->old_corner, model->origin, model->x,   model->old_x,  model->shown,
                   model->crossing,   model->root,   model->id,  model->piece};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        free(all[i]);
    mesh_destroy(&model->mesh);
    state_destroy(&model->state);
    arena_destroy(&model->arena);
}

void cut_model_reset(CutModel *model, double bend)
{
    memset(model->broken, 0, (size_t)model->faces);
    memcpy(model->corner, model->level->face, (size_t)model->faces * sizeof *model->corner);
    model->node_count = model->vertices;
    memset(model->crossing, 0, (size_t)model->level->edge_count * sizeof *model->crossing);
    for (int v = 0; v < model->vertices; v++) {
        model->origin[v] = v;
        model->x[v] = cut_model_deformed(model, model->levels.position[v], bend);
    }
}

Vec3 cut_model_deformed(const CutModel *model, Vec3 rest, double amount)
{
    const double size = model->shape == CUT_TUBE ? 0.15 : model->shape == CUT_STOMACH ? 0.25 : 0.1;
    Vec3 p = vec3_scale(1.0 / size, rest);
    Vec3 bent = {p.x + amount * (0.3 * p.y + 0.25 * p.z * p.z),
                 p.y * (1.0 + 0.4 * amount) + amount * 0.2 * sin(5.0 * p.x),
                 p.z * (1.0 - 0.3 * amount) + amount * (0.35 * p.x * p.x + 0.12 * sin(9.0 * p.y))};
    // And twisted about x.
    double angle = 0.8 * amount * p.x, c = cos(angle), s = sin(angle);
    return vec3(size * bent.x, size * (c * bent.y - s * bent.z), size * (s * bent.y + c * bent.z));
}

void cut_model_deform(CutModel *model, double amount)
{
    for (int n = 0; n < model->node_count; n++)
        model->x[n] = cut_model_deformed(model, model->levels.position[model->origin[n]], amount);
}

CutTissue cut_model_tissue(const CutModel *model)
{
    return (CutTissue){.face = model->all,
                       .face_count = model->faces,
                       .corner = (const int(*)[3])model->corner,
                       .position = model->x,
                       .broken = model->broken};
}

// --- union-find: the smaller becomes the root ---

static int find_root(int *root, int i)
{
    while (root[i] != i)
        i = root[i] = root[root[i]];
    return i;
}

static void join(int *root, int a, int b)
{
    a = find_root(root, a);
    b = find_root(root, b);
    if (a < b)
        root[b] = a;
    else
        root[a] = b;
}

// --- the rule: the faces around a vertex, joined across whole links, share a node ---

static int corner_at(const CutModel *model, int face, int vertex)
{
    int k = 0;
    while (model->level->face[face][k] != vertex)
        k++;
    return k;
}

// Joins the faces around a vertex; root[] holds places in the ring.
static void join_ring(const CutModel *model, int vertex, int *root)
{
    const int *ring = model->ring + model->ring_start[vertex];
    int count = model->ring_start[vertex + 1] - model->ring_start[vertex];
    for (int i = 0; i < count; i++)
        root[i] = i;
    for (int i = 0; i < count; i++) {
        int k = corner_at(model, ring[i], vertex);
        for (int s = 0; s < 2; s++) {
            int side = s ? (k + 2) % 3 : k;
            int beyond =
                levels_beyond(model->level, model->level->face_edge[ring[i]][side], ring[i]);
            if (beyond < 0 || model->broken[ring[i]] >> side & 1)
                continue;
            int j = 0;
            while (ring[j] != beyond)
                j++;
            join(root, i, j);
        }
    }
}

static void split_vertices(CutModel *model)
{
    memcpy(model->old_corner, model->corner, (size_t)model->faces * sizeof *model->corner);
    memcpy(model->old_x, model->x, (size_t)model->node_count * sizeof *model->x);
    model->node_count = model->vertices;
    for (int v = 0; v < model->vertices; v++) {
        const int *ring = model->ring + model->ring_start[v];
        int count = model->ring_start[v + 1] - model->ring_start[v], node[64], *root = model->root;
        join_ring(model, v, root);
        for (int i = 0; i < count; i++) {
            int k = corner_at(model, ring[i], v), first = find_root(root, i);
            if (first == i) {
                node[i] = i == 0 ? v : model->node_count++;
                model->origin[node[i]] = v;
                model->x[node[i]] = model->old_x[model->old_corner[ring[i]][k]];
            }
            model->corner[ring[i]][k] = node[first];
        }
    }
}

void cut_model_break(CutModel *model)
{
    for (int i = 0; i < model->finder.count; i++) {
        int e = model->finder.edge[i];
        for (int s = 0; s < 2; s++) {
            int face = model->level->edge_face[e][s], k = 0;
            while (model->level->face_edge[face][k] != e)
                k++;
            model->broken[face] |= (unsigned char)(1 << k);
        }
    }
    split_vertices(model);
}

void cut_model_show(CutModel *model)
{
    const LipMesh mesh = {.level = model->level,
                          .rest = model->levels.position,
                          .broken = model->broken,
                          .crossing = model->crossing,
                          .h = model->h};
    memcpy(model->shown, model->x, (size_t)model->node_count * sizeof *model->x);
    for (int v = 0; v < model->vertices; v++) {
        Lip lip[LIPS_RING];
        const int face = model->ring[model->ring_start[v]];
        const int count = cut_lips_place(&mesh, face, corner_at(model, face, v), lip);
        for (int i = 0; i < count; i++) {
            const int *corner = model->corner[lip[i].face], k = lip[i].corner;
            const Vec3 x = model->x[corner[k]];
            Vec3 *at = &model->shown[corner[k]];
            *at = x;
            for (int s = 0; s < 2; s++)
                *at =
                    vec3_madd(*at, lip[i].share[s], vec3_sub(model->x[corner[(k + s + 1) % 3]], x));
        }
    }
}

CutVerdict cut_model_cut(CutModel *model, const BladeEdge *edge, int edges, CutCare care)
{
    CutTissue tissue = cut_model_tissue(model);
    CutVerdict verdict = cut_find_whole(&model->finder, &tissue, edge, edges);
    if (verdict == CUT_DONE && care != CUT_PLAIN)
        verdict = cut_smooth(&model->finder, &tissue, edge, edges);
    if (verdict != CUT_DONE)
        return verdict;
    cut_lips_whole(&model->finder, &tissue, edge, edges, model->levels.position, model->crossing);
    cut_model_break(model);
    return verdict;
}

int cut_model_stroke(CutModel *model, const CutSweep *sweep)
{
    const CutTissue tissue = cut_model_tissue(model);
    const CutVerdict verdict = cut_find_tick(&model->finder, &tissue, sweep);
    assert_true(verdict == CUT_DONE || verdict == CUT_MET_NOTHING || verdict == CUT_WAS_CUT);
    if (verdict != CUT_DONE)
        return 0;
    cut_lips_tick(&model->finder, &tissue, model->levels.position, model->crossing);
    cut_model_break(model);
    return model->finder.count;
}

// Joins faces across unbroken links. No border is broken, and a link is broken for both its faces.
static void find_pieces(const CutModel *model)
{
    for (int f = 0; f < model->faces; f++)
        model->root[f] = f;
    for (int f = 0; f < model->faces; f++)
        for (int k = 0; k < 3; k++) {
            const int e = model->level->face_edge[f][k], beyond = levels_beyond(model->level, e, f);
            const bool broken = model->broken[f] >> k & 1;
            if (beyond < 0) {
                assert_false(broken);
                continue;
            }
            int j = 0;
            while (model->level->face_edge[beyond][j] != e)
                j++;
            assert_int_equal(broken, model->broken[beyond] >> j & 1);
            if (!broken)
                join(model->root, f, beyond);
        }
}

int cut_model_copies(const CutModel *model)
{
    return model->node_count - model->vertices;
}

WallShape cut_model_expect_sound(CutModel *model)
{
    for (int i = 0; i < model->node_count; i++)
        model->id[i] = i;
    find_pieces(model);
    for (int f = 0; f < model->faces; f++)
        for (int k = 0; k < 3; k++) {
            const int node = model->corner[f][k];
            assert_int_equal(model->origin[node], model->level->face[f][k]);
            model->piece[node] = find_root(model->root, f);
        }
    const BodyMesh mesh = {.node_count = model->node_count,
                           .triangle_count = model->faces,
                           .triangle = (const int(*)[3])model->corner,
                           .id = model->id,
                           .piece = model->piece};
    return wall_expect_manifold(&mesh, 0); // all shapes are parts of a sphere
}
