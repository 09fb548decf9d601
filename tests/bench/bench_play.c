// SPDX-License-Identifier: MIT
// Seeking in a recording of an hour with 500 cuts: the frame at a random time and the mesh that
// belongs to it, as pliant-play reads them. The recording is made up: a grid that gains a node with
// each cut.
#include "bench.h"

#include "base/clock.h"
#include "timeline.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

#define NAME "play.seek"

enum { SECONDS = 3600, CUTS = 500, CUTS_QUICK = 5, SEEKS = 500, SEEKS_QUICK = 10 };

typedef struct Made {
    int nodes, triangles; // at the start
    int hz, seconds, cuts;
    int *id;
    int (*triangle)[3];
    float *position;
} Made;

static void make_arrays(Made *made, int side)
{
    made->nodes = side * side;
    made->triangles = 0;
    made->id = calloc((size_t)(made->nodes + made->cuts), sizeof *made->id);
    made->triangle = calloc(2 * (size_t)made->nodes, sizeof *made->triangle);
    made->position = calloc(3 * (size_t)(made->nodes + made->cuts), sizeof *made->position);
    if (made->id == NULL || made->triangle == NULL || made->position == NULL)
        abort();
    for (int i = 0; i < made->nodes + made->cuts; i++)
        made->id[i] = i;
    for (int y = 0; y + 1 < side; y++)
        for (int x = 0; x + 1 < side; x++) {
            const int at = y * side + x;
            int *corner = made->triangle[made->triangles++];
            corner[0] = at, corner[1] = at + 1, corner[2] = at + side;
            corner = made->triangle[made->triangles++];
            corner[0] = at + 1, corner[1] = at + side + 1, corner[2] = at + side;
        }
}

static bool write_session(Recording *recording, Made *made)
{
    const int frames = made->seconds * made->hz, apart = frames / (made->cuts + 1);
    bool ok = true;
    for (int f = 0; f < frames && ok; f++) {
        // A cut every few seconds: the mesh is another one from then on.
        const int cuts = f / apart < made->cuts ? f / apart : made->cuts,
                  nodes = made->nodes + cuts;
        const RecordingTopology topology = {.number = 1 + cuts,
                                            .node_count = nodes,
                                            .triangle_count = made->triangles,
                                            .node_id = made->id,
                                            .triangle = (const int(*)[3])made->triangle};
        const RecordingEvent event = {
            .time = (double)f / made->hz, .step = f, .kind = "cut", .text = "a cut"};
        if (f % apart == 0 && f / apart <= made->cuts)
            ok = recording_add_topology(recording, 0, &topology) &&
                 (f == 0 || recording_add_event(recording, &event));
        made->position[0] = (float)f;
        const RecordingFrame frame = {.step = f,
                                      .time = (double)f / made->hz,
                                      .topology = topology.number,
                                      .node_count = nodes,
                                      .position = made->position};
        ok = ok && recording_add_frame(recording, 0, &frame);
    }
    return ok;
}

static bool make_session(Made *made, const char *path, Status *status)
{
    const RecordingBody body = {.name = "body", .nodes = 4096, .triangles = 4096};
    const RecordingOptions options = {
        .scene = "made up", .created_by = "pliant-bench", .body_count = 1, .body = &body};
    Recording *recording = recording_create(path, &options, status);
    if (recording == NULL)
        return false;
    bool written = write_session(recording, made);
    return recording_close(recording, status) && written;
}

static void run_seeks(Bench *bench, Timeline *timeline, const Made *made, int seeks)
{
    double *us = calloc((size_t)seeks, sizeof *us);
    if (us == NULL)
        abort();
    Status status = {0};
    unsigned random = 1;
    bool ok = true;
    for (int i = 0; i < seeks && ok; i++) {
        RecordingTopology topology;
        random = random * 1103515245u + 12345u;
        const double time = timeline_end(timeline) * (random >> 8 & 0xffff) / 65535.0;
        const int64_t begun = clock_now_ns();
        const TimelineFrame at = timeline_find(timeline, 0, time);
        ok = timeline_positions(timeline, &at, 0, made->position, &status) &&
             timeline_mesh(timeline, &at, 0, made->id, made->triangle, &topology, &status);
        us[i] = (double)(clock_now_ns() - begun) * 1e-3;
        ok = ok && made->position[0] == (float)timeline_frame(timeline, &at, 0).step;
    }
    if (!ok) {
        bench_fail(bench, NAME, status.code != STATUS_OK ? status.text : "another frame");
    } else {
        bench_sort(us, seeks);
        bench_row(bench, NAME, made->nodes, "wall_us_seek_p50", us[seeks / 2], "us");
        bench_row(bench, NAME, made->nodes, "wall_us_seek_max", us[seeks - 1], "us");
    }
    free(us);
}

static void run_session(Bench *bench, const char *path, int side, int hz)
{
    Made made = {
        .hz = hz, .seconds = bench->quick ? 20 : SECONDS, .cuts = bench->quick ? CUTS_QUICK : CUTS};
    Status status = {0};
    make_arrays(&made, side);
    if (make_session(&made, path, &status)) {
        const int64_t begun = clock_now_ns();
        char file[128], *list[1] = {file};
        snprintf(file, sizeof file, "%s", path);
        Timeline *timeline = timeline_open(list, 1, &status);
        if (timeline != NULL) {
            bench_row(bench, NAME, made.nodes, "frames", (double)made.seconds * hz, "1");
            bench_row(bench, NAME, made.nodes, "wall_us_open",
                      (double)(clock_now_ns() - begun) * 1e-3, "us");
            run_seeks(bench, timeline, &made, bench->quick ? SEEKS_QUICK : SEEKS);
        }
        timeline_close(timeline);
    }
    if (status.code != STATUS_OK)
        bench_fail(bench, NAME, status.text);
    free(made.id);
    free(made.triangle);
    free(made.position);
}

void bench_play(Bench *bench)
{
    char folder[] = "/tmp/pliant-bench-XXXXXX", path[64], sidecar[80];
    if (!bench_wants(bench, NAME))
        return;
    if (mkdtemp(folder) == NULL) {
        bench_fail(bench, NAME, "cannot make a folder");
        return;
    }
    snprintf(path, sizeof path, "%s/hour.h5", folder);
    snprintf(sidecar, sizeof sidecar, "%s.xdmf", path);
    // Many frames of a small body, and fewer of a large one: half a gigabyte and one.
    for (int large = 0; large < 2; large++) {
        run_session(bench, path, large ? 100 : 13, large ? 2 : 60);
        unlink(path);
        unlink(sidecar);
    }
    rmdir(folder);
}
