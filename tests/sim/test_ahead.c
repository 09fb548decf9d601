// SPDX-License-Identifier: MIT
// What bodies that look ahead are told in each tick: where tools will be soon, and where something
// acts on the body.
#include "test.h"
#include "random.h"
#include "sim/ahead.h"
#include "sim/follow.h"
#include "sim/guard/guard.h"
#include "sim_steps.h"
#include "toy_body.h"

static const double CELL = 0.01; // [m]
enum { CELLS = 8, RATE = 1000 };

// What the body was told last.
static Approach told[APPROACH_MOST];
static int told_count;

static void listen(void *model, const Approach *approach, int count)
{
    (void)model;
    assert_true(count <= APPROACH_MOST);
    told_count = count;
    for (int i = 0; i < count; i++)
        told[i] = approach[i];
}

typedef struct Scene {
    Arena arena;
    StateList state;
    TriMesh mesh;
    Sim *sim;
    BodyOps ops;
} Scene;

static void destroy(Scene *scene)
{
    mesh_destroy(&scene->mesh);
    state_destroy(&scene->state);
    arena_destroy(&scene->arena);
}

// A sheet that listens, and tools.
static void create(Scene *scene, const ToolOptions *tool, int tool_count)
{
    const ToyOptions options = {.quantum = CELL / 1024.0, .size = CELL};
    const SimOptions sim = {.rate_hz = RATE, .tool_timeout_s = 0.5, .may_load = true};
    Toy *toy;
    Status status = {0};
    *scene = (Scene){.mesh = toy_sheet(CELLS, CELL)};
    scene->sim = sim_create(&sim, &scene->arena, &scene->state);
    Body body = toy_body(&toy, "wall", &scene->mesh, &options, &scene->arena, &scene->state);
    scene->ops = *body.ops;
    scene->ops.approach = listen;
    body.ops = &scene->ops;
    sim_add_body(scene->sim, &body);
    for (int t = 0; t < tool_count; t++)
        sim_add_tool(scene->sim, &tool[t]);
    assert_true(sim_seal(scene->sim, 0.0, &status));
    told_count = 0;
}

static void move(Scene *scene, int tool, Vec3 position)
{
    const ToolPose pose = {.utime = 1000 * sim_steps(scene->sim),
                           .position = position,
                           .orientation = QUAT_NONE,
                           .active = true};
    sim_apply_pose(scene->sim, tool, &pose, false);
}

static const ToolOptions BALL = {.id = 1,
                                 .kind = TOOL_PROBE,
                                 .max_force = 1.0,
                                 .capsule_count = 1,
                                 .capsule = {{.radius = 5e-3}}};

TEST(a_path_leads_where_a_steady_tool_is_in_50_ms)
{
    SCOPED(destroy) Scene scene;
    create(&scene, &BALL, 1);
    sim_step(scene.sim);
    assert_int_equal(told_count, 0); // it has no pose yet
    const Vec3 velocity = vec3(0.1, 0.0, -0.02);
    Vec3 at = vec3(0.0, 0.0, 0.1);
    for (int k = 0; k < 150; k++) {
        at = vec3_madd(vec3(0.0, 0.0, 0.1), 1e-3 * k, velocity);
        move(&scene, 0, at);
        sim_step(scene.sim);
    }
    // The path begins where the tick began: a pose is reached after a period, so up to three ticks
    // of way behind; the calm velocity is there but for exp(-150/15).
    assert_int_equal(told_count, 1);
    const double tick = 1e-3 * vec3_length(velocity);
    expect_at_most(vec3_length(vec3_sub(told[0].from, at)), 3.0 * tick);
    const Vec3 way = vec3_sub(told[0].to, told[0].from);
    expect_near(vec3_length(vec3_madd(way, -APPROACH_TIME, velocity)), 0.0, 0.01 * tick);
    expect_near(approach_time(&told[0], 0.5), 0.5 * APPROACH_TIME, 1e-12);
    expect_near(told[0].radius, 5e-3, 0.0);
    expect_near(told[0].speed, vec3_length(velocity), 1e-4 * vec3_length(velocity));
    // No more poses: it stays where it is, and so does what is expected of it.
    for (int k = 0; k < 300; k++)
        sim_step(scene.sim);
    assert_int_equal(told_count, 1);
    expect_at_most(vec3_length(vec3_sub(told[0].to, told[0].from)), 1e-9);
    // Withdrawn, it is nowhere.
    for (int k = 0; k < 300; k++)
        sim_step(scene.sim);
    assert_int_equal(told_count, 0);
}

TEST(blades_and_shafts_are_told_along_their_length)
{
    const ToolOptions tool[2] = {
        {.id = 1,
         .kind = TOOL_BLADE,
         .max_force = 1.0,
         .edge = {{0.0, 0.0, -0.01}, {0.0, 0.0, 0.01}}},
        {.id = 2,
         .kind = TOOL_STATIC,
         .capsule_count = 1,
         .capsule = {{.from = {0.0, 0.0, 0.05}, .to = {0.03, 0.0, 0.05}, .radius = 2e-3}}}};
    SCOPED(destroy) Scene scene;
    create(&scene, tool, 2);
    move(&scene, 0, vec3(0.0, 0.2, 0.0));
    sim_step(scene.sim);
    assert_int_equal(told_count, 8);
    // The edge at rest, and the shaft.
    const Approach *edge = &told[2], *shaft = &told[6];
    expect_near(edge->radius, 0.0, 0.0);
    expect_near(edge->from.y, 0.2, 1e-12);
    expect_near(edge->to.z - edge->from.z, 0.02, 1e-12);
    expect_near(shaft->radius, 2e-3, 0.0);
    expect_near(shaft->to.x - shaft->from.x, 0.03, 1e-12);
    expect_near(shaft->speed, 0.0, 0.0);
    expect_near(approach_time(edge, 1.0), 0.0, 0.0);
    expect_near(approach_time(&told[3], 1.0), APPROACH_TIME, 0.0); // the edge, soon
}

static double distance_to(const Approach *approach, Vec3 x)
{
    const Region axis = {.from = approach->from, .to = approach->to};
    return region_distance(&axis, x);
}

static Vec3 random_point(uint64_t *random)
{
    const double x = random_between(random, 0.0, 1.0), y = random_between(random, 0.0, 1.0);
    return vec3(x, y, random_between(random, 0.0, 1.0));
}

// A list that is full still covers every capsule that was added.
TEST(a_full_list_covers_what_it_was_given)
{
    enum { GIVEN = 100, MOST = 7 };
    uint64_t random = 3;
    Approach given[GIVEN], list[MOST];
    int count = 0;
    for (int i = 0; i < GIVEN; i++) {
        given[i] = (Approach){.from = random_point(&random),
                              .to = random_point(&random),
                              .radius = 0.1 * random_between(&random, 0.0, 1.0)};
        count = ahead_add(list, count, MOST, &given[i]);
        assert_true(count <= MOST);
        for (int g = 0; g <= i; g++) {
            bool covered = false;
            for (int k = 0; k < count && !covered; k++)
                covered = distance_to(&list[k], given[g].from) + given[g].radius <=
                              list[k].radius * (1.0 + 1e-12) + 1e-12 &&
                          distance_to(&list[k], given[g].to) + given[g].radius <=
                              list[k].radius * (1.0 + 1e-12) + 1e-12;
            assert_true(covered);
        }
    }
    assert_int_equal(count, MOST);
}

// By their reach, but for rounding.
TEST(strips_cover_a_box)
{
    enum { MOST = 16, SAMPLES = 200 };
    const double size = 1e-3;
    uint64_t random = 7;
    Approach list[MOST];
    const Box none = box_empty();
    assert_int_equal(ahead_cover(&none, size, false, MOST, list), 0);
    Box endless = box_empty();
    box_add(&endless, vec3(0.0, 0.0, 0.0));
    endless.high[0] = endless.high[1] = (double)INFINITY;
    assert_int_equal(ahead_cover(&endless, size, false, MOST, list), 0);
    for (int i = 0; i < 200; i++) {
        Box box = box_empty();
        const double edge = 0.03 * random_between(&random, 0.0, 1.0);
        box_add(&box, vec3_scale(edge, random_point(&random)));
        box_add(&box, vec3_scale(edge, random_point(&random)));
        const int most = 1 + (int)(MOST * random_between(&random, 0.0, 1.0)),
                  count = ahead_cover(&box, size, i % 2 != 0, most < MOST ? most : MOST, list);
        assert_true(count >= 1 && count <= most);
        for (int s = 0; s < SAMPLES; s++) {
            const Vec3 part = random_point(&random);
            const Vec3 x = vec3(box.low[0] + part.x * (box.high[0] - box.low[0]),
                                box.low[1] + part.y * (box.high[1] - box.low[1]),
                                box.low[2] + part.z * (box.high[2] - box.low[2]));
            bool covered = false;
            for (int k = 0; k < count; k++)
                covered |= distance_to(&list[k], x) <= list[k].reach * (1.0 + 1e-9) &&
                           (list[k].thick == 0.0 ||
                            fabs(vec3_dot(list[k].across, vec3_sub(x, list[k].from))) <=
                                list[k].thick * (1.0 + 1e-9));
            assert_true(covered);
        }
    }
}

// Sides of whole cells that tremble by up to a quarter of one, equal ones among them, have the
// strips that they have at rest: those move no farther than the corners do.
TEST(strips_of_a_box_that_trembles_stay)
{
    enum { MOST = 16, EDGE = 12, TIMES = 20 };
    const double size = 1e-3;
    uint64_t random = 11;
    for (int i = 0; i < EDGE * EDGE * EDGE; i++) {
        const Vec3 corner =
            vec3(size * (i % EDGE), size * (i / EDGE % EDGE), size * (i / EDGE / EDGE));
        Box still = box_empty();
        box_add(&still, vec3(0.0, 0.0, 0.0));
        box_add(&still, corner);
        Approach rest[MOST], list[MOST];
        const int count = ahead_cover(&still, size, true, MOST, rest);
        for (int n = 0; n < TIMES; n++) {
            Box box = box_empty();
            const double by = 0.25 * size; // both ends of a side together
            box_add(&box, vec3_scale(0.5 * by, random_point(&random)));
            box_add(&box, vec3_madd(corner, -0.5 * by, random_point(&random)));
            assert_int_equal(ahead_cover(&box, size, true, MOST, list), count);
            for (int k = 0; k < count; k++) {
                assert_true(vec3_length(vec3_sub(list[k].from, rest[k].from)) < by);
                assert_true(vec3_length(vec3_sub(list[k].to, rest[k].to)) < by);
                expect_near(vec3_dot(list[k].across, rest[k].across), 1.0, 0.0);
            }
        }
    }
}

// A load acts for long: its nodes are among the places, and remain there until it has ended.
TEST(a_load_is_told_while_it_acts)
{
    SCOPED(destroy) Scene scene;
    create(&scene, NULL, 0);
    const LoadOptions load = {.body = -1,
                              .center = {0.02, 0.01, 0.0},
                              .radius = 0.012,
                              .force = {0.0, 0.0, 0.1},
                              .duration = 0.1};
    apply_well(sim_apply_load, scene.sim, &load);
    // Places are found every 16 ticks.
    for (int k = 0; k < 17; k++)
        sim_step(scene.sim);
    assert_true(told_count > 0);
    bool covered = false;
    for (int k = 0; k < told_count; k++)
        covered |= distance_to(&told[k], load.center) <= fmax(told[k].reach, CELL);
    assert_true(covered);
    for (int k = 0; k < 120; k++)
        sim_step(scene.sim);
    assert_int_equal(told_count, 0);
}

// A restored run is told what the uninterrupted one was.
TEST(what_is_told_follows_from_the_state)
{
    SCOPED(destroy) Scene scene;
    create(&scene, &BALL, 1);
    const LoadOptions load = {
        .body = -1, .radius = 0.02, .force = {0.0, 0.0, 0.1}, .duration = 1.0};
    apply_well(sim_apply_load, scene.sim, &load);
    move(&scene, 0, vec3(0.0, 0.0, 0.1));
    for (int k = 0; k < 20; k++)
        sim_step(scene.sim);
    const size_t size = state_bytes(&scene.state);
    FREED char *kept = zeroed(size, 1);
    state_copy_out(&scene.state, kept);
    Approach first[APPROACH_MOST];
    int first_count = 0;
    for (int run = 0; run < 2; run++) {
        for (int k = 0; k < 5; k++)
            sim_step(scene.sim);
        if (run == 1)
            break;
        first_count = told_count;
        memcpy(first, told, sizeof first);
        for (int k = 0; k < 30; k++)
            sim_step(scene.sim);
        state_copy_in(&scene.state, kept);
    }
    assert_true(first_count > 1);
    assert_int_equal(told_count, first_count);
    assert_memory_equal(told, first, (size_t)first_count * sizeof *told);
}

static bool change_elements(Sim *sim, int b, void *context, TopologyChange *change)
{
    (void)sim, (void)b, (void)context;
    change->inside = true;
    return false;
}

// The mesh stays the one that clients have, and the guard goes on with what the body had.
TEST(a_change_inside_costs_no_mesh_and_no_account)
{
    SCOPED(destroy) Scene scene;
    create(&scene, NULL, 0);
    sim_step(scene.sim);
    EnergyAccount *account = &scene.sim->guard->energy[0];
    *account = (EnergyAccount){.had = 2.0, .given = 1.0, .known = 1};
    const int topology = scene.sim->body[0].mesh.topology;
    change_inside(scene.sim, 0, change_elements, NULL);
    assert_int_equal(scene.sim->body[0].mesh.topology, topology);
    assert_int_equal(account->known, 1);
    expect_near(account->had, 2.0, 0.0);
    expect_near(account->given, 1.0, 0.0);
}
