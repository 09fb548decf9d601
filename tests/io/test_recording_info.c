// SPDX-License-Identifier: MIT
// What is said of a recording: of a whole one, of one that still grows, and of files that lie.
#include "test.h"
#include "io/recording.h"
#include "scratch_folder.h"

#ifdef PLIANT_WITH_HDF5
#include "recording_view.h"

enum { NODES = 4, FRAMES = 10 };

// A tetrahedron that loses a triangle after half of the frames, a tool, and two kinds of events.
static Recording *begin(const char *path)
{
    static const int id[NODES] = {0, 1, 2, 3}, tool[1] = {3};
    static const int triangle[2][3] = {{0, 1, 2}, {0, 2, 3}};
    const RecordingBody body = {.name = "tetra", .nodes = NODES, .triangles = 2};
    const RecordingOptions options = {.scene = "a scene",
                                      .created_by = "test 1",
                                      .body_count = 1,
                                      .tool_count = 1,
                                      .body = &body,
                                      .tool = tool};
    Status status = {0};
    Recording *recording = recording_create(path, &options, &status);
    if (recording == NULL)
        fail_msg("%s", status.text);
    for (int f = 0; f < FRAMES; f++) {
        const float position[3 * NODES] = {(float)f};
        const int nodes = f < FRAMES / 2 ? NODES : NODES - 1;
        const RecordingTopology topology = {.number = f < FRAMES / 2 ? 1 : 2,
                                            .node_count = nodes,
                                            .triangle_count = nodes - 2,
                                            .node_id = id,
                                            .triangle = triangle};
        if (f % (FRAMES / 2) == 0)
            assert_true(recording_add_topology(recording, 0, &topology));
        const RecordingFrame frame = {.step = 5 + 2 * f,
                                      .time = 0.5 + f,
                                      .topology = topology.number,
                                      .node_count = nodes,
                                      .position = position};
        assert_true(recording_add_frame(recording, 0, &frame));
        const RecordingTool sample = {.orientation = {1.0, 0.0, 0.0, 0.0}};
        assert_true(recording_add_tool(recording, 0, frame.time, &sample));
        RecordingEvent event = {.step = f};
        strcpy(event.kind, f % 3 == 0 ? "cut" : "reset");
        assert_true(recording_add_event(recording, &event));
    }
    const RecordingCounts counts = {.lost = 1, .dropped = 2, .without_mesh = 3, .refused = 4};
    recording_set_counts(recording, 0, &counts);
    return recording;
}

static const char *make(const char *name)
{
    Status status = {0};
    const char *path = scratch_at(name);
    Recording *recording = begin(path);
    expect_ok(recording_close(recording, &status), status);
    return path;
}

static void expect_content(const RecordingInfo *info)
{
    assert_string_equal(info->created_by, "test 1");
    assert_int_equal(info->body_count, 1);
    const RecordingBodyInfo *body = &info->body[0];
    assert_string_equal(body->name, "tetra");
    assert_int_equal(body->frames, FRAMES);
    assert_int_equal(body->broken, 0);
    assert_int_equal(body->first_step, 5);
    assert_int_equal(body->last_step, 5 + 2 * (FRAMES - 1));
    expect_near(body->first_time, 0.5, 0.0);
    expect_near(body->last_time, 0.5 + FRAMES - 1, 0.0);
    assert_int_equal(body->topologies, 2);
    assert_int_equal(body->least_nodes, NODES - 1);
    assert_int_equal(body->most_nodes, NODES);
    assert_int_equal(info->tool_count, 1);
    assert_string_equal(info->tool[0].name, "3");
    assert_int_equal(info->tool[0].rows, FRAMES);
    assert_int_equal(info->events, FRAMES);
    assert_int_equal(info->kind_count, 2);
    assert_string_equal(info->kind[0].kind, "cut");
    assert_int_equal(info->kind[0].events, (FRAMES + 2) / 3);
}

static int setup(void **state)
{
    (void)state;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return scratch_create(&scratch_space);
}

AROUND_ALL(setup, scratch_end)

TEST(what_is_in_a_recording_is_said)
{
    static RecordingInfo info;
    Status status = {0};
    expect_ok(recording_info_read(make("whole.h5"), &info, &status), status);
    expect_content(&info);
    assert_true(info.ended);
    const RecordingCounts *counts = &info.body[0].counts;
    assert_int_equal(counts->lost, 1);
    assert_int_equal(counts->dropped, 2);
    assert_int_equal(counts->without_mesh, 3);
    assert_int_equal(counts->refused, 4);
}

TEST(one_that_still_grows_is_read_and_not_called_ended)
{
    static RecordingInfo info;
    Status status = {0};
    const char *path = scratch_at("growing.h5");
    Recording *recording = begin(path);
    assert_true(recording_flush(recording));
    expect_ok(recording_info_read(path, &info, &status), status);
    expect_content(&info);
    assert_false(info.ended);
    assert_true(recording_close(recording, &status));
}

// --- Files that lie ---

static void expect_refusal(const char *path, const char *needle)
{
    static RecordingInfo info;
    Status status = {0};
    if (recording_info_read(path, &info, &status) || status.code != STATUS_INVALID ||
        strstr(status.text, needle) == NULL)
        fail_msg("'%s' expected in: %s", needle, status.text);
}

TEST(names_of_a_file_do_not_command_the_terminal)
{
    static RecordingInfo info = {.created_by = "a\033]b\xc2\x9b"
                                               "c",
                                 .tool_count = 1,
                                 .tool[0].name = "c\nd"};
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    recording_info_print(&info, out);
    fclose(out);
    expect_in(text, "made by a?]b\xc2?c\n");
    expect_in(text, "tool c?d: 0 rows\n");
    free(text);
}

TEST(what_is_missing_or_of_another_shape_is_named)
{
    static const char *const sets[] = {"/bodies/tetra/frames/time",
                                       "/bodies/tetra/frames/first",
                                       "/bodies/tetra/position",
                                       "/bodies/tetra/triangles",
                                       "/bodies/tetra/topology/count",
                                       "/tools/3/force",
                                       "/events"};
    for (int k = 0; k < 7; k++)
        for (int other = 0; other < 2; other++) { // gone; or a single number
            char name[32];
            snprintf(name, sizeof name, "shape-%d-%d.h5", k, other);
            const char *path = make(name);
            hid_t file = view_change(path);
            assert_true(H5Ldelete(file, sets[k], H5P_DEFAULT) >= 0);
            if (other) {
                hid_t space = H5Screate(H5S_SCALAR);
                H5Dclose(H5Dcreate2(file, sets[k], H5T_NATIVE_INT, space, H5P_DEFAULT, H5P_DEFAULT,
                                    H5P_DEFAULT));
                H5Sclose(space);
            }
            H5Fclose(file);
            expect_refusal(path, sets[k]);
        }
}

// Indices that point anywhere make no frame.
TEST(frames_whose_rows_are_not_there_do_not_count)
{
    static const struct {
        const char *set;
        int64_t value;
    } lies[] = {
        {"/bodies/tetra/frames/first", INT64_MAX}, {"/bodies/tetra/frames/first", -1},
        {"/bodies/tetra/frames/count", INT32_MAX}, {"/bodies/tetra/frames/count", -4},
        {"/bodies/tetra/frames/topology", 77},     {"/bodies/tetra/topology/first", 99},
        {"/bodies/tetra/topology/count", -1},      {"/bodies/tetra/topology/node_first", -9},
        {"/bodies/tetra/topology/node_count", 100}};
    static RecordingInfo info;
    for (int k = 0; k < 9; k++) {
        char name[32];
        Status status = {0};
        snprintf(name, sizeof name, "lie-%d.h5", k);
        const char *path = make(name);
        view_put_row(path, lies[k].set, H5T_NATIVE_INT64, 0, 0, &lies[k].value);
        expect_ok(recording_info_read(path, &info, &status), status);
        // A lie of a frame, or of the topology of half of them.
        int lost = strstr(lies[k].set, "/topology/") != NULL ? FRAMES / 2 : 1;
        assert_int_equal(info.body[0].frames, FRAMES - lost);
        assert_int_equal(info.body[0].broken, lost);
    }
}

TEST(what_is_no_recording_is_refused)
{
    expect_refusal(scratch_at("nowhere.h5"), "nowhere.h5");
    scratch_write_text("text.h5", "no HDF5");
    expect_refusal(scratch_at("text.h5"), "not an HDF5 file");
    H5Fclose(H5Fcreate(scratch_at("other.h5"), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
    expect_refusal(scratch_at("other.h5"), "no recording");
    const char *path = make("short.h5");
    assert_int_equal(truncate(path, 3000), 0);
    expect_refusal(path, "short.h5");
}

#else

TEST(what_is_not_built_in_is_refused)
{
    static RecordingInfo info;
    Status status = {0};
    assert_false(recording_info_read("x.h5", &info, &status));
    expect_in(status.text, "PLIANT_HDF5");
}
#endif
