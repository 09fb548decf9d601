// SPDX-License-Identifier: MIT
// Maps of errors put together from their chunks, and the errors that a client reads.
#include "test.h"
#include "frames.h"
#include "kit.h"

#include "pliant_error_map_t.h"
#include "pliant_error_t.h"

enum { NODES = 5, DATA = 4096 };

static uint8_t share[NODES] = {0, 10, 255, 3, 4};

// Chunk `index` of two: of two nodes, and of three.
static pliant_error_map_t half(int index, int32_t sequence)
{
    return (pliant_error_map_t){.utime = 100 + sequence,
                                .sequence = sequence,
                                .step = 7,
                                .topology = 5,
                                .node_count = NODES,
                                .chunk = index,
                                .chunk_count = 2,
                                .first = 2 * index,
                                .num_values = 2 + index,
                                .share = share + 2 * index};
}

static FramesResult take(ErrorMapFrame *frame, pliant_error_map_t chunk)
{
    unsigned char data[DATA];
    int size = pliant_error_map_t_encode(data, 0, DATA, &chunk);
    assert_true(size > 0);
    return error_map_frame_add(frame, data, (size_t)size);
}

TEST(chunks_of_a_map_in_any_order_become_the_whole)
{
    SCOPED(error_map_frame_destroy) ErrorMapFrame frame = {0};
    assert_int_equal(take(&frame, half(1, 0)), FRAMES_MORE);
    assert_int_equal(take(&frame, half(0, 0)), FRAMES_WHOLE);
    assert_int_equal(frame.head.topology, 5);
    assert_memory_equal(frame.share, share, sizeof share);
    assert_int_equal(take(&frame, half(0, 0)), FRAMES_STALE);
    // The next one replaces it; half of one is no map.
    assert_int_equal(take(&frame, half(0, 1)), FRAMES_MORE);
    assert_false(frame.head.whole);
    assert_int_equal(take(&frame, half(0, 2)), FRAMES_MORE);
    assert_int_equal(frame.head.lost, 1);
}

TEST(chunks_of_a_map_that_contradict_themselves_are_refused)
{
    pliant_error_map_t wrong[6];
    for (int i = 0; i < 6; i++)
        wrong[i] = half(0, 0);
    wrong[0].first = 4; // beyond its nodes
    wrong[1].node_count = -1;
    wrong[2].node_count = FRAMES_NODES_FREE + 1; // nothing has paid for so many
    wrong[3].chunk = 2;
    wrong[4].num_values = 0;
    wrong[5].chunk_count = 0;
    for (int i = 0; i < 6; i++) {
        SCOPED(error_map_frame_destroy) ErrorMapFrame frame = {0};
        assert_int_equal(take(&frame, wrong[i]), FRAMES_REFUSED);
        assert_int_equal(frame.head.refused, 1);
        assert_int_equal(take(&frame, half(0, 1)), FRAMES_MORE);
    }
    // Another mesh within one map.
    SCOPED(error_map_frame_destroy) ErrorMapFrame frame = {0};
    assert_int_equal(take(&frame, half(0, 0)), FRAMES_MORE);
    pliant_error_map_t other = half(1, 0);
    other.topology = 6;
    assert_int_equal(take(&frame, other), FRAMES_REFUSED);
    assert_int_equal(take(&frame, half(1, 0)), FRAMES_WHOLE);
}

// A client without a connection takes what a network would bring.
TEST(a_client_has_the_newest_errors)
{
    static PliantClient kit;
    unsigned char data[DATA];
    pliant_error_body_t body[2] = {{.name = (char *)"liver",
                                    .space = 1e-4,
                                    .steps = 2e-5,
                                    .total = 1.2e-4,
                                    .relative = 0.03,
                                    .age = 24},
                                   {.name = (char *)"skin", .space = -1.0, .age = -1}};
    pliant_error_tool_t tool[1] = {{.tool = 4, .force = 2.0, .error = 0.1, .share = 0.05}};
    pliant_error_t message = {
        .step = 99, .time = 0.099, .num_bodies = 2, .num_tools = 1, .body = body, .tool = tool};
    assert_null(pliant_errors(&kit));
    int size = pliant_error_t_encode(data, 0, DATA, &message);
    kit_take_errors(&kit, data, (size_t)size - 1); // cut off: not taken
    assert_null(pliant_errors(&kit));
    kit_take_errors(&kit, data, (size_t)size);
    const PliantErrors *errors = pliant_errors(&kit);
    assert_true(errors->step == 99 && errors->time == 0.099);
    assert_int_equal(errors->body_count, 2);
    assert_string_equal(errors->body[0].body, "liver");
    assert_true(errors->body[0].space == 1e-4 && errors->body[0].steps == 2e-5);
    assert_true(errors->body[0].total == 1.2e-4 && errors->body[0].relative == 0.03);
    assert_true(errors->body[0].age == 24 && errors->body[1].space == -1.0);
    assert_int_equal(errors->tool_count, 1);
    assert_true(errors->tool[0].tool == 4 && errors->tool[0].force == 2.0);
    assert_true(errors->tool[0].error == 0.1 && errors->tool[0].share == 0.05);
    // The next ones replace them.
    message.num_tools = 0;
    size = pliant_error_t_encode(data, 0, DATA, &message);
    kit_take_errors(&kit, data, (size_t)size);
    assert_int_equal(pliant_errors(&kit)->tool_count, 0);
    kit_forget(&kit);
    assert_null(pliant_errors(&kit));
}
