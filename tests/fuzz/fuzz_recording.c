// SPDX-License-Identifier: MIT
// A recording as `pliant-record --info` and `pliant-play` read and score it: one whose data were
// changed; with an odd first byte the input is the file itself, as it comes.
#include "fuzz.h"

#include "hdf_edit.h"
#include "score.h"

#include <stdio.h>
#include <stdlib.h>

enum { NODES = 4, FRAMES = 5 };

static void make_base(HdfBase *base)
{
    const RecordingBody body = {
        .name = "ball", .nodes = NODES, .triangles = 2, .has_map = {true, true}};
    const int tool = 1, id[NODES] = {0, 1, 2, 3}, triangle[2][3] = {{0, 1, 2}, {0, 2, 3}};
    const int parent[NODES][2] = {{0, 0}, {1, 1}, {0, 1}, {3, 3}};
    const signed char level[NODES] = {0};
    const RecordingOptions options = {.scene = "name = \"fuzz\"; score = { force_limit = 1.0; };",
                                      .created_by = "fuzz",
                                      .body_count = 1,
                                      .tool_count = 1,
                                      .body = &body,
                                      .tool = &tool};
    const float position[3 * NODES] = {0.0f, 0.0f, 0.0f, 1.0f};
    Status status = {0};
    Recording *recording = recording_create(fuzz_path("base"), &options, &status);
    MUST(recording != NULL);
    RecordingTopology topology = {.node_count = NODES,
                                  .triangle_count = 2,
                                  .node_id = id,
                                  .node_origin = id,
                                  .node_parent = parent,
                                  .node_level = level,
                                  .triangle = triangle};
    for (int i = 0; i < FRAMES; i++) {
        RecordingFrame frame = {.step = 10 * i,
                                .time = 0.01 * i,
                                .topology = topology.number,
                                .node_count = NODES,
                                .position = position};
        const RecordingEvent event = {.time = 0.01 * i, .body = "ball", .kind = "cut"};
        const RecordingTool sample = {.orientation = {1.0, 0.0, 0.0, 0.0}};
        if (i % 2 == 0) {
            topology.number = frame.topology = 1 + i / 2;
            MUST(recording_add_topology(recording, 0, &topology));
        }
        MUST(recording_add_frame(recording, 0, &frame));
        RecordingMap map = {
            .step = frame.step, .time = frame.time, .topology = topology.number, .count = NODES};
        MUST(recording_add_map(recording, 0, RECORDING_ERROR_MAP, &map,
                               (const void *const[]){position}));
        map.count = 2;
        MUST(recording_add_map(recording, 0, RECORDING_ELEMENTS, &map,
                               (const void *const[]){position, position}));
        MUST(recording_add_tool(recording, 0, frame.time, &sample));
        MUST(recording_add_event(recording, &event));
    }
    MUST(recording_close(recording, &status));
    hdf_base_read(base, fuzz_path("base"));
}

// Reads what a player reads: the mesh and positions of frames, rows of tools, events. Data may be
// refused, but never be more than was announced.
static void read_as_player(const char *path)
{
    enum { ROWS = 8 };
    Status status = {0};
    RecordingReader *reader = recording_reader_open(path, &status);
    MUST((reader != NULL) == (status.code == STATUS_OK));
    if (reader == NULL)
        return;
    const RecordingInfo *info = recording_reader_info(reader);
    for (int b = 0; b < info->body_count; b++) {
        int nodes, triangles;
        recording_reader_most(reader, b, &nodes, &triangles);
        float *position = malloc(((size_t)nodes + 1) * 3 * sizeof *position);
        int *id = malloc(((size_t)nodes + 1) * sizeof *id);
        int *origin = malloc(((size_t)nodes + 1) * sizeof *origin);
        int(*parent)[2] = malloc(((size_t)nodes + 1) * sizeof *parent);
        signed char *level = malloc((size_t)nodes + 1);
        int(*triangle)[3] = malloc(((size_t)triangles + 1) * sizeof *triangle);
        MUST(position != NULL && id != NULL && triangle != NULL && origin != NULL &&
             parent != NULL && level != NULL);
        for (int64_t f = 0; f < recording_reader_frames(reader, b) && f < ROWS; f++) {
            RecordingTopology topology;
            Status why = {0};
            const MeshColumns column = {.origin = origin, .parent = parent, .level = level};
            bool known;
            bool ok = recording_reader_nodes(reader, b, f, &column, &known, &why) &&
                      recording_reader_positions(reader, b, f, position, &why) &&
                      recording_reader_mesh(reader, b, f, id, triangle, &topology, &why);
            MUST(ok == (why.code == STATUS_OK));
            const double time = recording_reader_frame(reader, b, f).time;
            MUST(recording_reader_find_frame(reader, b, time) == f);
        }
        for (int kind = 0; kind < RECORDING_MAPS; kind++)
            for (int64_t m = 0; m < recording_reader_maps(reader, b, kind) && m < ROWS; m++) {
                const RecordingMap map = recording_reader_map(reader, b, kind, m);
                MUST(map.count >= 0 &&
                     map.count <= (kind == RECORDING_ELEMENTS ? triangles : nodes));
                unsigned char *rows = malloc((size_t)map.count * RECORDING_MAP_ROOM + 1);
                MUST(rows != NULL);
                void *const column[] = {rows, rows + sizeof(int16_t) * (size_t)map.count};
                Status why = {0};
                const bool ok = recording_reader_map_rows(reader, b, kind, m, column, &why);
                MUST(ok == (why.code == STATUS_OK));
                free(rows);
            }
        int numbers[2][64];
        unsigned char colour[64][RECORDING_COLOURS];
        const int64_t rows = recording_reader_look_rows(reader, b);
        Status look = {0};
        if (rows > 0)
            recording_reader_look(reader, b, rows > 64 ? rows - 64 : 0, rows > 64 ? 64 : (int)rows,
                                  numbers[0], numbers[1], colour, &look);
        free(position);
        free(id);
        free(origin);
        free(parent);
        free(level);
        free(triangle);
    }
    for (int t = 0; t < info->tool_count; t++) {
        RecordingTool sample[ROWS];
        int64_t rows = recording_reader_tool_rows(reader, t);
        if (rows > 0)
            recording_reader_tool(reader, t, 0, (int)(rows < ROWS ? rows : ROWS), sample, &status);
    }
    RecordingEvent event[ROWS];
    if (info->events > 0)
        recording_reader_events(reader, 0, (int)(info->events < ROWS ? info->events : ROWS), event,
                                &status);
    recording_reader_close(reader);
}

// Scores it: births, meshes and rows may be anything that the reader lets pass.
static void read_as_scorer(const char *path, FILE *nowhere)
{
    char *const part[] = {(char *)(uintptr_t)path};
    Status status = {0};
    Score score;
    Timeline *timeline = timeline_open(part, 1, &status);
    if (timeline == NULL)
        return;
    bool ok = score_read(timeline, NULL, &score, &status);
    MUST(ok == (status.code == STATUS_OK));
    if (ok) {
        score_write_json(&score, nowhere);
        score_write_csv(&score, nowhere);
        score_write_page(&score, nowhere);
        score_destroy(&score);
    }
    timeline_close(timeline);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static HdfBase base;
    static RecordingInfo info;
    static FILE *nowhere;
    if (base.bytes == NULL) {
        make_base(&base);
        nowhere = fopen("/dev/null", "w");
    }
    if (size == 0)
        return 0;
    Feed feed = {data + 1, size - 1};
    const char *path = data[0] & 1 ? fuzz_write("edited", data + 1, size - 1)
                                   : hdf_base_edit(&base, "edited", &feed, false);
    Status status = {0};
    bool ok = recording_info_read(path, &info, &status);
    fuzz_print(ok ? "taken" : status.text);
    MUST(ok == (status.code == STATUS_OK));
    MUST(strchr(status.text, '\n') == NULL);
    // Unchanged, all of it is there.
    MUST(size > 1 || data[0] != 0 ||
         (ok && info.body[0].frames == FRAMES && info.events == FRAMES));
    if (ok) {
        recording_info_print(&info, nowhere);
        read_as_player(path);
        read_as_scorer(path, nowhere);
    }
    return 0;
}
