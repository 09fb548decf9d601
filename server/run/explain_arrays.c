// Prints the bytes of every array, grouped by use. Arrays that share a name (one per level or
// blade) share a line.
#include "run/explain_parts.h"

#include <string.h>

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
    for (int i = 0; i < arena->count; i++) {
        if (!is_same(&arena->block[i], block))
            continue;
        if (i < index)
            return;
        bytes += arena->block[i].bytes;
        count++;
    }
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

void explain_arrays(World *world, int nodes, FILE *out)
{
    const Arena *arena = &world->arena;
    for (size_t u = 0; u < sizeof USES / sizeof *USES; u++) {
        fprintf(out, "arrays, %s: %zu bytes\n", USES[u].name, arena_bytes_of(arena, USES[u].use));
        for (int i = 0; i < arena->count; i++)
            if (arena->block[i].use == USES[u].use)
                print_block(arena, i, out);
    }
    const size_t total = arena_bytes(arena) + print_kept(world, out);
    fprintf(out,
            "total: %zu bytes, %.1f a node, of which %.1f read or written by every step and %.1f "
            "while a tool is near\n",
            total, (double)total / nodes, (double)arena_bytes_of(arena, ARENA_STEP) / nodes,
            (double)arena_bytes_of(arena, ARENA_CONTACT) / nodes);
    fprintf(out, "not counted: stacks, and what the libraries of LCM and HDF5 take\n");
}
