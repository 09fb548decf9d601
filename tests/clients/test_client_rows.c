// SPDX-License-Identifier: MIT
// Rest positions, colours, maps of errors and elements, put together from their chunks by one set
// of rules.
#include "test.h"
#include "frames.h"

#include "pliant_elements_t.h"
#include "pliant_error_map_t.h"
#include "pliant_look_t.h"
#include "pliant_rest_t.h"

enum { ROWS = 5, DATA = 4096 };
typedef enum Kind { REST, TEXTURED, LOOK, ERROR_MAP, ELEMENTS, KINDS } Kind;

typedef union Chunk {
    pliant_rest_t rest;
    pliant_look_t look;
    pliant_error_map_t map;
    pliant_elements_t elements;
} Chunk;

typedef union Frame {
    FrameHead head; // the first member of each
    RestFrame rest;
    LookFrame look;
    ErrorMapFrame map;
    ElementsFrame elements;
} Frame;

static float position[3 * ROWS] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14};
static float texture[2 * ROWS] = {0.0f, 0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f, 0.7f, 0.8f, 0.9f};
static uint8_t outside[3 * ROWS] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
static uint8_t inside[3 * ROWS] = {255, 254, 253, 252, 251, 250, 249, 248, 247, 246};
static uint8_t share[ROWS] = {0, 10, 255, 3, 4}, level[ROWS] = {0, 1, 2, 0, 1};
static int16_t tag[ROWS] = {3, -1, 32767, -32768, 0};
static int32_t at_level[2] = {40, 2};

#define HALF(rows_member)                                                                          \
    .utime = 100 + sequence, .sequence = sequence, .topology = 5, .rows_member = ROWS,             \
    .chunk = index, .chunk_count = 2, .first = 2 * index

// Chunk `index` of two: of two rows, and of three.
static Chunk half(Kind kind, int index, int32_t sequence)
{
    const int rows = 2 + index, at = 2 * index;
    switch (kind) {
    case LOOK:
        return (Chunk){.look = {HALF(node_count), .texture = (char *)"skin.png", .color = {9, 8, 7},
                                .inside = {6, 5, 4}, .num_values = 3 * rows,
                                .node_color = outside + 3 * at, .node_inside = inside + 3 * at}};
    case ERROR_MAP:
        return (Chunk){.map = {HALF(node_count), .num_values = rows, .share = share + at}};
    case ELEMENTS:
        return (Chunk){.elements = {HALF(square_count), .num_levels = 2, .num_squares = rows,
                                    .elements = at_level, .level = level + at, .tag = tag + at}};
    default:
        return (Chunk){.rest = {HALF(node_count), .num_values = 3 * rows,
                                .position = position + 3 * at,
                                .num_coordinates = kind == TEXTURED ? 2 * rows : 0,
                                .texture = texture + 2 * at}};
    }
}

static FramesResult take(Kind kind, Frame *frame, Chunk chunk)
{
    unsigned char data[DATA];
    int size;
#define ENCODED(type, member)                                                                      \
    (size = pliant_##type##_t_encode(data, 0, DATA, &chunk.member), assert_true(size > 0),         \
     type##_frame_add(&frame->member, data, (size_t)size))
    switch (kind) {
    case LOOK:
        return ENCODED(look, look);
    case ERROR_MAP:
        return ENCODED(error_map, map);
    case ELEMENTS:
        return ENCODED(elements, elements);
    default:
        return ENCODED(rest, rest);
    }
}

static void destroy(Kind kind, Frame *frame)
{
    switch (kind) {
    case LOOK:
        look_frame_destroy(&frame->look);
        break;
    case ERROR_MAP:
        error_map_frame_destroy(&frame->map);
        break;
    case ELEMENTS:
        elements_frame_destroy(&frame->elements);
        break;
    default:
        rest_frame_destroy(&frame->rest);
    }
}

static void expect_rows(Kind kind, const Frame *frame)
{
    assert_int_equal(frame->head.topology, 5);
    switch (kind) {
    case LOOK:
        assert_true(frame->look.varies);
        assert_string_equal(frame->look.texture, "skin.png");
        assert_memory_equal(frame->look.outside, outside, sizeof outside);
        assert_memory_equal(frame->look.inside, inside, sizeof inside);
        break;
    case ERROR_MAP:
        assert_memory_equal(frame->map.share, share, sizeof share);
        break;
    case ELEMENTS:
        assert_int_equal(frame->elements.level_count, 2);
        assert_memory_equal(frame->elements.at_level, at_level, sizeof at_level);
        assert_memory_equal(frame->elements.level, level, sizeof level);
        assert_memory_equal(frame->elements.tag, tag, sizeof tag);
        break;
    default:
        assert_int_equal(frame->rest.textured, kind == TEXTURED);
        assert_memory_equal(frame->rest.position, position, sizeof position);
        for (int i = 0; i < 2 * ROWS; i++)
            expect_near((double)frame->rest.texture[i], kind == TEXTURED ? (double)texture[i] : 0.0,
                        0.0);
    }
}

TEST(chunks_in_any_order_become_the_whole_and_the_next_ones_replace_it)
{
    for (int kind = 0; kind < KINDS; kind++) {
        Frame frame = {0};
        assert_int_equal(take(kind, &frame, half(kind, 1, 0)), FRAMES_MORE);
        assert_int_equal(take(kind, &frame, half(kind, 0, 0)), FRAMES_WHOLE);
        expect_rows(kind, &frame);
        assert_int_equal(take(kind, &frame, half(kind, 0, 0)), FRAMES_STALE); // repeated
        assert_int_equal(take(kind, &frame, half(kind, 0, 1)), FRAMES_MORE);
        assert_false(frame.head.whole);
        // A lost chunk gives way to the next message.
        assert_int_equal(take(kind, &frame, half(kind, 0, 2)), FRAMES_MORE);
        assert_int_equal(take(kind, &frame, half(kind, 1, 1)), FRAMES_STALE);
        assert_int_equal(take(kind, &frame, half(kind, 1, 2)), FRAMES_WHOLE);
        expect_rows(kind, &frame);
        assert_int_equal(frame.head.lost, 1);
        destroy(kind, &frame);
    }
}

TEST(a_body_of_one_colour_is_whole_with_its_only_chunk)
{
    Frame frame = {0};
    Chunk one = half(LOOK, 0, 0);
    one.look.chunk_count = 1;
    one.look.num_values = 0;
    assert_int_equal(take(LOOK, &frame, one), FRAMES_WHOLE);
    assert_false(frame.look.varies);
    assert_int_equal(frame.look.color[0], 9);
    assert_int_equal(frame.look.wall[2], 4);
    assert_null(frame.look.outside);
    // Later its nodes may differ.
    assert_int_equal(take(LOOK, &frame, half(LOOK, 0, 1)), FRAMES_MORE);
    assert_int_equal(take(LOOK, &frame, half(LOOK, 1, 1)), FRAMES_WHOLE);
    assert_true(frame.look.varies);
    look_frame_destroy(&frame.look);
}

// A member that gets a bad value; with `within` it is bad beside the frame's other chunk only.
typedef struct Fault {
    Kind kind;
    bool within;
    const char *name;
    size_t at;
    int32_t value;
} Fault;

#define OF(kind, type, member)     kind, false, #member, offsetof(pliant_##type##_t, member)
#define WITHIN(kind, type, member) kind, true, #member, offsetof(pliant_##type##_t, member)
// The last: nothing has paid for so many.
#define ALWAYS(kind, type, count)                                                                  \
    {OF(kind, type, first), 4}, {OF(kind, type, first), -1}, {OF(kind, type, count), -1},          \
        {OF(kind, type, chunk), 2}, {OF(kind, type, chunk_count), 0},                              \
        {WITHIN(kind, type, count), ROWS + 1}, {WITHIN(kind, type, topology), 6},                  \
        {OF(kind, type, count), FRAMES_NODES_MAX + 1},                                             \
    {                                                                                              \
        OF(kind, type, count), 2 * FRAMES_NODES_FREE + 2                                           \
    }

TEST(chunks_that_contradict_themselves_are_refused_and_leave_the_frame_alone)
{
    static int32_t many[FRAMES_LEVELS_MAX + 1];
    static const Fault FAULTS[] = {
        ALWAYS(REST, rest, node_count),
        {OF(REST, rest, num_values), 5},
        {WITHIN(REST, rest, num_coordinates), 4}, // the other chunk had none
        ALWAYS(TEXTURED, rest, node_count),
        {OF(TEXTURED, rest, num_coordinates), 2},     // of fewer nodes
        {WITHIN(TEXTURED, rest, num_coordinates), 0}, // the other chunk had some
        ALWAYS(LOOK, look, node_count),
        {OF(LOOK, look, num_values), 5},
        {OF(LOOK, look, num_values), 0}, // of several chunks each has nodes
        ALWAYS(ERROR_MAP, error_map, node_count),
        {OF(ERROR_MAP, error_map, num_values), 0},
        ALWAYS(ELEMENTS, elements, square_count),
        {OF(ELEMENTS, elements, num_squares), 0},
        {OF(ELEMENTS, elements, num_levels), 0},
        {OF(ELEMENTS, elements, num_levels), FRAMES_LEVELS_MAX + 1},
        {WITHIN(ELEMENTS, elements, num_levels), 1},
    };
    for (size_t i = 0; i < sizeof FAULTS / sizeof *FAULTS; i++) {
        const Fault *fault = &FAULTS[i];
        const Kind kind = fault->kind;
        for (int beside = fault->within; beside < 2; beside++) {
            Frame frame = {0};
            Chunk wrong = half(kind, beside, 0);
            if (beside)
                assert_int_equal(take(kind, &frame, half(kind, 0, 0)), FRAMES_MORE);
            *(int32_t *)((char *)&wrong + fault->at) = fault->value;
            if (kind == ELEMENTS && wrong.elements.num_levels > 2)
                wrong.elements.elements = many;
            if (take(kind, &frame, wrong) != FRAMES_REFUSED)
                fail_msg("taken of kind %d: %s = %d", kind, fault->name, fault->value);
            assert_int_equal(frame.head.refused, 1);
            assert_int_equal(take(kind, &frame, half(kind, 1, 0)),
                             beside ? FRAMES_WHOLE : FRAMES_MORE);
            destroy(kind, &frame);
        }
    }
}

TEST(a_name_of_a_texture_is_bounded)
{
    char longest[LOOK_TEXTURE_MAX + 1];
    memset(longest, 'a', sizeof longest);
    longest[LOOK_TEXTURE_MAX] = '\0';
    Frame frame = {0};
    Chunk wrong = half(LOOK, 0, 0);
    wrong.look.texture = longest;
    assert_int_equal(take(LOOK, &frame, wrong), FRAMES_REFUSED);
    look_frame_destroy(&frame.look);
}
