// SPDX-License-Identifier: MIT
// Loads on a body whose topology changes: a load is a traction carried by nodes, and the sum of the
// forces is what was asked for at every tick.
#include "test.h"
#include "sim_steps.h"
#include "sim/sim_data.h"
#include "random.h"
#include "toy_body.h"

static const double CELL = 0.01; // [m]
enum { CELLS = 8 };

static void create(ToyScene *scene, int bodies)
{
    ToySceneOptions options = {.cells = CELLS,
                               .cell = CELL,
                               .lockstep = true,
                               .count = bodies,
                               .rate_hz = 1000.0,
                               .may_load = true};
    toy_scene_create(scene, &options);
}

static LoadOptions load_within(double radius)
{
    return (LoadOptions){.body = -1,
                         .center = {0.003, -0.002, 0.0},
                         .radius = radius,
                         .force = {0.3, -0.2, 0.7},
                         .duration = 1000.0};
}

static void start(ToyScene *scene, LoadOptions load)
{
    apply_well(sim_apply_load, scene->sim, &load);
}

static Vec3 sum_of_loads(const ToyScene *scene)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int b = 0; b < scene->count; b++)
        for (int i = 0; i < scene->body[b]->surface.node_count; i++)
            sum = vec3_add(sum, scene->toy[b]->load[i]);
    return sum;
}

// A few hundred shares, each rounded to 1e-16 of itself and added with as much: 1e-13 of the force.
static void expect_sum(const ToyScene *scene, Vec3 force)
{
    expect_at_most(vec3_length(vec3_sub(sum_of_loads(scene), force)), 1e-13 * vec3_length(force));
}

TEST(total_force_is_kept_through_any_change)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, 1);
    uint64_t random = 5;
    toy_want_some(scene.toy[0], 2, &random);
    toy_scene_step(&scene);
    LoadOptions load = load_within(0.025);
    start(&scene, load);
    expect_sum(&scene, load.force);
    for (int k = 0; k < 300; k++) {
        toy_want_some(scene.toy[0], k % 3 == 0 ? 2 : 20, &random);
        toy_scene_step(&scene);
        expect_sum(&scene, load.force);
    }
    assert_true(scene.toy[0]->changes > 250);
}

// On a flat sheet at rest a midpoint lies where it would have lain: a load acts on the nodes inside
// its sphere, whenever they came.
TEST(a_load_acts_on_its_patch_at_any_level)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, 1);
    LoadOptions load = load_within(0.035);
    start(&scene, load);
    const BodySurface *surface = &scene.body[0]->surface;
    uint64_t random = 9;
    double area = 0.0;
    for (int k = 0; k < 30; k++) {
        for (int e = 0; e < scene.toy[0]->splits->edges; e++)
            if (random_below(&random, 20) == 0)
                toy_want(scene.toy[0], e, true);
        toy_scene_step(&scene);
        area = 0.0;
        for (int i = 0; i < surface->node_count; i++)
            if (vec3_length(vec3_sub(scene.toy[0]->splits->rest[i], load.center)) <= load.radius)
                area += surface->node_area[i];
        // rounding of 300 terms
        expect_near(scene.sim->loads.load[0].area, area, 1e-13 * area);
    }
    // Where all around is loaded, a node takes the traction times its own area.
    int whole = 0;
    for (int i = 0; i < surface->node_count; i++) {
        Vec3 away = vec3_sub(scene.toy[0]->splits->rest[i], load.center);
        if (vec3_length(away) > load.radius - 2.0 * CELL || !(surface->node_area[i] > 0.0))
            continue;
        expect_near(scene.toy[0]->load[i].z, load.force.z * surface->node_area[i] / area, 1e-14);
        whole++;
    }
    assert_true(whole > 5);
}

// The body that was changed many times and one that went there in a single step carry the same
// bits: where midpoints would have lain follows from where the coarse nodes were, and nodes are in
// ascending order.
TEST(loads_do_not_depend_on_the_way_to_a_topology)
{
    SCOPED(toy_scene_destroy) ToyScene wandering, direct;
    create(&wandering, 1);
    create(&direct, 1);
    LoadOptions load = load_within(0.025);
    start(&wandering, load);
    start(&direct, load);
    uint64_t random = 21;
    for (int k = 0; k < 100; k++) {
        toy_want_some(wandering.toy[0], 6, &random);
        toy_scene_step(&wandering);
    }
    memcpy(direct.toy[0]->splits->wanted, wandering.toy[0]->splits->wanted,
           (size_t)direct.toy[0]->splits->edges);
    toy_scene_step(&direct);
    const LoadSet *a = &wandering.sim->loads, *b = &direct.sim->loads;
    assert_int_equal(*a->used, *b->used);
    assert_memory_equal(a->pool, b->pool, (size_t)a->pool_capacity * sizeof *a->pool);
    assert_memory_equal(a->node, b->node, (size_t)a->pool_capacity * sizeof *a->node);
    assert_memory_equal(wandering.toy[0]->load, direct.toy[0]->load,
                        (size_t)wandering.body[0]->surface.node_count * sizeof(Vec3));
    for (int64_t i = 1; i < *a->used; i++)
        assert_true(a->pool[i - 1] < a->pool[i]);
}

// A sphere around nothing but a midpoint: when it goes, the nodes between which it lay carry on.
TEST(last_node_leaves_its_load_to_its_parents)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, 1);
    Toy *toy = scene.toy[0];
    const int edge = toy->splits->edges / 2;
    toy_want_all(toy, true);
    toy_scene_step(&scene);
    LoadOptions load = load_within(0.3 * CELL);
    load.center = toy->splits->rest[toy_midpoint(toy, edge)];
    start(&scene, load);
    expect_sum(&scene, load.force);
    assert_true(toy->load[toy_midpoint(toy, edge)].z == load.force.z);
    toy_want_all(toy, false);
    toy_scene_step(&scene);
    expect_sum(&scene, load.force);
    const int *parent = toy->splits->parent[edge];
    const double *area = scene.body[0]->surface.node_area;
    for (int k = 0; k < 2; k++)
        expect_near(toy->load[parent[k]].z,
                    load.force.z * area[parent[k]] / (area[parent[0]] + area[parent[1]]), 1e-15);
    toy_want(toy, edge, true);
    toy_scene_step(&scene);
    expect_sum(&scene, load.force);
    assert_true(toy->load[toy_midpoint(toy, edge)].z > 0.0);
}

// Three levels in one change, by hand: the weight goes from child to parent as far as it must.
TEST(weight_of_the_last_nodes_passes_through_parents_that_go_too)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, 1);
    Toy *toy = scene.toy[0];
    toy_want_all(toy, true);
    toy_scene_step(&scene);
    LoadOptions load = load_within(0.3 * CELL);
    const int top = toy_midpoint(toy, 40), below = toy_midpoint(toy, 7);
    load.center = toy->splits->rest[below];
    start(&scene, load);
    const int gone[2] = {below, top};
    const int parent[2][2] = {{top, 3}, {5, 6}};
    TopologyChange change = {.gone_count = 2, .gone = gone, .gone_parent = parent};
    loads_follow(&scene.sim->loads, scene.sim->body, 1, 0, &change);
    int heirs = 0;
    for (int64_t i = 0; i < *scene.sim->loads.used; i++)
        if (scene.sim->loads.node[i].share > 0.0)
            assert_int_equal(scene.sim->loads.pool[i], heirs++ == 0 ? 3 : heirs + 3);
    assert_int_equal(heirs, 3);
    expect_sum(&scene, load.force);
}

TEST(several_loads_on_two_bodies_follow_each_change)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, 2);
    uint64_t random = 33;
    Vec3 force = {0.0, 0.0, 0.0};
    for (int k = 0; k < 40; k++) {
        toy_want_some(scene.toy[k % 2], 5, &random);
        if (k % 3 == 1)
            toy_want_some(scene.toy[0], 5, &random);
        toy_scene_step(&scene);
        if (k % 8 == 0) { // two of five end before the test does
            LoadOptions load = load_within(0.005 + 0.004 * k / 8);
            load.body = k / 8 % 3 - 1;
            load.force.x = 0.1 * k;
            load.duration = k < 16 ? 0.02 : 1000.0;
            start(&scene, load);
        }
        force = (Vec3){0.0, 0.0, 0.0};
        int64_t used = 0;
        const LoadSet *set = &scene.sim->loads;
        for (int64_t l = 0; l < *set->count; l++) {
            assert_int_equal(set->load[l].first, used); // without gaps, in order
            used += set->load[l].count;
            force = vec3_add(force, set->load[l].force);
        }
        assert_int_equal(*set->used, used);
        for (int64_t i = used; i < set->pool_capacity; i++)
            assert_true(set->pool[i] == 0 && set->node[i].share == 0.0);
        expect_sum(&scene, force);
    }
    assert_int_equal(*scene.sim->loads.count, 3);
    expect_at_least(force.x, 1.0);
}

TEST(load_of_one_body_stays_on_it)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, 2);
    LoadOptions load = load_within(0.02);
    load.body = 1;
    start(&scene, load);
    uint64_t random = 3;
    for (int k = 0; k < 20; k++) {
        toy_want_some(scene.toy[k % 2], 4, &random);
        toy_scene_step(&scene);
        for (int i = 0; i < scene.body[0]->surface.node_count; i++)
            expect_near(vec3_length(scene.toy[0]->load[i]), 0.0, 0.0);
        expect_sum(&scene, load.force);
    }
}

// Loads on every coarse node that leave no room for the midpoints: some do without, and no force is
// lost.
TEST(full_pool_loses_no_force)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, 1);
    LoadOptions load = load_within(1.0);
    const LoadSet *set = &scene.sim->loads;
    const int loads = set->pool_capacity / scene.toy[0]->base_nodes;
    for (int k = 0; k < loads; k++)
        start(&scene, load);
    toy_want_all(scene.toy[0], true);
    toy_scene_step(&scene);
    assert_int_equal(*set->used, set->pool_capacity);
    expect_sum(&scene, vec3_scale(loads, load.force));
    toy_want_all(scene.toy[0], false);
    toy_scene_step(&scene);
    assert_int_equal(*set->used, loads * scene.toy[0]->base_nodes);
    expect_sum(&scene, vec3_scale(loads, load.force));
}

// A Gaussian patch made of eight spheres keeps its shape when all around it is divided: every node
// inside a sphere takes that load's traction.
TEST(eight_wide_loads_keep_their_patches)
{
    enum { LOADS = 8 };
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, 1);
    for (int k = 0; k < LOADS; k++)
        start(&scene, load_within(0.03 + 0.005 * k));
    toy_want_all(scene.toy[0], true);
    toy_scene_step(&scene);
    const BodySurface *surface = &scene.body[0]->surface;
    for (int k = 0; k < LOADS; k++) {
        LoadOptions load = load_within(0.03 + 0.005 * k);
        double area = 0.0;
        for (int i = 0; i < surface->node_count; i++)
            if (vec3_length(vec3_sub(scene.toy[0]->splits->rest[i], load.center)) <= load.radius)
                area += surface->node_area[i];
        // rounding of 300 terms
        expect_near(scene.sim->loads.load[k].area, area, 1e-13 * area);
    }
}

TEST(reset_brings_back_loads_and_topology)
{
    SCOPED(toy_scene_destroy) ToyScene scene;
    create(&scene, 1);
    uint64_t random = 8;
    LoadOptions load = load_within(0.02);
    start(&scene, load);
    toy_want_some(scene.toy[0], 2, &random);
    toy_scene_step(&scene);
    FREED void *before = copy_state(&scene.state);
    const uint64_t hash = state_hash(&scene.state);
    const double area = scene.body[0]->mass, h = scene.body[0]->h;
    toy_want_some(scene.toy[0], 2, &random);
    toy_scene_step(&scene);
    assert_true(state_hash(&scene.state) != hash);
    resume(&scene.state, scene.sim, before);
    expect_near(scene.body[0]->mass, area, 0.0);
    expect_near(scene.body[0]->h, h, 0.0);
    expect_sum(&scene, load.force);
    toy_want_all(scene.toy[0], true); // goes on from there
    toy_scene_step(&scene);
    expect_sum(&scene, load.force);

    sim_reset(scene.sim);
    assert_int_equal(*scene.sim->loads.count, 0);
    for (int e = 0; e < scene.toy[0]->splits->edges; e++)
        assert_false(scene.toy[0]->splits->split[e]);
    expect_near(vec3_length(sum_of_loads(&scene)), 0.0, 0.0);
    expect_near(scene.body[0]->lambda, TOY_LAMBDA, 0.0); // `restored` was called
}
