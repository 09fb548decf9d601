// SPDX-License-Identifier: MIT
// Where a body is pressed that nobody has measured.
#include "aim.h"
#include "test.h"

static const double DOWN[3] = {0.0, 0.0, -1.0};

TEST(the_highest_node_is_pressed_from_above)
{
    const float position[] = {0, 0, 1, 5, 5, 2, 9, 9, 0};
    const int32_t id[] = {0, 1, 2};
    double node[3];
    aim_choose(3, position, id, DOWN, node);
    expect_near(node[0], 5.0, 0.0);
    expect_near(node[2], 2.0, 0.0);
    aim_choose(3, position, id, (const double[3]){0.0, 0.0, 1.0}, node);
    expect_near(node[0], 9.0, 0.0);
}

TEST(a_flat_side_is_pressed_in_its_middle)
{
    enum { SIDE = 5, COUNT = SIDE * SIDE + 1 };
    float position[3 * COUNT];
    int32_t id[COUNT];
    for (int i = 0; i < COUNT; i++) {
        id[i] = i;
        position[3 * i] = (float)(i % SIDE);
        position[3 * i + 1] = (float)(i / SIDE);
        position[3 * i + 2] = 3.0f + 1e-4f * (float)(i % 2); // as it sways
    }
    position[3 * (COUNT - 1) + 2] = 0.0f; // what lies below
    double node[3];
    aim_choose(COUNT, position, id, DOWN, node);
    expect_near(node[0], 2.0, 0.0);
    expect_near(node[1], 2.0, 0.0);
}

TEST(free_slots_are_no_nodes)
{
    const float position[] = {0, 0, 9, 1, 0, 1, 3, 0, 1};
    const int32_t id[] = {-1, 0, -1};
    double node[3];
    aim_choose(3, position, id, DOWN, node);
    expect_near(node[0], 1.0, 0.0);
}
