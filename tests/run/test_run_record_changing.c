// SPDX-License-Identifier: MIT
// Recordings of a body whose mesh changes: every frame in the file has its own mesh, without free
// slots, whatever was dropped on the way from the step thread to the file.
#include "test.h"
#include "mesh_check.h"
#include "mesh_toy.h"
#include "random.h"
#include "recording_view.h"
#include "run/files_thread.h"
#include "scratch_folder.h"

// A scene of a toy that changes and one that does not, and the recording of both.
typedef struct Rig {
    MeshToy toy, still;
    World world;
    Scene scene;
    Exchange exchange;
    Recorder recorder;
    RecordFrame *frame; // for the way offline
    int dropped;
} Rig;

static void rig_create(Rig *rig, const char *name)
{
    Status status = {0};
    memset(rig, 0, sizeof *rig);
    mesh_toy_create(&rig->toy, false, 31);
    mesh_toy_create(&rig->still, true, 32);
    const SimOptions options = {.rate_hz = 1000.0, .may_load = false};
    rig->world.sim = sim_create(&options, &rig->world.arena, &rig->world.state);
    Body body = mesh_toy_body(&rig->still, "still", false, &rig->world.state);
    sim_add_body(rig->world.sim, &body);
    body = mesh_toy_body(&rig->toy, "toy", true, &rig->world.state);
    sim_add_body(rig->world.sim, &body);
    rig->scene.text = strdup("a scene");
    const ExchangeOptions exchange = {.records = true, .nodes_hz = 60.0};
    exchange_create(&rig->exchange, &rig->world, &exchange);
    expect_ok(recorder_create(&rig->recorder, scratch_at(name), &rig->world, &rig->scene, &status),
              status);
    rig->frame = malloc(record_frame_bytes(rig->world.sim));
}

static void rig_change(Rig *rig)
{
    mesh_toy_change(&rig->toy);
    sim_body(rig->world.sim, 1)->mesh = mesh_toy_mesh(&rig->toy);
}

// The scene's clock is stopped: the toy's moves are its ticks.
static void stamp(const Rig *rig, RecordFrame *frame)
{
    frame->step = rig->toy.state.moves;
    frame->time = 1e-3 * (double)frame->step;
}

// The step thread's part of a frame.
static void push(Rig *rig)
{
    Sim *sim = rig->world.sim;
    rig->toy.state.moves++;
    rig->still.state.moves++;
    RecordFrame *frame = record_find_room(&rig->exchange, sim);
    if (frame == NULL) {
        rig->dropped++;
        return;
    }
    RecordBody *to = record_frame_begin(frame, sim);
    for (int i = 0; i < 2; i++)
        to = record_body(to, sim_body(sim, i), exchange_push_frame(&rig->exchange, sim, i, false));
    stamp(rig, frame);
    ring_publish(&rig->exchange.recorded);
}

// The files thread's.
static void pull(Rig *rig, int frames)
{
    const RecordFrame *frame;
    while (frames-- > 0 && (frame = ring_peek(&rig->exchange.recorded)) != NULL) {
        assert_true(recorder_take_meshes(&rig->recorder, &rig->exchange, frame));
        assert_true(recorder_write_frame(&rig->recorder, frame));
        ring_pop(&rig->exchange.recorded);
    }
}

static void rig_close(Rig *rig)
{
    Status status = {0};
    expect_ok(recorder_close(&rig->recorder, &status), status);
    world_destroy(&rig->world);
    free(rig->scene.text);
    free(rig->frame);
}

static int node_of(int id)
{
    return id < 500 ? id - 10 : 1000 - id;
}

// A topology of the file as a mesh, its parents from the hierarchy, is one without cracks.
static void expect_topology(const MeshToy *toy, const BodyView *view, int at)
{
    int origin[TOY_NODES], parent[TOY_NODES][2], piece[TOY_NODES] = {0};
    signed char level[TOY_NODES];
    int nodes = view->node_count[at];
    const int32_t *id = view->node_id + view->first_node[at];
    assert_in_range(nodes, toy->base.node_count, TOY_NODES);
    for (int i = 0; i < nodes; i++) {
        assert_in_range(id[i], 0, 1000);
        int node = node_of(id[i]);
        origin[i] = id[i];
        level[i] = toy->node_level[node];
        for (int k = 0; k < 2; k++) {
            int up = toy->node_parent[node][k];
            parent[i][k] = toy->node_level[up] == 0 ? 10 + up : 1000 - up;
        }
    }
    const BodyMesh mesh = {.topology = view->number[at],
                           .node_count = nodes,
                           .triangle_count = view->triangle_count[at],
                           .node_capacity = TOY_NODES,
                           .triangle_capacity = TOY_FACES,
                           .triangle = (const int(*)[3])(view->triangle + view->first_triangle[at]),
                           .id = id,
                           .origin = origin,
                           .parent = (const int(*)[2])parent,
                           .piece = piece,
                           .level = level};
    expect_crack_free(&mesh, &toy->base, NULL);
    for (int t = 0; t < mesh.triangle_count; t++) // no free one
        assert_true(mesh.triangle[t][0] != mesh.triangle[t][1]);
}

// Every frame shows each of its nodes where that node was at one moment.
static int expect_recording(const Rig *rig, const char *name)
{
    char path[SCRATCH_PATH], xdmf[64];
    SCOPED(view_close) hid_t file = view_open(scratch_path(&scratch_space, name, path), false);
    assert_true(file >= 0);
    SCOPED(view_free) BodyView view, still;
    view_body(&view, file, "toy");
    view_body(&still, file, "still");
    assert_int_equal(still.topologies, 1);
    assert_int_equal(still.frames, view.frames);
    int before = 0, at = 0;
    for (int f = 0; f < view.frames; f++) {
        while (view.number[at] != view.topology[f])
            at++; // in the order of the frames
        assert_int_equal(view.count[f], view.node_count[at]);
        int moves = (int)lround((double)still.position[still.first[f]][2] / 0.125);
        assert_true(moves > before);
        before = moves;
        for (int i = 0; i < view.count[f]; i++) {
            int node = node_of(view.node_id[view.first_node[at] + i]);
            const float *position = view.position[view.first[f] + i];
            // Multiples of 1/16 of small numbers: exact in float.
            expect_near((double)position[0], rig->toy.rest[node].x, 0.0);
            expect_near((double)position[1], rig->toy.rest[node].y, 0.0);
            expect_near((double)position[2], rig->toy.rest[node].z + 0.125 * moves, 0.0);
        }
    }
    for (int t = 0; t < view.topologies; t++)
        expect_topology(&rig->toy, &view, t);
    snprintf(xdmf, sizeof xdmf, "%s.xdmf", name);
    int count, frames = view.frames;
    FREED SidecarFrame *frame = view_sidecar(scratch_path(&scratch_space, xdmf, path), &count);
    assert_int_equal(count, 2 * frames);
    expect_sidecar_matches(frame, count, &view, "toy");
    expect_sidecar_matches(frame, count, &still, "still");
    return frames;
}

static void rig_destroy(Rig *rig)
{
    mesh_toy_destroy(&rig->toy);
    mesh_toy_destroy(&rig->still);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(every_frame_has_its_mesh)
{
    SCOPED(rig_destroy) Rig rig;
    rig_create(&rig, "a.h5");
    for (int n = 0; n < 200; n++) {
        if (n % 3 == 0)
            rig_change(&rig);
        push(&rig);
        pull(&rig, 1);
    }
    rig_close(&rig);
    assert_int_equal(rig.dropped, 0);
    assert_int_equal(expect_recording(&rig, "a.h5"), 200);
}

// A disk that is slow now and then: frames are lost, and meshes with them, but none is mixed up.
TEST(what_is_dropped_is_dropped_whole)
{
    SCOPED(rig_destroy) Rig rig;
    uint64_t random = 4;
    rig_create(&rig, "b.h5");
    for (int n = 0; n < 1000; n++) {
        if (random_below(&random, 2) == 0)
            rig_change(&rig);
        push(&rig);
        if (n % 100 > 60)
            pull(&rig, random_below(&random, 6));
    }
    pull(&rig, 1000);
    rig_close(&rig);
    assert_in_range(rig.dropped, 100, 900);
    assert_int_equal(expect_recording(&rig, "b.h5"), 1000 - rig.dropped);
}

TEST(off_line_the_meshes_come_from_the_body)
{
    SCOPED(rig_destroy) Rig rig;
    rig_create(&rig, "c.h5");
    for (int n = 0; n < 60; n++) {
        rig_change(&rig);
        rig.toy.state.moves++;
        rig.still.state.moves++;
        record_frame_take(rig.frame, rig.world.sim);
        stamp(&rig, rig.frame);
        for (int i = 0; i < 2; i++)
            assert_true(
                recorder_follow_mesh(&rig.recorder, i, &sim_body(rig.world.sim, i)->mesh, NULL));
        assert_true(recorder_write_frame(&rig.recorder, rig.frame));
    }
    rig_close(&rig);
    assert_int_equal(expect_recording(&rig, "c.h5"), 60);
}
