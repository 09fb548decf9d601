// SPDX-License-Identifier: MIT
#include "run/files_thread.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

// --- the step thread -----------------------------------------------------------------------------

size_t record_tools_bytes(Sim *sim)
{
    return sizeof(RecordFrame) + (size_t)sim_tool_count(sim) * sizeof(RecordTool);
}

size_t record_frame_bytes(Sim *sim)
{
    size_t bytes = record_tools_bytes(sim);
    for (int i = 0; i < sim_body_count(sim); i++)
        bytes += sizeof(RecordBody) + 3 * (size_t)mesh_most_rows(sim_body(sim, i)) * sizeof(float);
    return bytes;
}

// Returns the rest positions behind a mesh that is handed over; NULL: its colours need none.
static RestCopy *recorded_rest(const Body *body, const MeshCopy *mesh)
{
    return rest_is_wanted(body, false)
               ? (RestCopy *)((uintptr_t)mesh + mesh_copy_bytes(&body->mesh))
               : NULL;
}

RecordFrame *record_find_room(Exchange *exchange, Sim *sim)
{
    RecordFrame *frame = ring_back(&exchange->recorded);
    for (int i = 0; i < exchange->body_count && frame != NULL; i++) {
        const Body *body = sim_body(sim, i);
        // The file has this mesh already.
        if (exchange->recorded_topology[i] == body->mesh.topology)
            continue;
        // A mesh goes before the frames that need it, or the frame must wait, too.
        MeshCopy *mesh = ring_back(&exchange->recorded_mesh[i]);
        if (mesh == NULL)
            return NULL;
        mesh_copy_follow(mesh, &body->mesh);
        RestCopy *rest = recorded_rest(body, mesh);
        if (rest != NULL)
            rest_copy_follow(rest, body);
        ring_publish(&exchange->recorded_mesh[i]);
        exchange->recorded_topology[i] = body->mesh.topology;
    }
    return frame;
}

static void take_tool(RecordTool *tool, Sim *sim, int index)
{
    const ToolMotion *motion = sim_tool_motion(sim, index);
    const ToolWrench *wrench = sim_wrench(sim, index);
    tool->active = motion->active;
    tool->sample.orientation = motion->end_orientation;
    // The position where the bodies feel the tool; the hand is elsewhere while it pushes beyond
    // max_force.
    tool->sample.position = wrench->contact ? wrench->position : motion->end_position;
    tool->sample.force = wrench->force;
}

RecordBody *record_frame_begin(RecordFrame *frame, Sim *sim)
{
    int tools = sim_tool_count(sim);
    frame->step = sim_steps(sim);
    frame->time = sim_time(sim);
    for (int i = 0; i < tools; i++)
        take_tool(&frame->tool[i], sim, i);
    return (RecordBody *)(frame->tool + tools);
}

static RecordBody *next_body(const RecordBody *body)
{
    return (RecordBody *)(uintptr_t)(body->position + 3 * (size_t)body->row_count);
}

static void begin_body(RecordBody *to, const Body *body)
{
    to->topology = body->mesh.topology;
    to->node_count = body->mesh.node_count;
    to->row_count = mesh_rows(&body->mesh);
}

RecordBody *record_body(RecordBody *to, const Body *body, const float *position)
{
    begin_body(to, body);
    memcpy(to->position, position, 3 * (size_t)to->row_count * sizeof *position);
    return next_body(to);
}

void record_frame_take(RecordFrame *frame, Sim *sim)
{
    RecordBody *to = record_frame_begin(frame, sim);
    for (int i = 0; i < sim_body_count(sim); i++) {
        const Body *body = sim_body(sim, i);
        begin_body(to, body);
        mesh_snapshot(body, to->position, NULL);
        to = next_body(to);
    }
}

// --- meshes --------------------------------------------------------------------------------------

#define RESERVE(count, type, what)                                                                 \
    arena_allocate(arena, ARENA_OUTPUT, count, sizeof(type), "run/recorded %s of %s", what,        \
                   body->name)

static void reserve_nodes(RecorderMesh *to, const Body *body, Arena *arena)
{
    const BodyMesh *mesh = &body->mesh;
    if (mesh->fit.row_count == 0)
        return;
    to->node = RESERVE(3 * (size_t)mesh_most_nodes(body), float, "nodes");
    to->scratch = RESERVE((size_t)FIT_SCRATCH * (size_t)mesh->fit.row_capacity, double, "fit");
    if (mesh_changes(body))
        to->copy = (MeshCopy *)arena_allocate(arena, ARENA_OUTPUT, 1, mesh_copy_bytes(mesh),
                                              "run/recorded mesh of %s", body->name);
}

void recorder_reserve(Recorder *recorder, World *world)
{
    Arena *arena = &world->arena;
    int bodies = sim_body_count(world->sim);
    *recorder = (Recorder){
        .sim = world->sim, .tools_apart = recorder->tools_apart, .describe = recorder->describe};
    // Bodies whose mesh never changes need no memory of their own.
    recorder->mesh =
        arena_allocate(arena, ARENA_OUTPUT, (size_t)bodies, sizeof *recorder->mesh, "run/recorder");
    for (int i = 0; i < bodies; i++) {
        const Body *body = sim_body(world->sim, i);
        RecordingMesh *mesh = &recorder->mesh[i].mesh;
        reserve_nodes(&recorder->mesh[i], body, arena);
        recorder->mesh[i].look = recorder_look_reserve(body, arena);
        if (!mesh_changes(body))
            continue;
        // A changing one gets room for its largest mesh without free slots.
        size_t nodes = (size_t)body->mesh.node_capacity;
        size_t triangles = (size_t)body->mesh.triangle_capacity;
        mesh->live = RESERVE(nodes, int, "live");
        mesh->row = RESERVE(nodes, int, "rows");
#define RESERVE_ROWS(name, type, width, of, empty, sent, recorded)                                 \
    MESH_IF_RECORDED(recorded,                                                                     \
                     mesh->name = RESERVE(MESH_SLOTS_##of(nodes, triangles), type[width], #name);)
        MESH_COLUMNS(RESERVE_ROWS)
        mesh->live_triangle = RESERVE(triangles, int, "triangles");
        recorder->mesh[i].position = RESERVE(3 * nodes, float, "positions");
    }
}

void recorder_reserve_maps(Recorder *recorder, const Exchange *exchange, World *world)
{
    Arena *arena = &world->arena;
    for (int i = 0; i < exchange->body_count; i++) {
        const Body *body = sim_body(world->sim, i);
        RecorderMesh *mesh = &recorder->mesh[i];
        bool any = false;
        for (int kind = 0; kind < RECORDING_MAPS; kind++) {
            const Ring *ring = exchange->told_map[kind];
            any |= mesh->has_map[kind] = ring != NULL && ring[i].memory != NULL;
        }
        // Triangles are more than nodes, but for those of closed surfaces of a few.
        const size_t slots = (size_t)mesh_most_nodes(body) + (size_t)body->mesh.triangle_capacity;
        if (any)
            mesh->map = RESERVE(RECORDING_MAP_ROOM * slots, unsigned char, "maps");
    }
}

// Returns the mesh without its free slots.
static RecordingTopology compact(RecorderMesh *to, const BodyMesh *mesh)
{
    const RecordingSlots slots = {.topology = mesh->topology,
                                  .node_count = mesh->node_count,
                                  .triangle_count = mesh->triangle_count,
#define READ_ROWS(name, ...) .name = mesh->name,
                                  MESH_COLUMNS(READ_ROWS)};
    return recording_mesh_take(&to->mesh, &slots);
}

static RecordingTopology whole(const BodyMesh *mesh)
{
    return (RecordingTopology){.number = mesh->topology,
                               .node_count = mesh->node_count,
                               .triangle_count = mesh->triangle_count,
#define LATER_ROWS(name, type, width, of, empty, sent, recorded)                                   \
    MESH_IF_LATER(recorded, .node_##name = mesh->name, )
                               MESH_COLUMNS(LATER_ROWS).node_id = mesh->id,
                               .triangle = mesh->triangle};
}

// Writes the colours that a mesh adds.
static bool write_look(Recorder *recorder, int index, const BodyMesh *mesh, const RestCopy *rest)
{
    struct RecorderLook *to = recorder->mesh[index].look;
    if (to == NULL)
        return true;
    const RecordingLook look = recorder_look_take(to, sim_body(recorder->sim, index), mesh, rest);
    return recording_add_look(recorder->recording, index, &look);
}

bool recorder_follow_mesh(Recorder *recorder, int body, const BodyMesh *mesh, const RestCopy *rest)
{
    RecorderMesh *to = &recorder->mesh[body];
    if (to->mesh.live == NULL || to->mesh.topology == mesh->topology)
        return true;
    const RecordingTopology topology = compact(to, mesh);
    if (to->copy != NULL)
        mesh_copy_follow(to->copy, mesh);
    return recording_add_topology(recorder->recording, body, &topology) &&
           write_look(recorder, body, mesh, rest);
}

bool recorder_take_meshes(Recorder *recorder, Exchange *exchange, const RecordFrame *frame)
{
    const RecordBody *body = (const RecordBody *)(frame->tool + sim_tool_count(recorder->sim));
    bool ok = true;
    for (int i = 0; i < exchange->body_count; i++) {
        Ring *ring = &exchange->recorded_mesh[i];
        const RecordingMesh *mesh = &recorder->mesh[i].mesh;
        const MeshCopy *copy;
        // Meshes of dropped frames come first.
        while (mesh->live != NULL && mesh->topology != body->topology &&
               (copy = ring_peek(ring)) != NULL) {
            const BodyMesh view = mesh_copy_view(copy);
            if (view.topology == body->topology)
                ok &= recorder_follow_mesh(recorder, i, &view,
                                           recorded_rest(sim_body(recorder->sim, i), copy));
            ring_pop(ring);
        }
        ASSERT(mesh->live == NULL || mesh->topology == body->topology);
        body = next_body(body);
    }
    return ok;
}

static bool write_topologies(Recorder *recorder)
{
    bool ok = true;
    for (int i = 0; i < sim_body_count(recorder->sim) && ok; i++) {
        const BodyMesh *mesh = &sim_body(recorder->sim, i)->mesh;
        RecorderMesh *changing = &recorder->mesh[i];
        if (changing->copy != NULL)
            mesh_copy_follow(changing->copy, mesh);
        // The meshes that bodies begin with; the file has each before its first frame.
        const RecordingTopology topology =
            changing->mesh.live != NULL ? compact(changing, mesh) : whole(mesh);
        ok = recording_add_topology(recorder->recording, i, &topology) &&
             write_look(recorder, i, mesh, NULL);
    }
    return ok && recording_flush(recorder->recording);
}

// --- writing -------------------------------------------------------------------------------------

// Chunk size for HDF5: a whole frame; for a body that grows and shrinks, 48 kB.
static int kept_together(bool changes, int count, int capacity)
{
    enum { ROWS = 4096 };
    int rows = changes && count < ROWS ? ROWS : count;
    return rows < capacity ? rows : capacity;
}

bool recorder_create(Recorder *recorder, const char *path, World *world, const Scene *scene,
                     Status *status)
{
    Sim *sim = world->sim;
    int bodies = sim_body_count(sim), tools = sim_tool_count(sim);
    RecordingBody *body = calloc((size_t)bodies + 1, sizeof *body);
    int *tool = calloc((size_t)tools + 1, sizeof *tool);
    ASSERT(body != NULL && tool != NULL);
    // Offline nobody has reserved it before.
    if (recorder->mesh == NULL)
        recorder_reserve(recorder, world);
    // Describe the bodies, with chunk sizes, and the tools.
    for (int i = 0; i < bodies; i++) {
        const Body *from = sim_body(sim, i);
        const BodyMesh *mesh = &from->mesh;
        bool changes = mesh_changes(from);
        body[i] = (RecordingBody){
            .name = from->name,
            .nodes = kept_together(changes, mesh->node_count, mesh->node_capacity),
            .triangles = kept_together(changes, mesh->triangle_count, mesh->triangle_capacity),
            .first_wall = mesh->first_wall,
            .coloured = from->look != NULL};
        memcpy(body[i].has_map, recorder->mesh[i].has_map, sizeof body[i].has_map);
    }
    for (int i = 0; i < tools; i++)
        tool[i] = sim_tool(sim, i)->id;
    // The file with all its data sets, and the first mesh of each body.
    const RecordingOptions options = {.scene = scene->text,
                                      .describe = recorder->describe,
                                      .created_by = "pliantd " PLIANT_VERSION,
                                      .body_count = bodies,
                                      .tool_count = tools,
                                      .body = body,
                                      .tool = tool};
    recorder->recording = recording_create(path, &options, status);
    free(body);
    free(tool);
    if (recorder->recording == NULL)
        return false;
    return write_topologies(recorder) ||
           status_fail(status, STATUS_INVALID, "%s", recording_status(recorder->recording)->text);
}

// Returns the positions of all nodes.
static const float *nodes_of(const RecordFrame *frame, const RecordBody *from,
                             const RecorderMesh *mesh, const Body *body)
{
    if (mesh->node == NULL)
        return from->position;
    const BodyFit fit = mesh->copy != NULL ? mesh_copy_view(mesh->copy).fit : body->mesh.fit;
    fit_nodes(&fit, from->node_count, from->position, mesh->scratch, mesh->node);
    fit_fade(&fit, frame->step, from->position, mesh->node);
    return mesh->node;
}

// Returns the positions of live nodes.
static RecordingFrame frame_of(const RecordFrame *frame, const RecordBody *body,
                               const RecorderMesh *mesh, const Body *from)
{
    const float *node = nodes_of(frame, body, mesh, from);
    RecordingFrame out = {.step = frame->step,
                          .time = frame->time,
                          .topology = body->topology,
                          .node_count = body->node_count,
                          .position = node};
    if (mesh->mesh.live == NULL)
        return out;
    recording_mesh_positions(&mesh->mesh, node, mesh->position);
    out.node_count = mesh->mesh.live_count;
    out.position = mesh->position;
    return out;
}

bool recorder_write_tools(Recorder *recorder, const RecordFrame *frame)
{
    bool ok = true;
    for (int i = 0; i < sim_tool_count(recorder->sim) && ok; i++)
        if (frame->tool[i].active)
            ok = recording_add_tool(recorder->recording, i, frame->time, &frame->tool[i].sample);
    return ok;
}

bool recorder_write_frame(Recorder *recorder, const RecordFrame *frame)
{
    Recording *recording = recorder->recording;
    Sim *sim = recorder->sim;
    // Tools in the rows of frames, unless they have rows of their own.
    bool ok = recorder->tools_apart || recorder_write_tools(recorder, frame);
    const RecordBody *body = (const RecordBody *)(frame->tool + sim_tool_count(sim));
    for (int i = 0; i < sim_body_count(sim) && ok; i++) {
        const RecordingFrame of_body = frame_of(frame, body, &recorder->mesh[i], sim_body(sim, i));
        ok = recording_add_frame(recording, i, &of_body);
        body = next_body(body);
    }
    recorder->frames += ok;
    return ok;
}

// Returns a map as the bus handed it over, and its columns.
static RecordingMap map_of(RecordingMapKind kind, const void *told, const void *column[])
{
    if (kind == RECORDING_ERROR_MAP) {
        const ErrorMap *from = told;
        column[0] = from->share;
        return (RecordingMap){
            .step = from->step, .topology = from->topology, .count = from->node_count};
    }
    const ElementsOut *from = told;
    RecordingMap map = {
        .step = from->step, .topology = from->topology, .count = from->square_count};
    memcpy(map.elements, from->at_level, (size_t)from->levels * sizeof *map.elements);
    column[0] = from->tag;
    column[1] = elements_levels(from);
    return map;
}

bool recorder_take_maps(Recorder *recorder, Exchange *exchange, int64_t step, bool last)
{
    bool ok = true;
    for (int i = 0; i < exchange->body_count; i++)
        for (int kind = 0; kind < RECORDING_MAPS; kind++) {
            const RecorderMesh *mesh = &recorder->mesh[i];
            Ring *ring = mesh->has_map[kind] ? &exchange->told_map[kind][i] : NULL;
            const void *told, *column[RECORDING_MAP_COLUMNS];
            while (ring != NULL && (told = ring_peek(ring)) != NULL) {
                RecordingMap map = map_of(kind, told, column);
                const bool fits = mesh->mesh.live == NULL || mesh->mesh.topology == map.topology;
                if (map.step > step || (!fits && !last))
                    break;
                map.time = (double)map.step * sim_tick(recorder->sim);
                recording_mesh_map(&mesh->mesh, kind, &map, column, mesh->map);
                if (fits)
                    ok &= recording_add_map(recorder->recording, i, kind, &map, column);
                ring_pop(ring);
            }
        }
    return ok;
}

bool recorder_write_event(Recorder *recorder, const EventOut *event)
{
    RecordingEvent out = {.time = (double)event->step * sim_tick(recorder->sim),
                          .step = event->step};
    if (event->body >= 0)
        snprintf(out.body, sizeof out.body, "%s", sim_body(recorder->sim, event->body)->name);
    snprintf(out.kind, sizeof out.kind, "%s", event->kind);
    snprintf(out.text, sizeof out.text, "%s", event->text);
    return recording_add_event(recorder->recording, &out);
}

void recorder_set_dropped(Recorder *recorder, int64_t frames)
{
    const RecordingCounts counts = {.dropped = frames};
    for (int i = 0; i < sim_body_count(recorder->sim) && recorder->recording != NULL; i++)
        recording_set_counts(recorder->recording, i, &counts);
}

bool recorder_close(Recorder *recorder, Status *status)
{
    Recording *recording = recorder->recording;
    recorder->recording = NULL;
    return recording == NULL || recording_close(recording, status);
}
