// A recording as `pliant-record --info` reads it: one whose data were changed; with an odd first
// byte the input is the file itself, as it comes.
#include "fuzz.h"

#include "io/recording.h"
#include "hdf_edit.h"

#include <stdio.h>

enum { NODES = 4, FRAMES = 5 };

static void make_base(HdfBase *base)
{
    const RecordingBody body = {.name = "ball", .nodes = NODES, .triangles = 2};
    const int tool = 1, id[NODES] = {0, 1, 2, 3}, triangle[2][3] = {{0, 1, 2}, {0, 2, 3}};
    const RecordingOptions options = {.scene = "name = \"fuzz\";",
                                      .created_by = "fuzz",
                                      .body_count = 1,
                                      .tool_count = 1,
                                      .body = &body,
                                      .tool = &tool};
    const float position[3 * NODES] = {0.0f, 0.0f, 0.0f, 1.0f};
    Status status = {0};
    Recording *recording = recording_create(fuzz_path("base"), &options, &status);
    MUST(recording != NULL);
    RecordingTopology topology = {
        .node_count = NODES, .triangle_count = 2, .node_id = id, .triangle = triangle};
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
        MUST(recording_add_tool(recording, 0, frame.time, &sample));
        MUST(recording_add_event(recording, &event));
    }
    MUST(recording_close(recording, &status));
    hdf_base_read(base, fuzz_path("base"));
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
    if (ok)
        recording_info_print(&info, nowhere);
    return 0;
}
