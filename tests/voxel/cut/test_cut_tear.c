// SPDX-License-Identifier: MIT
// Tearing of voxel bodies: which faces, by known stresses; a notched bar pulled apart; forces from
// outside beyond the threshold.
#include "test.h"
#include "sim_steps.h"
#include "cut_world.h"
#include "effort.h"

// Cells of the bar; depth of its notch.
enum { WIDE = EFFORT(16) == 16 ? 16 : 8, LONG = 3 * WIDE, DEEP = WIDE / 4 };
static const double CELL = 3.125e-3, E = 1e4;

// A bar along x, its left end held; with a notch from above, across its middle.
static void bar(VoxelWorldOptions *options, const int count[3], bool notched, FixedRegion end[2])
{
    *options = voxel_world_cube(8);
    lattice_destroy(&options->lattice);
    assert_true(lattice_box(&options->lattice, count, CELL, &(Status){0}));
    Lattice *lattice = &options->lattice;
    for (int k = 0; notched && k < DEEP; k++)
        for (int j = 0; j < count[1]; j++)
            for (int i = count[0] / 2 - 1; i <= count[0] / 2; i++)
                lattice->label[lattice_index(lattice, i, j, count[2] - 1 - k)] = 0;
    for (int side = 0; side < 2; side++) {
        const double x = (side == 0 ? -0.5 : 0.5) * count[0] * CELL;
        end[side] = (FixedRegion){.kind = FIXED_BOX,
                                  .low = {x - 0.1 * CELL, -1.0, -1.0},
                                  .high = {x + 0.1 * CELL, 1.0, 1.0}};
    }
    options->body.body.fixed = end;
    options->body.body.fixed_count = 2;
    options->material = (SolidMaterial){.youngs_modulus = E, .density = 1000.0};
}

static int broken_faces(const CutLattice *lattice, int axis)
{
    int count = 0;
    for (int c = 0; c < lattice->level_first[1]; c++)
        count += lattice->broken[c] >> axis & 1;
    return count;
}

static void *present(CutWorld *world)
{
    Vertices *vertices = &world->model->vertices;
    return vertices->row[vertices->current];
}

// --- which faces ---

// x -> turn (stretch along x) of every vertex.
static void deform(CutWorld *world, double stretch, Quat turn)
{
    const Rows *rows = &world->model->vertices.rows;
    for (int v = 0; v < world->model->vertices.count; v++) {
        Vec3 x = rows_rest(rows, v);
        x.x *= stretch;
        rows_write(rows, present(world), v, quat_rotate(turn, x), vec3(0.0, 0.0, 0.0));
    }
}

static bool find(CutWorld *world)
{
    const VoxelModel *model = world->model;
    const VoxelPass pass = {
        .law = model->law, .rows = present(world), .stiffness_scale = 1.0, .damping_scale = 1.0};
    return cut_tear_find(&world->cuts->tear, &pass);
}

// Uniform tension: T is E times the strain on faces across the pull, none on others, whatever the
// body's turn, law and sizes of elements.
TEST(pulled_faces_tear_at_the_border_first_and_everywhere_beyond_half_more)
{
    for (int variant = 0; variant < 8; variant++) {
        VoxelWorldOptions options;
        FixedRegion end[2];
        const int count[3] = {16, 8, 8};
        bar(&options, count, false, end);
        options.body.body.levels = variant % 2;
        options.body.law = variant & 2 ? VOXEL_MIYAZAKI2004 : VOXEL_AFFINE;
        options.body.body.precision = variant & 4 ? PRECISION_SINGLE : PRECISION_DOUBLE;
        options.body.body.fixed_count = 0;
        options.body.tear_stress = 0.1 * E;
        options.body.body.node_capacity = 8 * 17 * 9 * 9;
        options.body.body.face_capacity = 12 * 16 * 8 * 8;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        assert_non_null(world.body->ops->tear);
        const CutLattice *lattice = &world.cuts->lattice;
        const CutTear *tear = &world.cuts->tear;
        const Quat turn = quat_from_rotation(vec3(0.3, -1.1, 0.7));
        // A thousandth below: single precision rounds places of 25 mm to 2e-9 m, 1e-6 of a cell.
        deform(&world, 1.0999, turn);
        assert_false(find(&world));
        deform(&world, 0.8, turn); // pushed, not pulled
        assert_false(find(&world));
        deform(&world, 1.1001, turn);
        assert_true(find(&world));
        assert_int_equal(tear->hit_count, TEAR_FACES); // as many as fit a tick
        for (int k = 0; k < tear->hit_count; k++) {
            const short *at = lattice->element[tear->hit[k][0]].cell;
            assert_int_equal(tear->hit[k][1], 0);
            assert_true(at[1] == 0 || at[1] == 7 || at[2] == 0 || at[2] == 7);
        }
        // Half as much again, and all faces across tear, once the elements are divided.
        int inside = 0;
        for (int round = 0; round < 60; round++) {
            CutOutcome outcome;
            TopologyChange change = {.again = false};
            deform(&world, 1.1501, turn);
            world.body->ops->tear(world.body, 1e-3, &outcome, &change);
            world.body->ops->reconstruct(world.body, &change);
        }
        for (int c = 0; c < lattice->level_first[1]; c++) {
            const short *at = lattice->element[c].cell;
            inside += (lattice->broken[c] & 1) && at[1] == 4 && at[2] == 4;
        }
        assert_int_equal(inside, count[0] - 1);
        assert_int_equal(broken_faces(lattice, 1) + broken_faces(lattice, 2), 0);
        assert_int_equal(broken_faces(lattice, 0), (count[0] - 1) * count[1] * count[2]);
    }
}

// In a body that adapts all elements beyond half of the strength are told; those that may tear,
// which are among the last ones here, do not wait until the others were looked at.
TEST(faces_that_tear_do_not_wait_for_elements_that_are_tense)
{
    VoxelWorldOptions options;
    FixedRegion end[2];
    const int count[3] = {24, 16, 16};
    bar(&options, count, false, end);
    options.body.body.fixed_count = 0;
    options.body.body.levels = options.body.surface_level = 1;
    options.body.tear_stress = 0.1 * E;
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options);
    const CutTear *tear = &world.cuts->tear;
    // Six tenths of the strength, and twice the strength in a corner.
    deform(&world, 1.06, QUAT_NONE);
    const Rows *rows = &world.model->vertices.rows;
    for (int v = 0; v < world.model->vertices.count; v++) {
        Vec3 x = rows_rest(rows, v);
        if (x.x < 8.9 * CELL || x.y < 5.9 * CELL || x.z < 5.9 * CELL)
            continue;
        x.x *= 1.2;
        rows_write(rows, present(&world), v, x, vec3(0.0, 0.0, 0.0));
    }
    assert_true(find(&world));
    assert_int_equal(tear->stressed_count, world.cuts->lattice.leaf_count);
    assert_true(tear->stressed_count > TEAR_LOOKS + TEAR_LOOKS / 4);
    // The next tick finds them again.
    assert_true(find(&world));
}

TEST(every_level_of_the_kernels_finds_the_same_faces)
{
    for (int precision = 0; precision < 2; precision++) {
        int(*first)[2] = NULL, first_count = 0;
        for (const char *const *isa = isa_available(); *isa != NULL; isa++) {
            VoxelWorldOptions options = voxel_world_cube(16);
            options.body.body.isa = *isa;
            options.body.body.precision = (Precision)precision;
            options.body.tear_stress = 0.05 * E;
            SCOPED(cut_world_destroy) CutWorld world;
            uint64_t seed = 5;
            cut_world_create(&world, &options);
            cut_world_shake(&world, 0.5, &seed);
            assert_true(find(&world));
            const CutTear *tear = &world.cuts->tear;
            const size_t bytes = (size_t)tear->hit_count * sizeof *tear->hit;
            if (first == NULL) {
                first_count = tear->hit_count;
                first = zeroed(1, bytes);
                memcpy(first, tear->hit, bytes);
            }
            assert_int_equal(tear->hit_count, first_count);
            assert_memory_equal(tear->hit, first, bytes);
        }
        free(first);
    }
}

// --- the bar ---

// Moves the right end away at so many m/s: its vertices are held, the test holds them.
static void pull(CutWorld *world, double speed, double time)
{
    const Vertices *vertices = &world->model->vertices;
    for (int v = 0; v < vertices->count; v++) {
        Vec3 x = rows_rest(&vertices->rows, v);
        if (vertices->id[v] < 0 || !world->body->ops->is_fixed(world->model, v) || x.x < 0.0)
            continue;
        x.x += speed * time;
        rows_write(&vertices->rows, present(world), v, x, vec3(speed, 0.0, 0.0));
    }
}

static void run_pulled(CutWorld *world, double speed, double seconds)
{
    const long ticks = lround(seconds / sim_tick(world->sim));
    for (long tick = 0; tick < ticks; tick++) {
        pull(world, speed, (double)tick * sim_tick(world->sim));
        sim_step(world->sim);
    }
    assert_int_equal(sim_resets(world->sim), 0);
}

static void create_bar(CutWorld *world, int levels, int surface, double stress, bool notched)
{
    VoxelWorldOptions options;
    FixedRegion end[2];
    bar(&options, (int[3]){LONG, WIDE, WIDE}, notched, end);
    options.body.body.levels = levels;
    options.body.surface_level = surface;
    options.body.body.precision = PRECISION_SINGLE;
    options.body.tear_stress = stress;
    cut_world_create(world, &options);
}

TEST(notched_bar_comes_apart_at_the_notch_in_two_clean_pieces)
{
    // One that adapts is divided where it is under stress.
    for (int k = 0; k < 3; k++) {
        const int levels = k == 0 ? 0 : 2;
        SCOPED(cut_world_destroy) CutWorld world;
        create_bar(&world, levels, k == 2 ? 2 : 0, 0.3 * E, true);
        const CutLattice *lattice = &world.cuts->lattice;
        const CutPieces *pieces = &world.cuts->pieces;
        run_pulled(&world, 0.05, 1.5 * WIDE / 16.0);
        int broken = 0, farthest = 0;
        for (int c = 0; c < lattice->level_first[1]; c++)
            for (int axis = 0; axis < 3; axis++)
                if (lattice->broken[c] >> axis & 1) {
                    // how far from the middle plane
                    const int off = abs(lattice->element[c].cell[0] - (LONG / 2 - 1));
                    farthest = off > farthest ? off : farthest;
                    broken++;
                }
        print_message("level %d%s: %d faces broken (%d %d %d), %d pieces, %d small, up to %d cells "
                      "from the middle\n",
                      levels, k == 2 ? ", adapts" : "", broken, broken_faces(lattice, 0),
                      broken_faces(lattice, 1), broken_faces(lattice, 2), (int)*pieces->count,
                      pieces->small_count, farthest);
        assert_int_equal(*pieces->count, 2);
        assert_int_equal(pieces->small_count, 0);
        // A plane section has 192; the front rule leaves some beside it.
        const int ideal = WIDE * (WIDE - DEEP);
        assert_in_range(broken, ideal, 3 * ideal / 2);
        assert_true(farthest <= 4);
        int left = 0;
        for (int c = 0; c < lattice->level_first[1]; c++)
            left += cut_pieces_of(pieces, c) == cut_pieces_of(pieces, 0);
        expect_near(left, 0.5 * lattice->level_first[1], WIDE * WIDE);
        cut_world_check_masses(&world);
    }
}

TEST(nothing_tears_below_the_threshold)
{
    CutWorld world;
    create_bar(&world, 2, 0, 0.3 * E, false);
    run_pulled(&world, 0.05,
               0.5 * WIDE / 16.0); // strain 0.17 at the end, and what the start's shock adds
    for (int axis = 0; axis < 3; axis++)
        assert_int_equal(broken_faces(&world.cuts->lattice, axis), 0);
    cut_world_destroy(&world);
    VoxelWorldOptions options = voxel_world_cube(8);
    cut_world_create(&world, &options);
    assert_null(world.body->ops->tear);
    cut_world_destroy(&world);
}

// --- forces from outside ---

// The vertex at a lattice point.
static int vertex_at(const CutLattice *lattice, int x, int y, int z)
{
    for (int v = 0; v < cut_lattice_used(lattice); v++) {
        int point[3];
        cut_lattice_point(lattice, v, point);
        if (point[0] == x && point[1] == y && point[2] == z)
            return v;
    }
    fail();
    return -1;
}

TEST(force_beyond_the_threshold_releases_the_vertex)
{
    for (int variant = 0; variant < 4; variant++) {
        VoxelWorldOptions options = voxel_world_cube(8);
        options.body.tear_force = 0.1;
        options.body.body.precision = (Precision)(variant % 2);
        options.body.law = variant / 2 ? VOXEL_MIYAZAKI2004 : VOXEL_AFFINE;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        const CutLattice *lattice = &world.cuts->lattice;
        const BodyOps *ops = world.body->ops;
        assert_non_null(ops->tear);
        // In the middle of a face: four cells share the vertex, by four faces.
        const int vertex = vertex_at(lattice, 4, 4, 8), before = cut_lattice_used(lattice);
        ops->add_load(world.model, vertex, vec3(0.0, 0.06, 0.079)); // 0.0992 N
        sim_ticks(world.sim, 5);
        assert_int_equal(cut_lattice_used(lattice), before);
        ops->add_load(world.model, vertex, vec3(0.0, 0.0, 0.003)); // 0.1016 N
        sim_step(world.sim);
        assert_int_equal(cut_lattice_used(lattice), before); // felt in this tick
        sim_step(world.sim);
        assert_int_equal(cut_lattice_used(lattice), before + 3);
        assert_int_equal(broken_faces(lattice, 0), 2);
        assert_int_equal(broken_faces(lattice, 1), 2);
        assert_int_equal(broken_faces(lattice, 2), 0);
        assert_int_equal(*world.cuts->pieces.count, 1);
        // The load still pulls at one of the four, which shares its vertex with no other now.
        sim_ticks(world.sim, 20);
        assert_int_equal(cut_lattice_used(lattice), before + 3);
        assert_true(ops->check(world.model));
    }
}

static void run_on(CutWorld *world, int from, int to)
{
    for (int tick = from; tick < to; tick++) {
        pull(world, 0.05, tick * sim_tick(world->sim));
        sim_step(world->sim);
    }
}

// What was felt is state, what is under stress follows from it.
TEST(torn_run_goes_on_alike_from_its_states)
{
    SCOPED(cut_world_destroy) CutWorld world;
    VoxelWorldOptions options;
    FixedRegion end[2];
    bar(&options, (int[3]){24, 8, 8}, true, end);
    options.body.body.levels = 1;
    options.body.tear_stress = 0.3 * E;
    options.body.tear_force = 0.01;
    cut_world_create(&world, &options);
    const CutLattice *lattice = &world.cuts->lattice;
    world.body->ops->add_load(world.model, vertex_at(lattice, 18, 4, 8), vec3(0.0, 0.0, 0.02));
    // Between feeling and releasing; in the midst of tearing; the end.
    enum { TIMES = 2, END = 700 };
    int time[TIMES] = {1, 0};
    void *saved[TIMES];
    run_on(&world, 0, 1);
    for (int k = 0; k < TIMES; k++) {
        saved[k] = zeroed(1, state_bytes(&world.state));
    }
    state_copy_out(&world.state, saved[0]);
    int now = 1;
    while (broken_faces(lattice, 0) < 10 && now < END)
        run_on(&world, now, now + 1), now++;
    time[1] = now;
    state_copy_out(&world.state, saved[1]);
    run_on(&world, now, END);
    const uint64_t hash = state_hash(&world.state);
    const int pieces = (int)*world.cuts->pieces.count;
    print_message("torn from tick %d on, %d faces, %d pieces\n", now, broken_faces(lattice, 0),
                  pieces);
    assert_true(pieces > 1);
    for (int k = 0; k < TIMES; k++) {
        resume(&world.state, world.sim, saved[k]);
        assert_true(world.body->ops->check(world.model));
        run_on(&world, time[k], END);
        assert_int_equal(state_hash(&world.state), hash);
        free(saved[k]);
    }
}
