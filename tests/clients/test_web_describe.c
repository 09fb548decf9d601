// SPDX-License-Identifier: MIT
// Tools from the daemon's own words.
#include "texts.h"
#include "test.h"

static const char TEXT[] = "scene s: 1000 Hz, gravity [0, 0, 0] m/s2, 1 bodies, 4 tools, 0 loads\n"
                           "body sphere: model surface, leapfrog\n"
                           "  nodes 42 (3 fixed), springs 120, faces 80, pieces 1, mass 0.1 kg\n"
                           "tool 1: probe, 2 capsules, max_force 5 N\n"
                           "  capsule [0, 0, 0] to [0, 0, 0.1], radius 0.005 m\n"
                           "  capsule [0.001, -2e-05, 0] to [0, 0, 0], radius 0.0025 m\n"
                           "tool 20: blade, edge 0.02 m, 0 capsules, max_force 3.3 N\n"
                           "  edge [0, 0, 0] to [0, 0, 0.02] m\n"
                           "tool 4: static, 0 capsules, a plane\n"
                           "  plane [0, 0, -0.05] m, normal [0, 0, 1]\n"
                           "tool 5: remover, by suction, 1 capsules, max_force 3.3 N\n"
                           "  takes 100 mm3/s\n"
                           "  mouth [0, 0, 0.001] to [0, 0, 0], radius 0.004 m\n"
                           "publish on PLIANT_...: nodes 60 Hz\n"
                           "  capsule [9, 9, 9] to [9, 9, 9], radius 9 m\n";

TEST(shapes_belong_to_the_tool_above_them)
{
    DescribedTool tool[DESCRIBE_TOOLS];
    assert_int_equal(describe_tools(TEXT, tool), 4);
    assert_int_equal(tool[0].id, 1);
    assert_string_equal(tool[0].kind, "probe");
    expect_near(tool[0].max_force, 5.0, 0.0);
    assert_int_equal(tool[0].capsules, 2);
    expect_near(tool[0].capsule[0].to[2], 0.1, 0.0);
    expect_near(tool[0].capsule[1].from[1], -2e-5, 0.0);
    expect_near(tool[0].capsule[1].radius, 0.0025, 0.0);
    assert_false(tool[0].has_edge);
    assert_int_equal(tool[1].id, 20);
    assert_true(tool[1].has_edge);
    expect_near(tool[1].edge[1][2], 0.02, 0.0);
    assert_string_equal(tool[2].kind, "static");
    assert_false(tool[2].has_force);
    assert_true(tool[2].has_plane);
    expect_near(tool[2].point[2], -0.05, 0.0);
    expect_near(tool[2].normal[2], 1.0, 0.0);
    assert_int_equal(tool[2].capsules, 0); // that line is below another
    assert_string_equal(tool[2].removes, "");
    assert_string_equal(tool[3].kind, "remover");
    assert_string_equal(tool[3].removes, "suction");
    assert_true(tool[3].has_mouth);
    expect_near(tool[3].mouth.from[2], 0.001, 0.0);
    expect_near(tool[3].mouth.radius, 0.004, 0.0);
}

TEST(what_is_no_number_or_too_much_is_left_out)
{
    DescribedTool tool[DESCRIBE_TOOLS];
    assert_int_equal(describe_tools("", tool), 0);
    assert_int_equal(describe_tools("tool\ntool x: probe\ntool 1\n", tool), 0);
    assert_int_equal(describe_tools("tool 1: probe, max_force nan N\n"
                                    "  capsule [inf, 0, 0] to [0, 0, 0], radius 1 m\n"
                                    "  capsule [1, 0, 0] to [0, 0], radius 1 m",
                                    tool),
                     1);
    assert_int_equal(tool[0].capsules, 0);
    assert_false(tool[0].has_force);
    char text[16384] = "";
    for (int k = 0; k < 2 * DESCRIBE_TOOLS; k++)
        strcat(text, "tool 1: a_kind_of_tool_with_a_long_name, 1 capsules\n");
    for (int k = 0; k < 2 * DESCRIBE_CAPSULES; k++)
        strcat(text, "  capsule [0, 0, 0] to [0, 0, 0], radius 1 m\n");
    assert_int_equal(describe_tools(text, tool), DESCRIBE_TOOLS);
    // A line beyond all bounds.
    static char line[100000];
    memset(line, 'x', sizeof line - 1);
    memcpy(line, "tool 1: probe", 13);
    assert_int_equal(describe_tools(line, tool), 1);
}

// --- A recording ---

static bool contains(const Parcel *parcel, const char *text)
{
    return memmem(parcel->data, parcel->size, text, strlen(text)) != NULL;
}

TEST(a_recording_has_the_marks_and_the_curve_of_each_tool)
{
    double time[1] = {1.5};
    char *kind[1] = {(char *)"cut"}, *text[1] = {(char *)"\xff \"x\""}; // no UTF-8, and a quote
    int32_t tool[2] = {1, 7};
    float force[5] = {0.0f, 0.5f, 1.0f, 0.25f, 9.0f}; // one that belongs to no tool
    const pliant_playback_t playback = {.whole = true,
                                        .end = 3.0,
                                        .num_marks = 1,
                                        .mark_time = time,
                                        .mark_kind = kind,
                                        .mark_text = text,
                                        .num_tools = 2,
                                        .num_forces = 5,
                                        .tool = tool,
                                        .force = force};
    Parcel *recording = text_recording(&playback), *now = text_playback(&playback);
    assert_true(contains(recording, "\"marks\":[{\"time\":1.5,\"kind\":\"cut\",\"text\":"
                                    "\"? \\\"x\\\"\"}]"));
    assert_true(contains(recording, "{\"tool\":1,\"force\":[0.0,0.5]}"));
    assert_true(contains(recording, "{\"tool\":7,\"force\":[1.0,0.25]}"));
    assert_true(contains(now, "\"type\":\"playback\""));
    assert_false(contains(now, "marks"));
    parcel_drop(recording);
    parcel_drop(now);
}
