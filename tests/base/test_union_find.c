// SPDX-License-Identifier: MIT
// Disjoint sets against labels that every join rewrites.
#include "test.h"
#include "base/sets.h"
#include "random.h"

enum { COUNT = 200, ROUNDS = 50 };

// Gives both sets of labels the lower label. Returns true if they were two.
static bool relabel(int *label, int a, int b)
{
    const int low = label[a] < label[b] ? label[a] : label[b];
    const int high = label[a] < label[b] ? label[b] : label[a];
    for (int i = 0; i < COUNT; i++)
        label[i] = label[i] == high ? low : label[i];
    return low != high;
}

// A random number of joins, from none to more than make one set of all.
static int join_some(uint64_t *random, int (*pair)[2])
{
    const int count = random_below(random, 3 * COUNT);
    for (int k = 0; k < count; k++)
        for (int end = 0; end < 2; end++)
            pair[k][end] = random_below(random, COUNT);
    return count;
}

TEST(root_is_the_lowest_of_all_that_were_joined)
{
    uint64_t random = 5;
    int pair[3 * COUNT][2], parent[COUNT], label[COUNT];
    for (int round = 0; round < ROUNDS; round++) {
        union_find_reset(parent, COUNT);
        for (int i = 0; i < COUNT; i++)
            label[i] = i;
        const int count = join_some(&random, pair);
        for (int k = 0; k < count; k++)
            assert_int_equal(union_find_join(parent, pair[k][0], pair[k][1]),
                             relabel(label, pair[k][0], pair[k][1]));
        for (int i = 0; i < COUNT; i++)
            assert_int_equal(union_find_root(parent, i), label[i]);
    }
}

// Also by parents that lead to the root over several others.
TEST(sets_are_numbered_by_their_lowest_members)
{
    uint64_t random = 6;
    int pair[3 * COUNT][2], parent[COUNT], label[COUNT], number[COUNT];
    for (int round = 0; round < ROUNDS; round++) {
        union_find_reset(parent, COUNT);
        for (int i = 0; i < COUNT; i++)
            label[i] = i;
        const int count = join_some(&random, pair);
        for (int k = 0; k < count; k++) {
            union_find_join(parent, pair[k][0], pair[k][1]);
            relabel(label, pair[k][0], pair[k][1]);
        }
        int sets = 0;
        for (int i = 0; i < COUNT; i++)
            number[i] = label[i] == i ? sets++ : number[label[i]];
        assert_int_equal(union_find_number(parent, COUNT), sets);
        for (int i = 0; i < COUNT; i++)
            assert_int_equal(parent[i], number[i]);
    }
    assert_int_equal(union_find_number(parent, 0), 0);
}

TEST(order_of_the_joins_does_not_matter)
{
    uint64_t random = 7;
    int pair[3 * COUNT][2], parent[2][COUNT];
    for (int round = 0; round < ROUNDS; round++) {
        const int count = join_some(&random, pair);
        for (int way = 0; way < 2; way++) {
            union_find_reset(parent[way], COUNT);
            for (int k = 0; k < count; k++) {
                const int *join = pair[way == 0 ? k : count - 1 - k];
                union_find_join(parent[way], join[way], join[1 - way]);
            }
            union_find_number(parent[way], COUNT);
        }
        assert_memory_equal(parent[0], parent[1], sizeof parent[0]);
    }
}
