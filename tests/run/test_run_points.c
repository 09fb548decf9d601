// SPDX-License-Identifier: MIT
// Positions in packets (points_t): what the bus packs and what a client unpacks, without threads,
// sockets or real time.
#include "test.h"
#include "frames.h"
#include "random.h"
#include "run/bus_points.h"

#include "pliant_nodes_t.h"
#include "pliant_points_t.h"

enum { NODES = 3000, ROOM = 1290, PACKETS = NODES };

typedef struct Cloud {
    float position[3 * NODES];
    int id[NODES];
} Cloud;

// A frame as packets.
typedef struct Sent {
    int count;
    struct {
        int32_t first, nodes, origin[3], bytes;
        float grid;
        uint8_t data[ROOM];
    } packet[PACKETS];
} Sent;

typedef enum Shape { WALK, SCATTERED, ONE_PLACE, FAR_AWAY, SHAPES } Shape;

// Neighbours follow one another, or do not; 10 cm large, all in one place, or 100 km away.
static void make_cloud(Cloud *cloud, Shape shape, uint64_t *random)
{
    Vec3 at = shape == FAR_AWAY ? vec3(1e5, -1e5, 3e4) : vec3(0.1, -0.2, 0.3);
    for (int i = 0; i < NODES; i++) {
        double reach = shape == WALK || shape == FAR_AWAY ? 2e-3 : shape == SCATTERED ? 0.1 : 0.0;
        Vec3 x = vec3_add(at, vec3_scale(reach, random_vec3(random)));
        at = shape == SCATTERED ? at : x;
        // One in nine is a free slot, which holds what it will.
        cloud->id[i] = random_below(random, 9) == 0 ? -1 : i;
        bool free_slot = cloud->id[i] < 0;
        cloud->position[3 * i] = free_slot ? 1e30f : (float)x.x;
        cloud->position[3 * i + 1] = free_slot ? nanf("") : (float)x.y;
        cloud->position[3 * i + 2] = free_slot ? -INFINITY : (float)x.z;
    }
}

static void pack_all(const Cloud *cloud, float grid, Sent *sent)
{
    sent->count = 0;
    for (int first = 0; first < NODES;) {
        int k = sent->count++;
        sent->packet[k].first = first;
        sent->packet[k].grid = grid;
        sent->packet[k].nodes =
            points_pack(cloud->position + 3 * first, cloud->id + first, NODES - first, grid, ROOM,
                        sent->packet[k].origin, sent->packet[k].data, &sent->packet[k].bytes);
        assert_in_range(sent->packet[k].nodes, 1, POINTS_IN_PACKET);
        assert_in_range(sent->packet[k].bytes, 1, ROOM);
        first += sent->packet[k].nodes;
    }
}

static pliant_points_t packet_of(Sent *sent, int k, int sequence)
{
    pliant_points_t packet = {.utime = 1000 + sequence,
                              .sequence = sequence,
                              .step = 16 * sequence,
                              .time = 0.016 * sequence,
                              .topology = 4,
                              .node_count = NODES,
                              .first = sent->packet[k].first,
                              .count = (int16_t)sent->packet[k].nodes,
                              .grid = sent->packet[k].grid,
                              .num_bytes = sent->packet[k].bytes,
                              .data = sent->packet[k].data};
    memcpy(packet.origin, sent->packet[k].origin, sizeof packet.origin);
    return packet;
}

static FramesResult add(NodesFrame *frame, const pliant_points_t *packet)
{
    size_t size = (size_t)pliant_points_t_encoded_size(packet);
    FREED void *data = malloc(size); // exactly: a reader beyond its end is found
    assert_non_null(data);
    assert_int_equal(pliant_points_t_encode(data, 0, (int)size, packet), size);
    return nodes_frame_add(frame, data, size);
}

static FramesResult add_packet(NodesFrame *frame, Sent *sent, int k, int sequence)
{
    const pliant_points_t packet = packet_of(sent, k, sequence);
    return add(frame, &packet);
}

static void expect_near_cloud(const NodesFrame *frame, const Cloud *cloud, int first, int end,
                              float grid)
{
    for (int i = 3 * first; i < 3 * end; i++) {
        assert_true(isfinite(frame->position[i]));
        // Half a step, and what a float rounds far away.
        if (cloud->id[i / 3] >= 0)
            expect_near((double)frame->position[i], (double)cloud->position[i],
                        0.5 * (double)grid +
                            1e-7 * fabs((double)cloud->position[i]) * (grid > POINTS_GRID));
    }
}

// --- what is packed ------------------------------------------------------------------------------

TEST(positions_come_back_within_half_a_step)
{
    FREED Cloud *cloud = malloc(sizeof *cloud);
    FREED Sent *sent = malloc(sizeof *sent);
    uint64_t random = 5;
    for (int n = 0; n < 5 * SHAPES; n++) {
        SCOPED(nodes_frame_destroy) NodesFrame frame = {0};
        make_cloud(cloud, (Shape)(n % SHAPES), &random);
        float grid = points_grid(cloud->position, cloud->id, NODES);
        assert_true((grid == POINTS_GRID) == (n % SHAPES != FAR_AWAY));
        pack_all(cloud, grid, sent);
        for (int k = 0; k < sent->count; k++)
            assert_int_equal(add_packet(&frame, sent, k, 1),
                             k + 1 < sent->count ? FRAMES_MORE : FRAMES_WHOLE);
        expect_near_cloud(&frame, cloud, 0, NODES, grid);
        assert_int_equal(frame.head.refused, 0);
    }
}

TEST(each_packet_stands_alone)
{
    FREED Cloud *cloud = malloc(sizeof *cloud);
    FREED Sent *sent = malloc(sizeof *sent);
    uint64_t random = 6;
    make_cloud(cloud, SCATTERED, &random);
    pack_all(cloud, POINTS_GRID, sent);
    for (int k = 0; k < sent->count; k++) {
        SCOPED(nodes_frame_destroy) NodesFrame frame = {0};
        int first = sent->packet[k].first, end = first + sent->packet[k].nodes;
        assert_true(add_packet(&frame, sent, k, 1) != FRAMES_REFUSED);
        expect_near_cloud(&frame, cloud, first, end, POINTS_GRID);
        assert_int_equal(frame.head.parts.arrived, end - first);
    }
}

// Neighbours in the order of their slots cost less than half of the 12 bytes of three floats, and
// nodes in no order at all little more.
TEST(packets_take_half_of_the_bytes)
{
    static const double most[SHAPES] = {
        [WALK] = 5.0, [SCATTERED] = 6.8, [ONE_PLACE] = 1.4, [FAR_AWAY] = 5.0};
    FREED Cloud *cloud = malloc(sizeof *cloud);
    FREED Sent *sent = malloc(sizeof *sent);
    uint64_t random = 7;
    for (int shape = 0; shape < SHAPES; shape++) {
        make_cloud(cloud, (Shape)shape, &random);
        pack_all(cloud, points_grid(cloud->position, cloud->id, NODES), sent);
        int64_t bytes = 0;
        for (int k = 0; k < sent->count; k++)
            bytes += PACKET_BYTES - ROOM + sent->packet[k].bytes;
        expect_at_most((double)bytes / NODES, most[shape]);
    }
}

// All nodes from one packet.
static void unpack(NodesFrame *frame, int count, float grid, const int32_t origin[3], uint8_t *data,
                   int bytes)
{
    pliant_points_t packet = {
        .node_count = count, .count = count, .grid = grid, .num_bytes = bytes, .data = data};
    memcpy(packet.origin, origin, sizeof packet.origin);
    assert_int_equal(add(frame, &packet), FRAMES_WHOLE);
}

// The largest difference that there is takes 31 bits, not 32.
TEST(two_nodes_as_far_apart_as_the_grid_reaches)
{
    enum { COUNT = 8 };
    for (int n = 0; n < 2; n++) {
        // 4096 m is 2^29 steps, the next smaller float 32 steps less.
        float far = n == 0 ? 4096.0f : nextafterf(4096.0f, 0.0f);
        float position[3 * COUNT];
        int id[COUNT], bytes;
        for (int i = 0; i < COUNT; i++)
            id[i] = i;
        for (int i = 0; i < 3 * COUNT; i++)
            position[i] = i / 3 % 2 ? -far : far;
        float grid = points_grid(position, id, COUNT);
        assert_true(grid == (n == 0 ? 2.0f * POINTS_GRID : POINTS_GRID));
        int32_t origin[3];
        uint8_t data[POINTS_LEAST_BYTES]; // enough for any eight
        int count = points_pack(position, id, COUNT, grid, sizeof data, origin, data, &bytes);
        assert_int_equal(count, COUNT);
        SCOPED(nodes_frame_destroy) NodesFrame frame = {0};
        unpack(&frame, COUNT, grid, origin, data, bytes);
        for (int i = 0; i < 3 * COUNT; i++)
            assert_true(frame.position[i] == position[i]); // numbers of the grid
    }
}

// What has no place on any grid still gives a packet of finite numbers.
TEST(numbers_out_of_range_are_packed_as_finite_ones)
{
    enum { COUNT = 4 };
    const float position[3 * COUNT] = {NAN,  INFINITY, -INFINITY, 3e38f, -3e38f, 1e30f,
                                       0.0f, -0.0f,    1e-40f,    1.0f,  2.0f,   3.0f};
    const int id[COUNT] = {0, 1, 2, 3};
    int32_t origin[3];
    int bytes;
    uint8_t data[POINTS_LEAST_BYTES];
    for (int coarse = 0; coarse < 2; coarse++) {
        float grid = coarse ? points_grid(position + 3, id, 1) : POINTS_GRID;
        assert_true(isfinite(grid) && isfinite(points_grid(position, id, COUNT)));
        int count = points_pack(position, id, COUNT, grid, sizeof data, origin, data, &bytes);
        assert_int_equal(count, COUNT);
        SCOPED(nodes_frame_destroy) NodesFrame frame = {0};
        unpack(&frame, COUNT, grid, origin, data, bytes);
        for (int i = 0; i < 3 * COUNT; i++)
            assert_true(isfinite(frame.position[i]));
    }
}

// --- what a client makes of it -------------------------------------------------------------------

typedef struct Rig {
    Cloud cloud;
    Sent sent;
    NodesFrame frame;
} Rig;

static Rig *rig_create(void)
{
    Rig *rig = calloc(1, sizeof *rig);
    uint64_t random = 8;
    assert_non_null(rig);
    make_cloud(&rig->cloud, SCATTERED, &random);
    pack_all(&rig->cloud, POINTS_GRID, &rig->sent);
    assert_true(rig->sent.count >= 4);
    return rig;
}

static void rig_destroy(Rig *rig)
{
    nodes_frame_destroy(&rig->frame);
    free(rig);
}

// All packets but one; the result of the last that came.
static FramesResult add_but(Rig *rig, int missing, int sequence)
{
    FramesResult result = FRAMES_MORE;
    for (int k = 0; k < rig->sent.count; k++)
        if (k != missing)
            result = add_packet(&rig->frame, &rig->sent, k, sequence);
    return result;
}

TEST(a_lost_packet_leaves_its_nodes_as_they_were)
{
    Rig *rig = rig_create();
    const NodesFrame *frame = &rig->frame;
    // Until all nodes are known there is nothing to show.
    assert_int_equal(add_but(rig, 1, 1), FRAMES_MORE);
    assert_false(frame->ready);
    assert_int_equal(add_but(rig, 2, 2), FRAMES_PATCHED);
    assert_true(frame->ready && !frame->head.whole);
    int from = rig->sent.packet[2].first, end = from + rig->sent.packet[2].nodes;
    for (int i = 0; i < NODES; i++)
        assert_int_equal(frame->frame[i], i >= from && i < end ? 1 : 2);
    expect_near_cloud(frame, &rig->cloud, 0, NODES, POINTS_GRID);
    // The missing one comes late.
    assert_int_equal(add_packet(&rig->frame, &rig->sent, 2, 2), FRAMES_WHOLE);
    assert_int_equal(add_packet(&rig->frame, &rig->sent, 2, 2), FRAMES_STALE);
    assert_int_equal(frame->head.lost, 1);
    // Without the last packet nothing says that the frame is over; the next one shows it.
    assert_int_equal(add_but(rig, rig->sent.count - 1, 3), FRAMES_MORE);
    assert_int_equal(add_but(rig, 0, 4), FRAMES_PATCHED);
    assert_int_equal(frame->head.refused, 0);
    rig_destroy(rig);
}

TEST(nodes_of_another_mesh_are_not_patched_with)
{
    Rig *rig = rig_create();
    assert_int_equal(add_but(rig, -1, 1), FRAMES_WHOLE);
    FramesResult result = FRAMES_WHOLE;
    for (int k = 1; k < rig->sent.count; k++) {
        pliant_points_t packet = packet_of(&rig->sent, k, 2);
        packet.topology = 5;
        result = add(&rig->frame, &packet);
    }
    assert_int_equal(result, FRAMES_MORE);
    assert_false(rig->frame.ready);
    rig_destroy(rig);
}

TEST(positions_as_floats_are_kept_where_both_come)
{
    Rig *rig = rig_create();
    int half = NODES / 2;
    pliant_nodes_t chunk = {.utime = 1001,
                            .sequence = 1,
                            .step = 16,
                            .time = 0.016,
                            .topology = 4,
                            .node_count = NODES,
                            .chunk_count = 2,
                            .num_values = 3 * half};
    for (int i = 0; i < NODES; i++) // floats need finite numbers
        if (rig->cloud.id[i] < 0)
            memset(rig->cloud.position + 3 * i, 0, 3 * sizeof(float));
    chunk.position = rig->cloud.position;
    size_t size = (size_t)pliant_nodes_t_encoded_size(&chunk);
    FREED void *data = malloc(size);
    assert_int_equal(pliant_nodes_t_encode(data, 0, (int)size, &chunk), size);
    // The second chunk is lost; packets fill in, and nothing more.
    assert_int_equal(nodes_frame_add(&rig->frame, data, size), FRAMES_MORE);
    assert_int_equal(add_but(rig, -1, 1), FRAMES_WHOLE);
    assert_memory_equal(rig->frame.position, rig->cloud.position, 3 * (size_t)half * sizeof(float));
    expect_near_cloud(&rig->frame, &rig->cloud, half, NODES, POINTS_GRID);
    assert_int_equal(nodes_frame_add(&rig->frame, data, size), FRAMES_STALE);
    rig_destroy(rig);
}

TEST(packets_that_contradict_themselves_change_nothing)
{
    Rig *rig = rig_create();
    assert_int_equal(add_but(rig, -1, 1), FRAMES_WHOLE);
    const pliant_points_t good = packet_of(&rig->sent, 1, 2);
    uint8_t longer[ROOM + 1] = {0};
    memcpy(longer, good.data, (size_t)good.num_bytes);
    enum { WRONG = 15 };
    pliant_points_t bad[WRONG];
    for (int i = 0; i < WRONG; i++)
        bad[i] = good;
    bad[0].count = 0;
    bad[1].count = -8;
    bad[2].count = POINTS_IN_PACKET + 1;
    bad[3].count++; // its bits are not there
    bad[4].count = (int16_t)(bad[4].count - 8);
    bad[5].num_bytes--;
    bad[6].num_bytes++;
    bad[6].data = longer;
    bad[7].num_bytes = 0;
    bad[8].first = NODES - good.count + 1;
    bad[9].first = -1;
    bad[10].node_count = FRAMES_NODES_MAX + 1;
    bad[11].grid = 0.0f;
    bad[12].grid = -POINTS_GRID;
    bad[13].grid = NAN;
    bad[14].grid = 1e37f; // not finite in the world
    for (int i = 0; i < WRONG; i++)
        assert_int_equal(add(&rig->frame, &bad[i]), FRAMES_REFUSED);
    assert_int_equal(rig->frame.head.refused, WRONG);
    assert_int_equal(rig->frame.head.sequence, 1);
    assert_true(rig->frame.head.whole);
    expect_near_cloud(&rig->frame, &rig->cloud, 0, NODES, POINTS_GRID);
    assert_int_equal(add(&rig->frame, &good), FRAMES_MORE);
    // Another count of nodes, or another step, in the same frame.
    pliant_points_t other = packet_of(&rig->sent, 2, 2);
    other.step++;
    assert_int_equal(add(&rig->frame, &other), FRAMES_REFUSED);
    other.step--;
    other.node_count++;
    assert_int_equal(add(&rig->frame, &other), FRAMES_REFUSED);
    rig_destroy(rig);
}

// Bits that differ from what was sent give finite numbers or nothing.
TEST(corrupt_bits_give_finite_numbers_or_nothing)
{
    Rig *rig = rig_create();
    uint64_t random = 9;
    int taken = 0;
    for (int n = 0; n < 2000; n++) {
        pliant_points_t packet = packet_of(&rig->sent, n % rig->sent.count, n);
        uint8_t data[ROOM];
        memcpy(data, packet.data, (size_t)packet.num_bytes);
        for (int k = random_below(&random, 4); k >= 0; k--)
            data[random_below(&random, packet.num_bytes)] ^=
                (uint8_t)(1 << random_below(&random, 8));
        packet.data = data;
        packet.grid = n % 2 ? packet.grid : 1e20f;
        taken += add(&rig->frame, &packet) != FRAMES_REFUSED;
    }
    assert_in_range(taken, 1, 1999);
    for (int i = 0; i < 3 * NODES; i++)
        assert_true(isfinite(rig->frame.position[i]));
    rig_destroy(rig);
}
