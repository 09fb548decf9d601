// SPDX-License-Identifier: MIT
// The live error estimate: what one try of a step costs, beside the substeps of a tick.
#include "bench.h"

#include "base/clock.h"
#include "scene/build.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// A body of each model under its own weight.
static const char *const SURFACE =
    "estimate_error = true; gravity = [0.0, 0.0, -9.81]; bodies = ( { name = \"body\";"
    " mesh = { generator = \"ico_sphere\"; nodes = 2562; radius = 0.05; };"
    " shape = { }; fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.025]); } ); } );";
#ifdef PLIANT_WITH_VOXEL
static const char *const VOXEL =
    "estimate_error = true; gravity = [0.0, 0.0, -9.81]; bodies = ( { name = \"body\";"
    " model = \"voxel\"; voxels = { generator = \"box\"; count = [16, 16, 16]; size = 0.004; };"
    " material = { youngs_modulus = 1.0e4; density = 1000.0; damping = 0.2; };"
    " fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.031]); } ); } );";
#endif

static bool build(const char *text, const char *isa, Scene *scene, World *world, Status *status)
{
    char path[] = "/tmp/pliant-bench-XXXXXX";
    const BuildOptions options = {.isa = isa, .publishes = true};
    int fd = mkstemp(path);
    FILE *file = fd < 0 ? NULL : fdopen(fd, "w");
    if (file == NULL)
        return status_fail(status, STATUS_FAILED, "cannot write %s", path);
    fputs(text, file);
    fclose(file);
    bool whole = scene_read(path, scene, status) && world_build(world, scene, &options, status);
    unlink(path);
    return whole;
}

static void run_case(Bench *bench, const char *name, const char *text)
{
    Scene scene = {0};
    World world = {0};
    Status status = {0};
    if (!build(text, bench->isa, &scene, &world, &status)) {
        bench_fail(bench, name, status.text);
    } else {
        Sim *sim = world.sim;
        const Body *body = sim_body(sim, 0);
        Samples tick = {0}, try = {0};
        enum { TURNS = 10 };
        for (int r = 0; r < (bench->quick ? 3 : 40); r++) {
            int64_t begin = clock_thread_ns();
            for (int k = 0; k < TURNS; k++)
                sim_step(sim);
            int64_t middle = clock_thread_ns();
            for (int k = 0; k < TURNS; k++)
                sim_try_step(sim, 0);
            samples_add(&tick, (double)(middle - begin) * 1e-3 / TURNS);
            samples_add(&try, (double)(clock_thread_ns() - middle) * 1e-3 / TURNS);
        }
        const double us_tick = samples_min(&tick), us_try = samples_min(&try);
        bench_row(bench, name, body->state_capacity, "us_per_tick", us_tick, "us");
        bench_row(bench, name, body->state_capacity, "us_per_try", us_try, "us");
        bench_row(bench, name, body->state_capacity, "substeps_per_try",
                  us_try / (us_tick / body->substeps), "ratio");
    }
    world_destroy(&world);
    scene_destroy(&scene);
}

void bench_estimates(Bench *bench)
{
    if (bench_wants(bench, "estimate.surface"))
        run_case(bench, "estimate.surface", SURFACE);
#ifdef PLIANT_WITH_VOXEL
    if (bench_wants(bench, "estimate.voxel"))
        run_case(bench, "estimate.voxel", VOXEL);
#endif
}
