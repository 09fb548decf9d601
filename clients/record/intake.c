// SPDX-License-Identifier: MIT
#include "intake.h"

#include "client.h"
#include "wire.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "error_lines.h"
#include "ledger_lines.h"
#include "pliant_event_t.h"
#include "pliant_walls_t.h"

void intake_create(Intake *intake, const IntakeOptions *options, Queue *queue)
{
    *intake = (Intake){.options = *options, .queue = queue, .errors_step = -1};
    for (int i = 0; i < ITEM_BODIES; i++)
        intake->body[i].file_index = -1;
    for (int i = 0; i < ITEM_TOOLS; i++) {
        gather_restart(&intake->tool[i]);
        intake->tool_index[i] = -1;
    }
}

// --- tools and events ----------------------------------------------------------------------------

static void push_rows(Intake *intake, int tool)
{
    GatherRow row;
    if (!intake->open || intake->tool_index[tool] < 0)
        return;
    while (gather_next(&intake->tool[tool], intake->survey.tool[tool].is_static, &row))
        queue_push(intake->queue, item_tool(intake->tool_index[tool], row.time, &row.sample),
                   intake->options.when_full);
}

static void want_rows(Intake *intake, int64_t step)
{
    for (int t = 0; t < intake->survey.tool_count; t++) {
        gather_want(&intake->tool[t], step);
        push_rows(intake, t);
    }
}

static void take_contact(Intake *intake, const void *data, size_t size)
{
    GatherContact contact;
    int id;
    if (!gather_read_contact(data, size, &id, &contact)) {
        intake->survey.refused++;
        return;
    }
    // Contacts tell which tools there are.
    int tool = survey_add_tool(&intake->survey, id);
    if (tool < 0)
        return;
    gather_take_contact(&intake->tool[tool], &contact);
    push_rows(intake, tool);
}

static void take_pose(Intake *intake, const void *data, size_t size)
{
    GatherPose pose;
    int id;
    // The daemon refuses invalid messages of others.
    if (!gather_read_pose(data, size, &id, &pose))
        return;
    int tool = survey_find_tool(&intake->survey, id);
    if (tool >= 0)
        gather_take_pose(&intake->tool[tool], &pose);
}

// Simulated time of a tick [s]: messages of events and maps have their step alone.
static double time_of(const Intake *intake, int64_t step)
{
    const double rate = intake->survey.rate_hz;
    return rate > 0.0 ? (double)step * (1.0 / rate) : 0.0;
}

static void push_event(Intake *intake, const RecordingEvent *event)
{
    if (!queue_push(intake->queue, item_event(event), intake->options.when_full))
        intake->events_lost++;
}

static void take_event(Intake *intake, const void *data, size_t size)
{
    pliant_event_t message;
    if (!wire_check(&WIRE_EVENT, data, size) ||
        pliant_event_t_decode(data, 0, (int)size, &message) < 0) {
        intake->survey.refused++;
        return;
    }
    RecordingEvent event = {.time = time_of(intake, message.step), .step = message.step};
    snprintf(event.body, sizeof event.body, "%s", message.body);
    snprintf(event.kind, sizeof event.kind, "%s", message.kind);
    snprintf(event.text, sizeof event.text, "%s", message.text);
    pliant_event_t_decode_cleanup(&message);
    // Before a file is there they wait, some of them.
    if (intake->open)
        push_event(intake, &event);
    else if (intake->events_waiting < INTAKE_EVENTS_WAITING)
        intake->event[intake->events_waiting++] = event;
    else
        intake->events_lost++;
}

static void push_ledger(Intake *intake)
{
    if (intake->open && intake->ledger_count > 0)
        queue_push(intake->queue,
                   item_lines(RECORDING_LEDGERS, intake->ledger, intake->ledger_count),
                   intake->options.when_full);
}

// The file gets a ledger once, however often the server repeats it.
static void take_ledger(Intake *intake, const void *data, size_t size)
{
    pliant_ledger_t message;
    RecordingLedger line[LEDGER_LINES];
    if (!wire_check(&WIRE_LEDGER, data, size) ||
        pliant_ledger_t_decode(data, 0, (int)size, &message) < 0) {
        intake->survey.refused++;
        return;
    }
    const int count = ledger_lines(&message, line);
    pliant_ledger_t_decode_cleanup(&message);
    const size_t bytes = (size_t)count * sizeof *line;
    if (count == intake->ledger_count && memcmp(line, intake->ledger, bytes) == 0)
        return;
    memcpy(intake->ledger, line, bytes);
    intake->ledger_count = count;
    push_ledger(intake);
}

static void take_errors(Intake *intake, const void *data, size_t size)
{
    pliant_error_t message;
    RecordingLedger line[ERRORS_LINES];
    if (!wire_check(&WIRE_ERROR, data, size) ||
        pliant_error_t_decode(data, 0, (int)size, &message) < 0) {
        intake->survey.refused++;
        return;
    }
    const int count = error_lines(&message, line);
    pliant_error_t_decode_cleanup(&message);
    // A server sends the last ones again to who asks.
    if (count == 0 || !intake->open || line->step == intake->errors_step)
        return;
    intake->errors_step = line->step;
    queue_push(intake->queue, item_lines(RECORDING_ERRORS, line, count), intake->options.when_full);
}

// --- meshes --------------------------------------------------------------------------------------

// True if no live triangle uses a free node.
static bool mesh_is_valid(const MeshFrame *mesh)
{
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int32_t *corner = mesh->triangle + 3 * (size_t)t;
        bool free = corner[0] == corner[1];
        for (int k = 0; k < 3 && !free; k++) {
            if (mesh->id[corner[k]] < 0)
                return false;
        }
    }
    return true;
}

static void *grow(void *array, int count, size_t size)
{
    array = realloc(array, (size_t)count * size);
    if (!array)
        abort(); // the counts are bounded: the machine itself is out of memory
    return array;
}

static void make_room(IntakeBody *body)
{
    RecordingMesh *map = &body->map;
    // Memory grows with the mesh and never shrinks.
    if (body->mesh.node_count > body->node_capacity) {
        body->node_capacity = body->mesh.node_count;
        map->live = grow(map->live, body->node_capacity, sizeof *map->live);
        map->row = grow(map->row, body->node_capacity, sizeof *map->row);
#define GROW(name) map->name = grow(map->name, body->node_capacity, sizeof *map->name);
#define GROW_NODES(name, type, width, of, empty, sent, recorded)                                   \
    MESH_IF_RECORDED(recorded, MESH_IF_NODE(of, GROW(name)))
        MESH_COLUMNS(GROW_NODES)
    }
    if (body->mesh.triangle_count > body->triangle_capacity) {
        body->triangle_capacity = body->mesh.triangle_count;
        map->triangle = grow(map->triangle, body->triangle_capacity, sizeof *map->triangle);
        map->live_triangle =
            grow(map->live_triangle, body->triangle_capacity, sizeof *map->live_triangle);
    }
}

static void map_mesh(IntakeBody *body)
{
    const MeshFrame *mesh = &body->mesh;
    const RecordingSlots slots = {.topology = mesh->topology,
                                  .node_count = mesh->node_count,
                                  .triangle_count = mesh->triangle_count,
#define READ_ROWS(name, ...) .name = (void *)mesh->name,
                                  MESH_COLUMNS(READ_ROWS)};
    make_room(body);
    body->slots = mesh->node_count;
    body->triangle_slots = mesh->triangle_count;
    body->topology = recording_mesh_take(&body->map, &slots);
    body->mapped = true;
}

// --- colours -------------------------------------------------------------------------------------

static void make_colour_room(IntakeBody *body, int count)
{
    RecordingColours *to = &body->colours;
    if (to->id && count <= body->colour_capacity)
        return;
    body->colour_capacity = count;
    to->known_id = grow(to->known_id, count + 1, sizeof *to->known_id);
    to->known = grow(to->known, count + 1, sizeof *to->known);
    to->id = grow(to->id, count + 1, sizeof *to->id);
    to->colour = grow(to->colour, count + 1, sizeof *to->colour);
}

// Hands over what a look adds to the file, once the mesh that it is of is there.
static void push_look(Intake *intake, IntakeBody *body)
{
    const LookFrame *look = &body->look;
    const MeshFrame *mesh = &body->mesh;
    if (!intake->open || body->file_index < 0 || !look->head.whole ||
        (look->varies && (!mesh->whole || mesh->topology != look->head.topology ||
                          mesh->node_count != look->head.count)))
        return;
    const int nodes = look->varies ? look->head.count : 0;
    unsigned char own[RECORDING_COLOURS];
    memcpy(own, look->color, 3);
    memcpy(own + 3, look->wall, 3);
    make_colour_room(body, nodes);
    const RecordingLook rows =
        recording_colours_take(&body->colours, look->head.topology, own, nodes, mesh->id,
                               (const unsigned char(*)[3])(const void *)look->outside,
                               (const unsigned char(*)[3])(const void *)look->inside);
    if (rows.count > 0 &&
        !queue_push(intake->queue, item_look(body->file_index, &rows), intake->options.when_full)) {
        // The next look brings all again.
        body->colours.slots = 0;
        body->colours.begun = false;
    }
}

static void take_look(Intake *intake, IntakeBody *body, const void *data, size_t size)
{
    if (intake->options.survey_only)
        return;
    body->look.head.mesh_nodes = body->mesh.most_nodes;
    if (look_frame_add(&body->look, data, size) == FRAMES_WHOLE)
        push_look(intake, body);
}

// --- maps ----------------------------------------------------------------------------------------

// Hands the newest map of a kind over once the mesh that it is of is in the file; a repeated one
// never.
static void push_map(Intake *intake, IntakeBody *body, RecordingMapKind kind)
{
    const bool elements = kind == RECORDING_ELEMENTS;
    const FrameHead *head = elements ? &body->elements.head : &body->error_map.head;
    const void *column[RECORDING_MAP_COLUMNS] = {elements ? (const void *)body->elements.tag
                                                          : body->error_map.share,
                                                 elements ? body->elements.level : NULL};
    RecordingMap map = {.step = elements ? body->elements.step : body->error_map.step,
                        .topology = head->topology,
                        .count = head->count};
    if (!intake->open || body->file_index < 0 || !head->whole || !body->mapped ||
        body->told != map.topology || body->map.topology != map.topology ||
        map.count != (elements ? body->triangle_slots / 2 : body->slots) ||
        map.step <= body->map_step[kind])
        return;
    map.time = time_of(intake, map.step);
    if (elements)
        memcpy(map.elements, body->elements.at_level,
               (size_t)body->elements.level_count * sizeof *map.elements);
    const size_t slots = (size_t)body->slots + (size_t)body->triangle_slots;
    body->map_room = realloc(body->map_room, RECORDING_MAP_ROOM * slots);
    if (!body->map_room)
        abort(); // bounded as the mesh is
    recording_mesh_map(&body->map, kind, &map, column, body->map_room);
    const size_t bytes = (size_t)map.count * (elements ? sizeof(int16_t) + 1 : 1);
    if (queue_push(intake->queue, item_map(body->file_index, kind, &map, column, bytes),
                   intake->options.when_full))
        body->map_step[kind] = map.step;
}

static void push_maps(Intake *intake, IntakeBody *body)
{
    for (int kind = 0; kind < RECORDING_MAPS; kind++)
        push_map(intake, body, kind);
}

static void take_map(Intake *intake, IntakeBody *body, RecordingMapKind kind, const void *data,
                     size_t size)
{
    if (intake->options.survey_only)
        return;
    FrameHead *head = kind == RECORDING_ELEMENTS ? &body->elements.head : &body->error_map.head;
    head->mesh_nodes = body->mesh.most_nodes;
    if ((kind == RECORDING_ELEMENTS
             ? elements_frame_add(&body->elements, data, size)
             : error_map_frame_add(&body->error_map, data, size)) == FRAMES_WHOLE)
        push_map(intake, body, kind);
}

// --- frames --------------------------------------------------------------------------------------

static bool fits(const IntakeBody *body, const RecordingFrame *frame)
{
    return body->mapped && body->map.topology == frame->topology &&
           body->slots == frame->node_count;
}

// Hands a frame to the writer, after its mesh if that is new.
static void push_frame(Intake *intake, IntakeBody *body, const RecordingFrame *frame)
{
    Queue *queue = intake->queue;
    QueueWhenFull when_full = intake->options.when_full;
    bool ok = true;
    // A topology precedes its first frame.
    if (body->told != body->map.topology) {
        ok = queue_push(queue, item_topology(body->file_index, &body->topology), when_full);
        if (ok) {
            body->told = body->topology.number;
            push_maps(intake, body);
        }
    }
    // A frame without room is dropped and counted; others still fit.
    ok = ok && queue_push(queue, item_frame(body->file_index, frame, &body->map), when_full);
    if (ok)
        want_rows(intake, frame->step);
    else
        body->counts.dropped++;
}

static const WaitingFrame *last_that_fits(const IntakeBody *body)
{
    const WaitingFrame *last = NULL;
    for (const WaitingFrame *frame = body->waiting.first; frame; frame = frame->next)
        last = fits(body, &frame->frame) ? frame : last;
    return last;
}

// Writes the frames that waited for the current mesh; earlier ones have lost theirs.
static void push_waiting_frames(Intake *intake, IntakeBody *body)
{
    if (!intake->open || body->file_index < 0)
        return;
    // Up to the last frame that the mesh fits; those before it have lost theirs.
    const WaitingFrame *last = last_that_fits(body);
    WaitingFrame *frame = NULL;
    while (last && frame != last) {
        free(frame);
        frame = waiting_pop(&body->waiting);
        if (fits(body, &frame->frame))
            push_frame(intake, body, &frame->frame);
        else
            body->counts.without_mesh++;
    }
    free(frame);
    intake->wants_mesh |= body->waiting.first != NULL;
}

static bool is_due(const Intake *intake, const IntakeBody *body, double time)
{
    double hz = intake->options.hz;
    // On a grid of 1/hz, so that the mean rate is exact; the tolerance absorbs the rounding of a
    // tick.
    return hz <= 0.0 || !body->taken || floor(time * hz + 1e-6) > floor(body->time * hz + 1e-6);
}

static void take_frame(Intake *intake, IntakeBody *body)
{
    const NodesFrame *nodes = &body->nodes;
    bool left_out = intake->open && body->file_index < 0;
    if (left_out || !is_due(intake, body, nodes->time))
        return;
    // The file's rate counts from this frame.
    body->taken = true;
    body->time = nodes->time;
    const RecordingFrame frame = {.step = nodes->step,
                                  .time = nodes->time,
                                  .topology = nodes->head.topology,
                                  .node_count = nodes->head.count,
                                  .position = nodes->position};
    // Straight to the file if nothing waits before it.
    if (intake->open && body->file_index >= 0 && !body->waiting.first && fits(body, &frame)) {
        push_frame(intake, body, &frame);
        return;
    }
    // Else it waits for its mesh, or for the file.
    body->counts.without_mesh += waiting_push(&body->waiting, &frame);
    push_waiting_frames(intake, body);
}

// --- another run ---------------------------------------------------------------------------------

static int64_t refused(const IntakeBody *body)
{
    return body->nodes.head.refused + body->mesh.refused + body->mesh_refused +
           body->look.head.refused + body->error_map.head.refused + body->elements.head.refused;
}

static void forget(IntakeBody *body)
{
    waiting_drop(&body->waiting);
    body->mesh_refused += body->mesh.refused + body->look.head.refused +
                          body->error_map.head.refused + body->elements.head.refused;
    mesh_frame_destroy(&body->mesh);
    look_frame_destroy(&body->look);
    error_map_frame_destroy(&body->error_map);
    elements_frame_destroy(&body->elements);
    body->mapped = body->any = body->taken = false;
    body->told = 0;
    body->file_index = -1;
}

// Handles a restart of the daemon: meshes and time start over, and so does the recording.
static void restart(Intake *intake)
{
    intake_end(intake);
    intake->restarts++;
    intake->ledger_count = 0;
    intake->errors_step = -1;
    for (int i = 0; i < intake->survey.body_count; i++)
        forget(&intake->body[i]);
    for (int i = 0; i < ITEM_TOOLS; i++)
        gather_restart(&intake->tool[i]);
    if (intake->options.when_full != QUEUE_WAIT) // in a log all is known already
        survey_restart(&intake->survey);
    intake->wants_mesh = true;
}

static int32_t frames_ahead(const IntakeBody *body)
{
    return (int32_t)((uint32_t)body->nodes.head.sequence - (uint32_t)body->sequence);
}

static bool is_another_run(const IntakeBody *body)
{
    return body->any && (frames_ahead(body) <= 0 || body->nodes.step < body->step);
}

static void take_nodes(Intake *intake, int index, const void *data, size_t size)
{
    IntakeBody *body = &intake->body[index];
    const NodesFrame *nodes = &body->nodes;
    // This body is alive.
    intake->survey.body[index].seen = true;
    if (intake->options.survey_only)
        return;
    body->nodes.head.mesh_nodes = body->mesh.most_nodes;
    if (nodes_frame_add(&body->nodes, data, size) != FRAMES_WHOLE)
        return;
    // Steps that go back mean another daemon.
    if (is_another_run(body)) {
        restart(intake);
        intake->survey.body[index].seen = true;
    }
    // Sequence numbers tell what got lost.
    if (body->any)
        body->counts.lost += frames_ahead(body) - 1;
    bool repeated = body->any && nodes->step == body->step; // a paused daemon may repeat it
    body->any = true;
    body->sequence = nodes->head.sequence;
    body->step = nodes->step;
    if (!repeated)
        take_frame(intake, body);
}

static void take_mesh(Intake *intake, int index, bool is_delta, const void *data, size_t size)
{
    IntakeBody *body = &intake->body[index];
    MeshFrame *mesh = &body->mesh;
    if (!is_delta)
        survey_take_mesh(&intake->survey, index, data, size);
    if (intake->options.survey_only)
        return;
    // Deltas change the mesh that is there; whole ones replace it.
    FramesResult result =
        is_delta ? mesh_frame_add_delta(mesh, data, size) : mesh_frame_add(mesh, data, size);
    intake->wants_mesh |= result == FRAMES_MISSED;
    intake->mesh_chunks += !is_delta;
    if (result != FRAMES_WHOLE)
        return;
    bool same = body->mapped && body->map.topology == mesh->topology;
    if (same && body->slots == mesh->node_count && body->triangle_slots == mesh->triangle_count)
        return; // a repeat
    // Numbers only grow, except that 1 follows INT32_MAX, and one number means one mesh.
    const bool old = mesh->topology < body->told && body->told - mesh->topology <= INT32_MAX / 2;
    if (same || old || !mesh_is_valid(mesh)) {
        body->mesh_refused++;
        return;
    }
    // Frames that waited for this mesh can go.
    map_mesh(body);
    push_look(intake, body);
    push_waiting_frames(intake, body);
}

// Takes a description, which has the list of tools in its own order.
static void take_reply(Intake *intake, const void *data, size_t size)
{
    bool described = intake->survey.described != NULL;
    survey_take_reply(&intake->survey, data, size);
    for (int i = 0; i < ITEM_TOOLS && !described && intake->survey.described && !intake->open; i++)
        gather_restart(&intake->tool[i]);
}

// --- messages ------------------------------------------------------------------------------------

// Returns the part after "<prefix>_", or NULL.
static const char *behind(const char *channel, const char *prefix)
{
    size_t length = strlen(prefix);
    return strncmp(channel, prefix, length) == 0 && channel[length] == '_' ? channel + length + 1
                                                                           : NULL;
}

static const char *behind_head(const char *name, const char *head)
{
    size_t length = strlen(head);
    return strncmp(name, head, length) == 0 ? name + length : NULL;
}

static int find_body(Intake *intake, const char *name)
{
    return name ? survey_find_body(&intake->survey, name) : -1;
}

static void take_walls(SurveyBody *body, const void *data, size_t size)
{
    pliant_walls_t walls;
    if (wire_check(&WIRE_WALLS, data, size) &&
        pliant_walls_t_decode(data, 0, (int)size, &walls) >= 0 && walls.first_wall >= 0)
        body->first_wall = walls.first_wall;
}

static void take_of_body(Intake *intake, const char *name, const void *data, size_t size)
{
    // Which of its streams, by the channel's name; a delta's begins as a mesh's.
    enum { NODES, POINTS, LOOK, ERRORS, ELEMENTS, WALLS, DELTA, MESH, STREAMS };
    static const char *const heads[STREAMS] = {"NODES_",    "POINTS_", "LOOK_",       "ERROR_MAP_",
                                               "ELEMENTS_", "WALLS_",  "MESH_DELTA_", "MESH_"};
    int body = -1, stream = 0;
    while (stream < STREAMS && (body = find_body(intake, behind_head(name, heads[stream]))) < 0)
        stream++;
    switch (stream) {
    case NODES:
    case POINTS:
        take_nodes(intake, body, data, size);
        break;
    case LOOK:
        take_look(intake, &intake->body[body], data, size);
        break;
    case ERRORS:
        take_map(intake, &intake->body[body], RECORDING_ERROR_MAP, data, size);
        break;
    case ELEMENTS:
        take_map(intake, &intake->body[body], RECORDING_ELEMENTS, data, size);
        break;
    case WALLS:
        take_walls(&intake->survey.body[body], data, size);
        break;
    case DELTA:
    case MESH:
        take_mesh(intake, body, stream == DELTA, data, size);
        break;
    default:
        break;
    }
}

void intake_take(Intake *intake, const char *channel, const void *data, size_t size)
{
    // Poses come on the daemon's input prefix, the rest on the other.
    const char *name = behind(channel, intake->options.input_prefix);
    if (name && strcmp(name, "TOOL_POSE") == 0) {
        take_pose(intake, data, size);
        return;
    }
    name = behind(channel, intake->options.prefix);
    if (!name)
        return;
    // Those of the daemon itself, else one of a body.
    if (strcmp(name, "CONTACT") == 0)
        take_contact(intake, data, size);
    else if (strcmp(name, "EVENT") == 0)
        take_event(intake, data, size);
    else if (strcmp(name, "LEDGER") == 0)
        take_ledger(intake, data, size);
    else if (strcmp(name, "ERROR") == 0)
        take_errors(intake, data, size);
    else if (strcmp(name, "STATUS") == 0)
        survey_take_status(&intake->survey, data, size);
    else if (strcmp(name, "REPLY") == 0)
        take_reply(intake, data, size);
    else
        take_of_body(intake, name, data, size);
}

// --- files ---------------------------------------------------------------------------------------

char *intake_path(const char *path, int number)
{
    size_t size = strlen(path) + 16;
    char *out = malloc(size);
    if (!out)
        abort();
    // The number goes in front of the ending.
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    int stem = dot && dot > (slash ? slash + 1 : path) ? (int)(dot - path) : (int)strlen(path);
    if (number == 1)
        snprintf(out, size, "%s", path);
    else
        snprintf(out, size, "%.*s.%d%s", stem, path, number, path + stem);
    return out;
}

// Chunk size for HDF5: a frame, or a part of a large one.
static int kept_together(int count)
{
    enum { ROWS = 1 << 16 };
    return count < ROWS ? count : ROWS;
}

static void push_begin(Intake *intake)
{
    Survey *survey = &intake->survey;
    RecordingBody body[ITEM_BODIES];
    int tool[ITEM_TOOLS];
    intake->bodies = 0;
    // Only bodies that were asked for and are known have a place in the file.
    for (int i = 0; i < survey->body_count; i++) {
        intake->body[i].file_index = -1;
        if (!survey_records(survey, i))
            continue;
        intake->body[i].file_index = intake->bodies;
        body[intake->bodies++] =
            (RecordingBody){.name = survey->body[i].name,
                            .nodes = kept_together(survey->body[i].nodes),
                            .triangles = kept_together(survey->body[i].triangles),
                            .first_wall = survey->body[i].first_wall,
                            .coloured = true,
                            .has_map = {true, true}};
    }
    // All tools of the survey have one.
    for (int i = 0; i < ITEM_TOOLS; i++)
        intake->tool_index[i] = i < survey->tool_count ? i : -1;
    for (int i = 0; i < survey->tool_count; i++)
        tool[i] = survey->tool[i].id;
    const RecordingOptions options = {.scene = survey->described ? survey->described : "",
                                      .created_by = "pliant-record " PLIANT_VERSION,
                                      .body_count = intake->bodies,
                                      .tool_count = survey->tool_count,
                                      .body = body,
                                      .tool = tool,
                                      .overwrite = intake->options.overwrite,
                                      .still = intake->options.still};
    queue_push(intake->queue, item_begin(intake->path, &options), QUEUE_FORCE);
}

// The counts of a file start with its first frame.
static void begin_body(Intake *intake, IntakeBody *body)
{
    while (last_that_fits(body) && !fits(body, &body->waiting.first->frame))
        free(waiting_pop(&body->waiting));
    body->counts = (RecordingCounts){0};
    body->refused_before = refused(body);
    body->colours.slots = 0;
    body->colours.begun = false;
    body->map_step[RECORDING_ERROR_MAP] = body->map_step[RECORDING_ELEMENTS] = -1;
    push_look(intake, body);
    push_waiting_frames(intake, body);
}

bool intake_begin(Intake *intake, bool patient)
{
    if (intake->status.code != STATUS_OK)
        return false;
    if (intake->open || !survey_ready(&intake->survey, patient))
        return true;
    // A daemon that restarts for ever must not fill the disk.
    if (intake->files == INTAKE_FILES)
        return status_fail(&intake->status, STATUS_FAILED,
                           "%s: the daemon restarted %d times: the recording ends",
                           intake->options.path, INTAKE_FILES);
    // A file of its own for each daemon.
    free(intake->path);
    intake->path = intake_path(intake->options.path, ++intake->files);
    push_begin(intake);
    intake->open = intake->survey.fixed = true;
    // What had to wait for it.
    for (int i = 0; i < intake->events_waiting; i++)
        push_event(intake, &intake->event[i]);
    intake->events_waiting = 0;
    push_ledger(intake);
    for (int i = 0; i < intake->survey.body_count; i++)
        if (intake->body[i].file_index >= 0)
            begin_body(intake, &intake->body[i]);
    return true;
}

static RecordingCounts counts_of(const IntakeBody *body)
{
    RecordingCounts counts = body->counts;
    counts.refused = refused(body) - body->refused_before;
    return counts;
}

void intake_end(Intake *intake)
{
    RecordingCounts counts[ITEM_BODIES] = {0};
    // What still waits will never get its mesh.
    for (int i = 0; i < intake->survey.body_count; i++) {
        IntakeBody *body = &intake->body[i];
        body->counts.without_mesh += waiting_drop(&body->waiting);
        if (body->file_index >= 0)
            counts[body->file_index] = counts_of(body);
    }
    if (intake->open)
        queue_push(intake->queue, item_end(counts, intake->bodies), QUEUE_FORCE);
    intake->open = false;
}

RecordingCounts intake_counts(const Intake *intake)
{
    RecordingCounts sum = {.refused = intake->survey.refused};
    for (int i = 0; i < intake->survey.body_count; i++) {
        const RecordingCounts counts = counts_of(&intake->body[i]);
        sum.lost += counts.lost;
        sum.dropped += counts.dropped;
        sum.without_mesh += counts.without_mesh;
        sum.refused += counts.refused;
    }
    return sum;
}

void intake_destroy(Intake *intake)
{
    for (int i = 0; i < ITEM_BODIES; i++) {
        IntakeBody *body = &intake->body[i];
        forget(body);
        nodes_frame_destroy(&body->nodes);
        free(body->map.live);
        free(body->map.row);
        free(body->map.id);
        free(body->map.origin);
        free(body->map.parent);
        free(body->map.level);
        free(body->map.triangle);
        free(body->map.live_triangle);
        free(body->map_room);
        free(body->colours.known_id);
        free(body->colours.known);
        free(body->colours.id);
        free(body->colours.colour);
    }
    survey_destroy(&intake->survey);
    free(intake->path);
}
