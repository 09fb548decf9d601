// SPDX-License-Identifier: MIT
// Implicit bodies: what a tick of 1 ms costs on spheres of 114 to 2562 nodes, of a soft wall and of
// springs of 1e8 N/m on nodes of 1e-6 kg, while it is pressed for 0.2 s and for 0.2 s after; beside
// it leapfrog on the soft wall, whose substeps say from when on the implicit method is the cheaper.
#include "bench.h"
#include "world.h"

#include "base/clock.h"
#include "geometry/generator.h"
#include "surface/implicit.h"

#include <math.h>

static const double RADIUS = 0.05; // [m]
enum { TICKS = 400, PRESSED = 200 };

typedef enum Contender { SOFT, STIFF, LEAPFROG, CONTENDERS } Contender;

static const char *const names[CONTENDERS] = {"implicit.soft", "implicit.stiff",
                                              "implicit.leapfrog"};
static const SurfaceMaterial stiff = {
    .uniform = true, .spring_stiffness = 1e8, .spring_damping = 0.0, .node_mass = 1e-6};

typedef struct Trial {
    BenchWorld world[CONTENDERS];
    Samples samples[CONTENDERS];
    double iterations[CONTENDERS]; // a tick
} Trial;

static bool create(Trial *trial, const TriMesh *mesh, const char *isa, Status *status)
{
    for (int k = 0; k < CONTENDERS; k++) {
        BenchWorldOptions options = {.integrator =
                                         k == LEAPFROG ? INTEGRATOR_LEAPFROG : INTEGRATOR_IMPLICIT,
                                     .precision = PRECISION_SINGLE,
                                     .rate_hz = 1000.0,
                                     .may_load = true,
                                     .material = k == STIFF ? &stiff : NULL,
                                     .isa = isa};
        if (!bench_world_create(&trial->world[k], mesh, &options, status))
            return false;
    }
    return true;
}

// One press from rest: thread CPU time a tick [us].
static bool press(Trial *trial, int k, double *us, Status *status)
{
    BenchWorld *world = &trial->world[k];
    const LoadOptions load = {.center = {0.0, 0.0, RADIUS},
                              .radius = 0.4 * RADIUS,
                              .force = {0.0, 0.0, k == STIFF ? -0.003 : -1.0},
                              .duration = PRESSED * 1e-3};
    const SurfaceModel *model = world->body->model;
    const int64_t before = model->implicit != NULL ? model->implicit->iterations_done : 0;
    char why[128] = "";
    sim_reset(world->sim);
    if (!sim_apply_load(world->sim, &load, why, sizeof why))
        return status_fail(status, STATUS_FAILED, "%s", why);
    const int64_t begin = clock_thread_ns();
    for (int i = 0; i < TICKS; i++)
        sim_step(world->sim);
    *us = (double)(clock_thread_ns() - begin) * 1e-3 / TICKS;
    if (model->implicit != NULL)
        trial->iterations[k] = (double)(model->implicit->iterations_done - before) / TICKS;
    return world->body->resets == 0 || status_fail(status, STATUS_FAILED, "numbers went bad");
}

static void print(const Bench *bench, int nodes, const Trial *trial)
{
    double least[CONTENDERS];
    for (int k = 0; k < CONTENDERS; k++) {
        least[k] = samples_min(&trial->samples[k]);
        bench_row(bench, names[k], nodes, "us_per_tick", least[k], "us");
        bench_row(bench, names[k], nodes, "us_per_tick_median", samples_median(&trial->samples[k]),
                  "us");
        if (k != LEAPFROG)
            bench_row(bench, names[k], nodes, "iterations_per_tick", trial->iterations[k], "1");
    }
    const double substep = least[LEAPFROG] / trial->world[LEAPFROG].body->substeps;
    bench_row(bench, names[LEAPFROG], nodes, "substeps_per_tick",
              trial->world[LEAPFROG].body->substeps, "1");
    for (int k = SOFT; k <= STIFF; k++)
        bench_row(bench, names[k], nodes, "leapfrog_substeps", least[k] / substep, "1");
}

static void run_mesh(Bench *bench, const TriMesh *mesh)
{
    Trial trial = {0};
    Status status = {0};
    bool whole = create(&trial, mesh, bench->isa, &status);
    for (int r = -1; r < (bench->quick ? 2 : 20) && whole; r++) // the first round warms up
        for (int k = 0; k < CONTENDERS && whole; k++) {
            double us = 0.0;
            whole = press(&trial, k, &us, &status);
            if (r >= 0)
                samples_add(&trial.samples[k], us);
        }
    if (whole)
        print(bench, mesh->node_count, &trial);
    else
        bench_fail(bench, "implicit", status.text);
    for (int k = 0; k < CONTENDERS; k++)
        bench_world_destroy(&trial.world[k]);
}

void bench_implicit(Bench *bench)
{
    if (!bench_wants(bench, "implicit"))
        return;
    for (int size = 0; size < (bench->quick ? 1 : 3); size++) {
        TriMesh mesh = {0};
        Status status = {0};
        bool made = size == 0 ? generate_sphere(&mesh, 114, RADIUS, &status)
                              : generate_ico_sphere(&mesh, size + 2, RADIUS, &status);
        if (made)
            run_mesh(bench, &mesh);
        else
            bench_fail(bench, "implicit", status.text);
        mesh_destroy(&mesh);
    }
}
