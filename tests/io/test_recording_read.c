// SPDX-License-Identifier: MIT
// Recordings are read at any time, bit for bit, and files that lie are refused.
#include "test.h"
#include "scratch_folder.h"

#ifdef PLIANT_WITH_HDF5
#include "io/recording_read.h"
#include "recording_view.h"

enum { NODES = 5, FRAMES = 40, CUT_AT = 15 };

// Positions of which every bit is known, also where they are tiny.
static float coordinate(int frame, int i)
{
    return (float)(1.0 / (3.0 + 7 * frame + 11 * i)) * (i % 4 == 0 ? 1e-30f : 1.0f);
}

static int nodes_at(int frame)
{
    return frame < CUT_AT ? NODES : NODES - 1;
}

static double time_at(int frame)
{
    return 0.1 * frame;
}

static const char DESCRIBED[] = "scene tetra: 1000 Hz\nbody tetra: model surface, leapfrog\n";

// Nodes 9 and 3 are copies of others, and finer.
static const int origin[NODES] = {0, 1, 2, 2, 0};
static const int parent[NODES][2] = {{0, 0}, {1, 1}, {0, 1}, {3, 3}, {0, 2}};
static const signed char level[NODES] = {0, 0, 0, 1, 2};

static unsigned char share_at(int frame, int node)
{
    return (unsigned char)(7 * frame + 40 * node);
}

// Maps that a reader finds: of every tenth frame; of every fifth what is of no mesh, of another
// number of rows, or at no time that follows.
static void add_maps(Recording *recording, int f)
{
    unsigned char share[NODES];
    const int triangles = nodes_at(f) - 3;
    const int16_t tag[2] = {(int16_t)(-f), 300};
    const unsigned char deep[2] = {(unsigned char)f, 3};
    for (int i = 0; i < NODES; i++)
        share[i] = share_at(f, i);
    RecordingMap map = {
        .time = time_at(f), .step = 100 * f, .topology = f < CUT_AT ? 1 : 2, .count = nodes_at(f)};
    RecordingMap elements = map;
    elements.count = triangles;
    elements.elements[1] = f;
    if (f % 10 == 5) {
        map.topology = 3;
        elements.count = triangles - 1;
        assert_true(recording_add_map(recording, 0, RECORDING_ERROR_MAP, &map,
                                      (const void *const[]){share}));
        map.topology = 1;
        map.time = f == 25 ? -1.0 : (double)NAN;
    }
    assert_true(
        recording_add_map(recording, 0, RECORDING_ERROR_MAP, &map, (const void *const[]){share}));
    assert_true(recording_add_map(recording, 0, RECORDING_ELEMENTS, &elements,
                                  (const void *const[]){tag, deep}));
}

static const char *make_with(const char *name, const char *describe, const char *text)
{
    static const int id[NODES] = {0, 1, 2, 3, 9}, tool[1] = {3};
    const char *path = scratch_at(name);
    static const int triangle[2][3] = {{0, 1, 2}, {0, 2, 3}};
    const RecordingBody body = {"tetra", NODES, 2, 1, false, {true, true}};
    const RecordingOptions options = {.scene = text,
                                      .describe = describe,
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
        float position[3 * NODES];
        for (int i = 0; i < 3 * NODES; i++)
            position[i] = coordinate(f, i);
        const RecordingTopology topology = {.number = f < CUT_AT ? 1 : 2,
                                            .node_count = nodes_at(f),
                                            .triangle_count = nodes_at(f) - 3,
                                            .node_id = id,
                                            .node_origin = describe != NULL ? origin : NULL,
                                            .node_parent = describe != NULL ? parent : NULL,
                                            .node_level = describe != NULL ? level : NULL,
                                            .triangle = triangle};
        if (f == 0 || f == CUT_AT)
            assert_true(recording_add_topology(recording, 0, &topology));
        const RecordingFrame frame = {.step = 100 * f,
                                      .time = time_at(f),
                                      .topology = topology.number,
                                      .node_count = topology.node_count,
                                      .position = position};
        assert_true(recording_add_frame(recording, 0, &frame));
        if (f % 5 == 0)
            add_maps(recording, f);
        const RecordingTool sample = {.position = {f, 2.0, 3.0},
                                      .orientation = {f == 0 ? (double)NAN : 1.0, 0.0, 0.0, 0.25},
                                      .force = {0.5, -f, 0.25}};
        assert_true(recording_add_tool(recording, 0, frame.time, &sample));
        RecordingEvent event = {.time = frame.time, .step = f, .kind = "cut", .text = "a cut"};
        if (f % 10 == 5)
            assert_true(recording_add_event(recording, &event));
        RecordingLedger ledger[2] = {
            {.time = frame.time, .step = f, .line = LEDGER_BODY, .body = "tetra"},
            {.time = frame.time,
             .step = f,
             .line = LEDGER_TISSUE,
             .body = "tetra",
             .name = "fat",
             .value = {1.0 / 3.0, (double)NAN, f}}};
        if (f % 10 == 5)
            assert_true(recording_add_lines(recording, RECORDING_LEDGERS, ledger, 2));
        const RecordingLedger errors[2] = {{.time = frame.time,
                                            .step = f,
                                            .line = ERRORS_BODY,
                                            .body = "tetra",
                                            .value = {1e-4, -1.0, 1e-4, (double)INFINITY, 7.0}},
                                           {.line = ERRORS_TOOL, .flag = 4, .value = {2.0, f}}};
        if (f % 20 == 5)
            assert_true(recording_add_lines(recording, RECORDING_ERRORS, errors, 2));
    }
    expect_ok(recording_close(recording, &status), status);
    return path;
}

static const char *make(const char *name)
{
    char scene[1000];
    memset(scene, 's', sizeof scene); // longer than a text of fixed length
    scene[sizeof scene - 1] = '\0';
    return make_with(name, DESCRIBED, scene);
}

static RecordingReader *open_reader(const char *path)
{
    Status status = {0};
    RecordingReader *reader = recording_reader_open(path, &status);
    if (reader == NULL)
        fail_msg("%s", status.text);
    return reader;
}

static void close_reader(RecordingReader **reader)
{
    recording_reader_close(*reader);
}

static int setup(void **state)
{
    (void)state;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return scratch_create(&scratch_space);
}

AROUND_ALL(setup, scratch_end)

TEST(a_frame_is_found_by_its_time_and_has_the_recorded_bits)
{
    SCOPED(close_reader) RecordingReader *reader = open_reader(make("bits.h5"));
    assert_int_equal(recording_reader_frames(reader, 0), FRAMES);
    assert_int_equal(recording_reader_find_body(reader, "tetra"), 0);
    assert_int_equal(recording_reader_find_body(reader, "other"), -1);
    assert_int_equal(recording_reader_find_frame(reader, 0, -0.01), -1);
    assert_int_equal(recording_reader_find_frame(reader, 0, 1e9), FRAMES - 1);
    // From the last to the first, at and between the times of frames.
    for (int f = FRAMES - 1; f >= 0; f--) {
        float position[3 * NODES];
        Status status = {0};
        assert_int_equal(recording_reader_find_frame(reader, 0, time_at(f)), f);
        assert_int_equal(recording_reader_find_frame(reader, 0, time_at(f) + 0.05), f);
        RecordingFrame frame = recording_reader_frame(reader, 0, f);
        assert_int_equal(frame.step, 100 * f);
        assert_int_equal(frame.node_count, nodes_at(f));
        assert_int_equal(frame.topology, f < CUT_AT ? 1 : 2);
        assert_true(recording_reader_positions(reader, 0, f, position, &status));
        for (int i = 0; i < 3 * frame.node_count; i++) {
            const float expected = coordinate(f, i);
            assert_memory_equal(&position[i], &expected, sizeof expected);
        }
    }
}

TEST(a_frame_has_the_mesh_of_its_topology)
{
    SCOPED(close_reader) RecordingReader *reader = open_reader(make("mesh.h5"));
    int nodes, triangles, id[NODES], triangle[2][3];
    recording_reader_most(reader, 0, &nodes, &triangles);
    assert_int_equal(nodes, NODES);
    assert_int_equal(triangles, 2);
    assert_int_equal(recording_reader_first_wall(reader, 0), 1);
    for (int f = CUT_AT - 1; f <= CUT_AT; f++) {
        RecordingTopology topology;
        Status status = {0};
        assert_true(recording_reader_mesh(reader, 0, f, id, triangle, &topology, &status));
        assert_int_equal(topology.number, f < CUT_AT ? 1 : 2);
        assert_int_equal(topology.node_count, nodes_at(f));
        assert_int_equal(topology.triangle_count, nodes_at(f) - 3);
        assert_int_equal(topology.triangle[0][2], 2);
        assert_int_equal(topology.node_id[nodes_at(f) - 1], f < CUT_AT ? 9 : 3);
        int from[NODES], between[NODES][2];
        signed char at[NODES];
        bool known;
        const MeshColumns column = {.origin = from, .parent = between, .level = at};
        assert_true(recording_reader_nodes(reader, 0, f, &column, &known, &status));
        assert_true(known);
        assert_memory_equal(from, origin, (size_t)nodes_at(f) * sizeof *from);
        assert_memory_equal(between, parent, (size_t)nodes_at(f) * sizeof *between);
        assert_memory_equal(at, level, (size_t)nodes_at(f));
    }
}

TEST(tools_events_and_the_scene_are_read)
{
    Status status = {0};
    SCOPED(close_reader) RecordingReader *reader = open_reader(make("rest.h5"));
    assert_int_equal(strlen(recording_reader_scene(reader)), 999);
    assert_string_equal(recording_reader_describe(reader), DESCRIBED);
    assert_int_equal(recording_reader_find_tool(reader, 3), 0);
    assert_int_equal(recording_reader_find_tool(reader, 4), -1);
    assert_int_equal(recording_reader_tool_rows(reader, 0), FRAMES);
    assert_int_equal(recording_reader_find_tool_row(reader, 0, time_at(7) + 0.01), 7);
    RecordingTool sample[FRAMES];
    assert_true(recording_reader_tool(reader, 0, 0, FRAMES, sample, &status));
    assert_true(isnan(sample[0].orientation.w));
    for (int f = 1; f < FRAMES; f++) {
        expect_near(sample[f].position.x, f, 0.0);
        expect_near(sample[f].force.y, -f, 0.0);
        expect_near(sample[f].orientation.z, 0.25, 0.0);
    }
    assert_int_equal(recording_reader_info(reader)->events, 4);
    RecordingEvent event[4];
    assert_true(recording_reader_events(reader, 0, 4, event, &status));
    assert_int_equal(event[2].step, 25);
    assert_string_equal(event[2].text, "a cut");
    assert_int_equal(recording_reader_info(reader)->lines[RECORDING_LEDGERS], 8);
    RecordingLedger ledger[4];
    assert_true(recording_reader_lines(reader, RECORDING_LEDGERS, 4, 4, ledger, &status));
    assert_int_equal(ledger[0].line, LEDGER_BODY);
    assert_int_equal(ledger[1].step, 25);
    assert_string_equal(ledger[1].name, "fat");
    expect_near(ledger[1].value[0], 1.0 / 3.0, 0.0);
    expect_near(ledger[1].value[1], 0.0, 0.0); // a number that is none
    expect_near(ledger[3].value[2], 35.0, 0.0);
    assert_int_equal(recording_reader_info(reader)->lines[RECORDING_ERRORS], 4);
    assert_true(recording_reader_lines(reader, RECORDING_ERRORS, 2, 2, ledger, &status));
    assert_true(ledger[0].line == ERRORS_BODY && ledger[0].step == 25);
    expect_near(ledger[0].value[ERRORS_STEPS], -1.0, 0.0);
    expect_near(ledger[0].value[ERRORS_RELATIVE], 0.0, 0.0); // a number that is none
    expect_near(ledger[0].value[ERRORS_AGE], 7.0, 0.0);
    assert_true(ledger[1].line == ERRORS_TOOL && ledger[1].flag == 4);
    expect_near(ledger[1].value[ERRORS_ERROR], 25.0, 0.0);
}

TEST(colours_come_back_row_by_row_and_only_those_that_changed)
{
    static const int id[4] = {5, -1, 9, 2}, later[4] = {5, 7, 9, 2};
    unsigned char outside[4][3] = {{1, 2, 3}, {0}, {4, 5, 6}, {7, 8, 9}};
    unsigned char inside[4][3] = {{11, 12, 13}, {0}, {14, 15, 16}, {17, 18, 255}};
    static const unsigned char own[RECORDING_COLOURS] = {20, 21, 22, 23, 24, 25};
    int known_id[4], row_id[5];
    unsigned char known[4][RECORDING_COLOURS], row[5][RECORDING_COLOURS];
    RecordingColours colours = {.known_id = known_id, .known = known, .id = row_id, .colour = row};
    const RecordingBody body = {
        .name = "tetra", .nodes = NODES, .triangles = 2, .first_wall = 1, .coloured = true};
    const RecordingOptions options = {
        .scene = "", .created_by = "test 1", .body_count = 1, .body = &body};
    Status status = {0};
    const char *path = scratch_at("colours.h5");
    Recording *recording = recording_create(path, &options, &status);
    assert_non_null(recording);
#define TAKE(topology, ids)                                                                        \
    recording_colours_take(&colours, topology, own, 4, ids, (const unsigned char(*)[3])outside,    \
                           (const unsigned char(*)[3])inside)
    RecordingLook look = TAKE(3, id);
    assert_int_equal(look.count, 4); // of the body and of three nodes
    assert_true(recording_add_look(recording, 0, &look));
    look = TAKE(3, id);
    assert_int_equal(look.count, 0); // a repeat
    assert_true(recording_add_look(recording, 0, &look));
    inside[3][2] = 254; // one has changed, another is new
    look = TAKE(4, later);
    assert_int_equal(look.count, 2);
    assert_true(recording_add_look(recording, 0, &look));
    expect_ok(recording_close(recording, &status), status);

    SCOPED(close_reader) RecordingReader *reader = open_reader(path);
    int topology[6], node[6];
    unsigned char colour[6][RECORDING_COLOURS];
    assert_int_equal(recording_reader_look_rows(reader, 0), 6);
    assert_true(recording_reader_look(reader, 0, 0, 6, topology, node, colour, &status));
    assert_memory_equal(topology, ((const int[6]){3, 3, 3, 3, 4, 4}), sizeof topology);
    assert_memory_equal(node, ((const int[6]){RECORDING_OF_BODY, 5, 9, 2, 7, 2}), sizeof node);
    assert_memory_equal(colour[0], own, sizeof own);
    assert_memory_equal(colour[5], ((const unsigned char[6]){7, 8, 9, 17, 18, 254}), 6);
    // A file without has none.
    SCOPED(close_reader) RecordingReader *other = open_reader(make("plain.h5"));
    assert_int_equal(recording_reader_look_rows(other, 0), 0);
}

// pliant-record knows no scene and writes the description in its place; older files have none.
TEST(maps_are_found_by_their_time_and_those_of_no_mesh_are_left_out)
{
    SCOPED(close_reader) RecordingReader *reader = open_reader(make("maps.h5"));
    Status status = {0};
    for (int kind = 0; kind < RECORDING_MAPS; kind++) {
        assert_int_equal(recording_reader_maps(reader, 0, kind), 4);
        assert_int_equal(recording_reader_info(reader)->body[0].maps[kind], 4);
        assert_int_equal(recording_reader_find_map(reader, 0, kind, -0.1), -1);
        for (int f = 0; f < FRAMES; f++) {
            assert_int_equal(recording_reader_find_map(reader, 0, kind, time_at(f)), f / 10);
            const RecordingMap map = recording_reader_map(reader, 0, kind, f / 10);
            assert_int_equal(map.step, f / 10 * 1000);
        }
    }
    for (int m = 0; m < 4; m++) {
        unsigned char share[NODES], deep[2];
        int16_t tag[2];
        const int f = 10 * m;
        expect_ok(recording_reader_map_rows(reader, 0, RECORDING_ERROR_MAP, m,
                                            (void *const[]){share}, &status),
                  status);
        for (int i = 0; i < nodes_at(f); i++)
            assert_int_equal(share[i], share_at(f, i));
        expect_ok(recording_reader_map_rows(reader, 0, RECORDING_ELEMENTS, m,
                                            (void *const[]){tag, deep}, &status),
                  status);
        assert_true(tag[0] == -f && deep[0] == f);
        assert_int_equal(recording_reader_map(reader, 0, RECORDING_ELEMENTS, m).elements[1], f);
    }
}

TEST(a_description_in_place_of_the_scene_is_one)
{
    RecordingReader *reader = open_reader(make_with("heard.h5", NULL, DESCRIBED));
    assert_string_equal(recording_reader_describe(reader), DESCRIBED);
    assert_string_equal(recording_reader_scene(reader), "");
    recording_reader_close(reader);
    reader = open_reader(make_with("old.h5", NULL, "name = \"a\";"));
    assert_string_equal(recording_reader_describe(reader), "");
    assert_string_equal(recording_reader_scene(reader), "name = \"a\";");
    // Nor do they say what nodes were split from.
    int from[NODES], between[NODES][2];
    signed char at[NODES];
    bool known = true;
    Status status = {0};
    const MeshColumns column = {.origin = from, .parent = between, .level = at};
    assert_true(recording_reader_nodes(reader, 0, 0, &column, &known, &status));
    assert_false(known);
    recording_reader_close(reader);
}

TEST(a_position_that_is_no_number_and_a_corner_that_is_no_node_are_refused)
{
    Status status = {0};
    float position[3 * NODES];
    const float infinite[3] = {0.0f, INFINITY, 0.0f};
    const int corner[3] = {0, NODES, 1};
    const char *path = make("lies.h5");
    view_put_row(path, "/bodies/tetra/position", H5T_NATIVE_FLOAT, 1, 3, infinite);
    view_put_row(path, "/bodies/tetra/triangles", H5T_NATIVE_INT, 1, 3, corner);
    SCOPED(close_reader) RecordingReader *reader = open_reader(path);
    assert_false(recording_reader_positions(reader, 0, 0, position, &status));
    expect_in(status.text, "not finite");
    int id[NODES], triangle[2][3];
    RecordingTopology topology;
    status = (Status){0};
    assert_false(recording_reader_mesh(reader, 0, 0, id, triangle, &topology, &status));
    expect_in(status.text, "triangle 1 has node 5 of 5");
    // The rest of the file is still there.
    assert_true(recording_reader_positions(reader, 0, 3, position, &status));
}

TEST(a_frame_that_goes_back_in_time_is_not_found)
{
    const double late = 2.05;
    const char *path = make("back.h5");
    view_put_row(path, "/bodies/tetra/frames/time", H5T_NATIVE_DOUBLE, 1, 0, &late);
    SCOPED(close_reader) RecordingReader *reader = open_reader(path);
    // Frames 2 to 20 are not after the second one any more.
    assert_int_equal(recording_reader_frames(reader, 0), FRAMES - 19);
    assert_int_equal(recording_reader_find_frame(reader, 0, time_at(21)), 2);
}

TEST(several_readers_are_closed_in_any_order)
{
    const char *path = make("two.h5");
    RecordingReader *first = open_reader(path), *second = open_reader(path);
    recording_reader_close(first);
    recording_reader_close(second);
}

TEST(what_is_no_recording_is_refused)
{
    Status status = {0};
    scratch_write_text("text.h5", "no HDF5");
    assert_null(recording_reader_open(scratch_at("text.h5"), &status));
    expect_in(status.text, "not an HDF5 file");
}

#endif
