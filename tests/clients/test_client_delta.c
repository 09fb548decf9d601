// SPDX-License-Identifier: MIT
// Deltas of a mesh: what a client that has the mesh makes of good, late, lost and hostile ones.
// Long random sequences are with the bus that sends them (daemon/test_stream.c).
#include "test.h"
#include "frames.h"
#include "mesh_message.h"

#include "pliant_mesh_delta_t.h"

enum { NODES = 4, TRIANGLES = 3, DATA = 1024 };

static const int32_t id[NODES] = {10, 11, 12, 13}, parent[2 * NODES] = {10, 10, 11, 11, 12, 12};
static const int32_t triangle[3 * TRIANGLES] = {0, 1, 2, 0, 2, 3, 0, 0, 0};
static const int8_t level[NODES] = {0};

// The mesh of topology 5: two triangles, one free slot.
static FramesResult take_mesh(MeshFrame *frame, int sequence, int64_t utime)
{
    pliant_mesh_t mesh =
        mesh_message(sequence, utime, 5, NODES, id, parent, level, TRIANGLES, triangle);
    unsigned char data[DATA];
    int size = pliant_mesh_t_encode(data, 0, DATA, &mesh);
    assert_true(size > 0);
    return mesh_frame_add(frame, data, (size_t)size);
}

// A midpoint of nodes 0 and 2 comes in a fifth slot: 0-1-2 becomes 0-1-m and, in the free slot,
// m-1-2; 0-2-3 becomes 0-m-3 and, in a new slot, m-2-3.
typedef struct Delta {
    pliant_mesh_delta_t message;
    int32_t triangle_slot[4], triangle[12], node_slot[1], id[1], origin[1], parent[2], piece[1];
    int8_t level[1];
} Delta;

static void make_delta(Delta *delta)
{
    *delta = (Delta){.triangle_slot = {0, 1, 2, 3},
                     .triangle = {0, 1, 4, 0, 4, 3, 4, 1, 2, 4, 2, 3},
                     .node_slot = {4},
                     .id = {70},
                     .origin = {10},
                     .parent = {10, 12},
                     .piece = {3},
                     .level = {1}};
    delta->message = (pliant_mesh_delta_t){.utime = 100,
                                           .sequence = 1,
                                           .from_topology = 5,
                                           .topology = 6,
                                           .node_count = 5,
                                           .triangle_count = 4,
                                           .chunk_count = 1,
                                           .num_triangles = 4,
                                           .num_indices = 12,
                                           .triangle_slot = delta->triangle_slot,
                                           .triangle = delta->triangle,
                                           .num_nodes = 1,
                                           .num_parents = 2,
                                           .node_slot = delta->node_slot,
                                           .id = delta->id,
                                           .origin = delta->origin,
                                           .parent = delta->parent,
                                           .piece = delta->piece,
                                           .level = delta->level};
}

static FramesResult take(MeshFrame *frame, const pliant_mesh_delta_t *message)
{
    unsigned char data[DATA];
    int size = pliant_mesh_delta_t_encode(data, 0, DATA, message);
    assert_true(size > 0);
    return mesh_frame_add_delta(frame, data, (size_t)size);
}

static void expect_before(const MeshFrame *frame)
{
    assert_true(frame->whole);
    assert_int_equal(frame->topology, 5);
    assert_int_equal(frame->node_count, NODES);
    assert_int_equal(frame->triangle_count, TRIANGLES);
    assert_memory_equal(frame->id, id, sizeof id);
    assert_memory_equal(frame->triangle, triangle, sizeof triangle);
}

static void expect_after(const MeshFrame *frame)
{
    static const int32_t ids[5] = {10, 11, 12, 13, 70}, born_of[2] = {10, 12};
    static const int32_t triangles[12] = {0, 1, 4, 0, 4, 3, 4, 1, 2, 4, 2, 3};
    assert_true(frame->whole);
    assert_int_equal(frame->topology, 6);
    assert_int_equal(frame->node_count, 5);
    assert_int_equal(frame->triangle_count, 4);
    assert_memory_equal(frame->id, ids, sizeof ids);
    assert_memory_equal(frame->parent + 8, born_of, sizeof born_of);
    assert_int_equal(frame->origin[0], 10); // of the mesh before
    assert_int_equal(frame->piece[3], 13);
    assert_int_equal(frame->origin[4], 10); // of the delta
    assert_int_equal(frame->piece[4], 3);
    assert_int_equal(frame->level[4], 1);
    assert_memory_equal(frame->triangle, triangles, sizeof triangles);
}

TEST(a_delta_makes_the_next_mesh)
{
    SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
    Delta delta;
    make_delta(&delta);
    take_mesh(&frame, 1, 0);
    expect_before(&frame);
    assert_int_equal(take(&frame, &delta.message), FRAMES_WHOLE);
    expect_after(&frame);
    assert_int_equal(take(&frame, &delta.message), FRAMES_STALE);
    expect_after(&frame);
}

TEST(nothing_changes_before_the_last_chunk)
{
    for (int first = 0; first < 2; first++) {
        SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
        Delta delta;
        make_delta(&delta);
        pliant_mesh_delta_t part[2] = {delta.message, delta.message};
        for (int k = 0; k < 2; k++) {
            part[k].chunk = k;
            part[k].chunk_count = 2;
            part[k].num_triangles = 2;
            part[k].num_indices = 6;
            part[k].triangle_slot = delta.triangle_slot + 2 * k;
            part[k].triangle = delta.triangle + 6 * k;
            part[k].num_nodes = k;
            part[k].num_parents = 2 * k;
        }
        take_mesh(&frame, 1, 0);
        assert_int_equal(take(&frame, &part[first]), FRAMES_MORE);
        expect_before(&frame);
        assert_int_equal(take(&frame, &part[1 - first]), FRAMES_WHOLE);
        expect_after(&frame);
    }
}

TEST(a_delta_of_another_mesh_is_missed_and_a_whole_mesh_heals)
{
    SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
    Delta delta;
    make_delta(&delta);
    assert_int_equal(take(&frame, &delta.message), FRAMES_MISSED); // joined late
    assert_false(frame.whole);
    take_mesh(&frame, 1, 200);
    delta.message.sequence = 2;
    delta.message.from_topology = 4;
    assert_int_equal(take(&frame, &delta.message), FRAMES_MISSED);
    expect_before(&frame);
    delta.message.sequence = 3;
    delta.message.from_topology = 5;
    assert_int_equal(take(&frame, &delta.message), FRAMES_WHOLE);
    expect_after(&frame);
    assert_int_equal(frame.missed, 2);
}

// The mesh stays in use while a whole one arrives, and an older whole one does not undo a delta.
TEST(a_mesh_that_a_delta_overtook_is_given_up)
{
    SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
    Delta delta;
    make_delta(&delta);
    take_mesh(&frame, 1, 0);
    pliant_mesh_t half = mesh_message(2, 50, 5, NODES, id, parent, level, TRIANGLES, NULL);
    half.chunk_count = 2;
    half.num_indices = 0;
    unsigned char data[DATA];
    int size = pliant_mesh_t_encode(data, 0, DATA, &half);
    assert_int_equal(mesh_frame_add(&frame, data, (size_t)size), FRAMES_MORE);
    expect_before(&frame);
    assert_int_equal(take(&frame, &delta.message), FRAMES_WHOLE);
    half.chunk = 1;
    half.num_nodes = half.num_parents = 0;
    half.num_indices = 3 * TRIANGLES;
    half.triangle = (int32_t *)(uintptr_t)triangle;
    size = pliant_mesh_t_encode(data, 0, DATA, &half);
    assert_int_equal(mesh_frame_add(&frame, data, (size_t)size), FRAMES_STALE);
    expect_after(&frame);
    assert_int_equal(take_mesh(&frame, 3, 300), FRAMES_WHOLE); // a newer one counts
    expect_before(&frame);
}

#define OF(member) #member, offsetof(Delta, member)

TEST(hostile_deltas_are_refused_and_leave_the_mesh_alone)
{
    // A number that gets a bad value, of the message or of what it points to.
    static const struct {
        const char *name;
        size_t at;
        int32_t value;
    } bad[] = {
        {OF(message.node_count), 0},
        {OF(message.node_count), -1},
        {OF(message.node_count), FRAMES_NODES_MAX + 1},
        {OF(message.node_count), INT32_MAX},
        {OF(message.triangle_count), -1},
        {OF(message.triangle_count), FRAMES_TRIANGLES_MAX + 1},
        {OF(message.chunk), -1},
        {OF(message.chunk), 1},
        {OF(message.chunk_count), 0},
        {OF(message.chunk_count), INT32_MAX},
        {OF(triangle[7]), 5},
        {OF(triangle[0]), -1},
        {OF(triangle_slot[3]), 4},
        {OF(triangle_slot[0]), -1},
        {OF(node_slot[0]), 5},
        {OF(node_slot[0]), INT32_MIN},
        {OF(id[0]), -2},
        {OF(message.num_indices), 9},
        {OF(message.num_parents), 1},
    };
    enum { NUMBERS = sizeof bad / sizeof *bad, MORE_CHANGES_THAN_SLOTS = NUMBERS, NEEDED, COMES };
    for (int fault = 0; fault <= COMES; fault++) {
        MeshFrame frame = {0};
        Delta delta;
        make_delta(&delta);
        pliant_mesh_delta_t *m = &delta.message;
        take_mesh(&frame, 1, 0);
        if (fault < NUMBERS)
            *(int32_t *)((char *)&delta + bad[fault].at) = bad[fault].value;
        else if (fault == MORE_CHANGES_THAN_SLOTS)
            m->triangle_count = 3, delta.triangle_slot[3] = 2;
        else // a node goes that a triangle needs, one that stays or one that comes
            m->node_count = 3, m->num_nodes = m->num_parents = 0;
        if (fault == NEEDED)
            m->num_triangles = 1, m->num_indices = 3, delta.triangle[2] = 2;
        if (take(&frame, m) != FRAMES_REFUSED)
            fail_msg("fault %d: %s", fault,
                     fault < NUMBERS ? bad[fault].name : "of several members");
        expect_before(&frame);
        assert_int_equal(frame.refused, 1);
        // And the next good one is followed.
        make_delta(&delta);
        delta.message.sequence = 2;
        assert_int_equal(take(&frame, &delta.message), FRAMES_WHOLE);
        expect_after(&frame);
        mesh_frame_destroy(&frame);
    }
}

// 200 bytes that claim the largest mesh made a client take and fill 180 MB.
TEST(a_mesh_grows_by_no_more_than_came)
{
    SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
    Delta delta;
    make_delta(&delta);
    pliant_mesh_delta_t *m = &delta.message;
    take_mesh(&frame, 1, 0);
    const size_t held = frame.held;
    for (int k = 0; k < 4; k++) {
        m->sequence = k + 1;
        m->node_count = k == 0 ? FRAMES_NODES_MAX : k == 1 ? NODES + 2 : NODES + 1;
        m->triangle_count = k == 2 ? FRAMES_TRIANGLES_MAX : k == 3 ? TRIANGLES + 5 : TRIANGLES + 4;
        if (take(&frame, m) != FRAMES_REFUSED)
            fail_msg("case %d is taken", k);
        expect_before(&frame);
        assert_int_equal(frame.held, held);
    }
    m->sequence = 5;
    m->triangle_count = TRIANGLES + 4; // four come, if only one of them in a new slot
    assert_int_equal(take(&frame, m), FRAMES_WHOLE);
}

// Memory follows what has arrived, also of a whole mesh.
TEST(a_mesh_that_claims_much_holds_what_came_of_it)
{
    SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
    pliant_mesh_t m = mesh_message(1, 0, 5, NODES, id, parent, level, TRIANGLES, triangle);
    m.node_count = FRAMES_NODES_MAX;
    m.triangle_count = FRAMES_TRIANGLES_MAX;
    m.chunk_count = FRAMES_CHUNKS_MAX;
    m.first_node = FRAMES_NODES_MAX - NODES;
    unsigned char data[DATA];
    int size = pliant_mesh_t_encode(data, 0, DATA, &m);
    assert_int_equal(mesh_frame_add(&frame, data, (size_t)size), FRAMES_MORE);
    assert_in_range(frame.next.held, 1, 2 * DATA); // twice what came, with its slots
    // Chunks that name a slot twice do not make a mesh.
    m = mesh_message(2, 1, 6, 2, id, parent, level, 0, NULL);
    m.chunk_count = 2;
    m.num_nodes = 1;
    m.num_parents = 2;
    for (int k = 0; k < 2; k++) {
        m.chunk = k;
        size = pliant_mesh_t_encode(data, 0, DATA, &m);
        assert_int_equal(mesh_frame_add(&frame, data, (size_t)size),
                         k == 0 ? FRAMES_MORE : FRAMES_REFUSED);
    }
    assert_int_equal(frame.next.held, 0);
    assert_false(frame.whole);
}

TEST(slots_beyond_a_smaller_mesh_are_gone)
{
    SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
    Delta delta;
    make_delta(&delta);
    take_mesh(&frame, 1, 0);
    pliant_mesh_delta_t *m = &delta.message;
    m->node_count = 3; // node 3 goes with its triangle, which is slot 1
    m->triangle_count = 1;
    m->num_nodes = m->num_parents = m->num_triangles = m->num_indices = 0;
    assert_int_equal(take(&frame, m), FRAMES_WHOLE);
    assert_int_equal(frame.node_count, 3);
    assert_int_equal(frame.triangle_count, 1);
    assert_memory_equal(frame.triangle, triangle, 3 * sizeof *triangle);
    // What grows again, to what the mesh had before, is free until it is told.
    m->sequence = 2;
    m->from_topology = 6;
    m->topology = 7;
    m->node_count = NODES;
    m->triangle_count = 2;
    assert_int_equal(take(&frame, m), FRAMES_WHOLE);
    assert_int_equal(frame.id[2], 12);
    assert_int_equal(frame.id[3], -1);
    assert_int_equal(frame.triangle[3] | frame.triangle[4] | frame.triangle[5], 0);
}

TEST(garbage_is_no_delta)
{
    unsigned char data[64] = {1, 2, 3};
    SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
    for (size_t size = 0; size <= sizeof data; size++)
        assert_int_equal(mesh_frame_add_delta(&frame, data, size), FRAMES_REFUSED);
}
