// SPDX-License-Identifier: MIT
// What contact between two bodies costs: the same two without it but with its time step, with it a
// tool's length apart, and one at rest on the other; and of a hollow body with itself.
#include "bench.h"
#include "daemon.h"

#include "base/clock.h"
#include "scene/build.h"

#include <stdlib.h>
#include <unistd.h>

enum { NONE, APART, RESTS, CASES };
static const char *const WORD[CASES] = {"none", "apart", "rests"};
static const double TOOL_LENGTH = 0.1; // [m]

typedef struct Case {
    Scene scene;
    World world;
    Samples samples;
} Case;

// Scenes of two bodies, by the height of the upper one, further keys of both, and other groups.
#define BLOCKS(name, surface)                                                                      \
    "name = \"" name "\"; rate_hz = 1000.0; gravity = [0.0, 0.0, -9.81];\n"                        \
    "bodies = ( { name = \"lower\"; model = \"voxel\"; integrator = \"leapfrog\"; %s\n" surface    \
    "    voxels = { generator = \"box\"; count = %d; size = 0.003; };\n"                           \
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0239]); } ); },\n"                   \
    "  { name = \"upper\"; model = \"voxel\"; integrator = \"leapfrog\"; %s\n" surface             \
    "    voxels = { generator = \"box\"; count = %d; size = 0.003;\n"                              \
    "      place = { translation = [0.019, 0.0007, %.4f]; }; }; %s } );\n%s"
static const char SOLIDS[] = BLOCKS("solids", "");
static const char SMOOTH[] = BLOCKS("smooth", "    surface = \"fitted\";\n");
static const char BALLS[] =
    "name = \"balls\"; rate_hz = 1000.0;\n"
    "bodies = ( { name = \"lower\"; integrator = \"leapfrog\"; shape = {}; %s\n"
    "    mesh = { generator = \"sphere\"; nodes = %d; radius = 0.05; }; },\n"
    "  { name = \"upper\"; integrator = \"leapfrog\"; shape = {}; %s\n"
    "    mesh = { generator = \"sphere\"; nodes = %d; radius = 0.05;\n"
    "      place = { translation = [0.0, 0.0, %.4f]; }; }; %s } );\n"
    "loads = ( { body = \"upper\"; center = [0.0, 0.0, 0.1]; radius = 0.3;\n"
    "    force = [0.0, 0.0, -2.0]; duration = 1000.0; } );\n%s";

// A hollow ball that is pulled apart at its poles, or pressed in until they meet.
static const char FOLDS[] =
    "name = \"folds\"; rate_hz = 1000.0;\n"
    "bodies = ( { name = \"lower\"; integrator = \"leapfrog\"; %s\n"
    "    shape = { angular_frequency = 30.0; };\n"
    "    mesh = { generator = \"sphere\"; nodes = %d; radius = 0.05; }; } );\n"
    "loads = ( { center = [0.0, 0.0, 0.05]; radius = 0.02; force = [0.0, 0.0, %g];\n"
    "    duration = 1000.0; }, { center = [0.0, 0.0, -0.05]; radius = 0.02;\n"
    "    force = [0.0, 0.0, %g]; duration = 1000.0; } );\n%s";

static bool create(Case *it, const char *form, int size, int kind, double height, double time_step,
                   Status *status)
{
    const BuildOptions options = {.isa = "auto", .may_load = true};
    char text[2048], path[64], step[64] = "", held[96] = "";
    if (kind == NONE)
        snprintf(step, sizeof step, "time_step = %.17g;", time_step);
    // A solid that nothing carries would fall.
    if ((form == SOLIDS || form == SMOOTH) && kind != RESTS)
        snprintf(held, sizeof held, "fixed = ( { box = ([-1.0, -1.0, %.4f], [1.0, 1.0, 1.0]); } );",
                 height + 0.0239);
    const double force = height > 0.1 ? 1.0 : -1.0; // by the same rule as heights
    if (form == FOLDS)
        snprintf(text, sizeof text, form, step, size, force, -force,
                 kind == NONE ? "" : "touch = ( { bodies = [\"lower\"]; } );");
    else
        snprintf(text, sizeof text, form, step, size, step, size, height, held,
                 kind == NONE
                     ? ""
                     : "touch = ( { bodies = [\"lower\", \"upper\"]; friction = 0.3; } );");
    if (!daemon_write_scene(text, path, sizeof path))
        return status_fail(status, STATUS_FAILED, "cannot write a scene");
    const bool whole = scene_read(path, &it->scene, status) &&
                       world_build(&it->world, &it->scene, &options, status);
    unlink(path);
    return whole;
}

static void time_pair(Bench *bench, const char *name, const char *form, int size, double height)
{
    const int settle = bench->quick ? 20 : 2000, ticks = bench->quick ? 20 : BENCH_REPEATS_MAX;
    Case it[CASES] = {0};
    Status status = {0};
    // The one that rests tells the time step.
    bool whole = create(&it[RESTS], form, size, RESTS, height, 0.0, &status);
    const double h =
        whole ? sim_tick(it[RESTS].world.sim) / sim_body(it[RESTS].world.sim, 0)->substeps : 0.0;
    for (int kind = 0; kind < RESTS && whole; kind++)
        whole = create(&it[kind], form, size, kind, height + (kind == APART ? TOOL_LENGTH : 0.0), h,
                       &status);
    if (!whole)
        bench_fail(bench, name, status.text);
    for (int i = 0; i < settle + ticks && whole; i++)
        for (int kind = 0; kind < CASES; kind++) {
            const int64_t begin = clock_thread_ns();
            sim_step(it[kind].world.sim);
            if (i >= settle)
                samples_add(&it[kind].samples, 1e-3 * (double)(clock_thread_ns() - begin));
        }
    const int nodes = whole ? sim_body(it[NONE].world.sim, 0)->state_capacity : 0;
    for (int kind = 0; kind < CASES && whole; kind++) {
        char row[48];
        const double us = samples_median(&it[kind].samples);
        snprintf(row, sizeof row, "%s.%s", name, WORD[kind]);
        bench_row(bench, row, nodes, "us_tick", us, "us");
        bench_row(bench, row, nodes, "ratio", us / samples_median(&it[NONE].samples), "1");
    }
    for (int kind = 0; kind < CASES; kind++) {
        world_destroy(&it[kind].world);
        scene_destroy(&it[kind].scene);
    }
}

void bench_touches(Bench *bench)
{
    if (bench_wants(bench, "touch.solids"))
        time_pair(bench, "touch.solids", SOLIDS, bench->quick ? 4 : 16,
                  bench->quick ? 0.0125 : 0.0485);
    if (bench_wants(bench, "touch.smooth"))
        time_pair(bench, "touch.smooth", SMOOTH, bench->quick ? 4 : 16,
                  bench->quick ? 0.0125 : 0.0485);
    if (bench_wants(bench, "touch.balls"))
        time_pair(bench, "touch.balls", BALLS, bench->quick ? 162 : 5000, 0.1);
    if (bench_wants(bench, "touch.folds"))
        time_pair(bench, "touch.folds", FOLDS, bench->quick ? 162 : 5000, 0.1);
}
