#include "expect.h"
#include "random.h"

#include "voxel/batch.h"

#include <stdlib.h>
#include <string.h>

enum { ELEMENTS = 500, VERTICES = 900, GIVEN = 5 };

static int vertex[ELEMENTS][NODE_COUNT], element_class[ELEMENTS];
static ElementClass classes[GIVEN];

// Elements of few rest shapes, with vertices at random; the last class equals the first, the one
// before it is nobody's.
static BatchOptions options(uint64_t seed)
{
    uint64_t random = seed;
    for (int c = 0; c < GIVEN; c++)
        classes[c] = (ElementClass){1e-3 * (1 + c % 4), 1e3, 0.0, 1.0, 0.0};
    for (int e = 0; e < ELEMENTS; e++) {
        static const unsigned masks[4] = {0, 0x1, 0x20003, 0x1};
        unsigned mask = masks[random_below(&random, 4)];
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

static void every_element_stands_in_one_lane_with_its_vertices(void **unused)
{
    (void)unused;
    Arena arena = {0};
    Batches b;
    BatchOptions from = options(1);
    batches_create(&b, &from, &arena);
    const int lanes = batches_total(&b) * LANES;
    int *owner = malloc((size_t)lanes * sizeof *owner);
    assert_non_null(owner);
    for (int i = 0; i < lanes; i++)
        owner[i] = -1;
    for (int e = 0; e < ELEMENTS; e++) {
        assert_in_range(b.place[e], 0, lanes - 1);
        assert_int_equal(owner[b.place[e]], -1);
        owner[b.place[e]] = e;
    }
    for (int i = 0; i < lanes; i++) {
        const int batch = i / LANES, hanging = batch - b.plain.batch_count, e = owner[i];
        Template cube;
        template_create(&cube, 0);
        const Template *t = hanging < 0 ? &cube : &b.templates[b.hanging.template_index[hanging]];
        const int *row = hanging < 0 ? b.plain.vertex + batch * NODE_CORNERS * LANES
                                     : b.hanging.vertex + b.hanging.start[hanging] * LANES;
        for (int n = 0; n < t->count; n++)
            assert_int_equal(row[n * LANES + i % LANES], e < 0 ? VERTICES : vertex[e][t->node[n]]);
        if (e < 0)
            continue;
        assert_int_equal(t->mask, mask_of(e));
        const int c = hanging < 0 ? b.plain.element_class[batch] : b.hanging.element_class[hanging];
        assert_memory_equal(&b.classes[c], &classes[element_class[e]], sizeof(ElementClass));
    }
    free(owner);
    arena_destroy(&arena);
}

static void batches_follow_template_class_and_element(void **unused)
{
    (void)unused;
    Arena arena = {0};
    Batches b;
    BatchOptions from = options(2);
    batches_create(&b, &from, &arena);
    assert_int_equal(b.template_count, 2);
    assert_int_equal(b.class_count, 3); // one is unused, two are equal
    for (int e = 0; e < ELEMENTS; e++)
        for (int f = 0; f < ELEMENTS; f++) {
            if (mask_of(e) != mask_of(f)) {
                assert_true((b.place[e] < b.place[f]) == (mask_of(e) < mask_of(f)));
                continue;
            }
            double one = classes[element_class[e]].size, other = classes[element_class[f]].size;
            if (one != other)
                assert_true((b.place[e] < b.place[f]) == (one < other));
            else
                assert_true((b.place[e] < b.place[f]) == (e < f));
        }
    // No lane is left over but in the last batch of a class.
    int count[4][GIVEN] = {{0}}, needed = 0;
    for (int e = 0; e < ELEMENTS; e++)
        count[mask_of(e) == 0 ? 0 : mask_of(e) == 1 ? 1 : 2][element_class[e] % (GIVEN - 1)]++;
    for (int k = 0; k < 4 * GIVEN; k++)
        needed += (count[k / GIVEN][k % GIVEN] + LANES - 1) / LANES;
    assert_int_equal(batches_total(&b), needed);
    arena_destroy(&arena);
}

static void the_same_elements_give_the_same_batches(void **unused)
{
    (void)unused;
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

static void no_elements_give_no_batches(void **unused)
{
    (void)unused;
    Arena arena = {0};
    Batches b;
    BatchOptions from = options(4);
    from.element_count = 0;
    batches_create(&b, &from, &arena);
    assert_int_equal(batches_total(&b), 0);
    arena_destroy(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_element_stands_in_one_lane_with_its_vertices),
        cmocka_unit_test(batches_follow_template_class_and_element),
        cmocka_unit_test(the_same_elements_give_the_same_batches),
        cmocka_unit_test(no_elements_give_no_batches),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
