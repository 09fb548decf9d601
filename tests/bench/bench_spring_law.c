// SPDX-License-Identifier: MIT
// What laws of springs cost: leapfrog of spheres of 642 and 10242 nodes, whose springs relax by one
// branch or three, stiffen, or do both, against the linear law, interleaved. The same substeps,
// with damping, shape springs and a force on every node.
#include "bench.h"
#include "world.h"

#include "base/clock.h"
#include "geometry/generator.h"

static const double RADIUS = 0.2; // [m]

typedef struct Law {
    const char *name;
    int branches;
    bool stiffens;
} Law;

enum { LAWS = 5 };
static const Law LAW[LAWS] = {{"spring.linear", 0, false},
                              {"spring.relaxing.1", 1, false},
                              {"spring.relaxing.3", 3, false},
                              {"spring.stiffening", 0, true},
                              {"spring.relaxing.1.stiffening", 1, true}};

static bool create(BenchWorld *world, const TriMesh *mesh, const Law *law, Precision precision,
                   const char *isa, Status *status)
{
    SurfaceMaterial material = bench_material();
    for (int k = 0; k < law->branches; k++)
        material.branch[material.branch_count++] = (MaxwellBranch){0.1, 0.1, false};
    if (law->stiffens)
        material.stiffening = (Stiffening){0.15, 10.0};
    const BenchWorldOptions options = {.integrator = INTEGRATOR_LEAPFROG,
                                       .precision = precision,
                                       .material = &material,
                                       .rate_hz = 10000.0, // one substep a tick
                                       .may_load = true,
                                       .isa = isa};
    const LoadOptions load = {.radius = 2.0 * RADIUS, .force = {4.0, -3.0, 2.0}, .duration = 1e6};
    char why[128] = "";
    return bench_world_create(world, mesh, &options, status) &&
           (sim_apply_load(world->sim, &load, why, sizeof why) ||
            status_fail(status, STATUS_FAILED, "%s", why));
}

static void run_size(Bench *bench, int subdivisions, Precision precision)
{
    TriMesh mesh;
    Status status = {0};
    BenchWorld world[LAWS];
    Samples samples[LAWS] = {0};
    bool whole = generate_ico_sphere(&mesh, subdivisions, RADIUS, &status);
    int made = 0;
    for (; whole && made < LAWS; made++)
        whole = create(&world[made], &mesh, &LAW[made], precision, bench->isa, &status);
    const int steps = 100000 / mesh.node_count + 1, repeats = bench->quick ? 3 : 50;
    for (int r = -1; whole && r < repeats; r++) // the first round warms up
        for (int k = 0; k < LAWS; k++) {
            sim_step(world[k].sim); // back into the caches
            const int64_t begin = clock_thread_ns();
            for (int i = 0; i < steps; i++)
                sim_step(world[k].sim);
            if (r >= 0)
                samples_add(&samples[k], (double)(clock_thread_ns() - begin) * 1e-3 / steps /
                                             world[k].body->substeps);
        }
    for (int k = 0; k < LAWS && whole; k++) {
        char row[64];
        snprintf(row, sizeof row, "%s.%s", LAW[k].name,
                 precision == PRECISION_SINGLE ? "single" : "double");
        bench_row(bench, row, mesh.node_count, "us_per_substep", samples_min(&samples[k]), "us");
        if (k > 0)
            bench_row(bench, row, mesh.node_count, "ratio",
                      samples_min(&samples[k]) / samples_min(&samples[0]), "1");
    }
    if (!whole)
        bench_fail(bench, "spring.linear", status.text);
    while (made-- > 0)
        bench_world_destroy(&world[made]);
    mesh_destroy(&mesh);
}

void bench_spring_laws(Bench *bench)
{
    bool wanted = false;
    for (int k = 0; k < LAWS; k++)
        wanted |= bench_wants(bench, LAW[k].name);
    for (int precision = 0; wanted && precision < PRECISION_COUNT; precision++)
        for (int subdivisions = 3; subdivisions <= (bench->quick ? 3 : 5); subdivisions += 2)
            run_size(bench, subdivisions, (Precision)precision);
}
