// SPDX-License-Identifier: MIT
#include "voxel_press.h"

#include "base/check.h"
#include "voxel/model.h"
#include "sim_steps.h"

#include <math.h>

static const double EDGE = 0.1, RADIUS = 0.03, DEPTH = 0.02, SPEED = 0.05;

void voxel_press_create(VoxelPress *press, int n, int levels, Precision precision, const char *isa)
{
    static const FixedRegion bottom = {
        .kind = FIXED_BOX, .low = {-1, -1, -1}, .high = {1, 1, -0.0499}};
    VoxelWorldOptions options = voxel_world_cube(n);
    options.rate_hz = 500.0;
    options.body.body.levels = levels;
    options.body.body.precision = precision;
    options.body.body.isa = isa;
    fix_within(&options.body.body, &bottom);
    // Only the end matters: ten times the usual damping, so that it comes to rest within a second;
    // contact eight times as firm, so that the ball sinks into the surface by no more than 1.2 mm;
    // no friction.
    options.body.damping = 2.0;
    options.body.body.contact_ratio = 4.0;
    options.body.body.friction = 0.0;
    options.tool[options.tool_count++] = (ToolOptions){PROBE(RADIUS, 1e6)};
    voxel_world_create(&press->world, &options);
    sim_set_lockstep(press->world.sim, true);
    const size_t count = (size_t)press->world.count;
    press->tick = 0;
    press->rest = zeroed(count, sizeof *press->rest);
    for (size_t i = 0; i < count; i++)
        press->rest[i] = press->world.x[i];
}

void voxel_press_destroy(VoxelPress *press)
{
    free(press->rest);
    voxel_world_destroy(&press->world);
}

void voxel_press_tick(VoxelPress *press)
{
    Sim *sim = press->world.sim;
    const double way = SPEED * press->tick * sim_tick(sim);
    const double above = 0.5 * EDGE + RADIUS; // it touches
    const ToolPose pose = {.utime = (int64_t)(1e6 * press->tick * sim_tick(sim)),
                           .position = {0.0, 0.0, above + 1e-6 - fmin(way, DEPTH)},
                           .orientation = QUAT_NONE,
                           .active = true};
    sim_apply_pose(sim, 0, &pose, true);
    sim_step(sim);
    press->tick++;
}

void voxel_press_release(VoxelPress *press)
{
    const ToolPose away = {.utime = (int64_t)(1e6 * press->tick * sim_tick(press->world.sim)),
                           .orientation = QUAT_NONE};
    sim_apply_pose(press->world.sim, 0, &away, true);
    sim_step(press->world.sim);
    press->tick++;
}

double voxel_press_error(VoxelPress *press, VoxelPress *full)
{
    const VoxelModel *model = press->world.body->model;
    double differences = 0.0, whole = 0.0;
    voxel_world_read(&press->world);
    voxel_world_read(&full->world);
    for (int i = 0; i < model->surface_count; i++) {
        // The same outer vertices in the same order.
        ASSERT(press->world.id[i] == full->world.id[i]);
        Vec3 u = vec3_sub(press->world.x[i], press->rest[i]);
        Vec3 expected = vec3_sub(full->world.x[i], full->rest[i]);
        Vec3 difference = vec3_sub(u, expected);
        differences += vec3_dot(difference, difference);
        whole += vec3_dot(expected, expected);
    }
    return sqrt(differences / whole);
}

double voxel_press_force(const VoxelPress *press)
{
    return sim_wrench(press->world.sim, 0)->force.z;
}

double voxel_press_kinetic(const VoxelPress *press)
{
    return measure_of(press->world.body).kinetic;
}
