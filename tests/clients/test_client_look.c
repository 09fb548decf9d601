// SPDX-License-Identifier: MIT
// Colours of bodies put together from their chunks.
#include "test.h"
#include "frames.h"

#include "pliant_look_t.h"

enum { NODES = 4, DATA = 4096 };

static uint8_t outside[3 * NODES] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
static uint8_t inside[3 * NODES] = {255, 254, 253, 252, 251, 250, 249, 248, 247, 246, 245, 244};

// Chunk `index` of two, each of two nodes.
static pliant_look_t half(int index, int32_t sequence)
{
    return (pliant_look_t){.utime = 100 + sequence,
                           .sequence = sequence,
                           .topology = 5,
                           .node_count = NODES,
                           .chunk = index,
                           .chunk_count = 2,
                           .texture = (char *)"skin.png",
                           .color = {9, 8, 7},
                           .inside = {6, 5, 4},
                           .first = 2 * index,
                           .num_values = 6,
                           .node_color = outside + 6 * index,
                           .node_inside = inside + 6 * index};
}

static FramesResult take(LookFrame *frame, pliant_look_t chunk)
{
    unsigned char data[DATA];
    int size = pliant_look_t_encode(data, 0, DATA, &chunk);
    assert_true(size > 0);
    return look_frame_add(frame, data, (size_t)size);
}

TEST(chunks_of_colours_in_any_order_become_the_whole)
{
    SCOPED(look_frame_destroy) LookFrame frame = {0};
    assert_int_equal(take(&frame, half(1, 0)), FRAMES_MORE);
    assert_int_equal(take(&frame, half(0, 0)), FRAMES_WHOLE);
    assert_int_equal(frame.head.topology, 5);
    assert_true(frame.varies);
    assert_string_equal(frame.texture, "skin.png");
    assert_memory_equal(frame.outside, outside, sizeof outside);
    assert_memory_equal(frame.inside, inside, sizeof inside);
    assert_int_equal(take(&frame, half(0, 0)), FRAMES_STALE);
    // The next one replaces it; half of one is no look.
    assert_int_equal(take(&frame, half(0, 1)), FRAMES_MORE);
    assert_false(frame.head.whole);
}

TEST(a_body_of_one_colour_is_whole_with_its_only_chunk)
{
    SCOPED(look_frame_destroy) LookFrame frame = {0};
    pliant_look_t one = half(0, 0);
    one.chunk_count = 1;
    one.num_values = 0;
    assert_int_equal(take(&frame, one), FRAMES_WHOLE);
    assert_false(frame.varies);
    assert_int_equal(frame.color[0], 9);
    assert_int_equal(frame.wall[2], 4);
    assert_null(frame.outside);
    // Later its nodes may differ.
    assert_int_equal(take(&frame, half(0, 1)), FRAMES_MORE);
    assert_int_equal(take(&frame, half(1, 1)), FRAMES_WHOLE);
    assert_true(frame.varies);
}

TEST(chunks_of_colours_that_contradict_themselves_are_refused)
{
    char longest[LOOK_TEXTURE_MAX + 1];
    memset(longest, 'a', sizeof longest);
    longest[LOOK_TEXTURE_MAX] = '\0';
    pliant_look_t wrong[7];
    for (int i = 0; i < 7; i++)
        wrong[i] = half(0, 0);
    wrong[0].first = 3; // beyond its nodes
    wrong[1].node_count = -1;
    wrong[2].node_count = FRAMES_NODES_FREE + 1; // nothing has paid for so many
    wrong[3].chunk = 2;
    wrong[4].num_values = 5;
    wrong[5].num_values = 0; // of several chunks each has nodes
    wrong[6].texture = longest;
    for (int i = 0; i < 7; i++) {
        SCOPED(look_frame_destroy) LookFrame frame = {0};
        assert_int_equal(take(&frame, wrong[i]), FRAMES_REFUSED);
        assert_int_equal(frame.head.refused, 1);
        assert_int_equal(take(&frame, half(0, 1)), FRAMES_MORE);
    }
    // Another mesh within one look.
    SCOPED(look_frame_destroy) LookFrame frame = {0};
    assert_int_equal(take(&frame, half(0, 0)), FRAMES_MORE);
    pliant_look_t other = half(1, 0);
    other.topology = 6;
    assert_int_equal(take(&frame, other), FRAMES_REFUSED);
    assert_int_equal(take(&frame, half(1, 0)), FRAMES_WHOLE);
}
