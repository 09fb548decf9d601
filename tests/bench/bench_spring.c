// Springs: the textbook's RK4 against the server's RK4 and leapfrog, on spheres of 642 to 40962
// nodes with spring damping, shape-preserving springs and a force on every node. All three do the
// same work from the same state with the same step; the two RK4s must end in the same place.
#include "bench.h"
#include "textbook.h"
#include "world.h"

#include "base/check.h"
#include "base/clock.h"
#include "geometry/generator.h"

#include <math.h>
#include <stdlib.h>

static const double RADIUS = 0.2; // [m]

typedef enum Contender { TEXTBOOK_RK4, DOUBLE_RK4, DOUBLE_LEAPFROG, CONTENDERS } Contender;

static const char *const names[CONTENDERS] = {"spring.textbook.rk4", "spring.double.rk4",
                                              "spring.double.leapfrog"};
static const int evaluations[CONTENDERS] = {4, 4, 1}; // a step

typedef struct SpringBench {
    TriMesh mesh;
    double h; // step of all three [s]
    BenchWorld rk4, leapfrog;
    Textbook textbook;
} SpringBench;

static const Vec3 FORCE = {0.4, -0.3, 0.2}; // on all nodes together [N]

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

static int compare_springs(const void *a, const void *b)
{
    const TextbookSpring *x = a, *y = b;
    return x->a != y->a ? (x->a > y->a) - (x->a < y->a) : (x->b > y->b) - (x->b < y->b);
}

// The twin of the body `like`, from the same rules.
static void create_textbook(Textbook *textbook, const TriMesh *mesh, const Body *like,
                            const Vec3 *velocity)
{
    const SurfaceMaterial material = bench_material();
    const SurfaceShape shape = bench_shape();
    textbook_create(textbook, mesh->node_count, like->spring_count);
    double area = 0.0;
    for (int i = 0; i < mesh->node_count; i++)
        area += like->surface.node_area[i];
    for (int i = 0; i < mesh->node_count; i++) {
        TextbookNode *n = &textbook->node[i];
        Vec3 x = mesh->position[i], v = velocity[i];
        Vec3 f = vec3_scale(like->surface.node_area[i] / area, FORCE);
        double m = like->surface.node_mass[i], w = shape.angular_frequency;
        *n = (TextbookNode){.x = {x.x, x.y, x.z},
                            .v = {v.x, v.y, v.z},
                            .rest = {x.x, x.y, x.z},
                            .external = {f.x, f.y, f.z},
                            .mass = m,
                            .shape_stiffness = m * w * w,
                            .shape_damping = 2.0 * shape.damping_ratio * w * m};
    }
    // Every edge of a closed mesh is met twice: once from its lower node.
    int count = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            int a = mesh->triangle[t][k], b = mesh->triangle[t][(k + 1) % 3];
            if (a < b)
                textbook->spring[count++] = (TextbookSpring){.a = a, .b = b};
        }
    ASSERT(count == like->spring_count);
    qsort(textbook->spring, (size_t)count, sizeof *textbook->spring, compare_springs);
    for (int f = 0; f < mesh->triangle_count; f++)
        for (int k = 0; k < 3; k++) {
            int a = mesh->triangle[f][k], b = mesh->triangle[f][(k + 1) % 3];
            TextbookSpring key = {.a = a < b ? a : b, .b = a < b ? b : a};
            TextbookSpring *spring = bsearch(&key, textbook->spring, (size_t)count,
                                             sizeof *textbook->spring, compare_springs);
            double length = vec3_length(vec3_sub(mesh->position[a], mesh->position[b]));
            spring->rest_length = length;
            spring->stiffness +=
                material.youngs_modulus_2d * like->surface.face_area[f] / (length * length);
            spring->damping = material.damping_time * spring->stiffness;
        }
}

static bool create(SpringBench *b, int subdivisions, const char *isa, Status *status)
{
    *b = (SpringBench){0};
    if (!generate_ico_sphere(&b->mesh, subdivisions, RADIUS, status))
        return false;
    Vec3 *velocity = velocities(&b->mesh);
    // The step that fits leapfrog, the shorter one, for all three; one substep a tick.
    BenchWorldOptions options = {.integrator = INTEGRATOR_LEAPFROG,
                                 .rate_hz = 1000.0,
                                 .initial_velocity = velocity,
                                 .may_load = true,
                                 .isa = isa};
    bool whole = bench_world_create(&b->leapfrog, &b->mesh, &options, status);
    if (whole) {
        b->h = fmin(b->leapfrog.body->h, 1e-3);
        options.rate_hz = 1.0 / b->h;
        bench_world_destroy(&b->leapfrog);
        whole = bench_world_create(&b->leapfrog, &b->mesh, &options, status);
    }
    options.integrator = INTEGRATOR_RK4;
    whole = whole && bench_world_create(&b->rk4, &b->mesh, &options, status);
    if (whole) {
        ASSERT(b->rk4.body->substeps == 1 && b->leapfrog.body->substeps == 1);
        create_textbook(&b->textbook, &b->mesh, b->rk4.body, velocity);
        LoadOptions load = {.radius = 2.0 * RADIUS, .force = FORCE, .duration = 1e6};
        char why[128];
        whole = sim_apply_load(b->rk4.sim, &load, why, sizeof why) &&
                sim_apply_load(b->leapfrog.sim, &load, why, sizeof why);
    }
    free(velocity);
    return whole;
}

static void destroy(SpringBench *b)
{
    bench_world_destroy(&b->rk4);
    bench_world_destroy(&b->leapfrog);
    textbook_destroy(&b->textbook);
    mesh_destroy(&b->mesh);
}

// Largest distance between the two RK4s over the largest displacement.
static double disagreement(const SpringBench *b)
{
    size_t count = (size_t)b->mesh.node_count;
    Vec3 *x = calloc(count, sizeof *x), *v = calloc(count, sizeof *v);
    ASSERT(x != NULL && v != NULL);
    surface_read_state(b->rk4.body, x, v);
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

// Thread CPU time a step [us].
static double time_steps(SpringBench *b, Contender contender, int steps)
{
    int64_t begin = clock_thread_ns();
    for (int i = 0; i < steps; i++) {
        if (contender == TEXTBOOK_RK4)
            textbook_step(&b->textbook, b->h);
        else
            sim_step(contender == DOUBLE_RK4 ? b->rk4.sim : b->leapfrog.sim);
    }
    return (double)(clock_thread_ns() - begin) * 1e-3 / steps;
}

static void print(const Bench *bench, int nodes, int springs, const Samples samples[CONTENDERS])
{
    double textbook = samples_min(&samples[TEXTBOOK_RK4]) / evaluations[TEXTBOOK_RK4];
    for (int k = 0; k < CONTENDERS; k++) {
        if (!bench_wants(bench, names[k]))
            continue;
        double us = samples_min(&samples[k]), evaluation = us / evaluations[k];
        bench_row(bench, names[k], nodes, "us_per_step", us, "us");
        bench_row(bench, names[k], nodes, "us_per_step_median", samples_median(&samples[k]), "us");
        bench_row(bench, names[k], nodes, "ns_per_spring_eval", 1e3 * evaluation / springs, "ns");
        // Times faster than the textbook, an evaluation of all forces.
        if (k != TEXTBOOK_RK4)
            bench_row(bench, names[k], nodes, "ratio_to_textbook", textbook / evaluation, "1");
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
    // About 4 ms a sample of the textbook; both RK4s take equally many steps.
    int steps = 40000 / b.mesh.node_count + 1, repeats = bench->quick ? 3 : 25;
    Samples samples[CONTENDERS] = {0};
    for (int k = 0; k < CONTENDERS; k++) // warm
        time_steps(&b, (Contender)k, steps);
    for (int r = 0; r < repeats; r++)
        for (int k = 0; k < CONTENDERS; k++)
            samples_add(&samples[k], time_steps(&b, (Contender)k, k == 2 ? 4 * steps : steps));
    // Rounding in another order, over some hundred steps.
    if (!(disagreement(&b) < 1e-7))
        bench_fail(bench, "spring", "textbook and server moved differently");
    print(bench, b.mesh.node_count, b.rk4.body->spring_count, samples);
    destroy(&b);
}

void bench_springs(Bench *bench)
{
    bool wanted = false;
    for (int k = 0; k < CONTENDERS; k++)
        wanted |= bench_wants(bench, names[k]);
    for (int subdivisions = 3; wanted && subdivisions <= (bench->quick ? 3 : 6); subdivisions++)
        run_size(bench, subdivisions);
}
