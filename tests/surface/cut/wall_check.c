// SPDX-License-Identifier: MIT
#include "wall_check.h"

#include "expect.h"

typedef struct Side {
    int low, high, triangle, forward;
} Side;

static int compare_sides(const void *a, const void *b)
{
    const Side *x = a, *y = b;
    if (x->low != y->low)
        return x->low < y->low ? -1 : 1;
    if (x->high != y->high)
        return x->high < y->high ? -1 : 1;
    return x->triangle - y->triangle;
}

static int root_of(int *up, int i)
{
    while (up[i] != i)
        i = up[i] = up[up[i]];
    return i;
}

static int find_corner(const int corner[3], int node)
{
    return corner[0] == node ? 0 : corner[1] == node ? 1 : 2;
}

// Corners of triangles at the same node, joined across edges, are one set a node.
static void expect_fans(const BodyMesh *mesh, const Side *side, int sides)
{
    FREED int *up = calloc((size_t)mesh->triangle_count * 3, sizeof *up);
    FREED int *fans = calloc((size_t)mesh->node_count, sizeof *fans);
    for (int i = 0; i < 3 * mesh->triangle_count; i++)
        up[i] = i;
    for (int i = 0; i + 1 < sides; i++) {
        if (side[i].low != side[i + 1].low || side[i].high != side[i + 1].high)
            continue;
        const int node[2] = {side[i].low, side[i].high};
        for (int k = 0; k < 2; k++) {
            int a = 3 * side[i].triangle + find_corner(mesh->triangle[side[i].triangle], node[k]);
            int b = 3 * side[i + 1].triangle +
                    find_corner(mesh->triangle[side[i + 1].triangle], node[k]);
            up[root_of(up, a)] = root_of(up, b);
        }
    }
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3 && mesh->triangle[t][0] != mesh->triangle[t][1]; k++)
            fans[mesh->triangle[t][k]] += root_of(up, 3 * t + k) == 3 * t + k;
    for (int i = 0; i < mesh->node_count; i++)
        if (fans[i] != (mesh->id[i] >= 0))
            fail_msg("node %d has %d fans", mesh->id[i], fans[i]);
}

// Border sides lead from node to node; each node has at most one that begins there.
static int count_borders(const BodyMesh *mesh, const Side *side, int sides, int *border_edges)
{
    size_t nodes = mesh->node_count > 0 ? (size_t)mesh->node_count : 1;
    int *next = calloc(nodes, sizeof *next), borders = 0;
    FREED int *into = calloc(nodes, sizeof *into);
    for (int i = 0; i < mesh->node_count; i++)
        next[i] = -1;
    *border_edges = 0;
    for (int i = 0; i < sides; i++) {
        bool inner =
            (i > 0 && side[i].low == side[i - 1].low && side[i].high == side[i - 1].high) ||
            (i + 1 < sides && side[i].low == side[i + 1].low && side[i].high == side[i + 1].high);
        if (inner)
            continue;
        int from = side[i].forward ? side[i].low : side[i].high;
        int to = side[i].forward ? side[i].high : side[i].low;
        assert_int_equal(next[from], -1);
        next[from] = to;
        into[to]++;
        ++*border_edges;
    }
    for (int i = 0; i < mesh->node_count; i++)
        assert_int_equal(into[i], next[i] >= 0);
    for (int i = 0; i < mesh->node_count; i++) {
        borders += next[i] >= 0;
        for (int at = i; next[at] >= 0;) {
            int to = next[at];
            next[at] = -1;
            at = to;
        }
    }
    free(next);
    return borders;
}

static int count_pieces(const BodyMesh *mesh, const Side *side, int sides)
{
    size_t nodes = mesh->node_count > 0 ? (size_t)mesh->node_count : 1;
    int *up = calloc(nodes, sizeof *up), pieces = 0;
    FREED int *holder = calloc(nodes, sizeof *holder);
    for (int i = 0; i < mesh->node_count; i++)
        up[i] = i;
    for (int i = 0; i < sides; i++) {
        assert_int_equal(mesh->piece[side[i].low], mesh->piece[side[i].high]);
        up[root_of(up, side[i].low)] = root_of(up, side[i].high);
    }
    for (int i = 0; i < mesh->node_count; i++)
        if (mesh->id[i] >= 0 && root_of(up, i) == i)
            holder[pieces++] = mesh->piece[i];
    for (int a = 0; a < pieces; a++)
        for (int b = 0; b < a; b++)
            assert_int_not_equal(holder[a], holder[b]);
    free(up);
    return pieces;
}

WallShape wall_expect_manifold(const BodyMesh *mesh, int handles)
{
    WallShape shape = {0};
    FREED Side *side = calloc((size_t)mesh->triangle_count * 3, sizeof *side);
    int sides = 0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *corner = mesh->triangle[t];
        if (corner[0] == corner[1])
            continue;
        shape.faces++;
        for (int k = 0; k < 3; k++) {
            int a = corner[k], b = corner[(k + 1) % 3];
            assert_true(a != b && mesh->id[a] >= 0);
            side[sides++] = (Side){a < b ? a : b, a < b ? b : a, t, a < b};
        }
    }
    qsort(side, (size_t)sides, sizeof *side, compare_sides);
    for (int i = 0; i < sides; i++) {
        bool same = i > 0 && side[i].low == side[i - 1].low && side[i].high == side[i - 1].high;
        shape.edges += !same;
        if (!same)
            continue;
        assert_true(side[i].forward != side[i - 1].forward);
        assert_true(i < 2 || side[i].low != side[i - 2].low || side[i].high != side[i - 2].high);
    }
    for (int i = 0; i < mesh->node_count; i++)
        shape.nodes += mesh->id[i] >= 0;
    expect_fans(mesh, side, sides);
    shape.borders = count_borders(mesh, side, sides, &shape.border_edges);
    shape.pieces = count_pieces(mesh, side, sides);
    int euler = shape.nodes - shape.edges + shape.faces;
    assert_int_equal(euler, 2 * shape.pieces - shape.borders - 2 * handles);
    return shape;
}

void wall_expect_locked(const DetailBench *bench)
{
    const Detail *detail = bench->detail;
    const DetailCut *cut = detail->set.cut;
    for (int f = 0; f < detail->set.face_count; f++) {
        int level = detail->set.levels.finest, face = f;
        while (!detail_exists(&detail->set, level, face))
            level--, face /= 4;
        if (level == detail->set.levels.finest)
            continue;
        assert_int_equal(cut->broken[f] & ~CUT_COAGULATED, 0);
        for (int k = 0; k < 3; k++)
            assert_int_equal(cut->node[f][k], cut->base[f][k]);
    }
}

double wall_stiffness(const DetailBench *bench)
{
    const SurfaceModel *model = bench->model;
    const SpringTable *springs = &model->springs;
    double sum = 0.0;
    for (int i = 0; i < bench->detail->set.node_count; i++) {
        if (bench->detail->set.status[i] == NODE_OFF)
            continue;
        int lane = model->lane[model->slot[i]], chunk = lane / LANES;
        for (int e = springs->start[chunk]; e < springs->end[chunk]; e++)
            sum += 0.5 * model_get(model, springs->stiffness, (long)e * LANES + lane % LANES);
    }
    return sum;
}

double wall_expected_stiffness(const DetailBench *bench)
{
    const Detail *detail = bench->detail;
    double sum = 0.0;
    for (int l = 0; l <= detail->set.levels.finest; l++)
        for (int f = 0; f < detail->set.levels.level[l].face_count; f++)
            for (int k = 0; k < 3 && detail_is_leaf(&detail->set, l, f); k++) {
                const int *corner = detail->set.levels.level[l].face[f];
                Vec3 a = model_rest(bench->model, bench->model->slot[corner[k]]);
                Vec3 b = model_rest(bench->model, bench->model->slot[corner[(k + 1) % 3]]);
                Vec3 edge = vec3_sub(a, b);
                sum += detail->options.material.youngs_modulus_2d *
                       level_rules_area(&detail->rules, l, f) / vec3_dot(edge, edge);
            }
    return sum;
}
