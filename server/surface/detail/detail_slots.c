// SPDX-License-Identifier: MIT
#include "surface/detail/detail_slots.h"

#include "base/check.h"
#include "surface/detail/detail_cut.h"

#include <string.h>

static int take(SlotTable *table, int thing)
{
    int slot = table->lowest;
    while (table->thing[slot] >= 0) {
        slot++;
        ASSERT(slot < table->capacity);
    }
    table->thing[slot] = thing;
    table->slot[thing] = slot;
    table->lowest = slot + 1;
    table->used++;
    if (slot >= table->high)
        table->high = slot + 1;
    return slot;
}

static int release(SlotTable *table, int thing)
{
    int slot = table->slot[thing];
    table->slot[thing] = -1;
    table->thing[slot] = -1;
    table->used--;
    if (slot < table->lowest)
        table->lowest = slot;
    while (table->high > 0 && table->thing[table->high - 1] < 0)
        table->high--;
    return slot;
}

// Derives everything from `thing`.
static void restore(SlotTable *table)
{
    table->used = table->high = 0;
    table->lowest = table->capacity;
    for (int i = 0; i < table->thing_count; i++)
        table->slot[i] = -1;
    for (int s = 0; s < table->capacity; s++) {
        // The lowest free slot is the next to be taken.
        if (table->thing[s] < 0) {
            table->lowest = s < table->lowest ? s : table->lowest;
            continue;
        }
        table->slot[table->thing[s]] = s;
        table->used++;
        table->high = s + 1;
    }
}

static void create_table(SlotTable *table, const char *name, const char *what, int capacity,
                         int thing_count, Arena *arena, StateList *state)
{
    table->capacity = capacity;
    table->thing_count = thing_count;
    table->thing = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)capacity, sizeof(int),
                                  "%s/%s slots", name, what);
    table->slot = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)thing_count, sizeof(int),
                                 "%s/slot of %s", name, what);
    for (int s = 0; s < capacity; s++)
        table->thing[s] = -1;
    for (int i = 0; i < thing_count; i++)
        table->slot[i] = -1;
    state_add(state, table->thing, (size_t)capacity * sizeof(int), "%s/%s_slots", name, what);
}

MeshSlots *slots_create(const char *name, const Levels *levels, const int capacity[2],
                        const int *row_of_node, const int *root_id, const int *root_origin,
                        const int *root_piece, int first_id, const DetailCut *cut, Arena *arena,
                        StateList *state)
{
    MeshSlots *slots = ALLOCATE(ARENA_TOPOLOGY, 1, MeshSlots, "mesh slots");
    const Level *finest = &levels->level[levels->finest];
    int most = finest->node_count + (cut != NULL ? cut->copy_capacity : 0);
    // At most what the finest level and all copies need.
    int nodes = capacity[0] > 0 && capacity[0] < most ? capacity[0] : most;
    int faces =
        capacity[1] > 0 && capacity[1] < finest->face_count ? capacity[1] : finest->face_count;
    create_table(&slots->node, name, "node", nodes, most, arena, state);
    create_table(&slots->face, name, "face", faces, finest->face_count, arena, state);
    // What describes a node in its slot.
    slots->levels = levels;
    slots->row_of_node = row_of_node;
    slots->root_id = root_id;
    slots->root_origin = root_origin;
    slots->root_piece = root_piece;
    slots->first_id = first_id;
    slots->cut = cut;
    // By slot, as published.
    slots->row = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "rows of node slots");
    slots->triangle = ALLOCATE(ARENA_TOPOLOGY, faces, *slots->triangle, "triangles");
    slots->id = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node ids");
    slots->origin = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node origins");
    slots->parent = ALLOCATE(ARENA_TOPOLOGY, nodes, *slots->parent, "node parents");
    slots->piece = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node pieces");
    slots->level = ALLOCATE(ARENA_TOPOLOGY, nodes, signed char, "node levels");
    for (int s = 0; s < nodes; s++)
        slots->id[s] = -1;
    return slots;
}

bool slots_reserve(MeshSlots *slots)
{
    // Four faces in place of one, and one more in each of three neighbours.
    enum { NODES = 3, FACES = 6 };
    if (slots->node.used + NODES > slots->node.capacity ||
        slots->face.used + slots->face_reserve + FACES > slots->face.capacity)
        return slots->node.capacity == slots->node.thing_count &&
               slots->face.capacity ==
                   slots->face.thing_count; // everything that can exist has a slot
    slots->face_reserve += FACES;
    return true;
}

static int id_of(const MeshSlots *slots, int node)
{
    int roots = slots->levels->level[0].node_count;
    return node < roots ? slots->root_id[node] : slots->first_id + node - roots;
}

static int piece_of(const MeshSlots *slots, int node)
{
    if (slots->cut != NULL)
        return slots->cut->node_piece[node];
    int parent[2], root = node;
    while (levels_of_node(slots->levels, root) > 0) {
        levels_parents(slots->levels, root, parent);
        root = parent[0];
    }
    return slots->root_piece[root];
}

static void describe_node(MeshSlots *slots, int slot)
{
    int node = slots->node.thing[slot], first = node, parent[2];
    slots->row[slot] = slots->row_of_node[node];
    slots->id[slot] = id_of(slots, node);
    slots->piece[slot] = piece_of(slots, node);
    if (slots->cut != NULL && node >= slots->cut->base_count)
        first = slots->cut->origin[node - slots->cut->base_count];
    levels_parents(slots->levels, first, parent);
    for (int k = 0; k < 2; k++)
        slots->parent[slot][k] = id_of(slots, first == node ? parent[k] : first);
    slots->level[slot] = (signed char)levels_of_node(slots->levels, first);
    slots->origin[slot] = slots->level[slot] == 0 ? slots->root_origin[first] : id_of(slots, first);
}

void slots_label(MeshSlots *slots)
{
    for (int s = 0; s < slots->node.high; s++)
        if (slots->node.thing[s] >= 0)
            slots->piece[s] = piece_of(slots, slots->node.thing[s]);
}

static void forget_node(MeshSlots *slots, int slot)
{
    slots->row[slot] = 0;
    slots->id[slot] = slots->origin[slot] = -1;
    slots->parent[slot][0] = slots->parent[slot][1] = -1;
    slots->piece[slot] = -1;
    slots->level[slot] = 0;
}

void slots_take_node(MeshSlots *slots, int node)
{
    describe_node(slots, take(&slots->node, node));
}

void slots_free_node(MeshSlots *slots, int node)
{
    forget_node(slots, release(&slots->node, node));
}

void slots_put_face(MeshSlots *slots, int face, const int corner[3])
{
    int slot = slots->face.slot[face];
    if (slot < 0)
        slot = take(&slots->face, face);
    for (int k = 0; k < 3; k++)
        slots->triangle[slot][k] = slots->node.slot[corner[k]];
    slots->face_reserve = 0; // drawing has begun: the reserve is being used
}

void slots_free_face(MeshSlots *slots, int face)
{
    memset(slots->triangle[release(&slots->face, face)], 0, sizeof *slots->triangle);
}

void slots_restore(MeshSlots *slots)
{
    restore(&slots->node);
    restore(&slots->face);
    memset(slots->triangle, 0, (size_t)slots->face.capacity * sizeof *slots->triangle);
    for (int s = 0; s < slots->node.capacity; s++)
        if (slots->node.thing[s] >= 0)
            describe_node(slots, s);
        else
            forget_node(slots, s);
}

void slots_describe(const MeshSlots *slots, int topology, BodyMesh *mesh)
{
    *mesh = (BodyMesh){
        .topology = topology,
        .node_count = slots->node.high,
        .triangle_count = slots->face.high,
        .node_capacity = slots->node.capacity,
        .triangle_capacity = slots->face.capacity,
        .triangle = (const int(*)[3])slots->triangle,
        .id = slots->id,
        .origin = slots->origin,
        .parent = (const int(*)[2])slots->parent,
        .piece = slots->piece,
        .level = slots->level,
    };
}
