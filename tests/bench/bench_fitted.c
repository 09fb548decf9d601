// SPDX-License-Identifier: MIT
// What the smooth surface of a solid costs: the step thread, which copies the vertices that
// clients' nodes follow from, keeps up with cuts and lets tools feel it; the thread that computes
// the nodes.
#include "bench.h"
#include "daemon.h"

#include "base/check.h"
#include "base/clock.h"
#include "run/exchange.h"
#include "scene/build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { KINDS = 2, REPEATS = 40 };
static const char *const WORD[KINDS] = {"blocks", "fitted"};

typedef struct Case {
    Scene scene;
    World world;
    Exchange exchange;
    double *scratch;
    float *node;
} Case;

static bool create(Case *it, int kind, int cells, Status *status)
{
    const double size = 0.1 / cells;
    const BuildOptions options = {.isa = "auto", .may_load = true, .publishes = true};
    char text[1024], path[64];
    *it = (Case){0};
    snprintf(text, sizeof text,
             "name = \"bench\";\nrate_hz = 1000.0;\n"
             "bodies = ( { name = \"cube\";  model = \"voxel\";  levels = 2;  cuttable = true;\n"
             "    surface = \"%s\";\n"
             "    voxels = { generator = \"box\";  count = %d;  size = %.9g; };\n"
             "    material = { youngs_modulus = 1.0e4;  density = 1000.0; };\n"
             "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0499]); } ); } );\n"
             "tools = ( { id = 1;  kind = \"blade\";\n"
             "    edge = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.11]); },\n"
             "    { id = 2;  kind = \"probe\";  capsules = ( { radius = 0.006; } ); } );\n",
             WORD[kind], cells, size);
    if (!daemon_write_scene(text, path, sizeof path))
        return status_fail(status, STATUS_FAILED, "cannot write a scene");
    const bool whole = scene_read(path, &it->scene, status) &&
                       world_build(&it->world, &it->scene, &options, status);
    unlink(path);
    if (!whole)
        return false;
    exchange_create(&it->exchange, &it->world, &(ExchangeOptions){.nodes_hz = 60.0});
    const BodyMesh *mesh = &sim_body(it->world.sim, 0)->mesh;
    const int rows = mesh->node_capacity;
    it->scratch = calloc((size_t)FIT_SCRATCH * (size_t)rows, sizeof *it->scratch);
    it->node = calloc(3 * (size_t)rows, sizeof *it->node);
    ASSERT(it->scratch != NULL && it->node != NULL);
    return true;
}

static void destroy(Case *it)
{
    free(it->scratch);
    free(it->node);
    world_destroy(&it->world);
    scene_destroy(&it->scene);
}

static double push(Case *it)
{
    const int64_t begin = clock_thread_ns();
    exchange_push_frame(&it->exchange, it->world.sim, 0, false);
    return 1e-3 * (double)(clock_thread_ns() - begin);
}

// A frame of an unchanged mesh, after a tick; and what another thread computes of it.
static void time_frames(Bench *bench, Case it[KINDS])
{
    Samples frame[KINDS] = {0}, nodes = {0};
    for (int r = 0; r < (bench->quick ? 2 : REPEATS); r++)
        for (int kind = 0; kind < KINDS; kind++) {
            sim_step(it[kind].world.sim);
            const double us = push(&it[kind]);
            if (r >= 3 || bench->quick) // each of the slot's frames has the mesh by then
                samples_add(&frame[kind], us);
            const Frame *taken = slot_take(&it[kind].exchange.frame[0]);
            if (kind == 0 || taken == NULL)
                continue;
            const int64_t begin = clock_thread_ns();
            const BodyMesh view = mesh_copy_view(exchange_frame_mesh(&it[kind].exchange, 0, taken));
            fit_nodes(&view.fit, taken->node_count, taken->value, it[kind].scratch, it[kind].node);
            samples_add(&nodes, 1e-3 * (double)(clock_thread_ns() - begin));
        }
    const BodyMesh *mesh = &sim_body(it[1].world.sim, 0)->mesh;
    for (int kind = 0; kind < KINDS; kind++) {
        char name[32];
        snprintf(name, sizeof name, "fitted.frame.%s", WORD[kind]);
        bench_row(bench, name, mesh->node_count, "us_frame", samples_min(&frame[kind]), "us");
        bench_row(bench, name, mesh->node_count, "us_frame_median", samples_median(&frame[kind]),
                  "us");
    }
    bench_row(bench, "fitted.nodes", mesh->node_count, "us_nodes", samples_min(&nodes), "us");
    bench_row(bench, "fitted.nodes", mesh->node_count, "rows", mesh->fit.row_count, "1");
}

// A blade through half of the cube; each tick, and each frame that a tick may add, at its least.
static void time_stroke(Bench *bench, Case it[KINDS], int cells)
{
    enum { EVERY = 16 };
    const double half = 0.05;
    const int moving = 1040, ticks = moving + 200;
    double *us[KINDS], most[KINDS] = {0.0};
    for (int kind = 0; kind < KINDS; kind++) {
        us[kind] = malloc((size_t)ticks * sizeof *us[kind]);
        ASSERT(us[kind] != NULL);
    }
    for (int r = 0; r < (bench->quick ? 1 : 3); r++)
        for (int kind = 0; kind < KINDS; kind++) {
            Sim *sim = it[kind].world.sim;
            sim_reset(sim);
            for (int i = 0; i < ticks; i++) {
                const double y = -half - 0.0017 + fmin(i, moving) * 5e-5;
                ToolPose pose = {.position = {0.0007, y, -half - 0.005},
                                 .orientation = {1.0, 0.0, 0.0, 0.0},
                                 .active = true};
                sim_apply_pose(sim, 0, &pose, false);
                const int64_t begin = clock_thread_ns();
                sim_step(sim);
                double spent = 1e-3 * (double)(clock_thread_ns() - begin);
                if (i % EVERY == 0)
                    spent += push(&it[kind]);
                us[kind][i] = r == 0 || spent < us[kind][i] ? spent : us[kind][i];
            }
        }
    for (int kind = 0; kind < KINDS; kind++) {
        char name[32];
        double sum = 0.0;
        snprintf(name, sizeof name, "fitted.blade.%s", WORD[kind]);
        for (int i = 0; i < ticks; i++)
            sum += us[kind][i];
        bench_row(bench, name, cells, "us_tick_mean", sum / ticks, "us");
        bench_sort(us[kind], ticks);
        most[kind] = us[kind][ticks - 1];
        bench_row(bench, name, cells, "us_tick_p99", us[kind][ticks * 99 / 100], "us");
        bench_row(bench, name, cells, "us_tick_max", most[kind], "us");
        free(us[kind]);
    }
}

// A probe that hovers 50 mm above the cube for 0.1 s, then is dragged over it by 20 mm in 0.5 s, 5
// mm deep.
static void time_touch(Bench *bench, Case it[KINDS], int cells)
{
    enum { AWAY = 100, DOWN = 100, TICKS = 700 };
    const double radius = 0.006, top = 0.05;
    for (int kind = 0; kind < KINDS; kind++) {
        double us[TICKS], sum[2] = {0.0};
        for (int r = 0; r < (bench->quick ? 1 : 5); r++) {
            Sim *sim = it[kind].world.sim;
            sim_reset(sim);
            for (int i = 0; i < TICKS; i++) {
                const double down = fmin(1.0, fmax(0.0, (i - AWAY) / (double)DOWN));
                const double along = fmax(0.0, i - AWAY - DOWN) * 4e-5;
                const double height = i < AWAY ? 0.05 : -0.005 * down;
                const ToolPose pose = {.position = {-0.01 + along, 0.0013, top + radius + height},
                                       .orientation = {1.0, 0.0, 0.0, 0.0},
                                       .active = true};
                sim_apply_pose(sim, 1, &pose, false);
                const int64_t begin = clock_thread_ns();
                sim_step(sim);
                const double spent = 1e-3 * (double)(clock_thread_ns() - begin);
                us[i] = r == 0 || spent < us[i] ? spent : us[i];
            }
            if (!sim_wrench(sim, 1)->contact)
                bench_fail(bench, "fitted.touch", "the probe touches nothing");
        }
        for (int i = 0; i < TICKS; i++)
            sum[i >= AWAY + DOWN] += i < AWAY || i >= AWAY + DOWN ? us[i] : 0.0;
        char name[32];
        snprintf(name, sizeof name, "fitted.touch.%s", WORD[kind]);
        const double away = sum[0] / AWAY, touched = sum[1] / (TICKS - AWAY - DOWN);
        bench_row(bench, name, cells, "us_tick_away", away, "us");
        bench_row(bench, name, cells, "us_tick_touched", touched, "us");
        bench_row(bench, name, cells, "ratio", touched / away, "1");
    }
}

// A cut of 75 mm by a message, each after a RESET.
static void time_message(Bench *bench, Case it[KINDS], int cells)
{
    Samples samples[KINDS] = {0};
    for (int i = 0; i < (bench->quick ? 1 : 20); i++)
        for (int kind = 0; kind < KINDS; kind++) {
            Sim *sim = it[kind].world.sim;
            CutOutcome sum = {0};
            char why[192];
            const double x = 0.0011 + 0.0007 * i;
            const CutOptions cut = {.before = {{{x, -0.0375, -0.06}, {x, -0.0375, 0.06}}},
                                    .after = {{{x, 0.0375, -0.06}, {x, 0.0375, 0.06}}}};
            sim_reset(sim);
            sim_step(sim);
            const int64_t begin = clock_thread_ns();
            if (!sim_apply_cut(sim, &cut, &sum, why, sizeof why))
                bench_fail(bench, "fitted.message", why);
            samples_add(&samples[kind], 1e-3 * (double)(clock_thread_ns() - begin));
        }
    for (int kind = 0; kind < KINDS; kind++) {
        char name[32];
        snprintf(name, sizeof name, "fitted.message.%s", WORD[kind]);
        bench_row(bench, name, cells, "us_cut", samples_min(&samples[kind]), "us");
        bench_row(bench, name, cells, "us_cut_median", samples_median(&samples[kind]), "us");
    }
}

void bench_fitted(Bench *bench)
{
    const int cells = bench->quick ? 12 : 32;
    Case it[KINDS];
    Status status = {0};
    bool whole = true;
    if (!bench_wants(bench, "fitted"))
        return;
    for (int kind = 0; kind < KINDS; kind++)
        whole = create(&it[kind], kind, cells, &status) && whole;
    if (whole) {
        time_frames(bench, it);
        time_stroke(bench, it, cells);
        time_message(bench, it, cells);
        time_touch(bench, it, cells);
    } else {
        bench_fail(bench, "fitted", status.text);
    }
    for (int kind = 0; kind < KINDS; kind++)
        destroy(&it[kind]);
}
