// SPDX-License-Identifier: MIT
// What the bus publishes of a body whose mesh changes, and what a client makes of it: without
// threads, sockets or real time.
#include "test.h"
#include "frames.h"
#include "mesh_check.h"
#include "mesh_toy.h"
#include "random.h"
#include "mesh_message.h"
#include "run/bus_parts.h"

#include "pliant_nodes_t.h"

enum { DATAGRAM = 65499, PATIENCE = 100000 };

// --- a mesh of nothing but slots -----------------------------------------------------------------

enum { NODES = 6000, TRIANGLES = 12000 }; // capacity: many chunks

typedef struct Slots {
    int topology, node_count, triangle_count;
    int id[NODES], origin[NODES], parent[NODES][2], piece[NODES];
    signed char level[NODES];
    int triangle[TRIANGLES][3];
} Slots;

static BodyMesh mesh_of(const Slots *slots)
{
    return (BodyMesh){.topology = slots->topology,
                      .node_count = slots->node_count,
                      .triangle_count = slots->triangle_count,
                      .node_capacity = NODES,
                      .triangle_capacity = TRIANGLES,
                      .triangle = slots->triangle,
                      .id = slots->id,
                      .origin = slots->origin,
                      .parent = slots->parent,
                      .piece = slots->piece,
                      .level = slots->level};
}

static void change_node(Slots *slots, int i, uint64_t *random)
{
    slots->id[i] = random_below(random, 4) == 0 ? -1 : random_below(random, 1 << 30);
    slots->origin[i] = random_below(random, 1 << 30);
    slots->parent[i][0] = random_below(random, 1 << 30);
    slots->parent[i][1] = random_below(random, 1 << 30);
    slots->piece[i] = random_below(random, 9);
    slots->level[i] = (signed char)random_below(random, 9);
}

static void change_triangle(Slots *slots, int t, uint64_t *random)
{
    bool frees = random_below(random, 4) == 0;
    for (int k = 0; k < 3; k++)
        slots->triangle[t][k] = frees ? 0 : random_below(random, slots->node_count);
}

// Some slots change, or nearly all; the counts grow or shrink.
static void change_slots(Slots *slots, uint64_t *random)
{
    int nodes = slots->node_count, triangles = slots->triangle_count;
    bool all = random_below(random, 8) == 0;
    slots->node_count = all ? 1 + random_below(random, NODES) : nodes;
    slots->triangle_count = all ? random_below(random, TRIANGLES + 1) : triangles;
    for (int i = 0; i < slots->node_count; i++)
        if (i >= nodes || random_below(random, 100) < (all ? 90 : 2))
            change_node(slots, i, random);
    for (int t = 0; t < slots->triangle_count; t++) {
        bool stays = t < triangles && slots->triangle[t][0] < slots->node_count &&
                     slots->triangle[t][1] < slots->node_count &&
                     slots->triangle[t][2] < slots->node_count;
        if (!stays || random_below(random, 100) < (all ? 90 : 2))
            change_triangle(slots, t, random);
    }
    slots->topology++;
}

// --- messages ------------------------------------------------------------------------------------

typedef struct Message {
    size_t size;
    unsigned char data[DATAGRAM];
} Message;

// Encoded, below one datagram.
static void encode_delta(Message *to, const MeshDelta *delta, const BodyMesh *after, int chunk,
                         int sequence, MeshDeltaChunk *memory)
{
    pliant_mesh_delta_t message = mesh_delta_chunk(delta, after, chunk, memory);
    message.sequence = sequence;
    message.utime = 1000 * sequence + chunk;
    to->size = (size_t)pliant_mesh_delta_t_encoded_size(&message);
    assert_true(to->size <= DATAGRAM);
    assert_int_equal(pliant_mesh_delta_t_encode(to->data, 0, DATAGRAM, &message), to->size);
}

static FramesResult add_whole(MeshFrame *frame, const BodyMesh *mesh, int sequence, int64_t utime)
{
    pliant_mesh_t message =
        mesh_message(sequence, utime, mesh->topology, mesh->node_count, mesh->id, mesh->parent[0],
                     (const int8_t *)mesh->level, mesh->triangle_count, mesh->triangle[0]);
    message.origin = (int32_t *)(uintptr_t)mesh->origin;
    message.piece = (int32_t *)(uintptr_t)mesh->piece;
    int size = pliant_mesh_t_encoded_size(&message);
    FREED unsigned char *data = malloc((size_t)size);
    assert_int_equal(pliant_mesh_t_encode(data, 0, size, &message), size);
    return mesh_frame_add(frame, data, (size_t)size);
}

// The client's mesh is that of the server, slot by slot; what a free node slot holds besides its id
// means nothing.
static void expect_same_mesh(const MeshFrame *frame, const BodyMesh *mesh)
{
    assert_true(frame->whole);
    assert_int_equal(frame->topology, mesh->topology);
    assert_int_equal(frame->node_count, mesh->node_count);
    assert_int_equal(frame->triangle_count, mesh->triangle_count);
    assert_memory_equal(frame->id, mesh->id, (size_t)mesh->node_count * sizeof *mesh->id);
    if (mesh->triangle_count > 0)
        assert_memory_equal(frame->triangle, mesh->triangle,
                            (size_t)mesh->triangle_count * sizeof *mesh->triangle);
    for (int i = 0; i < mesh->node_count; i++)
        if (mesh->id[i] >= 0)
            assert_memory_equal(frame->parent + 2 * i, mesh->parent[i], sizeof *mesh->parent);
}

// What the client does not keep, kept by the plainest of receivers.
static void apply_rest(Slots *rest, const Message *message)
{
    pliant_mesh_delta_t delta;
    assert_true(pliant_mesh_delta_t_decode(message->data, 0, (int)message->size, &delta) >= 0);
    for (int k = 0; k < delta.num_nodes; k++) {
        rest->origin[delta.node_slot[k]] = delta.origin[k];
        rest->piece[delta.node_slot[k]] = delta.piece[k];
        rest->level[delta.node_slot[k]] = delta.level[k];
    }
    pliant_mesh_delta_t_decode_cleanup(&delta);
}

TEST(deltas_in_any_order_of_chunks_make_the_whole_mesh)
{
    enum { CHUNKS_MAX = 16, CHANGES = 120 };
    FREED Slots *now = calloc(1, sizeof *now), *before = calloc(1, sizeof *before);
    FREED Slots *rest = calloc(1, sizeof *rest);
    FREED MeshDeltaChunk *memory = malloc(sizeof *memory);
    FREED Message *message = malloc(CHUNKS_MAX * sizeof *message);
    MeshDelta delta = {.node = malloc(NODES * sizeof(int)),
                       .triangle = malloc(TRIANGLES * sizeof(int))};
    SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
    uint64_t random = 99;
    now->node_count = 1;
    change_slots(now, &random);
    BodyMesh mesh = mesh_of(now);
    assert_int_equal(add_whole(&frame, &mesh, 1, 0), FRAMES_WHOLE);
    *rest = *now;
    int most = 0;
    for (int n = 1; n <= CHANGES; n++) {
        *before = *now;
        change_slots(now, &random);
        const BodyMesh old = mesh_of(before);
        mesh = mesh_of(now);
        mesh_delta_find(&delta, &old, &mesh);
        int chunks = mesh_delta_chunks(&delta);
        assert_in_range(chunks, 1, CHUNKS_MAX);
        most = chunks > most ? chunks : most;
        for (int c = 0; c < chunks; c++) {
            encode_delta(&message[c], &delta, &mesh, c, n, memory);
            apply_rest(rest, &message[c]);
        }
        for (int c = chunks - 1; c > 0; c--) { // shuffled
            int other = random_below(&random, c + 1);
            Message swapped = message[c];
            message[c] = message[other];
            message[other] = swapped;
        }
        for (int c = 0; c < chunks; c++) {
            FramesResult wanted = c + 1 < chunks ? FRAMES_MORE : FRAMES_WHOLE;
            assert_int_equal(mesh_frame_add_delta(&frame, message[c].data, message[c].size),
                             wanted);
            assert_int_equal(mesh_frame_add_delta(&frame, message[c].data, message[c].size),
                             FRAMES_STALE); // repeated
        }
        expect_same_mesh(&frame, &mesh);
        for (int i = 0; i < now->node_count; i++) {
            if (now->id[i] < 0)
                continue;
            assert_int_equal(rest->origin[i], now->origin[i]);
            assert_int_equal(rest->piece[i], now->piece[i]);
            assert_int_equal(rest->level[i], now->level[i]);
        }
    }
    assert_in_range(most, 4, CHUNKS_MAX); // it was about chunks
    assert_int_equal(frame.refused, 0);
    assert_int_equal(frame.missed, 0);
    free(delta.node);
    free(delta.triangle);
}

TEST(a_lost_chunk_costs_deltas_until_the_next_whole_mesh)
{
    FREED Slots *now = calloc(1, sizeof *now), *before = calloc(1, sizeof *before);
    FREED MeshDeltaChunk *memory = malloc(sizeof *memory);
    FREED Message *message = malloc(sizeof *message);
    MeshDelta delta = {.node = malloc(NODES * sizeof(int)),
                       .triangle = malloc(TRIANGLES * sizeof(int))};
    SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
    uint64_t random = 5;
    now->node_count = 1;
    change_slots(now, &random);
    BodyMesh mesh = mesh_of(now);
    bool behind = true; // it joins late
    int lost = 0, missed = 0, followed = 0;
    for (int n = 1; n <= 200; n++) {
        *before = *now;
        change_slots(now, &random);
        const BodyMesh old = mesh_of(before);
        mesh = mesh_of(now);
        mesh_delta_find(&delta, &old, &mesh);
        for (int c = 0; c < mesh_delta_chunks(&delta); c++) {
            encode_delta(message, &delta, &mesh, c, n, memory);
            if (random_below(&random, 20) == 0) {
                lost++;
                behind = true;
                continue;
            }
            FramesResult result = mesh_frame_add_delta(&frame, message->data, message->size);
            missed += result == FRAMES_MISSED;
            assert_true(result == FRAMES_MORE || result == (behind ? FRAMES_MISSED : FRAMES_WHOLE));
        }
        if (n % 10 == 0) {
            assert_int_equal(add_whole(&frame, &mesh, n, 1000 * n + 500), FRAMES_WHOLE);
            behind = false;
        }
        // Never a mesh that is a mixture: behind or right.
        if (frame.whole && frame.topology == mesh.topology)
            expect_same_mesh(&frame, &mesh);
        else
            assert_true(behind);
        followed += !behind;
    }
    assert_in_range(lost, 10, 100);
    assert_in_range(missed, 10, 200);
    assert_in_range(followed, 40, 200);
    assert_int_equal(frame.refused, 0);
    free(delta.node);
    free(delta.triangle);
}

TEST(nothing_changed_is_an_empty_delta)
{
    int node[TOY_NODES], triangle[TOY_FACES];
    MeshDelta delta = {.node = node, .triangle = triangle};
    SCOPED(mesh_toy_destroy) MeshToy toy;
    mesh_toy_create(&toy, true, 1);
    const BodyMesh mesh = mesh_toy_mesh(&toy);
    mesh_delta_find(&delta, &mesh, &mesh);
    assert_int_equal(delta.node_count, 0);
    assert_int_equal(delta.triangle_count, 0);
    assert_int_equal(mesh_delta_chunks(&delta), 1);
}

TEST(a_copy_shows_the_mesh_and_follows_its_number)
{
    SCOPED(mesh_toy_destroy) MeshToy toy;
    mesh_toy_create(&toy, false, 3);
    BodyMesh mesh = mesh_toy_mesh(&toy);
    FREED MeshCopy *copy = calloc(1, mesh_copy_bytes(&mesh));
    int live = 0;
    for (int n = 0; n < 50; n++) {
        mesh_toy_change(&toy);
        mesh = mesh_toy_mesh(&toy);
        mesh_copy_follow(copy, &mesh);
        const BodyMesh view = mesh_copy_view(copy);
        expect_crack_free(&view, &toy.base, NULL);
        assert_int_equal(view.topology, mesh.topology);
        size_t nodes = (size_t)mesh.node_count;
        assert_memory_equal(view.origin, mesh.origin, nodes * sizeof *mesh.origin);
        assert_memory_equal(view.parent, mesh.parent, nodes * sizeof *mesh.parent);
        assert_memory_equal(view.level, mesh.level, nodes);
        live = mesh_live_nodes(&view);
    }
    int expected = 0; // counted from the hierarchy's side
    for (int i = 0; i < toy.nodes; i++)
        expected += toy.state.slot_of[i] >= 0;
    assert_int_equal(live, expected);
}

// --- the bus -------------------------------------------------------------------------------------

// A scene of one toy, its bus on a queue in memory, and a client at its other end.
typedef struct Rig {
    MeshToy toy;
    World world;
    Scene scene;
    Exchange exchange;
    Bus *bus;
    int64_t now_ns;
    // what came
    MeshFrame mesh;
    NodesFrame nodes;
    int meshes, deltas, frames, velocities; // chunks, but frames: whole ones
    int wholes;
    size_t largest;
    int64_t frame_step; // of the newest whole frame
    double rounding;    // of positions [m]
} Rig;

static void on_mesh(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Rig *rig = user;
    FramesResult result = mesh_frame_add(&rig->mesh, buffer->data, buffer->data_size);
    assert_true(result == FRAMES_MORE || result == FRAMES_WHOLE);
    rig->meshes++;
    rig->wholes += result == FRAMES_WHOLE;
    rig->largest = buffer->data_size > rig->largest ? buffer->data_size : rig->largest;
}

static void on_delta(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Rig *rig = user;
    // In order and without loss a listener that has a mesh follows every delta.
    FramesResult result = mesh_frame_add_delta(&rig->mesh, buffer->data, buffer->data_size);
    assert_true(result == FRAMES_MORE || result == FRAMES_WHOLE ||
                (result == FRAMES_MISSED && rig->wholes == 0));
    rig->deltas++;
    rig->largest = buffer->data_size > rig->largest ? buffer->data_size : rig->largest;
}

static void on_nodes(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Rig *rig = user;
    FramesResult result = nodes_frame_add(&rig->nodes, buffer->data, buffer->data_size);
    assert_true(result != FRAMES_REFUSED); // stale: the last frame again, on DESCRIBE
    // Never before their mesh.
    if (rig->wholes > 0) {
        assert_int_equal(rig->nodes.head.topology, rig->mesh.topology);
        assert_int_equal(rig->nodes.head.count, rig->mesh.node_count);
    }
    if (result != FRAMES_WHOLE)
        return;
    rig->frames++;
    rig->frame_step = rig->nodes.step;
    for (int i = 0; i < rig->nodes.head.count && rig->wholes > 0; i++) // a node's own place
        if (rig->mesh.id[i] >= 0) {
            int id = rig->mesh.id[i], node = id < 500 ? id - 10 : 1000 - id;
            expect_near((double)rig->nodes.position[3 * i], rig->toy.rest[node].x, rig->rounding);
        }
}

static void on_velocity(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Rig *rig = user;
    pliant_nodes_t chunk;
    assert_true(pliant_nodes_t_decode(buffer->data, 0, (int)buffer->data_size, &chunk) >= 0);
    assert_int_equal(chunk.topology, rig->nodes.head.topology);
    for (int i = 0; i < chunk.num_values / 3; i++) // the toy's velocity is the id
        if (rig->wholes > 0 && rig->mesh.id[chunk.first + i] >= 0)
            expect_near((double)chunk.position[3 * i], rig->mesh.id[chunk.first + i], 0.0);
    rig->velocities++;
    pliant_nodes_t_decode_cleanup(&chunk);
}

static Rig *rig_begin(bool adapts, double mesh_hz)
{
    Rig *rig = zeroed(1, sizeof *rig);
    mesh_toy_create(&rig->toy, false, 11);
    const SimOptions options = {.rate_hz = 1000.0, .may_load = false};
    rig->world.sim = sim_create(&options, &rig->world.arena, &rig->world.state);
    const Body body = mesh_toy_body(&rig->toy, "toy", adapts, &rig->world.state);
    sim_add_body(rig->world.sim, &body);
    Scene *scene = &rig->scene;
    snprintf(scene->name, sizeof scene->name, "rig");
    snprintf(scene->prefix, sizeof scene->prefix, "RIG");
    snprintf(scene->input_prefix, sizeof scene->input_prefix, "RIG");
    scene->sim.rate_hz = 1000.0;
    scene->publish = (ScenePublish){.nodes_hz = 50.0, .mesh_hz = mesh_hz, .velocity = true};
    const ExchangeOptions exchange = {.velocity = true, .nodes_hz = 50.0};
    exchange_create(&rig->exchange, &rig->world, &exchange);
    Status status = {0};
    rig->bus = bus_reserve(&rig->world, scene, &rig->exchange);
    expect_ok(
        bus_connect(rig->bus, &(BusOptions){.describe = "a rig", .lcm_url = "memq://"}, &status),
        status);
    lcm_subscribe(rig->bus->lcm, "RIG_MESH_toy", on_mesh, rig);
    lcm_subscribe(rig->bus->lcm, "RIG_MESH_DELTA_toy", on_delta, rig);
    lcm_subscribe(rig->bus->lcm, "RIG_NODES_toy", on_nodes, rig);
    lcm_subscribe(rig->bus->lcm, "RIG_POINTS_toy", on_nodes, rig);
    rig->rounding = 1e-6;
    lcm_subscribe(rig->bus->lcm, "RIG_VELOCITY_toy", on_velocity, rig);
    rig->now_ns = 1000000000;
    return rig;
}

static void rig_end(Rig **rig_at)
{
    Rig *rig = *rig_at;
    bus_disconnect(rig->bus);
    mesh_frame_destroy(&rig->mesh);
    nodes_frame_destroy(&rig->nodes);
    world_destroy(&rig->world);
    mesh_toy_destroy(&rig->toy);
    free(rig);
}

static void rig_change(Rig *rig)
{
    while (!mesh_toy_change(&rig->toy)) {
    }
    Body *body = sim_body(rig->world.sim, 0);
    body->mesh = mesh_toy_mesh(&rig->toy);
}

static void rig_push(Rig *rig, bool at_once)
{
    rig->toy.state.moves++;
    exchange_push_frame(&rig->exchange, rig->world.sim, 0, at_once);
}

// What the bus thread does between two sleeps, and what its listeners make of it.
static void rig_turn(Rig *rig, bool at_once)
{
    bus_send_frames(rig->bus, rig->now_ns, at_once);
    bus_send_meshes(rig->bus, rig->now_ns);
    while (lcm_handle_timeout(rig->bus->lcm, 0) > 0) {
    }
}

// Turns until nothing is under way for so long.
static void rig_run(Rig *rig, int64_t ns)
{
    int64_t end = rig->now_ns + ns;
    while (rig->now_ns < end) {
        rig_turn(rig, false);
        // At least a little: a bus that is due for ever would spin.
        int64_t due = bus_next_chunk_ns(rig->bus);
        assert_true(due > rig->now_ns);
        rig->now_ns = due < end ? due : end;
    }
}

static void expect_rig_followed(const Rig *rig)
{
    const BodyMesh mesh = mesh_toy_mesh(&rig->toy);
    expect_same_mesh(&rig->mesh, &mesh);
    assert_int_equal(rig->nodes.head.topology, mesh.topology);
    assert_true(rig->nodes.head.whole);
    assert_int_equal(rig->mesh.lost, 0);
    assert_int_equal(rig->mesh.refused, 0);
}

TEST(a_listener_follows_every_published_topology)
{
    enum { FRAMES = 300 };
    SCOPED(rig_end) Rig *rig = rig_begin(true, 1.0);
    int changes = 0;
    uint64_t random = 3;
    for (int n = 0; n < FRAMES; n++) {
        // Several changes between two frames are one for the listener.
        int more = random_below(&random, 3);
        for (int k = 0; k < more; k++)
            rig_change(rig);
        changes += more > 0;
        rig_push(rig, false);
        rig_run(rig, 20000000);
        expect_rig_followed(rig);
    }
    assert_int_equal(rig->frames, FRAMES);
    assert_int_equal(rig->deltas, changes); // one chunk each: at most at nodes_hz
    assert_in_range(rig->wholes, 6, 7);     // six seconds
}

TEST(packets_of_positions_follow_their_mesh_like_floats)
{
    SCOPED(rig_end) Rig *rig = rig_begin(true, 1.0);
    rig->scene.publish.positions = POSITIONS_PACKETS;
    rig->rounding += 0x1p-18; // half a step of the grid
    uint64_t random = 4;
    for (int n = 0; n < 100; n++) {
        if (random_below(&random, 2) == 0)
            rig_change(rig);
        rig_push(rig, false);
        rig_run(rig, 20000000);
        expect_rig_followed(rig);
    }
    assert_int_equal(rig->frames, 100);
}

TEST(a_frame_never_taken_takes_no_topology_with_it)
{
    SCOPED(rig_end) Rig *rig = rig_begin(true, 1.0);
    uint64_t random = 8;
    rig_push(rig, false);
    rig_run(rig, 20000000);
    for (int n = 0; n < 200; n++) {
        int frames = 1 + random_below(&random, 4); // of which the bus sees the last
        for (int k = 0; k < frames; k++) {
            if (random_below(&random, 2) == 0)
                rig_change(rig);
            rig_push(rig, false);
        }
        rig_run(rig, 20000000);
        expect_rig_followed(rig);
    }
}

TEST(lockstep_tells_all_before_it_returns)
{
    SCOPED(rig_end) Rig *rig = rig_begin(true, 1.0);
    rig_push(rig, true);
    rig_turn(rig, true);
    for (int n = 0; n < 50; n++) {
        rig_change(rig);
        rig_push(rig, true);
        rig_turn(rig, true); // no time passes
        assert_int_equal(rig->frames, n + 2);
        expect_rig_followed(rig);
    }
}

// A client that requests the mesh all the time gets it ten times a second, which is not more than
// the network bears, and does not keep others from new topologies.
TEST(asking_without_end_starves_nobody)
{
    SCOPED(rig_end) Rig *rig = rig_begin(true, 0.0); // only when asked
    rig_push(rig, false);
    rig_run(rig, 1);
    for (int n = 0; n < 1000; n++) { // of 1 ms
        if (n % 20 == 0) {
            rig_change(rig);
            rig_push(rig, false);
        }
        bus_restart_streams(rig->bus);
        rig_turn(rig, false);
        rig->now_ns += 1000000;
        if (n % 20 == 19)
            expect_rig_followed(rig);
    }
    assert_in_range(rig->wholes, 9, 10);
    assert_int_equal(rig->deltas, 50);
}

// A mesh of many chunks is of one topology, whatever happens while it leaves; frames of the next
// one wait for its end.
TEST(a_whole_mesh_under_way_is_of_one_topology)
{
    FREED Slots *slots = calloc(1, sizeof *slots);
    SCOPED(rig_end) Rig *rig = rig_begin(true, 0.0);
    uint64_t random = 77;
    // The bus is shown a large mesh in place of the toy's.
    BodyStream *stream = &rig->bus->body[0];
    slots->topology = 40;
    slots->node_count = NODES;
    slots->triangle_count = TRIANGLES;
    for (int i = 0; i < NODES; i++)
        change_node(slots, i, &random);
    for (int t = 0; t < TRIANGLES; t++)
        change_triangle(slots, t, &random);
    stream->mesh = mesh_of(slots);
    bus_restart_streams(rig->bus);
    rig_turn(rig, false);
    rig->toy.state.topology = 41;
    sim_body(rig->world.sim, 0)->mesh = mesh_toy_mesh(&rig->toy);
    rig_push(rig, false);
    for (int n = 0; n < PATIENCE && rig->wholes == 0; n++) {
        assert_int_equal(rig->frames, 0);
        assert_int_equal(rig->deltas, 0);
        rig->now_ns = bus_next_chunk_ns(rig->bus);
        rig_turn(rig, false);
    }
    assert_int_equal(rig->wholes, 1);
    assert_in_range(rig->meshes, 6, 12); // 6000 nodes, 12000 triangles
    BodyMesh large = mesh_of(slots);
    expect_same_mesh(&rig->mesh, &large);
    // Then the frame that waited, and its mesh before it.
    rig_run(rig, 30000000);
    assert_int_equal(rig->frames, 1);
    expect_rig_followed(rig);
    assert_true(rig->largest <= DATAGRAM);
}

// RESET brings meshes back, but no number: a client that has seen a number knows its mesh.
TEST(no_number_ever_names_two_meshes)
{
    enum { TICKS = 400, NUMBERS = TICKS + 50 };
    SCOPED(rig_end) Rig *rig = rig_begin(true, 1.0);
    Sim *sim = rig->world.sim;
    Status status = {0};
    assert_true(sim_seal(sim, 0.0, &status));
    uint64_t random = 6, *seen = calloc(NUMBERS, sizeof *seen);
    int last = 0;
    for (int n = 0; n < TICKS; n++) {
        if (random_below(&random, 20) == 0)
            sim_reset(sim);
        sim_step(sim);
        const BodyMesh *mesh = &sim_body(sim, 0)->mesh;
        assert_in_range(mesh->topology, last, NUMBERS - 1);
        last = mesh->topology;
        uint64_t hash = 14695981039346656037u; // of slots in use
        for (int i = 0; i < mesh->node_count; i++)
            hash = (hash ^ (uint64_t)(unsigned)mesh->id[i]) * 1099511628211u;
        for (int t = 0; t < 3 * mesh->triangle_count; t++)
            hash = (hash ^ (uint64_t)(unsigned)mesh->triangle[t / 3][t % 3]) * 1099511628211u;
        assert_true(seen[last] == 0 || seen[last] == hash);
        seen[last] = hash;
        rig_push(rig, true);
        rig_turn(rig, true);
        assert_int_equal(rig->mesh.topology, last);
        assert_int_equal(rig->mesh.node_count, mesh->node_count);
        assert_memory_equal(rig->mesh.id, mesh->id, (size_t)mesh->node_count * sizeof(int));
    }
    assert_in_range(last, TICKS / 4, NUMBERS);
    free(seen);
}

static size_t bytes_for_meshes(const Rig *rig)
{
    size_t bytes = 0;
    for (int i = 0; i < rig->world.arena.count; i++) {
        const ArenaBlock *block = &rig->world.arena.block[i];
        if (strcmp(block->name, "run/mesh_toy") == 0 || strstr(block->name, "delta") != NULL)
            bytes += block->bytes;
    }
    return bytes;
}

TEST(a_body_that_never_changes_pays_for_no_copy)
{
    SCOPED(rig_end) Rig *rig = rig_begin(false, 1.0);
    assert_int_equal(bytes_for_meshes(rig), 0);
    assert_int_equal(rig->exchange.mesh_at[0], 0);
    // A frame holds its positions and velocities and no more (rounded up to 64 bytes).
    size_t values = 6 * (size_t)rig->toy.state.node_count * sizeof(float);
    assert_true(rig->exchange.frame[0].stride < sizeof(Frame) + values + 64);
    assert_ptr_equal(rig->bus->body[0].mesh.id, rig->toy.state.id);
    rig_push(rig, false);
    rig_run(rig, 2000000000);
    assert_int_equal(rig->deltas, 0);
    assert_in_range(rig->wholes, 2, 3);
    expect_rig_followed(rig);
    rig_end(&rig);
    rig = rig_begin(true, 1.0);
    assert_true(bytes_for_meshes(rig) > 0);
}
