// SPDX-License-Identifier: MIT
// The estimate of the error of a solid's elements (server/voxel/error.h): what it says of states
// whose error is known, what must not change it, and scenes against the truth.
#include "test.h"
#include "scoped.h"
#include "sim_steps.h"
#include "voxel/cut/cut_body.h"
#include "voxel/error.h"
#include "voxel/model.h"
#include "voxel_error.h"
#include "voxel_world.h"

#include <math.h>
#include <string.h>

static VoxelWorldOptions estimated(VoxelWorldOptions options, double poisson)
{
    options.body.body.estimate_error = true;
    options.material.poisson_ratio = poisson;
    return options;
}

// A round in calls of this budget; returns how many.
static int round_of(const VoxelWorld *world, int budget, BodyError *error)
{
    const ErrorQuestion nothing = {.tool_count = 0};
    for (int calls = 1;; calls++) {
        assert_true(calls < 100000);
        if (world->body->ops->estimate(world->body->model, &nothing, budget, error))
            return calls;
    }
}

static BodyError error_of(const VoxelWorld *world)
{
    BodyError error;
    round_of(world, 1 << 20, &error);
    return error;
}

typedef Vec3 Motion(Vec3 x);

static void move(VoxelWorld *world, Motion *motion)
{
    const VoxelModel *model = world->body->model;
    voxel_world_read(world);
    for (int i = 0; i < world->count; i++) {
        world->x[i] = motion(rows_rest(&model->vertices.rows, i));
        world->v[i] = (Vec3){0.0, 0.0, 0.0};
    }
    voxel_world_write(world, world->x, world->v);
}

static Vec3 stretched(Vec3 x)
{
    return vec3(1.2 * x.x + 0.1 * x.y, 0.9 * x.y - 0.05 * x.z, 1.05 * x.z);
}

// Pure bending of a bar along x, to first order; nu 0.3.
static const double CURVATURE = 1e-3; // [1/m]
static Vec3 bent(Vec3 x)
{
    const double nu = 0.3, k = CURVATURE;
    return vec3(x.x - k * x.x * x.z, x.y + nu * k * x.y * x.z,
                x.z + 0.5 * k * (x.x * x.x + nu * (x.z * x.z - x.y * x.y)));
}

// The strain grows with the square of z, of which an element knows nothing.
static Vec3 pulled_more_above(Vec3 x)
{
    return vec3(x.x + 0.3 * x.x * x.z * x.z / 0.0025, x.y, x.z);
}

static Vec3 turned(Vec3 x)
{
    static const Quat TURN = {0.6, 0.0, 0.64, 0.48};
    return vec3_add(vec3(0.3, -0.2, 0.1), quat_rotate(TURN, pulled_more_above(x)));
}

// ---------------------------------------------------------------------------------------------
// States whose error is known

TEST(a_body_at_rest_has_no_error)
{
    VoxelWorldOptions options = estimated(voxel_world_cube(8), 0.3);
    VoxelWorld world;
    voxel_world_create(&world, &options);
    const BodyError error = error_of(&world);
    expect_near(error.displacement, 0.0, 0.0);
    expect_near(error.relative, 0.0, 0.0);
    voxel_world_destroy(&world);
}

// Elements reproduce a uniform strain exactly, at borders of levels too.
TEST(a_uniform_strain_has_no_error)
{
    VoxelWorldOptions options = estimated(voxel_world_cube(16), 0.3);
    VoxelWorld world;
    voxel_world_create(&world, &options);
    move(&world, stretched);
    // Squares of single precision's rounding, over that of the strain.
    assert_true(error_of(&world).relative < 1e-10);
    voxel_world_destroy(&world);
}

// And pure bending, with one element through the thickness or several.
TEST(pure_bending_has_no_error)
{
    for (int thick = 1; thick <= 4; thick += 3) {
        VoxelWorldOptions options =
            estimated(voxel_world_block(4 * thick, thick, thick, 0.01), 0.3);
        VoxelWorld world;
        voxel_world_create(&world, &options);
        move(&world, bent);
        // The next order of the rotation, about (k l)^2 of the strain k h, squared.
        assert_true(error_of(&world).relative < 1e-5);
        voxel_world_destroy(&world);
    }
}

// The energy of the error falls with the square of the cell.
TEST(halved_cells_quarter_the_error)
{
    double error[3];
    for (int k = 0; k < 3; k++) {
        VoxelWorldOptions options = estimated(voxel_world_cube(8 << k), 0.3);
        options.body.body.levels = 0;
        VoxelWorld world;
        voxel_world_create(&world, &options);
        move(&world, pulled_more_above);
        error[k] = error_of(&world).relative;
        voxel_world_destroy(&world);
    }
    // At the faces the recovered strains are those half a cell beneath, of first order in a layer
    // as thin as a cell: the same order, another constant until that layer is thin.
    expect_near(error[0] / error[1], 4.0, 0.5);
    expect_near(error[1] / error[2], 4.0, 0.3);
}

// ---------------------------------------------------------------------------------------------
// What must not change it

TEST(a_turn_of_the_body_does_not_change_it)
{
    VoxelWorldOptions options = estimated(voxel_world_cube(8), 0.3);
    VoxelWorld world;
    voxel_world_create(&world, &options);
    move(&world, pulled_more_above);
    const double straight = error_of(&world).relative;
    move(&world, turned);
    assert_true(straight > 1e-3);
    // Recovered strains are kept in single precision.
    expect_near(error_of(&world).relative, straight, 1e-5 * straight);
    voxel_world_destroy(&world);
}

TEST(precision_and_budget_do_not_change_it)
{
    double first = 0.0;
    for (int k = 0; k < 3; k++) {
        VoxelWorldOptions options = estimated(voxel_world_cube(16), 0.3);
        options.body.body.precision = k == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        VoxelWorld world;
        voxel_world_create(&world, &options);
        move(&world, pulled_more_above);
        BodyError error;
        const int calls = round_of(&world, k == 2 ? 20 : 1 << 20, &error);
        // Elements twice, a batch beyond the budget at most.
        if (k == 2)
            assert_true(calls > 2 * world.body->element_count / 36 &&
                        calls < 2 * world.body->element_count / 16);
        else
            assert_int_equal(calls, 1);
        if (k == 0)
            first = error.relative;
        // Displacements of a tenth of the body in single precision.
        expect_near(error.relative, first, 1e-4 * first);
        voxel_world_destroy(&world);
    }
}

// A body that can be cut has the same elements in other batches.
TEST(a_body_that_can_be_cut_has_the_same_error)
{
    double error[2];
    for (int cuttable = 0; cuttable < 2; cuttable++) {
        VoxelWorldOptions options = estimated(voxel_world_cube(8), 0.3);
        options.body.body.cuttable = cuttable;
        options.body.split_budget = 100;
        options.body.tick = 1e-3;
        VoxelWorld world;
        voxel_world_create(&world, &options);
        move(&world, pulled_more_above);
        error[cuttable] = error_of(&world).relative;
        voxel_world_destroy(&world);
    }
    // Sums in another order, in single precision.
    expect_near(error[1], error[0], 1e-5 * error[0]);
}

// Stretches the right half of the body alone: each vertex as the elements on its side.
static void stretch_right_half(VoxelWorld *world)
{
    const VoxelModel *model = world->body->model;
    const PlainBatches *plain = &model->batches->plain;
    for (int b = 0; b < plain->batch_count; b++)
        for (int k = 0; k < NODE_CORNERS * LANES; k++) {
            const int *vertex = plain->vertex + (long)b * NODE_CORNERS * LANES;
            const int v = vertex[k], last = vertex[(NODE_CORNERS - 1) * LANES + k % LANES];
            if (v == model->vertices.capacity)
                continue;
            Vec3 x = rows_rest(&model->vertices.rows, v);
            // The corner of its element with the largest x.
            if (rows_rest(&model->vertices.rows, last).x > 0.005)
                x.x *= 1.2;
            rows_write(&model->vertices.rows, model->vertices.row[model->vertices.current], v, x,
                       (Vec3){0.0, 0.0, 0.0});
        }
}

// Two halves that are stretched differently have no error where a cut parts them.
TEST(strains_are_not_recovered_across_a_cut)
{
    double error[2];
    for (int cut = 0; cut < 2; cut++) {
        VoxelWorldOptions options = estimated(voxel_world_block(8, 4, 4, 0.01), 0.0);
        options.body.body.cuttable = true;
        options.body.split_budget = 100;
        options.body.tick = 1e-3;
        VoxelWorld world;
        voxel_world_create(&world, &options);
        if (cut == 1) {
            const CutOptions sweep = {.body = 0,
                                      .before.end = {{1e-4, -1.0, 1.0}, {1e-4, 1.0, 1.0}},
                                      .after.end = {{1e-4, -1.0, -1.0}, {1e-4, 1.0, -1.0}}};
            CutOutcome outcome;
            char why[SIM_EVENT_TEXT];
            assert_true(sim_apply_cut(world.sim, &sweep, &outcome, why, sizeof why));
        }
        stretch_right_half(&world);
        error[cut] = error_of(&world).relative;
        voxel_world_destroy(&world);
    }
    assert_true(error[0] > 0.01);
    assert_true(error[1] < 1e-10);
}

TEST(estimating_changes_no_state)
{
    uint64_t hash[2];
    for (int asked = 0; asked < 2; asked++) {
        VoxelWorldOptions options = voxel_world_cube(8);
        options.body.body.estimate_error = asked;
        VoxelWorld world;
        voxel_world_create(&world, &options);
        voxel_world_throw(&world);
        const ErrorQuestion nothing = {.tool_count = 0};
        for (int k = 0; k < 50; k++) {
            BodyError error;
            sim_step(world.sim);
            // Without the option there is no answer.
            const bool said = world.body->ops->estimate(world.body->model, &nothing, 200, &error);
            assert_true(asked || !said);
        }
        hash[asked] = state_hash(&world.state);
        voxel_world_destroy(&world);
    }
    assert_true(hash[0] == hash[1]);
}

// A body that swings, estimated at once, and during ten ticks: the same state, so the same to the
// last bit.
TEST(a_round_sees_one_state)
{
    VoxelWorldOptions options = estimated(voxel_world_cube(8), 0.3);
    options.body.body.levels = 0;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    move(&world, pulled_more_above);
    sim_ticks(world.sim, 20);
    const BodyError before = error_of(&world);
    const ErrorQuestion nothing = {.tool_count = 0};
    BodyError error;
    int ticks = 0;
    for (; !world.body->ops->estimate(world.body->model, &nothing, 100, &error); ticks++)
        sim_step(world.sim);
    const BodyError after = error_of(&world);
    print_message("%.3f %% and %.3f mm, %d ticks later %.3f %% and %.3f mm\n",
                  100.0 * before.relative, 1e3 * before.displacement, ticks, 100.0 * after.relative,
                  1e3 * after.displacement);
    assert_true(ticks >= 10);
    assert_true(fabs(after.displacement / before.displacement - 1.0) > 0.1);
    expect_near(error.relative, before.relative, 0.0);
    expect_near(error.displacement, before.displacement, 0.0);
}

static double rms_of_nodes(const VoxelWorld *world, const Vec3 *rest)
{
    const BodySurface *surface = &world->body->surface;
    double sum = 0.0;
    int count = 0;
    for (int i = 0; i < surface->node_used; i++) {
        Vec3 x;
        if (surface->node_face_end[i] == surface->node_face_start[i])
            continue;
        world->body->ops->read_nodes(world->body->model, &i, 1, &x, NULL);
        sum += vec3_dot(vec3_sub(x, rest[i]), vec3_sub(x, rest[i]));
        count++;
    }
    return sqrt(sum / count);
}

// The displacement of which an error is a part is that of all nodes that are shown, also of those
// that large elements carry. They are where they are told to be but for the rounding of copies.
TEST(carried_nodes_count_where_they_are)
{
    VoxelWorldOptions options = estimated(voxel_world_cube(8), 0.3);
    options.body.surface_level = options.body.body.levels;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    const int count = world.body->surface.node_used;
    FREED Vec3 *rest = zeroed((size_t)count, sizeof *rest);
    for (int i = 0; i < count; i++)
        world.body->ops->read_nodes(world.body->model, &i, 1, &rest[i], NULL);
    const VoxelModel *model = world.body->model;
    const int rows = model->vertices.count;
    for (int v = 0; v < rows; v++) {
        const Vec3 x = rows_rest(&model->vertices.rows, v);
        rows_write(&model->vertices.rows, model->vertices.present, v, stretched(x),
                   vec3(0.0, 0.0, 0.0));
    }
    sim_step(world.sim);
    const BodyError error = error_of(&world);
    const double moved = error.displacement / error.relative;
    print_message("moved by %.4f mm\n", 1e3 * moved);
    expect_near(moved, rms_of_nodes(&world, rest), 1e-6 * moved);
}

// A body that is stretched as one, and that a tool nears within a round: what is divided was where
// the whole body was, which has no error.
TEST(vertices_that_come_within_a_round_were_where_it_began)
{
    VoxelWorldOptions options = estimated(voxel_world_cube(16), 0.3);
    options.body.surface_level = options.body.body.levels = 2;
    options.tool[options.tool_count++] = (ToolOptions){PROBE(0.01, 10.0)};
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    const VoxelModel *model = world.body->model;
    const Rows *rows = &model->vertices.rows;
    for (int v = 0; v < model->vertices.count; v++)
        if (!cut_lattice_is_carried(&model->cuts->lattice, v))
            rows_write(rows, model->vertices.row[model->vertices.current], v,
                       stretched(rows_rest(rows, v)), vec3(0.0, 0.0, 0.0));
    const ErrorQuestion nothing = {.tool_count = 0};
    BodyError error;
    assert_false(world.body->ops->estimate(world.body->model, &nothing, 1, &error)); // it copies
    const int elements = world.body->element_count;
    put_tool(world.sim, 0, vec3(0.0, 0.0, 0.07));
    sim_ticks(world.sim, 40);
    assert_true(world.body->element_count > elements + 100);
    round_of(&world, 1 << 20, &error);
    print_message("%d elements came, error %.1e\n", world.body->element_count - elements,
                  error.relative);
    // Squares of single precision's rounding, over that of the strain.
    assert_true(error.relative < 1e-10);
}

// ---------------------------------------------------------------------------------------------
// Where it is

TEST(it_is_shown_where_it_is)
{
    const ErrorScene *scene = error_scene("block press medium");
    ErrorRun run;
    error_run(&run, scene, 0);
    error_run_estimate(&run, scene, 1000);
    const Body *body = run.world.body;
    const int nodes = body->mesh.node_count;
    FREED unsigned char *share = zeroed((size_t)nodes, 1);
    body->ops->snapshot_error(body->model, 0, nodes, share);
    // Under the ball most; far from it a tenth at most.
    int near = 0, far = 0;
    for (int i = 0; i < nodes; i++) {
        Vec3 x;
        body->ops->read_nodes(body->model, &i, 1, &x, NULL);
        const double away = vec3_length(vec3_sub(x, vec3(0.0, 0.0, 0.04)));
        near = away < 0.02 && share[i] > near ? share[i] : near;
        far = away > 0.06 && share[i] > far ? share[i] : far;
    }
    assert_int_equal(near, 255);
    assert_true(far < 26);
    error_run_end(&run);
}

// ---------------------------------------------------------------------------------------------
// The truth

// Scenes of the study (tests/accuracy/errors.md), in the short form those whose bodies come
// to rest within a tenth of a second, against the truth that the study found.
TEST(the_error_of_scenes_is_within_a_factor_of_two)
{
    int scenes = 0, within = 0, forces = 0, forces_within = 0;
    for (int s = 0; s < ERROR_SCENE_COUNT; s++) {
        const ErrorScene *scene = &ERROR_SCENES[s];
        if (scene->slow && !test_is_long())
            continue;
        ErrorRun run;
        error_run(&run, scene, 0);
        const BodyError error = error_run_estimate(&run, scene, 500);
        const double ratio = error.relative / scene->truth;
        print_message("%-28s %.2f\n", scene->name, ratio);
        scenes++;
        within += ratio >= 0.5 && ratio <= 2.0;
        assert_true(ratio > 1.0 / 3.0);
        // The force's terms cancel each other, to nothing in places: below 1 % it is a bound.
        const double of_force = error.force[0] / fabs(scene->force_truth);
        if (fabs(scene->force_truth) > 0.01) {
            print_message("%-28s %.2f (force)\n", scene->name, of_force);
            forces++;
            forces_within += of_force >= 0.5 && of_force <= 2.0;
            assert_true(of_force > 1.0 / 3.0);
        }
        error_run_end(&run);
    }
    assert_true(scenes >= 25);
    assert_true(10 * within >= 9 * scenes);
    // All but the three of the study: 28 of 31 in the long form.
    assert_true(forces >= 20);
    assert_true(forces - forces_within <= 3);
}
