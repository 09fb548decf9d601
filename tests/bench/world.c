// SPDX-License-Identifier: MIT
#include "world.h"

SurfaceMaterial bench_material(void)
{
    return (SurfaceMaterial){.youngs_modulus_2d = 80.0, .areal_density = 4.2, .damping_time = 1e-4};
}

SurfaceShape bench_shape(void)
{
    return (SurfaceShape){
        .wanted = true, .angular_frequency = 50.0, .damping_ratio = 0.1, .frame = SHAPE_WORLD};
}

bool bench_world_create(BenchWorld *world, const TriMesh *mesh, const BenchWorldOptions *options,
                        Status *status)
{
    static const FixedRegion below = {
        .kind = FIXED_BOX, .low = {-10.0, -10.0, -10.0}, .high = {10.0, 10.0, -0.1}};
    *world = (BenchWorld){0};
    SurfaceOptions surface = {
        .body.name = "body",
        .material = options->material != NULL ? *options->material : bench_material(),
        .shape = bench_shape(),
        .cavity = options->cavity,
        .body.integrator = options->integrator,
        .body.precision = options->precision,
        .body.time_step = options->time_step,
        .body.fixed_count = options->held_below ? 1 : 0,
        .body.fixed = &below,
        .body.initial_velocity = options->initial_velocity,
        .body.contact_ratio = 0.5,
        .body.contact_damping = 1e-3,
        .body.friction = 0.3,
        .body.isa = options->isa,
    };
    SimOptions sim = {
        .rate_hz = options->rate_hz, .tool_timeout_s = 1e6, .may_load = options->may_load};
    Body body;
    if (!surface_create(&body, mesh, &surface, &world->arena, &world->state, status))
        return false;
    world->sim = sim_create(&sim, &world->arena, &world->state);
    world->body = sim_add_body(world->sim, &body);
    if (options->tool != NULL)
        sim_add_tool(world->sim, options->tool);
    return sim_seal(world->sim, 0.0, status);
}

void bench_world_destroy(BenchWorld *world)
{
    state_destroy(&world->state);
    arena_destroy(&world->arena);
}
