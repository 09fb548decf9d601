// SPDX-License-Identifier: MIT
// Solids with Maxwell branches, and solids that stiffen by Fung's law: forces against the energy,
// closed forms, the decay of swings, what a free body keeps, energy from wild starts, states, cuts,
// threads, tearing.
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "law_trial.h"
#include "random.h"
#include "voxel_world.h"

#include "voxel/model.h"

static const double PI = 3.14159265358979323846;
static const double LENGTH = 0.2, WIDTH = 0.05; // of a bar [m]

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

static void read_vertices(void *world)
{
    voxel_world_read(world);
}

static void write_vertices(void *world, const Vec3 *x, const Vec3 *v)
{
    voxel_world_write(world, x, v);
}

// Evaluates the forces of the elements in the present state, without moving the dashpots: [count].
static void read_forces(void *of, Vec3 *force)
{
    const VoxelWorld *world = of;
    VoxelModel *model = world->body->model;
    Vertices *vertices = &model->vertices;
    Relaxation *relaxation = model->batches->relaxation;
    const size_t bytes = ((size_t)vertices->capacity + 1) * 4 * rows_real_size(&vertices->rows);
    VoxelPass pass = voxel_pass(model, vertices_row(vertices));
    if (relaxation != NULL)
        relaxation_begin(relaxation, 0.0, &pass.relaxation);
    memset(vertices->force, 0, bytes);
    batch_runs_evaluate(model->batches, &pass, BATCHES_ALL);
    if (relaxation != NULL)
        relaxation_abandon(relaxation);
    for (int i = 0; i < world->count; i++)
        force[i] = vec3(rows_get(&vertices->rows, vertices->force, 4L * i),
                        rows_get(&vertices->rows, vertices->force, 4L * i + 1),
                        rows_get(&vertices->rows, vertices->force, 4L * i + 2));
    memset(vertices->force, 0, bytes);
}

static LawBody law_body(const char *name, VoxelWorld *world)
{
    return (LawBody){.name = name,
                     .sim = world->sim,
                     .body = world->body,
                     .length = 0.1,
                     .count = world->count,
                     .mass = world->mass,
                     .x = world->x,
                     .v = world->v,
                     .of = world,
                     .read = read_vertices,
                     .write = write_vertices,
                     .forces = read_forces};
}

// The options of a bar of so many cells along LENGTH and across.
static VoxelWorldOptions bar(int along, int across)
{
    return voxel_world_block(along, across, across, LENGTH / along);
}

static const FixedRegion ENDS[] = {
    {.kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {-0.0999, 1.0, 1.0}},
    {.kind = FIXED_BOX, .low = {0.0999, -1.0, -1.0}, .high = {1.0, 1.0, 1.0}}};

static void hold(VoxelWorldOptions *options, int ends)
{
    options->body.body.fixed = ENDS;
    options->body.body.fixed_count = ends;
}

// On the end of a bar, by where its vertices were read.
static double pull_of(VoxelWorld *world)
{
    FREED Vec3 *force = malloc((size_t)world->count * sizeof *force);
    double pull = 0.0;
    read_forces(world, force);
    for (int i = 0; i < world->count; i++)
        pull += world->x[i].x > 0.0999 ? -force[i].x : 0.0;
    return pull;
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

// With any strains of the dashpots, strained by up to 20 %, turned, with noise, crushed in places:
// far below the knee, about it and beyond it, cubes and elements with hanging vertices, before and
// after a cut that divides some.
TEST(forces_are_the_gradient_of_the_energy)
{
    static const MaxwellBranch BRANCHES[] = {{0.1, 0.3, true}, {0.02, 0.25, false}};
    static const struct {
        const char *name;
        Stiffening law;
        int branches;
    } MATERIALS[] = {{"relaxing", {0.0, 1.0}, 2},
                     {"stiffening at 1.0", {1.0, 10.0}, 0},
                     {"stiffening at 0.1", {0.1, 10.0}, 0},
                     {"stiffening at 0.02, relaxing", {0.02, 100.0}, 1},
                     {"stiffening at 0.3, relaxing", {0.3, 3.0}, 1}};
    static const double NOISE[] = {1e-3, 4e-3}; // of cells of 12.5 mm: crushed ones with the second
    uint64_t random = 5;
    const Quat turn = quat_unit((Quat){0.8, 0.3, -0.4, 0.2});
    for (int k = 0; k < 10; k++) {
        VoxelWorldOptions options = voxel_world_cube(8);
        options.material.poisson_ratio = 0.3;
        options.body.damping = 0.0;
        options.body.body.levels = 1;
        options.body.body.cuttable = k % 2 != 0;
        options.body.split_budget = 100;
        options.body.stiffening = MATERIALS[k / 2].law;
        set_branches(&options.body, MATERIALS[k / 2].branches, BRANCHES);
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        if (k % 2 != 0) {
            cut_through(&world, 0.003);
            voxel_world_run(&world, 0.01);
        }
        read_all(&world);
        Relaxation *relaxation = relaxation_of(&world);
        char name[64];
        snprintf(name, sizeof name, "%s%s", MATERIALS[k / 2].name, k % 2 != 0 ? ", cut" : "");
        const LawBody body = law_body(name, &world);
        FREED Vec3 *x = malloc((size_t)body.count * sizeof *x);
        for (int round = 0; round < 1 + EFFORT(3); round++) { // at least both
            for (int i = 0; i < body.count; i++) {
                const Vec3 p = world.x[i], s = vec3(1.2 * p.x + 0.1 * p.y, 0.9 * p.y, 0.95 * p.z);
                x[i] = vec3_madd(quat_rotate(turn, s), NOISE[round % 2], random_vec3(&random));
            }
            for (int lane = 0; relaxation != NULL && lane < relaxation->layout.groups * LANES;
                 lane++) {
                double strain[RELAXATION_NUMBERS];
                for (int n = 0; n < RELAXATION_NUMBERS; n++)
                    strain[n] = random_between(&random, -0.2, 0.2);
                relaxation_put(relaxation, lane, strain);
            }
            law_expect_gradient(&body, x, &random);
        }
    }
}

// ---------------------------------------------------------------------------------------------
// Closed forms

// A bar, stretched by 10 % at once and held: its stress falls as E (1 + sum e exp(-t / time)), e
// the stiffness of a branch over E. A branch of changes of shape alone has the shear modulus mu e,
// and with nu = 0.3 the bar, whose sides are free, the modulus 9 K G / (3 K + G).
TEST(stress_relaxes_as_the_closed_form)
{
    static const MaxwellBranch BRANCHES[] = {{0.03, 0.2, true}, {0.3, 0.3, true}};
    VoxelWorldOptions options = bar(8, 2);
    options.material = (SolidMaterial){.youngs_modulus = 1e4, .density = 1000.0};
    hold(&options, 2);
    set_branches(&options.body, 2, BRANCHES);
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    voxel_world_read(&world);
    for (int i = 0; i < world.count; i++) {
        world.x[i].x *= 1.1;
        world.v[i] = vec3(0.0, 0.0, 0.0);
    }
    voxel_world_write(&world, world.x, world.v);
    double off = 0.0;
    for (int tick = 0; tick <= 1500; tick++) {
        // Shares of the stiffness to fast strains, of which half is left.
        const double t = tick * sim_tick(world.sim),
                     expected = 1e4 * 0.1 * WIDTH * WIDTH / 0.5 *
                                (0.5 + 0.2 * exp(-t / 0.03) + 0.3 * exp(-t / 0.3));
        off = fmax(off, fabs(pull_of(&world) / expected - 1.0));
        sim_step(world.sim);
    }
    print_message("stress off by %.2g of the closed form\n", off);
    expect_at_most(off, 1e-6); // exact in time, the state is in double
}

// A bar stretched or shortened by e, its sides narrower by nu e as a free bar's are.
TEST(a_bar_follows_the_closed_form)
{
    static const Stiffening LAWS[] = {{0.15, 10.0}, {0.3, 2.0}, {0.1, 100.0}};
    for (int k = 0; k < 6; k++) {
        const Stiffening law = LAWS[k % 3];
        const double nu = k < 3 ? 0.0 : 0.3;
        VoxelWorldOptions options = bar(8, 2);
        options.material =
            (SolidMaterial){.youngs_modulus = 1e4, .poisson_ratio = nu, .density = 1000.0};
        options.body.stiffening = law;
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        FREED Vec3 *x = malloc((size_t)world.count * sizeof *x);
        double off = 0.0;
        for (double e = -0.6; e < 0.8; e += 0.05) {
            for (int i = 0; i < world.count; i++)
                x[i] = vec3((1.0 + e) * world.x[i].x, (1.0 - nu * e) * world.x[i].y,
                            (1.0 - nu * e) * world.x[i].z);
            voxel_world_write(&world, x, world.v);
            const double expected = copysign(1e4 * WIDTH * WIDTH * law_stress(law, fabs(e)), e);
            if (fabs(e) > 1e-9)
                off = fmax(off, fabs(pull_of(&world) / expected - 1.0));
        }
        print_message("s %.2f, cap %3.0f, nu %.1f: off by %.2g of the closed form\n", law.strain,
                      law.cap, nu, off);
        expect_at_most(off, 1e-10); // rounding; 1e-2 is asked
    }
}

// A bar that is held at one end bends, or twists, at 3, 10 and 30 Hz, with moduli that bring it
// there.
TEST(swings_decay_at_the_loss_factor)
{
    static const double MODULI[2][3] = {{2.3e5, 2.6e6, 2.3e7}, {2.3e4, 2.6e5, 2.3e6}};
    for (int loss = 1; loss <= 2; loss++)
        for (int row = 0; row < EFFORT(6); row++) {
            const double modulus = MODULI[row % 2][row / 2];
            VoxelWorldOptions options = bar(24, 6);
            options.material =
                (SolidMaterial){.youngs_modulus = modulus, .poisson_ratio = 0.3, .density = 1000.0};
            hold(&options, 1);
            options.body.body.integrator = INTEGRATOR_LEAPFROG;
            options.body.damping = 0.0;
            options.body.branch_count = MAXWELL_BRANCHES;
            assert_true(maxwell_of_loss(0.1 * loss, options.body.branch));
            SCOPED(voxel_world_destroy) VoxelWorld world;
            voxel_world_create(&world, &options);
            const LawBody body = law_body(row % 2 == 1 ? "twisted" : "bent", &world);
            FREED Vec3 *shape = malloc((size_t)body.count * sizeof *shape);
            for (int i = 0; i < body.count; i++) { // bending of a cantilever, or torsion
                const Vec3 x = world.x[i];
                const double z = (x.x + 0.5 * LENGTH) / LENGTH, k = 1.8751040687, s = 0.7340955138,
                             w = cosh(k * z) - cos(k * z) - s * (sinh(k * z) - sin(k * z));
                shape[i] = row % 2 == 1 ? vec3_scale(sin(0.5 * PI * z), vec3(0.0, -x.z, x.y))
                                        : vec3(0.0, 0.0, 0.5 * WIDTH * w);
            }
            law_expect_loss(&body, shape, 0.05 * sqrt(modulus / 1e5), 0.1 * loss);
        }
}

// ---------------------------------------------------------------------------------------------
// Motion

typedef struct Law {
    const char *name;
    Stiffening stiffening;
    int branches;
    double damping;
    int cells;
} Law;

static const Law RELAXING = {"relaxing", {0.0, 1.0}, 2, 0.0, 8},
                 STIFFENING = {"stiffening", {0.02, 10.0}, 0, 0.2, 16},
                 BOTH = {"stiffening, relaxing", {0.02, 10.0}, 2, 0.2, 16};

static void make_free(VoxelWorld *world, const Law *law, Precision precision, bool cuttable,
                      Team *team)
{
    static const MaxwellBranch BRANCHES[] = {{0.005, 0.2, false}, {0.05, 0.2, true}};
    VoxelWorldOptions options = voxel_world_cube(cuttable ? 8 : law->cells);
    options.material.poisson_ratio = 0.3;
    options.body.body.precision = precision;
    options.body.body.cuttable = cuttable;
    options.body.body.team = team;
    options.body.split_budget = 4;
    options.body.damping = law->damping;
    options.body.stiffening = law->stiffening;
    set_branches(&options.body, law->branches, BRANCHES);
    voxel_world_create(world, &options);
    voxel_world_throw(world);
}

// Some thousand substeps, a few per cent beyond the strain of the law.
TEST(a_free_body_keeps_its_momentum)
{
    const Law *const LAWS[] = {&RELAXING, &STIFFENING, &BOTH};
    for (int k = 0; k < 3 * PRECISION_COUNT; k++) {
        const Law *law = LAWS[k / 2];
        const bool stiffens = law->stiffening.strain > 0.0;
        SCOPED(voxel_world_destroy) VoxelWorld world;
        make_free(&world, law, (Precision)(k % 2), false, NULL);
        const LawBody body = law_body(law->name, &world);
        law_expect_momentum(&body, stiffens ? TRIALS(100, 300) : EFFORT(1000), (Precision)(k % 2),
                            1e-4, stiffens ? 1.0 : 0.9);
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

// The longest steps, or short ones.
static LawFall fall_of(Start start, Stiffening law, double nu, double time_step, int ticks)
{
    uint64_t random = 81;
    VoxelWorldOptions options = voxel_world_cube(8);
    options.material.poisson_ratio = nu;
    options.body.stiffening = law;
    options.body.body.levels = 1;
    options.body.body.integrator = INTEGRATOR_LEAPFROG;
    options.body.body.time_step = time_step;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    for (int i = 0; i < world.count; i++) {
        world.x[i] = start_of(start, world.x[i], &random);
        world.v[i] = vec3_cross(vec3(0.3, -0.5, 1.0), world.x[i]);
    }
    const LawBody body = law_body("stiffening", &world);
    return law_fall(&body, world.x, world.v, ticks);
}

// From any start, with the default damping. With steps a fiftieth of the critical one at rest
// energy falls in every tick. With the longest ones, at which leapfrog's swings within a step (by
// 6e-3 of the first, of the linear law too), it is gone in 0.4 s.
TEST(energy_falls_from_any_start)
{
    static const Stiffening LAWS[] = {{0.15, 10.0}, {0.3, 50.0}, {0.05, 100.0}};
    for (int k = 0; k < TRIALS(STARTS, 3 * STARTS); k++) {
        const Start start = (Start)(k % STARTS);
        const Stiffening law = LAWS[k / STARTS];
        const double nu = k % 2 == 0 ? 0.0 : 0.3;
        const LawFall longest = fall_of(start, law, nu, 0.0, 400),
                      fine = fall_of(start, law, nu, 2e-5, 40);
        print_message(
            "start %d, s %.2f, cap %3.0f, nu %.1f: longest steps +%.2g, %.2g left; short +%.2g\n",
            start, law.strain, law.cap, nu, longest.growth, longest.left, fine.growth);
        expect_at_most(longest.growth, 0.01);
        expect_at_most(longest.left, 0.01);
        expect_at_most(fine.growth, 1e-9);
    }
}

// ---------------------------------------------------------------------------------------------
// States, threads, cuts, tears

TEST(threads_give_the_same_bits)
{
    for (int k = 0; k < 4; k++) {
        uint64_t hash[2];
        for (int threads = 1; threads <= 2; threads++) {
            SCOPED(team_end) Team *team = threads > 1 ? team_create(threads) : NULL;
            assert_true(team == NULL || team_start(team, threads, NULL, &(Status){0}));
            SCOPED(voxel_world_destroy) VoxelWorld world;
            make_free(&world, k > 1 ? &BOTH : &STIFFENING, (Precision)(k % 2), false, team);
            voxel_world_run(&world, 0.02);
            hash[threads - 1] = state_hash(&world.state);
        }
        assert_int_equal(hash[1], hash[0]);
    }
}

// A body is cut in the middle of its motion; from a state before that, all of it repeats. Elements
// that move to other batches, and those that are divided, take their strains along: energy does not
// grow by the cut.
TEST(states_and_cuts_keep_the_dashpots)
{
    for (int k = 0; k < 2; k++) {
        const Law *law = k == 0 ? &RELAXING : &BOTH;
        SCOPED(voxel_world_destroy) VoxelWorld world;
        print_message("%s\n", law->name);
        make_free(&world, law, PRECISION_DOUBLE, true, NULL);
        voxel_world_run(&world, 0.02);
        const LawBody body = law_body(law->name, &world);
        FREED void *middle = copy_state(&world.state);
        uint64_t hash[2];
        for (int pass = 0; pass < 2; pass++) {
            voxel_world_run(&world, 0.005);
            const double before = energy_of(body.body);
            cut_through(&world, 0.003);
            sim_step(world.sim);
            // A tick of damping, and what a swing of leapfrog's energy is.
            expect_at_most(energy_of(body.body), 1.001 * before);
            voxel_world_run(&world, 0.05);
            hash[pass] = state_hash(&world.state);
            // Also from a state after the cut, whose lanes without elements are those of a new run.
            FREED void *late = copy_state(&world.state);
            uint64_t later[2];
            for (int again = 0; again < 2; again++) {
                voxel_world_run(&world, 0.011);
                later[again] = state_hash(&world.state);
                resume(&world.state, world.sim, late);
            }
            assert_true(later[0] == later[1]);
            resume(&world.state, world.sim, middle);
            assert_true(world.body->ops->check(world.body->model));
        }
        assert_true(hash[0] == hash[1]);
        // What no tissue has been is refused.
        ((double *)relaxation_of(&world)->strain[relaxation_of(&world)->current])[7] = (double)NAN;
        assert_false(world.body->ops->check(world.body->model));
    }
}

// Pulls a bar apart until it tears; returns the strain then.
static double tears_at(Stiffening law, double stress)
{
    VoxelWorldOptions options = bar(8, 4);
    options.material = (SolidMaterial){.youngs_modulus = 1e4, .density = 1000.0};
    hold(&options, 2);
    options.body.body.cuttable = true;
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
