// SPDX-License-Identifier: MIT
// Heat of diathermy in solids: against closed forms, and its account.
#include "test.h"
#include "cut_world.h"
#include "effort.h"

#define DIFFUSIVITY (HEAT_CONDUCTIVITY / (HEAT_CAPACITY * 1000.0)) // [m2/s] of water's density

static VoxelWorldOptions heated_block(int n, double size)
{
    VoxelWorldOptions options = voxel_world_block(n, n, n, size);
    options.body.body.levels = 0;
    options.body.heats = true;
    options.body.coagulated_stiffness = HEAT_STIFFER;
    return options;
}

static int cell_at(const CutWorld *world, int i, int j, int k)
{
    return cut_lattice_cell(&world->cuts->lattice, i, j, k);
}

// A ball of an electrode at a point of the body at rest, whose middle is the origin.
static Removal electrode(Vec3 at, double radius, double joules)
{
    return (Removal){.kind = REMOVER_DIATHERMY,
                     .mouth = {.kind = REGION_CAPSULE, .from = at, .to = at, .radius = radius},
                     .heat = joules};
}

static double give(CutWorld *world, Removal removal)
{
    const Vertices *vertices = &world->model->vertices;
    return cut_heat_give(world->cuts->heat, &vertices->rows, vertices_row(vertices), &removal);
}

// Given = stored + carried off by blood + gone with what was removed.
static void expect_balanced(const CutHeat *heat)
{
    const double given = heat_sum(&heat->books->given), stored = cut_heat_stored(heat);
    const double perfused = heat_sum(&heat->books->perfused);
    const double removed = heat_sum(&heat->books->removed);
    // A rounding of each cell's energy a visit, at random, over 1e5 visits and less.
    expect_near(stored + perfused + removed, given, 1e-12 * given);
}

// ---------------------------------------------------------------------------------------------
// Spreading

// The largest relative difference to Q / (4 pi k r) erfc(r / sqrt(4 a t)), at 4 to 8 mm.
static double point_source_error(int n, double size)
{
    SCOPED(cut_world_destroy) CutWorld world;
    VoxelWorldOptions options = heated_block(n, size);
    cut_world_create(&world, &options);
    CutHeat *heat = world.cuts->heat;
    heat->perfusion = 0.0;
    const double power = 0.1, tick = 0.005, end = 100.0;
    const int m = n / 2, source = cell_at(&world, m, m, m);
    for (double t = 0.0; t < end - 0.5 * tick; t += tick) {
        heat->energy[source] += power * tick;
        heat->warm[source / 64] |= UINT64_C(1) << source % 64;
        heat->warm_count += heat->warm_count == 0;
        cut_heat_spread(heat, tick);
    }
    double worst = 0.0;
    for (int k = 0; k < n; k++)
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++) {
                const double r =
                    size * sqrt((i - m) * (i - m) + (j - m) * (j - m) + (k - m) * (k - m));
                if (r < 0.004 || r > 0.008)
                    continue;
                const double exact = power / (4.0 * M_PI * HEAT_CONDUCTIVITY * r) *
                                     erfc(r / sqrt(4.0 * DIFFUSIVITY * end));
                const double is = cut_heat_temperature(heat, cell_at(&world, i, j, k)) - HEAT_BODY;
                worst = fmax(worst, fabs(is - exact) / exact);
            }
    return worst;
}

TEST(point_source_in_an_infinite_medium)
{
    const double coarse = point_source_error(17, 0.002), fine = point_source_error(33, 0.001);
    print_message("point source: %.4f off with cells of 2 mm, %.4f with 1 mm\n", coarse, fine);
    // The lattice's own error, of second order.
    expect_at_most(fine, 0.05);
    expect_at_most(fine, 0.4 * coarse);
}

TEST(blood_cools_exponentially)
{
    SCOPED(cut_world_destroy) CutWorld world;
    VoxelWorldOptions options = heated_block(6, 0.001);
    cut_world_create(&world, &options);
    CutHeat *heat = world.cuts->heat;
    const double start = 4.0; // [K] above the body: harmless
    for (int cell = 0; cell < heat->cell_count; cell++)
        heat->energy[cell] = start * heat->capacity[0];
    assert_true(cut_heat_derive(heat));
    for (int t = 0; t < 100000; t++)
        cut_heat_spread(heat, 1e-3);
    // The implicit step is off by 1e-5 in 1e5 of them; what cells pass on while they are cooled one
    // after the other, by a ten-thousandth of their difference a tick, by 4e-5.
    const double exact = start * exp(-HEAT_PERFUSION * 100.0);
    for (int cell = 0; cell < heat->cell_count; cell++)
        expect_near(cut_heat_temperature(heat, cell) - HEAT_BODY, exact, 1e-4 * exact);
}

// However long the step, however small or large the cells.
TEST(no_cell_leaves_the_range_of_temperatures)
{
    uint64_t seed = 71;
    for (int round = 0; round < 12; round++) {
        SCOPED(cut_world_destroy) CutWorld world;
        VoxelWorldOptions options = heated_block(8, round % 2 == 0 ? 1e-4 : 0.02);
        cut_world_create(&world, &options);
        CutHeat *heat = world.cuts->heat;
        heat->perfusion = round % 3 == 0 ? 0.0 : HEAT_PERFUSION;
        for (int cell = 0; cell < heat->cell_count; cell++)
            heat->energy[cell] = random_below(&seed, 3) == 0
                                     ? random_between(&seed, 0.0, 90.0) * heat->capacity[0]
                                     : 0.0;
        assert_true(cut_heat_derive(heat));
        const double tick = pow(10.0, random_between(&seed, -4.0, 6.0));
        double high = HEAT_BOILING;
        for (int t = 0; t < 50; t++) {
            double most = 0.0;
            cut_heat_spread(heat, tick);
            for (int cell = 0; cell < heat->cell_count; cell++) {
                const double is = cut_heat_temperature(heat, cell);
                expect_at_least(is, HEAT_BODY - 1e-9);
                expect_at_most(is, high + 1e-9); // rounding
                most = fmax(most, is);
            }
            high = most;
        }
    }
}

TEST(heat_does_not_cross_a_cut)
{
    SCOPED(cut_world_destroy) CutWorld world;
    VoxelWorldOptions options = heated_block(8, 0.001);
    cut_world_create(&world, &options);
    CutHeat *heat = world.cuts->heat;
    // Half of the block is cut off, along x = 0.
    int face[64][2];
    for (int f = 0; f < 64; f++)
        face[f][0] = cell_at(&world, 3, f % 8, f / 8), face[f][1] = 0;
    cut_lattice_break(&world.cuts->lattice, (const int(*)[2])face, 64);
    const double given = give(&world, electrode(vec3(-0.004, 0.0, 0.0), 0.001, 0.5));
    expect_near(given, 0.5, 1e-12);
    for (int t = 0; t < 5000; t++)
        cut_heat_spread(heat, 0.01);
    for (int cell = 0; cell < heat->cell_count; cell++)
        if (world.cuts->lattice.element[cell].cell[0] >= 4)
            assert_true(heat->energy[cell] == 0.0);
    expect_balanced(heat);
}

// A round over more cells than a tick visits takes several ticks, and comes to the same.
TEST(rounds_make_up_for_their_time)
{
    double hottest[2];
    for (int k = 0; k < 2; k++) {
        SCOPED(cut_world_destroy) CutWorld world;
        VoxelWorldOptions options = heated_block(k == 0 ? 7 : 21, 0.001);
        cut_world_create(&world, &options);
        CutHeat *heat = world.cuts->heat;
        heat->perfusion = 0.0;
        // All of the block is warm; one cell is hotter.
        const int m = world.lattice.count[0] / 2, middle = cell_at(&world, m, m, m);
        for (int cell = 0; cell < heat->cell_count; cell++)
            heat->energy[cell] = 1.0 * heat->capacity[0];
        heat->energy[middle] = 5.0 * heat->capacity[0];
        assert_true(cut_heat_derive(heat));
        for (int t = 0; t < 3000; t++)
            cut_heat_spread(heat, 1e-3);
        hottest[k] = cut_heat_temperature(heat, middle) - HEAT_BODY;
        // 343 cells, and 9261: a tick and 19 ticks a round.
        assert_int_equal(k == 0 ? 1 : 19, (heat->cell_count + HEAT_VISITS - 1) / HEAT_VISITS);
    }
    // The time lags by up to two rounds, 38 ms of 3 s, in which it cools by 4 %.
    expect_near(hottest[0], hottest[1], 0.04 * hottest[1]);
}

// ---------------------------------------------------------------------------------------------
// Coagulation and boiling

TEST(a_second_at_60_degrees_coagulates)
{
    // The time that A exp(-E / R T) asks for, to half a tick and the table's 0.2 %.
    for (double at = 50.0; at < 66.0; at += 2.3) {
        SCOPED(cut_world_destroy) CutWorld world;
        VoxelWorldOptions options = heated_block(4, 0.001);
        cut_world_create(&world, &options);
        CutHeat *heat = world.cuts->heat;
        heat->perfusion = 0.0;
        for (int cell = 0; cell < heat->cell_count; cell++)
            heat->energy[cell] = (at - HEAT_BODY) * heat->capacity[0];
        assert_true(cut_heat_derive(heat));
        const double time = 1.0 / (3.1e98 * exp(-6.28e5 / (8.314 * (273.15 + at))));
        const double tick = time / 1000.0;
        int ticks = 0;
        while (!cut_heat_is_coagulated(heat, 0) && ticks < 2000)
            cut_heat_spread(heat, tick), ticks++;
        expect_near(ticks, 1000.0, 1.0 + 0.004 * 1000.0);
        assert_int_equal(heat->coagulated[0], heat->cell_count);
    }
}

TEST(a_cell_boils_away_with_its_latent_heat)
{
    SCOPED(cut_world_destroy) CutWorld world;
    VoxelWorldOptions options = heated_block(8, 0.001);
    cut_world_create(&world, &options);
    CutHeat *heat = world.cuts->heat;
    // 30 W beside the block, no time to spread: what is given is what was taken and what is there.
    int boiled = 0;
    double given = 0.0;
    for (int t = 0; t < 2500; t++) {
        given += give(&world, electrode(vec3(-0.0045, 0.0002, -0.0001), 0.0015, 0.03));
        boiled += heat->boiled_count;
        if (heat->boiled_count > 0)
            cut_heat_remove(heat, heat->boiled, heat->boiled_count);
    }
    // Water from 37 to 100 C, and 70 % of it boiled: 1.81 J a cell of a milligram.
    const double each = 1e-6 * (3600.0 * 63.0 + 0.7 * 2.26e6);
    expect_near(heat_sum(&heat->books->removed), boiled * each, 1e-9 * boiled * each);
    expect_near(given, heat_sum(&heat->books->given), 1e-12 * given);
    assert_true(boiled > 5 && boiled * each < given);
    expect_balanced(heat);
}

TEST(an_electrode_in_the_air_heats_nothing)
{
    SCOPED(cut_world_destroy) CutWorld world;
    VoxelWorldOptions options = heated_block(8, 0.001);
    cut_world_create(&world, &options);
    // From a gap of a cell on; at half a cell it touches.
    assert_true(give(&world, electrode(vec3(-0.0065, 0.0, 0.0), 0.0015, 1.0)) == 0.0);
    assert_true(give(&world, electrode(vec3((double)NAN, 0.0, 0.0), 0.0015, 1.0)) == 0.0);
    assert_true(cut_heat_stored(world.cuts->heat) == 0.0);
    assert_true(give(&world, electrode(vec3(-0.0055, 0.0, 0.0), 0.0015, 1.0)) > 0.9);
}

// Cells are searched window by window: none that is in reach is left out, in whatever shape.
TEST(an_electrode_finds_all_cells_within_its_reach)
{
    uint64_t seed = 74;
    int found = 0;
    for (int round = 0; round < 40; round++) {
        SCOPED(cut_world_destroy) CutWorld world;
        VoxelWorldOptions options = round % 2 == 0 ? voxel_world_cube(16) : voxel_world_corner();
        options.body.body.levels = round % 4;
        options.body.heats = true;
        options.body.coagulated_stiffness = HEAT_STIFFER;
        cut_world_create(&world, &options);
        cut_world_shake(&world, 0.1 * (round % 5), &seed);
        CutHeat *heat = world.cuts->heat;
        const CutLattice *lattice = &world.cuts->lattice;
        const Vertices *vertices = &world.model->vertices;
        CellCentres centres;
        cut_centres_begin(&centres, lattice, &vertices->rows, vertices_row(vertices));
        const int hit = random_below(&seed, heat->cell_count);
        const double radius = random_between(&seed, 0.3, 1.5) * world.lattice.size;
        const Removal removal = electrode(cut_centre(&centres, hit), radius, 1.0);
        const double reach = fmax(3.0 * radius, radius + 0.5 * sqrt(3.0) * world.lattice.size);
        give(&world, removal);
        int count = 0;
        for (int cell = 0; cell < heat->cell_count; cell++)
            count += vec3_length(vec3_sub(cut_centre(&centres, cell), removal.mouth.from)) <= reach;
        assert_int_equal(heat->near_count, count);
        found += count;
    }
    assert_true(found > 1000);
}

// 0.1 to 1000 W, cells of 0.1 to 20 mm, electrodes of 0.2 to 5 mm, through the block and out of it.
TEST(extremes_stay_finite_and_balanced)
{
    uint64_t seed = 72;
    for (int round = 0; round < EFFORT(20); round++) {
        SCOPED(cut_world_destroy) CutWorld world;
        const double size = pow(10.0, random_between(&seed, -4.0, -1.7));
        VoxelWorldOptions options = heated_block(12, size);
        options.body.body.levels = round % 3;
        cut_world_create(&world, &options);
        CutHeat *heat = world.cuts->heat;
        const double power = pow(10.0, random_between(&seed, -1.0, 3.0));
        const double radius = pow(10.0, random_between(&seed, -3.7, -2.3));
        const double speed = round % 2 == 0 ? 0.1 : 0.0;
        for (int t = 0; t < 300; t++) {
            const Vec3 at = vec3(-8.0 * size + speed * 1e-3 * t, 0.3 * size, 0.1 * size);
            const double given =
                give(&world, electrode(speed > 0.0 ? at : vec3(-6.0 * size, 0.0, 0.0), radius,
                                       power * 1e-3));
            assert_true(given >= 0.0 && given <= power * 1e-3 * (1.0 + 1e-12));
            cut_heat_remove(heat, heat->boiled, heat->boiled_count);
            cut_heat_spread(heat, 1e-3);
        }
        for (int cell = 0; cell < heat->cell_count; cell++) {
            assert_true(isfinite(heat->energy[cell]));
            expect_at_least(heat->energy[cell], 0.0);
        }
        if (heat_sum(&heat->books->given) > 0.0)
            expect_balanced(heat);
    }
}

// A minute of each, held, with as many cells removed a tick as a body allows.
LONG_TEST(a_minute_of_heat_stays_finite_and_balanced)
{
    static const double POWER[] = {0.1, 30.0, 1000.0}, SIZE[] = {1e-4, 2e-3, 0.02};
    for (int k = 0; k < 9; k++) {
        SCOPED(cut_world_destroy) CutWorld world;
        const double size = SIZE[k / 3], power = POWER[k % 3];
        VoxelWorldOptions options = heated_block(16, size);
        cut_world_create(&world, &options);
        CutHeat *heat = world.cuts->heat;
        double hottest = 0.0;
        for (int t = 0; t < 60000; t++) {
            give(&world, electrode(vec3(-8.0 * size, 0.0, 0.0), 1.0 * size, power * 1e-3));
            cut_heat_remove(heat, heat->boiled, heat->boiled_count);
            cut_heat_spread(heat, 1e-3);
        }
        for (int cell = 0; cell < heat->cell_count; cell++) {
            assert_true(isfinite(heat->energy[cell]) && heat->energy[cell] >= 0.0);
            hottest = fmax(hottest, cut_heat_temperature(heat, cell));
        }
        expect_at_most(hottest, HEAT_BOILING);
        expect_balanced(heat);
    }
}

// ---------------------------------------------------------------------------------------------
// Stiffness

static void coagulate_all(CutWorld *world)
{
    CutHeat *heat = world->cuts->heat;
    for (int cell = 0; cell < heat->cell_count; cell++)
        heat->energy[cell] = 45.0 * heat->capacity[0];
    assert_true(cut_heat_derive(heat));
    for (int t = 0; t < 100 && heat->coagulated[0] < heat->cell_count; t++)
        sim_step(world->sim);
    assert_int_equal(heat->coagulated[0], heat->cell_count);
}

// Coagulated tissue is a body of the stiffer material, in its forces and in its step.
TEST(coagulated_tissue_moves_as_stiffer_tissue)
{
    for (int levels = 0; levels < 3; levels++) {
        SCOPED(cut_world_destroy) CutWorld world, other;
        VoxelWorldOptions options = voxel_world_cube(8), stiffer = voxel_world_cube(8);
        options.body.body.levels = stiffer.body.body.levels = levels;
        options.body.damping = stiffer.body.damping = 0.0;
        options.body.heats = true;
        options.body.coagulated_stiffness = HEAT_STIFFER;
        stiffer.material.youngs_modulus *= HEAT_STIFFER;
        cut_world_create(&world, &options);
        cut_world_create(&other, &stiffer);
        coagulate_all(&world);
        expect_near(world.body->lambda, other.body->lambda, 1e-12 * other.body->lambda);
        expect_near(world.body->time_step_limit, other.body->time_step_limit,
                    1e-12 * other.body->time_step_limit);
        // Both from one state.
        uint64_t seed = 73, same = 73;
        cut_world_shake(&world, 0.2, &seed);
        cut_world_shake(&other, 0.2, &same);
        world.body->substeps = other.body->substeps;
        world.body->h = other.body->h;
        for (int t = 0; t < 20; t++)
            sim_step(world.sim), sim_step(other.sim);
        const Vertices *a = &world.model->vertices, *b = &other.model->vertices;
        assert_int_equal(a->count, b->count);
        double difference = 0.0;
        for (int v = 0; v < a->count; v++) {
            Vec3 x, y, w;
            rows_read(&a->rows, vertices_row(a), v, &x, &w);
            rows_read(&b->rows, vertices_row(b), v, &y, &w);
            difference = fmax(difference, vec3_length(vec3_sub(x, y)));
        }
        // Batches are packed in another order: rounding alone.
        expect_at_most(difference, 1e-9 * world.lattice.size);
    }
}

// Nodes are shown as coagulated by the cells around them; the mesh is sent again for that at most
// five times a second.
TEST(coagulated_tissue_is_shown)
{
    SCOPED(cut_world_destroy) CutWorld world;
    VoxelWorldOptions options = voxel_world_cube(8);
    options.body.body.levels = 1;
    options.body.heats = true;
    options.body.coagulated_stiffness = HEAT_STIFFER;
    cut_world_create(&world, &options);
    CutHeat *heat = world.cuts->heat;
    const BodyMesh *mesh = &world.body->mesh;
    FREED unsigned char *share = malloc((size_t)mesh->node_count);
    const int before = mesh->topology;
    // One half is too hot, its cells one after the other.
    for (int cell = 0; cell < heat->cell_count; cell++)
        if (world.cuts->lattice.element[cell].cell[0] < 4)
            heat->energy[cell] = (25.0 + 5e-3 * cell) * heat->capacity[0];
    assert_true(cut_heat_derive(heat));
    for (int t = 0; t < 800; t++)
        sim_step(world.sim);
    assert_int_equal(heat->cooked_count, heat->cell_count / 2);
    assert_true(mesh->topology > before && mesh->topology <= before + 4);
    world.body->ops->snapshot_coagulated(world.model, share);
    for (int i = 0; i < mesh->node_count; i++) {
        int point[3];
        cut_lattice_point(&world.cuts->lattice, world.cuts->faces.slot_vertex[i], point);
        assert_int_equal(share[i], point[0] < 4 ? 255 : point[0] > 4 ? 0 : 128);
    }
}

// What follows from the state is the same as derived again, and a run goes on from it bit by bit.
TEST(heated_state_that_was_brought_back_goes_on_alike)
{
    SCOPED(cut_world_destroy) CutWorld world;
    VoxelWorldOptions options = voxel_world_cube(12);
    options.body.body.levels = 2;
    options.body.heats = true;
    options.body.coagulated_stiffness = HEAT_STIFFER;
    cut_world_create(&world, &options);
    CutHeat *heat = world.cuts->heat;
    const Removal hot = electrode(vec3(-0.05, 0.0, 0.0), 0.008, 100.0);
    for (int t = 0; t < 300; t++) {
        if (t < 60)
            give(&world, hot);
        sim_step(world.sim);
    }
    assert_true(heat->cooked_count > 10 && heat->cooked_count < heat->cell_count / 2);
    const size_t bytes = state_bytes(&world.state);
    const size_t lanes = (size_t)world.cuts->lattice.element_count * sizeof(int);
    FREED char *kept = malloc(bytes);
    FREED int *lane = malloc(lanes);
    memcpy(lane, world.cuts->windows.lane, lanes);
    state_copy_out(&world.state, kept);
    for (int t = 0; t < 50; t++)
        sim_step(world.sim);
    const uint64_t hash = state_hash(&world.state);
    const int substeps = world.body->substeps;
    state_copy_in(&world.state, kept);
    world.body->ops->restored(world.body);
    assert_true(world.cuts->sound);
    assert_memory_equal(lane, world.cuts->windows.lane, lanes);
    for (int t = 0; t < 50; t++)
        sim_step(world.sim);
    assert_true(state_hash(&world.state) == hash);
    assert_int_equal(world.body->substeps, substeps);
    // Impossible numbers are found.
    heat->energy[5] = (double)NAN;
    world.body->ops->restored(world.body);
    assert_false(world.cuts->sound);
}

// ---------------------------------------------------------------------------------------------
// The whole of it: a tool in a body that moves

TEST(a_tool_burns_a_hole_into_a_body_that_moves)
{
    for (int round = test_is_long() ? 0 : 2; round < 4; round++) {
        SCOPED(cut_world_destroy) CutWorld world;
        VoxelWorldOptions options = voxel_world_cube(16);
        options.body.body.levels = round;
        options.body.body.removable = true;
        options.body.body.precision = round % 2 == 0 ? PRECISION_SINGLE : PRECISION_DOUBLE;
        options.body.heats = true;
        options.body.coagulated_stiffness = HEAT_STIFFER;
        // Light tissue: what takes seconds is over in a hundred ticks.
        options.material.density = 20.0;
        options.tool[options.tool_count++] = (ToolOptions){.id = 1,
                                                           .kind = TOOL_REMOVER,
                                                           .removes = REMOVER_DIATHERMY,
                                                           .mouth = {.radius = 0.006},
                                                           .power = 4000.0,
                                                           .max_force = 10.0};
        cut_world_create(&world, &options);
        uint64_t seed = 75;
        cut_world_shake(&world, 0.1, &seed);
        for (int i = 0; i < world.model->vertices.count; i++) { // waves alone, no drift
            Vec3 x, v;
            void *row = world.model->vertices.row[world.model->vertices.current];
            rows_read(&world.model->vertices.rows, row, i, &x, &v);
            rows_write(&world.model->vertices.rows, row, i, x, vec3(0.0, 0.0, 0.0));
        }
        CutHeat *heat = world.cuts->heat;
        const CutLattice *lattice = &world.cuts->lattice;
        for (int t = 0; t < 500; t++) {
            const ToolPose pose = {.position = {-0.052 + 1.5e-4 * t, 0.004, -0.003},
                                   .orientation = {1.0, 0.0, 0.0, 0.0},
                                   .grip = t < 400 ? 1.0 : 0.0,
                                   .active = true};
            sim_apply_pose(world.sim, 0, &pose, true);
            sim_step(world.sim);
        }
        assert_int_equal(sim_resets(world.sim), 0);
        expect_balanced(heat);
        int gone = 0, coagulated = 0;
        for (int cell = 0; cell < heat->cell_count; cell++) {
            gone += cut_lattice_is_gone(lattice, cell);
            coagulated += !cut_lattice_is_gone(lattice, cell) && cut_heat_is_coagulated(heat, cell);
            assert_true(!cut_lattice_is_gone(lattice, cell) || heat->energy[cell] == 0.0);
        }
        // Each cell that went took what it takes to boil, of 1.81 MJ/kg; a rim is coagulated.
        const double each = 20.0 * pow(world.lattice.size, 3.0) * (3600.0 * 63.0 + 0.7 * 2.26e6);
        expect_near(heat_sum(&heat->books->removed), gone * each, 1e-9 * gone * each);
        assert_int_equal(coagulated, heat->coagulated[0]);
        assert_true(gone > 20 && coagulated > gone / 2 && coagulated < 20 * gone);
        // Derived again it is the same.
        const size_t lanes = (size_t)lattice->element_count * sizeof(int);
        FREED int *lane = malloc(lanes);
        memcpy(lane, world.cuts->windows.lane, lanes);
        world.body->ops->restored(world.body);
        assert_true(world.cuts->sound);
        assert_memory_equal(lane, world.cuts->windows.lane, lanes);
        assert_int_equal(coagulated, heat->coagulated[0]);
    }
}
