// SPDX-License-Identifier: MIT
// Assembles chunked meshes and applies their deltas. One thread.
#include "frames_parts.h"
#include "wire.h"

#include <stdlib.h>
#include <string.h>

#include "pliant_mesh_delta_t.h"
#include "pliant_mesh_t.h"

static bool counts_valid(int32_t node_count, int32_t triangle_count, int32_t chunk,
                         int32_t chunk_count)
{
    return node_count >= 1 && node_count <= FRAMES_NODES_MAX && triangle_count >= 0 &&
           triangle_count <= FRAMES_TRIANGLES_MAX && chunk >= 0 && chunk < chunk_count &&
           chunk_count <= node_count + triangle_count && chunk_count <= FRAMES_CHUNKS_MAX;
}

// True if all `count` numbers are in [low, high).
static bool all_inside(const int32_t *number, int32_t count, int32_t low, int32_t high)
{
    for (int k = 0; k < count; k++) {
        if (number[k] < low || number[k] >= high)
            return false;
    }
    return true;
}

// Bytes of the sent columns with so many rows.
static size_t bytes_of(size_t nodes, size_t triangles)
{
    size_t bytes = 0;
#define ADD_BYTES(name, type, width, of, ...)                                                      \
    bytes += (width)*MESH_SLOTS_##of(nodes, triangles) * sizeof(type);
    MESH_COLUMNS(ADD_BYTES)
    return bytes;
}

// Frees the columns of anything that has them.
#define FREE_COLUMN(name, ...) free(of->name);

static void free_mesh(MeshFrame *of)
{
    MESH_COLUMNS(FREE_COLUMN)
}

// Copies to the element `at` of an array. The pointers of an empty array may be NULL, to which
// nothing may be added and which memcpy must not get; without `from` there is nothing to copy.
static void copy(void *to, size_t at, const void *from, size_t count, size_t size)
{
    if (count > 0 && from)
        memcpy((char *)to + at * size, from, count * size);
}

// --- a change: rows that arrive, until they are complete ---

// Frees its rows. What it was remains, so that a repeated chunk is recognised.
static void change_end(MeshChange *of)
{
    MESH_COLUMNS(FREE_COLUMN)
    free(of->node_slot);
    free(of->triangle_slot);
    free(of->chunks.seen);
    frames_claim(&of->held, 0);
    *of = (MeshChange){.utime = of->utime,
                       .sequence = of->sequence,
                       .from_topology = of->from_topology,
                       .topology = of->topology,
                       .chunk_count = of->chunk_count,
                       .node_count = of->node_count,
                       .triangle_count = of->triangle_count,
                       .started = of->started,
                       .done = true};
}

// A chunk of a whole mesh or of a delta, in the latter's form.
typedef pliant_mesh_delta_t Chunk;

static bool change_begin(MeshFrame *frame, MeshChange *change, const Chunk *chunk)
{
    // Given up for a newer one, if it was not whole.
    frame->lost += change->started && !change->done;
    change_end(change);
    change->sequence = chunk->sequence;
    change->from_topology = chunk->from_topology;
    change->topology = chunk->topology;
    change->chunk_count = chunk->chunk_count;
    change->node_count = chunk->node_count;
    change->triangle_count = chunk->triangle_count;
    change->started = true;
    change->done = false;
    return parts_begin(&change->chunks, chunk->chunk_count);
}

static bool grow(void *rows, size_t size, int capacity)
{
    void **old = rows, *more = capacity > 0 ? realloc(*old, size * (size_t)capacity) : NULL;
    if (more)
        *old = more;
    return more || capacity == 0;
}

// Makes memory for so many rows; twice as many, so that rows are seldom moved.
static bool make_room(MeshChange *change, int nodes, int triangles)
{
    const int node_most = nodes > change->node_capacity ? 2 * nodes : change->node_capacity;
    const int triangle_most =
        triangles > change->triangle_capacity ? 2 * triangles : change->triangle_capacity;
    if (node_most == change->node_capacity && triangle_most == change->triangle_capacity)
        return true;
    const size_t slots = (size_t)node_most + (size_t)triangle_most;
    if (!frames_claim(&change->held,
                      bytes_of((size_t)node_most, (size_t)triangle_most) + slots * sizeof(int32_t)))
        return false;
    bool ok = grow(&change->node_slot, sizeof(int32_t), node_most) &&
              grow(&change->triangle_slot, sizeof(int32_t), triangle_most);
#define GROW_COLUMN(name, type, width, of, ...)                                                    \
    ok = ok &&                                                                                     \
         grow(&change->name, (width) * sizeof(type), MESH_SLOTS_##of(node_most, triangle_most));
    MESH_COLUMNS(GROW_COLUMN)
    change->node_capacity = node_most;
    change->triangle_capacity = triangle_most;
    return ok;
}

static bool change_add(MeshChange *change, const Chunk *chunk)
{
    if (!make_room(change, change->nodes + chunk->num_nodes,
                   change->triangles + chunk->num_triangles))
        return false;
    const size_t node = (size_t)change->nodes, triangle = (size_t)change->triangles;
    const size_t nodes = (size_t)chunk->num_nodes, triangles = (size_t)chunk->num_triangles;
    // Behind what came before: which slots, and their rows.
    copy(change->node_slot, node, chunk->node_slot, nodes, sizeof(int32_t));
    copy(change->triangle_slot, triangle, chunk->triangle_slot, triangles, sizeof(int32_t));
#define ADD_COLUMN(name, type, width, of, empty, sent, ...)                                        \
    MESH_IF_SENT(sent, copy(change->name, (width)*MESH_SLOTS_##of(node, triangle), chunk->name,    \
                            (width)*MESH_SLOTS_##of(nodes, triangles), sizeof(type));)
    MESH_COLUMNS(ADD_COLUMN)
    change->nodes += chunk->num_nodes;
    change->triangles += chunk->num_triangles;
    change->utime = chunk->utime;
    parts_mark(&change->chunks, chunk->chunk, 1);
    return true;
}

static bool change_agrees(const MeshChange *change, const Chunk *chunk)
{
    return chunk->from_topology == change->from_topology && chunk->topology == change->topology &&
           chunk->node_count == change->node_count &&
           chunk->triangle_count == change->triangle_count &&
           chunk->chunk_count == change->chunk_count;
}

// Takes one chunk. FRAMES_WHOLE: all have come.
static FramesResult change_take(MeshFrame *frame, MeshChange *change, const Chunk *chunk)
{
    bool ok = true;
    if (!change->started || chunk->sequence != change->sequence)
        ok = change_begin(frame, change, chunk);
    else if (!change_agrees(change, chunk))
        return FRAMES_REFUSED;
    else if (change->done || change->chunks.seen[chunk->chunk])
        return FRAMES_STALE; // a repeated chunk must not change what is complete
    // Each slot changes once, so more than the mesh has is a contradiction.
    if (ok && (chunk->num_nodes > change->node_count - change->nodes ||
               chunk->num_triangles > change->triangle_count - change->triangles))
        return FRAMES_REFUSED;
    if (!ok || !change_add(change, chunk)) {
        change_end(change); // no memory
        return FRAMES_REFUSED;
    }
    return parts_whole(&change->chunks) ? FRAMES_WHOLE : FRAMES_MORE;
}

// Makes the arrays of the mesh have so many slots; new ones are free until they are written. False
// if there is no memory, and then the mesh is as it was.
static bool mesh_resize(MeshFrame *frame, int nodes, int triangles)
{
    const int old_nodes = frame->node_count, old_triangles = frame->triangle_count;
    if (frame->whole && nodes == old_nodes && triangles == old_triangles)
        return true;
    MeshFrame sized = *frame;
    bool ok = frames_claim(&sized.held, bytes_of((size_t)nodes, (size_t)triangles));
#define ALLOCATE_COLUMN(name, type, width, of, ...)                                                \
    const size_t name##_count = (width) * (size_t)MESH_SLOTS_##of(nodes, triangles);               \
    sized.name = ok ? frames_allocate(name##_count, sizeof(type)) : NULL;                          \
    ok = ok && sized.name;
    MESH_COLUMNS(ALLOCATE_COLUMN)
    if (!ok) {
        free_mesh(&sized);
        frames_claim(&sized.held, frame->held);
        return false;
    }
#define FILL_COLUMN(name, type, width, of, empty, ...)                                             \
    const size_t name##_old = (width) * (size_t)MESH_SLOTS_##of(old_nodes, old_triangles);         \
    copy(sized.name, 0, frame->name, name##_old < name##_count ? name##_old : name##_count,        \
         sizeof(type));                                                                            \
    for (size_t k = name##_old; k < name##_count; k++)                                             \
        sized.name[k] = empty;
    MESH_COLUMNS(FILL_COLUMN)
    free_mesh(frame);
    *frame = sized;
    frame->node_count = nodes;
    frame->triangle_count = triangles;
    return true;
}

// Writes the slots that a complete change brings.
static void change_apply(MeshFrame *frame, const MeshChange *change)
{
#define WRITE_ROW(name, type, width)                                                               \
    memcpy(frame->name + (width) * (size_t)slot, change->name + (width) * (size_t)k,               \
           (width) * sizeof(type));
#define WRITE_NODE(name, type, width, of, empty, sent, ...)                                        \
    MESH_IF_SENT(sent, MESH_IF_NODE(of, WRITE_ROW(name, type, width)))
#define WRITE_TRIANGLE(name, type, width, of, empty, sent, ...)                                    \
    MESH_IF_SENT(sent, MESH_IF_TRIANGLE(of, WRITE_ROW(name, type, width)))
    for (int k = 0; k < change->nodes; k++) {
        const int slot = change->node_slot[k];
        MESH_COLUMNS(WRITE_NODE)
    }
    for (int k = 0; k < change->triangles; k++) {
        const int slot = change->triangle_slot[k];
        MESH_COLUMNS(WRITE_TRIANGLE)
    }
    frame->whole = true;
    frame->topology = change->topology;
    frame->utime = change->utime;
    // Memory for what was paid for by rows may be taken again without them.
    if (frame->most_nodes < frame->node_count)
        frame->most_nodes = frame->node_count;
    if (frame->most_triangles < frame->triangle_count)
        frame->most_triangles = frame->triangle_count;
}

// --- whole meshes ---

static bool mesh_valid(const pliant_mesh_t *chunk)
{
    return counts_valid(chunk->node_count, chunk->triangle_count, chunk->chunk,
                        chunk->chunk_count) &&
           chunk->num_indices % 3 == 0 && chunk->num_parents == 2 * (int64_t)chunk->num_nodes &&
           range_inside(chunk->first_triangle, chunk->num_indices / 3, chunk->triangle_count) &&
           range_inside(chunk->first_node, chunk->num_nodes, chunk->node_count) &&
           all_inside(chunk->triangle, chunk->num_indices, 0, chunk->node_count);
}

// True if a chunk of a repeated mesh completes the one being assembled: on a link with much loss
// the missing chunks may come with the next copy. The same topology of the same daemon is the same
// mesh.
static bool mesh_goes_on(const MeshChange *next, const pliant_mesh_t *chunk)
{
    enum { MOST_AHEAD = 64, MOST_APART_US = 60000000 };
    int32_t ahead = (int32_t)((uint32_t)chunk->sequence - (uint32_t)next->sequence);
    return next->started && !next->done && ahead > 0 && ahead <= MOST_AHEAD &&
           chunk->topology == next->topology && chunk->chunk_count == next->chunk_count &&
           chunk->node_count == next->node_count && chunk->triangle_count == next->triangle_count &&
           chunk->utime >= next->utime &&
           (uint64_t)chunk->utime - (uint64_t)next->utime <= MOST_APART_US;
}

// True if no slot occurs twice.
static bool all_differ(const int32_t *slot, int count)
{
    FramesParts slots = {0};
    bool differ = parts_begin(&slots, count);
    for (int k = 0; k < count && differ; k++)
        parts_mark(&slots, slot[k], 1);
    differ = differ && parts_whole(&slots);
    free(slots.seen);
    return differ;
}

// True if a change brings each slot once.
static bool change_brings_all(const MeshChange *change)
{
    return change->nodes == change->node_count && change->triangles == change->triangle_count &&
           all_differ(change->node_slot, change->nodes) &&
           all_differ(change->triangle_slot, change->triangles);
}

// `slot` may be NULL where nothing has come.
static void number_slots(int32_t *slot, int at, int first, int count)
{
    for (int k = 0; k < count; k++)
        slot[at + k] = first + k;
}

// Adds the rows of a chunk to the mesh being assembled.
static FramesResult mesh_take_rows(MeshFrame *frame, const pliant_mesh_t *chunk)
{
    MeshChange *next = &frame->next;
#define POINT_AT_COLUMN(name, type, width, of, empty, sent, ...)                                   \
    MESH_IF_SENT(sent, .name = chunk->name, )
    const Chunk rows = {.utime = chunk->utime,
                        .sequence = chunk->sequence,
                        .topology = chunk->topology,
                        .node_count = chunk->node_count,
                        .triangle_count = chunk->triangle_count,
                        .chunk = chunk->chunk,
                        .chunk_count = chunk->chunk_count,
                        .num_triangles = chunk->num_indices / 3,
                        .num_nodes = chunk->num_nodes,
                        MESH_COLUMNS(POINT_AT_COLUMN)};
    FramesResult result = change_take(frame, next, &rows);
    // Its slots follow from where it begins.
    if (result == FRAMES_MORE || result == FRAMES_WHOLE) {
        number_slots(next->node_slot, next->nodes - rows.num_nodes, chunk->first_node,
                     rows.num_nodes);
        number_slots(next->triangle_slot, next->triangles - rows.num_triangles,
                     chunk->first_triangle, rows.num_triangles);
    }
    return result;
}

static FramesResult mesh_take(MeshFrame *frame, const pliant_mesh_t *chunk)
{
    MeshChange *next = &frame->next;
    if (!mesh_valid(chunk))
        return FRAMES_REFUSED;
    if (next->started &&
        frames_stale(chunk->sequence, chunk->utime, next->sequence, next->utime, STALE_MESHES))
        return FRAMES_STALE;
    if (mesh_goes_on(next, chunk))
        next->sequence = chunk->sequence;
    FramesResult result = mesh_take_rows(frame, chunk);
    if (result == FRAMES_STALE && !next->done) { // had already, from an earlier sending
        next->utime = chunk->utime;
        return FRAMES_MORE;
    }
    // The mesh is shown only when all of it has come.
    if (result != FRAMES_WHOLE)
        return result;
    const bool ok =
        change_brings_all(next) && mesh_resize(frame, next->node_count, next->triangle_count);
    if (ok)
        change_apply(frame, next);
    change_end(next);
    return ok ? FRAMES_WHOLE : FRAMES_REFUSED;
}

FramesResult mesh_frame_add(MeshFrame *frame, const void *data, size_t size)
{
    pliant_mesh_t chunk;
    FramesResult result = FRAMES_REFUSED;
    if (wire_check(&WIRE_MESH, data, size) &&
        pliant_mesh_t_decode(data, 0, (int)size, &chunk) >= 0) {
        result = mesh_take(frame, &chunk);
        pliant_mesh_t_decode_cleanup(&chunk);
    }
    frame->refused += result == FRAMES_REFUSED;
    return result;
}

// --- deltas ---

static bool delta_valid(const pliant_mesh_delta_t *chunk)
{
    return counts_valid(chunk->node_count, chunk->triangle_count, chunk->chunk,
                        chunk->chunk_count) &&
           chunk->num_indices == 3 * (int64_t)chunk->num_triangles &&
           chunk->num_parents == 2 * (int64_t)chunk->num_nodes &&
           all_inside(chunk->triangle_slot, chunk->num_triangles, 0, chunk->triangle_count) &&
           all_inside(chunk->triangle, chunk->num_indices, 0, chunk->node_count) &&
           all_inside(chunk->node_slot, chunk->num_nodes, 0, chunk->node_count) &&
           all_inside(chunk->id, chunk->num_nodes, -1, INT32_MAX);
}

// True if the mesh grows by no more than the rows that came, or to what it was before: a delta of
// 200 bytes must not make its receiver take, and fill, the memory of the largest mesh.
static bool growth_is_paid(const MeshFrame *frame)
{
    const MeshChange *change = &frame->change;
    return (change->node_count <= frame->most_nodes ||
            change->node_count - frame->node_count <= change->nodes) &&
           (change->triangle_count <= frame->most_triangles ||
            change->triangle_count - frame->triangle_count <= change->triangles);
}

// True if no remaining triangle uses a removed node.
static bool change_fits(const MeshFrame *frame)
{
    const MeshChange *change = &frame->change;
    if (change->node_count >= frame->node_count)
        return true;
    unsigned char *replaced = frames_allocate((size_t)change->triangle_count, 1);
    bool fits = replaced != NULL;
    for (int k = 0; k < change->triangles && fits; k++)
        replaced[change->triangle_slot[k]] = 1;
    for (int t = 0; t < frame->triangle_count && t < change->triangle_count && fits; t++)
        fits = replaced[t] || all_inside(frame->triangle + 3 * (size_t)t, 3, 0, change->node_count);
    free(replaced);
    return fits;
}

// Applies a complete delta, but only to the mesh that it starts from.
static FramesResult delta_apply(MeshFrame *frame)
{
    const MeshChange *change = &frame->change;
    if (!frame->whole || frame->topology != change->from_topology) {
        frame->missed++;
        return FRAMES_MISSED;
    }
    if (!growth_is_paid(frame) || !change_fits(frame) ||
        !mesh_resize(frame, change->node_count, change->triangle_count))
        return FRAMES_REFUSED;
    change_apply(frame, change);
    // A whole mesh being assembled is older than this one.
    if (frame->next.started && !frame->next.done) {
        frame->lost++;
        change_end(&frame->next);
    }
    return FRAMES_WHOLE;
}

static FramesResult delta_take(MeshFrame *frame, const pliant_mesh_delta_t *chunk)
{
    MeshChange *change = &frame->change;
    // What contradicts itself or is old is refused.
    if (!delta_valid(chunk))
        return FRAMES_REFUSED;
    if (change->started &&
        frames_stale(chunk->sequence, chunk->utime, change->sequence, change->utime, STALE_FRAMES))
        return FRAMES_STALE;
    FramesResult result = change_take(frame, change, chunk);
    if (result != FRAMES_WHOLE)
        return result;
    result = delta_apply(frame);
    change_end(change);
    return result;
}

FramesResult mesh_frame_add_delta(MeshFrame *frame, const void *data, size_t size)
{
    pliant_mesh_delta_t chunk;
    FramesResult result = FRAMES_REFUSED;
    if (wire_check(&WIRE_MESH_DELTA, data, size) &&
        pliant_mesh_delta_t_decode(data, 0, (int)size, &chunk) >= 0) {
        result = delta_take(frame, &chunk);
        pliant_mesh_delta_t_decode_cleanup(&chunk);
    }
    frame->refused += result == FRAMES_REFUSED;
    return result;
}

void mesh_frame_destroy(MeshFrame *frame)
{
    free_mesh(frame);
    frames_claim(&frame->held, 0);
    change_end(&frame->next);
    change_end(&frame->change);
    *frame = (MeshFrame){0};
}
