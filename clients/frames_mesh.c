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

static void free_parts(MeshParts *next)
{
    free(next->triangle);
    free(next->id);
    free(next->origin);
    free(next->parent);
    free(next->piece);
    free(next->level);
}

static void free_mesh(MeshFrame *frame)
{
    free(frame->triangle);
    free(frame->id);
    free(frame->origin);
    free(frame->parent);
    free(frame->piece);
    free(frame->level);
}

static void mesh_begin(MeshFrame *frame, const pliant_mesh_t *chunk)
{
    // Given up for a newer one, if it was not whole.
    MeshParts *next = &frame->next;
    frame->lost += next->started && !next->done;
    free_parts(next);
    // Memory for what it announces; the sizes were checked.
    size_t nodes = (size_t)chunk->node_count;
    next->triangle = frames_allocate(3 * (size_t)chunk->triangle_count, sizeof(int32_t));
    next->id = frames_allocate(nodes, sizeof(int32_t));
    next->origin = frames_allocate(nodes, sizeof(int32_t));
    next->parent = frames_allocate(2 * nodes, sizeof(int32_t));
    next->piece = frames_allocate(nodes, sizeof(int32_t));
    next->level = frames_allocate(nodes, sizeof(int8_t));
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
    frame->triangle = next->triangle;
    frame->id = next->id;
    frame->origin = next->origin;
    frame->parent = next->parent;
    frame->piece = next->piece;
    frame->level = next->level;
    next->triangle = next->id = next->origin = next->parent = next->piece = NULL;
    next->level = NULL;
    // And what the mesh is.
    frame->utime = next->utime;
    frame->topology = next->topology;
    frame->node_count = next->node_count;
    frame->triangle_count = next->triangle_count;
    frame->whole = next->done = true;
}

// An empty array's pointer may be NULL, which memcpy must not get.
static void copy(int32_t *to, const int32_t *from, int32_t count)
{
    if (count)
        memcpy(to, from, sizeof *to * (size_t)count);
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
    copy(next->triangle + 3 * (size_t)chunk->first_triangle, chunk->triangle, chunk->num_indices);
    copy(next->id + chunk->first_node, chunk->id, chunk->num_nodes);
    copy(next->origin + chunk->first_node, chunk->origin, chunk->num_nodes);
    copy(next->parent + 2 * (size_t)chunk->first_node, chunk->parent, chunk->num_parents);
    copy(next->piece + chunk->first_node, chunk->piece, chunk->num_nodes);
    if (chunk->num_nodes)
        memcpy(next->level + chunk->first_node, chunk->level, (size_t)chunk->num_nodes);
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

enum { NODE_COLUMNS = 7, TRIANGLE_COLUMNS = 4 };

static int32_t *make_room(int32_t *rows, int columns, int count, int *capacity)
{
    if (count <= *capacity)
        return rows;
    *capacity = 2 * count;
    rows = realloc(rows, sizeof *rows * (size_t)columns * (size_t)*capacity);
    if (!rows)
        abort(); // the counts are bounded: the machine itself is out of memory
    return rows;
}

static const int32_t *node_row(const MeshChange *change, int k)
{
    return change->node + NODE_COLUMNS * (size_t)k;
}

static const int32_t *triangle_row(const MeshChange *change, int k)
{
    return change->triangle + TRIANGLE_COLUMNS * (size_t)k;
}

static void change_add(MeshChange *change, const pliant_mesh_delta_t *chunk)
{
    // Nodes, one row each.
    change->node = make_room(change->node, NODE_COLUMNS, change->nodes + chunk->num_nodes,
                             &change->node_capacity);
    for (int k = 0; k < chunk->num_nodes; k++) {
        int32_t *row = change->node + NODE_COLUMNS * (size_t)change->nodes++;
        row[0] = chunk->node_slot[k];
        row[1] = chunk->id[k];
        row[2] = chunk->origin[k];
        row[3] = chunk->parent[2 * k];
        row[4] = chunk->parent[2 * k + 1];
        row[5] = chunk->piece[k];
        row[6] = chunk->level[k];
    }
    // Triangles, likewise.
    change->triangle =
        make_room(change->triangle, TRIANGLE_COLUMNS, change->triangles + chunk->num_triangles,
                  &change->triangle_capacity);
    for (int k = 0; k < chunk->num_triangles; k++) {
        int32_t *row = change->triangle + TRIANGLE_COLUMNS * (size_t)change->triangles++;
        row[0] = chunk->triangle_slot[k];
        memcpy(row + 1, chunk->triangle + 3 * k, 3 * sizeof *row);
    }
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
        replaced[triangle_row(change, k)[0]] = 1;
    for (int t = 0; t < frame->triangle_count && t < change->triangle_count; t++)
        fits = fits && (replaced[t] ||
                        all_inside(frame->triangle + 3 * (size_t)t, 3, 0, change->node_count));
    free(replaced);
    return fits;
}

// Reallocates `old` rows of `columns` numbers to `count`; fills new ones with `fill`.
static int32_t *resize(int32_t *rows, int columns, int old, int count, int32_t fill)
{
    if (old == count)
        return rows;
    size_t width = (size_t)columns;
    int32_t *more = frames_allocate(width * (size_t)count, sizeof *more);
    memcpy(more, rows, width * (size_t)(old < count ? old : count) * sizeof *more);
    for (size_t k = width * (size_t)old; k < width * (size_t)count; k++)
        more[k] = fill;
    free(rows);
    return more;
}

static int8_t *resize_levels(int8_t *level, int old, int count)
{
    if (old == count)
        return level;
    int8_t *more = frames_allocate((size_t)count, 1);
    memcpy(more, level, (size_t)(old < count ? old : count));
    free(level);
    return more;
}

static void change_apply(MeshFrame *frame)
{
    // Arrays of the new sizes; new slots are free until they are written.
    const MeshChange *change = &frame->change;
    int nodes = change->node_count, triangles = change->triangle_count;
    frame->id = resize(frame->id, 1, frame->node_count, nodes, -1);
    frame->origin = resize(frame->origin, 1, frame->node_count, nodes, -1);
    frame->parent = resize(frame->parent, 2, frame->node_count, nodes, -1);
    frame->piece = resize(frame->piece, 1, frame->node_count, nodes, 0);
    frame->level = resize_levels(frame->level, frame->node_count, nodes);
    frame->triangle = resize(frame->triangle, 3, frame->triangle_count, triangles, 0);
    frame->node_count = nodes;
    frame->triangle_count = triangles;
    // Write the changed slots.
    for (int k = 0; k < change->nodes; k++) {
        const int32_t *row = node_row(change, k);
        frame->id[row[0]] = row[1];
        frame->origin[row[0]] = row[2];
        memcpy(frame->parent + 2 * (size_t)row[0], row + 3, 2 * sizeof *row);
        frame->piece[row[0]] = row[5];
        frame->level[row[0]] = (int8_t)row[6];
    }
    for (int k = 0; k < change->triangles; k++) {
        const int32_t *row = triangle_row(change, k);
        memcpy(frame->triangle + 3 * (size_t)row[0], row + 1, 3 * sizeof *row);
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
    free(frame->change.node);
    free(frame->change.triangle);
    *frame = (MeshFrame){0};
}
