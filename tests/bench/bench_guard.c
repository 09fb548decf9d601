// SPDX-License-Identifier: MIT
// What the guard costs a step: the same body by the same kernels, with and without the look at each
// number in the tick's last pass, in turns; and the stage that asks for its result. One step a
// tick, so that nothing of it is shared by several.
#include "bench_guard.h"
#include "world.h"

#include "base/clock.h"
#include "geometry/generator.h"
#include "surface/model.h"

static SpringKernel *evaluate_checked;

// The look is due in the last step of a tick.
static void evaluate_unchecked(const SpringPass *pass)
{
    SpringPass without = *pass;
    without.evaluation.last = false;
    evaluate_checked(&without);
}

static void leave_out(const SurfaceModel *model, SpringKernels *kernels)
{
    *kernels = *model->kernels;
    evaluate_checked = kernels->evaluate[model->kind][model->shape];
    kernels->evaluate[model->kind][model->shape] = evaluate_unchecked;
}

void bench_guard_time(Sim *sim, int ticks, double *least)
{
    int64_t begin = clock_thread_ns();
    for (int i = 0; i < ticks; i++)
        sim_step(sim);
    const double us = (double)(clock_thread_ns() - begin) * 1e-3 / ticks;
    *least = *least > 0.0 && *least < us ? *least : us;
}

void bench_guard_rows(Bench *bench, const char *name, int size, const GuardTimes *times,
                      double stage_us)
{
    bench_row(bench, name, size, "us_per_step", times->with, "us");
    bench_row(bench, name, size, "check_stage_us", stage_us, "us");
    // The stage also does what would have to be done without it: it keeps the result of the tick.
    bench_row(bench, name, size, "guard_percent",
              100.0 * (times->with - times->without + stage_us) / times->without, "%");
}

static void run(Bench *bench, const char *name, IntegratorKind integrator, int subdivisions)
{
    TriMesh mesh;
    Status status = {0};
    BenchWorld world = {0};
    const BenchWorldOptions options = {.integrator = integrator,
                                       .precision = PRECISION_SINGLE,
                                       .rate_hz = 2000.0,
                                       .time_step = 5e-4,
                                       .isa = bench->isa};
    if (!generate_ico_sphere(&mesh, subdivisions, 0.2, &status) ||
        !bench_world_create(&world, &mesh, &options, &status)) {
        bench_fail(bench, name, status.text);
        bench_world_destroy(&world);
        return;
    }
    SurfaceModel *model = world.body->model;
    const SpringKernels *own = model->kernels;
    SpringKernels without;
    leave_out(model, &without);
    GuardTimes times = {0};
    const int ticks = 40000 / mesh.node_count + 1;
    bench_guard_time(world.sim, ticks, &times.with);
    const int64_t before = sim_stage_ns(world.sim, STAGE_CHECK), first = sim_steps(world.sim);
    for (int r = 0; r < (bench->quick ? 3 : 1000); r++) {
        model->kernels = own;
        bench_guard_time(world.sim, ticks, &times.with);
        model->kernels = &without;
        bench_guard_time(world.sim, ticks, &times.without);
    }
    model->kernels = own;
    const double stage_us = 1e-3 * (double)(sim_stage_ns(world.sim, STAGE_CHECK) - before) /
                            (double)(sim_steps(world.sim) - first);
    bench_guard_rows(bench, name, mesh.node_count, &times, stage_us);
    bench_world_destroy(&world);
    mesh_destroy(&mesh);
}

void bench_guards(Bench *bench)
{
    const int subdivisions = bench->quick ? 3 : 4; // 642 or 2562 nodes
    if (bench_wants(bench, "guard.surface.rk4"))
        run(bench, "guard.surface.rk4", INTEGRATOR_RK4, subdivisions);
    if (bench_wants(bench, "guard.surface.leapfrog"))
        run(bench, "guard.surface.leapfrog", INTEGRATOR_LEAPFROG, subdivisions);
}
