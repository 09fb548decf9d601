// SPDX-License-Identifier: MIT
// Cuts of bodies that adapt, through elements larger than a cell: made whole in the tick in which
// they come, and the same as of a body of single cells; or refused whole.
#include "test.h"
#include "cut_world.h"
#include "effort.h"
#include "sim_steps.h"

static VoxelWorldOptions options_of(int kind)
{
    VoxelWorldOptions options = kind % 3 == 0   ? voxel_world_cube(16)
                                : kind % 3 == 1 ? voxel_world_ball()
                                                : voxel_world_corner();
    options.body.split_budget = 1; // what is cut does not wait for it
    return options;
}

static void make_world(CutWorld *world, VoxelWorldOptions options, int levels)
{
    options.body.body.levels = options.body.surface_level = levels;
    cut_world_create(world, &options);
}

// Nothing waits: faces that are broken are open, and whoever looks at the mesh finds the nodes of
// each triangle in one piece.
static void expect_whole(const CutWorld *world)
{
    const CutLattice *lattice = &world->cuts->lattice;
    const BodyMesh *mesh = &world->body->mesh;
    for (int cell = 0; cell < lattice->level_first[1]; cell++)
        for (int axis = 0; axis < 3; axis++)
            assert_true(!(lattice->broken[cell] >> axis & 1) ||
                        cut_lattice_is_open(lattice, cell, axis));
    assert_int_equal(lattice->wanted_count, 0);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 1; k < 3; k++)
            assert_int_equal(mesh->piece[mesh->triangle[t][k]], mesh->piece[mesh->triangle[t][0]]);
}

static int compare_ids(const void *a, const void *b)
{
    const int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

// Both show nodes of the same ids, and as many triangles.
static void expect_same_mesh(const BodyMesh *a, const BodyMesh *b)
{
    const BodyMesh *mesh[2] = {a, b};
    int *id[2], count[2] = {0, 0};
    for (int k = 0; k < 2; k++) {
        id[k] = zeroed((size_t)mesh[k]->node_count + 1, sizeof *id[k]);
        for (int i = 0; i < mesh[k]->node_count; i++)
            if (mesh[k]->id[i] >= 0)
                id[k][count[k]++] = mesh[k]->id[i];
        qsort(id[k], (size_t)count[k], sizeof *id[k], compare_ids);
    }
    assert_int_equal(count[0], count[1]);
    assert_memory_equal(id[0], id[1], (size_t)count[0] * sizeof *id[0]);
    assert_int_equal(a->triangle_count, b->triangle_count);
    free(id[0]);
    free(id[1]);
}

TEST(cuts_through_larger_elements_are_those_through_cells)
{
    uint64_t seed = 41;
    int larger = 0, parted = 0;
    for (int round = 0; round < EFFORT(12); round++) {
        SCOPED(cut_world_destroy) CutWorld fine;
        SCOPED(cut_world_destroy) CutWorld world;
        make_world(&fine, options_of(round), 0);
        make_world(&world, options_of(round), 1 + round / 3 % 3);
        const CutLattice *cells = &fine.cuts->lattice, *lattice = &world.cuts->lattice;
        assert_int_equal(cells->level_first[1], lattice->level_first[1]);
        for (int k = 0; k < 3; k++) {
            const CutOptions cut = cut_world_random(&world, &seed);
            CutOutcome of_cells, outcome;
            larger += lattice->leaf_at_level[0] < cells->leaf_count;
            assert_int_equal(cut_world_cut(&world, &cut, &outcome),
                             cut_world_cut(&fine, &cut, &of_cells));
            assert_int_equal(outcome.verdict, of_cells.verdict);
            assert_int_equal(outcome.separated, of_cells.separated);
            assert_int_equal(outcome.pieces, of_cells.pieces);
            assert_memory_equal(cells->broken, lattice->broken, (size_t)cells->level_first[1]);
            expect_whole(&world);
            expect_same_mesh(&world.body->mesh, &fine.body->mesh);
            cut_world_check_masses(&world);
            parted += outcome.pieces > 1;
        }
    }
    assert_true(larger > EFFORT(12) && parted > 0);
}

// A blade that appears inside of the body, and goes on through it at half a metre a second. Where
// there is room for fewer cells than there are, it looks at those along itself alone.
TEST(what_a_fast_blade_meets_parts_in_the_same_tick)
{
    uint64_t seed = 42;
    for (int round = 0; round < EFFORT(6); round++) {
        SCOPED(cut_world_destroy) CutWorld world;
        VoxelWorldOptions options = options_of(round);
        if (round % 3 == 0)
            options.body.body.node_capacity = 3600; // of 4096 cells, 1738 nodes at rest
        options.tool[options.tool_count++] =
            (ToolOptions){.id = 1,
                          .kind = TOOL_BLADE,
                          .edge = {{-0.1, 0.0, 0.0}, {0.1, 0.0, 0.0}},
                          .max_force = 10.0};
        make_world(&world, options, 2);
        const Vec3 turn = random_vec3(&seed), way = vec3_scale(5e-4, vec3_unit(random_vec3(&seed)));
        for (int tick = 0; tick < 150; tick++) {
            const ToolPose pose = {.position = vec3_scale(tick, way),
                                   .orientation = quat_from_rotation(turn),
                                   .active = true};
            sim_apply_pose(world.sim, 0, &pose, true);
            sim_step(world.sim);
            expect_whole(&world);
        }
        const CutLattice *lattice = &world.cuts->lattice;
        int broken = 0;
        for (int cell = 0; cell < lattice->level_first[1]; cell++)
            broken += __builtin_popcount(lattice->broken[cell]);
        assert_int_equal(sim_resets(world.sim), 0);
        assert_true(broken > 20 || round % 3 == 2); // it may miss the corner
    }
}

TEST(a_cut_that_has_no_room_breaks_nothing)
{
    for (int more = 0; more < 4; more++) {
        SCOPED(cut_world_destroy) CutWorld world;
        VoxelWorldOptions options = options_of(0);
        options.body.body.node_capacity = 1900 + 300 * more; // 1738 at rest
        make_world(&world, options, 2);
        const CutLattice *lattice = &world.cuts->lattice;
        CutOptions cut = cut_world_sweep(vec3(1e-3, 0.0, 0.0), vec3(0.0, 0.6, 0.8),
                                         vec3(0.3, 0.8, -0.6), 0.2, -0.2, 0.2);
        CutOutcome outcome;
        assert_false(cut_world_cut(&world, &cut, &outcome));
        assert_int_equal(outcome.verdict, CUT_NO_NODES);
        assert_true(outcome.needed > outcome.room);
        for (int cell = 0; cell < lattice->level_first[1]; cell++)
            assert_int_equal(lattice->broken[cell], 0);
        assert_int_equal(*world.cuts->pieces.count, 1);
        expect_whole(&world);
        cut_world_check_masses(&world);
        // What was divided for it is merged again; with a third more than it says it fits.
        assert_int_equal(world.body->element_count, 64);
        options = options_of(0);
        options.body.body.node_capacity =
            1900 + 300 * more + (outcome.needed - outcome.room) * 4 / 3;
        SCOPED(cut_world_destroy) CutWorld larger;
        make_world(&larger, options, 2);
        assert_true(cut_world_cut(&larger, &cut, &outcome));
        // A smaller one fits as it is.
        cut = cut_world_sweep(vec3(0.05, 0.05, 0.05), vec3(0.0, 0.0, 1.0), vec3(1.0, 1.0, 0.0),
                              0.007, -0.02, 0.02);
        assert_true(cut_world_cut(&world, &cut, &outcome));
        expect_whole(&world);
    }
}
