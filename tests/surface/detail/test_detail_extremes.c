// SPDX-License-Identifier: MIT
// What could break it: a wall that is divided while a tool lies in it, no room left, a load of
// 1e6 N, tools faster than any hand, nothing free to move, several pieces, nodes of many and of few
// edges, corners, five levels of a tetrahedron, and states that no run has made.
#include "detail_bench.h"

#include "test.h"
#include "sim_steps.h"
#include "effort.h"
#include "fixture.h"
#include "geometry/generator.h"
#include "random.h"
#include "sim/guard/guard.h"

static SurfaceOptions adaptive(int levels)
{
    SurfaceOptions options = bench_options(levels, 0);
    options.adapt.check_hz = 100.0;
    options.body.integrator = INTEGRATOR_LEAPFROG;
    return options;
}

static ToolOptions ball(ToolKind kind, double radius, double max_force)
{
    return (ToolOptions){.id = 1,
                         .kind = kind,
                         .capsule_count = 1,
                         .capsule = {{.radius = radius}},
                         .max_force = max_force};
}

static void set(DetailBench *bench, const char *key, double value)
{
    char why[160];
    if (!sim_apply_set(bench->sim, key, value, why, sizeof why))
        fail_msg("%s", why);
}

static void move(DetailBench *bench, Vec3 position)
{
    put_tool(bench->sim, 0, position);
}

static bool load(DetailBench *bench, Vec3 center, double radius, Vec3 force, double duration)
{
    const LoadOptions options = {
        .center = center, .radius = radius, .force = force, .duration = duration};
    char why[128];
    return sim_apply_load(bench->sim, &options, why, sizeof why);
}

// Nothing that leaves the body is not a number.
static void expect_finite(const DetailBench *bench)
{
    int nodes = bench->body->mesh.node_count;
    FREED float *row = malloc(6 * (size_t)nodes * sizeof *row);
    bench->body->ops->snapshot(bench->model, row, row + 3 * nodes);
    for (int i = 0; i < 6 * nodes; i++)
        assert_true(isfinite(row[i]));
    BodyMeasure measure = measure_of(bench->body);
    assert_true(isfinite(measure.kinetic) && isfinite(measure.elastic) &&
                isfinite(measure.max_displacement));
    for (int t = 0; t < sim_tool_count(bench->sim); t++)
        assert_true(isfinite(vec3_length(sim_wrench(bench->sim, t)->force)) &&
                    isfinite(vec3_length(sim_wrench(bench->sim, t)->torque)));
}

// ---------------------------------------------------------------------------------------------
// Sides of a thin wall

// A probe drawn about in a sheet that refines under it: so deep that its middle comes out behind,
// or not as deep, with the levels going up and down at the governor's whim. It is pushed back to
// where it came from, as by sheets wholly of either level.
TEST(a_wall_keeps_its_side_while_it_is_divided_and_merged)
{
    static const struct {
        double depth, low; // [m]; level to which it falls back, 3: none
    } walls[] = {{0.015, 3.0}, {0.009, 2.0}, {0.009, 1.0}, {0.009, 0.0}};
    for (size_t w = 0; w < sizeof walls / sizeof *walls; w++) {
        TriMesh mesh;
        assert_true(generate_sheet(&mesh, 9, 9, 0.12, 0.12, &(Status){0}));
        SurfaceOptions options = adaptive(3);
        const ToolOptions tool = ball(TOOL_PROBE, 0.004, 2.0);
        SCOPED(bench_destroy) DetailBench bench;
        bench_create(&bench, BENCH_ADAPTIVE, &mesh, &options, &tool, NULL);
        double deepest = 0.0;
        int pushed = 0;
        for (int i = 0; i < 2000; i++) {
            if (i % 40 == 0)
                set(&bench, "adapt_level", i / 40 % 2 == 0 ? 3.0 : walls[w].low);
            double depth = walls[w].depth * fmin(1.0, i / 500.0);
            move(&bench, (Vec3){0.004 + 0.01 * sin(0.01 * i), 0.003, 0.005 - depth});
            sim_step(bench.sim);
            const ToolWrench *wrench = sim_wrench(bench.sim, 0);
            deepest = fmax(deepest, wrench->depth);
            pushed += wrench->force.z > 0.0;
            if (wrench->force.z < 0.0)
                fail_msg("tick %d: %g N on the probe, downwards", i, wrench->force.z);
            if (i % 50 == 0)
                bench_expect_sound(&bench);
        }
        print_message("to level %g: pushed in %d ticks, depth to %.2g m\n", walls[w].low, pushed,
                      deepest);
        // From when it touches; a wall that falls back lets go for a moment.
        assert_true(pushed > 1850);
        // Deep presses end with the axis on the wall, a tenth of the radius before it.
        assert_true(walls[w].depth < 0.01 || deepest > 0.0035);
        assert_true(bench.detail->adapt.sweep->refined > 50);
        assert_true(walls[w].low == 3.0 || bench.detail->adapt.sweep->coarsened > 300);
    }
}

// Faces that merge hand on to the one that they become, each of them; those of a divided one come
// from it.
TEST(every_face_that_goes_has_a_successor)
{
    SurfaceOptions options = bench_options(3, 0);
    SCOPED(bench_destroy) DetailBench bench;
    bench_create_on(&bench, BENCH_ADAPTIVE, fixture_sphere, &options, NULL, NULL);
    const Detail *detail = bench.detail;
    FREED bool *was = calloc((size_t)detail->set.face_count, sizeof *was);
    uint64_t random = 8;
    for (int round = 0; round < EFFORT(400); round++) {
        for (int p = 0; p < detail->set.face_count; p++)
            was[p] = detail->faces.face[p][0] != detail->faces.face[p][1];
        bench_change_at_random(&bench, &random, round / 100 % 2 == 0 ? 8 : 2);
        const TopologyChange *change = &detail->report.change;
        for (int i = 0; i < change->face_count; i++) {
            int face = change->face[i].face, from = change->face[i].from;
            bool is = detail->faces.face[face][0] != detail->faces.face[face][1];
            assert_true(from < 0 ? was[face] && !is : was[from] && is);
            if (from >= 0)
                continue;
            int heirs = 0; // with from = this place
            for (int k = 0; k < change->face_count; k++)
                heirs += change->face[k].from == face;
            assert_true(heirs > 0);
        }
        for (int p = 0; p < detail->set.face_count; p++)
            for (int i = 0; !was[p] && detail->faces.face[p][0] != detail->faces.face[p][1]; i++) {
                assert_true(i < change->face_count);
                if (change->face[i].face == p && change->face[i].from >= 0)
                    break;
            }
        bench_expect_sound(&bench);
    }
}

// A load on a patch smaller than the faces, with the levels going up and down beneath it: its sum
// stays.
TEST(a_small_load_keeps_its_sum_while_levels_come_and_go)
{
    SurfaceOptions options = adaptive(3);
    options.body.precision = PRECISION_DOUBLE;
    options.start_level = 3;
    SCOPED(bench_destroy) DetailBench bench;
    bench_create_on(&bench, BENCH_ADAPTIVE, fixture_sphere, &options, NULL, NULL);
    // Around a midpoint of the finest level, in reach of nothing else.
    int node = bench.detail->set.node_count - 1;
    assert_true(load(&bench, bench.levels.position[node], 1e-4, (Vec3){0.1, -0.2, 0.3}, 10.0));
    for (int i = 0; i < 800; i++) {
        if (i % 100 == 0)
            set(&bench, "adapt_level", i / 100 % 4);
        sim_step(bench.sim);
        Vec3 sum = {0.0, 0.0, 0.0};
        for (int n = 0; n < bench.detail->set.node_count; n++) {
            if (bench.detail->set.status[n] != NODE_FREE)
                continue;
            long at = model_lane(bench.model->lane[bench.model->slot[n]]);
            sum.x += model_get(bench.model, bench.model->external, at);
            sum.y += model_get(bench.model, bench.model->external, at + LANES);
            sum.z += model_get(bench.model, bench.model->external, at + 2 * LANES);
        }
        // Shares add up to 1 but for rounding.
        expect_near(sum.x, 0.1, 1e-14);
        expect_near(sum.y, -0.2, 1e-14);
        expect_near(sum.z, 0.3, 1e-14);
        if (i % 50 == 0)
            bench_expect_sound(&bench);
    }
    assert_true(bench.detail->adapt.sweep->coarsened > 100);
}

// ---------------------------------------------------------------------------------------------
// Capacity

TEST(what_does_not_fit_is_refused_and_counted)
{
    for (int kind = 0; kind < 3; kind++) {
        SurfaceOptions options = adaptive(3);
        options.body.node_capacity = kind == 0 ? 150 : kind == 1 ? 0 : 116; // of 114 to start with
        options.body.face_capacity = kind == 1 ? 300 : 0;                   // of 224
        const ToolOptions tool = ball(TOOL_PROBE, 0.006, 3.3);
        SCOPED(bench_destroy) DetailBench bench;
        bench_create_on(&bench, BENCH_ADAPTIVE, fixture_sphere, &options, &tool, NULL);
        assert_int_equal(bench.body->mesh.node_capacity,
                         kind == 1 ? bench.detail->set.node_count : options.body.node_capacity);
        for (int i = 0; i < 1500; i++) {
            move(&bench, (Vec3){0.02 * cos(0.01 * i), 0.02 * sin(0.01 * i), 0.04});
            sim_step(bench.sim);
            assert_in_range(bench.body->mesh.node_count, 114, bench.body->mesh.node_capacity);
            assert_in_range(bench.body->mesh.triangle_count, 224,
                            bench.body->mesh.triangle_capacity);
            if (i % 50 == 0)
                bench_expect_sound(&bench);
        }
        BodyMeasure measure = measure_of(bench.body);
        assert_true(measure.refused > 0);
        assert_int_equal(measure.refused, bench.detail->adapt.sweep->refused);
        assert_true(kind == 2 ? bench.detail->adapt.sweep->refined == 0
                              : bench.detail->adapt.sweep->refined > 5);
        assert_int_equal(sim_resets(bench.sim), 0);
        // Nothing is left behind when the tool is gone.
        move(&bench, (Vec3){0.0, 0.0, 1.0});
        sim_ticks(bench.sim, 3000);
        assert_int_equal(bench.body->finest_level, 0);
        assert_int_equal(bench.body->mesh.node_count, 114);
        assert_int_equal(bench.body->mesh.triangle_count, 224);
    }
}

// ---------------------------------------------------------------------------------------------
// Extremes

TEST(absurd_loads_and_tools_leave_finite_numbers)
{
    for (int kind = 0; kind < 8; kind++) {
        SurfaceOptions options = adaptive(2);
        options.body.precision = kind & 1 ? PRECISION_SINGLE : PRECISION_DOUBLE;
        options.shape.frame = kind & 2 ? SHAPE_BODY : SHAPE_WORLD;
        const ToolOptions tool = ball(TOOL_PROBE, 0.006, 1e6);
        SCOPED(bench_destroy) DetailBench bench;
        bench_create_on(&bench, BENCH_ADAPTIVE, fixture_sphere, &options, &tool, NULL);
        bool loaded = (kind & 4) != 0;
        if (loaded) {
            assert_true(load(&bench, (Vec3){0.0, 0.0, 0.05}, 0.02, (Vec3){0.0, 0.0, -1e6}, 0.05));
            assert_true(load(&bench, (Vec3){0.0, 0.0, -0.05}, 0.02, (Vec3){0.0, 0.0, 1e6}, 0.05));
        }
        for (int i = 0; i < 300; i++) {
            // 100 m/s to and fro, or anywhere at all.
            double x = fmod(0.1 * i, 0.4) - 0.2;
            if (!loaded)
                move(&bench, (Vec3){x, 0.013 * (i % 7 - 3), i % 11 == 0 ? 0.0 : 0.01 * (i % 5)});
            sim_step(bench.sim);
            expect_finite(&bench);
            if (i % 20 == 0)
                bench_expect_sound(&bench);
        }
        print_message("kind %d: %d resets, %d refined\n", kind, (int)sim_resets(bench.sim),
                      (int)bench.detail->adapt.sweep->refined);
        // It comes back when it is left alone, unless it was set spinning.
        withdraw_tool(bench.sim, 0);
        sim_ticks(bench.sim, 5000);
        expect_finite(&bench);
        BodyMeasure measure = measure_of(bench.body);
        if (options.shape.frame == SHAPE_WORLD) {
            assert_int_equal(bench.body->finest_level, 0);
            expect_at_most(measure.elastic, 1e-6);
        }
    }
}

// Bad numbers from within: the tick is taken back, whatever the levels, and nothing of it is seen.
TEST(bad_numbers_are_never_published)
{
    for (int precision = 0; precision < 2; precision++) {
        SurfaceOptions options = adaptive(2);
        options.body.precision = (Precision)precision;
        SCOPED(bench_destroy) DetailBench bench;
        bench_create_on(&bench, BENCH_ADAPTIVE, fixture_sphere, &options, NULL, NULL);
        uint64_t random = 3;
        for (int round = 0; round < 40; round++) {
            bench_change_at_random(&bench, &random, 7);
            sim_restored(bench.sim);
            // A force that no number holds, in one round for many ticks in a row.
            for (int i = 0; i < (round == 20 ? 15 : 1); i++) {
                int node = random_below(&random, 114);
                const Vec3 force = {(double)NAN, 0.0, (double)INFINITY};
                bench.body->ops->add_load(bench.model, node, force);
                bench.sim->guard->freeze[0] = (GuardFreeze){0}; // so many would freeze it
                sim_step(bench.sim);
                bench.body->ops->clear_loads(bench.model);
                expect_finite(&bench);
            }
            bench_expect_sound(&bench);
            sim_ticks(bench.sim, 3);
            expect_finite(&bench);
        }
        assert_int_equal(sim_resets(bench.sim), 54);
    }
}

TEST(a_body_that_cannot_move_does_not)
{
    const FixedRegion all = {.kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, 1.0}};
    for (int frame = 0; frame < 3; frame++) {
        SurfaceOptions options = adaptive(2);
        options.shape = frame == 2 ? (SurfaceShape){.wanted = false} : options.shape;
        options.shape.frame = frame == 1 ? SHAPE_BODY : SHAPE_WORLD;
        fix_within(&options.body, &all);
        options.body.gravity.z = -9.81;
        const ToolOptions tool = ball(TOOL_PROBE, 0.006, 3.3);
        SCOPED(bench_destroy) DetailBench bench;
        bench_create_on(&bench, BENCH_ADAPTIVE, fixture_sphere, &options, &tool, NULL);
        assert_false(load(&bench, (Vec3){0.0, 0.0, 0.05}, 0.02, (Vec3){0.0, 0.0, -1.0}, 1.0));
        for (int i = 0; i < 500; i++) {
            move(&bench, (Vec3){0.0, 0.02 * sin(0.02 * i), 0.05});
            sim_step(bench.sim);
            if (i % 50 == 0)
                bench_expect_sound(&bench);
        }
        assert_true(bench.detail->adapt.sweep->refined > 0); // it is pressed all the same
        expect_near(measure_of(bench.body).max_displacement, 0.0, 1e-12);
        assert_int_equal(sim_resets(bench.sim), 0);
    }
}

// ---------------------------------------------------------------------------------------------
// Meshes

static void append(TriMesh *mesh, const TriMesh *other, Vec3 shift)
{
    TriMesh sum;
    mesh_create(&sum, mesh->node_count + other->node_count,
                mesh->triangle_count + other->triangle_count);
    for (int part = 0; part < 2; part++) {
        const TriMesh *from = part == 0 ? mesh : other;
        int node = part == 0 ? 0 : mesh->node_count, face = part == 0 ? 0 : mesh->triangle_count;
        for (int i = 0; i < from->node_count; i++)
            sum.position[node + i] =
                part == 0 ? from->position[i] : vec3_add(from->position[i], shift);
        for (int f = 0; f < from->triangle_count; f++)
            for (int k = 0; k < 3; k++)
                sum.triangle[face + f][k] = node + from->triangle[f][k];
    }
    mesh_destroy(mesh);
    *mesh = sum;
}

static void several_pieces(TriMesh *mesh)
{
    TriMesh other;
    Status status = {0};
    assert_true(generate_ico_sphere(mesh, 1, 0.03, &status));
    assert_true(generate_sheet(&other, 5, 4, 0.06, 0.05, &status));
    append(mesh, &other, (Vec3){0.0, 0.0, 0.04});
    mesh_destroy(&other);
    assert_true(generate_ico_sphere(&other, 0, 0.02, &status));
    append(mesh, &other, (Vec3){0.07, 0.0, 0.0});
    mesh_destroy(&other);
}

// Poles of 40 edges, a ring of nodes of 4: two cones base to base.
static void forty_edges(TriMesh *mesh)
{
    assert_true(generate_uv_sphere(mesh, 1, 40, 0.05, &(Status){0}));
}

static void tetrahedron(TriMesh *mesh)
{
    assert_true(generate_sphere(mesh, 4, 0.05, &(Status){0}));
}

static void corners(TriMesh *mesh) // two triangles: all nodes are corners
{
    assert_true(generate_sheet(mesh, 2, 2, 0.08, 0.08, &(Status){0}));
}

static void bipyramid_of_three(TriMesh *mesh) // poles of 3 edges
{
    assert_true(generate_uv_sphere(mesh, 1, 3, 0.05, &(Status){0}));
}

TEST(odd_meshes_are_handled_like_others)
{
    static const struct {
        void (*make)(TriMesh *mesh);
        int levels;
    } meshes[] = {{several_pieces, 3},
                  {forty_edges, 3},
                  {tetrahedron, 5},
                  {corners, 5},
                  {bipyramid_of_three, 4}};
    for (size_t m = 0; m < sizeof meshes / sizeof *meshes; m++)
        for (int precision = 0; precision < 2; precision++) {
            TriMesh mesh;
            meshes[m].make(&mesh);
            SurfaceOptions options = adaptive(meshes[m].levels);
            options.body.precision = (Precision)precision;
            options.shape.damping_ratio = 0.3;
            options.shape.angular_frequency = 150.0; // small ones stay dented by less
            const ToolOptions tool = ball(TOOL_PROBE, 0.006, 2.0);
            SCOPED(bench_destroy) DetailBench bench;
            bench_create(&bench, BENCH_ADAPTIVE, &mesh, &options, &tool, NULL);
            int finest = 0;
            assert_true(load(&bench, bench.mesh.position[0], 0.01, (Vec3){0.1, 0.0, -0.3}, 0.4));
            for (int i = 0; i < 600; i++) {
                move(&bench, (Vec3){0.02 * cos(0.01 * i), 0.02 * sin(0.01 * i), 0.02});
                sim_step(bench.sim);
                finest = bench.body->finest_level > finest ? bench.body->finest_level : finest;
                if (i % 50 == 0)
                    bench_expect_sound(&bench);
            }
            print_message("mesh %d: %d refined to level %d, %d substeps\n", (int)m,
                          (int)bench.detail->adapt.sweep->refined, finest, bench.body->substeps);
            assert_true(finest >= 2);
            expect_finite(&bench);
            assert_int_equal(sim_resets(bench.sim), 0);
            withdraw_tool(bench.sim, 0);
            int64_t changes = 0;
            for (int i = 0; i < 4000; i++) {
                sim_step(bench.sim);
                if (i == 3000)
                    changes =
                        bench.detail->adapt.sweep->refined + bench.detail->adapt.sweep->coarsened;
            }
            // The levels of a tetrahedron are far from its faces: it may stay dented, but at rest.
            assert_int_equal(
                bench.detail->adapt.sweep->refined + bench.detail->adapt.sweep->coarsened, changes);
            assert_true(bench.body->finest_level == 0 || meshes[m].make == tetrahedron);
            bench_expect_sound(&bench);
        }
}
