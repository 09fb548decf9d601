// SPDX-License-Identifier: MIT
// Publishes frames, meshes and tools of a timeline. One thread.
#include "sender.h"

#include "base/check.h"
#include "base/sets.h"
#include "sending.h"

#include "pliant_contact_t.h"
#include "pliant_elements_t.h"
#include "pliant_error_map_t.h"
#include "pliant_look_t.h"
#include "pliant_mesh_t.h"
#include "pliant_nodes_t.h"
#include "pliant_tool_pose_t.h"
#include "pliant_walls_t.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void *allocate(int count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    ASSERT(memory != NULL);
    return memory;
}

void sender_create(Sender *sender, Client *client, Timeline *timeline)
{
    *sender = (Sender){.client = client, .timeline = timeline, .bodies = timeline_bodies(timeline)};
    sender->body = allocate(sender->bodies, sizeof *sender->body);
    client_channel(client, "TOOL_POSE", NULL, sender->pose_channel);
    client_channel(client, "CONTACT", NULL, sender->contact_channel);
    for (int i = 0; i < sender->bodies; i++) {
        SenderBody *body = &sender->body[i];
        const char *called = timeline_body(timeline, i);
        int nodes, triangles;
        timeline_most(timeline, i, &nodes, &triangles);
        body->at.frame = -1;
        body->position = allocate(nodes, 3 * sizeof *body->position);
#define ALLOCATE_ROWS(name, type, width, of, ...)                                                  \
    body->column.name = allocate(MESH_SLOTS_##of(nodes, triangles), sizeof *body->column.name);
        MESH_COLUMNS(ALLOCATE_ROWS)
        client_channel(client, "NODES", called, body->nodes_channel);
        client_channel(client, "MESH", called, body->mesh_channel);
        client_channel(client, "WALLS", called, body->walls_channel);
        client_channel(client, "LOOK", called, body->look_channel);
        for (int kind = 0; kind < RECORDING_MAPS; kind++) {
            static const char *const names[RECORDING_MAPS] = {"ERROR_MAP", "ELEMENTS"};
            client_channel(client, names[kind], called, body->map[kind].channel);
            body->map[kind].number = -1;
            body->map[kind].row = allocate(nodes + triangles, RECORDING_MAP_ROOM);
        }
        body->outside = allocate(nodes, 3);
        body->inside = allocate(nodes, 3);
    }
}

void sender_destroy(Sender *sender)
{
    for (int i = 0; i < sender->bodies; i++) {
        SenderBody *body = &sender->body[i];
        free(body->position);
        free(body->outside);
        free(body->inside);
        colours_destroy(&body->colours);
        for (int kind = 0; kind < RECORDING_MAPS; kind++)
            free(body->map[kind].row);
#define FREE_ROWS(name, ...) free(body->column.name);
        MESH_COLUMNS(FREE_ROWS)
    }
    free(sender->body);
    *sender = (Sender){0};
}

static void count(Sender *sender, int result)
{
    sender->failed += result != 0;
}

// --- what is shown -------------------------------------------------------------------------------

// Numbers the connected pieces of the mesh, which are not recorded.
static void find_pieces(SenderBody *body)
{
    const RecordingTopology *mesh = &body->mesh;
    union_find_reset(body->column.piece, mesh->node_count);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 1; k < 3; k++)
            union_find_join(body->column.piece, mesh->triangle[t][0], mesh->triangle[t][k]);
    body->pieces = union_find_number(body->column.piece, mesh->node_count);
}

static void start_mesh(SenderBody *body, bool repeats)
{
    body->look_chunks = body->colours.rows == 0 ? 0
                        : colours_vary(&body->colours)
                            ? chunks_of(body->mesh.node_count, NODES_IN_LOOK_CHUNK)
                            : 1;
    body->mesh_chunks =
        body->look_chunks + chunks_of_mesh(body->mesh.node_count, body->mesh.triangle_count);
    body->mesh_next = 0;
    body->mesh_sequence++;
    body->repeats = repeats;
}

static void start_nodes(SenderBody *body)
{
    body->nodes_chunks =
        body->frame.node_count > 0 ? chunks_of(body->frame.node_count, NODES_IN_CHUNK) : 0;
    body->nodes_next = 0;
}

// Finds the colours of the mesh's nodes.
static bool read_look(Sender *sender, int index, const TimelineFrame *at, Status *status)
{
    SenderBody *body = &sender->body[index];
    if (!colours_read(&body->colours, sender->timeline, at, index, status))
        return false;
    for (int i = 0; i < body->mesh.node_count && colours_vary(&body->colours); i++) {
        const unsigned char *colour =
            colours_of(&body->colours, body->mesh.node_id[i], body->mesh.number);
        memcpy(body->outside + 3L * i, colour, 3);
        memcpy(body->inside + 3L * i, colour + 3, 3);
    }
    return true;
}

static bool read_mesh(Sender *sender, int index, const TimelineFrame *at, Status *status)
{
    SenderBody *body = &sender->body[index];
    bool known;
    const MeshColumns *column = &body->column;
    if (!timeline_mesh(sender->timeline, at, index, column->id, column->triangle, &body->mesh,
                       status))
        return false;
    find_pieces(body);
    if (!timeline_nodes(sender->timeline, at, index, column, &known, status))
        return false;
    if (!known) {
        memcpy(column->origin, column->id, (size_t)body->mesh.node_count * sizeof *column->id);
        for (int i = 0; i < body->mesh.node_count; i++)
            column->parent[i][0] = column->parent[i][1] = column->id[i];
        memset(column->level, 0, (size_t)body->mesh.node_count * sizeof *column->level);
    }
    body->first_wall = timeline_first_wall(sender->timeline, at, index);
    return read_look(sender, index, at, status);
}

// Columns of a map in its memory: of triangles tags, and levels behind them.
static unsigned char *levels_of(const SenderMap *map)
{
    return map->row + sizeof(int16_t) * (size_t)map->map.count;
}

// Reads the maps that go with the frame shown, if they are of its mesh. Only pairs of triangles are
// squares.
static bool read_maps(Sender *sender, int index, const TimelineFrame *at, Status *status)
{
    SenderBody *body = &sender->body[index];
    for (int kind = 0; kind < RECORDING_MAPS; kind++) {
        SenderMap *to = &body->map[kind];
        const bool elements = kind == RECORDING_ELEMENTS;
        RecordingMap map;
        const int64_t found = timeline_find_map(sender->timeline, at, index, kind, &map);
        const int rows = elements ? body->mesh.triangle_count / 2 * 2 : body->mesh.node_count;
        if (found < 0 || map.topology != body->mesh.number || map.count != rows || rows == 0) {
            to->number = -1;
            to->next = to->chunks = 0;
            continue;
        }
        if (found == to->number && at->part == to->part)
            continue;
        to->number = -1;
        to->next = to->chunks = 0;
        to->map = map;
        void *const column[RECORDING_MAP_COLUMNS] = {to->row, levels_of(to)};
        if (!timeline_map_rows(sender->timeline, at, index, kind, found, column, status))
            return false;
        to->number = found;
        to->part = at->part;
        to->sequence++;
        to->chunks = chunks_of(rows, ROWS_IN_MAP_CHUNK);
    }
    return true;
}

static bool show_body(Sender *sender, int index, const TimelineFrame *at, Status *status)
{
    SenderBody *body = &sender->body[index];
    const RecordingFrame frame = timeline_frame(sender->timeline, at, index);
    // What is under way of the frame before is given up, since its memory is needed.
    body->nodes_next = body->nodes_chunks = 0;
    if (!timeline_positions(sender->timeline, at, index, body->position, status))
        return false;
    if (!body->has_mesh || body->mesh.number != frame.topology) {
        body->mesh_next = body->mesh_chunks = 0;
        body->has_mesh = false;
        if (!read_mesh(sender, index, at, status))
            return false;
        body->has_mesh = true;
        start_mesh(body, false);
    }
    if (!read_maps(sender, index, at, status))
        return false;
    body->at = *at;
    body->frame = frame;
    body->frame.position = body->position;
    body->nodes_sequence++;
    start_nodes(body);
    sender->frames++;
    return true;
}

bool sender_show(Sender *sender, double time, Status *status)
{
    for (int i = 0; i < sender->bodies; i++) {
        const SenderBody *body = &sender->body[i];
        const TimelineFrame at = timeline_find(sender->timeline, i, time);
        if (at.frame >= 0 && (at.frame != body->at.frame || at.part != body->at.part) &&
            !show_body(sender, i, &at, status))
            return false;
    }
    return true;
}

void sender_repeat(Sender *sender, bool frames)
{
    for (int i = 0; i < sender->bodies; i++) {
        SenderBody *body = &sender->body[i];
        if (body->has_mesh && body->mesh_next == body->mesh_chunks)
            start_mesh(body, true);
        if (frames && body->has_mesh && body->nodes_next == body->nodes_chunks)
            start_nodes(body);
        for (int kind = 0; kind < RECORDING_MAPS && frames; kind++) {
            SenderMap *map = &body->map[kind];
            if (map->number < 0 || map->next < map->chunks)
                continue;
            map->next = 0;
            map->chunks = chunks_of(map->map.count, ROWS_IN_MAP_CHUNK);
            map->sequence++;
        }
    }
}

int64_t sender_step(const Sender *sender, double *time)
{
    int64_t step = 0;
    *time = 0.0;
    for (int i = 0; i < sender->bodies; i++) {
        const SenderBody *body = &sender->body[i];
        if (body->at.frame < 0 || body->frame.step < step)
            continue;
        step = body->frame.step;
        *time = body->frame.time;
    }
    return step;
}

// --- chunks --------------------------------------------------------------------------------------

static void send_look_chunk(Sender *sender, SenderBody *body)
{
    const int chunk = body->mesh_next++, chunks = body->look_chunks;
    const bool vary = colours_vary(&body->colours);
    const int nodes = vary ? body->mesh.node_count : 0;
    const int first = chunk_begin(nodes, chunk, chunks);
    pliant_look_t look = {.utime = client_utime(),
                          .sequence = (int32_t)body->mesh_sequence,
                          .topology = body->mesh.number,
                          .node_count = body->mesh.node_count,
                          .chunk = chunk,
                          .chunk_count = chunks,
                          .texture = (char *)"",
                          .first = first,
                          .num_values = 3 * (chunk_begin(nodes, chunk + 1, chunks) - first),
                          .node_color = body->outside + 3L * first,
                          .node_inside = body->inside + 3L * first};
    memcpy(look.color, body->colours.own, 3);
    memcpy(look.inside, body->colours.own + 3, 3);
    count(sender, pliant_look_t_publish(sender->client->lcm, body->look_channel, &look));
}

static void send_mesh_chunk(Sender *sender, SenderBody *body)
{
    if (body->mesh_next < body->look_chunks) {
        send_look_chunk(sender, body);
        return;
    }
    const RecordingTopology *mesh = &body->mesh;
    const int chunk = body->mesh_next++ - body->look_chunks;
    const int chunks = body->mesh_chunks - body->look_chunks;
    const int triangle = chunk_begin(mesh->triangle_count, chunk, chunks);
    const int triangle_end = chunk_begin(mesh->triangle_count, chunk + 1, chunks);
    const int node = chunk_begin(mesh->node_count, chunk, chunks);
    const int node_end = chunk_begin(mesh->node_count, chunk + 1, chunks);
    if (chunk == 0 && body->first_wall > 0) {
        const pliant_walls_t walls = {.utime = client_utime(),
                                      .sequence = (int32_t)body->mesh_sequence,
                                      .topology = mesh->number,
                                      .first_wall = body->first_wall};
        count(sender, pliant_walls_t_publish(sender->client->lcm, body->walls_channel, &walls));
    }
#define POINT_AT_ROWS(name, type, width, of, empty, sent, ...)                                     \
    MESH_IF_SENT(sent, .name = (type *)(body->column.name + MESH_SLOTS_##of(node, triangle)), )
    const pliant_mesh_t message = {.utime = client_utime(),
                                   .sequence = (int32_t)body->mesh_sequence,
                                   .topology = mesh->number,
                                   .node_count = mesh->node_count,
                                   .triangle_count = mesh->triangle_count,
                                   .chunk = chunk,
                                   .chunk_count = chunks,
                                   .first_triangle = triangle,
                                   .num_indices = 3 * (triangle_end - triangle),
                                   .first_node = node,
                                   .num_nodes = node_end - node,
                                   .num_parents = 2 * (node_end - node),
                                   MESH_COLUMNS(POINT_AT_ROWS)};
    count(sender, pliant_mesh_t_publish(sender->client->lcm, body->mesh_channel, &message));
}

static void send_nodes_chunk(Sender *sender, SenderBody *body)
{
    const RecordingFrame *frame = &body->frame;
    const int chunk = body->nodes_next++, chunks = body->nodes_chunks;
    const int first = chunk_begin(frame->node_count, chunk, chunks);
    const int end = chunk_begin(frame->node_count, chunk + 1, chunks);
    const pliant_nodes_t message = {.utime = client_utime(),
                                    .sequence = (int32_t)body->nodes_sequence,
                                    .step = frame->step,
                                    .time = frame->time,
                                    .topology = frame->topology,
                                    .node_count = frame->node_count,
                                    .chunk = chunk,
                                    .chunk_count = chunks,
                                    .first = first,
                                    .num_values = 3 * (end - first),
                                    .position = body->position + 3L * first};
    count(sender, pliant_nodes_t_publish(sender->client->lcm, body->nodes_channel, &message));
}

// Elements of every second triangle: those of the squares, in place.
static void send_elements_chunk(Sender *sender, SenderMap *map)
{
    int16_t tag[ROWS_IN_MAP_CHUNK];
    uint8_t level[ROWS_IN_MAP_CHUNK];
    const int chunk = map->next++, squares = map->map.count / 2;
    const int first = chunk_begin(squares, chunk, map->chunks);
    const int end = chunk_begin(squares, chunk + 1, map->chunks);
    int levels = RECORDING_MAP_LEVELS;
    while (levels > 1 && map->map.elements[levels - 1] == 0)
        levels--;
    for (int i = first; i < end; i++) {
        memcpy(&tag[i - first], map->row + 2 * sizeof *tag * (size_t)i, sizeof *tag);
        level[i - first] = levels_of(map)[2 * (size_t)i];
    }
    const pliant_elements_t message = {.utime = client_utime(),
                                       .sequence = (int32_t)map->sequence,
                                       .step = map->map.step,
                                       .topology = map->map.topology,
                                       .square_count = squares,
                                       .chunk = chunk,
                                       .chunk_count = map->chunks,
                                       .first = first,
                                       .num_levels = levels,
                                       .num_squares = end - first,
                                       .elements = map->map.elements,
                                       .level = level,
                                       .tag = tag};
    count(sender, pliant_elements_t_publish(sender->client->lcm, map->channel, &message));
}

static void send_map_chunk(Sender *sender, SenderBody *body, RecordingMapKind kind)
{
    SenderMap *map = &body->map[kind];
    if (kind == RECORDING_ELEMENTS) {
        send_elements_chunk(sender, map);
        return;
    }
    const int chunk = map->next++, nodes = map->map.count;
    const int first = chunk_begin(nodes, chunk, map->chunks);
    const int end = chunk_begin(nodes, chunk + 1, map->chunks);
    const pliant_error_map_t message = {.utime = client_utime(),
                                        .sequence = (int32_t)map->sequence,
                                        .step = map->map.step,
                                        .topology = map->map.topology,
                                        .node_count = nodes,
                                        .chunk = chunk,
                                        .chunk_count = map->chunks,
                                        .first = first,
                                        .num_values = end - first,
                                        .share = map->row + first};
    count(sender, pliant_error_map_t_publish(sender->client->lcm, map->channel, &message));
}

void sender_send(Sender *sender, int64_t now_ns, int64_t interval_ns)
{
    if (now_ns < sender->due_ns)
        return;
    for (int i = 0; i < sender->bodies; i++) {
        SenderBody *body = &sender->body[i];
        const bool mesh = body->mesh_next < body->mesh_chunks;
        const bool nodes = body->nodes_next < body->nodes_chunks;
        int kind = 0;
        while (kind < RECORDING_MAPS && body->map[kind].next == body->map[kind].chunks)
            kind++;
        if (mesh && !(nodes && body->repeats))
            send_mesh_chunk(sender, body);
        else if (nodes)
            send_nodes_chunk(sender, body);
        else if (kind < RECORDING_MAPS)
            send_map_chunk(sender, body, kind);
        else
            continue;
        sender->due_ns = now_ns + interval_ns;
        return;
    }
}

int sender_waiting(const Sender *sender, bool with_repeats)
{
    int chunks = 0;
    for (int i = 0; i < sender->bodies; i++) {
        const SenderBody *body = &sender->body[i];
        chunks += body->nodes_chunks - body->nodes_next;
        for (int kind = 0; kind < RECORDING_MAPS; kind++)
            chunks += body->map[kind].chunks - body->map[kind].next;
        if (with_repeats || !body->repeats)
            chunks += body->mesh_chunks - body->mesh_next;
    }
    return chunks;
}

// --- tools ---------------------------------------------------------------------------------------

static void set3(double to[3], Vec3 from)
{
    memcpy(to, (const double[3]){from.x, from.y, from.z}, 3 * sizeof *to);
}

static void send_tool(Sender *sender, int id, const RecordingTool *sample, bool active)
{
    const Quat q = active ? sample->orientation : QUAT_NONE;
    pliant_tool_pose_t pose = {.utime = client_utime(),
                               .sender = sender->client->sender,
                               .sequence = (int32_t)++sender->pose_sequence,
                               .tool = id,
                               .orientation = {q.w, q.x, q.y, q.z},
                               .active = active};
    pliant_contact_t contact = {.utime = pose.utime,
                                .sequence = (int32_t)++sender->contact_sequence,
                                .tool = id,
                                .pose_utime = pose.utime,
                                // Over at once: a recorded force is for eyes, not for a hand.
                                .valid_until = pose.utime};
    contact.step = sender_step(sender, &contact.time);
    if (active) {
        set3(pose.position, sample->position);
        set3(contact.position, sample->position);
        set3(contact.force, sample->force);
        contact.contact =
            sample->force.x != 0.0 || sample->force.y != 0.0 || sample->force.z != 0.0;
    }
    count(sender, pliant_tool_pose_t_publish(sender->client->lcm, sender->pose_channel, &pose));
    count(sender, pliant_contact_t_publish(sender->client->lcm, sender->contact_channel, &contact));
}

bool sender_tools(Sender *sender, double time, Status *status)
{
    for (int i = 0; i < timeline_tools(sender->timeline); i++) {
        RecordingTool sample = {0};
        bool active;
        if (!timeline_tool(sender->timeline, i, time, &sample, &active, status))
            return false;
        if (active || sender->active[i])
            send_tool(sender, timeline_tool_id(sender->timeline, i), &sample, active);
        sender->active[i] = active;
    }
    return true;
}
