// SPDX-License-Identifier: MIT
// Maxwell branches: forces against the energy, the relaxation of a stretched bar, the decay of
// swings at a loss factor, what a free body keeps, states and cuts.
#include "effort.h"
#include "test.h"
#include "extreme.h"
#include "random.h"
#include "voxel_world.h"

#include "voxel/model.h"

#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

static void set_branches(VoxelOptions *options, int count, const MaxwellBranch *branch)
{
    options->branch_count = count;
    memcpy(options->branch, branch, (size_t)count * sizeof *branch);
}

static Relaxation *relaxation_of(const VoxelWorld *world)
{
    const VoxelModel *model = world->body->model;
    return model->batches->relaxation;
}

// Evaluates the forces of the elements in the present state, without moving the dashpots: [count].
static void read_forces(const VoxelWorld *world, Vec3 *force)
{
    VoxelModel *model = world->body->model;
    Vertices *vertices = &model->vertices;
    const size_t bytes = ((size_t)vertices->capacity + 1) * 4 * rows_real_size(&vertices->rows);
    VoxelPass pass = voxel_pass(model, vertices_row(vertices));
    relaxation_begin(model->batches->relaxation, 0.0, &pass.relaxation);
    memset(vertices->force, 0, bytes);
    batch_runs_evaluate(model->batches, &pass, BATCHES_ALL);
    relaxation_abandon(model->batches->relaxation);
    for (int i = 0; i < world->count; i++)
        force[i] = vec3(rows_get(&vertices->rows, vertices->force, 4L * i),
                        rows_get(&vertices->rows, vertices->force, 4L * i + 1),
                        rows_get(&vertices->rows, vertices->force, 4L * i + 2));
    memset(vertices->force, 0, bytes);
}

static double elastic_of(const VoxelWorld *world)
{
    BodyMeasure measure;
    world->body->ops->measure(world->body->model, &measure);
    return measure.elastic;
}

// ---------------------------------------------------------------------------------------------
// Forces

// With any strains of the dashpots, in strained and turned states, of cubes and elements with
// hanging vertices: forces are the slope of the energy, and have neither resultant nor moment.
TEST(forces_are_the_gradient_of_the_energy)
{
    static const MaxwellBranch BRANCHES[] = {{0.1, 0.3, false}, {0.02, 0.25, true}};
    VoxelWorldOptions options = voxel_world_cube(8);
    options.material.poisson_ratio = 0.3;
    options.body.damping = 0.0;
    options.body.body.levels = 1;
    set_branches(&options.body, 2, BRANCHES);
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    Relaxation *relaxation = relaxation_of(&world);
    uint64_t random = 5;
    const Quat turn = quat_unit((Quat){0.8, 0.3, -0.4, 0.2});
    const int count = world.count;
    FREED Vec3 *x = malloc((size_t)count * sizeof *x), *d = malloc((size_t)count * sizeof *d),
               *moved = malloc((size_t)count * sizeof *moved),
               *f = malloc((size_t)count * sizeof *f);
    voxel_world_read(&world);
    memcpy(x, world.x, (size_t)count * sizeof *x);
    for (int round = 0; round < EFFORT(8); round++) {
        for (int i = 0; i < count; i++) {
            const Vec3 stretched = vec3(1.2 * x[i].x + 0.1 * x[i].y, 0.9 * x[i].y, 0.95 * x[i].z);
            world.x[i] = vec3_madd(quat_rotate(turn, stretched), 1e-3, random_vec3(&random));
            d[i] = random_vec3(&random);
        }
        voxel_world_write(&world, world.x, world.v);
        double strain[RELAXATION_NUMBERS];
        for (int lane = 0; lane < relaxation->layout.groups * LANES; lane++) {
            for (int n = 0; n < RELAXATION_NUMBERS; n++)
                strain[n] = random_between(&random, -0.2, 0.2);
            relaxation_put(relaxation, lane, strain);
        }
        read_forces(&world, f);
        double slope = 0.0, size = 0.0, energy[2];
        Vec3 sum = {0, 0, 0}, moment = {0, 0, 0};
        for (int i = 0; i < count; i++) {
            slope -= vec3_dot(f[i], d[i]);
            size += vec3_length(f[i]);
            sum = vec3_add(sum, f[i]);
            moment = vec3_add(moment, vec3_cross(world.x[i], f[i]));
        }
        const double step = 1e-7;
        for (int side = 0; side < 2; side++) {
            for (int i = 0; i < count; i++)
                moved[i] = vec3_madd(world.x[i], side == 0 ? -step : step, d[i]);
            voxel_world_write(&world, moved, world.v);
            energy[side] = elastic_of(&world);
        }
        const double differs = (energy[1] - energy[0]) / (2.0 * step);
        expect_near(slope, differs, 1e-6 * size);
        expect_at_most(vec3_length(sum), 1e-12 * size);
        expect_at_most(vec3_length(moment), 1e-12 * 0.1 * size);
    }
}

// ---------------------------------------------------------------------------------------------
// Relaxation

// A bar, stretched by 10 % at once and held: its stress falls as E (1 + sum e exp(-t / time)), e
// the stiffness of a branch over E. A branch of changes of shape alone has the shear modulus mu e,
// and with nu = 0.3 the bar, whose sides are free, the modulus 9 K G / (3 K + G).
TEST(stress_relaxes_as_the_closed_form)
{
    static const FixedRegion ends[] = {
        {.kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {-0.0999, 1.0, 1.0}},
        {.kind = FIXED_BOX, .low = {0.0999, -1.0, -1.0}, .high = {1.0, 1.0, 1.0}}};
    static const MaxwellBranch BRANCHES[] = {{0.03, 0.2, true}, {0.3, 0.3, true}};
    VoxelWorldOptions options = voxel_world_cube(4);
    Status status = {0};
    lattice_destroy(&options.lattice);
    assert_true(lattice_box(&options.lattice, (int[3]){8, 2, 2}, 0.025, &status));
    options.material = (SolidMaterial){1e4, 0.0, 1000.0};
    options.body.body.levels = 0;
    options.body.body.fixed = ends;
    options.body.body.fixed_count = 2;
    set_branches(&options.body, 2, BRANCHES);
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    voxel_world_read(&world);
    for (int i = 0; i < world.count; i++) {
        world.x[i].x *= 1.1;
        world.v[i] = vec3(0.0, 0.0, 0.0);
    }
    voxel_world_write(&world, world.x, world.v);
    FREED Vec3 *force = malloc((size_t)world.count * sizeof *force);
    double off = 0.0;
    for (int tick = 0; tick <= 1500; tick++) {
        double pull = 0.0;
        read_forces(&world, force);
        for (int i = 0; i < world.count; i++)
            pull += world.x[i].x > 0.1 ? -force[i].x : 0.0;
        // Shares of the stiffness to fast strains, of which half is left.
        const double t = tick * sim_tick(world.sim),
                     expected = 1e4 * 0.1 * 0.05 * 0.05 / 0.5 *
                                (0.5 + 0.2 * exp(-t / 0.03) + 0.3 * exp(-t / 0.3));
        off = fmax(off, fabs(pull / expected - 1.0));
        sim_step(world.sim);
    }
    print_message("stress off by %.2g of the closed form\n", off);
    expect_at_most(off, 1e-6); // exact in time, the state is in double
}

// ---------------------------------------------------------------------------------------------
// Swings

static const double LENGTH = 0.2, WIDTH = 0.05; // [m]

typedef struct Swing {
    double youngs_modulus, loss;
    bool twists;
} Swing;

// The shape of the swing at a rest position: bending of a cantilever, or torsion.
static Vec3 shape_of(const Swing *swing, Vec3 rest)
{
    const double z = (rest.x + 0.5 * LENGTH) / LENGTH, k = 1.8751040687, s = 0.7340955138;
    if (swing->twists)
        return vec3_scale(sin(0.5 * PI * z), vec3(0.0, -rest.z, rest.y));
    return vec3(0.0, 0.0,
                0.5 * WIDTH * (cosh(k * z) - cos(k * z) - s * (sinh(k * z) - sin(k * z))));
}

// Plucks a bar; returns its loss factor, by the logarithmic decrement, and its frequency [Hz].
static double loss_of(const Swing *swing, double *frequency, double *growth)
{
    static const FixedRegion end = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {-0.0999, 1.0, 1.0}};
    VoxelWorldOptions options = voxel_world_cube(4);
    Status status = {0};
    lattice_destroy(&options.lattice);
    assert_true(lattice_box(&options.lattice, (int[3]){24, 6, 6}, WIDTH / 6.0, &status));
    options.material = (SolidMaterial){swing->youngs_modulus, 0.3, 1000.0};
    options.body.body.fixed = &end;
    options.body.body.fixed_count = 1;
    options.body.body.levels = 0;
    options.body.body.integrator = INTEGRATOR_LEAPFROG;
    options.body.damping = 0.0;
    options.body.branch_count = MAXWELL_BRANCHES;
    assert_true(maxwell_of_loss(swing->loss, options.body.branch));
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    voxel_world_read(&world);
    FREED Vec3 *shape = malloc((size_t)world.count * sizeof *shape),
               *rest = malloc((size_t)world.count * sizeof *rest);
    for (int i = 0; i < world.count; i++) {
        rest[i] = world.x[i];
        shape[i] = shape_of(swing, rest[i]);
        world.v[i] = vec3_scale(0.05 * sqrt(swing->youngs_modulus / 1e5), shape[i]);
    }
    voxel_world_write(&world, world.x, world.v);
    Extremes extremes = {0};
    BodyMeasure before, now;
    world.body->ops->measure(world.body->model, &before);
    bool more = true;
    *growth = 0.0;
    for (int tick = 1; tick < 20000 && more; tick++) {
        double part = 0.0; // of the swing's shape
        sim_step(world.sim);
        voxel_world_read(&world);
        for (int i = 0; i < world.count; i++)
            part += world.mass[i] * vec3_dot(shape[i], vec3_sub(world.x[i], rest[i]));
        more = add_sample(&extremes, part);
        world.body->ops->measure(world.body->model, &now);
        *growth = fmax(*growth, (now.kinetic + now.elastic) / (before.kinetic + before.elastic));
        before = now;
    }
    assert_false(more);
    double decrement;
    *frequency = 0.5 / (half_swing(&extremes, &decrement) * sim_tick(world.sim));
    // Half a swing: a decrement of pi times the damping ratio, half of the loss factor.
    return 2.0 * decrement / PI;
}

// At 3, 10 and 30 Hz, bent and twisted, with moduli that bring the bar there.
TEST(swings_decay_at_the_loss_factor)
{
    static const double MODULI[2][3] = {{2.3e5, 2.6e6, 2.3e7}, {2.3e4, 2.6e5, 2.3e6}};
    for (int loss = 0; loss < 2; loss++)
        for (int k = 0; k < EFFORT(6); k++) {
            const Swing swing = {MODULI[k % 2][k / 2], loss == 0 ? 0.1 : 0.2, k % 2 == 1};
            double f, growth;
            const double got = loss_of(&swing, &f, &growth);
            print_message(
                "%s at %.3g Hz: loss factor %.4f, asked %.2f; energy at most %.6f of that "
                "a tick before\n",
                swing.twists ? "twisted" : "bent", f, got, swing.loss, growth);
            expect_near(got, swing.loss, 0.2 * swing.loss);
            expect_at_most(growth, 1.0 + 1e-3); // leapfrog's elastic energy oscillates in a step
        }
}

// ---------------------------------------------------------------------------------------------
// A free body, states, cuts

static void make_free(VoxelWorld *world, Precision precision, bool cuttable)
{
    static const MaxwellBranch BRANCHES[] = {{0.005, 0.2, false}, {0.05, 0.2, true}};
    VoxelWorldOptions options = voxel_world_cube(8);
    options.material.poisson_ratio = 0.3;
    options.body.body.precision = precision;
    options.body.body.cuttable = cuttable;
    options.body.split_budget = 4;
    options.body.damping = 0.0;
    set_branches(&options.body, 2, BRANCHES);
    voxel_world_create(world, &options);
    voxel_world_throw(world);
}

TEST(a_free_body_keeps_its_momentum)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        SCOPED(voxel_world_destroy) VoxelWorld world;
        make_free(&world, (Precision)precision, false);
        Vec3 linear[2], angular[2];
        voxel_world_momentum(&world, &linear[0], &angular[0]);
        BodyMeasure before, now;
        world.body->ops->measure(world.body->model, &before);
        voxel_world_run(&world, EFFORT(1000) * 1e-3);
        voxel_world_read(&world);
        voxel_world_momentum(&world, &linear[1], &angular[1]);
        world.body->ops->measure(world.body->model, &now);
        const double scale = vec3_length(angular[0]),
                     p = vec3_length(vec3_sub(linear[1], linear[0])) * 0.1 / scale,
                     l = vec3_length(vec3_sub(angular[1], angular[0])) / scale;
        const bool single = precision == PRECISION_SINGLE;
        print_message("%s: momentum off by %.2g, angular by %.2g, %.3f of the energy left\n",
                      single ? "single" : "double", p, l,
                      (now.kinetic + now.elastic) / (before.kinetic + before.elastic));
        expect_at_most(p, single ? 1e-5 : 1e-11);
        expect_at_most(l, single ? 1e-4 : 1e-10);
        assert_true(now.kinetic + now.elastic < 0.9 * (before.kinetic + before.elastic));
    }
}

// A body is cut in the middle of its motion; from a state before that, all of it repeats. Elements
// that move to other batches, and those that are divided, take their strains along: energy does not
// grow by the cut.
TEST(states_and_cuts_keep_the_dashpots)
{
    SCOPED(voxel_world_destroy) VoxelWorld world;
    make_free(&world, PRECISION_DOUBLE, true);
    voxel_world_run(&world, 0.02);
    FREED void *middle = malloc(state_bytes(&world.state));
    state_copy_out(&world.state, middle);
    uint64_t hash[2];
    for (int pass = 0; pass < 2; pass++) {
        char why[256];
        const CutOptions cut = {.body = 0,
                                .before = {{{-0.2, -0.2, 0.003}, {-0.2, 0.2, 0.003}}},
                                .after = {{{0.2, -0.2, 0.003}, {0.2, 0.2, 0.003}}}};
        CutOutcome sum = {0};
        voxel_world_run(&world, 0.005);
        BodyMeasure before, now;
        world.body->ops->measure(world.body->model, &before);
        assert_true(sim_apply_cut(world.sim, &cut, &sum, why, sizeof why));
        sim_step(world.sim);
        world.body->ops->measure(world.body->model, &now);
        // A tick of damping, and what a swing of leapfrog's energy is.
        expect_at_most(now.kinetic + now.elastic, 1.001 * (before.kinetic + before.elastic));
        voxel_world_run(&world, 0.05);
        hash[pass] = state_hash(&world.state);
        // Also from a state after the cut, whose lanes without elements are those of a new run.
        FREED void *late = malloc(state_bytes(&world.state));
        uint64_t later[2];
        assert_non_null(late);
        state_copy_out(&world.state, late);
        for (int again = 0; again < 2; again++) {
            voxel_world_run(&world, 0.011);
            later[again] = state_hash(&world.state);
            state_copy_in(&world.state, late);
            sim_restored(world.sim);
        }
        assert_true(later[0] == later[1]);
        state_copy_in(&world.state, middle);
        sim_restored(world.sim);
        assert_true(world.body->ops->check(world.body->model));
    }
    assert_true(hash[0] == hash[1]);
    // What no tissue has been is refused.
    ((double *)relaxation_of(&world)->strain[relaxation_of(&world)->current])[7] = (double)NAN;
    assert_false(world.body->ops->check(world.body->model));
}
