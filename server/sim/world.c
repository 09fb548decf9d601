// SPDX-License-Identifier: MIT
// The step thread calls world_count_input and world_image_take, which only copies.
#include "sim/world.h"

#include "base/check.h"

#include <stdlib.h>

void world_destroy(World *world)
{
    // Threads first: they may still use the rest.
    team_destroy(world->team);
    for (int i = 0; i < world->mesh_count; i++)
        mesh_destroy(&world->mesh[i]);
    free(world->mesh);
    free(world->cells);
    state_destroy(&world->state);
    arena_destroy(&world->arena);
    *world = (World){0};
}

void world_count_input(World *world)
{
    int64_t step = sim_steps(world->sim);
    world->inputs = step == world->inputs_step ? world->inputs + 1 : 1;
    world->inputs_step = step;
}

int64_t world_inputs(const World *world)
{
    return sim_steps(world->sim) == world->inputs_step ? world->inputs : 0;
}

// --- copies ---

void world_image_reserve(WorldImage *image, Arena *arena, const World *world)
{
    // What does not depend on the number of nodes.
    size_t bodies = (size_t)sim_body_count(world->sim);
    *image = (WorldImage){0};
    image->block =
        arena_allocate(arena, ARENA_OUTPUT, state_bytes(&world->state), 1, "checkpoint/state");
    image->node_count =
        arena_allocate(arena, ARENA_OUTPUT, bodies, sizeof *image->node_count, "checkpoint/counts");
    image->id = arena_allocate(arena, ARENA_OUTPUT, bodies, sizeof *image->id, "checkpoint/ids");
    image->position = arena_allocate(arena, ARENA_OUTPUT, bodies, sizeof *image->position,
                                     "checkpoint/positions");
    image->velocity = arena_allocate(arena, ARENA_OUTPUT, bodies, sizeof *image->velocity,
                                     "checkpoint/velocities");
    // For each body as many nodes as it can ever have.
    for (size_t i = 0; i < bodies; i++) {
        const Body *body = sim_body(world->sim, (int)i);
        size_t nodes = (size_t)body->state_capacity;
        image->id[i] =
            arena_allocate(arena, ARENA_OUTPUT, nodes, sizeof(int), "checkpoint/%s/id", body->name);
        image->position[i] = arena_allocate(arena, ARENA_OUTPUT, nodes, sizeof(Vec3),
                                            "checkpoint/%s/position", body->name);
        image->velocity[i] = arena_allocate(arena, ARENA_OUTPUT, nodes, sizeof(Vec3),
                                            "checkpoint/%s/velocity", body->name);
    }
}

const char *world_fault(const World *world)
{
    if (!sim_check(world->sim))
        return "";
    for (int i = 0; i < sim_body_count(world->sim); i++) {
        const Body *body = sim_body(world->sim, i);
        if (body->ops->check != NULL && !body->ops->check(body->model))
            return body->name;
    }
    return NULL;
}

void world_image_take(WorldImage *image, const World *world)
{
    // All of the state, and the rows of each body in the world for readers of the file.
    state_copy_out(&world->state, image->block);
    for (int i = 0; i < sim_body_count(world->sim); i++) {
        const Body *body = sim_body(world->sim, i);
        image->node_count[i] = body->ops->read_state(body->model, image->id[i], image->position[i],
                                                     image->velocity[i]);
    }
    image->time = sim_time(world->sim);
    image->step = sim_steps(world->sim);
    image->inputs = world_inputs(world);
    image->fault = world_fault(world);
}
