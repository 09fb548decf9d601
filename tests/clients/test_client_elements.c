// SPDX-License-Identifier: MIT
// Elements at a surface put together from their chunks.
#include "test.h"
#include "frames.h"

#include "pliant_elements_t.h"

enum { SQUARES = 5, DATA = 4096 };

static uint8_t level[SQUARES] = {0, 1, 2, 0, 1};
static int16_t tag[SQUARES] = {3, -1, 32767, -32768, 0};
static int32_t count[2] = {40, 2};

// Chunk `index` of two: of two squares, and of three.
static pliant_elements_t half(int index, int32_t sequence)
{
    return (pliant_elements_t){.utime = 100 + sequence,
                               .sequence = sequence,
                               .step = 7,
                               .topology = 5,
                               .square_count = SQUARES,
                               .chunk = index,
                               .chunk_count = 2,
                               .first = 2 * index,
                               .num_levels = 2,
                               .num_squares = 2 + index,
                               .elements = count,
                               .level = level + 2 * index,
                               .tag = tag + 2 * index};
}

static FramesResult take(ElementsFrame *frame, pliant_elements_t chunk)
{
    unsigned char data[DATA];
    int size = pliant_elements_t_encode(data, 0, DATA, &chunk);
    assert_true(size > 0);
    return elements_frame_add(frame, data, (size_t)size);
}

TEST(chunks_of_elements_in_any_order_become_the_whole)
{
    SCOPED(elements_frame_destroy) ElementsFrame frame = {0};
    assert_int_equal(take(&frame, half(1, 0)), FRAMES_MORE);
    assert_int_equal(take(&frame, half(0, 0)), FRAMES_WHOLE);
    assert_int_equal(frame.head.topology, 5);
    assert_int_equal(frame.level_count, 2);
    assert_memory_equal(frame.at_level, count, sizeof count);
    assert_memory_equal(frame.level, level, sizeof level);
    assert_memory_equal(frame.tag, tag, sizeof tag);
    assert_int_equal(take(&frame, half(0, 0)), FRAMES_STALE);
    // The next ones replace them; half of them is given up.
    assert_int_equal(take(&frame, half(0, 1)), FRAMES_MORE);
    assert_false(frame.head.whole);
    assert_int_equal(take(&frame, half(0, 2)), FRAMES_MORE);
    assert_int_equal(frame.head.lost, 1);
}

TEST(chunks_of_elements_that_contradict_themselves_are_refused)
{
    static int32_t many[FRAMES_LEVELS_MAX + 1];
    enum { WRONG = 8 };
    pliant_elements_t wrong[WRONG];
    for (int i = 0; i < WRONG; i++)
        wrong[i] = half(0, 0);
    wrong[0].first = 4; // beyond its squares
    wrong[1].square_count = -1;
    wrong[2].square_count = 2 * FRAMES_NODES_FREE + 2; // nothing has paid for so many
    wrong[3].chunk = 2;
    wrong[4].num_squares = 0;
    wrong[5].chunk_count = 0;
    wrong[6].num_levels = 0;
    wrong[7].num_levels = FRAMES_LEVELS_MAX + 1;
    wrong[7].elements = many;
    for (int i = 0; i < WRONG; i++) {
        SCOPED(elements_frame_destroy) ElementsFrame frame = {0};
        assert_int_equal(take(&frame, wrong[i]), FRAMES_REFUSED);
        assert_int_equal(frame.head.refused, 1);
        assert_int_equal(take(&frame, half(0, 1)), FRAMES_MORE);
    }
    // Another mesh, or other levels, within one message.
    SCOPED(elements_frame_destroy) ElementsFrame frame = {0};
    assert_int_equal(take(&frame, half(0, 0)), FRAMES_MORE);
    pliant_elements_t other = half(1, 0);
    other.topology = 6;
    assert_int_equal(take(&frame, other), FRAMES_REFUSED);
    other = half(1, 0);
    other.num_levels = 1;
    assert_int_equal(take(&frame, other), FRAMES_REFUSED);
    assert_int_equal(take(&frame, half(1, 0)), FRAMES_WHOLE);
}
