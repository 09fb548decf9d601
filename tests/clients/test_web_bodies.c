// SPDX-License-Identifier: MIT
// Meshes, nodes and rest positions from LCM to the board: only what belongs together, and only
// once.
#include "feed.h"
#include "client.h"
#include "test.h"
#include "mesh_message.h"

#include "pliant_elements_t.h"
#include "pliant_error_map_t.h"
#include "pliant_mesh_delta_t.h"
#include "pliant_nodes_t.h"
#include "pliant_points_t.h"
#include "pliant_rest_t.h"
#include "pliant_walls_t.h"

enum { DATA = 4096 };

static Board board;
static Bodies bodies;
static int32_t sequence;
static int32_t triangle[3] = {0, 1, 2}, id[4] = {10, 11, 12, 13}, parent[8];
static int8_t level[4];
static float position[12];

static int begin(void **state)
{
    (void)state;
    pliant_body_status_t names[2] = {{.name = (char[]){"a"}}, {.name = (char[]){"b"}}};
    board_init(&board);
    bodies_init(&bodies, &board);
    bodies_name(&bodies, &(pliant_status_t){.num_bodies = 2, .body = names});
    bodies_open(&bodies);
    return 0;
}

static int end(void **state)
{
    (void)state;
    bodies_destroy(&bodies);
    board_destroy(&board);
    return 0;
}

#define SEND(type, take, name, message)                                                            \
    do {                                                                                           \
        unsigned char data_[DATA];                                                                 \
        const int size_ = pliant_##type##_encode(data_, 0, DATA, &(message));                      \
        take(&bodies, name, data_, (size_t)size_);                                                 \
    } while (0)

static void send_mesh(const char *name, int topology)
{
    sequence++;
    pliant_mesh_t mesh =
        mesh_message(sequence, sequence, topology, 3, id, parent, level, 1, triangle);
    SEND(mesh_t, bodies_take_mesh, name, mesh);
}

// Adds a node in a fourth slot.
static void send_delta(const char *name, int from, int to)
{
    sequence++;
    int32_t slot = 3;
    pliant_mesh_delta_t delta = {.utime = sequence,
                                 .sequence = sequence,
                                 .from_topology = from,
                                 .topology = to,
                                 .node_count = 4,
                                 .triangle_count = 1,
                                 .chunk_count = 1,
                                 .num_nodes = 1,
                                 .num_parents = 2,
                                 .node_slot = &slot,
                                 .id = id + 3,
                                 .origin = id + 3,
                                 .parent = parent,
                                 .piece = id,
                                 .level = level};
    SEND(mesh_delta_t, bodies_take_delta, name, delta);
}

static void send_nodes(const char *name, int topology, int count)
{
    sequence++;
    pliant_nodes_t nodes = {.utime = sequence,
                            .sequence = sequence,
                            .step = sequence,
                            .topology = topology,
                            .node_count = count,
                            .chunk_count = 1,
                            .num_values = 3 * count,
                            .position = position};
    SEND(nodes_t, bodies_take_nodes, name, nodes);
}

// One node of a frame of three, all at (step, 0, 0), on a grid of a metre: three widths of 0.
static void send_point(const char *name, int step, int node)
{
    uint8_t bits[2] = {0, 0};
    pliant_points_t points = {.utime = step,
                              .sequence = step,
                              .step = step,
                              .topology = 1,
                              .node_count = 3,
                              .first = node,
                              .count = 1,
                              .grid = 1.0f,
                              .origin = {step, 0, 0},
                              .num_bytes = sizeof bits,
                              .data = bits};
    SEND(points_t, bodies_take_nodes, name, points);
}

static void send_rest(const char *name, int topology)
{
    sequence++;
    pliant_rest_t rest = {.utime = sequence,
                          .sequence = sequence,
                          .topology = topology,
                          .node_count = 3,
                          .chunk_count = 1,
                          .num_values = 9,
                          .position = position};
    SEND(rest_t, bodies_take_rest, name, rest);
}

// Of a binary message on the board.
static int32_t topology_of(const BoardSlot *slot)
{
    int32_t word[3];
    assert_non_null(slot->parcel);
    memcpy(word, slot->parcel->data, sizeof word);
    return word[2];
}

// What the board has of node `node` of body "a".
static double x_of(int node)
{
    const BoardSlot *slot = &board.body[0][BOARD_NODES];
    float x;
    assert_non_null(slot->parcel);
    const size_t positions = slot->parcel->size - 9 * sizeof x; // they come last
    memcpy(&x, slot->parcel->data + positions + 3 * (size_t)node * sizeof x, sizeof x);
    return (double)x;
}

AROUND_EACH(begin, end)

TEST(a_lost_packet_holds_up_only_its_own_nodes)
{
    send_mesh("a", 1);
    send_point("a", 100, 0);
    send_point("a", 100, 2);
    assert_null(board.body[0][BOARD_NODES].parcel); // node 1 was never heard of
    for (int node = 0; node < 3; node++)
        send_point("a", 101, node);
    send_point("a", 102, 0);
    expect_near(x_of(0), 101.0, 0.0); // a frame that still comes is not shown
    send_point("a", 102, 2);
    expect_near(x_of(0), 102.0, 0.0);
    expect_near(x_of(1), 101.0, 0.0);
    expect_near(x_of(2), 102.0, 0.0);
}

TEST(a_mesh_waits_for_its_nodes_and_nodes_for_their_mesh)
{
    send_mesh("b", 1);
    assert_null(board.body[1][BOARD_MESH].parcel);
    send_nodes("b", 1, 3);
    assert_int_equal(topology_of(&board.body[1][BOARD_MESH]), 1);
    assert_int_equal(topology_of(&board.body[1][BOARD_NODES]), 1);
    assert_null(board.body[0][BOARD_MESH].parcel);
    send_nodes("a", 5, 3);
    assert_null(board.body[0][BOARD_NODES].parcel);
    send_mesh("a", 5);
    assert_int_equal(topology_of(&board.body[0][BOARD_NODES]), 5);
    send_mesh("nobody", 1); // not in the scene: dropped
    send_nodes("nobody", 1, 3);
}

TEST(a_delta_is_shown_with_the_first_nodes_of_its_mesh)
{
    send_mesh("a", 1);
    send_nodes("a", 1, 3);
    send_delta("a", 1, 2);
    assert_int_equal(topology_of(&board.body[0][BOARD_MESH]), 1);
    send_nodes("a", 2, 4);
    assert_int_equal(topology_of(&board.body[0][BOARD_MESH]), 2);
    assert_int_equal(topology_of(&board.body[0][BOARD_NODES]), 2);
    expect_near(bodies_unmatched(&bodies, client_now_ns()), 0.0, 0.0);
}

TEST(nodes_of_a_mesh_that_was_missed_are_not_shown_but_counted_as_time)
{
    send_mesh("a", 1);
    send_nodes("a", 1, 3);
    uint64_t version = board.version;
    send_delta("a", 2, 3); // the one from 1 to 2 was lost
    send_nodes("a", 3, 4);
    send_nodes("a", 1, 4); // a count that its mesh does not have
    assert_true(board.version == version);
    expect_at_least(bodies_unmatched(&bodies, client_now_ns() + 1000000000), 1.0);
    send_nodes("a", 3, 3);
    send_mesh("a", 3); // the whole mesh heals it
    assert_int_equal(topology_of(&board.body[0][BOARD_NODES]), 3);
    expect_near(bodies_unmatched(&bodies, client_now_ns() + 1000000000), 0.0, 0.0);
}

TEST(what_is_repeated_unchanged_is_not_news)
{
    send_mesh("a", 1);
    send_nodes("a", 1, 3);
    send_rest("a", 1);
    assert_int_equal(topology_of(&board.body[0][BOARD_REST]), 1);
    uint64_t version = board.version;
    send_mesh("a", 1);
    send_rest("a", 1);
    assert_true(board.version == version);
    triangle[0] = 2, triangle[2] = 0; // another mesh by the same number, as of another daemon
    send_mesh("a", 1);
    triangle[0] = 0, triangle[2] = 2;
    assert_true(board.body[0][BOARD_MESH].version > version);
    assert_true(board.body[0][BOARD_NODES].version > board.body[0][BOARD_MESH].version);
}

TEST(rest_positions_wait_for_their_mesh)
{
    send_rest("a", 2);
    send_mesh("a", 1);
    send_nodes("a", 1, 3);
    assert_null(board.body[0][BOARD_REST].parcel);
    send_mesh("a", 2);
    send_nodes("a", 2, 3);
    assert_int_equal(topology_of(&board.body[0][BOARD_REST]), 2);
}

// Of the mesh on the board.
static int32_t wall_of(const BoardSlot *slot)
{
    int32_t word[6];
    assert_non_null(slot->parcel);
    memcpy(word, slot->parcel->data, sizeof word);
    return word[5];
}

TEST(walls_are_told_with_the_mesh)
{
    unsigned char data[DATA];
    const pliant_walls_t walls = {.utime = 1, .sequence = 1, .topology = 1, .first_wall = 7};
    const int size = pliant_walls_t_encode(data, 0, DATA, &walls);
    send_mesh("a", 1);
    send_nodes("a", 1, 3);
    assert_int_equal(wall_of(&board.body[0][BOARD_MESH]), 0);
    bodies_take_walls(&bodies, "a", data, (size_t)size - 1); // not whole: dropped
    assert_int_equal(wall_of(&board.body[0][BOARD_MESH]), 0);
    bodies_take_walls(&bodies, "nobody", data, (size_t)size);
    bodies_take_walls(&bodies, "a", data, (size_t)size);
    assert_int_equal(wall_of(&board.body[0][BOARD_MESH]), 7);
    assert_int_equal(topology_of(&board.body[0][BOARD_MESH]), 1);
}

TEST(maps_of_errors_are_shown_once)
{
    static uint8_t share[] = {0, 128, 255, 7};
    pliant_error_map_t map = {.sequence = 1,
                              .topology = 3,
                              .node_count = 4,
                              .chunk_count = 1,
                              .num_values = 4,
                              .share = share};
    SEND(error_map_t, bodies_take_error_map, "nobody", map);
    SEND(error_map_t, bodies_take_error_map, "a", map);
    const BoardSlot *slot = &board.body[0][BOARD_ERROR_MAP];
    assert_int_equal(topology_of(slot), 3);
    assert_int_equal(slot->parcel->size, 24 + 4);
    assert_memory_equal(slot->parcel->data + 24, share, 4);
    // The same again, as for a client that asked, is no news.
    const uint64_t version = slot->version;
    map.sequence = 2;
    SEND(error_map_t, bodies_take_error_map, "a", map);
    assert_true(slot->version == version);
    share[3] = 8;
    map.sequence = 3;
    SEND(error_map_t, bodies_take_error_map, "a", map);
    assert_true(slot->version > version);
}

TEST(elements_are_shown_once)
{
    static uint8_t large[] = {0, 2};
    static int16_t tag[] = {7, -7};
    static int32_t count[] = {5, 0, 1};
    pliant_elements_t elements = {.sequence = 1,
                                  .topology = 3,
                                  .square_count = 2,
                                  .chunk_count = 1,
                                  .num_levels = 3,
                                  .num_squares = 2,
                                  .elements = count,
                                  .level = large,
                                  .tag = tag};
    SEND(elements_t, bodies_take_elements, "nobody", elements);
    SEND(elements_t, bodies_take_elements, "a", elements);
    const BoardSlot *slot = &board.body[0][BOARD_ELEMENTS];
    assert_int_equal(topology_of(slot), 3);
    assert_int_equal(slot->parcel->size, 24 + 12 + 4 + 2);
    assert_memory_equal(slot->parcel->data + 24, count, 12);
    assert_memory_equal(slot->parcel->data + 36, tag, 4);
    assert_memory_equal(slot->parcel->data + 40, large, 2);
    // The same again, as for a client that asked, is no news.
    const uint64_t version = slot->version;
    elements.sequence = 2;
    SEND(elements_t, bodies_take_elements, "a", elements);
    assert_true(slot->version == version);
    large[0] = 1;
    elements.sequence = 3;
    SEND(elements_t, bodies_take_elements, "a", elements);
    assert_true(slot->version > version);
}

TEST(bodies_of_a_scene_that_pages_do_not_know_stay_back)
{
    pliant_body_status_t name = {.name = (char[]){"c"}};
    pliant_status_t status = {.num_bodies = 1, .body = &name};
    assert_false(bodies_are(&bodies, &status));
    bodies_name(&bodies, &status);
    assert_true(bodies_are(&bodies, &status));
    send_mesh("c", 1);
    send_nodes("c", 1, 3);
    send_mesh("a", 1);
    send_nodes("a", 1, 3);
    assert_null(board.body[0][BOARD_MESH].parcel);
    bodies_open(&bodies);
    assert_int_equal(topology_of(&board.body[0][BOARD_MESH]), 1);
}
