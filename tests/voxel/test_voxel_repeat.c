// SPDX-License-Identifier: MIT
// The same scene, the same bits: at every instruction-set level, from a second build, after a
// reset, from a state that was put away. A scene that is moved and turned as a whole does the same
// there.
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "random.h"
#include "voxel_world.h"

#include "voxel/model.h"

// A corner of three materials that is stirred, loaded, and held or free.
static void create(VoxelWorld *world, Precision precision, IntegratorKind integrator, bool held,
                   const char *isa)
{
    static const FixedRegion end = {.kind = FIXED_BOX, .low = {-1, -1, -1}, .high = {1, 1, 0.01}};
    VoxelWorldOptions options = voxel_world_corner();
    options.body.body.precision = precision;
    options.body.body.integrator = integrator;
    options.body.body.gravity = vec3(0.0, 1.0, -9.81);
    options.body.body.fixed = &end;
    options.body.body.fixed_count = held ? 1 : 0;
    options.body.body.isa = isa;
    voxel_world_create(world, &options);
}

// Noise of more than half a cell, so that some elements are flat or turned over and the slow path
// of rotations has work.
static void stir(VoxelWorld *world)
{
    uint64_t random = 5;
    for (int i = 0; i < world->count; i++) {
        bool held = world->body->surface.node_count > i &&
                    world->body->ops->is_fixed(world->body->model, i);
        Vec3 noise = random_vec3(&random), speed = random_vec3(&random);
        if (held || world->x[i].z <= 0.01)
            continue;
        world->x[i] = vec3_madd(world->x[i], 0.005, noise);
        world->v[i] = vec3_madd(vec3_cross(vec3(1.0, 2.0, 3.0), world->x[i]), 0.3, speed);
    }
    voxel_world_write(world, world->x, world->v);
}

static void press(VoxelWorld *world)
{
    LoadOptions load = {
        .center = {0.04, 0.02, 0.09}, .radius = 0.04, .force = {0.1, 0.0, -0.2}, .duration = 0.03};
    apply_well(sim_apply_load, world->sim, &load);
}

static uint64_t run(VoxelWorld *world)
{
    stir(world);
    press(world);
    voxel_world_run(world, 0.06);
    assert_int_equal(world->body->resets, 0);
    return state_hash(&world->state);
}

TEST(every_level_of_instructions_gives_the_same_bits)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++)
        for (int law = 0; law < 2; law++) {
            uint64_t first = 0;
            for (const char *const *isa = isa_available(); *isa != NULL; isa++) {
                SCOPED(voxel_world_destroy) VoxelWorld world;
                create(&world, (Precision)precision, INTEGRATOR_SYMPLECTIC_EULER, law == 1, *isa);
                uint64_t hash = run(&world);
                assert_string_equal(world.body->ops->isa(world.body->model), *isa);
                if (isa == isa_available())
                    first = hash;
                assert_true(hash == first);
            }
        }
}

TEST(a_second_build_gives_the_same_bits)
{
    for (int integrator = 1; integrator < 3; integrator++) {
        uint64_t hash[2];
        for (int k = 0; k < 2; k++) {
            SCOPED(voxel_world_destroy) VoxelWorld world;
            create(&world, PRECISION_SINGLE, (IntegratorKind)integrator, integrator == 2, "auto");
            hash[k] = run(&world);
        }
        assert_true(hash[0] == hash[1]);
    }
}

// All that moves; not the clock, which goes on.
static void expect_same_body(const VoxelWorld *world, const void *rows, const BaseFrame *frame)
{
    const VoxelModel *model = world->body->model;
    size_t bytes =
        (size_t)(model->vertices.count + 1) * ROW * rows_real_size(&model->vertices.rows);
    assert_memory_equal(model->vertices.row[model->vertices.current], rows, bytes);
    assert_memory_equal(&model->vertices.rows.frame->origin, &frame->origin, sizeof frame->origin);
    assert_memory_equal(&model->vertices.rows.frame->turn, &frame->turn, sizeof frame->turn);
}

TEST(after_a_reset_all_begins_anew)
{
    for (int held = 0; held < 2; held++) {
        SCOPED(voxel_world_destroy) VoxelWorld world;
        create(&world, PRECISION_SINGLE, INTEGRATOR_LEAPFROG, held == 1, "auto");
        const VoxelModel *model = world.body->model;
        size_t bytes = (size_t)(model->vertices.count + 1) * ROW * sizeof(float);
        FREED void *rows = malloc(bytes);
        BaseFrame frame = {.ticks = 0};
        for (int k = 0; k < 2; k++) {
            run(&world);
            if (k == 0) {
                memcpy(rows, model->vertices.row[model->vertices.current], bytes);
                frame = *model->vertices.rows.frame;
            } else {
                expect_same_body(&world, rows, &frame);
            }
            sim_reset(world.sim);
            voxel_world_read(&world);
            for (int i = 0; i < world.count; i++) {
                assert_true(vec3_length(world.v[i]) == 0.0);
                Vec3 rest = rows_rest(&model->vertices.rows, i);
                expect_near(vec3_length(vec3_sub(world.x[i], rest)), 0.0, 0.0);
            }
        }
    }
}

// Put away in the middle of a load and of the repair of turned elements; another body goes on from
// there.
TEST(a_state_put_away_goes_on_with_the_same_bits)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++)
        for (int held = 0; held < 2; held++) {
            SCOPED(voxel_world_destroy) VoxelWorld world, other;
            create(&world, (Precision)precision, INTEGRATOR_SYMPLECTIC_EULER, held == 1, "auto");
            create(&other, (Precision)precision, INTEGRATOR_SYMPLECTIC_EULER, held == 1, "auto");
            stir(&world);
            press(&world);
            voxel_world_run(&world, 0.011);
            FREED void *block = copy_state(&world.state);
            voxel_world_run(&world, 0.05);
            uint64_t hash = state_hash(&world.state);

            voxel_world_run(&other, 0.007); // it has been elsewhere
            resume(&other.state, other.sim, block);
            assert_true(sim_check(other.sim));
            assert_true(other.body->ops->check(other.body->model));
            voxel_world_run(&other, 0.05);
            assert_true(state_hash(&other.state) == hash);

            state_copy_in(&world.state, block); // and back in the same
            sim_restored(world.sim);
            voxel_world_run(&world, 0.05);
            assert_true(state_hash(&world.state) == hash);
        }
}

// States read from a file that cannot be.
TEST(states_that_cannot_be_are_seen)
{
    SCOPED(voxel_world_destroy) VoxelWorld world;
    create(&world, PRECISION_DOUBLE, INTEGRATOR_SYMPLECTIC_EULER, false, "auto");
    VoxelModel *model = world.body->model;
    const BodyOps *ops = world.body->ops;
    assert_true(ops->check(model));
    double *number = (double *)model->vertices.row[model->vertices.current] + ROW + 5,
           kept = *number;
    *number = (double)NAN;
    assert_false(ops->check(model));
    *number = 1e101;
    assert_false(ops->check(model));
    *number = kept;
    assert_true(ops->check(model));
    model->batches->last[0][3][0] = 2.0;
    assert_false(ops->check(model));
    model->batches->last[0][3][0] = (double)NAN;
    assert_false(ops->check(model));
    model->batches->last[0][3][0] = 1.0;
    model->vertices.rows.frame->turn.w = 0.0;
    assert_false(ops->check(model));
    model->vertices.rows.frame->turn = QUAT_NONE;
    assert_true(ops->check(model));
}

// The scene placed elsewhere and turned, all of its vectors with it.
static void create_placed(VoxelWorld *world, Quat turn, Vec3 move, bool held,
                          IntegratorKind integrator)
{
    VoxelWorldOptions options = voxel_world_corner();
    FixedRegion end = {
        .kind = FIXED_SPHERE,
        .center = vec3_add(move, quat_rotate(turn, vec3(0.02, 0.02, 0.0))),
        .radius = 0.0213, // no vertex on its border
    };
    options.body.body.gravity = quat_rotate(turn, vec3(0.0, 3.0, -9.81));
    options.body.body.integrator = integrator;
    options.body.body.fixed = &end;
    options.body.body.fixed_count = held ? 1 : 0;
    lattice_place(&options.lattice, 1.0, quat_to_rotation(turn), move);
    voxel_world_create(world, &options);
    uint64_t random = 9;
    for (int i = 0; i < world->count; i++) {
        Vec3 u = vec3_scale(0.0005, random_vec3(&random));
        Vec3 v = vec3_scale(0.2, random_vec3(&random));
        if (held)
            continue;
        world->x[i] = vec3_add(world->x[i], quat_rotate(turn, u));
        world->v[i] = quat_rotate(turn, v);
    }
    voxel_world_write(world, world->x, world->v);
    LoadOptions load = {.center = vec3_add(move, quat_rotate(turn, vec3(0.02, 0.02, 0.09))),
                        .radius = 0.0213,
                        .force = quat_rotate(turn, vec3(0.1, 0.05, 0.1)),
                        .duration = 0.1};
    apply_well(sim_apply_load, world->sim, &load);
    voxel_world_run(world, 0.3);
    voxel_world_read(world);
}

TEST(a_scene_moved_as_a_whole_does_the_same_there)
{
    const Quat turn = quat_from_rotation(vec3(0.5, -1.2, 2.0));
    const Vec3 move = {0.7, -0.4, 0.2};
    for (int held = 0; held < 2; held++)
        for (int integrator = 1; integrator < 3; integrator++) {
            SCOPED(voxel_world_destroy) VoxelWorld here, there;
            create_placed(&here, QUAT_NONE, vec3(0.0, 0.0, 0.0), held == 1,
                          (IntegratorKind)integrator);
            create_placed(&there, turn, move, held == 1, (IntegratorKind)integrator);
            double worst = 0.0;
            for (int i = 0; i < here.count; i++) {
                Vec3 expected = vec3_add(move, quat_rotate(turn, here.x[i]));
                worst = fmax(worst, vec3_length(vec3_sub(there.x[i], expected)));
            }
            print_message("%s: differs by %.2g m\n", held == 1 ? "held" : "free", worst);
            // Rounding of places of a metre, which a stable motion does not enlarge.
            expect_near(worst, 0.0, 1e-12);
        }
}
