// SPDX-License-Identifier: MIT
#include "test.h"
#include "random.h"

#include "voxel/batch.h"

enum { ELEMENTS = 500, VERTICES = 900, GIVEN = 5 };

static int vertex[ELEMENTS][NODE_COUNT], element_class[ELEMENTS];
static ElementClass classes[GIVEN];

// Elements of many rest shapes, most of them rare, with vertices at random; the last class equals
// the first, the one before it is nobody's.
static BatchOptions options(uint64_t seed)
{
    uint64_t random = seed;
    for (int c = 0; c < GIVEN; c++)
        classes[c] = (ElementClass){1e-3 * (1 + c % 4), 1e3, 0.0, 1.0, 0.0, 1.0};
    for (int e = 0; e < ELEMENTS; e++) {
        static const unsigned masks[3] = {0, 0x1, 0x20003};
        int shape = random_below(&random, 5);
        unsigned mask = shape < 3 ? masks[shape] : 0x100u + (unsigned)random_below(&random, 40);
        for (int n = 0; n < NODE_COUNT; n++) {
            bool present = n < NODE_CORNERS || (mask >> (n - NODE_CORNERS) & 1);
            vertex[e][n] = present ? random_below(&random, VERTICES) : -1;
        }
        int c = random_below(&random, GIVEN - 1);
        element_class[e] = c == GIVEN - 2 ? GIVEN - 1 : c;
    }
    return (BatchOptions){"test",        ELEMENTS, (const int(*)[NODE_COUNT])vertex,
                          element_class, classes,  VERTICES};
}

static unsigned mask_of(int e)
{
    unsigned mask = 0;
    for (int n = NODE_CORNERS; n < NODE_COUNT; n++)
        mask |= vertex[e][n] >= 0 ? 1u << (n - NODE_CORNERS) : 0u;
    return mask;
}

// A lane holds the vertices of its element, in the order of its rest shape, and its class.
static void expect_lane(const Batches *b, int batch, int lane, int e)
{
    if (batch < b->plain.batch_count) {
        const int *row = b->plain.vertex + batch * NODE_CORNERS * LANES;
        for (int n = 0; n < NODE_CORNERS; n++)
            assert_int_equal(row[n * LANES + lane], e < 0 ? VERTICES : vertex[e][n]);
        const int c = b->plain.element_class[batch];
        if (e >= 0)
            assert_memory_equal(&b->classes[c], &classes[element_class[e]], sizeof(ElementClass));
        return;
    }
    const HangingBatches *h = &b->hanging;
    const int k = batch - b->plain.batch_count, mixed = k - (h->batch_count - b->mixed_count);
    const int *row = h->vertex + h->start[k] * LANES;
    const int t = mixed < 0 ? h->table[k] : b->mixture[mixed][lane];
    if (mixed >= 0)
        assert_int_equal(h->table[k], b->template_count + mixed);
    for (int n = 0; n < h->start[k + 1] - h->start[k]; n++)
        assert_int_equal(row[n * LANES + lane], e >= 0 && n < b->templates[t].count
                                                    ? vertex[e][b->templates[t].node[n]]
                                                    : VERTICES);
    if (e < 0) {
        assert_true(mixed < 0 || t == -1);
        return;
    }
    assert_int_equal(b->templates[t].mask, mask_of(e));
    assert_memory_equal(&b->classes[h->element_class[k][lane]], &classes[element_class[e]],
                        sizeof(ElementClass));
}

TEST(every_element_stands_in_one_lane_with_its_vertices)
{
    SCOPED(arena_destroy) Arena arena = {0};
    Batches b;
    BatchOptions from = options(1);
    batches_create(&b, &from, &arena);
    const int lanes = batches_total(&b) * LANES;
    FREED int *owner = malloc((size_t)lanes * sizeof *owner);
    for (int i = 0; i < lanes; i++)
        owner[i] = -1;
    for (int e = 0; e < ELEMENTS; e++) {
        assert_in_range(b.lane[e], 0, lanes - 1);
        assert_int_equal(owner[b.lane[e]], -1);
        owner[b.lane[e]] = e;
    }
    for (int i = 0; i < lanes; i++)
        expect_lane(&b, i / LANES, i % LANES, owner[i]);
}

static bool is_mixed(const Batches *b, int e)
{
    return b->lane[e] / LANES >= batches_total(b) - b->mixed_count;
}

static int count_of(int e)
{
    int count = 0;
    for (int n = 0; n < NODE_COUNT; n++)
        count += vertex[e][n] >= 0;
    return count;
}

// Negative when element e has to stand before f.
static int order(const Batches *b, int e, int f)
{
    if (is_mixed(b, e) != is_mixed(b, f))
        return is_mixed(b, e) ? 1 : -1;
    if (is_mixed(b, e) && count_of(e) != count_of(f))
        return count_of(e) - count_of(f);
    if (mask_of(e) != mask_of(f))
        return mask_of(e) < mask_of(f) ? -1 : 1;
    double one = classes[element_class[e]].size, other = classes[element_class[f]].size;
    if (mask_of(e) == 0 && one != other)
        return one < other ? -1 : 1;
    return e - f;
}

TEST(batches_follow_template_class_and_element)
{
    SCOPED(arena_destroy) Arena arena = {0};
    Batches b;
    BatchOptions from = options(2);
    batches_create(&b, &from, &arena);
    assert_in_range(b.mixed_count, 2, b.hanging.batch_count - 2);
    assert_int_equal(b.class_count, 3); // one is unused, two are equal
    for (int e = 0; e < ELEMENTS; e++)
        for (int f = 0; f < ELEMENTS; f++)
            if (e != f)
                assert_true((b.lane[e] < b.lane[f]) == (order(&b, e, f) < 0));
}

TEST(few_lanes_are_left_over)
{
    SCOPED(arena_destroy) Arena arena = {0};
    Batches b;
    BatchOptions from = options(5);
    batches_create(&b, &from, &arena);
    // Each class of cubes and the mixed batches end in one that may hold a single element, each
    // template in one that is three quarters full.
    int least = (b.plain.batch_count - b.class_count) * LANES + b.class_count;
    least += (b.hanging.batch_count - b.mixed_count) * LANES * 3 / 4;
    least += (b.mixed_count - 1) * LANES + 1;
    assert_in_range(ELEMENTS, least, batches_total(&b) * LANES);
}

TEST(the_same_elements_give_the_same_batches)
{
    Arena arena[2] = {{0}};
    Batches b;
    for (int k = 0; k < 2; k++) {
        BatchOptions from = options(3);
        batches_create(&b, &from, &arena[k]);
    }
    assert_int_equal(arena[0].count, arena[1].count);
    for (int i = 0; i < arena[0].count; i++) {
        assert_int_equal(arena[0].block[i].bytes, arena[1].block[i].bytes);
        assert_memory_equal(arena[0].block[i].memory, arena[1].block[i].memory,
                            arena[0].block[i].bytes);
    }
    arena_destroy(&arena[0]);
    arena_destroy(&arena[1]);
}

TEST(no_elements_give_no_batches)
{
    SCOPED(arena_destroy) Arena arena = {0};
    Batches b;
    BatchOptions from = options(4);
    from.element_count = 0;
    batches_create(&b, &from, &arena);
    assert_int_equal(batches_total(&b), 0);
}
