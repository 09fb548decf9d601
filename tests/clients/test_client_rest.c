// SPDX-License-Identifier: MIT
// Rest positions and texture coordinates put together from their chunks.
#include "test.h"
#include "frames.h"

#include "pliant_rest_t.h"

enum { NODES = 4, DATA = 4096 };

static float position[3 * NODES] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
static float texture[2 * NODES] = {0.0f, 0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f, 0.7f};

// Chunk `index` of two, each of two nodes.
static pliant_rest_t half(int index, int32_t sequence, bool textured)
{
    return (pliant_rest_t){.utime = 100 + sequence,
                           .sequence = sequence,
                           .topology = 5,
                           .node_count = NODES,
                           .chunk = index,
                           .chunk_count = 2,
                           .first = 2 * index,
                           .num_values = 6,
                           .position = position + 6 * index,
                           .num_coordinates = textured ? 4 : 0,
                           .texture = texture + 4 * index};
}

static FramesResult take(RestFrame *frame, pliant_rest_t chunk)
{
    unsigned char data[DATA];
    int size = pliant_rest_t_encode(data, 0, DATA, &chunk);
    assert_true(size > 0);
    return rest_frame_add(frame, data, (size_t)size);
}

TEST(chunks_in_any_order_become_the_whole)
{
    for (int textured = 0; textured < 2; textured++) {
        SCOPED(rest_frame_destroy) RestFrame frame = {0};
        assert_int_equal(take(&frame, half(1, 0, textured)), FRAMES_MORE);
        assert_int_equal(take(&frame, half(0, 0, textured)), FRAMES_WHOLE);
        assert_int_equal(frame.head.topology, 5);
        assert_int_equal(frame.textured, textured);
        assert_memory_equal(frame.position, position, sizeof position);
        if (textured)
            assert_memory_equal(frame.texture, texture, sizeof texture);
        else
            expect_near((double)frame.texture[7], 0.0, 0.0);
    }
}

TEST(a_lost_chunk_gives_way_to_the_next_message)
{
    SCOPED(rest_frame_destroy) RestFrame frame = {0};
    assert_int_equal(take(&frame, half(0, 0, true)), FRAMES_MORE);
    assert_int_equal(take(&frame, half(0, 1, true)), FRAMES_MORE);
    assert_int_equal(take(&frame, half(1, 0, true)), FRAMES_STALE);
    assert_int_equal(take(&frame, half(1, 1, true)), FRAMES_WHOLE);
    assert_int_equal(take(&frame, half(1, 1, true)), FRAMES_STALE); // repeated
    assert_int_equal(frame.head.lost, 1);
}

TEST(chunks_that_contradict_themselves_are_refused)
{
    SCOPED(rest_frame_destroy) RestFrame frame = {0};
    assert_int_equal(take(&frame, half(0, 0, true)), FRAMES_MORE);
    pliant_rest_t wrong[8];
    for (int k = 0; k < 8; k++)
        wrong[k] = half(1, 0, true);
    wrong[0].num_coordinates = 2; // of fewer nodes
    wrong[1].num_coordinates = 0; // the other chunk had some
    wrong[2].first = 3;           // beyond the last node
    wrong[3].first = -1;
    wrong[4].num_values = 5;
    wrong[5].node_count = NODES + 1;
    wrong[6].chunk = 2;
    wrong[7].node_count = FRAMES_NODES_MAX + 1;
    for (int k = 0; k < 8; k++)
        assert_int_equal(take(&frame, wrong[k]), FRAMES_REFUSED);
    assert_int_equal(frame.head.refused, 8);
    assert_int_equal(take(&frame, half(1, 0, true)), FRAMES_WHOLE);
}
