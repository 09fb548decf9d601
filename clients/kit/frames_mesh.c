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
           chunk_count <= node_count + triangle_count;
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

// Frees the columns of anything that has them.
#define FREE_COLUMN(name, ...) free(of->name);

static void free_parts(MeshParts *of)
{
    MESH_COLUMNS(FREE_COLUMN)
}

static void free_change(MeshChange *of)
{
    MESH_COLUMNS(FREE_COLUMN)
}

static void free_mesh(MeshFrame *of)
{
    MESH_COLUMNS(FREE_COLUMN)
}

static void mesh_begin(MeshFrame *frame, const pliant_mesh_t *chunk)
{
    // Given up for a newer one, if it was not whole.
    MeshParts *next = &frame->next;
    frame->lost += next->started && !next->done;
    free_parts(next);
    // Memory for what it announces; the sizes were checked.
    const size_t nodes = (size_t)chunk->node_count, triangles = (size_t)chunk->triangle_count;
#define ALLOCATE_COLUMN(name, type, width, of, ...)                                                \
    next->name = frames_allocate((width)*MESH_SLOTS_##of(nodes, triangles), sizeof(type));
    MESH_COLUMNS(ALLOCATE_COLUMN)
    parts_begin(&next->nodes, chunk->node_count);
    parts_begin(&next->triangles, chunk->triangle_count);
    // What all its chunks must say alike.
    next->sequence = chunk->sequence;
    next->topology = chunk->topology;
    next->chunk_count = chunk->chunk_count;
    next->node_count = chunk->node_count;
    next->triangle_count = chunk->triangle_count;
    next->started = true;
    next->done = false;
}

// True if a chunk of a repeated mesh completes the one being assembled: on a link with much loss
// the missing chunks may come with the next copy. The same topology of the same daemon is the same
// mesh.
static bool mesh_goes_on(const MeshParts *next, const pliant_mesh_t *chunk)
{
    enum { MOST_AHEAD = 64, MOST_APART_US = 60000000 };
    int32_t ahead = (int32_t)((uint32_t)chunk->sequence - (uint32_t)next->sequence);
    return next->started && !next->done && ahead > 0 && ahead <= MOST_AHEAD &&
           chunk->topology == next->topology && chunk->chunk_count == next->chunk_count &&
           chunk->node_count == next->node_count && chunk->triangle_count == next->triangle_count &&
           chunk->utime >= next->utime &&
           (uint64_t)chunk->utime - (uint64_t)next->utime <= MOST_APART_US;
}

// Makes the assembled mesh the current one.
static void mesh_replace(MeshFrame *frame)
{
    MeshParts *next = &frame->next;
    // The arrays change their owner: nothing is copied.
    free_mesh(frame);
#define MOVE_COLUMN(name, ...)                                                                     \
    frame->name = next->name;                                                                      \
    next->name = NULL;
    MESH_COLUMNS(MOVE_COLUMN)
    // And what the mesh is.
    frame->utime = next->utime;
    frame->topology = next->topology;
    frame->node_count = next->node_count;
    frame->triangle_count = next->triangle_count;
    frame->whole = next->done = true;
}

// Copies to the element `at` of an array. The pointer to an empty array may be NULL, to which
// nothing may be added and which memcpy must not get.
static void copy(void *to, size_t at, const void *from, size_t count, size_t size)
{
    if (count > 0)
        memcpy((char *)to + at * size, from, count * size);
}

static FramesResult mesh_take(MeshFrame *frame, const pliant_mesh_t *chunk)
{
    MeshParts *next = &frame->next;
    if (!mesh_valid(chunk))
        return FRAMES_REFUSED;
    if (next->started &&
        // In order: another mesh begins, a contradiction, a repeat.
        frames_stale(chunk->sequence, chunk->utime, next->sequence, next->utime, STALE_MESHES))
        return FRAMES_STALE;
    if (mesh_goes_on(next, chunk))
        next->sequence = chunk->sequence;
    if (!next->started || chunk->sequence != next->sequence)
        mesh_begin(frame, chunk);
    else if (chunk->node_count != next->node_count ||
             chunk->triangle_count != next->triangle_count || chunk->topology != next->topology ||
             chunk->chunk_count != next->chunk_count)
        return FRAMES_REFUSED;
    else if (next->done)
        return FRAMES_STALE; // a repeated chunk must not change a completed mesh
    // Copy the chunk's share of triangles and nodes to where it belongs.
    next->utime = chunk->utime;
    const size_t node = (size_t)chunk->first_node, triangle = (size_t)chunk->first_triangle;
    const size_t nodes = (size_t)chunk->num_nodes, triangles = (size_t)chunk->num_indices / 3;
#define COPY_COLUMN(name, type, width, of, empty, sent, ...)                                       \
    MESH_IF_SENT(sent, copy(next->name, (width)*MESH_SLOTS_##of(node, triangle), chunk->name,      \
                            (width)*MESH_SLOTS_##of(nodes, triangles), sizeof(type));)
    MESH_COLUMNS(COPY_COLUMN)
    // The mesh is shown only when all of it has come.
    parts_mark(&next->triangles, chunk->first_triangle, chunk->num_indices / 3);
    parts_mark(&next->nodes, chunk->first_node, chunk->num_nodes);
    if (!parts_whole(&next->nodes) || !parts_whole(&next->triangles))
        return FRAMES_MORE;
    mesh_replace(frame);
    return FRAMES_WHOLE;
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

static void change_begin(MeshFrame *frame, const pliant_mesh_delta_t *chunk)
{
    MeshChange *change = &frame->change;
    // Given up for a newer one, if it was not whole.
    frame->lost += change->started && !change->done;
    parts_begin(&change->chunks, chunk->chunk_count);
    change->sequence = chunk->sequence;
    change->from_topology = chunk->from_topology;
    change->topology = chunk->topology;
    change->chunk_count = chunk->chunk_count;
    change->node_count = chunk->node_count;
    change->triangle_count = chunk->triangle_count;
    change->nodes = change->triangles = 0;
    change->started = true;
    change->done = false;
}

static void *grow(void *rows, size_t size, int capacity)
{
    rows = realloc(rows, size * (size_t)capacity);
    if (!rows)
        abort(); // the counts are bounded: the machine itself is out of memory
    return rows;
}

static void make_room(MeshChange *change, int nodes, int triangles)
{
#define GROW_COLUMN(name, type, width)                                                             \
    change->name = grow(change->name, (width) * sizeof(type), most);
#define GROW_NODES(name, type, width, of, ...) MESH_IF_NODE(of, GROW_COLUMN(name, type, width))
#define GROW_TRIANGLES(name, type, width, of, ...)                                                 \
    MESH_IF_TRIANGLE(of, GROW_COLUMN(name, type, width))
    if (nodes > change->node_capacity) {
        const int most = change->node_capacity = 2 * nodes;
        GROW_COLUMN(node_slot, int32_t, 1)
        MESH_COLUMNS(GROW_NODES)
    }
    if (triangles > change->triangle_capacity) {
        const int most = change->triangle_capacity = 2 * triangles;
        GROW_COLUMN(triangle_slot, int32_t, 1)
        MESH_COLUMNS(GROW_TRIANGLES)
    }
}

static void change_add(MeshChange *change, const pliant_mesh_delta_t *chunk)
{
    make_room(change, change->nodes + chunk->num_nodes, change->triangles + chunk->num_triangles);
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
}

// True if no remaining triangle uses a removed node.
static bool change_fits(const MeshFrame *frame)
{
    const MeshChange *change = &frame->change;
    if (change->node_count >= frame->node_count)
        return true;
    unsigned char *replaced = frames_allocate((size_t)change->triangle_count, 1);
    bool fits = true;
    for (int k = 0; k < change->triangles; k++)
        replaced[change->triangle_slot[k]] = 1;
    for (int t = 0; t < frame->triangle_count && t < change->triangle_count; t++)
        fits = fits && (replaced[t] ||
                        all_inside(frame->triangle + 3 * (size_t)t, 3, 0, change->node_count));
    free(replaced);
    return fits;
}

// Reallocates `old` rows to `count`.
static void *resize(void *rows, size_t size, int old, int count)
{
    if (old == count)
        return rows;
    void *more = frames_allocate((size_t)count, size);
    copy(more, 0, rows, (size_t)(old < count ? old : count), size);
    free(rows);
    return more;
}

static void change_apply(MeshFrame *frame)
{
    // Arrays of the new sizes; new slots are free until they are written.
    const MeshChange *change = &frame->change;
    int nodes = change->node_count, triangles = change->triangle_count;
    const int old_nodes = frame->node_count, old_triangles = frame->triangle_count;
#define RESIZE_COLUMN(name, type, width, of, empty, ...)                                           \
    frame->name =                                                                                  \
        resize(frame->name, (width) * sizeof(type), MESH_SLOTS_##of(old_nodes, old_triangles),     \
               MESH_SLOTS_##of(nodes, triangles));                                                 \
    for (int k = (width)*MESH_SLOTS_##of(old_nodes, old_triangles);                                \
         k < (width)*MESH_SLOTS_##of(nodes, triangles); k++)                                       \
        frame->name[k] = empty;
    MESH_COLUMNS(RESIZE_COLUMN)
    frame->node_count = nodes;
    frame->triangle_count = triangles;
    // Write the changed slots.
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
    frame->topology = change->topology;
    frame->utime = change->utime;
    // A whole mesh being assembled is older than this one.
    if (frame->next.started && !frame->next.done) {
        frame->lost++;
        frame->next.done = true;
    }
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
    if (!change->started || chunk->sequence != change->sequence)
        change_begin(frame, chunk);
    else if (chunk->from_topology != change->from_topology || chunk->topology != change->topology ||
             chunk->node_count != change->node_count ||
             chunk->triangle_count != change->triangle_count ||
             chunk->chunk_count != change->chunk_count)
        return FRAMES_REFUSED;
    else if (change->done || change->chunks.seen[chunk->chunk])
        return FRAMES_STALE;
    // Each slot changes once, so more than the mesh has is a contradiction.
    if (chunk->num_nodes > change->node_count - change->nodes ||
        chunk->num_triangles > change->triangle_count - change->triangles)
        return FRAMES_REFUSED;
    change_add(change, chunk);
    if (!parts_whole(&change->chunks))
        return FRAMES_MORE;
    change->done = true;
    // A complete delta applies only to the mesh that it starts from.
    if (!frame->whole || frame->topology != change->from_topology) {
        frame->missed++;
        return FRAMES_MISSED;
    }
    if (!change_fits(frame))
        return FRAMES_REFUSED;
    change_apply(frame);
    return FRAMES_WHOLE;
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
    free_parts(&frame->next);
    free(frame->next.nodes.seen);
    free(frame->next.triangles.seen);
    free(frame->change.chunks.seen);
    free(frame->change.node_slot);
    free(frame->change.triangle_slot);
    free_change(&frame->change);
    *frame = (MeshFrame){0};
}
