// SPDX-License-Identifier: MIT
// Graspers on a body where faces of two levels meet: what hangs there carries no mass of its own.
#include "detail_bench.h"
#include "test.h"

#include "sim/hold/attachment_data.h"
#include "sim/sim_data.h"
#include "geometry/generator.h"

static bool has_hanging_corner(const DetailBench *bench, int face)
{
    const BodySurface *surface = &bench->body->surface;
    bool hangs = false;
    for (int k = 0; k < 3; k++) {
        int node = surface->face[face][k];
        if (surface->node_face_end[node] <= surface->node_face_start[node] ||
            node == surface->face[face][(k + 1) % 3])
            return false; // nobody's place
        hangs |= bench->detail->set.status[node] == NODE_HANGING;
    }
    return hangs;
}

static void hold_at(DetailBench *bench, Vec3 position, double grip)
{
    ToolPose pose = {
        .position = position, .orientation = {1, 0, 0, 0}, .active = true, .grip = grip};
    sim_apply_pose(bench->sim, 0, &pose, true);
    sim_step(bench->sim);
}

// Jaws smaller than any face: the one that they close on is held by a point in it.
TEST(faces_with_hanging_corners_are_held_too)
{
    TriMesh mesh;
    assert_true(generate_ico_sphere(&mesh, 1, 0.05, &(Status){0}));
    SurfaceOptions options = bench_options(2, 0);
    ToolOptions tool = {.id = 1,
                        .kind = TOOL_GRASPER,
                        .capsule_count = 1,
                        .capsule = {{{0, 0, 0}, {0, 0, 0}, 0.001}},
                        .max_force = 100.0,
                        .grip_stiffness = 0.3,
                        .grip_damping = 0.5};
    SCOPED(bench_destroy) DetailBench bench;
    bench_create(&bench, BENCH_ADAPTIVE, &mesh, &options, &tool, NULL);
    const Attachment *grip = bench.sim->attachment[0];
    const BodySurface *surface = &bench.body->surface;
    uint64_t random = 5;
    int tried = 0;
    for (int i = 0; i < 30; i++)
        bench_change_at_random(&bench, &random, 8);
    for (int f = 0; f < surface->face_used; f++) {
        if (!has_hanging_corner(&bench, f))
            continue;
        Vec3 x[3], at = {0, 0, 0};
        bench.body->ops->read_nodes(bench.body->model, surface->face[f], 3, x, NULL);
        for (int k = 0; k < 3; k++)
            at = vec3_madd(at, 1.0 / 3.0, x[k]);
        bool points;
        hold_at(&bench, at, 1.0);
        assert_int_equal(attachment_held(grip, &points), 1);
        assert_true(points);
        hold_at(&bench, vec3_add(at, vec3(0.001, 0, 0)), 1.0);
        assert_true(sim_wrench(bench.sim, 0)->force.x < 0.0);
        for (int i = 0; attachment_is_holding(grip) && i < 30; i++) // they open in 20 ms
            hold_at(&bench, at, 0.0);
        hold_at(&bench, vec3(1.0, 0, 0), 0.0);
        tried++;
    }
    assert_true(tried > 20);
}
