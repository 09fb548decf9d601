// SPDX-License-Identifier: MIT
// Springs: the server's RK4 and leapfrog in both precisions against the textbook's RK4 and, where
// it was built in, Bullet's soft body, on spheres of 642 to 40962 nodes with spring damping,
// shape-preserving springs and a force on every node. All do one step of the same length from the
// same state, interleaved; the RK4s must end in the same place.
#include "bench.h"
#include "twin.h"

#include "base/check.h"
#include "base/clock.h"
#include "geometry/generator.h"

#include <math.h>
#include <stdlib.h>

static const double RADIUS = 0.2;           // [m]
static const Vec3 FORCE = {0.4, -0.3, 0.2}; // on all nodes together [N]

typedef enum Contender {
    TEXTBOOK_RK4,
    DOUBLE_RK4,
    DOUBLE_LEAPFROG,
    SINGLE_RK4,
    SINGLE_LEAPFROG,
    BULLET_1,
    BULLET_10,
    CONTENDERS
} Contender;

typedef struct Rules {
    const char *name;
    int evaluations; // a step: of all forces, or passes over all links
    IntegratorKind integrator;
    Precision precision;
} Rules;

static const Rules rules[CONTENDERS] = {
    [TEXTBOOK_RK4] = {.name = "spring.textbook.rk4", .evaluations = 4},
    [DOUBLE_RK4] = {"spring.double.rk4", 4, INTEGRATOR_RK4, PRECISION_DOUBLE},
    [DOUBLE_LEAPFROG] = {"spring.double.leapfrog", 1, INTEGRATOR_LEAPFROG, PRECISION_DOUBLE},
    [SINGLE_RK4] = {"spring.single.rk4", 4, INTEGRATOR_RK4, PRECISION_SINGLE},
    [SINGLE_LEAPFROG] = {"spring.single.leapfrog", 1, INTEGRATOR_LEAPFROG, PRECISION_SINGLE},
    [BULLET_1] = {.name = "spring.bullet.1", .evaluations = 1},
    [BULLET_10] = {.name = "spring.bullet.10", .evaluations = 10},
};
enum { FIRST_SERVER = DOUBLE_RK4, LAST_SERVER = SINGLE_LEAPFROG };

typedef struct SpringBench {
    TriMesh mesh;
    double h;                     // step of all [s]
    BenchWorld world[CONTENDERS]; // those of the server
    Textbook textbook;
    BulletBody *bullet[CONTENDERS]; // NULL when Bullet was not built in
} SpringBench;

// Neighbours move against each other by up to 5 mm/s: enough that every spring works, and so little
// that nothing buckles.
static Vec3 *velocities(const TriMesh *mesh)
{
    Vec3 *v = calloc((size_t)mesh->node_count, sizeof *v);
    ASSERT(v != NULL);
    for (int i = 0; i < mesh->node_count; i++)
        v[i] = vec3(5e-3 * sin(12.9 * i), 5e-3 * sin(78.2 * i), 5e-3 * sin(37.7 * i));
    return v;
}

// The step that fits leapfrog, the shorter one, for all; one substep per tick.
static bool choose_step(SpringBench *b, BenchWorldOptions *options, Status *status)
{
    BenchWorld world;
    bool whole = bench_world_create(&world, &b->mesh, options, status);
    if (whole)
        b->h = fmin(world.body->h, 1e-3);
    options->rate_hz = whole ? 1.0 / b->h : 0.0;
    bench_world_destroy(&world);
    return whole;
}

static bool create(SpringBench *b, int subdivisions, const char *isa, Status *status)
{
    *b = (SpringBench){0};
    if (!generate_ico_sphere(&b->mesh, subdivisions, RADIUS, status))
        return false;
    Vec3 *velocity = velocities(&b->mesh);
    BenchWorldOptions options = {.integrator = INTEGRATOR_LEAPFROG,
                                 .rate_hz = 1000.0,
                                 .initial_velocity = velocity,
                                 .may_load = true,
                                 .isa = isa};
    const LoadOptions load = {.radius = 2.0 * RADIUS, .force = FORCE, .duration = 1e6};
    char why[128] = "";
    bool whole = choose_step(b, &options, status);
    for (int k = FIRST_SERVER; k <= LAST_SERVER && whole; k++) {
        options.integrator = rules[k].integrator;
        options.precision = rules[k].precision;
        whole = bench_world_create(&b->world[k], &b->mesh, &options, status) &&
                (sim_apply_load(b->world[k].sim, &load, why, sizeof why) ||
                 status_fail(status, STATUS_FAILED, "%s", why));
        ASSERT(!whole || b->world[k].body->substeps == 1);
    }
    if (whole) {
        twin_textbook(&b->textbook, &b->mesh, b->world[DOUBLE_RK4].body, velocity, FORCE);
#ifdef PLIANT_BENCH_BULLET
        b->bullet[BULLET_1] = twin_bullet(&b->textbook, 1);
        b->bullet[BULLET_10] = twin_bullet(&b->textbook, 10);
#endif
    }
    free(velocity);
    return whole;
}

static void destroy(SpringBench *b)
{
    for (int k = FIRST_SERVER; k <= LAST_SERVER; k++)
        bench_world_destroy(&b->world[k]);
#ifdef PLIANT_BENCH_BULLET
    bullet_destroy(b->bullet[BULLET_1]);
    bullet_destroy(b->bullet[BULLET_10]);
#endif
    textbook_destroy(&b->textbook);
    mesh_destroy(&b->mesh);
}

// Largest distance between the textbook and a server's RK4 over the largest displacement.
static double disagreement(const SpringBench *b, Contender contender)
{
    size_t count = (size_t)b->mesh.node_count;
    Vec3 *x = calloc(count, sizeof *x), *v = calloc(count, sizeof *v);
    ASSERT(x != NULL && v != NULL);
    const Body *body = b->world[contender].body;
    body->ops->read_state(body->model, NULL, x, v);
    double worst = 0.0, farthest = 0.0;
    for (size_t i = 0; i < count; i++) {
        const double *t = b->textbook.node[i].x;
        worst = fmax(worst, vec3_length(vec3_sub(x[i], vec3(t[0], t[1], t[2]))));
        farthest = fmax(farthest, vec3_length(vec3_sub(x[i], b->mesh.position[i])));
    }
    free(x);
    free(v);
    return worst / farthest;
}

// Bullet's nodes still lie about where they began: it solved the same body.
static bool bullet_is_sane(const SpringBench *b)
{
#ifdef PLIANT_BENCH_BULLET
    for (int k = BULLET_1; k <= BULLET_10; k++)
        for (int i = 0; i < b->mesh.node_count; i++) {
            double x[3];
            bullet_position(b->bullet[k], i, x);
            if (!(vec3_length(vec3_sub(vec3(x[0], x[1], x[2]), b->mesh.position[i])) < RADIUS))
                return false;
        }
#else
    (void)b;
#endif
    return true;
}

// Thread CPU time a step [us], after one step that brings the contender back into the caches.
static double time_steps(SpringBench *b, Contender contender, int steps)
{
    int64_t begin = 0;
    for (int i = -1; i < steps; i++) {
        if (i == 0)
            begin = clock_thread_ns();
        if (contender == TEXTBOOK_RK4)
            textbook_step(&b->textbook, b->h);
        else if ((int)contender <= LAST_SERVER)
            sim_step(b->world[contender].sim);
#ifdef PLIANT_BENCH_BULLET
        else
            bullet_step(b->bullet[contender], b->h);
#endif
    }
    return (double)(clock_thread_ns() - begin) * 1e-3 / steps;
}

static bool is_built(Contender contender)
{
#ifdef PLIANT_BENCH_BULLET
    return contender < CONTENDERS;
#else
    return (int)contender <= LAST_SERVER;
#endif
}

static void print(const Bench *bench, int nodes, int springs, const Samples samples[CONTENDERS])
{
    double least[CONTENDERS] = {0};
    for (int k = 0; k < CONTENDERS; k++)
        least[k] = is_built((Contender)k) ? samples_min(&samples[k]) : 0.0;
    for (int k = 0; k < CONTENDERS; k++) {
        const char *name = rules[k].name;
        if (!bench_wants(bench, name) || !is_built((Contender)k))
            continue;
        bench_row(bench, name, nodes, "us_per_step", least[k], "us");
        bench_row(bench, name, nodes, "us_per_step_median", samples_median(&samples[k]), "us");
        bench_row(bench, name, nodes, "ns_per_spring_eval",
                  1e3 * least[k] / (rules[k].evaluations * springs), "ns");
        // Times faster than the textbook, a pass over all springs.
        if (k != TEXTBOOK_RK4)
            bench_row(bench, name, nodes, "ratio_to_textbook",
                      least[TEXTBOOK_RK4] / 4 * rules[k].evaluations / least[k], "1");
        // Shares of another's whole step.
        if (k == SINGLE_LEAPFROG || k == DOUBLE_LEAPFROG)
            bench_row(bench, name, nodes, "step_share_of_rk4",
                      least[k] / least[k == SINGLE_LEAPFROG ? SINGLE_RK4 : DOUBLE_RK4], "1");
        if (k == SINGLE_RK4 && is_built(BULLET_1))
            bench_row(bench, name, nodes, "step_share_of_bullet_1", least[k] / least[BULLET_1],
                      "1");
    }
}

static void run_size(Bench *bench, int subdivisions)
{
    SpringBench b;
    Status status = {0};
    if (!create(&b, subdivisions, bench->isa, &status)) {
        bench_fail(bench, "spring", status.text);
        destroy(&b);
        return;
    }
    // About 5 ms a sample of the textbook; all RK4s take equally many steps.
    int steps = 40000 / b.mesh.node_count + 1, repeats = bench->quick ? 3 : 50;
    Samples samples[CONTENDERS] = {0};
    for (int r = -1; r < repeats; r++) // the first round warms up
        for (int k = 0; k < CONTENDERS; k++) {
            if (!is_built((Contender)k))
                continue;
            double us = time_steps(&b, (Contender)k, rules[k].evaluations == 1 ? 4 * steps : steps);
            if (r >= 0)
                samples_add(&samples[k], us);
        }
    // Rounding in another order, over some hundred steps; in single precision of displacements.
    if (!(disagreement(&b, DOUBLE_RK4) < 1e-7) || !(disagreement(&b, SINGLE_RK4) < 1e-4))
        bench_fail(bench, "spring", "textbook and server moved differently");
    if (!bullet_is_sane(&b))
        bench_fail(bench, "spring.bullet", "Bullet's nodes went astray");
    print(bench, b.mesh.node_count, b.world[DOUBLE_RK4].body->spring_count, samples);
    destroy(&b);
}

// The server's step with a cavity over the one without, in the same state and with the same step.
static void run_cavity(Bench *bench, int subdivisions, Precision precision)
{
    enum { WITHOUT, CONSTANT, GAS, CASES };
    static const char *const NAMES[2][CASES] = {
        {"spring.cavity.double.none", "spring.cavity.double.constant", "spring.cavity.double.gas"},
        {"spring.cavity.single.none", "spring.cavity.single.constant", "spring.cavity.single.gas"}};
    const char *const *name = NAMES[precision == PRECISION_SINGLE];
    TriMesh mesh;
    Status status = {0};
    if (!generate_ico_sphere(&mesh, subdivisions, RADIUS, &status)) {
        bench_fail(bench, name[CONSTANT], status.text);
        return;
    }
    Vec3 *velocity = velocities(&mesh);
    // A tick is one step, shorter than any of the bounds.
    BenchWorldOptions options = {.integrator = INTEGRATOR_LEAPFROG,
                                 .rate_hz = 2000.0 * (1 << subdivisions),
                                 .precision = precision,
                                 .initial_velocity = velocity,
                                 .isa = bench->isa};
    BenchWorld world[CASES];
    bool whole = true;
    for (int k = 0; k < CASES; k++) {
        options.cavity = (SurfaceCavity){
            .wanted = k != WITHOUT, .gas = k == GAS, .ambient = 1e5, .pressure = 10.0};
        whole &= bench_world_create(&world[k], &mesh, &options, &status);
    }
    free(velocity);
    const int steps = 40000 / mesh.node_count + 1, repeats = bench->quick ? 3 : 50;
    Samples samples[CASES] = {0};
    for (int r = -1; r < repeats && whole; r++)
        for (int k = 0; k < CASES; k++) {
            const int64_t begin = clock_thread_ns();
            for (int i = 0; i < 4 * steps; i++)
                sim_step(world[k].sim);
            if (r >= 0)
                samples_add(&samples[k], (double)(clock_thread_ns() - begin) * 1e-3 / (4 * steps));
        }
    if (!whole)
        bench_fail(bench, name[CONSTANT], status.text);
    for (int k = 0; k < CASES && whole; k++) {
        bench_row(bench, name[k], mesh.node_count, "us_per_step", samples_min(&samples[k]), "us");
        bench_row(bench, name[k], mesh.node_count, "substeps", world[k].body->substeps, "1");
        if (k != WITHOUT)
            bench_row(bench, name[k], mesh.node_count, "ratio",
                      samples_min(&samples[k]) / samples_min(&samples[WITHOUT]), "1");
    }
    for (int k = 0; k < CASES; k++)
        bench_world_destroy(&world[k]);
    mesh_destroy(&mesh);
}

void bench_springs(Bench *bench)
{
    bool wanted = false;
    for (int k = 0; k < CONTENDERS; k++)
        wanted |= bench_wants(bench, rules[k].name);
    if (!is_built(BULLET_1) && (bench_wants(bench, "spring.bullet.1")))
        bench_skip(bench, "spring.bullet", "built without Bullet (libbullet-dev, PLIANT_BULLET)");
    for (int subdivisions = 3; wanted && subdivisions <= (bench->quick ? 3 : 6); subdivisions++)
        run_size(bench, subdivisions);
    const bool encloses = bench_wants(bench, "spring.cavity");
    for (int subdivisions = 3; encloses && subdivisions <= (bench->quick ? 3 : 5); subdivisions++) {
        run_cavity(bench, subdivisions, PRECISION_DOUBLE);
        run_cavity(bench, subdivisions, PRECISION_SINGLE);
    }
}
