// SPDX-License-Identifier: MIT
#include "world.h"

#include "fuzz.h"

#include "base/log.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const char TEXT[] =
    "name = \"fuzz\"; rate_hz = 500.0; tool_timeout_s = 0.05; gravity = [0.0, 0.0, -1.0];\n"
    "settle_s = 0.01; max_ties = 3;\n"
    "bodies = (\n"
#ifdef PLIANT_WITH_SURFACE
    "  { name = \"ball\"; mesh = { generator = \"ico_sphere\"; nodes = 42; radius = 0.05; };\n"
    "    levels = 1; start_level = 0; prestress = 0.1; cuttable = true; cavity = { fluid = true; "
    "pressure = 200.0; }; contact = { stiffness = 1.0; };\n"
    "    adapt = { force = 0.005; speed = 0.3; curvature = 0.4; check_hz = 100.0; };\n"
    "    material = { youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4; };\n"
    "    shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n"
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.03]); } ); }\n"
#ifdef PLIANT_WITH_VOXEL
    "  ,\n"
#endif
#endif
#ifdef PLIANT_WITH_VOXEL
    "  { name = \"block\"; model = \"voxel\";\n"
    "    voxels = { generator = \"box\"; count = [4, 4, 4]; size = 0.02;\n"
    "               place = { translation = [0.089, 0.0, 0.0]; }; };\n"
    "    levels = 1; cuttable = true; split_budget = 4; tear = { stress = 3000.0; };\n"
    "    material = { youngs_modulus = 1.0e4; density = 1000.0; damping = 0.2; };\n"
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.03]); } ); }\n"
#endif
    ");\n"
#if defined(PLIANT_WITH_SURFACE) && defined(PLIANT_WITH_VOXEL)
    "touch = ( { bodies = [\"ball\", \"block\"]; friction = 0.3; }, { bodies = [\"ball\"]; }, { "
    "bodies = [\"block\"]; } );\n"
#endif
    "tools = (\n"
    "  { id = 1; kind = \"probe\"; max_force = 3.3;\n"
    "    capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.0, 0.0, 0.1]; radius = 0.01; } ); },\n"
    "  { id = 2; kind = \"blade\"; edge = ( [0.0, 0.0, 0.0], [0.0, 0.0, 0.05] ); },\n"
    "  { id = 3; kind = \"grasper\"; max_force = 3.3;\n"
    "    capsules = ( { from = [0.0, 0.0, 0.0]; radius = 0.02; } ); },\n"
    "  { id = 4; kind = \"static\"; plane = { point = [0.0, 0.0, -0.06];\n"
    "                                       normal = [0.0, 0.0, 1.0]; }; } );\n";

#ifdef PLIANT_WITH_VOXEL
// Solids whose elements are divided and merged: one that is steered by its error and keeps all its
// cells, and one that is cut, heated and taken away.
static const char ADAPTS[] =
    "name = \"adapts\"; rate_hz = 500.0; tool_timeout_s = 0.05; gravity = [0.0, 0.0, -1.0];\n"
    "settle_s = 0.0;\n"
    "bodies = (\n"
    "  { name = \"pad\"; model = \"voxel\";\n"
    "    voxels = { generator = \"box\"; count = [9, 7, 6]; size = 0.01; };\n"
    "    levels = { inside = 2; surface = 2; }; adapt = { error = 0.05; };\n"
    "    material = { youngs_modulus = 1.0e4; density = 1000.0; damping = 0.2; };\n"
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.029]); } ); },\n"
    "  { name = \"lump\"; model = \"voxel\";\n"
    "    voxels = { generator = \"ball\"; radius = 0.045; size = 0.01;\n"
    "               place = { translation = [0.12, 0.0, 0.0]; }; };\n"
    "    levels = { inside = 2; surface = 2; }; cuttable = true; split_budget = 4;\n"
    "    tear = { stress = 3000.0; };\n"
    "    material = { youngs_modulus = 1.0e4; density = 1000.0; damping = 0.2; };\n"
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.03]); } ); } );\n"
    "tools = (\n"
    "  { id = 1; kind = \"probe\"; max_force = 3.3;\n"
    "    capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.0, 0.0, 0.1]; radius = 0.01; } ); },\n"
    "  { id = 2; kind = \"remover\"; removes_by = \"diathermy\"; max_force = 3.3;\n"
    "    power = 40.0; mouth = { radius = 0.008; };\n"
    "    capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.0, 0.0, 0.1]; radius = 0.008; } ); } );\n";
#else
static const char ADAPTS[] = "";
#endif

void fuzz_world_build(FuzzWorld *world, const char *text)
{
    Status status = {0};
    // The plain kernels: what they are given is the same at every level.
    const BuildOptions options = {.isa = "baseline", .may_load = true, .publishes = true};
    const char *path = fuzz_write("world.cfg", text, strlen(text));
    if (!scene_read(path, &world->scene, &status) ||
        !world_build(&world->world, &world->scene, &options, &status))
        fprintf(stderr, "fuzz: %s\n", status.text);
    MUST(status.code == STATUS_OK);
    world->start = malloc(state_bytes(&world->world.state));
    MUST(world->start != NULL);
    state_copy_out(&world->world.state, world->start);
}

// Puts a world back to its start; builds it the first time.
static FuzzWorld *world_at_start(FuzzWorld *world, const char *text)
{
    log_set_level(LOG_ERROR);
    if (world->start == NULL)
        fuzz_world_build(world, text);
    SimEvent event;
    GraspEvent grasp;
    state_copy_in(&world->world.state, world->start);
    sim_restored(world->world.sim);
    sim_set_lockstep(world->world.sim, false);
    while (sim_take_event(world->world.sim, &event))
        continue;
    while (sim_next_grasp(world->world.sim, &grasp))
        continue;
    return world;
}

FuzzWorld *fuzz_world(void)
{
    static FuzzWorld world;
    return world_at_start(&world, TEXT);
}

FuzzWorld *fuzz_world_that_adapts(void)
{
    static FuzzWorld world;
    return world_at_start(&world, ADAPTS);
}

static void check_body(Sim *sim, int index)
{
    const Body *body = sim_body(sim, index);
    int slots = body->mesh.node_count;
    float *position = malloc(sizeof(float) * 3 * (size_t)(slots + 1));
    MUST(position != NULL);
    body->ops->snapshot(body->model, position, NULL);
    for (int i = 0; i < slots; i++)
        if (body->mesh.id[i] >= 0)
            for (int c = 0; c < 3; c++)
                MUST(isfinite(position[3 * i + c]));
    free(position);
    for (int t = 0; t < body->mesh.triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            int node = body->mesh.triangle[t][k];
            bool free_slot = body->mesh.triangle[t][0] == body->mesh.triangle[t][1];
            MUST(node >= 0 && node < slots);
            MUST(free_slot || body->mesh.id[node] >= 0);
        }
    BodyMeasure measure;
    sim_measure(sim, index, &measure);
    MUST(isfinite(measure.kinetic) && isfinite(measure.elastic));
    MUST(isfinite(measure.max_displacement));
    MUST(body->ops->check == NULL || body->ops->check(body->model));
}

void fuzz_world_check(FuzzWorld *world)
{
    Sim *sim = world->world.sim;
    MUST(sim_check(sim));
    for (int i = 0; i < sim_body_count(sim); i++)
        check_body(sim, i);
    for (int i = 0; i < sim_tool_count(sim); i++) {
        const ToolWrench *wrench = sim_wrench(sim, i);
        MUST(vec3_finite(wrench->force) && vec3_finite(wrench->torque));
        MUST(vec3_finite(wrench->point) && vec3_finite(wrench->normal));
        MUST(vec3_finite(wrench->position) && isfinite(wrench->depth));
    }
}
