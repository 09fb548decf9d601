// What gradation saves and what it costs: a ball pressed into a cube, by the body with elements of
// several sizes and by the same cells as elements of one size. Whole ticks, contact among them, in
// single precision; the bodies take turns tick by tick.
#include "bench.h"
#include "voxel_press.h"

#include "base/clock.h"

enum { LEVELS_MOST = 3 };

static void tick(VoxelPress *press, Samples *samples)
{
    int64_t begin = clock_thread_ns();
    voxel_press_tick(press);
    double us = 1e-3 * (double)(clock_thread_ns() - begin);
    if (samples != NULL)
        samples_add(samples, us / press->world.body->substeps);
}

// Cubes of `cells`^3: press[0] of one size, press[i] of as many as levels[i - 1] allows.
static void run_cube(Bench *bench, int cells, const int *levels, int count, int ticks, bool rests)
{
    VoxelPress press[LEVELS_MOST + 1];
    Samples samples[LEVELS_MOST + 1] = {0};
    for (int k = 0; k <= count; k++)
        voxel_press_create(&press[k], cells, k == 0 ? 0 : levels[k - 1], PRECISION_SINGLE,
                           bench->isa);
    for (int i = 0; i < ticks; i++)
        for (int k = 0; k <= count; k++)
            tick(&press[k], i >= ticks - (bench->quick ? 3 : 30) ? &samples[k] : NULL);
    for (int k = 0; k <= count; k++) {
        char name[32];
        const int size = press[k].world.count;
        const double least = samples_min(&samples[k]);
        snprintf(name, sizeof name, "voxel.press.level%d", k == 0 ? 0 : levels[k - 1]);
        bench_row(bench, name, size, "us_per_step", least, "us");
        if (k > 0)
            bench_row(bench, name, size, "ratio_to_full", samples_min(&samples[0]) / least, "1");
        if (!rests)
            continue;
        bench_row(bench, name, size, "force", voxel_press_force(&press[k]), "N");
        if (k > 0)
            bench_row(bench, name, size, "error", voxel_press_error(&press[k], &press[0]), "1");
        if (!(voxel_press_kinetic(&press[k]) < 1e-7))
            bench_fail(bench, name, "the body has not come to rest");
    }
    for (int k = 0; k <= count; k++)
        voxel_press_destroy(&press[k]);
}

void bench_voxel_presses(Bench *bench)
{
    if (!bench_wants(bench, "voxel.press"))
        return;
    if (bench->quick) {
        run_cube(bench, 16, (int[]){1, 2}, 2, 20, false);
        return;
    }
    run_cube(bench, 32, (int[]){1, 2, 3}, 3, VOXEL_PRESS_TICKS, true);
    run_cube(bench, 64, (int[]){3}, 1, 40, false); // until it touches well
}
