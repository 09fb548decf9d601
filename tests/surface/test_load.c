// SPDX-License-Identifier: MIT
// Loads: who shares them, how long they last, when they are refused.
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"

#include "sim/load.h"

TEST(load_is_shared_by_nodal_area_and_sums_to_its_force)
{
    FixtureOptions options = fixture_loadable();
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    LoadOptions load = {
        .center = {0.0, 0.0, 0.05}, .radius = 0.03, .force = {0.1, 0.2, -0.3}, .duration = 0.001};
    apply_well(sim_apply_load, fixture.sim, &load);
    int inside = 0, substeps = fixture.body->substeps;
    double area = 0.0;
    const BodySurface *surface = &fixture.body->surface;
    for (int i = 0; i < surface->node_count; i++)
        if (vec3_length(vec3_sub(fixture.mesh.position[i], load.center)) <= load.radius) {
            area += surface->node_area[i];
            inside++;
        }
    assert_true(inside > 3 && inside < surface->node_count / 2);
    assert_int_equal(substeps, 1);
    fixture_run(&fixture, 1);
    // The first kick from rest: the momentum of a node is its share of the force times the tick.
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int i = 0; i < surface->node_count; i++) {
        Vec3 p = vec3_scale(surface->node_mass[i], fixture.v[i]);
        bool takes = vec3_length(vec3_sub(fixture.mesh.position[i], load.center)) <= load.radius;
        Vec3 share = vec3_scale(takes ? 1e-3 * surface->node_area[i] / area : 0.0, load.force);
        // Rounding of the springs' forces (1 N) over the tick.
        expect_at_most(vec3_length(vec3_sub(p, share)), 1e-16);
        sum = vec3_add(sum, p);
    }
    expect_at_most(vec3_length(vec3_sub(sum, vec3_scale(1e-3, load.force))), 1e-16);
}

// Momentum gained in one tick by a body that nothing else acts on [N s].
static double gain_of_a_tick(Fixture *fixture)
{
    double before = 0.0, after = 0.0;
    const double *mass = fixture->body->surface.node_mass;
    fixture_read(fixture);
    for (int i = 0; i < fixture->mesh.node_count; i++)
        before += mass[i] * fixture->v[i].x;
    fixture_run(fixture, 1);
    for (int i = 0; i < fixture->mesh.node_count; i++)
        after += mass[i] * fixture->v[i].x;
    return after - before;
}

TEST(load_lasts_its_duration_in_ticks)
{
    static const struct {
        double duration;
        int ticks;
    } cases[] = {{0.0, 1}, {0.0004, 1}, {0.001, 1}, {0.0149, 15}, {0.015, 15}, {0.0154, 15}};
    for (int k = 0; k < 6; k++) {
        FixtureOptions options = fixture_loadable();
        options.shape.wanted = false;
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        fixture_run(&fixture, 5);
        LoadOptions load = fixture_everywhere;
        load.duration = cases[k].duration;
        apply_well(sim_apply_load, fixture.sim, &load);
        for (int tick = 0; tick < 20; tick++) // 1 ms of 0.3 N, or rounding
            expect_near(gain_of_a_tick(&fixture), tick < cases[k].ticks ? 3e-4 : 0.0, 1e-15);
    }
}

TEST(scene_loads_start_at_their_time_and_add_up)
{
    FixtureOptions options = fixture_loadable();
    options.shape.wanted = false;
    options.may_load = false;
    LoadOptions load[2] = {fixture_everywhere, fixture_everywhere};
    load[0].start = 0.008; // given out of order
    load[0].duration = 0.002;
    load[1].start = 0.005;
    load[1].duration = 0.004;
    options.load = load;
    options.load_count = 2;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    static const int expected[12] = {0, 0, 0, 0, 0, 1, 1, 1, 2, 1, 0, 0};
    for (int tick = 0; tick < 12; tick++)
        expect_near(gain_of_a_tick(&fixture), 3e-4 * expected[tick], 1e-15); // rounding
}

TEST(load_on_nothing_is_refused)
{
    FixtureOptions options = fixture_loadable();
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    uint64_t before = state_hash(&fixture.state);
    LoadOptions load = fixture_everywhere;
    load.center = vec3(1.0, 2.0, 3.0);
    load.radius = 0.5;
    char why[128] = "";
    assert_false(sim_apply_load(fixture.sim, &load, why, sizeof why));
    assert_non_null(strstr(why, "no node within 0.5 m of (1, 2, 3)"));
    assert_true(state_hash(&fixture.state) == before);
}

TEST(load_on_held_nodes_alone_is_refused)
{
    const FixedRegion top = {.kind = FIXED_BOX, .low = {-1.0, -1.0, 0.02}, .high = {1.0, 1.0, 1.0}};
    FixtureOptions options = fixture_loadable();
    options.fixed = &top;
    options.fixed_count = 1;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    LoadOptions load = fixture_everywhere;
    load.center = vec3(0.0, 0.0, 0.05);
    load.radius = 0.02;
    char why[128] = "";
    assert_false(sim_apply_load(fixture.sim, &load, why, sizeof why));
    assert_non_null(strstr(why, "free"));
}

TEST(full_set_of_loads_refuses_and_takes_again_when_one_ended)
{
    FixtureOptions options = fixture_loadable();
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    LoadOptions load = fixture_everywhere;
    load.center = fixture.mesh.position[5];
    load.radius = 1e-3; // one node
    char why[128] = "";
    for (int k = 0; k < SIM_LOADS; k++)
        apply_well(sim_apply_load, fixture.sim, &load);
    assert_false(sim_apply_load(fixture.sim, &load, why, sizeof why));
    assert_non_null(strstr(why, "64 loads"));
    fixture_run(&fixture, 11);
    load.radius = 0.2;
    apply_well(sim_apply_load, fixture.sim, &load);
    apply_well(sim_apply_load, fixture.sim, &load);
    // Room for two loads of all nodes, not for three.
    assert_false(sim_apply_load(fixture.sim, &load, why, sizeof why));
    assert_non_null(strstr(why, "too many nodes"));
}

// As a checkpoint may bring them: places are counted on from body to body, and of the first body
// here the last one never had a node.
TEST(a_load_on_a_place_that_never_had_a_node_cannot_be)
{
    const Body bodies[2] = {{.surface = {.node_count = 4, .node_used = 3}},
                            {.surface = {.node_count = 2, .node_used = 2}}};
    static const struct {
        int node;
        bool sound;
    } cases[] = {{-1, false}, {0, true}, {2, true}, {3, false}, {4, true}, {5, true}, {6, false}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        int64_t count = 1, used = 1;
        int pool[1] = {cases[k].node};
        Load load = {.area = 1.0, .count = 1};
        const LoadSet set = {
            .count = &count, .used = &used, .load = &load, .pool = pool, .pool_capacity = 1};
        assert_int_equal(loads_check(&set, bodies, 2), cases[k].sound);
    }
}
