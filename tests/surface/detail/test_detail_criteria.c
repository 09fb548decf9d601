// SPDX-License-Identifier: MIT
// When faces are divided and taken back: each indicator of
// server/surface/detail/README.md, "Refinement criteria", alone, against its definition; how long
// calm must last; how often faces are looked at; what the governor may set.
#include "detail_bench.h"

#include "test.h"
#include "sim_steps.h"
#include "fixture.h"
#include "geometry/generator.h"
#include "random.h"

#define MODULUS 80.0 // E2D of bench_options [N/m]
#define DENSITY 4.2  // rho_A [kg/m2]
#define NEVER   1e9  // a threshold that is not met
static const double TICK = 1e-3;

enum { EVERY_TICK = 1000 };

static SurfaceOptions adapting(int levels, double force, double speed, double curvature,
                               double check_hz)
{
    SurfaceOptions options = bench_options(levels, 0);
    options.adapt = (SurfaceAdapt){
        .force = force, .speed = speed, .curvature = curvature, .check_hz = check_hz};
    return options;
}

static void create_sheet(DetailBench *bench, const SurfaceOptions *options, const ToolOptions *tool)
{
    TriMesh mesh;
    assert_true(generate_sheet(&mesh, 7, 7, 0.12, 0.12, &(Status){0}));
    bench_create(bench, BENCH_ADAPTIVE, &mesh, options, tool, NULL);
}

static void create_sphere(DetailBench *bench, const SurfaceOptions *options)
{
    TriMesh mesh;
    assert_true(generate_ico_sphere(&mesh, 1, 0.05, &(Status){0}));
    bench_create(bench, BENCH_ADAPTIVE, &mesh, options, NULL, NULL);
}

// One look at the present state, without motion.
static bool adapt(DetailBench *bench, int64_t step)
{
    TopologyChange change;
    return bench->body->ops->adapt(bench->body, step, TICK, &change);
}

static int leaves(const DetailBench *bench, int level)
{
    return bench->detail->set.leaf_count[level];
}

static void put(DetailBench *bench, int node, Vec3 x, Vec3 v)
{
    SurfaceModel *model = bench->model;
    rows_write(&model->basis, model->rows[model->current], model->slot[node], x, v);
}

static Vec3 rest_of(const DetailBench *bench, int node)
{
    const double *place = bench->model->basis.rest[bench->model->slot[node]];
    return vec3_add(bench->model->basis.rest_origin, (Vec3){place[0], place[1], place[2]});
}

// All nodes in use in their rest places with a velocity.
static void move_all(DetailBench *bench, Vec3 velocity)
{
    for (int i = 0; i < bench->detail->set.node_count; i++)
        if (bench->detail->set.status[i] != NODE_OFF)
            put(bench, i, rest_of(bench, i), velocity);
}

static double mean_edge(const Levels *levels)
{
    const Level *level = &levels->level[0];
    double sum = 0.0;
    for (int e = 0; e < level->edge_count; e++)
        sum += vec3_length(
            vec3_sub(levels->position[level->edge[e][0]], levels->position[level->edge[e][1]]));
    return sum / level->edge_count;
}

// ---------------------------------------------------------------------------------------------
// The indicators

// Of the sheet of 7 x 7 nodes: its node, the faces around it, and those with their halo: all with a
// corner among theirs.
enum { MIDDLE = 24, AROUND = 6, HALO = 24 };

// (|f| / A_i) L_l / E2D against the threshold; A_i = m_i / rho_A.
TEST(force_refines_at_its_threshold)
{
    for (int precision = 0; precision < 2; precision++)
        for (int over = 0; over < 2; over++) {
            SurfaceOptions options = adapting(1, 0.005, NEVER, NEVER, EVERY_TICK);
            options.body.precision = (Precision)precision;
            SCOPED(bench_destroy) DetailBench bench;
            create_sheet(&bench, &options, NULL);
            double area = bench.model->mass[MIDDLE] / DENSITY;
            double force = 0.005 * MODULUS * area / mean_edge(&bench.levels);
            force *= over ? 1.001 : 0.999;
            const LoadOptions load = {.center = rest_of(&bench, MIDDLE),
                                      .radius = 0.001,
                                      .force = {0.6 * force, 0.0, -0.8 * force},
                                      .duration = 1.0};
            apply_well(sim_apply_load, bench.sim, &load);
            assert_int_equal(adapt(&bench, 0), over);
            assert_int_equal(leaves(&bench, 1), over ? 4 * HALO : 0);
        }
}

// |v| / (c 2^l) in the world's frame.
TEST(speed_refines_at_its_threshold)
{
    for (int level = 0; level < 2; level++)
        for (int over = 0; over < 2; over++) {
            SurfaceOptions options = adapting(2, NEVER, 0.3, NEVER, EVERY_TICK);
            options.start_level = level;
            SCOPED(bench_destroy) DetailBench bench;
            create_sheet(&bench, &options, NULL);
            int before = leaves(&bench, level + 1);
            double speed = 0.3 * sqrt(MODULUS / DENSITY) * (level == 0 ? 1.0 : 2.0);
            speed *= over ? 1.001 : 0.999;
            put(&bench, MIDDLE, rest_of(&bench, MIDDLE), (Vec3){0.0, 0.6 * speed, 0.8 * speed});
            assert_int_equal(adapt(&bench, 0), over);
            int divided = level == 0 ? HALO : AROUND;
            assert_int_equal(leaves(&bench, level + 1), before + (over ? 4 * divided : 0));
        }
}

// Two faces over a ridge that rests at `rest` and is turned to `now` [rad].
static void fold(TriMesh *mesh, double rest)
{
    mesh_create(mesh, 4, 2);
    const Vec3 x[4] = {{0.0, -0.01, 0.0},
                       {0.0, 0.01, 0.0},
                       {-0.02, 0.0, 0.0},
                       {0.02 * cos(rest), 0.0, 0.02 * sin(rest)}};
    const int triangle[2][3] = {{0, 1, 2}, {1, 0, 3}};
    memcpy(mesh->position, x, sizeof x);
    memcpy(mesh->triangle, triangle, sizeof triangle);
}

TEST(change_of_the_angle_refines_at_its_threshold)
{
    static const double rests[3] = {0.0, 1.1, -2.0};
    static const double turns[6] = {0.399, 0.401, -0.399, -0.401, 1.5, -0.9};
    for (int r = 0; r < 3; r++)
        for (int t = 0; t < 6; t++) {
            SurfaceOptions options = adapting(1, NEVER, NEVER, 0.4, EVERY_TICK);
            TriMesh mesh;
            fold(&mesh, rests[r]);
            SCOPED(bench_destroy) DetailBench bench;
            bench_create(&bench, BENCH_ADAPTIVE, &mesh, &options, NULL, NULL);
            double now = rests[r] + turns[t];
            put(&bench, 3, (Vec3){0.02 * cos(now), 0.0, 0.02 * sin(now)}, (Vec3){0});
            bool over = fabs(turns[t]) > 0.4;
            assert_int_equal(adapt(&bench, 0), over);
            assert_int_equal(leaves(&bench, 1), over ? 8 : 0);
        }
}

// A body that moves as a whole is at rest as far as its shape goes: nothing to refine.
TEST(rigid_motion_refines_nothing)
{
    for (int kind = 0; kind < 8; kind++) {
        bool has_shape = (kind & 2) != 0;
        SurfaceOptions options = adapting(2, 0.005, 0.3, 0.4, EVERY_TICK);
        options.body.precision = kind & 1 ? PRECISION_SINGLE : PRECISION_DOUBLE;
        options.shape.wanted = has_shape;
        options.shape.frame = SHAPE_BODY;
        options.start_level = kind & 4 ? 1 : 0;
        SCOPED(bench_destroy) DetailBench bench;
        create_sphere(&bench, &options);
        const Vec3 velocity = {20.0, -5.0, 3.0}, spin = {0.0, 60.0, 100.0}; // 6 m/s at the rim
        for (int i = 0; i < bench.detail->set.node_count; i++)
            if (bench.detail->set.status[i] != NODE_OFF)
                put(&bench, i, rest_of(&bench, i),
                    vec3_add(velocity, vec3_cross(spin, rest_of(&bench, i))));
        int64_t before = bench.detail->adapt.sweep->refined;
        adapt(&bench, 0);
        if (bench.detail->adapt.sweep->refined != before)
            fail_msg("%s, %s shape springs: %lld faces refined",
                     options.body.precision == PRECISION_SINGLE ? "single" : "double",
                     has_shape ? "with" : "without",
                     (long long)(bench.detail->adapt.sweep->refined - before));
    }
}

// ---------------------------------------------------------------------------------------------
// Hysteresis and pace

// A face refined by the speed of the middle node, whose children then have the indicator eta.
static void create_refined(DetailBench *bench, double check_hz)
{
    SurfaceOptions options = adapting(1, NEVER, 0.3, NEVER, check_hz);
    create_sheet(bench, &options, NULL);
    put(bench, MIDDLE, rest_of(bench, MIDDLE),
        (Vec3){1.01 * 0.3 * bench->detail->adapt.wave_speed, 0.0, 0.0});
    for (int64_t step = 0; leaves(bench, 1) < 4 * HALO; step++) {
        assert_true(step < 30);
        adapt(bench, step);
    }
}

static void set_eta(DetailBench *bench, double eta)
{
    move_all(bench, (Vec3){0});
    double speed = eta * 0.3 * 2.0 * bench->detail->adapt.wave_speed; // of level 1
    put(bench, MIDDLE, rest_of(bench, MIDDLE), (Vec3){0.0, 0.0, speed});
}

// Low mark 0.35: between it and 1 nothing happens, however long.
TEST(faces_between_the_marks_stay)
{
    static const double etas[3] = {0.352, 0.6, 0.998};
    for (int k = 0; k < 3; k++) {
        SCOPED(bench_destroy) DetailBench bench;
        create_refined(&bench, EVERY_TICK);
        set_eta(&bench, etas[k]);
        for (int64_t step = 20; step < 1020; step++)
            assert_false(adapt(&bench, step));
    }
}

// 50 ms of calm, no less: and once they are over, at the next look at it. Whether leaves are calm
// is asked in whole sweeps, as many as fit into 50 ms.
TEST(calm_faces_are_taken_back_after_the_hold)
{
    static const double rates[3] = {EVERY_TICK, 100.0, 40.0};
    for (int k = 0; k < 3; k++) {
        SCOPED(bench_destroy) DetailBench bench;
        create_refined(&bench, rates[k]);
        set_eta(&bench, 0.348);
        int64_t step = 100;
        while (!adapt(&bench, step))
            assert_true(++step < 400);
        int first = (int)(step - 100);
        while (leaves(&bench, 1) > 0) {
            assert_true(++step < 400);
            adapt(&bench, step);
        }
        // [ticks] between two looks at the calm of a face: whole sweeps
        int period = (int)(1000.0 / rates[k] * fmax(1.0, floor(0.05 * rates[k])));
        assert_in_range(first, 50, 50 + 2 * period);
        // All of them at the same look; their neighbours' 2:1 holds none back.
        assert_int_equal((int)(step - 100), first);
        bench_expect_sound(&bench);
    }
}

TEST(calm_that_is_interrupted_begins_anew)
{
    SCOPED(bench_destroy) DetailBench bench;
    create_refined(&bench, EVERY_TICK);
    int64_t step = 100;
    for (int round = 0; round < 5; round++) {
        set_eta(&bench, 0.3);
        for (int i = 0; i < 48; i++)
            assert_false(adapt(&bench, step++));
        set_eta(&bench, 0.4);
        for (int i = 0; i < 50; i++) // a look at least
            assert_false(adapt(&bench, step++));
    }
}

// All faces ask for refinement: those of a small body are looked at in one tick of a check period,
// so that its topology changes once.
TEST(a_small_body_is_looked_at_at_once_check_hz_times_a_second)
{
    static const double rates[3] = {200.0, 100.0, 50.0};
    for (int k = 0; k < 3; k++) {
        SurfaceOptions options = adapting(1, NEVER, 0.3, NEVER, rates[k]);
        SCOPED(bench_destroy) DetailBench bench;
        create_sphere(&bench, &options);
        const int period = (int)(1000.0 / rates[k]), faces = 80;
        for (int i = 1; i <= 3 * period; i++) {
            move_all(&bench, (Vec3){3.0, 0.0, 0.0});
            adapt(&bench, i);
            const Sweep *sweep = bench.detail->adapt.sweep;
            assert_int_equal(sweep->refined, i < period ? 0 : faces);
            assert_int_equal(sweep->topology, i < period ? 0 : 1);
            assert_int_equal(sweep->count, i / period);
        }
        assert_int_equal(leaves(&bench, 1), 4 * faces);
    }
}

// A large body in slices of 2048 leaves: no tick looks at more, and each face is looked at check_hz
// times a second.
TEST(a_large_body_is_looked_at_in_slices)
{
    TriMesh mesh;
    SurfaceOptions options = adapting(1, NEVER, 0.3, NEVER, 100.0);
    SCOPED(bench_destroy) DetailBench bench;
    const int faces = 20480, slice = 2048;
    assert_true(generate_ico_sphere(&mesh, 5, 0.05, &(Status){0}));
    assert_int_equal(mesh.triangle_count, faces);
    bench_create(&bench, BENCH_ADAPTIVE, &mesh, &options, NULL, NULL);
    const Sweep *sweep = bench.detail->adapt.sweep;
    int64_t looked = 0;
    for (int i = 1; i <= 100; i++) {
        int64_t before = looked;
        adapt(&bench, i);
        looked = sweep->count * faces + sweep->root;
        assert_in_range(looked - before, 0, slice);
        assert_in_range(looked, (int64_t)faces * (i - 1) / 10, (int64_t)faces * i / 10);
    }
    assert_int_equal(sweep->count, 10);
}

// Where nothing happens a face is looked at in every fourth sweep; a load does not wait for it.
TEST(a_face_at_ease_is_looked_at_in_every_fourth_sweep)
{
    for (int loaded = 0; loaded < 2; loaded++) {
        SurfaceOptions options = adapting(1, 1e-9, 0.3, NEVER, EVERY_TICK);
        SCOPED(bench_destroy) DetailBench bench;
        create_sheet(&bench, &options, NULL);
        assert_false(adapt(&bench, 0)); // finds all at ease
        put(&bench, MIDDLE, rest_of(&bench, MIDDLE),
            (Vec3){2.0 * 0.3 * bench.detail->adapt.wave_speed, 0.0, 0.0});
        if (loaded == 0) {
            for (int64_t step = 1; step <= SKIP_MOST; step++)
                assert_false(adapt(&bench, step));
        } else { // far away
            const LoadOptions load = {.center = {0.06, 0.06, 0.0},
                                      .radius = 0.001,
                                      .force = {0.0, 0.0, 1e-12},
                                      .duration = 1.0};
            apply_well(sim_apply_load, bench.sim, &load);
        }
        assert_true(adapt(&bench, 1 + SKIP_MOST));
        assert_int_equal(leaves(&bench, 1), 4 * HALO);
    }
}

// What cannot wait: with faces looked at once in ages, loads and tools still refine.
TEST(a_new_load_refines_in_its_own_tick)
{
    SurfaceOptions options = adapting(2, 0.005, 0.3, 0.4, 1e-9);
    SCOPED(bench_destroy) DetailBench bench;
    create_sheet(&bench, &options, NULL);
    sim_ticks(bench.sim, 100);
    assert_int_equal(bench.detail->adapt.sweep->refined, 0);
    const LoadOptions load = {
        .center = {0.0, 0.0, 0.0}, .radius = 0.015, .force = {0.0, 0.0, -0.1}, .duration = 0.05};
    apply_well(sim_apply_load, bench.sim, &load);
    sim_step(bench.sim);
    assert_true(bench.detail->adapt.sweep->refined > 0);
    bench_expect_sound(&bench);
}

TEST(a_tool_that_presses_refines_in_the_next_tick)
{
    const ToolOptions ball = {PROBE(0.008, 5.0)};
    SurfaceOptions options = adapting(2, 0.005, NEVER, NEVER, 1e-9);
    SCOPED(bench_destroy) DetailBench bench;
    create_sheet(&bench, &options, &ball);
    ToolPose pose = {
        .position = {0.002, 0.003, 0.007}, .orientation = {1.0, 0.0, 0.0, 0.0}, .active = true};
    int pressed = -1;
    for (int i = 0; i < 100 && pressed < 0; i++) {
        pose.position.z = 0.009 - 0.0001 * i;
        sim_apply_pose(bench.sim, 0, &pose, true);
        sim_step(bench.sim);
        // Its force against the whole area of the nearest node's faces: beyond the threshold there.
        double force = vec3_length(sim_wrench(bench.sim, 0)->force);
        if (force >
            2.0 * 0.005 * MODULUS * bench.model->mass[MIDDLE] / DENSITY / mean_edge(&bench.levels))
            pressed = i;
    }
    assert_true(pressed >= 0);
    sim_apply_pose(bench.sim, 0, &pose, true);
    sim_step(bench.sim);
    assert_true(bench.detail->adapt.sweep->refined > 0);
    bench_expect_sound(&bench);
}

// A load is given to the nodes anew with every change of topology; only when it is new are all
// faces looked at, which costs as much as hundreds of changes.
TEST(a_load_that_follows_a_change_asks_for_no_look_at_all_faces)
{
    SurfaceOptions options = adapting(2, 0.005, NEVER, NEVER, 1e-9);
    const ToolOptions ball = {PROBE(0.008, 5.0)};
    const LoadOptions load = {// far below what refines, and far from the tool
                              .center = {0.05, 0.05, 0.0},
                              .radius = 0.03,
                              .force = {0.0, 0.0, -1e-4},
                              .duration = 10.0};
    const int roots = 72; // faces of level 0
    SCOPED(bench_destroy) DetailBench bench;
    create_sheet(&bench, &options, &ball);
    apply_well(sim_apply_load, bench.sim, &load);
    assert_int_equal(bench.detail->adapt.sweep->urgent, 2 * roots);
    sim_step(bench.sim); // levels may come one by one: as many looks as there are levels
    assert_int_equal(bench.detail->adapt.sweep->urgent, roots);
    sim_step(bench.sim);
    assert_int_equal(bench.detail->adapt.sweep->urgent, 0);
    assert_int_equal(bench.detail->adapt.sweep->refined, 0);
    ToolPose pose = {
        .position = {0.0, 0.0, 0.004}, .orientation = {1.0, 0.0, 0.0, 0.0}, .active = true};
    for (int i = 0; i < 100 && bench.detail->adapt.sweep->refined == 0; i++) {
        sim_apply_pose(bench.sim, 0, &pose, true);
        sim_step(bench.sim);
    }
    assert_true(bench.detail->adapt.sweep->refined > 0);
    assert_int_equal(bench.detail->adapt.sweep->urgent, 0);
}

// ---------------------------------------------------------------------------------------------
// What may be set

static bool set(DetailBench *bench, const char *key, double value)
{
    char why[160];
    return sim_apply_set(bench->sim, key, value, why, sizeof why);
}

static int finest(const DetailBench *bench)
{
    return bench->body->finest_level;
}

TEST(the_governors_level_lowers_and_raises_the_finest_one)
{
    SurfaceOptions options = adapting(3, NEVER, 0.05, NEVER, 100.0);
    SCOPED(bench_destroy) DetailBench bench;
    create_sphere(&bench, &options);
    // Fast enough for level 3 everywhere: 0.05 c 2^2 = 0.87 m/s.
    int64_t step = 0;
    static const int levels[6] = {3, 1, 2, 0, 3, 0};
    for (int k = 0; k < 6; k++) {
        assert_true(set(&bench, k % 2 == 0 ? "adapt_level" : "body.adapt_level", levels[k]));
        // 5120 faces at 16 a tick; to take back 1280, as fast.
        for (int i = 0; i < 600; i++) {
            move_all(&bench, (Vec3){2.0, 0.0, 0.0});
            adapt(&bench, step++);
        }
        assert_int_equal(finest(&bench), levels[k]);
        assert_int_equal(leaves(&bench, levels[k]), 80 << (2 * levels[k]));
        bench_expect_sound(&bench);
    }
}

TEST(the_governors_scale_raises_all_thresholds)
{
    SurfaceOptions options = adapting(1, NEVER, 0.3, NEVER, EVERY_TICK);
    SCOPED(bench_destroy) DetailBench bench;
    create_sheet(&bench, &options, NULL);
    double speed = 0.3 * bench.detail->adapt.wave_speed;
    assert_true(set(&bench, "adapt_scale", 4.0));
    put(&bench, MIDDLE, rest_of(&bench, MIDDLE), (Vec3){3.99 * speed, 0.0, 0.0});
    assert_false(adapt(&bench, 0));
    put(&bench, MIDDLE, rest_of(&bench, MIDDLE), (Vec3){4.01 * speed, 0.0, 0.0});
    assert_true(adapt(&bench, 1));
    assert_true(set(&bench, "body.adapt_scale", 100.0));   // now all is calm
    for (int64_t step = 2; step < 2 + 50 + 2 * 50; step++) // the hold, and a look before and after
        adapt(&bench, step);
    assert_int_equal(finest(&bench), 0);
}

TEST(what_cannot_be_set_changes_nothing)
{
    SurfaceOptions options = adapting(2, 0.005, 0.3, 0.4, 100.0);
    SCOPED(bench_destroy) DetailBench bench;
    create_sheet(&bench, &options, NULL);
    uint64_t before = state_hash(&bench.state);
    const double bad[4] = {(double)NAN, (double)INFINITY, -1.0, 1e300};
    static const char *const keys[5] = {"adapt_force", "adapt_speed", "adapt_curvature",
                                        "adapt_scale", "adapt_level"};
    for (int k = 0; k < 5; k++)
        for (int b = 0; b < 4; b++)
            assert_false(set(&bench, keys[k], bad[b]));
    assert_false(set(&bench, "adapt_level", 0.5));
    assert_false(set(&bench, "adapt_level", LEVELS_MAX + 1));
    assert_false(set(&bench, "body.adapt", 1.0));
    assert_true(state_hash(&bench.state) == before);
    assert_true(set(&bench, "adapt_level", LEVELS_MAX)); // of no more than there are
    assert_int_equal(bench.detail->adapt.sweep->level, 2);
    // Thresholds of zero are met by whatever is not at rest; at rest nothing is.
    for (int k = 0; k < 4; k++)
        assert_true(set(&bench, keys[k], 0.0));
    sim_ticks(bench.sim, 100);
    bench_expect_sound(&bench);
}
