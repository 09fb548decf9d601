// SPDX-License-Identifier: MIT
// Chunked frames and meshes come together again whatever their order, and hostile chunks do
// nothing.
#include "test.h"
#include "frames.h"

#include "pliant_mesh_t.h"
#include "pliant_nodes_t.h"

enum { NODES = 7, PER_CHUNK = 3, CHUNKS = 3 };

static FramesResult add_nodes(NodesFrame *frame, const pliant_nodes_t *chunk)
{
    size_t size = (size_t)pliant_nodes_t_encoded_size(chunk);
    FREED void *data = malloc(size);
    assert_non_null(data);
    assert_int_equal(pliant_nodes_t_encode(data, 0, (int)size, chunk), size);
    return nodes_frame_add(frame, data, size);
}

static FramesResult add_mesh(MeshFrame *frame, const pliant_mesh_t *chunk)
{
    size_t size = (size_t)pliant_mesh_t_encoded_size(chunk);
    FREED void *data = malloc(size);
    assert_non_null(data);
    assert_int_equal(pliant_mesh_t_encode(data, 0, (int)size, chunk), size);
    return mesh_frame_add(frame, data, size);
}

// Chunk `k` of frame `sequence`; coordinate c of node i is 10 i + c + 100 sequence. Valid until the
// next call.
static pliant_nodes_t nodes_chunk(int sequence, int k)
{
    static float position[3 * PER_CHUNK];
    int first = k * PER_CHUNK, count = NODES - first < PER_CHUNK ? NODES - first : PER_CHUNK;
    for (int i = 0; i < 3 * count; i++)
        position[i] = (float)(10 * (first + i / 3) + i % 3 + 100 * sequence);
    return (pliant_nodes_t){.utime = 1000 + sequence,
                            .sequence = sequence,
                            .step = 16 * sequence,
                            .time = 0.016 * sequence,
                            .topology = 4,
                            .node_count = NODES,
                            .chunk = k,
                            .chunk_count = CHUNKS,
                            .first = first,
                            .num_values = 3 * count,
                            .position = position};
}

static FramesResult add_nodes_chunk(NodesFrame *frame, int sequence, int k)
{
    pliant_nodes_t chunk = nodes_chunk(sequence, k);
    return add_nodes(frame, &chunk);
}

static void check_frame(const NodesFrame *frame, int sequence)
{
    assert_true(frame->head.whole);
    assert_int_equal(frame->head.count, NODES);
    assert_int_equal(frame->head.topology, 4);
    assert_int_equal(frame->step, 16 * sequence);
    for (int i = 0; i < 3 * NODES; i++) // small integers: exact in float
        expect_near((double)frame->position[i], 10.0 * (i / 3) + i % 3 + 100.0 * sequence, 0.0);
}

TEST(chunks_in_any_order_make_the_frame)
{
    static const int order[6][CHUNKS] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                         {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    SCOPED(nodes_frame_destroy) NodesFrame frame = {0};
    for (int n = 0; n < 6; n++) {
        assert_int_equal(add_nodes_chunk(&frame, n, order[n][0]), FRAMES_MORE);
        assert_int_equal(add_nodes_chunk(&frame, n, order[n][1]), FRAMES_MORE);
        assert_int_equal(add_nodes_chunk(&frame, n, order[n][2]), FRAMES_WHOLE);
        check_frame(&frame, n);
    }
    assert_int_equal(frame.head.lost, 0);
}

TEST(repeated_chunks_do_not_complete_a_frame)
{
    SCOPED(nodes_frame_destroy) NodesFrame frame = {0};
    for (int k = 0; k < 2 * CHUNKS; k++)
        assert_int_equal(add_nodes_chunk(&frame, 0, k % 2), FRAMES_MORE);
    assert_int_equal(add_nodes_chunk(&frame, 0, 2), FRAMES_WHOLE);
    assert_int_equal(add_nodes_chunk(&frame, 0, 2), FRAMES_STALE); // already handed out
}

TEST(newer_frame_replaces_an_unfinished_one_and_late_chunks_are_dropped)
{
    SCOPED(nodes_frame_destroy) NodesFrame frame = {0};
    add_nodes_chunk(&frame, 1, 0);
    add_nodes_chunk(&frame, 1, 1);
    assert_int_equal(add_nodes_chunk(&frame, 2, 0), FRAMES_MORE);
    assert_int_equal(frame.head.lost, 1);
    assert_int_equal(add_nodes_chunk(&frame, 1, 2), FRAMES_STALE);
    add_nodes_chunk(&frame, 2, 1);
    assert_int_equal(add_nodes_chunk(&frame, 2, 2), FRAMES_WHOLE);
    check_frame(&frame, 2);
}

TEST(frames_of_which_nothing_came_are_counted)
{
    SCOPED(nodes_frame_destroy) NodesFrame frame = {0};
    for (int k = 0; k < CHUNKS; k++)
        add_nodes_chunk(&frame, 3, k);
    add_nodes_chunk(&frame, 7, 0); // 4, 5 and 6 are missing
    assert_int_equal(frame.head.lost, 3);
    add_nodes_chunk(&frame, 8, 0); // and 7 never became whole
    assert_int_equal(frame.head.lost, 4);
}

TEST(daemon_that_starts_anew_is_followed_at_once)
{
    SCOPED(nodes_frame_destroy) NodesFrame frame = {0};
    for (int k = 0; k < CHUNKS; k++)
        add_nodes_chunk(&frame, 20, k);
    for (int k = 0; k < CHUNKS; k++) { // counts from 0 again, but later by the clock
        pliant_nodes_t chunk = nodes_chunk(0, k);
        chunk.utime = 5000;
        assert_int_equal(add_nodes(&frame, &chunk), k + 1 < CHUNKS ? FRAMES_MORE : FRAMES_WHOLE);
    }
    check_frame(&frame, 0);
}

// A member of a message that gets a bad value.
typedef struct Fault {
    const char *name;
    size_t at;
    int32_t value;
} Fault;
#define OF_NODES(member) #member, offsetof(pliant_nodes_t, member)
#define OF_MESH(member)  #member, offsetof(pliant_mesh_t, member)

TEST(hostile_sizes_are_refused_and_leave_the_frame_alone)
{
    static const Fault FAULTS[] = {
        {OF_NODES(node_count), 0},
        {OF_NODES(node_count), -1},
        {OF_NODES(node_count), FRAMES_NODES_MAX + 1},
        {OF_NODES(node_count), INT32_MAX},
        {OF_NODES(chunk), -1},
        {OF_NODES(chunk), CHUNKS},
        {OF_NODES(chunk_count), INT32_MAX},
        {OF_NODES(first), -1},
        {OF_NODES(first), NODES - 1},
        {OF_NODES(first), INT32_MAX},
        {OF_NODES(num_values), 8},
        {OF_NODES(topology), 5}, // contradicts its own frame
    };
    SCOPED(nodes_frame_destroy) NodesFrame frame = {0};
    add_nodes_chunk(&frame, 3, 0);
    for (size_t k = 0; k < sizeof FAULTS / sizeof *FAULTS; k++) {
        pliant_nodes_t chunk = nodes_chunk(3, 1);
        *(int32_t *)((char *)&chunk + FAULTS[k].at) = FAULTS[k].value;
        if (add_nodes(&frame, &chunk) != FRAMES_REFUSED)
            fail_msg("taken: %s = %d", FAULTS[k].name, FAULTS[k].value);
    }
    assert_int_equal(frame.head.refused, 12);
    assert_int_equal(frame.head.lost, 0);
    add_nodes_chunk(&frame, 3, 1);
    assert_int_equal(add_nodes_chunk(&frame, 3, 2), FRAMES_WHOLE);
    check_frame(&frame, 3);
}

// A chunk of one node takes no memory of a mesh that has not come.
TEST(nodes_take_the_memory_of_their_mesh)
{
    NodesFrame frame = {.head.mesh_nodes = 2 * FRAMES_NODES_FREE};
    pliant_nodes_t chunk = nodes_chunk(1, 0);
    chunk.node_count = 2 * FRAMES_NODES_FREE + 1;
    assert_int_equal(add_nodes(&frame, &chunk), FRAMES_REFUSED);
    assert_int_equal(frame.head.held, 0);
    chunk.node_count--;
    assert_int_equal(add_nodes(&frame, &chunk), FRAMES_MORE);
    // What the mesh allows outlasts a change of size.
    chunk.sequence++;
    chunk.node_count = FRAMES_NODES_FREE;
    assert_int_equal(add_nodes(&frame, &chunk), FRAMES_MORE);
    assert_int_equal(frame.head.mesh_nodes, 2 * FRAMES_NODES_FREE);
    nodes_frame_destroy(&frame);
}

// All frames of a process share a budget: what does not fit is refused, and has its chance again.
TEST(frames_beyond_the_budget_are_refused_without_an_end_of_the_program)
{
    enum { MOST = 64 };
    static NodesFrame frame[MOST];
    pliant_nodes_t chunk = nodes_chunk(1, 0);
    chunk.node_count = FRAMES_NODES_MAX;
    int taken = 0;
    for (int i = 0; i < MOST; i++)
        frame[i].head.mesh_nodes = FRAMES_NODES_MAX;
    while (taken < MOST && add_nodes(&frame[taken], &chunk) == FRAMES_MORE)
        taken++;
    // 18 bytes a node: 14 such frames are the last below 1 GiB.
    assert_int_equal(taken, 14);
    assert_int_equal(frame[taken].head.refused, 1);
    assert_int_equal(frame[taken].head.held, 0);
    nodes_frame_destroy(&frame[0]);
    assert_int_equal(add_nodes(&frame[taken], &chunk), FRAMES_MORE);
    for (int i = 0; i <= taken; i++)
        nodes_frame_destroy(&frame[i]);
}

// A tetrahedron in two chunks: triangles first, then the rest with the nodes.
static pliant_mesh_t mesh_chunk(int k)
{
    static int32_t triangle[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    static int32_t id[4] = {10, 11, 12, -1}, parent[8];
    static int8_t level[4];
    pliant_mesh_t chunk = {.topology = 2, .node_count = 4, .triangle_count = 4, .chunk_count = 2};
    chunk.chunk = k;
    chunk.first_triangle = k ? 3 : 0;
    chunk.num_indices = k ? 3 : 9;
    chunk.triangle = triangle[chunk.first_triangle];
    chunk.num_nodes = k ? 4 : 0;
    chunk.num_parents = 2 * chunk.num_nodes;
    chunk.id = chunk.origin = chunk.piece = id;
    chunk.parent = parent;
    chunk.level = level;
    return chunk;
}

static FramesResult add_mesh_chunk(MeshFrame *frame, int sequence, int k, int topology)
{
    pliant_mesh_t chunk = mesh_chunk(k);
    chunk.sequence = sequence;
    chunk.utime = 1000000 * sequence;
    chunk.topology = topology;
    return add_mesh(frame, &chunk);
}

// On a link that loses much no mesh ever comes whole; its halves do.
TEST(what_is_missing_of_a_mesh_may_come_with_the_next)
{
    SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
    assert_int_equal(add_mesh_chunk(&frame, 1, 0, 2), FRAMES_MORE);
    assert_int_equal(add_mesh_chunk(&frame, 2, 0, 2), FRAMES_MORE);
    assert_int_equal(add_mesh_chunk(&frame, 4, 1, 2), FRAMES_WHOLE);
    assert_int_equal(frame.triangle[5], 3);
    assert_int_equal(frame.id[0], 10);
    assert_int_equal(frame.lost, 0);
    // But only of the same one, and not of a daemon that counts anew.
    assert_int_equal(add_mesh_chunk(&frame, 5, 0, 3), FRAMES_MORE);
    assert_int_equal(add_mesh_chunk(&frame, 6, 1, 4), FRAMES_MORE);
    assert_int_equal(add_mesh_chunk(&frame, 7, 0, 3), FRAMES_MORE);
    assert_int_equal(add_mesh_chunk(&frame, 1, 1, 3), FRAMES_MORE);
    assert_int_equal(frame.topology, 2);
}

TEST(mesh_chunks_make_the_mesh)
{
    for (int first = 0; first < 2; first++) {
        SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
        pliant_mesh_t chunk = mesh_chunk(first);
        assert_int_equal(add_mesh(&frame, &chunk), FRAMES_MORE);
        chunk = mesh_chunk(1 - first);
        assert_int_equal(add_mesh(&frame, &chunk), FRAMES_WHOLE);
        assert_int_equal(frame.triangle[5], 3);
        assert_int_equal(frame.triangle[9], 0);
        assert_int_equal(frame.id[0], 10);
        assert_int_equal(frame.id[3], -1);
    }
}

TEST(what_was_lost_of_a_mesh_comes_with_its_next_sending)
{
    MeshFrame frame = {0};
    for (int sequence = 1; sequence <= 2; sequence++) { // of each sending another half arrives
        pliant_mesh_t chunk = mesh_chunk(sequence - 1);
        chunk.sequence = sequence;
        assert_int_equal(add_mesh(&frame, &chunk), sequence == 2 ? FRAMES_WHOLE : FRAMES_MORE);
    }
    assert_int_equal(frame.lost, 0);
    mesh_frame_destroy(&frame);
    // Another topology, or a daemon that starts anew, is another mesh.
    for (int other = 0; other < 2; other++) {
        pliant_mesh_t chunk = mesh_chunk(0);
        chunk.utime = 1;
        chunk.sequence = 5;
        assert_int_equal(add_mesh(&frame, &chunk), FRAMES_MORE);
        chunk = mesh_chunk(1);
        chunk.utime = 2;
        chunk.sequence = other == 0 ? 6 : 1;
        chunk.topology += other == 0;
        assert_int_equal(add_mesh(&frame, &chunk), FRAMES_MORE);
        assert_int_equal(frame.lost, 1);
        mesh_frame_destroy(&frame);
    }
}

TEST(mesh_with_an_index_outside_is_refused)
{
    static const Fault FAULTS[] = {
        {OF_MESH(first_triangle), 2},
        {OF_MESH(num_indices), 8},
        {OF_MESH(num_parents), 2},
        {OF_MESH(triangle_count), FRAMES_TRIANGLES_MAX + 1},
    };
    enum { MEMBERS = sizeof FAULTS / sizeof *FAULTS };
    SCOPED(mesh_frame_destroy) MeshFrame frame = {0};
    for (int k = 0; k < MEMBERS + 2; k++) {
        int32_t triangle[9] = {0, 1, 2, 0, 1, 3, 0, 2, 3};
        pliant_mesh_t chunk = mesh_chunk(0);
        chunk.triangle = triangle;
        if (k < MEMBERS)
            *(int32_t *)((char *)&chunk + FAULTS[k].at) = FAULTS[k].value;
        else
            triangle[k == MEMBERS ? 4 : 8] = k == MEMBERS ? 4 : -1;
        if (add_mesh(&frame, &chunk) != FRAMES_REFUSED)
            fail_msg("taken: %s", k < MEMBERS ? FAULTS[k].name : "a corner");
        assert_false(frame.next.started);
    }
}

TEST(garbage_is_refused)
{
    unsigned char data[64] = {1, 2, 3};
    SCOPED(nodes_frame_destroy) NodesFrame nodes = {0};
    SCOPED(mesh_frame_destroy) MeshFrame mesh = {0};
    for (size_t size = 0; size <= sizeof data; size++) {
        assert_int_equal(nodes_frame_add(&nodes, data, size), FRAMES_REFUSED);
        assert_int_equal(mesh_frame_add(&mesh, data, size), FRAMES_REFUSED);
    }
}
