// SPDX-License-Identifier: MIT
// The live error estimates: what one try of a step costs, beside the substeps of a tick; and what a
// round of a body's own estimate takes of its ticks (publish.error_hz), by the difference between
// runs that are alike otherwise.
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

// Of rounds in space: bodies at rest under a ball that is pressed in. Elements of all kinds, those
// that follow the tool, and a wall.
typedef struct Space {
    const char *name, *bodies;
    double radius, place; // of the ball and of its middle above the origin [m]
} Space;

#ifdef PLIANT_WITH_VOXEL
#define CUBE(cells, size, levels)                                                                  \
    "model = \"voxel\"; surface = \"blocks\"; voxels = { generator = \"box\"; count = " cells      \
    "; size = " size "; }; levels = " levels                                                       \
    "; material = { youngs_modulus = 1.0e4; poisson_ratio = 0.3; density = 1000.0; };"             \
    " fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.024]); } );"
#endif
static const Space SPACES[] = {
#ifdef PLIANT_WITH_VOXEL
    {"estimate.space.voxel", CUBE("16", "0.003125", "2"), 0.005, 0.027},
    {"estimate.space.adapts", CUBE("64", "0.0015625", "{ inside = 3; surface = 3; }"), 0.005,
     0.052},
#endif
    {"estimate.space.surface",
     "mesh = { generator = \"ico_sphere\"; nodes = 2562; radius = 0.05; }; levels = 1;"
     " shape = { }; fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.025]); } );",
     0.005, 0.052},
};

// Builds a scene in which a ball is in its body; true when it is at rest there.
static bool press(const Bench *bench, const Space *space, double error_hz, Scene *scene,
                  World *world, Status *status)
{
    char text[2048];
    snprintf(text, sizeof text,
             "publish = { error_hz = %g; }; bodies = ( { name = \"body\"; %s } );"
             " tools = ( { id = 1; kind = \"probe\"; max_force = 10.0;"
             " capsules = ( { radius = %g; } ); } );",
             error_hz, space->bodies, space->radius);
    if (!build(text, bench->isa, scene, world, status))
        return false;
    sim_set_lockstep(world->sim, true);
    const ToolPose pose = {
        .position = {0.0, 0.0, space->place}, .orientation = QUAT_NONE, .active = true};
    sim_apply_pose(world->sim, 0, &pose, true);
    for (int k = 0; k < (bench->quick ? 50 : 500); k++)
        sim_step(world->sim);
    return true;
}

static double us_of_ticks(Sim *sim, int count)
{
    const int64_t begin = clock_thread_ns();
    for (int k = 0; k < count; k++)
        sim_step(sim);
    return (double)(clock_thread_ns() - begin) * 1e-3 / count;
}

static void run_space(Bench *bench, const Space *space)
{
    enum { NONE, ALWAYS, RUNS };
    static const double HZ[RUNS] = {0.0, 1e3}; // the latter: a round begins where one ends
    Scene scene[RUNS] = {0};
    World world[RUNS] = {0};
    Status status = {0};
    bool built = true;
    for (int k = 0; k < RUNS && built; k++)
        built = press(bench, space, HZ[k], &scene[k], &world[k], &status);
    if (!built) {
        bench_fail(bench, space->name, status.text);
    } else {
        // Samples are longer than a round.
        const int ticks = bench->quick ? 10 : 100;
        Samples without = {0}, with = {0};
        for (int r = 0; r < (bench->quick ? 3 : 40); r++) {
            samples_add(&without, us_of_ticks(world[NONE].sim, ticks));
            samples_add(&with, us_of_ticks(world[ALWAYS].sim, ticks));
        }
        const double us = samples_min(&with) - samples_min(&without);
        const int size = sim_body(world[NONE].sim, 0)->state_capacity;
        bench_row(bench, space->name, size, "us_per_tick_without", samples_min(&without), "us");
        bench_row(bench, space->name, size, "us_of_round", us, "us");
        bench_row(bench, space->name, size, "percent_of_period",
                  1e-4 * us / sim_tick(world[NONE].sim), "%");
    }
    for (int k = 0; k < RUNS; k++) {
        world_destroy(&world[k]);
        scene_destroy(&scene[k]);
    }
}

void bench_estimates(Bench *bench)
{
    for (size_t k = 0; k < sizeof SPACES / sizeof *SPACES; k++)
        if (bench_wants(bench, SPACES[k].name))
            run_space(bench, &SPACES[k]);
    if (bench_wants(bench, "estimate.surface"))
        run_case(bench, "estimate.surface", SURFACE);
#ifdef PLIANT_WITH_VOXEL
    if (bench_wants(bench, "estimate.voxel"))
        run_case(bench, "estimate.voxel", VOXEL);
#endif
}
