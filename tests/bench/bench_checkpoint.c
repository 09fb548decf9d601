// SPDX-License-Identifier: MIT
// What a checkpoint costs: the copy at the end of a tick, which the step thread makes, and the
// writing of the file, which the files thread makes, with its flushes to the disk of TMPDIR.
#include "bench.h"
#include "daemon.h"

#include "base/clock.h"
#include "scene/build.h"
#include "io/checkpoint.h"

#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#ifdef PLIANT_WITH_HDF5

#define SURFACE(nodes, keys)                                                                       \
    "bodies = ( { name = \"ball\";  integrator = \"leapfrog\";  " keys                             \
    "    mesh = { generator = \"sphere\";  nodes = " nodes ";  radius = 0.2; };\n"                 \
    "    shape = { angular_frequency = 50.0;  damping_ratio = 0.1; }; } );\n"
#define VOXELS(count, keys)                                                                        \
    "bodies = ( { name = \"cube\";  model = \"voxel\";  levels = 2;  " keys                        \
    "    voxels = { generator = \"box\";  count = " count ";  size = 0.003125; };\n"               \
    "    material = { youngs_modulus = 1.0e4;  density = 1000.0; };\n"                             \
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0249]); } ); } );\n"

static void run(Bench *bench, const char *name, World *world)
{
    const int repeats = bench->quick ? 3 : 40;
    char path[128];
    const char *base = getenv("TMPDIR");
    snprintf(path, sizeof path, "%s/pliant-bench-%d.h5", base != NULL ? base : "/tmp",
             (int)getpid());
    WorldImage image;
    world_image_reserve(&image, &world->arena, world);
    Samples take = {0}, write = {0};
    Status status = {0};
    for (int i = 0; i < repeats && status.code == STATUS_OK; i++) {
        for (int k = 0; k < 3; k++)
            sim_step(world->sim); // its own data fill the caches, as they do in a run
        int64_t begin = clock_now_ns();
        world_image_take(&image, world);
        int64_t taken = clock_now_ns();
        checkpoint_write(path, &image, world, &status);
        samples_add(&take, (double)(taken - begin) * 1e-3);
        samples_add(&write, (double)(clock_now_ns() - taken) * 1e-3);
    }
    struct stat facts = {0};
    const bool there = stat(path, &facts) == 0;
    unlink(path);
    if (status.code != STATUS_OK || !there) {
        bench_fail(bench, name, status.text);
        return;
    }
    const int nodes = image.node_count[0];
    bench_row(bench, name, nodes, "us_copy_min", samples_min(&take), "us");
    bench_row(bench, name, nodes, "us_copy", samples_median(&take), "us");
    bench_row(bench, name, nodes, "ms_write_min", 1e-3 * samples_min(&write), "ms");
    bench_row(bench, name, nodes, "ms_write", 1e-3 * samples_median(&write), "ms");
    bench_row(bench, name, nodes, "bytes", (double)facts.st_size, "B");
}

static void run_scene(Bench *bench, const char *name, const char *bodies)
{
    char text[2048], path[64];
    Status status = {0};
    Scene scene = {0};
    World world = {0};
    const BuildOptions options = {.isa = bench->isa};
    snprintf(text, sizeof text, "name = \"bench\";\nrate_hz = 1000.0;\n%s", bodies);
    if (!daemon_write_scene(text, path, sizeof path)) {
        bench_fail(bench, name, "cannot write a scene");
        return;
    }
    if (scene_read(path, &scene, &status) && world_build(&world, &scene, &options, &status))
        run(bench, name, &world);
    else
        bench_fail(bench, name, status.text);
    world_destroy(&world);
    scene_destroy(&scene);
    unlink(path);
}

void bench_checkpoints(Bench *bench)
{
    static const struct {
        const char *name, *bodies, *quick;
    } cases[] = {
        {"checkpoint.surface", SURFACE("10242", ""), SURFACE("500", "")},
        {"checkpoint.surface.levels", SURFACE("2562", "levels = 2;  adapt = {};\n"),
         SURFACE("200", "levels = 1;  adapt = {};\n")},
#ifdef PLIANT_WITH_VOXEL
        {"checkpoint.voxel", VOXELS("32", ""), VOXELS("8", "")},
        {"checkpoint.voxel.cuttable", VOXELS("32", "cuttable = true;\n"),
         VOXELS("8", "cuttable = true;\n")},
#endif
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        if (bench_wants(bench, cases[k].name))
            run_scene(bench, cases[k].name, bench->quick ? cases[k].quick : cases[k].bodies);
}

#else

void bench_checkpoints(Bench *bench)
{
    if (bench_wants(bench, "checkpoint"))
        bench_skip(bench, "checkpoint", "built without HDF5");
}

#endif
