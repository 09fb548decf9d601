// SPDX-License-Identifier: MIT
// pliant-record beside the real daemon in a private network: a body of 40962 nodes at 60 frames a
// second, of which none may be missing.
#include "bench.h"
#include "daemon.h"

#include "io/recording.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define NAME "record.sphere"

enum { NODES = 40962, NODES_QUICK = 2562 };

// Two substeps per tick, so that one core holds the rate and has time for the recorder.
static void describe(int nodes, char *text, size_t size)
{
    snprintf(text, size,
             "name = \"bench\";  rate_hz = 60.0;\n"
             "publish = { nodes_hz = 60.0; };\n"
             "bodies = ( { name = \"ball\";\n"
             "    mesh = { generator = \"ico_sphere\";  nodes = %d;  radius = 0.2; };\n"
             "    material = { youngs_modulus_2d = 0.1;  areal_density = 4.2;\n"
             "                 damping_time = 0.0; };\n"
             "    shape = { angular_frequency = 10.0;  damping_ratio = 0.3; }; } );\n"
             "loads = ( { body = \"ball\"; center = [0.0, 0.0, 0.2]; radius = 0.05;\n"
             "            force = [0.0, 0.0, -0.2]; start = 1.0; duration = 60.0; } );\n",
             nodes);
}

// Processor time of the recorder [s], from what the shell's `times` says of its children.
static double read_times(const char *path)
{
    double minutes[2], seconds[2], all = 0.0;
    FILE *file = fopen(path, "r");
    char line[128];
    for (int k = 0; file != NULL && k < 2 && fgets(line, sizeof line, file) != NULL; k++)
        if (k == 1 && sscanf(line, "%lfm%lfs %lfm%lfs", &minutes[0], &seconds[0], &minutes[1],
                             &seconds[1]) == 4)
            all = 60.0 * (minutes[0] + minutes[1]) + seconds[0] + seconds[1];
    if (file != NULL)
        fclose(file);
    return all;
}

static void tell(Bench *bench, int nodes, const RecordingBodyInfo *body, double cpu)
{
    const RecordingCounts *counts = &body->counts;
    // A tick is a frame: what the daemon skipped counts as well.
    int64_t due = body->frames > 0 ? body->last_step - body->first_step + 1 : 0;
    bench_row(bench, NAME, nodes, "frames_due", (double)due, "1");
    bench_row(bench, NAME, nodes, "frames", (double)body->frames, "1");
    bench_row(bench, NAME, nodes, "frames_lost", (double)counts->lost, "1");
    bench_row(bench, NAME, nodes, "frames_dropped", (double)counts->dropped, "1");
    bench_row(bench, NAME, nodes, "frames_without_mesh", (double)counts->without_mesh, "1");
    if (body->frames > 0)
        bench_row(bench, NAME, nodes, "us_recorder_per_frame", 1e6 * cpu / (double)body->frames,
                  "us");
}

static void run_sphere(Bench *bench, const char *folder)
{
    static RecordingInfo info;
    int nodes = bench->quick ? NODES_QUICK : NODES, seconds = bench->quick ? 1 : 20;
    char scene[1024], beside[512], file[128], times[128];
    const char *why;
    DaemonRun alone, both;
    Status status = {0};
    describe(nodes, scene, sizeof scene);
    snprintf(file, sizeof file, "%s/run.h5", folder);
    snprintf(times, sizeof times, "%s/times", folder);
    // It may take a while to start: the daemon runs longer than what is recorded of it.
    snprintf(beside, sizeof beside, "\"$BIN/pliant-record\" -o %s --duration %d; times >%s", file,
             seconds, times);
    DaemonEnd end = daemon_run(scene, bench->quick ? 1 : 5, &alone, &why);
    if (end == DAEMON_DONE)
        end = daemon_run_beside(scene, seconds + 4, beside, &both, &why);
    if (end == DAEMON_SKIPPED) {
        bench_skip(bench, NAME, why);
        return;
    }
    // Its last words come after the daemon's, if it began late.
    const struct timespec pause = {.tv_nsec = 100000000};
    for (int i = 0; i < 300 && access(times, F_OK) != 0; i++)
        nanosleep(&pause, NULL);
    if (end == DAEMON_FAILED || !recording_info_read(file, &info, &status) || !info.ended) {
        bench_fail(bench, NAME, end == DAEMON_FAILED ? why : status.text);
        return;
    }
    tell(bench, nodes, &info.body[0], read_times(times));
    bench_row(bench, NAME, nodes, "wall_us_step_p99_alone", alone.step[1], "us");
    bench_row(bench, NAME, nodes, "wall_us_step_p99", both.step[1], "us");
    bench_row(bench, NAME, nodes, "late_ticks", both.late_ticks, "1");
}

void bench_record(Bench *bench)
{
    char folder[] = "/tmp/pliant-bench-XXXXXX", path[128];
    static const char *const files[] = {"run.h5", "run.h5.xdmf", "times"};
    if (!bench_wants(bench, NAME))
        return;
    if (mkdtemp(folder) == NULL) {
        bench_fail(bench, NAME, "cannot make a folder");
        return;
    }
    run_sphere(bench, folder);
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, files[i]);
        unlink(path);
    }
    rmdir(folder);
}
