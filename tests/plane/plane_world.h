// SPDX-License-Identifier: MIT
// A scene of one plane body and its tools in memory: a real body in a real Sim, poses taken at
// once, no clock but the ticks.
#ifndef PLIANT_TESTS_PLANE_WORLD_H
#define PLIANT_TESTS_PLANE_WORLD_H

#include "sim/sim_data.h"
#include "plane/model.h"
#include "sim_steps.h"

#include <stdio.h>
#include <stdlib.h>
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

typedef struct PlaneWorldOptions {
    Lattice lattice; // taken over by plane_world_create
    SolidMaterial material;
    PlaneOptions body;
    double rate_hz;
    int tool_count;
    ToolOptions tool[2];
} PlaneWorldOptions;

typedef struct PlaneWorld {
    Lattice lattice;
    Arena arena;
    StateList state;
    Sim *sim;
    Body *body;
    PlaneModel *model;
} PlaneWorld;

// A free disc of radius `cells` cells of 2 mm, E 10 kPa, nu 0, rho 1000 kg/m3, damping 0.2, levels
// 3, affine, double, symplectic Euler, 1 kHz, no gravity, no tools.
static inline PlaneWorldOptions plane_world_disc(int cells)
{
    PlaneWorldOptions options = {
        .material = {.youngs_modulus = 1e4, .density = 1000.0},
        .body = {.body.name = "sheet",
                 .body.levels = 3,
                 .law = PLANE_AFFINE,
                 .material_count = 1,
                 .damping = 0.2,
                 .body.integrator = INTEGRATOR_SYMPLECTIC_EULER,
                 .body.contact_ratio = 0.5,
                 .body.contact_damping = 2e-4},
        .rate_hz = 1000.0,
    };
    if (!lattice_disc(&options.lattice, 0.002 * cells, 0.002, &(Status){0}))
        abort();
    return options;
}

static inline void plane_world_create(PlaneWorld *world, PlaneWorldOptions *options)
{
    *world = (PlaneWorld){.lattice = options->lattice};
#ifdef __SSE2__
    _mm_setcsr(_mm_getcsr() | 0x8040); // flush to zero, denormals are zero, as the daemon does
#endif
    SimOptions sim = {.rate_hz = options->rate_hz,
                      .gravity = options->body.body.gravity,
                      .tool_timeout_s = 0.2,
                      .may_load = !options->body.body.without_loads};
    Status status = {0};
    Body body;
    options->body.lattice = &world->lattice;
    options->body.material = &options->material;
    world->sim = sim_create(&sim, &world->arena, &world->state);
    bool ok = plane_create(&body, &options->body, &world->arena, &world->state, &status);
    if (ok) {
        world->body = sim_add_body(world->sim, &body);
        world->model = world->body->model;
        for (int t = 0; t < options->tool_count; t++)
            sim_add_tool(world->sim, &options->tool[t]);
        ok = sim_seal(world->sim, 0.0, &status);
    }
    if (!ok) {
        fprintf(stderr, "%s\n", status.text);
        abort();
    }
    sim_set_lockstep(world->sim, true);
}

static inline void plane_world_destroy(PlaneWorld *world)
{
    lattice_destroy(&world->lattice);
    state_destroy(&world->state);
    arena_destroy(&world->arena);
}

static inline void plane_world_run(PlaneWorld *world, double seconds)
{
    long ticks = lround(seconds / sim_tick(world->sim));
    for (long i = 0; i < ticks; i++)
        sim_step(world->sim);
}

static inline void plane_world_place(PlaneWorld *world, int tool, Vec3 position)
{
    put_tool(world->sim, tool, position);
}

static inline void plane_world_read(const PlaneWorld *world, int vertex, Vec3 *x, Vec3 *v)
{
    rows_read(&world->model->vertices.rows,
              world->model->vertices.row[world->model->vertices.current], vertex, x, v);
}

static inline void plane_world_write(PlaneWorld *world, int vertex, Vec3 x, Vec3 v)
{
    rows_write(&world->model->vertices.rows,
               world->model->vertices.row[world->model->vertices.current], vertex, x, v);
}

// Sums over the vertices, angular about the origin.
static inline void plane_world_momentum(const PlaneWorld *world, Vec3 *linear, Vec3 *angular)
{
    *linear = *angular = vec3(0, 0, 0);
    for (int i = 0; i < world->model->vertices.count; i++) {
        Vec3 x, v;
        plane_world_read(world, i, &x, &v);
        *linear = vec3_madd(*linear, world->model->vertices.mass[i], v);
        *angular = vec3_madd(*angular, world->model->vertices.mass[i], vec3_cross(x, v));
    }
}

#endif
