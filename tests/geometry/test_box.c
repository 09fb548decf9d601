// SPDX-License-Identifier: MIT
// Axis-aligned boxes.
#include "test.h"
#include "geometry/box.h"
#include "random.h"

TEST(box_reaches_to_the_outermost_of_its_points)
{
    uint64_t random = 3;
    Box box = box_empty();
    double low[3] = {2.0, 2.0, 2.0}, high[3] = {-2.0, -2.0, -2.0};
    for (int i = 0; i < 1000; i++) {
        const Vec3 x = random_vec3(&random);
        const double at[3] = {x.x, x.y, x.z};
        box_add(&box, x);
        for (int c = 0; c < 3; c++) {
            low[c] = fmin(low[c], at[c]);
            high[c] = fmax(high[c], at[c]);
        }
        assert_memory_equal(box.low, low, sizeof low);
        assert_memory_equal(box.high, high, sizeof high);
    }
}

TEST(one_point_makes_a_box_without_size_and_none_an_empty_one)
{
    Box box = box_empty();
    for (int c = 0; c < 3; c++)
        assert_true(box.low[c] > box.high[c]);
    box_add(&box, vec3(1.0, -2.0, 3.0));
    expect_near(box_extent(&box), 0.0, 0.0);
    expect_near(box_middle(&box).y, -2.0, 0.0);
}

// Numbers that binary fractions hold: no rounding.
TEST(sides_middle_and_margin_are_those_of_the_corners)
{
    Box box = box_empty();
    box_add(&box, vec3(1.0, 5.0, -1.0));
    box_add(&box, vec3(0.0, -2.0, 3.0));
    const Vec3 size = box_size(&box), middle = box_middle(&box);
    expect_near(size.x, 1.0, 0.0);
    expect_near(size.y, 7.0, 0.0);
    expect_near(size.z, 4.0, 0.0);
    expect_near(middle.x, 0.5, 0.0);
    expect_near(middle.y, 1.5, 0.0);
    expect_near(middle.z, 1.0, 0.0);
    expect_near(box_extent(&box), 7.0, 0.0);
    box_grow(&box, 0.25);
    expect_near(box_low(&box).y, -2.25, 0.0);
    expect_near(box_high(&box).z, 3.25, 0.0);
    expect_near(box_extent(&box), 7.5, 0.0);
}
