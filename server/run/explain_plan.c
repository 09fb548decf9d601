// SPDX-License-Identifier: MIT
// What a scene costs and enables, for --explain. A feature that a scene can do without must be
// listed: by the row of the key that enables it, here only what options of the program enable.
#include "run/modes.h"

#include <string.h>

// --- the bytes of every array --------------------------------------------------------------------

static const struct {
    ArenaUse use;
    const char *name;
} USES[] = {{ARENA_STEP, "every step"},
            {ARENA_CONTACT, "while a tool is near"},
            {ARENA_TOPOLOGY, "meshes and connectivity"},
            {ARENA_OUTPUT, "messages and files"}};

static bool is_same(const ArenaBlock *a, const ArenaBlock *b)
{
    return a->use == b->use && strcmp(a->name, b->name) == 0;
}

// Prints all arrays of this one's name, unless an earlier one has printed them.
static void print_block(const Arena *arena, int index, FILE *out)
{
    const ArenaBlock *block = &arena->block[index];
    size_t bytes = 0;
    int count = 0;
    // A block of the same name that came earlier has printed all of them.
    for (int i = 0; i < arena->count; i++) {
        if (!is_same(&arena->block[i], block))
            continue;
        if (i < index)
            return;
        bytes += arena->block[i].bytes;
        count++;
    }
    // One line, with their number where there are several.
    fprintf(out, "  %-47s %12zu", block->name, bytes);
    if (count > 1)
        fprintf(out, " in %d", count);
    fprintf(out, "\n");
}

static size_t mesh_bytes(const TriMesh *mesh)
{
    size_t nodes = (size_t)mesh->node_count;
    return nodes * (sizeof *mesh->position + sizeof *mesh->file_index) +
           (size_t)mesh->triangle_count * sizeof *mesh->triangle +
           (mesh->file_node != NULL ? (size_t)mesh->file_node_count : 0) * sizeof *mesh->file_node +
           (size_t)mesh->copy_count * sizeof *mesh->copy_of +
           (mesh->uv != NULL ? nodes : 0) * sizeof *mesh->uv;
}

// Prints memory that belongs to no array of the running scene but stays allocated with it.
static size_t print_kept(World *world, FILE *out)
{
    // What loading leaves, though no step needs it.
    size_t meshes = 0;
    for (int i = 0; i < world->mesh_count; i++)
        meshes += sizeof world->mesh[i] + sizeof world->cells[i] + mesh_bytes(&world->mesh[i]);
    const size_t arrays = (size_t)world->arena.capacity * sizeof *world->arena.block;
    const size_t state = (size_t)world->state.capacity * sizeof *world->state.array;
    const size_t team = world->team != NULL ? team_bytes() : 0;
    fprintf(out, "kept from loading: %zu bytes\n", meshes + arrays + state + team);
    fprintf(out, "  %-47s %12zu\n  %-47s %12zu\n  %-47s %12zu\n", "meshes as they were read",
            meshes, "list of these arrays", arrays, "list of the state", state);
    if (team > 0)
        fprintf(out, "  %-47s %12zu\n", "threads of a step", team);
    return meshes + arrays + state + team;
}

// Prints the arrays and their bytes; `nodes`: the sum over all bodies.
static void print_arrays(World *world, int nodes, FILE *out)
{
    const Arena *arena = &world->arena;
    // By use, so that it shows what a step reads and writes.
    for (size_t u = 0; u < sizeof USES / sizeof *USES; u++) {
        fprintf(out, "arrays, %s: %zu bytes\n", USES[u].name, arena_bytes_of(arena, USES[u].use));
        for (int i = 0; i < arena->count; i++)
            if (arena->block[i].use == USES[u].use)
                print_block(arena, i, out);
    }
    // The sum, also by node: the figure to compare scenes by.
    const size_t total = arena_bytes(arena) + print_kept(world, out);
    fprintf(out,
            "total: %zu bytes, %.1f a node, of which %.1f read or written by every step and %.1f "
            "while a tool is near\n",
            total, (double)total / nodes, (double)arena_bytes_of(arena, ARENA_STEP) / nodes,
            (double)arena_bytes_of(arena, ARENA_CONTACT) / nodes);
    fprintf(out, "not counted: stacks, and what the libraries of LCM and HDF5 take\n");
}

// --- features ------------------------------------------------------------------------------------

// Prints the features that options of the program enable.
static void print_files(const ExchangeOptions *asked, FILE *out)
{
    scene_print_feature(asked->records, "recording", "option --record FILE", out);
    scene_print_feature(asked->checkpoints, "checkpoints", "option --checkpoint FILE", out);
    scene_print_feature(asked->logs_inputs, "log of applied inputs", "option --log-inputs FILE",
                        out);
    scene_print_feature(asked->checkpoints || asked->logs_inputs || asked->records, "files thread",
                        "any of these three", out);
}

static void print_all_features(World *world, const Scene *scene, const ExchangeOptions *asked,
                               FILE *out)
{
    fprintf(out, "features of the scene, and what enables each:\n");
    scene_print_features(world, scene, out);
    // What only a live run has.
    if (asked != NULL) {
        scene_print_published(world, scene, out);
        print_files(asked, out);
    }
    for (int i = 0; i < scene->body_count; i++) {
        fprintf(out, "features of body %s, and what enables each:\n", scene->body[i].name);
        scene_print_body_features(world, scene, i, out);
    }
}

// --- all of it -----------------------------------------------------------------------------------

void explain_plan(World *world, const Scene *scene, const ExchangeOptions *asked, FILE *out)
{
    explain_summary(world, scene, out);
    Sim *sim = world->sim;
    // Which stages run, and which kernels.
    fprintf(out, "stages:");
    for (int i = 0; i < sim_stage_count(sim); i++)
        fprintf(out, " %s", stage_name(sim_stage(sim, i)));
    fprintf(out, "\n");
    for (int i = 0; i < sim_body_count(sim); i++) {
        const Body *body = sim_body(sim, i);
        fprintf(out, "kernel of body %s:\n", body->name);
        body->ops->explain(body->model, out);
    }
    print_arrays(world, explain_nodes(world), out);
    print_all_features(world, scene, asked, out);
}
