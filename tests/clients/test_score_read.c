// SPDX-License-Identifier: MIT
// From recordings to sheets: a strip that is cut in its middle, and a tool that presses.
#include "score_parts.h"

#include "test.h"
#include "scratch_folder.h"

static Timeline *timeline;
static Score score;
static Status status;
static char path[2][SCRATCH_PATH];

static const char SCENE[] = "name = \"strip\";\n"
                            "bodies = ( { name = \"strip\"; mesh = { file = \"none.obj\"; };\n"
                            "    fixed = ( { box = ([-1, -1, -1], [0, 1, 1]); } ); } );\n"
                            "score = { force_limit = 3.0; regions = ( { name = \"low\"; box = "
                            "([-1, -1, -1], [1, 0.004, 1]); } "
                            "); };\n";

// Two squares of 1 cm. Once cut, the right one has nodes 6 and 7 for 1 and 4.
static const int NODE_ID[] = {0, 1, 2, 3, 4, 5, 6, 7};
static const float POSITION[][3] = {{0.00f, 0.00f, 0}, {0.01f, 0.00f, 0}, {0.02f, 0.00f, 0},
                                    {0.00f, 0.01f, 0}, {0.01f, 0.01f, 0}, {0.02f, 0.01f, 0},
                                    {0.01f, 0.00f, 0}, {0.01f, 0.01f, 0}};
static const int WHOLE[][3] = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
static const int CUT[][3] = {{0, 1, 4}, {0, 4, 3}, {6, 2, 5}, {6, 5, 7}};
static const int ORIGIN[] = {0, 1, 2, 3, 4, 5, 1, 4};
static const int PARENT[][2] = {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}, {5, 5}, {6, 6}, {7, 7}};
static const signed char LEVEL[8] = {0};

static void add_mesh(Recording *recording, bool cut)
{
    const RecordingTopology topology = {.number = cut ? 2 : 1,
                                        .node_count = cut ? 8 : 6,
                                        .triangle_count = 4,
                                        .node_id = NODE_ID,
                                        .triangle = cut ? CUT : WHOLE,
                                        .node_origin = ORIGIN,
                                        .node_parent = PARENT,
                                        .node_level = LEVEL};
    assert_true(recording_add_topology(recording, 0, &topology));
}

static void add_frame(Recording *recording, int64_t step, bool cut)
{
    const RecordingFrame frame = {.step = step,
                                  .time = (double)step * 0.001,
                                  .topology = cut ? 2 : 1,
                                  .node_count = cut ? 8 : 6,
                                  .position = &POSITION[0][0]};
    const RecordingTool tool = {.position = vec3(0.0, 0.0, 0.05 * frame.time),
                                .orientation = QUAT_NONE,
                                .force = vec3(0.0, step >= 500 && step < 600 ? 4.0 : 1.0, 0.0)};
    assert_true(recording_add_frame(recording, 0, &frame) &&
                recording_add_tool(recording, 0, frame.time, &tool));
}

static void add_event(Recording *recording, int64_t step, const char *body, const char *kind)
{
    RecordingEvent event = {.time = (double)step * 0.001, .step = step};
    snprintf(event.body, sizeof event.body, "%s", body);
    snprintf(event.kind, sizeof event.kind, "%s", kind);
    snprintf(event.text, sizeof event.text, "</script><script>alert(1)</script>");
    assert_true(recording_add_event(recording, &event));
}

// Records steps [from, to) in frames of 10 ms, cut at step 505 without `event` or with it.
static const char *record(int number, const char *scene, int from, int to, const char *kind)
{
    const RecordingBody body = {.name = "strip", .nodes = 6, .triangles = 4};
    const int id = 7;
    const RecordingOptions options = {.scene = scene,
                                      .created_by = "<script>alert(\"1\")</script>",
                                      .body_count = 1,
                                      .tool_count = 1,
                                      .body = &body,
                                      .tool = &id};
    scratch_path(&scratch_space, number == 0 ? "a.h5" : "b.h5", path[number]);
    Recording *recording = recording_create(path[number], &options, &status);
    assert_non_null(recording);
    bool cut = from > 505;
    add_mesh(recording, cut);
    for (int step = from; step < to; step += 10) {
        if (step > 505 && !cut)
            add_mesh(recording, cut = true);
        add_frame(recording, step, cut);
    }
    if (*kind != '\0' && from < 505 && to > 505)
        add_event(recording, 505, "", kind);
    assert_true(recording_close(recording, &status));
    return path[number];
}

static void open_parts(int count)
{
    char *const part[] = {path[0], path[1]};
    timeline = timeline_open(part, count, &status);
    assert_non_null(timeline);
}

static void read_parts(int count)
{
    open_parts(count);
    expect_ok(score_read(timeline, NULL, &score, &status), status);
}

static int begin(void **unused)
{
    (void)unused;
    status = (Status){0};
    score = (Score){.part_count = 0};
    return scratch_create(&scratch_space);
}

static int end(void **unused)
{
    (void)unused;
    score_destroy(&score);
    timeline_close(timeline);
    timeline = NULL;
    scratch_destroy(&scratch_space);
    return 0;
}

AROUND_EACH(begin, end)

TEST(a_recorded_session_is_scored_by_its_scene)
{
    record(0, SCENE, 0, 1000, "cut");
    read_parts(1);
    expect_near(score.rules.scene.force_limit, 3.0, 0.0);
    assert_string_equal(score.rules.scene.region[0].name, "low");
    assert_int_equal(score.cut_count, 1);
    assert_string_equal(score.cut[0].kind, "cut");
    expect_near(score.cut[0].time_s, 0.505, 1e-12);
    expect_near(score.cut[0].inside, 0.004, 1e-9);
    expect_near(score.cut[0].outside, 0.006, 1e-9);
    assert_int_equal(score.body[0].cuts_both, 1);
    // The left square is fixed, the right one as large: it is the one that was removed.
    assert_int_equal(score.body[0].pieces_last, 2);
    assert_int_equal(score.body[0].removed, 1);
    expect_near(score.body[0].removed_size, 1e-4, 1e-11);
    const ScoreTool *tool = &score.tool[0];
    assert_int_equal(tool->id, 7);
    expect_near(tool->path_m, 0.05 * 0.99, 1e-12);
    expect_near(tool->peak_force_n, 4.0, 0.0);
    // Between rows the force is a line: a third of 10 ms on both sides of 90 ms.
    expect_near(tool->over_limit_s, 0.09 + 2.0 * 0.01 / 3.0, 1e-9);
    assert_int_equal(tool->over_limit_count, 1);
    assert_true(score.ended && score.fixed_known);
}

TEST(a_cut_without_an_event_is_found)
{
    record(0, SCENE, 0, 1000, "");
    read_parts(1);
    assert_int_equal(score.cut_count, 1);
    assert_string_equal(score.cut[0].kind, "");
    expect_near(score.cut[0].inside + score.cut[0].outside, 0.01, 1e-9);
    expect_near(score.cut[0].time_s, 0.51, 1e-12); // of the frame that shows it
}

TEST(a_recording_that_was_not_ended_says_so)
{
    const RecordingBody body = {.name = "strip", .nodes = 6, .triangles = 4};
    const RecordingOptions options = {
        .scene = SCENE, .created_by = "test", .body_count = 1, .body = &body};
    Recording *recording =
        recording_create(scratch_path(&scratch_space, "open.h5", path[1]), &options, &status);
    assert_non_null(recording);
    add_mesh(recording, false);
    const RecordingFrame frame = {.topology = 1, .node_count = 6, .position = &POSITION[0][0]};
    assert_true(recording_add_frame(recording, 0, &frame) && recording_flush(recording));
    // As it is on the disk now.
    file_copy(path[1], scratch_path(&scratch_space, "a.h5", path[0]));
    assert_true(recording_close(recording, &status));
    read_parts(1);
    assert_false(score.ended);
    assert_int_equal(score.body[0].pieces_last, 1);
}

TEST(parts_of_a_session_make_one_sheet)
{
    record(0, SCENE, 0, 500, "cut");
    record(1, SCENE, 500, 1000, "cut");
    read_parts(2);
    assert_int_equal(score.part_count, 2);
    assert_int_equal(score.cut_count, 1);
    expect_near(score.body[0].inside, 0.004, 1e-9);
    expect_near(score.tool[0].path_m, 0.05 * 0.99, 1e-12);
    assert_int_equal(score.tool[0].gaps, 0);
}

TEST(parts_of_different_scenes_are_refused)
{
    record(0, "scene strip: 1000 Hz\nunits: m\n", 0, 500, "");
    record(1, "scene other: 1000 Hz\nunits: m\n", 0, 500, "");
    open_parts(2);
    assert_false(score_read(timeline, NULL, &score, &status));
    assert_non_null(
        strstr(status.text, "part 2 is of the scene 'other', part 1 of 'strip': score them alone"));
}

TEST(a_description_names_limit_and_regions)
{
    record(0,
           "scene strip: 1000 Hz, gravity [0, 0, 0] m/s2, 1 bodies, 1 tools, 0 loads\n"
           "body strip: {\n"
           "score = { force_limit = 2.5; regions = ( { name = \"a\"; sphere = (0.0, 0.0, 0.0); "
           "radius = 0.1; } ); };\n"
           "units: m\n",
           0, 100, "");
    read_parts(1);
    expect_near(score.rules.scene.force_limit, 2.5, 0.0);
    assert_int_equal(score.rules.scene.region_count, 1);
    assert_int_equal(score.rules.scene.region[0].region.kind, FIXED_SPHERE);
    assert_false(score.fixed_known);
    assert_string_equal(score.scene, "strip");
}

TEST(another_scene_can_be_named)
{
    static const char OTHER[] = "score = { force_limit = 7; };\n";
    char scene[SCRATCH_PATH];
    record(0, SCENE, 0, 100, "");
    file_write(scratch_path(&scratch_space, "other.cfg", scene), OTHER, strlen(OTHER));
    open_parts(1);
    assert_true(score_read(timeline, scene, &score, &status));
    expect_near(score.rules.scene.force_limit, 7.0, 0.0);
    assert_int_equal(score.rules.scene.region_count, 0);
}

TEST(bad_rules_are_refused_with_their_line)
{
    static const char *const BAD[][2] = {
        {"name = \"a\";\nscore = { force_limit = -1.0; };", ":2: score.force_limit -1"},
        {"score = 5;", "score must be a group"},
        {"score = { regions = ( { sphere = [0, 0, 0]; } ); };", "radius is missing"},
        {"score = { regions = ( { nodes = [1]; } ); };", "nodes"},
        {"score = { regions = 3; };", "regions"},
        {"score = { weight = 3; };", "weight"},
        {"bodies = 3;", "bodies must be a list"},
        {"bodies = ( 1, { name = \"a\"; fixed = ( 2 ); } );", "fixed"},
        {"@include \"/etc/passwd\"\n", "--score-scene"},
        {"score = { force_limit = ", "--score-scene"},
        {"scene x\nscore = { regions = (", "recorded scene"},
    };
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        record(0, BAD[i][0], 0, 50, "");
        open_parts(1);
        assert_false(score_read(timeline, NULL, &score, &status));
        assert_int_equal(status.code, STATUS_INVALID);
        if (strstr(status.text, BAD[i][1]) == NULL)
            fail_msg("\"%s\" does not say \"%s\"", status.text, BAD[i][1]);
        end(NULL);
        begin(NULL);
    }
}

// --- files ---------------------------------------------------------------------------------------

// The file that was written; the caller frees it.
static char *read_file(const char *ending)
{
    char name[16], file[SCRATCH_PATH];
    size_t size;
    snprintf(name, sizeof name, "sheet%s", ending);
    return (char *)file_read(scratch_path(&scratch_space, name, file), &size);
}

TEST(three_files_say_the_same_and_escape_what_recordings_say)
{
    record(0, SCENE, 0, 1000, "cut");
    read_parts(1);
    const char *base = scratch_at("sheet");
    // A second time replaces the first.
    assert_true(score_write(&score, base, &status));
    assert_true(score_write(&score, base, &status));
    FREED char *json = read_file(".json");
    expect_in(json, "\"severed_inside_m\": 0.004");
    expect_in(json, "alert(\\\"1\\\")");
    assert_null(strstr(json, "nan"));
    assert_null(strstr(json, "inf,"));
    FREED char *csv = read_file(".csv");
    expect_in(csv, "body,strip,severed_inside,0.004");
    expect_in(csv, "tool,7,over_limit_count,1,1");
    FREED char *page = read_file(".html");
    expect_in(page, "&#60;script&#62;");
    assert_null(strstr(page, "<script"));
    assert_null(strstr(page, "nan"));
    assert_null(strstr(page, "http")); // nothing comes from elsewhere
}

TEST(a_file_of_someone_else_is_kept)
{
    char base[SCRATCH_PATH], name[SCRATCH_PATH];
    record(0, SCENE, 0, 100, "");
    read_parts(1);
    scratch_path(&scratch_space, "sheet", base);
    file_write(scratch_path(&scratch_space, "sheet.csv", name), "my notes\n", 9);
    assert_false(score_write(&score, base, &status));
    FREED char *notes = read_file(".csv");
    assert_string_equal(notes, "my notes\n");
}
