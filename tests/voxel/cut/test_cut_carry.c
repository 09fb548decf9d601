// SPDX-License-Identifier: MIT
// Bodies that adapt: the points that are shown while elements merge and are divided, and what a
// change keeps of mass, momentum and energy.
#include "sim/follow.h"
#include "test.h"
#include "cut_world.h"
#include "effort.h"
#include "sim_steps.h"

enum { BODIES = 3 };

// A cube of which all elements are whole, a ball and a part of three materials, whose surface
// elements are partly filled.
static VoxelWorldOptions options_of(int body)
{
    VoxelWorldOptions options = body == 0   ? voxel_world_cube(16)
                                : body == 1 ? voxel_world_ball()
                                            : voxel_world_corner();
    options.body.body.levels = 2;
    options.body.surface_level = 2;
    options.body.split_budget = 8;
    return options;
}

// --- at rest ---

// Reads what is published.
static void read_shown(const CutWorld *world, float (*x)[3])
{
    world->body->ops->snapshot(world->body->model, x[0], NULL);
}

TEST(an_untouched_body_shows_the_points_of_one_that_does_not_adapt)
{
    for (int k = 0; k < BODIES; k++) {
        VoxelWorldOptions options = options_of(k), plain = options_of(k);
        plain.body.surface_level = 0;
        SCOPED(cut_world_destroy) CutWorld world;
        SCOPED(cut_world_destroy) CutWorld fine;
        cut_world_create(&world, &options);
        cut_world_create(&fine, &plain);
        const BodyMesh *a = &world.body->mesh, *b = &fine.body->mesh;
        assert_int_equal(a->node_count, b->node_count);
        assert_int_equal(a->triangle_count, b->triangle_count);
        assert_memory_equal(a->triangle, b->triangle, (size_t)a->triangle_count * sizeof *a->triangle);
        assert_memory_equal(a->id, b->id, (size_t)a->node_count * sizeof *a->id);
        assert_memory_equal(a->piece, b->piece, (size_t)a->node_count * sizeof *a->piece);
        float(*x)[3] = calloc((size_t)a->node_count, sizeof *x);
        float(*y)[3] = calloc((size_t)a->node_count, sizeof *y);
        read_shown(&world, x);
        read_shown(&fine, y);
        assert_memory_equal(x, y, (size_t)a->node_count * sizeof *x);
        free(x);
        free(y);
        // What tools meet is as heavy and as firm.
        for (int v = 0; v < fine.cuts->faces.vertex_count; v++) {
            if (fine.body->surface.node_area[v] == 0.0)
                continue;
            expect_near(world.body->surface.node_area[v], fine.body->surface.node_area[v], 0.0);
            expect_near(world.body->surface.node_mass[v], fine.body->surface.node_mass[v],
                        1e-12 * fine.body->surface.node_mass[v]);
            expect_near(world.body->surface.node_firmness[v], fine.body->surface.node_firmness[v],
                        1e-12);
        }
        cut_world_check_masses(&world);
        print_message("%d of %d elements, %d carried of %d\n", world.body->element_count,
                      fine.body->element_count, world.cuts->carry->count, a->node_count);
        assert_true(2 * world.body->element_count < fine.body->element_count);
    }
}
