// SPDX-License-Identifier: MIT
// The course of a grasper's jaws, as --grip says it.
#include "test.h"
#include "track.h"

TEST(one_number_holds_for_ever)
{
    Grip grip;
    assert_true(grip_parse("0.7", &grip));
    expect_near(grip_at(&grip, 0.0), 0.7, 0.0);
    expect_near(grip_at(&grip, 1e4), 0.7, 0.0);
    expect_near(grip_at(&(Grip){0}, 1.0), 0.0, 0.0);
}

TEST(points_are_joined_by_straight_lines)
{
    Grip grip;
    assert_true(grip_parse("1:0,2:1,2:0.5,4:0.25", &grip));
    expect_near(grip_at(&grip, 0.0), 0.0, 0.0);
    expect_near(grip_at(&grip, 1.5), 0.5, 1e-15);
    expect_near(grip_at(&grip, 2.0), 0.5, 0.0); // a jump
    expect_near(grip_at(&grip, 3.0), 0.375, 1e-15);
    expect_near(grip_at(&grip, 9.0), 0.25, 0.0);
}

TEST(what_is_no_course_is_refused)
{
    static const char *const bad[] = {
        "",        "x",  "1.1", "-0.1",  "nan", "0:2",  "0:0,",  "1:0,0:1", "0:0;1",
        "0:0,1:x", ":1", "0:",  "0:0 1", "inf", "-1:0", "1e6:0", "0,1:1",   "0:nan"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        Grip grip;
        if (grip_parse(bad[i], &grip)) {
            print_error("\"%s\" was taken\n", bad[i]);
            fail();
        }
    }
}
