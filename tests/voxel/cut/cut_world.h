// SPDX-License-Identifier: MIT
// A real cuttable voxel body in a Sim: cuts by sweeps and strokes, and what must hold afterwards.
#ifndef PLIANT_TESTS_CUT_WORLD_H
#define PLIANT_TESTS_CUT_WORLD_H

#include "expect.h"
#include "random.h"
#include "sim/follow.h"
#include "voxel_world.h"

#include "voxel/cut/cut_body.h"
#include "voxel/cut/cut_shape.h"

#include <stdlib.h>
#include <string.h>
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

typedef struct CutWorld {
    Lattice lattice;
    SolidMaterial material;
    Arena arena;
    StateList state;
    Sim *sim;
    Body *body;
    VoxelModel *model;
    VoxelCuts *cuts;  // of the model
    double rest_mass; // sum rho V [kg]
} CutWorld;

// Takes over the lattice of the options.
static inline bool cut_world_try(CutWorld *world, VoxelWorldOptions *options, Status *status)
{
#ifdef __SSE2__
    _mm_setcsr(_mm_getcsr() | 0x8040); // flush to zero, as the daemon does
#endif
    *world = (CutWorld){.lattice = options->lattice, .material = options->material};
    VoxelOptions *body = &options->body;
    body->lattice = &world->lattice;
    body->body.cuttable = true;
    if (body->split_budget == 0)
        body->split_budget = 16;
    static SolidMaterial table[LATTICE_MATERIALS];
    for (int m = 0; m < LATTICE_MATERIALS; m++)
        table[m] = options->material;
    if (body->material_count == 0) {
        body->material = table;
        body->material_count = LATTICE_MATERIALS;
    }
    const SimOptions sim = {.rate_hz = options->rate_hz,
                            .gravity = body->body.gravity,
                            .tool_timeout_s = 1e9,
                            .may_load = true};
    world->sim = sim_create(&sim, &world->arena, &world->state);
    Body made = {0};
    if (!voxel_create(&made, body, &world->arena, &world->state, status))
        return false;
    world->body = sim_add_body(world->sim, &made);
    world->model = world->body->model;
    world->cuts = world->model->cuts;
    for (int t = 0; t < options->tool_count; t++)
        sim_add_tool(world->sim, &options->tool[t]);
    for (long c = 0;
         c < (long)world->lattice.count[0] * world->lattice.count[1] * world->lattice.count[2]; c++)
        if (world->lattice.label[c] != 0)
            world->rest_mass +=
                body->material[world->lattice.label[c] - 1].density * pow(world->lattice.size, 3.0);
    return sim_seal(world->sim, 0.0, status);
}

static inline void cut_world_create(CutWorld *world, VoxelWorldOptions *options)
{
    Status status = {0};
    if (!cut_world_try(world, options, &status)) {
        print_error("%s\n", status.text);
        fail();
    }
}

static inline void cut_world_destroy(CutWorld *world)
{
    lattice_destroy(&world->lattice);
    state_destroy(&world->state);
    arena_destroy(&world->arena);
}

// Of the vertices that may move: about the origin.
typedef struct WorldMomentum {
    Vec3 linear, angular;
    double linear_sum, angular_sum; // of the absolute values
} WorldMomentum;

static inline WorldMomentum cut_world_momentum(const CutWorld *world)
{
    const Vertices *vertices = &world->model->vertices;
    WorldMomentum sum = {0};
    for (int i = 0; i < vertices->count; i++) {
        if (vertices_is_fixed(vertices, i))
            continue;
        Vec3 x, v;
        rows_read(&vertices->rows, vertices_row(vertices), i, &x, &v);
        Vec3 p = vec3_scale(vertices->mass[i], v), l = vec3_cross(x, p);
        sum.linear = vec3_add(sum.linear, p);
        sum.angular = vec3_add(sum.angular, l);
        sum.linear_sum += vec3_length(p);
        sum.angular_sum += vec3_length(x) * vec3_length(p);
    }
    return sum;
}

// A spin, a drift and waves, so that nothing is at rest.
static inline void cut_world_shake(CutWorld *world, double strain, uint64_t *seed)
{
    Vertices *vertices = &world->model->vertices;
    const double size = world->lattice.size;
    Vec3 spin = vec3_scale(4.0, random_vec3(seed)), drift = vec3_scale(0.5, random_vec3(seed));
    Vec3 wave = vec3_scale(0.3 / size, random_vec3(seed));
    for (int i = 0; i < vertices->count; i++) {
        Vec3 x, v;
        void *row = vertices->row[vertices->current];
        rows_read(&vertices->rows, row, i, &x, &v);
        Vec3 u = vec3_scale(strain * size, vec3(sin(vec3_dot(wave, x)), cos(vec3_dot(wave, x)),
                                                sin(2.0 * vec3_dot(wave, x))));
        if (vertices_is_fixed(vertices, i))
            continue;
        v = vec3_add(vec3_add(drift, vec3_cross(spin, x)), vec3_scale(5.0, u));
        rows_write(&vertices->rows, row, i, vec3_add(x, u), v);
    }
    if (world->cuts->carry != NULL)
        cut_carry_forget(world->cuts->carry);
}

// Masses from the bits and levels alone, in the plainest way; and positive, with the known sum.
static inline void cut_world_check_masses(const CutWorld *world)
{
    const VoxelModel *model = world->model;
    const CutMasses *masses = &world->cuts->masses;
    const CutLattice *lattice = &world->cuts->lattice;
    const Vertices *vertices = &model->vertices;
    assert_int_equal(vertices->count, cut_lattice_used(lattice));
    double *mass = calloc((size_t)vertices->count + 1, sizeof *mass), sum = 0.0;
    for (int e = 0; e < lattice->element_count; e++) {
        if (!cut_lattice_is_leaf(lattice, e))
            continue;
        const int *node = cut_lattice_nodes(lattice, e);
        const CutElement *of = &lattice->element[e];
        double own = masses->mass[of->level * masses->material_count + of->material - 1];
        Template shape;
        const unsigned mask = e < lattice->level_first[1] ? 0 : template_mask_of(node);
        template_create(&shape, mask);
        if (cut_shape_is_partial(lattice, e)) {
            uint64_t solid[1 << (3 * VOXEL_LEVELS_MAX - 6)];
            template_create_partial(&shape, mask, cut_shape_solid(lattice, e, solid), solid);
            own *= shape.share;
        }
        for (int i = 0; i < shape.count; i++)
            mass[node[shape.node[i]]] +=
                model->law == VOXEL_MIYAZAKI2004 ? own / shape.count : own * shape.weight[i] / 8.0;
    }
    for (int v = 0; v < vertices->count; v++) {
        assert_true(vertices->mass[v] > 0.0 || lattice->anchor[v] < 0 ||
                    cut_lattice_is_carried(lattice, v));
        expect_near(vertices->mass[v], mass[v], 1e-12 * mass[v]); // sums in another order
        sum += vertices->mass[v];
    }
    expect_near(sum, world->rest_mass, 1e-12 * world->rest_mass);
    expect_near(world->body->mass, world->rest_mass, 1e-12 * world->rest_mass);
    free(mass);
}

// A plane sweep across everything within `reach` of a point: the edge passes along `along`.
static inline CutOptions cut_world_sweep(Vec3 middle, Vec3 edge, Vec3 along, double half_edge,
                                         double from, double to)
{
    CutOptions cut = {.body = 0};
    edge = vec3_unit(edge);
    along = vec3_unit(along);
    for (int k = 0; k < 2; k++) {
        Vec3 end = vec3_madd(middle, k == 0 ? -half_edge : half_edge, edge);
        cut.before.end[k] = vec3_madd(end, from, along);
        cut.after.end[k] = vec3_madd(end, to, along);
    }
    return cut;
}

static inline bool cut_world_cut(CutWorld *world, const CutOptions *cut, CutOutcome *outcome)
{
    char why[SIM_EVENT_TEXT];
    return sim_apply_cut(world->sim, cut, outcome, why, sizeof why);
}

// Finds leaves among `count` random elements of level 1 or more, some perhaps twice. Returns how
// many.
static inline int cut_world_random_leaves(const CutWorld *world, uint64_t *seed, int count,
                                          int *leaf)
{
    const CutLattice *lattice = &world->cuts->lattice;
    const int first = lattice->level_first[1], larger = lattice->element_count - first;
    int found = 0;
    for (int k = 0; k < count; k++) {
        const int element = first + random_below(seed, larger);
        if (cut_lattice_is_leaf(lattice, element))
            leaf[found++] = element;
    }
    return found;
}

typedef struct CutWorldDivision {
    VoxelCuts *cuts;
    const int *element;
    int count;
} CutWorldDivision;

static inline bool cut_world_make_division(Sim *sim, int body, void *context,
                                           TopologyChange *change)
{
    const CutWorldDivision *division = context;
    *change = (TopologyChange){0};
    return cut_lattice_divide(&division->cuts->lattice, division->element, division->count) > 0 &&
           cut_body_follow(division->cuts, &sim->body[body], true, false, change);
}

// Divides leaves, and what must be before them.
static inline void cut_world_divide(CutWorld *world, const int *element, int count)
{
    CutWorldDivision division = {world->cuts, element, count};
    change_body(world->sim, 0, cut_world_make_division, &division);
}

// Divides those among `count` random elements that are leaves.
static inline void cut_world_divide_some(CutWorld *world, uint64_t *seed, int count)
{
    FREED int *leaf = malloc((size_t)count * sizeof *leaf);
    cut_world_divide(world, leaf, cut_world_random_leaves(world, seed, count, leaf));
}

// A random plane through the body, whole or stopping inside.
static inline CutOptions cut_world_random(const CutWorld *world, uint64_t *seed)
{
    const int *n = world->lattice.count;
    const double size = world->lattice.size, reach = size * (n[0] + n[1] + n[2]);
    Vec3 middle = vec3_scale(0.3 * reach / 2.0, random_vec3(seed));
    const bool whole = random_below(seed, 2) == 0;
    return cut_world_sweep(middle, random_vec3(seed), random_vec3(seed), reach, -reach,
                           whole ? reach : random_between(seed, -0.2, 0.2) * reach);
}

#endif
