// SPDX-License-Identifier: MIT
// What gradation saves and what it costs: a ball pressed into a cube, by the body with elements of
// several sizes and by the same cells as elements of one size. Whole ticks, contact among them, in
// single precision; the bodies take turns tick by tick.
#include "bench.h"
#include "voxel_press.h"

#include "base/clock.h"

enum { LEVELS_MOST = 3 };

static void tick(VoxelPress *press, void (*step)(VoxelPress *press), Samples *samples)
{
    int64_t begin = clock_thread_ns();
    step(press);
    double us = 1e-3 * (double)(clock_thread_ns() - begin);
    if (samples != NULL)
        samples_add(samples, us / press->world.body->substeps);
}

typedef struct Contest {
    int count;                   // bodies
    int levels[LEVELS_MOST + 1]; // of each; the first has 0: elements of one size
    VoxelPress press[LEVELS_MOST + 1];
    Samples pressed[LEVELS_MOST + 1], released[LEVELS_MOST + 1];
} Contest;

static void run_ticks(Contest *contest, int ticks, int timed)
{
    for (int i = 0; i < ticks; i++)
        for (int k = 0; k < contest->count; k++)
            tick(&contest->press[k], voxel_press_tick,
                 i >= ticks - timed ? &contest->pressed[k] : NULL);
}

static void write_rows(Bench *bench, Contest *contest, bool rests)
{
    for (int k = 0; k < contest->count; k++) {
        VoxelPress *press = &contest->press[k];
        char name[32];
        const int size = press->world.count;
        const double least = samples_min(&contest->pressed[k]);
        snprintf(name, sizeof name, "voxel.press.level%d", contest->levels[k]);
        bench_row(bench, name, size, "us_per_step", least, "us");
        if (k > 0)
            bench_row(bench, name, size, "ratio_to_full", samples_min(&contest->pressed[0]) / least,
                      "1");
        if (!rests)
            continue;
        bench_row(bench, name, size, "force", voxel_press_force(press), "N");
        if (k > 0)
            bench_row(bench, name, size, "error", voxel_press_error(press, &contest->press[0]),
                      "1");
        if (!(voxel_press_kinetic(press) < 1e-7))
            bench_fail(bench, name, "the body has not come to rest");
    }
}

// The same ticks without contact.
static void run_released(Bench *bench, Contest *contest, int timed)
{
    for (int i = 0; i < timed; i++)
        for (int k = 0; k < contest->count; k++)
            tick(&contest->press[k], voxel_press_release, &contest->released[k]);
    for (int k = 0; k < contest->count; k++) {
        char name[32];
        const int size = contest->press[k].world.count;
        const double least = samples_min(&contest->released[k]);
        snprintf(name, sizeof name, "voxel.press.level%d", contest->levels[k]);
        bench_row(bench, name, size, "us_per_step_released", least, "us");
        if (k > 0)
            bench_row(bench, name, size, "ratio_to_full_released",
                      samples_min(&contest->released[0]) / least, "1");
    }
}

// Cubes of `cells`^3 of so many levels each. `rests`: the ticks are enough for it.
static void run_cubes(Bench *bench, int cells, int count, const int *levels, int ticks, bool rests)
{
    const int timed = bench->quick ? 3 : 30;
    Contest contest = {.count = count};
    for (int k = 0; k < count; k++) {
        contest.levels[k] = levels[k];
        voxel_press_create(&contest.press[k], cells, levels[k], PRECISION_SINGLE, bench->isa);
    }
    run_ticks(&contest, ticks, timed);
    write_rows(bench, &contest, rests);
    run_released(bench, &contest, timed);
    for (int k = 0; k < count; k++)
        voxel_press_destroy(&contest.press[k]);
}

void bench_voxel_presses(Bench *bench)
{
    if (!bench_wants(bench, "voxel.press"))
        return;
    if (bench->quick) {
        run_cubes(bench, 16, 3, (int[]){0, 1, 2}, 20, false);
        return;
    }
    run_cubes(bench, 32, 4, (int[]){0, 1, 2, 3}, VOXEL_PRESS_TICKS, true);
    run_cubes(bench, 64, 2, (int[]){0, 3}, 40, false); // until it touches well
}
