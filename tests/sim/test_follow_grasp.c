// SPDX-License-Identifier: MIT
// What is held of a body whose topology changes: nodes that come within the jaws are held, what
// goes leaves its share to others, and hand and body feel the same.
#include "effort.h"
#include "test.h"
#include "sim/hold/attachment_data.h"
#include "sim/sim_data.h"
#include "random.h"
#include "toy_body.h"

static const double CELL = 0.01; // [m]
enum { CELLS = 8 };

static ToolOptions jaws(double radius)
{
    return (ToolOptions){.id = 1,
                         .kind = TOOL_GRASPER,
                         .capsule_count = 1,
                         .capsule = {{{0, 0, 0}, {0, 0, 0}, radius}},
                         .max_force = 1e9,
                         .grip_stiffness = 0.3};
}

static void pull(ToyScene *scene, Vec3 position, double grip)
{
    ToolPose pose = {
        .position = position, .orientation = {1, 0, 0, 0}, .active = true, .grip = grip};
    sim_apply_pose(scene->sim, 0, &pose, true);
    toy_scene_step(scene);
}

static bool is_used(const Body *body, int node)
{
    return body->surface.node_face_end[node] > body->surface.node_face_start[node];
}

// The sheet stands still: held is at every moment what lies within the jaws where they closed, and
// the force is that of all these masses.
TEST(what_lies_within_the_jaws_is_held_at_any_level)
{
    const double radius = 0.017;
    const Vec3 at = {0.002, -0.003, 0.001}, away = {0.0, 0.0, 0.002};
    ToolOptions tool = jaws(radius);
    SCOPED(toy_scene_destroy) ToyScene scene;
    toy_scene_touched(&scene, CELLS, CELL, &tool);
    const Attachment *grip = scene.sim->attachment[0];
    const Body *body = scene.body[0];
    Toy *toy = scene.toy[0];
    uint64_t random = 3;
    pull(&scene, at, 1.0);
    assert_true(attachment_is_holding(grip));
    double lambda = 0.3 * body->contact_lambda;
    for (int k = 0; k < EFFORT(300); k++) {
        toy_want_some(toy, k % 3 == 0 ? 2 : 20, &random);
        pull(&scene, vec3_add(at, away), 1.0);
        int within = 0;
        double mass = 0.0;
        for (int i = 0; i < body->surface.node_count; i++) {
            bool inside = is_used(body, i) && vec3_length(vec3_sub(toy->position[i], at)) <= radius;
            within += inside;
            mass += inside ? body->surface.node_mass[i] : 0.0;
        }
        bool points;
        assert_int_equal(attachment_held(grip, &points), within);
        assert_false(points);
        Vec3 sum = {0, 0, 0};
        for (int i = 0; i < body->surface.node_count; i++)
            sum = vec3_add(sum, toy->force[i]);
        Vec3 force = sim_wrench(scene.sim, 0)->force;
        // A kick a substep: the forces of a tick add up to substeps times one's.
        double size = lambda * mass * away.z;
        expect_near(-force.z, size, 1e-12 * size);
        expect_near(sum.z, size * body->substeps, 1e-12 * size * body->substeps);
        expect_near(force.x, 0.0, 1e-12 * size);
    }
    assert_true(toy->changes > EFFORT(250));
    assert_true(sim_refused_holds(scene.sim) == 0);
    for (int i = 0; i < 21; i++) // eased over 20 ms
        pull(&scene, at, 0.0);
    assert_false(attachment_is_holding(grip));
}

// Jaws smaller than a face hold points of it; once the wall is fine enough, nodes.
TEST(points_of_faces_pass_on_and_give_way_to_nodes)
{
    ToolOptions tool = jaws(0.0029);
    SCOPED(toy_scene_destroy) ToyScene scene;
    toy_scene_touched(&scene, CELLS, CELL, &tool);
    const Attachment *grip = scene.sim->attachment[0];
    Toy *toy = scene.toy[0];
    // Amid a face of the coarse sheet: its corners are 3.5 mm away or more.
    const int *corner = scene.mesh.triangle[2 * (CELLS * CELLS / 2 + CELLS / 2)];
    Vec3 at = {0, 0, 0};
    for (int k = 0; k < 3; k++)
        at = vec3_madd(at, 1.0 / 3.0, scene.mesh.position[corner[k]]);
    pull(&scene, at, 1.0);
    bool points;
    assert_true(attachment_held(grip, &points) >= 1);
    assert_true(points);
    Vec3 away = vec3(0, 0, 0.001);
    pull(&scene, vec3_add(at, away), 1.0);
    double coarse = -sim_wrench(scene.sim, 0)->force.z;
    assert_true(coarse > 0.0);
    uint64_t random = 9;
    for (int k = 0; k < 100; k++) {
        toy_want_some(toy, 3, &random);
        pull(&scene, vec3_add(at, away), 1.0);
        int held = attachment_held(grip, &points);
        assert_true(held > 0);
        assert_true(-sim_wrench(scene.sim, 0)->force.z > 0.0);
        assert_true(attachment_check(grip));
    }
    toy_want_all(toy, true);
    pull(&scene, vec3_add(at, away), 1.0);
    // The three midpoints are 2.4 to 3.7 mm off: whatever holds, it holds.
    assert_true(attachment_held(grip, &points) > 0);
}

// A hold that is let go in any state of the mesh leaves nothing behind, and the state of a hold is
// a function of what is held alone.
TEST(letting_go_clears_what_was_known)
{
    ToolOptions tool = jaws(0.02);
    SCOPED(toy_scene_destroy) ToyScene scene;
    toy_scene_touched(&scene, CELLS, CELL, &tool);
    const Attachment *grip = scene.sim->attachment[0];
    uint64_t random = 21;
    for (int k = 0; k < 50; k++) {
        pull(&scene, vec3(0, 0, 0), 1.0);
        for (int i = 0; i < 5; i++) {
            toy_want_some(scene.toy[0], 4, &random);
            pull(&scene, vec3(0, 0, 0.001), 1.0);
            assert_true(attachment_check(grip));
        }
        for (int i = 0; attachment_is_holding(grip) && i < 30; i++) // it eases for 20 ms
            pull(&scene, vec3(0, 0, 0), 0.0);
        for (int i = 0; i < grip->capacity; i++) {
            assert_int_equal(grip->node[i], 0);
            assert_true(grip->held[i].share == 0.0 && vec3_length(grip->held[i].local) == 0.0);
        }
        for (int i = 0; i < HELD_POINTS; i++)
            assert_true(grip->point[i].face == 0 && grip->point[i].weight[0] == 0.0);
    }
}
