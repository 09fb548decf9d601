// SPDX-License-Identifier: MIT
// Stiffening: forces against the energy, the curve of a bar, what a free body keeps, energy from
// wild starts, states, cuts, threads, tearing.
#include "effort.h"
#include "test.h"
#include "random.h"
#include "voxel_world.h"

#include "voxel/model.h"

#include <stdlib.h>
#include <string.h>

// Evaluates the forces of the elements in the present state: [count].
static void read_forces(const VoxelWorld *world, Vec3 *force)
{
    VoxelModel *model = world->body->model;
    Vertices *vertices = &model->vertices;
    const size_t bytes = ((size_t)vertices->capacity + 1) * 4 * rows_real_size(&vertices->rows);
    VoxelPass pass = voxel_pass(model, vertices_row(vertices));
    if (model->batches->relaxation != NULL)
        relaxation_begin(model->batches->relaxation, 0.0, &pass.relaxation);
    memset(vertices->force, 0, bytes);
    batch_runs_evaluate(model->batches, &pass, BATCHES_ALL);
    if (model->batches->relaxation != NULL)
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

static double energy_of(const VoxelWorld *world)
{
    BodyMeasure measure;
    world->body->ops->measure(world->body->model, &measure);
    return measure.elastic + measure.kinetic;
}

static void cut_through(VoxelWorld *world, double z)
{
    char why[256];
    const CutOptions cut = {.body = 0,
                            .before = {{{-0.2, -0.2, z}, {-0.2, 0.2, z}}},
                            .after = {{{0.2, -0.2, z}, {0.2, 0.2, z}}}};
    CutOutcome sum = {0};
    assert_true(sim_apply_cut(world->sim, &cut, &sum, why, sizeof why));
    assert_true(sum.separated > 0);
}

// Makes room for the vertices that cuts and divisions have added, and reads them all.
static void read_all(VoxelWorld *world)
{
    const VoxelModel *model = world->body->model;
    world->count = model->vertices.count;
    const size_t count = (size_t)world->count;
    world->id = realloc(world->id, count * sizeof *world->id);
    world->x = realloc(world->x, count * sizeof *world->x);
    world->v = realloc(world->v, count * sizeof *world->v);
    assert_true(world->id != NULL && world->x != NULL && world->v != NULL);
    voxel_world_read(world);
}

// ---------------------------------------------------------------------------------------------
// Forces

// Compares the slope along a random direction, the resultant and the moment.
static void expect_slope(VoxelWorld *world, const Vec3 *x, uint64_t *random)
{
    const int count = world->count;
    FREED Vec3 *d = malloc((size_t)count * sizeof *d),
               *moved = malloc((size_t)count * sizeof *moved),
               *f = malloc((size_t)count * sizeof *f);
    for (int i = 0; i < count; i++)
        d[i] = random_vec3(random);
    voxel_world_write(world, x, world->v);
    read_forces(world, f);
    double slope = 0.0, size = 0.0, energy[2];
    Vec3 sum = {0, 0, 0}, moment = {0, 0, 0};
    for (int i = 0; i < count; i++) {
        slope -= vec3_dot(f[i], d[i]);
        size += vec3_length(f[i]);
        sum = vec3_add(sum, f[i]);
        moment = vec3_add(moment, vec3_cross(x[i], f[i]));
    }
    // Of an energy that grows by powers of a strain of 0.02: the third derivatives times the square
    // of the step are 1e-9 of the slope.
    const double step = 1e-7;
    for (int side = 0; side < 2; side++) {
        for (int i = 0; i < count; i++)
            moved[i] = vec3_madd(x[i], side == 0 ? -step : step, d[i]);
        voxel_world_write(world, moved, world->v);
        energy[side] = elastic_of(world);
    }
    expect_near(slope, (energy[1] - energy[0]) / (2.0 * step), 1e-6 * size);
    expect_at_most(vec3_length(sum), 1e-12 * size);
    expect_at_most(vec3_length(moment), 1e-12 * 0.1 * size);
}

// Strained by up to 20 %, turned, with noise, crushed in places: far below the knee, about it and
// beyond it, cubes and elements with hanging vertices, relaxing ones, before and after a cut that
// divides some.
TEST(forces_are_the_slope_of_the_energy)
{
    static const MaxwellBranch BRANCH = {0.1, 0.3, true};
    static const Stiffening LAWS[] = {{1.0, 10.0}, {0.1, 10.0}, {0.02, 100.0}, {0.3, 3.0}};
    static const double NOISE[] = {1e-3, 4e-3}; // of cells of 12.5 mm: crushed ones with the second
    uint64_t random = 5;
    const Quat turn = quat_unit((Quat){0.8, 0.3, -0.4, 0.2});
    for (int k = 0; k < EFFORT(8); k++) {
        VoxelWorldOptions options = voxel_world_cube(8);
        options.material.poisson_ratio = 0.3;
        options.body.damping = 0.0;
        options.body.body.levels = 1;
        options.body.body.cuttable = k % 2 != 0;
        options.body.split_budget = 100;
        options.body.stiffening = LAWS[k / 2 % 4];
        options.body.branch_count = k / 4 % 2;
        options.body.branch[0] = BRANCH;
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        if (k % 2 != 0) {
            cut_through(&world, 0.003);
            voxel_world_run(&world, 0.01);
        }
        read_all(&world);
        const int count = world.count;
        FREED Vec3 *x = malloc((size_t)count * sizeof *x);
        for (int round = 0; round < 4; round++) {
            for (int i = 0; i < count; i++) {
                const Vec3 p = world.x[i], s = vec3(1.2 * p.x + 0.1 * p.y, 0.9 * p.y, 0.95 * p.z);
                x[i] = vec3_madd(quat_rotate(turn, s), NOISE[round % 2], random_vec3(&random));
            }
            expect_slope(&world, x, &random);
        }
    }
}

// A bar stretched or shortened by e, its sides narrower by nu e as a free bar's are: its stress is
// E e exp((e/s)^2) up to the strain s sqrt(q_c), and from there on a straight line with the slope
// cap E. Here q_c is the root of (1 + 2 q) exp(q) = cap by bisection.
TEST(a_bar_follows_the_closed_form)
{
    static const Stiffening LAWS[] = {{0.15, 10.0}, {0.3, 2.0}, {0.1, 100.0}};
    const double modulus = 1e4, side = 0.05;
    for (int k = 0; k < 6; k++) {
        const Stiffening law = LAWS[k % 3];
        const double nu = k < 3 ? 0.0 : 0.3;
        double low = 0.0, high = 3.0;
        for (int i = 0; i < 60; i++) {
            const double q = 0.5 * (low + high);
            *((1.0 + 2.0 * q) * exp(q) < law.cap ? &low : &high) = q;
        }
        const double knee = law.strain * sqrt(low), at_knee = knee * exp(low);
        VoxelWorldOptions options = voxel_world_cube(4);
        Status status = {0};
        lattice_destroy(&options.lattice);
        assert_true(lattice_box(&options.lattice, (int[3]){8, 2, 2}, 0.5 * side, &status));
        options.material = (SolidMaterial){modulus, nu, 1000.0};
        options.body.body.levels = 0;
        options.body.stiffening = law;
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        voxel_world_read(&world);
        FREED Vec3 *x = malloc((size_t)world.count * sizeof *x),
                   *force = malloc((size_t)world.count * sizeof *force);
        double off = 0.0;
        for (double e = -0.6; e < 0.8; e += 0.05) {
            const double size = fabs(e),
                         stress = size <= knee ? size * exp(size * size / (law.strain * law.strain))
                                               : at_knee + law.cap * (size - knee);
            for (int i = 0; i < world.count; i++)
                x[i] = vec3((1.0 + e) * world.x[i].x, (1.0 - nu * e) * world.x[i].y,
                            (1.0 - nu * e) * world.x[i].z);
            voxel_world_write(&world, x, world.v);
            read_forces(&world, force);
            double pull = 0.0;
            for (int i = 0; i < world.count; i++)
                pull += world.x[i].x > 0.0999 ? -force[i].x : 0.0;
            const double expected = copysign(modulus * side * side * stress, e);
            if (size > 1e-9)
                off = fmax(off, fabs(pull / expected - 1.0));
        }
        print_message("s %.2f, cap %3.0f, nu %.1f: off by %.2g of the closed form\n", law.strain,
                      law.cap, nu, off);
        expect_at_most(off, 1e-10); // rounding; 1e-2 is asked
    }
}

// ---------------------------------------------------------------------------------------------
// Motion

static void make_free(VoxelWorld *world, Precision precision, bool cuttable, bool relaxes,
                      Team *team)
{
    static const MaxwellBranch BRANCHES[] = {{0.005, 0.2, false}, {0.05, 0.2, true}};
    VoxelWorldOptions options = voxel_world_cube(cuttable ? 8 : 16);
    options.material.poisson_ratio = 0.3;
    options.body.body.precision = precision;
    options.body.body.cuttable = cuttable;
    options.body.body.team = team;
    options.body.split_budget = 4;
    options.body.damping = 0.2;
    options.body.stiffening = (Stiffening){0.02, 10.0};
    options.body.branch_count = relaxes ? 2 : 0;
    memcpy(options.body.branch, BRANCHES, sizeof BRANCHES);
    voxel_world_create(world, &options);
    voxel_world_throw(world);
}

// Rounding of some thousand substeps, a few per cent beyond the strain of the law.
TEST(a_free_body_keeps_its_momentum)
{
    for (int k = 0; k < 4; k++) {
        const bool single = k % 2 != 0;
        SCOPED(voxel_world_destroy) VoxelWorld world;
        make_free(&world, single ? PRECISION_SINGLE : PRECISION_DOUBLE, false, k > 1, NULL);
        Vec3 linear[2], angular[2];
        voxel_world_momentum(&world, &linear[0], &angular[0]);
        const double before = energy_of(&world);
        voxel_world_run(&world, TRIALS(100, 300) * 1e-3);
        voxel_world_read(&world);
        voxel_world_momentum(&world, &linear[1], &angular[1]);
        const double scale = vec3_length(angular[0]),
                     p = vec3_length(vec3_sub(linear[1], linear[0])) * 0.1 / scale,
                     l = vec3_length(vec3_sub(angular[1], angular[0])) / scale;
        print_message("%s%s: momentum off by %.2g, angular by %.2g, %.3f of the energy left\n",
                      single ? "single" : "double", k > 1 ? ", relaxing" : "", p, l,
                      energy_of(&world) / before);
        expect_at_most(p, single ? 1e-5 : 1e-11);
        expect_at_most(l, single ? 1e-4 : 1e-10);
        assert_true(energy_of(&world) < before);
    }
}

typedef enum Start { BLOB, FLAT, MIRRORED, NOISE, STRETCHED, STARTS } Start;

static Vec3 start_of(Start start, Vec3 x, uint64_t *random)
{
    switch (start) {
    case BLOB:
        return vec3_scale(0.05, random_vec3(random));
    case FLAT:
        return vec3(x.x, x.y, 0.0);
    case MIRRORED:
        return vec3(x.x, x.y, -x.z);
    case STRETCHED:
        return vec3(0.7 * x.x, 0.8 * x.y, 3.0 * x.z);
    default:
        return vec3_madd(x, 0.02, random_vec3(random));
    }
}

typedef struct Trial {
    Start start;
    Stiffening law;
    double nu, time_step; // 0: the longest
    int ticks;
} Trial;

// Returns the largest growth of the energy in a tick, over the first; `left`: of it at the end.
static double growth_of(const Trial *trial, double *left)
{
    uint64_t random = 81;
    VoxelWorldOptions options = voxel_world_cube(8);
    options.material.poisson_ratio = trial->nu;
    options.body.stiffening = trial->law;
    options.body.body.levels = 1;
    options.body.body.integrator = INTEGRATOR_LEAPFROG;
    options.body.body.time_step = trial->time_step;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    voxel_world_read(&world);
    for (int i = 0; i < world.count; i++) {
        world.x[i] = start_of(trial->start, world.x[i], &random);
        world.v[i] = vec3_cross(vec3(0.3, -0.5, 1.0), world.x[i]);
    }
    voxel_world_write(&world, world.x, world.v);
    const double first = energy_of(&world);
    double before = first, growth = 0.0;
    for (int tick = 0; tick < trial->ticks; tick++) {
        sim_step(world.sim);
        const double now = energy_of(&world);
        growth = fmax(growth, (now - before) / first);
        before = now;
    }
    *left = before / first;
    return growth;
}

// From any start, with the default damping. With steps a fiftieth of the critical one at rest
// energy falls in every tick. With the longest ones, at which leapfrog's swings within a step (by
// 6e-3 of the first, of the linear law too), it is gone in 0.4 s.
TEST(energy_falls_from_any_start)
{
    static const Stiffening LAWS[] = {{0.15, 10.0}, {0.3, 50.0}, {0.05, 100.0}};
    for (int k = 0; k < TRIALS(STARTS, 3 * STARTS); k++) {
        Trial trial = {.start = (Start)(k % STARTS),
                       .law = LAWS[k / STARTS],
                       .nu = k % 2 == 0 ? 0.0 : 0.3,
                       .ticks = 400};
        double left, unused;
        const double swing = growth_of(&trial, &left);
        trial.time_step = 2e-5;
        trial.ticks = 40;
        const double growth = growth_of(&trial, &unused);
        print_message(
            "start %d, s %.2f, cap %3.0f, nu %.1f: longest steps +%.2g, %.2g left; short +%.2g\n",
            trial.start, trial.law.strain, trial.law.cap, trial.nu, swing, left, growth);
        expect_at_most(swing, 0.01);
        expect_at_most(left, 0.01);
        expect_at_most(growth, 1e-9);
    }
}

// ---------------------------------------------------------------------------------------------
// States, threads, cuts, tears

TEST(threads_give_the_same_bits)
{
    for (int k = 0; k < 4; k++) {
        uint64_t hash[2];
        for (int threads = 1; threads <= 2; threads++) {
            Team *team = threads > 1 ? team_create(threads) : NULL;
            Status status = {0};
            assert_true(team == NULL || team_start(team, threads, NULL, &status));
            SCOPED(voxel_world_destroy) VoxelWorld world;
            make_free(&world, (Precision)(k % 2), false, k > 1, team);
            voxel_world_run(&world, 0.02);
            hash[threads - 1] = state_hash(&world.state);
            team_destroy(team);
        }
        assert_int_equal(hash[1], hash[0]);
    }
}

// A body is cut in the middle of its motion; from a state before that, all of it repeats. A cut
// gives no energy.
TEST(states_repeat_through_a_cut)
{
    SCOPED(voxel_world_destroy) VoxelWorld world;
    make_free(&world, PRECISION_DOUBLE, true, true, NULL);
    voxel_world_run(&world, 0.02);
    FREED void *middle = malloc(state_bytes(&world.state));
    state_copy_out(&world.state, middle);
    uint64_t hash[2];
    for (int pass = 0; pass < 2; pass++) {
        voxel_world_run(&world, 0.005);
        const double before = energy_of(&world);
        cut_through(&world, 0.003);
        sim_step(world.sim);
        // A tick of damping, and what the energy swings within a step.
        expect_at_most(energy_of(&world), 1.001 * before);
        voxel_world_run(&world, 0.05);
        hash[pass] = state_hash(&world.state);
        state_copy_in(&world.state, middle);
        sim_restored(world.sim);
    }
    assert_int_equal(hash[1], hash[0]);
}

// Pulls a bar apart until it tears; returns the strain then.
static double tears_at(Stiffening law, double stress)
{
    static const FixedRegion ends[] = {
        {.kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {-0.0999, 1.0, 1.0}},
        {.kind = FIXED_BOX, .low = {0.0999, -1.0, -1.0}, .high = {1.0, 1.0, 1.0}}};
    VoxelWorldOptions options = voxel_world_cube(4);
    Status status = {0};
    lattice_destroy(&options.lattice);
    assert_true(lattice_box(&options.lattice, (int[3]){8, 4, 4}, 0.025, &status));
    options.material = (SolidMaterial){1e4, 0.0, 1000.0};
    options.body.body.fixed = ends;
    options.body.body.fixed_count = 2;
    options.body.body.cuttable = true;
    options.body.body.levels = 0;
    options.body.tear_stress = stress;
    options.body.split_budget = 4;
    options.body.stiffening = law;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    voxel_world_read(&world);
    FREED Vec3 *rest = malloc((size_t)world.count * sizeof *rest);
    memcpy(rest, world.x, (size_t)world.count * sizeof *rest);
    const VoxelModel *model = world.body->model;
    const int count = world.count;
    double strain = 0.0;
    for (; strain < 1.0; strain += 0.005) {
        for (int i = 0; i < count; i++) {
            world.x[i] = vec3((1.0 + strain) * rest[i].x, rest[i].y, rest[i].z);
            world.v[i] = vec3(0.0, 0.0, 0.0);
        }
        voxel_world_write(&world, world.x, world.v);
        sim_step(world.sim);
        if (model->vertices.count != count)
            break;
    }
    return strain;
}

// In the middle of a body a crack begins at 1.5 times the strength, at a front, where the outer
// faces are, at the strength itself. Steps of the strain are 0.005.
TEST(a_stiffening_bar_tears_at_its_stress)
{
    const Stiffening law = {0.2, 100.0};
    const double linear = tears_at((Stiffening){0.0, 1.0}, 4000.0), stiff = tears_at(law, 4000.0);
    print_message("tears at strains of %.3f, stiffening at %.3f\n", linear, stiff);
    expect_near(linear, 0.4, 0.011);
    double strain = 0.0; // E e exp((e/s)^2) = 4000 Pa
    while (1e4 * strain * exp(strain * strain / 0.04) < 4000.0)
        strain += 1e-4;
    expect_near(stiff, strain, 0.011);
}
