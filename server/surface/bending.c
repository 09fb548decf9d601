// SPDX-License-Identifier: MIT
// Hinges between the faces of a surface body: tables and bounds. Their forces are in kernel/bend.h.
// Step thread, except for creation.
#include "surface/bending.h"

#include "base/check.h"
#include "surface/model.h"

#include <stdlib.h>
#include <string.h>

// A face smaller than this share of its rest area, squared, weakens its hinges.
static const double FADES_BELOW = 0.5;

double bending_stiffness(const SurfaceMaterial *material)
{
    if (material->bending_stiffness > 0.0)
        return material->bending_stiffness;
    // E t^3 / (12 (1 - nu^2)) with E t = E2D and nu = 1/3.
    return material->youngs_modulus_2d * material->thickness * material->thickness * 9.0 / 96.0;
}

// Two faces at an edge: x[0] and x[1] are its ends, the others the third nodes of its left and
// right face.
typedef struct Fold {
    Vec3 left, right; // normals, as long as twice the areas [m2]
    double area[2];   // twice the areas [m2]
    double length;    // of the edge [m]
} Fold;

static Fold fold_of(const Vec3 x[4])
{
    Vec3 edge = vec3_sub(x[1], x[0]);
    Fold fold = {.left = vec3_cross(edge, vec3_sub(x[2], x[0])),
                 .right = vec3_cross(vec3_sub(x[3], x[0]), edge),
                 .length = vec3_length(edge)};
    fold.area[0] = vec3_length(fold.left);
    fold.area[1] = vec3_length(fold.right);
    return fold;
}

// Returns k [N m]: D l^2 / (A_1 + A_2); 0 if a face has no area, and so no angle.
static double hinge_stiffness(const Fold *fold, double stiffness)
{
    if (!(fold->area[0] > 0.0 && fold->area[1] > 0.0))
        return 0.0;
    return stiffness * fold->length * fold->length / (0.5 * (fold->area[0] + fold->area[1]));
}

// ---------------------------------------------------------------------------------------------
// Bounds

// Adds the blocks of a hinge to the row sums of its nodes: that of two nodes is k g_i g_j^T, of
// norm k |g_i| |g_j|, with g the change of the angle with a node.
static void add_rows(const int node[4], const Vec3 *position, double stiffness, double *sum)
{
    Vec3 x[4];
    for (int i = 0; i < 4; i++)
        x[i] = position[node[i]];
    Fold fold = fold_of(x);
    double k = hinge_stiffness(&fold, stiffness), length[4], total = 0.0;
    if (k == 0.0)
        return;
    // The third nodes move at their heights, the ends of the edge balance them.
    Vec3 edge = vec3_sub(x[1], x[0]);
    double square = fold.length * fold.length;
    double s = vec3_dot(vec3_sub(x[2], x[0]), edge) / square,
           t = vec3_dot(vec3_sub(x[3], x[0]), edge) / square;
    Vec3 third = vec3_scale(fold.length / (fold.area[0] * fold.area[0]), fold.left),
         fourth = vec3_scale(fold.length / (fold.area[1] * fold.area[1]), fold.right);
    length[2] = vec3_length(third);
    length[3] = vec3_length(fourth);
    length[1] = vec3_length(vec3_add(vec3_scale(s, third), vec3_scale(t, fourth)));
    length[0] = vec3_length(vec3_add(vec3_scale(1.0 - s, third), vec3_scale(1.0 - t, fourth)));
    for (int i = 0; i < 4; i++)
        total += length[i];
    for (int i = 0; i < 4; i++)
        sum[node[i]] += k * length[i] * total;
}

// Returns the largest sum over its mass, of free nodes as for springs.
static double largest_row(const double *sum, const double *mass, const bool *fixed, int count)
{
    bool any_free = false;
    double most = 0.0;
    for (int i = 0; i < count; i++)
        any_free |= !fixed[i];
    for (int i = 0; i < count; i++)
        if (!fixed[i] || !any_free)
            most = fmax(most, sum[i] / mass[i]);
    return most / FADES_BELOW;
}

// Finds the nodes of the hinge at an edge; false at a border.
static bool hinge_at(const int end[2], const int face[2], const int (*corner)[3], int node[4])
{
    if (face[0] < 0 || face[1] < 0)
        return false;
    node[0] = end[0];
    node[1] = end[1];
    for (int side = 0; side < 2; side++) {
        const int *at = corner[face[side]];
        node[2 + side] = at[0] + at[1] + at[2] - end[0] - end[1];
    }
    return true;
}

double bending_bound(const TriMesh *mesh, const WingedMesh *winged, double stiffness,
                     const double *mass, const bool *fixed)
{
    double *sum = calloc((size_t)mesh->node_count + 1, sizeof *sum);
    ASSERT(sum != NULL);
    for (int e = 0; e < winged->edge_count; e++) {
        int node[4];
        if (hinge_at(winged->edge[e].node, winged->edge[e].face, (const int(*)[3])mesh->triangle,
                     node))
            add_rows(node, mesh->position, stiffness, sum);
    }
    double most = largest_row(sum, mass, fixed, mesh->node_count);
    free(sum);
    return most;
}

double bending_level_bound(const LevelRules *rules, int level, double stiffness, const bool *fixed)
{
    const Level *at = &rules->levels->level[level];
    double *sum = calloc((size_t)at->node_count, sizeof *sum);
    double *mass = calloc((size_t)at->node_count, sizeof *mass);
    ASSERT(sum != NULL && mass != NULL);
    // A node stands for a third of the faces around it.
    for (int f = 0; f < at->face_count; f++)
        for (int k = 0; k < 3; k++)
            mass[at->face[f][k]] += level_rules_area(rules, level, f) / 3.0;
    for (int i = 0; i < at->node_count; i++)
        mass[i] = level_rules_node_mass(rules, level, mass[i]);
    for (int e = 0; e < at->edge_count; e++) {
        int node[4];
        if (hinge_at(at->edge[e], at->edge_face[e], (const int(*)[3])at->face, node))
            add_rows(node, rules->levels->position, stiffness, sum);
    }
    double most = largest_row(sum, mass, fixed, at->node_count);
    free(sum);
    free(mass);
    return most;
}

// ---------------------------------------------------------------------------------------------
// Tables

// Returns the index of a number of a hinge.
static long value_at(const Bending *bending, int group, int value, int lane)
{
    return ((long)group * bending->hinges.values + value) * LANES + lane;
}

Bending *bending_allocate(const SurfaceModel *model, int groups, double stiffness, const char *name,
                          Arena *arena)
{
    Bending *bending = ALLOCATE(ARENA_STEP, 1, Bending, "bending");
    const int values = model->basis.displaced ? HINGE_REST + HINGE_VECTORS : HINGE_REST;
    bending->stiffness = stiffness;
    bending->capacity = groups * LANES;
    bending->hinges.values = values;
    bending->hinges.slot = ALLOCATE(ARENA_STEP, 4 * LANES * groups + 1, int, "nodes of hinges");
    bending->hinges.value = model_allocate_reals(model, (size_t)values * LANES * (size_t)groups + 1,
                                                 name, "hinges", arena);
    bending->group = ALLOCATE(ARENA_STEP, groups + 1, int, "groups of hinges");
    return bending;
}

static int groups_of(int count)
{
    return (count + LANES - 1) / LANES;
}

const int *bending_slots(const Bending *bending, int first, int count, int i)
{
    const int groups = groups_of(count);
    return bending->hinges.slot + (long)(first + i % groups) * 4 * LANES + i / groups;
}

// Fills a group; lanes without a hinge are NULL.
static void put_group(const SurfaceModel *model, Bending *bending, int group,
                      const int *const slot[LANES])
{
    // Rest vectors, in single precision as the kernel will read them.
    double vectors[HINGE_VECTORS * LANES], angle[LANES], square[2 * LANES];
    memset(vectors, 0, sizeof vectors);
    for (int lane = 0; lane < LANES; lane++)
        for (int k = 0; k < 4; k++) {
            // Without a hinge: one node four times.
            const int at = slot[lane] != NULL ? slot[lane][k] : slot[0][0];
            const int from = slot[lane] != NULL ? slot[lane][0] : at;
            bending->hinges.slot[((long)group * 4 + k) * LANES + lane] = at;
            for (int c = 0; c < 3 && k > 0; c++)
                model_put(model, vectors, (long)(3 * (k - 1) + c) * LANES + lane,
                          model->basis.rest[at][c] - model->basis.rest[from][c]);
        }
    model->kernels->bend_measure(vectors, angle, square);
    void *value = bending->hinges.value;
    for (int lane = 0; lane < LANES; lane++) {
        double k = 0.0;
        if (slot[lane] != NULL) {
            Vec3 x[4];
            for (int i = 0; i < 4; i++)
                x[i] = model_rest(model, slot[lane][i]);
            Fold fold = fold_of(x);
            k = hinge_stiffness(&fold, bending->stiffness);
        }
        model_put(model, value, value_at(bending, group, HINGE_STIFFNESS, lane), k);
        model_put(model, value, value_at(bending, group, HINGE_ANGLE, lane),
                  model_get(model, angle, lane));
        for (int side = 0; side < 2; side++)
            model_put(model, value, value_at(bending, group, HINGE_FADE + side, lane),
                      k > 0.0 ? 1.0 / (FADES_BELOW * model_get(model, square, side * LANES + lane))
                              : 0.0);
        for (int v = 0; v < bending->hinges.values - HINGE_REST; v++)
            model_put(model, value, value_at(bending, group, HINGE_REST + v, lane),
                      model_get(model, vectors, (long)v * LANES + lane));
    }
}

int bending_put(const SurfaceModel *model, Bending *bending, int first, const int (*slot)[4],
                int count)
{
    const int groups = groups_of(count);
    for (int g = 0; g < groups; g++) {
        const int *lanes[LANES];
        for (int lane = 0; lane < LANES; lane++)
            lanes[lane] = lane * groups + g < count ? slot[lane * groups + g] : NULL;
        put_group(model, bending, first + g, lanes);
    }
    return groups;
}

static int by_first_slot(const void *a, const void *b)
{
    const int *p = a, *q = b;
    for (int k = 0; k < 4; k++)
        if (p[k] != q[k])
            return p[k] < q[k] ? -1 : 1;
    return 0;
}

void bending_create(SurfaceModel *model, const TriMesh *mesh, const WingedMesh *winged,
                    double stiffness, const char *name, Arena *arena)
{
    // Hinges in the order of slots: their nodes are close in memory, and sums have one order.
    int(*slot)[4] = calloc((size_t)winged->edge_count + 1, sizeof *slot);
    int count = 0;
    ASSERT(slot != NULL);
    for (int e = 0; e < winged->edge_count; e++) {
        const WingedEdge *edge = &winged->edge[e];
        // The edge from its lower slot: left and right are then the other way round, too.
        const bool turned = model->slot[edge->node[0]] > model->slot[edge->node[1]];
        const int end[2] = {edge->node[turned], edge->node[!turned]};
        const int face[2] = {edge->face[turned], edge->face[!turned]};
        int node[4];
        if (!hinge_at(end, face, (const int(*)[3])mesh->triangle, node))
            continue;
        for (int k = 0; k < 4; k++)
            slot[count][k] = model->slot[node[k]];
        count++;
    }
    qsort(slot, (size_t)count, sizeof *slot, by_first_slot);
    Bending *bending = bending_allocate(model, groups_of(count), stiffness, name, arena);
    bending->group_count = bending_put(model, bending, 0, (const int(*)[4])slot, count);
    for (int g = 0; g < bending->group_count; g++)
        bending->group[g] = g;
    bending->hinge_count = count;
    free(slot);
    bending->force = model_allocate_reals(model, (size_t)model->basis.count * ROW, name,
                                          "bending forces", arena);
    bending->external = model_allocate_reals(model, 3 * (size_t)model->basis.count, name,
                                             "bending and outside forces", arena);
    model->bending = bending;
}

// ---------------------------------------------------------------------------------------------
// Forces and energy

void bending_add(const SurfaceModel *model, const SpringPass *pass)
{
    const Bending *bending = model->bending;
    const BendPass bend = {.hinges = &bending->hinges,
                           .group = bending->group,
                           .group_count = bending->group_count,
                           .present = pass->present,
                           .force = bending->force,
                           .damping_time = pass->damping_time};
    // Damped as the springs are: by the same time.
    model->kernels->bend[model->damped](&bend);
}

void bending_evaluate(const SurfaceModel *model, SpringPass *pass)
{
    const Bending *bending = model->bending;
    memset(bending->force, 0, (size_t)model->basis.count * ROW * model_real_size(model));
    bending_add(model, pass);
    // The kernel reads them with the external forces.
    model->kernels->bend_gather(bending->force, pass->stiffness_scale, pass->external,
                                model->springs.chunk_count, bending->external);
    pass->external = bending->external;
}

// Returns the energy of a hinge [J].
static double hinge_energy(const SurfaceModel *model, const void *rows, int group, int lane)
{
    const double pi = 3.14159265358979323846;
    const Bending *bending = model->bending;
    const void *value = bending->hinges.value;
    const double k = model_get(model, value, value_at(bending, group, HINGE_STIFFNESS, lane));
    Vec3 x[4];
    for (int i = 0; i < 4; i++)
        rows_read(&model->basis, rows, bending->hinges.slot[((long)group * 4 + i) * LANES + lane],
                  &x[i], NULL);
    Fold fold = fold_of(x);
    if (k == 0.0 || !(fold.area[0] > 0.0 && fold.area[1] > 0.0))
        return 0.0;
    double change = atan2(-vec3_dot(fold.left, vec3_sub(x[3], x[0])) * fold.length,
                          vec3_dot(fold.left, fold.right)) -
                    model_get(model, value, value_at(bending, group, HINGE_ANGLE, lane));
    change = change > pi ? change - 2.0 * pi : change < -pi ? change + 2.0 * pi : change;
    double share = 1.0;
    for (int side = 0; side < 2; side++)
        share = fmin(
            share, fold.area[side] * fold.area[side] *
                       model_get(model, value, value_at(bending, group, HINGE_FADE + side, lane)));
    return 0.5 * k * share * change * change;
}

double bending_energy(const SurfaceModel *model, const void *rows)
{
    const Bending *bending = model->bending;
    double energy = 0.0;
    for (int g = 0; g < bending->group_count; g++)
        for (int lane = 0; lane < LANES; lane++)
            energy += hinge_energy(model, rows, bending->group[g], lane);
    return energy;
}
