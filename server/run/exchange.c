// SPDX-License-Identifier: MIT
// What the threads share, and copies of meshes that they hand over.
#include "run/exchange.h"
#include "run/ledger.h"

#include "base/clock.h"
#include "run/files_thread.h"

#include <errno.h>
#include <limits.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

// --- copies of meshes ----------------------------------------------------------------------------

int mesh_live_nodes(const BodyMesh *mesh)
{
    int live = 0;
    for (int i = 0; i < mesh->node_count; i++)
        live += mesh->id[i] >= 0;
    return live;
}

// Bytes of a column, such that the next one is aligned.
static size_t aligned(size_t bytes)
{
    return (bytes + 3) / 4 * 4;
}

static size_t bytes_of(size_t nodes, size_t triangles)
{
    size_t bytes = 0;
#define ADD_BYTES(name, type, width, of, ...)                                                      \
    bytes += aligned(MESH_SLOTS_##of(nodes, triangles) * (width) * sizeof(type));
    MESH_COLUMNS(ADD_BYTES)
    return bytes;
}

// Bytes of what a fitted mesh has besides.
static size_t fit_bytes(const BodyFit *fit, size_t nodes)
{
    return fit->row_count == 0
               ? 0
               : nodes * sizeof *fit->row + (size_t)fit->row_capacity * sizeof *fit->offset +
                     (size_t)fit->cell_capacity * sizeof *fit->cell +
                     (size_t)fit->fade_capacity * sizeof *fit->fade;
}

size_t mesh_copy_bytes(const BodyMesh *mesh)
{
    size_t nodes = (size_t)mesh->node_capacity;
    size_t bytes = sizeof(MeshCopy) + bytes_of(nodes, (size_t)mesh->triangle_capacity) +
                   fit_bytes(&mesh->fit, nodes);
    return (bytes + 7) / 8 * 8;
}

BodyMesh mesh_copy_view(const MeshCopy *copy)
{
    const size_t nodes = (size_t)copy->node_count, triangles = (size_t)copy->triangle_count;
    BodyMesh mesh = {
        .topology = copy->topology,
        .node_count = copy->node_count,
        .triangle_count = copy->triangle_count,
        .node_capacity = copy->node_capacity,
        .triangle_capacity = copy->triangle_capacity,
        .first_wall = copy->first_wall,
        .fit = copy->fit,
    };
    // The arrays lie one behind the other, in the order in which mesh_copy_follow puts them.
    const unsigned char *at = (const unsigned char *)copy->data;
#define VIEW(name, type, width, of, ...)                                                           \
    mesh.name = (void *)(uintptr_t)at;                                                             \
    at += aligned(MESH_SLOTS_##of(nodes, triangles) * sizeof *mesh.name);
    MESH_COLUMNS(VIEW)
    BodyFit *fit = &mesh.fit;
    if (fit->row_count > 0) {
        fit->row = (const int *)(const void *)at;
        fit->offset = (const float(*)[3])(const void *)(fit->row + copy->node_count);
        fit->cell = (const int(*)[FIT_CORNERS])(const void *)(fit->offset + fit->row_count);
        fit->fade = (const FitFade *)(const void *)(fit->cell + fit->cell_count);
    }
    return mesh;
}

static unsigned char *append(unsigned char *to, const void *from, size_t bytes)
{
    if (bytes > 0) // memcpy from NULL is undefined even for no bytes
        memcpy(to, from, bytes);
    return to + aligned(bytes);
}

void mesh_copy_follow(MeshCopy *copy, const BodyMesh *mesh)
{
    // A topology number names one mesh only, so the same number needs no copy.
    if (copy->node_count > 0 && copy->topology == mesh->topology)
        return;
    const size_t nodes = (size_t)mesh->node_count, triangles = (size_t)mesh->triangle_count;
    copy->topology = mesh->topology;
    copy->node_count = mesh->node_count;
    copy->triangle_count = mesh->triangle_count;
    copy->node_capacity = mesh->node_capacity;
    copy->triangle_capacity = mesh->triangle_capacity;
    copy->first_wall = mesh->first_wall;
    copy->fit = mesh->fit;
    // Arrays follow in the order of mesh_copy_view.
    unsigned char *to = (unsigned char *)copy->data;
#define APPEND(name, type, width, of, ...)                                                         \
    to = append(to, mesh->name, MESH_SLOTS_##of(nodes, triangles) * sizeof *mesh->name);
    MESH_COLUMNS(APPEND)
    const BodyFit *fit = &mesh->fit;
    if (fit->row_count > 0) {
        to = append(to, fit->row, nodes * sizeof *fit->row);
        to = append(to, fit->offset, (size_t)fit->row_count * sizeof *fit->offset);
        to = append(to, fit->cell, (size_t)fit->cell_count * sizeof *fit->cell);
        append(to, fit->fade, (size_t)fit->fade_count * sizeof *fit->fade);
    }
}

size_t rest_copy_bytes(const Body *body)
{
    const size_t each = 3 * sizeof(float) + (body->ops->snapshot_coagulated != NULL);
    return (sizeof(RestCopy) + (size_t)body->mesh.node_capacity * each + 7) / 8 * 8;
}

static unsigned char *coagulated_in(const RestCopy *copy)
{
    return (unsigned char *)(uintptr_t)(copy->position + 3L * copy->node_count);
}

LookColours rest_colours(const RestCopy *copy, const BodyLook *look, int node)
{
    LookColours colours = look_colours(look, copy->position + 3L * node);
    if (copy->coagulates)
        look_coagulate(&colours, coagulated_in(copy)[node]);
    return colours;
}

void rest_copy_follow(RestCopy *copy, const Body *body)
{
    const BodyMesh *mesh = &body->mesh;
    if (copy->node_count > 0 && copy->topology == mesh->topology)
        return;
    copy->topology = mesh->topology;
    copy->node_count = mesh->node_count;
    body->ops->snapshot_rest(body->model, copy->position);
    // Free slots get zeros, so that equal meshes give equal bytes.
    for (int i = 0; i < mesh->node_count; i++)
        if (mesh->id[i] < 0)
            memset(copy->position + 3L * i, 0, 3 * sizeof *copy->position);
    copy->coagulates = body->ops->snapshot_coagulated != NULL;
    if (copy->coagulates)
        body->ops->snapshot_coagulated(body->model, coagulated_in(copy));
}

void rest_copy_take(RestCopy *copy, const RestCopy *from)
{
    if (copy->node_count > 0 && copy->topology == from->topology)
        return;
    const size_t nodes = (size_t)from->node_count;
    memcpy(copy, from,
           sizeof *from + nodes * (3 * sizeof *from->position + (size_t)from->coagulates));
}

void rest_texture(const Body *body, const BodyMesh *mesh, int first, int end, float *uv)
{
    for (int i = first; i < end; i++, uv += 2) {
        int id = mesh->id[i];
        if (id >= body->texture_count)
            id = mesh->origin[i];
        bool known = id >= 0 && id < body->texture_count;
        uv[0] = known ? body->texture[id][0] : 0.0F;
        uv[1] = known ? body->texture[id][1] : 0.0F;
    }
}

// --- the exchange --------------------------------------------------------------------------------

static size_t round_up(size_t bytes)
{
    return (bytes + 63) / 64 * 64;
}

static void create_slot(Slot *slot, Arena *arena, size_t stride, const char *name)
{
    size_t rounded = round_up(stride);
    slot_init(slot, arena_allocate(arena, ARENA_OUTPUT, 3, rounded, "run/%s", name), rounded);
}

static void create_ring(Ring *ring, Arena *arena, unsigned capacity, size_t stride,
                        const char *name)
{
    ring_init(ring, arena_allocate(arena, ARENA_OUTPUT, capacity, stride, "run/%s", name), capacity,
              stride);
}

static void create_frames(Exchange *exchange, int index, const Body *body, bool rest, Arena *arena)
{
    // A frame and what follows it in one piece, so that one slot hands over all.
    size_t values = (size_t)mesh_most_rows(body) * (exchange->velocity ? 6 : 3);
    size_t bytes = sizeof(Frame) + values * sizeof(float);
    if (mesh_changes(body)) {
        exchange->mesh_at[index] = round_up(bytes);
        bytes = exchange->mesh_at[index] + mesh_copy_bytes(&body->mesh);
        if (rest_is_wanted(body, rest)) {
            exchange->rest_at[index] = bytes;
            bytes += rest_copy_bytes(body);
        }
    }
    char name[64];
    snprintf(name, sizeof name, "frame_%s", body->name);
    create_slot(&exchange->frame[index], arena, bytes, name);
}

MeshCopy *exchange_frame_mesh(const Exchange *exchange, int body, const Frame *frame)
{
    size_t at = exchange->mesh_at[body];
    return at == 0 ? NULL : (MeshCopy *)((uintptr_t)frame + at);
}

RestCopy *exchange_frame_rest(const Exchange *exchange, int body, const Frame *frame)
{
    size_t at = exchange->rest_at == NULL ? 0 : exchange->rest_at[body];
    return at == 0 ? NULL : (RestCopy *)((uintptr_t)frame + at);
}

const float *exchange_push_frame(Exchange *exchange, Sim *sim, int index, bool at_once)
{
    const Body *body = sim_body(sim, index);
    // When and what the frame is.
    Frame *frame = slot_back(&exchange->frame[index]);
    frame->utime = clock_utime();
    frame->step = sim_steps(sim);
    frame->time = sim_time(sim);
    frame->at_once = at_once;
    frame->topology = body->mesh.topology;
    frame->node_count = body->mesh.node_count;
    frame->row_count = mesh_rows(&body->mesh);
    // Mesh and rest positions follow only when the topology has changed.
    MeshCopy *mesh = exchange_frame_mesh(exchange, index, frame);
    if (mesh != NULL)
        mesh_copy_follow(mesh, &body->mesh);
    RestCopy *rest = exchange_frame_rest(exchange, index, frame);
    if (rest != NULL)
        rest_copy_follow(rest, body);
    // The body writes its positions, and velocities if they are published.
    mesh_snapshot(body, frame->value,
                  exchange->velocity ? frame->value + 3 * frame->row_count : NULL);
    slot_publish(&exchange->frame[index]);
    return frame->value; // the reader does not write
}

static void create_errors(Exchange *exchange, Sim *sim, bool maps, Arena *arena)
{
    const size_t bodies = (size_t)exchange->body_count;
    create_slot(&exchange->error, arena, sizeof(ErrorOut) + bodies * sizeof(SimError), "error");
    if (!maps)
        return;
    exchange->error_map = arena_allocate(arena, ARENA_OUTPUT, bodies, sizeof *exchange->error_map,
                                         "run/error_map_slots");
    exchange->map_push = arena_allocate(arena, ARENA_OUTPUT, bodies, sizeof *exchange->map_push,
                                        "run/error_map_pushes");
    for (int i = 0; i < exchange->body_count; i++) {
        const Body *body = sim_body(sim, i);
        if (body->ops->snapshot_error != NULL)
            create_slot(&exchange->error_map[i], arena,
                        sizeof(ErrorMap) + (size_t)mesh_most_nodes(body), "error_map");
    }
}

void exchange_push_error(Exchange *exchange, Sim *sim)
{
    ErrorOut *out = slot_back(&exchange->error);
    out->step = sim_steps(sim);
    out->time = sim_time(sim);
    sim_tool_errors(sim, out->tool);
    for (int i = 0; i < exchange->body_count; i++)
        sim_error(sim, i, &out->body[i]);
    slot_publish(&exchange->error);
}

static bool push_map(Slot *slot, PartPush *push, const Body *body, const SimError *error, Sim *sim,
                     bool now)
{
    const BodyMesh *mesh = &body->mesh;
    // That of another mesh is of no use, so what is under way begins again.
    const bool is_new = push->topology != mesh->topology;
    if (error->age < 0 || (!push->under_way && error->rounds == push->changes))
        return false;
    ErrorMap *map = slot_back(slot);
    if (!push->under_way || is_new) {
        *push = (PartPush){error->rounds, mesh->topology, 0, true};
        map->step = sim_steps(sim);
        map->topology = mesh->topology;
        map->node_count = mesh->node_count;
    }
    int end = push->written + NODES_IN_TICK;
    if (now || end > mesh->node_count)
        end = mesh->node_count;
    body->ops->snapshot_error(body->model, push->written, end, map->share + push->written);
    for (int n = push->written; n < end; n++)
        if (mesh->id[n] < 0)
            map->share[n] = 0;
    push->written = end;
    push->under_way = end < mesh->node_count;
    if (!push->under_way)
        slot_publish(slot);
    return !push->under_way;
}

bool exchange_push_error_maps(Exchange *exchange, Sim *sim, bool now)
{
    bool pushed = false;
    for (int i = 0; i < exchange->body_count && exchange->error_map != NULL; i++) {
        SimError error;
        if (exchange->error_map[i].memory == NULL)
            continue;
        sim_error(sim, i, &error);
        pushed |= push_map(&exchange->error_map[i], &exchange->map_push[i], sim_body(sim, i),
                           &error, sim, now);
    }
    return pushed;
}

static void create_elements(Exchange *exchange, Sim *sim, Arena *arena)
{
    const size_t bodies = (size_t)exchange->body_count;
    exchange->elements = arena_allocate(arena, ARENA_OUTPUT, bodies, sizeof *exchange->elements,
                                        "run/element_slots");
    exchange->elements_push = arena_allocate(arena, ARENA_OUTPUT, bodies,
                                             sizeof *exchange->elements_push, "run/element_pushes");
    for (int i = 0; i < exchange->body_count; i++) {
        const Body *body = sim_body(sim, i);
        const size_t squares = (size_t)body->mesh.triangle_capacity / 2;
        if (body->element_at_level == NULL)
            continue;
        ASSERT(body->element_levels <= ELEMENT_LEVELS);
        create_slot(&exchange->elements[i], arena,
                    sizeof(ElementsOut) + squares * (sizeof(uint16_t) + 1), "elements");
        exchange->elements_push[i].changes = -1;
    }
}

static bool push_elements(Slot *slot, PartPush *push, const Body *body, Sim *sim, bool due,
                          bool now)
{
    // Those of another mesh are of no use, so what is under way begins again.
    const bool is_new = push->topology != body->mesh.topology;
    if (!push->under_way && (!due || (!is_new && push->changes == body->element_changes)))
        return false;
    ElementsOut *out = slot_back(slot);
    if (!push->under_way || is_new) {
        *push = (PartPush){body->element_changes, body->mesh.topology, 0, true};
        out->step = sim_steps(sim);
        out->topology = body->mesh.topology;
        out->square_count = body->mesh.triangle_count / 2;
        out->levels = body->element_levels;
        memcpy(out->at_level, body->element_at_level, (size_t)out->levels * sizeof *out->at_level);
    }
    // Elements may change meanwhile; then all are written once more.
    int end = push->written + SQUARES_IN_TICK;
    if (now || end > out->square_count)
        end = out->square_count;
    body->ops->snapshot_elements(body, push->written, end, elements_levels(out) + push->written,
                                 out->tag + push->written);
    push->written = end;
    push->under_way = end < out->square_count;
    if (!push->under_way)
        slot_publish(slot);
    return !push->under_way;
}

bool exchange_push_elements(Exchange *exchange, Sim *sim, bool due, bool now)
{
    bool pushed = false;
    for (int i = 0; i < exchange->body_count && exchange->elements != NULL; i++)
        if (exchange->elements[i].memory != NULL)
            pushed |= push_elements(&exchange->elements[i], &exchange->elements_push[i],
                                    sim_body(sim, i), sim, due, now);
    return pushed;
}

// Returns a capacity for that many entries: a power of two within limits.
static unsigned waiting(double count, unsigned least, unsigned most)
{
    unsigned entries = least;
    while (entries < most && (double)entries < count)
        entries *= 2;
    return entries;
}

static void create_recording(Exchange *exchange, World *world, const ExchangeOptions *options)
{
    // Frames of one second, the time for which a busy disk or a checkpoint may block the files
    // thread; and rows of tools, which are small, if these have a rate of their own.
    create_ring(&exchange->recorded, &world->arena,
                waiting(options->nodes_hz, EXCHANGE_FRAMES_LEAST, EXCHANGE_FRAMES_MOST),
                round_up(record_frame_bytes(world->sim)), "recorded");
    if (options->tools_hz > 0.0)
        create_ring(&exchange->recorded_tools, &world->arena,
                    waiting(options->tools_hz, EXCHANGE_FRAMES_LEAST, UINT_MAX / 2),
                    round_up(record_tools_bytes(world->sim)), "recorded_tools");
    // Changed meshes, handed over before the frames that need them.
    exchange->recorded_mesh =
        arena_allocate(&world->arena, ARENA_OUTPUT, (size_t)exchange->body_count,
                       sizeof *exchange->recorded_mesh, "run/recorded_mesh_rings");
    exchange->recorded_topology =
        arena_allocate(&world->arena, ARENA_OUTPUT, (size_t)exchange->body_count,
                       sizeof *exchange->recorded_topology, "run/recorded_topologies");
    for (int i = 0; i < exchange->body_count; i++) {
        const Body *body = sim_body(world->sim, i);
        exchange->recorded_topology[i] =
            body->mesh.topology; // recorder_create writes this topology
        if (mesh_changes(body))
            create_ring(&exchange->recorded_mesh[i], &world->arena, EXCHANGE_MESHES,
                        mesh_copy_bytes(&body->mesh) +
                            (rest_is_wanted(body, false) ? rest_copy_bytes(body) : 0),
                        "recorded_meshes");
    }
    // Events that the file gets, too.
    create_ring(&exchange->told, &world->arena, EXCHANGE_EVENTS, sizeof(EventOut), "told");
    if (options->ledger > 0)
        create_ring(&exchange->told_ledger, &world->arena, EXCHANGE_LEDGERS,
                    round_up(options->ledger), "told_ledgers");
    if (options->errors)
        create_ring(
            &exchange->told_errors, &world->arena, EXCHANGE_EVENTS,
            round_up(sizeof(Ledger) + (size_t)(exchange->body_count + exchange->tool_count) *
                                          sizeof(RecordingLedger)),
            "told_errors");
    // Maps of the bodies that publish them.
    const Slot *const published[RECORDING_MAPS] = {
        [RECORDING_ERROR_MAP] = exchange->error_map, [RECORDING_ELEMENTS] = exchange->elements};
    for (int kind = 0; kind < RECORDING_MAPS; kind++) {
        if (published[kind] == NULL)
            continue;
        exchange->told_map[kind] =
            arena_allocate(&world->arena, ARENA_OUTPUT, (size_t)exchange->body_count, sizeof(Ring),
                           "run/told_map_rings");
        for (int i = 0; i < exchange->body_count; i++)
            if (published[kind][i].memory != NULL)
                create_ring(&exchange->told_map[kind][i], &world->arena, EXCHANGE_MAPS,
                            published[kind][i].stride, "told_maps");
    }
}

void exchange_create(Exchange *exchange, World *world, const ExchangeOptions *options)
{
    memset(exchange, 0, sizeof *exchange);
    Arena *arena = &world->arena;
    Sim *sim = world->sim;
    // What the scene has and which outputs are enabled.
    exchange->tool_count = sim_tool_count(sim);
    exchange->body_count = sim_body_count(sim);
    exchange->velocity = options->velocity;
    exchange->checkpoints = options->checkpoints;
    exchange->logs_inputs = options->logs_inputs;
    exchange->records = options->records;

    // Slots to the step thread: the newest pose of each tool.
    exchange->pose = arena_allocate(arena, ARENA_OUTPUT, (size_t)exchange->tool_count,
                                    sizeof *exchange->pose, "run/pose_slots");
    exchange->lifts = arena_allocate(arena, ARENA_OUTPUT, (size_t)exchange->tool_count,
                                     sizeof *exchange->lifts, "run/lifts");
    exchange->taken = arena_allocate(arena, ARENA_OUTPUT, (size_t)exchange->tool_count,
                                     sizeof *exchange->taken, "run/poses_taken");
    for (int i = 0; i < exchange->tool_count; i++)
        create_slot(&exchange->pose[i], arena, sizeof(Input), "pose");
    // Slots from the step thread: a frame of each body, with mesh and rest positions behind it.
    exchange->frame = arena_allocate(arena, ARENA_OUTPUT, (size_t)exchange->body_count,
                                     sizeof *exchange->frame, "run/frame_slots");
    exchange->mesh_at = arena_allocate(arena, ARENA_OUTPUT, (size_t)exchange->body_count,
                                       sizeof *exchange->mesh_at, "run/frame_meshes");
    bool rest = options->rest;
    for (int i = 0; i < exchange->body_count; i++)
        rest |= rest_is_wanted(sim_body(sim, i), false);
    if (rest)
        exchange->rest_at = arena_allocate(arena, ARENA_OUTPUT, (size_t)exchange->body_count,
                                           sizeof *exchange->rest_at, "run/frame_rests");
    for (int i = 0; i < exchange->body_count; i++)
        create_frames(exchange, i, sim_body(sim, i), options->rest, arena);
    create_slot(&exchange->status, arena,
                sizeof(StatusOut) + (size_t)exchange->body_count * sizeof(BodyOut), "status");
    if (options->ledger > 0)
        create_slot(&exchange->ledger, arena, round_up(options->ledger), "ledger");
    if (options->errors)
        create_errors(exchange, sim, options->error_maps, arena);
    if (options->elements)
        create_elements(exchange, sim, arena);
    // Rings of requests and of the answers, contacts and events that go out.
    create_ring(&exchange->request, arena, EXCHANGE_REQUESTS, sizeof(Input), "requests");
    create_ring(&exchange->urgent, arena, EXCHANGE_URGENT, sizeof(Input), "urgent_requests");
    if (exchange->tool_count > 0)
        create_ring(&exchange->contact, arena, EXCHANGE_CONTACTS, sizeof(ContactOut), "contacts");
    create_ring(&exchange->answer, arena, EXCHANGE_ANSWERS, sizeof(Answer), "answers");
    create_ring(&exchange->event, arena, EXCHANGE_EVENTS, sizeof(EventOut), "events");
    // Only the enabled files take memory.
    if (options->logs_inputs) // poses of four seconds: a log that lacks one repeats no run
        create_ring(&exchange->applied, arena,
                    waiting(4.0 * exchange->tool_count / sim_tick(sim), EXCHANGE_APPLIED_LEAST,
                            EXCHANGE_APPLIED_MOST),
                    sizeof(AppliedInput), "applied");
    if (options->checkpoints) {
        world_image_reserve(&exchange->image, &world->arena, world);
        create_ring(&exchange->written, arena, EXCHANGE_REQUESTS, sizeof(Answer), "written");
    }
    if (options->records)
        create_recording(exchange, world, options);
    if (options->checkpoints || options->records || options->logs_inputs)
        create_ring(&exchange->files_event, arena, EXCHANGE_EVENTS, sizeof(EventOut),
                    "files_events");

    exchange->step_fd = exchange->bus_fd = exchange->files_fd = -1;
}

bool exchange_open(Exchange *exchange, Status *status)
{
    exchange->step_fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    exchange->bus_fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    exchange->files_fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (exchange->step_fd < 0 || exchange->bus_fd < 0 || exchange->files_fd < 0)
        return status_fail(status, STATUS_FAILED, "cannot create a wake-up descriptor: %s",
                           strerror(errno));
    return true;
}

void exchange_close(Exchange *exchange)
{
    int fds[] = {exchange->step_fd, exchange->bus_fd, exchange->files_fd};
    for (int i = 0; i < 3; i++)
        if (fds[i] >= 0)
            close(fds[i]);
}

void exchange_wake(int fd)
{
    uint64_t one = 1;
    // A full counter means that a wake-up is already pending.
    if (write(fd, &one, sizeof one) < 0)
        return;
}

void exchange_clear(int fd)
{
    uint64_t count;
    if (read(fd, &count, sizeof count) < 0)
        return; // no wake-up was pending
}
