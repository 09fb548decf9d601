// SPDX-License-Identifier: MIT
// What cutting and removing cost: a blade drawn through a solid and a drill over a wall from tick
// to tick, cut messages through a surface, and the real daemon under a hundred cuts a second while
// a tool presses.
#include "bench.h"
#include "daemon.h"

#include "base/check.h"
#include "base/clock.h"
#include "scene/build.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double RATE = 1000.0; // [Hz]

static bool load(const char *text, Scene *scene, World *world, Status *status)
{
    char path[64];
    const BuildOptions options = {.isa = "auto", .may_load = true};
    if (!daemon_write_scene(text, path, sizeof path))
        return status_fail(status, STATUS_FAILED, "cannot write a scene");
    bool whole = scene_read(path, scene, status) && world_build(world, scene, &options, status);
    unlink(path);
    return whole;
}

static void row_quantiles(Bench *bench, const char *name, int size, double *us, int count)
{
    double sum = 0.0;
    for (int i = 0; i < count; i++)
        sum += us[i];
    bench_sort(us, count);
    bench_row(bench, name, size, "us_tick_mean", sum / count, "us");
    bench_row(bench, name, size, "us_tick_p99", us[count * 99 / 100], "us");
    bench_row(bench, name, size, "us_tick_max", us[count - 1], "us");
}

// --- a tool that is drawn through a body ---

// Draws the first tool with 50 mm/s. Each tick at its least over some repeats, which do the same
// work: the whole of it, and what is left to be done after the tool has stopped.
static void draw_tool(Bench *bench, const char *name, World *world, int size, Vec3 from, Vec3 way)
{
    Sim *sim = world->sim;
    const double speed = 0.05;
    const int moving = (int)(vec3_length(way) / speed * RATE), ticks = moving + 200;
    const int repeats = bench->quick ? 1 : 3;
    double *us = malloc((size_t)ticks * sizeof *us);
    ASSERT(us != NULL);
    int pieces = 1;
    int64_t elements = 0;
    for (int r = 0; r < repeats; r++) {
        sim_reset(sim);
        for (int i = 0; i < ticks; i++) {
            ToolPose pose = {.position = vec3_madd(from, fmin(i, moving) / moving, way),
                             .orientation = {1.0, 0.0, 0.0, 0.0},
                             .active = true,
                             .grip = 1.0};
            sim_apply_pose(sim, 0, &pose, false);
            int64_t begin = clock_thread_ns();
            sim_step(sim);
            double spent = 1e-3 * (double)(clock_thread_ns() - begin);
            us[i] = r == 0 || spent < us[i] ? spent : us[i];
        }
        pieces = sim_pieces(sim, 0);
        elements = sim_body(sim, 0)->element_count;
    }
    row_quantiles(bench, name, size, us, ticks);
    bench_row(bench, name, size, "pieces", pieces, "1");
    bench_row(bench, name, size, "elements_after", (double)elements, "1");
    free(us);
}

static void run_blade(Bench *bench, const char *name)
{
    int cells = bench->quick ? 12 : 32;
    double size = 0.1 / cells;
    char text[1024];
    Scene scene = {0};
    World world = {0};
    Status status = {0};
    snprintf(text, sizeof text,
             "name = \"bench\";\nrate_hz = %g;\n"
             "bodies = ( { name = \"cube\";  model = \"voxel\";  levels = 2;  cuttable = true;\n"
             "    voxels = { generator = \"box\";  count = %d;  size = %.9g; };\n"
             "    material = { youngs_modulus = 1.0e4;  density = 1000.0; };\n"
             "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0499]); } ); } );\n"
             "tools = ( { id = 1;  kind = \"blade\";\n"
             "    edge = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.11]); } );\n",
             RATE, cells, size);
    if (!load(text, &scene, &world, &status))
        bench_fail(bench, name, status.text);
    else if (sim_body(world.sim, 0)->ops->cut == NULL)
        bench_skip(bench, name, "voxel bodies cannot be cut in this build");
    else
        draw_tool(bench, name, &world, cells, (Vec3){0.0007, -0.0517, -0.055},
                  (Vec3){0.0, 0.052, 0.0});
    world_destroy(&world);
    scene_destroy(&scene);
}

// A drill that goes over the top of a body.
static void run_drill(Bench *bench, const char *name, int size, const char *body)
{
    char text[1024];
    Scene scene = {0};
    World world = {0};
    Status status = {0};
    snprintf(text, sizeof text,
             "name = \"bench\";\nrate_hz = %g;\nbodies = ( %s );\n"
             "tools = ( { id = 1;  kind = \"remover\";  removes_by = \"drill\";\n"
             "    mouth = { radius = 0.005; }; } );\n",
             RATE, body);
    if (!load(text, &scene, &world, &status))
        bench_fail(bench, name, status.text);
    else if (sim_body(world.sim, 0)->ops->remove == NULL)
        bench_skip(bench, name, "nothing can be taken from this body in this build");
    else
        draw_tool(bench, name, &world, size, (Vec3){-0.02, 0.001, 0.048}, (Vec3){0.04, 0.0, 0.0});
    world_destroy(&world);
    scene_destroy(&scene);
}

// --- cut messages ---

// A cut of 75 mm across a body, each after a RESET: from the message to the cut body.
static void run_message(Bench *bench, const char *name, const char *body)
{
    char text[1024];
    Scene scene = {0};
    World world = {0};
    Status status = {0};
    snprintf(text, sizeof text, "name = \"bench\";\nrate_hz = %g;\nbodies = ( %s );\n", RATE, body);
    if (!load(text, &scene, &world, &status)) {
        bench_fail(bench, name, status.text);
    } else if (sim_body(world.sim, 0)->ops->cut == NULL) {
        bench_skip(bench, name, "this body cannot be cut in this build");
    } else {
        Sim *sim = world.sim;
        Samples samples = {0};
        CutOutcome sum = {0};
        char why[192];
        for (int i = 0; i < (bench->quick ? 2 : 20); i++) {
            double x = 0.0011 + 0.0007 * i;
            CutOptions cut = {.body = 0,
                              .before = {{{x, -0.0375, -0.06}, {x, -0.0375, 0.06}}},
                              .after = {{{x, 0.0375, -0.06}, {x, 0.0375, 0.06}}}};
            sim_reset(sim);
            sim_step(sim);
            int64_t begin = clock_thread_ns();
            bool made = sim_apply_cut(sim, &cut, &sum, why, sizeof why);
            samples_add(&samples, 1e-3 * (double)(clock_thread_ns() - begin));
            if (!made)
                bench_fail(bench, name, why);
        }
        int nodes = sim_body(sim, 0)->mesh.node_count;
        bench_row(bench, name, nodes, "us_cut", samples_min(&samples), "us");
        bench_row(bench, name, nodes, "us_cut_median", samples_median(&samples), "us");
        bench_row(bench, name, nodes, "links", sum.separated, "1");
    }
    world_destroy(&world);
    scene_destroy(&scene);
}

// --- live ---

// Random sweeps through both bodies in turn.
static bool write_sweeps(char *path, size_t size, int count)
{
    char *text = malloc((size_t)count * 192 + 1);
    ASSERT(text != NULL);
    size_t used = 0;
    text[0] = '\0';
    srand(17);
    for (int i = 0; i < count; i++) {
        // The two ends go nearly the same way: few sweeps are too twisted.
        double end[12], way[3];
        for (int k = 0; k < 3; k++)
            way[k] = 0.08 * (2.0 * rand() / RAND_MAX - 1.0);
        for (int k = 0; k < 6; k++) {
            end[k] = 0.04 * (2.0 * rand() / RAND_MAX - 1.0) + (k % 3 == 0 && i % 2 ? 0.2 : 0.0);
            end[k + 6] = end[k] + way[k % 3] + 0.01 * (2.0 * rand() / RAND_MAX - 1.0);
        }
        used += (size_t)snprintf(text + used, 192,
                                 "lift\n%.5f %.5f %.5f %.5f %.5f %.5f\n"
                                 "%.5f %.5f %.5f %.5f %.5f %.5f\n",
                                 end[0], end[1], end[2], end[3], end[4], end[5], end[6], end[7],
                                 end[8], end[9], end[10], end[11]);
    }
    bool whole = daemon_write_scene(text, path, size);
    free(text);
    return whole;
}

static void run_live(Bench *bench, const char *name)
{
    enum { A_SECOND = 100, CELLS = 1728 };
    static const char scene[] =
        "name = \"bench\";\nrate_hz = 1000.0;\n"
        "bodies = ( { name = \"cube\";  model = \"voxel\";  levels = 1;  cuttable = true;\n"
        "    voxels = { generator = \"box\";  count = 12;  size = 0.005; };\n"
        "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.029]); } ); },\n"
        "  { name = \"ball\";  model = \"surface\";  levels = 1;  cuttable = true;  shape = {};\n"
        "    mesh = { generator = \"ico_sphere\";  nodes = 642;  radius = 0.03;\n"
        "             place = { translation = [0.2, 0.0, 0.0]; }; }; } );\n"
        "tools = ( { id = 1;  kind = \"probe\";\n"
        "    capsules = ( { from = [0.0, 0.0, 0.0];  radius = 0.008; } ); } );\n";
    int seconds = bench->quick ? 1 : 10;
    char path[64], beside[256];
    const char *why;
    DaemonRun run;
    if (!write_sweeps(path, sizeof path, seconds * A_SECOND)) {
        bench_fail(bench, name, "cannot write the sweeps");
        return;
    }
    snprintf(beside, sizeof beside,
             "\"$BIN/pliant-cut\" --quiet --rate %d --file %s & "
             "\"$BIN/pliant-probe\" --press 0,0,0.045 --depth 0.02 --repeat %d --hold 0.2 "
             "--speed 0.1 & wait",
             A_SECOND, path, seconds);
    switch (daemon_run_beside(scene, seconds + 2, beside, &run, &why)) {
    case DAEMON_SKIPPED:
        bench_skip(bench, name, why);
        break;
    case DAEMON_FAILED:
        bench_fail(bench, name, why);
        break;
    case DAEMON_DONE:
        bench_row(bench, name, CELLS, "cuts_a_second", A_SECOND, "1/s");
        bench_row(bench, name, CELLS, "ticks", run.ticks, "1");
        bench_row(bench, name, CELLS, "late_ticks", run.late_ticks, "1");
        bench_row(bench, name, CELLS, "wall_us_step_p50", run.step[0], "us");
        bench_row(bench, name, CELLS, "wall_us_step_p99", run.step[1], "us");
        bench_row(bench, name, CELLS, "wall_us_step_max", run.step[3], "us");
    }
    unlink(path);
}

void bench_cuts(Bench *bench)
{
    static const struct {
        const char *name, *body;
    } messages[] = {
        {"cut.surface.sphere",
         "{ name = \"ball\";  model = \"surface\";  levels = 2;  cuttable = true;  shape = {};\n"
         "  mesh = { generator = \"ico_sphere\";  nodes = 162;  radius = 0.05; }; }"},
        {"cut.surface.sheet",
         "{ name = \"sheet\";  model = \"surface\";  levels = 2;  cuttable = true;  shape = {};\n"
         "  mesh = { generator = \"sheet\";  columns = 17;  rows = 17;  width = 0.1;\n"
         "           height = 0.1; }; }"},
        {"cut.voxel.cube", "{ name = \"cube\";  model = \"voxel\";  levels = 2;  cuttable = true;\n"
                           "  voxels = { generator = \"box\";  count = 16;  size = 0.00625; }; }"},
    };
    if (bench_wants(bench, "cut.voxel.blade"))
        run_blade(bench, "cut.voxel.blade");
    for (size_t k = 0; k < sizeof messages / sizeof *messages; k++)
        if (bench_wants(bench, messages[k].name))
            run_message(bench, messages[k].name, messages[k].body);
    if (bench_wants(bench, "remove.surface.sphere"))
        run_drill(bench, "remove.surface.sphere", 162, messages[0].body);
    if (bench_wants(bench, "live.cuts"))
        run_live(bench, "live.cuts");
}
