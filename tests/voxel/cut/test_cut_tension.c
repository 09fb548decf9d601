// SPDX-License-Identifier: MIT
// Tension at rest: it moves no body that is whole, opens cuts as far as closed forms say, and keeps
// momentum and energy.
#include "test.h"
#include "sim_steps.h"
#include "cut_world.h"
#include "effort.h"

static const double E = 1e4, CELL = 5e-3;

// A block of cells under tension; its ends across an axis are fixed (-1: nothing is).
static void block(VoxelWorldOptions *options, const int count[3], double stress, int axis,
                  FixedRegion end[2])
{
    *options = voxel_world_block(count[0], count[1], count[2], CELL);
    options->material = (SolidMaterial){.youngs_modulus = E, .density = 1e3, .prestress = stress};
    for (int side = 0; side < 2 && axis >= 0; side++) {
        const double at = (side == 0 ? -0.49 : 0.49) * count[axis] * CELL;
        double low[3] = {-1.0, -1.0, -1.0}, high[3] = {1.0, 1.0, 1.0};
        *(side == 0 ? &high[axis] : &low[axis]) = at;
        end[side] = (FixedRegion){.kind = FIXED_BOX,
                                  .low = vec3(low[0], low[1], low[2]),
                                  .high = vec3(high[0], high[1], high[2])};
        options->body.body.fixed = end;
        options->body.body.fixed_count = 2;
    }
}

static Vec3 unit_of(int axis)
{
    return vec3(axis == 0, axis == 1, axis == 2);
}

static CutOutcome cut(CutWorld *world, const CutOptions *sweep)
{
    CutOutcome outcome;
    assert_true(cut_world_cut(world, sweep, &outcome));
    while (world->cuts->lattice.wanted_count > 0)
        sim_step(world->sim);
    return outcome;
}

// Across the whole body, by a plane through its middle, but for a thousandth of a cell.
static CutOutcome cut_across(CutWorld *world, int axis)
{
    const CutOptions sweep =
        cut_world_sweep(vec3_scale(1e-3 * CELL, unit_of(axis)), unit_of((axis + 1) % 3),
                        unit_of((axis + 2) % 3), 1.0, -1.0, 1.0);
    return cut(world, &sweep);
}

static bool is_cell(const CutWorld *world, int e)
{
    return e < world->cuts->lattice.level_first[1] && cut_lattice_is_leaf(&world->cuts->lattice, e);
}

// Returns how far the sides of a broken face are apart along a direction, by their middles; 0 where
// it is whole. `middle`: at rest.
static double opening(const CutWorld *world, int cell, int axis, Vec3 along, Vec3 *middle)
{
    const CutLattice *lattice = &world->cuts->lattice;
    const Vertices *vertices = &world->model->vertices;
    if (!is_cell(world, cell) || !cut_lattice_is_open(lattice, cell, axis))
        return 0.0;
    const int beyond = cut_lattice_beyond(lattice, cell, axis);
    Vec3 apart = {0.0, 0.0, 0.0}, x;
    *middle = apart;
    for (int c = 0; c < 4; c++) {
        const int low = (c & 1) << (axis + 1) % 3 | (c >> 1) << (axis + 2) % 3;
        const int here = cut_lattice_nodes(lattice, cell)[low | 1 << axis],
                  there = cut_lattice_nodes(lattice, beyond)[low];
        rows_read(&vertices->rows, vertices_row(vertices), there, &x, NULL);
        apart = vec3_madd(apart, 0.25, x);
        rows_read(&vertices->rows, vertices_row(vertices), here, &x, NULL);
        apart = vec3_madd(apart, -0.25, x);
        *middle = vec3_madd(*middle, 0.25, rows_rest(&vertices->rows, here));
    }
    return vec3_dot(apart, along);
}

// Returns the mean opening of broken faces.
static double mean_opening(const CutWorld *world, Vec3 along)
{
    double sum = 0.0;
    int count = 0;
    Vec3 at;
    for (int c = 0; c < world->cuts->lattice.level_first[1]; c++)
        for (int axis = 0; axis < 3; axis++) {
            count += is_cell(world, c) && cut_lattice_is_open(&world->cuts->lattice, c, axis);
            sum += opening(world, c, axis, along, &at);
        }
    return sum / count;
}

// --- before any cut ---

// Bent, shaken and under its weight, in both precisions: bit-identical. At rest nothing moves.
TEST(a_whole_body_does_not_feel_its_tension)
{
    for (int variant = 0; variant < 4; variant++) {
        uint64_t hash[2];
        for (int k = 0; k < 2; k++) {
            uint64_t seed = 3;
            FixedRegion end[2];
            VoxelWorldOptions options;
            block(&options, (const int[3]){8, 8, 8}, k == 0 ? 0.0 : 0.2 * E, 2, end);
            options.body.body.levels = 2;
            options.body.body.fixed_count = variant & 2 ? 2 : 0;
            options.body.body.precision = variant & 1 ? PRECISION_SINGLE : PRECISION_DOUBLE;
            options.body.body.gravity = vec3(0.0, -9.81, 0.0);
            SCOPED(cut_world_destroy) CutWorld world;
            cut_world_create(&world, &options);
            cut_world_shake(&world, 0.3, &seed);
            sim_ticks(world.sim, 50);
            hash[k] = state_hash(&world.state);
        }
        assert_true(hash[0] == hash[1]);
    }
    FixedRegion end[2];
    VoxelWorldOptions options;
    block(&options, (const int[3]){8, 8, 8}, 0.2 * E, 2, end);
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options);
    sim_ticks(world.sim, 200);
    const BodyMeasure measure = measure_of(world.body);
    expect_at_most(measure.max_displacement, 1e-9 * 8 * CELL);
    expect_at_most(measure.kinetic, 0.0);
}

// --- how far cuts open ---

// A crack of length 2 a in a plate under plane stress opens by 4 sqrt(a^2 - x^2) stress / E
// (Westergaard 1939). The plate is six times as wide, and fixed where that crack would move it,
// which takes 4 % of the opening; the rest is a layer of cells: less with finer ones.
TEST(a_slit_opens_as_a_crack_does)
{
    double off = 1.0;
    for (int n = test_is_long() ? 24 : 48; n <= (test_is_long() ? 96 : 48); n *= 2) {
        FixedRegion end[2];
        VoxelWorldOptions options;
        const double stress = 0.01 * E, a = CELL * n / 12.0;
        block(&options, (const int[3]){n, n, 1}, stress, 1, end);
        options.body.damping = 0.5;
        options.body.drag = 2000.0 / n; // near the critical damping of the slowest swing
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        const CutOptions sweep = cut_world_sweep(vec3(0.0, 1e-6, 0.0), vec3(0.0, 0.0, 1.0),
                                                 vec3(1.0, 0.0, 0.0), 1.0, -a, a);
        assert_int_equal(cut(&world, &sweep).separated, n / 6);
        sim_ticks(world.sim, 10 * n);
        // At its middle, between two faces.
        double opened = 0.0;
        for (int c = 0; c < world.cuts->lattice.level_first[1]; c++) {
            Vec3 at = {1.0, 0.0, 0.0};
            const double here = opening(&world, c, 1, unit_of(1), &at);
            opened += fabs(at.x) < CELL ? 0.5 * here : 0.0;
        }
        const double x = 0.5 * CELL, expected = 4.0 * stress / E * sqrt(a * a - x * x);
        print_message("slit of %d cells: %.4f of the closed form\n", n / 6, opened / expected);
        if (n > 24) // a slit of four cells is hardly a crack
            expect_near(opened, expected, 0.1 * expected);
        expect_at_most(fabs(1.0 - opened / expected), off);
        off = fabs(1.0 - opened / expected);
    }
}

// Between two fixed ends both halves shorten by stress / E, whatever the axis. A segment at 0.9 of
// its length pulls with 0.993 of the tension, one at 0.8 with 0.985 (cut_tension.c).
TEST(a_block_cut_across_gapes_by_its_strain)
{
    for (int axis = 0; axis < 3; axis++)
        for (int levels = 0; levels <= 2; levels += 2) {
            FixedRegion end[2];
            VoxelWorldOptions options;
            int count[3] = {8, 8, 8};
            count[axis] = 16;
            const double stress = axis == 0 ? 0.1 * E : 0.2 * E;
            block(&options, count, stress, axis, end);
            options.body.body.levels = levels;
            options.body.drag = 60.0; // near the critical damping of its slowest swing
            SCOPED(cut_world_destroy) CutWorld world;
            cut_world_create(&world, &options);
            assert_int_equal(cut_across(&world, axis).pieces, 2);
            sim_ticks(world.sim, 600);
            const double strain = stress / E, gap = strain * 16.0 * CELL;
            expect_near(mean_opening(&world, unit_of(axis)), gap, 0.02 * gap);
            assert_int_equal(sim_resets(world.sim), 0);
        }
}

// Fibres at 45 degrees in a turned lattice: a cut across them gapes, one along them does not.
TEST(fibres_open_the_cuts_across_them)
{
    double gap[2];
    for (int k = 0; k < 2; k++) {
        FixedRegion end[2];
        VoxelWorldOptions options;
        block(&options, (const int[3]){12, 12, 4}, 0.1 * E, -1, end);
        options.lattice.turn = quat_from_rotation(vec3(0.4, 0.3, -1.0));
        const Vec3 fibre = quat_rotate(options.lattice.turn, vec3_unit(vec3(1.0, 1.0, 0.0))),
                   across = quat_rotate(options.lattice.turn, vec3_unit(vec3(1.0, -1.0, 0.0))),
                   edge = quat_rotate(options.lattice.turn, vec3(0.0, 0.0, 1.0));
        options.lattice.origin =
            quat_rotate(options.lattice.turn, vec3_scale(CELL, vec3(-6.0, -6.0, -2.0)));
        options.material.prestress_axis = vec3_scale(3.0, fibre);
        options.body.drag = 60.0;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        const Vec3 normal = k == 0 ? fibre : across;
        const CutOptions sweep = cut_world_sweep(vec3_scale(0.1 * CELL, normal), edge,
                                                 k == 0 ? across : fibre, 1.0, -1.0, 1.0);
        assert_int_equal(cut(&world, &sweep).pieces, 2);
        sim_ticks(world.sim, 500);
        gap[k] = mean_opening(&world, normal);
    }
    // Each half, a prism of half a square, shortens by 0.1 about its centre, a third of its height
    // from the cut. Its steps are rounded off by a share of a cell.
    const double expected = 2.0 * 0.1 * 12.0 / sqrt(2.0) / 3.0 * CELL;
    expect_near(gap[0], expected, 0.03 * expected);
    expect_at_most(fabs(gap[1]), 0.02 * gap[0]);
}

// --- forces ---

// Labels of other tension and direction, levels, cuts in three directions, deformed by half a cell.
static void deformed(CutWorld *world, VoxelWorldOptions *options, SolidMaterial material[3],
                     uint64_t *seed)
{
    *options = voxel_world_corner();
    memcpy(material, VOXEL_WORLD_MATERIALS, 3 * sizeof *material);
    material[0].prestress = 0.1 * material[0].youngs_modulus;
    material[1].prestress = 0.05 * material[1].youngs_modulus;
    material[1].prestress_axis = vec3(1.0, 0.3, -0.5);
    options->body.material = material;
    cut_world_create(world, options);
    for (int k = 0; k < 5; k++) {
        const CutOptions sweep = cut_world_random(world, seed);
        CutOutcome outcome;
        cut_world_cut(world, &sweep, &outcome);
        sim_ticks(world->sim, 5);
    }
    cut_world_shake(world, 0.5, seed);
}

// Central differences of the potential, at a millionth of a cell: their error is rounding, 1e-16 of
// the energy over 1e-6 of its length.
TEST(forces_are_the_slope_of_the_potential)
{
    uint64_t seed = 8;
    SolidMaterial material[3];
    VoxelWorldOptions options;
    SCOPED(cut_world_destroy) CutWorld world;
    deformed(&world, &options, material, &seed);
    const Vertices *vertices = &world.model->vertices;
    const CutTension *tension = world.cuts->tension;
    FREED double *force = calloc(4 * (size_t)vertices->capacity + 4, sizeof *force);
    double *row = vertices->row[vertices->current], most = 0.0, sum[3] = {0.0};
    assert_true(tension->count > 300);
    cut_tension_add_forces(tension, row, force, 0.7);
    for (int v = 0; v < vertices->count; v++)
        for (int k = 0; k < 3; k++) {
            most = fmax(most, fabs(force[4 * v + k]));
            sum[k] += force[4 * v + k];
        }
    for (int k = 0; k < 3; k++)
        expect_near(sum[k], 0.0, 1e-13 * most * vertices->count);
    const double step = 1e-6 * world.lattice.size;
    int pulled = 0;
    for (int v = 0; v < vertices->count; v += 3)
        for (int k = 0; k < 3; k++) {
            double *at = &row[v * ROW + k], was = *at, energy[2];
            for (int side = 0; side < 2; side++) {
                *at = was + (side == 0 ? -step : step);
                energy[side] = cut_tension_energy(tension, row, 0.7);
            }
            *at = was;
            expect_near((energy[0] - energy[1]) / (2.0 * step), force[4 * v + k], 1e-6 * most);
            pulled += fabs(force[4 * v + k]) > 0.01 * most;
        }
    assert_true(pulled > 100);
}

// A free body that is cut and cut again: its pieces move against each other, and all of them
// together have the momentum and no more than the energy that they had.
TEST(a_free_body_keeps_momentum_and_gains_no_energy)
{
    uint64_t seed = 9;
    for (int round = 0; round < TRIALS(1, 6); round++) {
        SolidMaterial material[3];
        VoxelWorldOptions options;
        SCOPED(cut_world_destroy) CutWorld world;
        deformed(&world, &options, material, &seed);
        const WorldMomentum before = cut_world_momentum(&world);
        BodyMeasure measure = measure_of(world.body);
        double last = measure.kinetic + measure.elastic + measure.outer;
        for (int k = 0; k < 20; k++) {
            sim_ticks(world.sim, 20);
            measure = measure_of(world.body);
            const double now = measure.kinetic + measure.elastic + measure.outer;
            // An explicit step lets the sum swing by a share of the step over the period.
            expect_at_most(now, last + 1e-2 * measure.elastic);
            last = now;
        }
        const WorldMomentum after = cut_world_momentum(&world);
        expect_near(vec3_length(vec3_sub(after.linear, before.linear)), 0.0,
                    1e-11 * before.linear_sum);
        expect_near(vec3_length(vec3_sub(after.angular, before.angular)), 0.0,
                    1e-10 * before.angular_sum);
        assert_int_equal(sim_resets(world.sim), 0);
    }
}

TEST(a_state_brought_back_goes_on_in_the_same_bits)
{
    uint64_t seed = 10, expected = 0;
    SolidMaterial material[3];
    VoxelWorldOptions options;
    SCOPED(cut_world_destroy) CutWorld world;
    deformed(&world, &options, material, &seed);
    const CutOptions sweep = cut_world_random(&world, &seed);
    FREED void *middle = copy_state(&world.state);
    for (int k = 0; k < 2; k++) {
        CutOutcome outcome;
        cut_world_cut(&world, &sweep, &outcome);
        sim_ticks(world.sim, 20);
        assert_true(k == 0 || state_hash(&world.state) == expected);
        expected = state_hash(&world.state);
        sim_reset(world.sim);
        sim_ticks(world.sim, 3);
        resume(&world.state, world.sim, middle);
    }
}

// --- extremes ---

// A layer of one cell, cut free but for its end, under the largest tension: a string between its
// ends would bend it like a bow.
TEST(a_slender_flap_stays_straight_and_comes_to_rest)
{
    for (int isotropic = 0; isotropic < 2; isotropic++) {
        FixedRegion end[2];
        VoxelWorldOptions options;
        block(&options, (const int[3]){24, 4, 4}, 0.2 * E, 0, end);
        options.body.body.fixed_count = 1;
        options.body.drag = 20.0;
        if (!isotropic)
            options.material.prestress_axis = vec3(1.0, 0.0, 0.0);
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        const double top = CELL * 1.001;
        const CutOptions flap = cut_world_sweep(vec3(0.0, 0.0, top), vec3(0.0, 1.0, 0.0),
                                                vec3(-1.0, 0.0, 0.0), 1.0, -1.0, 10.0 * CELL);
        cut(&world, &flap);
        const CutOptions tip =
            cut_world_sweep(vec3(11.0 * CELL + 1e-6, 0.0, 0.0), vec3(0.0, 1.0, 0.0),
                            vec3(0.0, 0.0, 1.0), 1.0, top, 1.0);
        cut(&world, &tip);
        sim_ticks(world.sim, 2000);
        const Vertices *vertices = &world.model->vertices;
        double up = 0.0;
        for (int v = 0; v < vertices->count; v++) {
            Vec3 x;
            rows_read(&vertices->rows, vertices_row(vertices), v, &x, NULL);
            up = fmax(up, fabs(x.z - rows_rest(&vertices->rows, v).z));
        }
        // The stub below bends a little: the flap pulls at its edge. As a bow, the flap would rise
        // by most of its length.
        expect_at_most(up, 2.0 * CELL);
        // It creeps: its slowest swing is damped far beyond the critical.
        expect_at_most(measure_of(world.body).kinetic, 1e-4 * measure_of(world.body).elastic);
        assert_int_equal(sim_resets(world.sim), 0);
    }
}

// A tension just below the strength: a notch unzips the bar, which comes to rest in pieces.
TEST(a_body_that_tears_under_its_tension_comes_to_rest)
{
    FixedRegion end[2];
    VoxelWorldOptions options;
    block(&options, (const int[3]){16, 6, 6}, 0.1 * E, 0, end);
    options.body.tear_stress = 0.11 * E;
    options.body.drag = 20.0;
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options);
    sim_ticks(world.sim, 100);
    expect_at_most(measure_of(world.body).max_displacement, 0.0);
    const CutOptions notch = cut_world_sweep(vec3(1e-6, 0.0, 0.0), vec3(0.0, 1.0, 0.0),
                                             vec3(0.0, 0.0, 1.0), 1.0, -1.0, -1.0 * CELL);
    cut(&world, &notch);
    sim_ticks(world.sim, 2000);
    assert_true(*world.cuts->pieces.count >= 2);
    const BodyMeasure measure = measure_of(world.body);
    expect_at_most(measure.max_displacement, 4.0 * CELL);
    expect_at_most(measure.kinetic, 1e-6 * measure.elastic);
    assert_int_equal(sim_resets(world.sim), 0);
}

// Stretched until elastic stress and tension together are the strength.
TEST(tension_counts_as_stress_where_a_body_tears)
{
    for (int variant = 0; variant < 8; variant++) {
        VoxelWorldOptions options;
        FixedRegion end[2];
        block(&options, (const int[3]){16, 8, 8}, 0.04 * E, -1, end);
        options.body.body.levels = variant & 1 ? 2 : 0;
        options.body.law = variant & 2 ? VOXEL_MIYAZAKI2004 : VOXEL_AFFINE;
        options.body.tear_stress = 0.1 * E;
        if (variant & 4)
            options.material.prestress_axis = vec3(0.0, 1.0, 0.0);
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        const VoxelModel *model = world.model;
        const Quat turn = quat_from_rotation(vec3(0.3, -1.1, 0.7));
        void *row = model->vertices.row[model->vertices.current];
        // Along y, where fibres run, and along x.
        for (int axis = 0; axis < 2; axis++)
            for (int beyond = 0; beyond < 2; beyond++) {
                const double rest = variant & 4 && axis == 0 ? 0.0 : 0.04;
                for (int v = 0; v < model->vertices.count; v++) {
                    Vec3 x = rows_rest(&model->vertices.rows, v);
                    *(axis == 0 ? &x.x : &x.y) *= 1.1 - rest + (beyond ? 1e-4 : -1e-4);
                    rows_write(&model->vertices.rows, row, v, quat_rotate(turn, x),
                               vec3(0.0, 0.0, 0.0));
                }
                const VoxelPass pass = {
                    .law = model->law, .rows = row, .stiffness_scale = 1.0, .damping_scale = 1.0};
                assert_int_equal(cut_tear_find(&world.cuts->tear, &pass), beyond);
            }
    }
}

// Ten random cuts, whole and partial, of blocks fixed at one end under the largest tension, by both
// integrators, in both precisions: bounded, and at rest again.
TEST(random_cuts_under_tension_come_to_rest)
{
    uint64_t seed = 11;
    for (int round = 0; round < TRIALS(2, 16); round++) {
        FixedRegion end[2];
        VoxelWorldOptions options;
        block(&options, (const int[3]){16, 8, 8}, 0.2 * E, 0, end);
        options.material.poisson_ratio = round & 4 ? 0.45 : 0.0;
        options.body.body.fixed_count = 1;
        options.body.body.levels = 2;
        options.body.body.integrator =
            round & 1 ? INTEGRATOR_LEAPFROG : INTEGRATOR_SYMPLECTIC_EULER;
        options.body.body.precision = round & 2 ? PRECISION_SINGLE : PRECISION_DOUBLE;
        options.body.drag = 20.0;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        for (int k = 0; k < 10; k++) {
            const CutOptions sweep = cut_world_random(&world, &seed);
            CutOutcome outcome;
            cut_world_cut(&world, &sweep, &outcome);
            sim_ticks(world.sim, 40);
        }
        sim_ticks(world.sim, 1000);
        const BodyMeasure measure = measure_of(world.body);
        expect_at_most(measure.max_displacement, 16 * CELL);
        expect_at_most(measure.kinetic, 1e-6 * measure.elastic);
        assert_int_equal(sim_resets(world.sim), 0);
    }
}
