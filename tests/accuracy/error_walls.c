// SPDX-License-Identifier: MIT
// pliant-error-walls [NAME...]: estimated and true errors of walls (BodyOps.estimate), one line a
// scene. The truth is the same body refined once more everywhere, under the same loads and the same
// ways of tools.
#include "run.h"
#include "scoped.h"

#include "base/check.h"
#include "base/clock.h"
#include "scene/build.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void surface_error_tune(int iterations, double scale);

typedef struct Case {
    const char *name;
    const char *mesh;     // of level 0
    int level;            // held at this level
    int adapts;           // finest level if it adapts, else 0
    const char *material; // further keys
    const char *body;     // further keys of the body
    const char *tail;     // loads and others
    double radius;        // of the tool; 0: none
    Vec3 way[3];          // of the tool: from here, pressed to there in 0.3 s, dragged to there
    double seconds;
    bool cuts;
    Vec3 cut[4]; // before, after
} Case;

#define SPHERE   "generator = \"sphere\"; nodes = 114; radius = 0.05;"
#define SPHERE2  "generator = \"ico_sphere\"; nodes = 162; radius = 0.05;"
#define SHEET    "generator = \"sheet\"; columns = 11; rows = 11; width = 0.2; height = 0.2;"
#define STOMACH  "generator = \"stomach\"; nodes = 188; length = 0.25;"
#define TUBE     "file = \"tube.off\";"
#define SOFT     "youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4;"
#define BENDS    SOFT " thickness = 0.004;"
#define CALM     "shape = { angular_frequency = 50.0; damping_ratio = 1.0; };"
#define WEAK     "shape = { angular_frequency = 15.0; damping_ratio = 2.0; };"
#define HELD_LOW "fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.035]); } );"
#define HELD_SIDES                                                                                 \
    "fixed = ( { box = ([-1.0, -1.0, -1.0], [-0.0999, 1.0, 1.0]); },"                              \
    " { box = ([0.0999, -1.0, -1.0], [1.0, 1.0, 1.0]); } );"
#define HELD_ENDS                                                                                  \
    "fixed = ( { box = ([-1.0, -1.0, -1.0], [-0.0699, 1.0, 1.0]); },"                              \
    " { box = ([0.0699, -1.0, -1.0], [1.0, 1.0, 1.0]); } );"
#define HELD_HEAD "fixed = ( { box = ([0.05, -1.0, -1.0], [1.0, 1.0, 1.0]); } );"
// Loads of several radii: a pressure without a jump at its border.
#define ONE(x, y, z, r, fx, fy, fz)                                                                \
    "{ center = [" #x ", " #y ", " #z "]; radius = " #r "; force = [" #fx ", " #fy ", " #fz        \
    "]; duration = 10.0; }"
#define LOAD(x, y, z, fx, fy, fz)                                                                  \
    "loads = (" ONE(x, y, z, 0.03, fx, fy, fz) "," ONE(x, y, z, 0.025, fx, fy,                     \
                                                       fz) "," ONE(x, y, z, 0.02, fx, fy, fz) ");"
#define TOP_LOAD(f) LOAD(0.0, 0.0, 0.05, 0.0, 0.0, f)

static const Case CASES[] = {
    {"sphere pressed 0.2 N", SPHERE, 0, 0, BENDS, CALM, TOP_LOAD(-0.067), .seconds = 0.8},
    {"sphere pressed 0.5 N", SPHERE, 0, 0, BENDS, CALM, TOP_LOAD(-0.167), .seconds = 0.8},
    {"sphere pulled 0.3 N", SPHERE, 0, 0, BENDS, CALM, TOP_LOAD(0.1), .seconds = 0.8},
    {"sphere level 1", SPHERE, 1, 0, BENDS, CALM, TOP_LOAD(-0.167), .seconds = 0.8},
    {"sphere adapts to 1", SPHERE, 0, 1, BENDS, CALM, TOP_LOAD(-0.167), .seconds = 0.8},
    {"sphere adapts to 2", SPHERE, 0, 2, BENDS, CALM, TOP_LOAD(-0.167), .seconds = 0.8},
    {"sphere thin", SPHERE, 0, 0, SOFT, CALM, TOP_LOAD(-0.067), .seconds = 0.8},
    {"sphere thin pulled", SPHERE, 0, 0, SOFT, CALM, TOP_LOAD(0.1), .seconds = 0.8},
    {"ball sags", SPHERE2, 0, 0, BENDS, WEAK HELD_LOW, "gravity = [0.0, 0.0, -9.81];",
     .seconds = 1.2},
    {"ball sags, level 1", SPHERE2, 1, 0, BENDS, WEAK HELD_LOW, "gravity = [0.0, 0.0, -9.81];",
     .seconds = 1.2},
    {"ball probed",
     SPHERE2,
     0,
     0,
     BENDS,
     CALM HELD_LOW,
     "",
     0.012,
     {{0.0, 0.0, 0.0625}, {0.0, 0.0, 0.052}, {0.0, 0.0, 0.052}},
     .seconds = 0.8},
    {"ball probed off a node",
     SPHERE2,
     0,
     0,
     BENDS,
     CALM HELD_LOW,
     "",
     0.012,
     {{0.0125, 0.004, 0.0625}, {0.0125, 0.004, 0.052}, {0.0125, 0.004, 0.052}},
     .seconds = 0.8},
    {"ball dragged on",
     SPHERE2,
     0,
     0,
     BENDS,
     CALM HELD_LOW,
     "",
     0.012,
     {{0.0, 0.0, 0.0625}, {0.0, 0.0, 0.052}, {0.02, 0.0, 0.052}},
     .seconds = 0.8},
    {"ball probed, adapts to 2",
     SPHERE2,
     0,
     2,
     BENDS,
     CALM HELD_LOW,
     "",
     0.012,
     {{0.0, 0.0, 0.0625}, {0.0, 0.0, 0.052}, {0.0, 0.0, 0.052}},
     .seconds = 0.8},
    {"gas ball pressed", SPHERE2, 0, 0, BENDS, CALM "cavity = { gas = true; pressure = 300.0; };",
     TOP_LOAD(-0.167), .seconds = 0.8},
    {"ball blown up", SPHERE2, 0, 0, BENDS, WEAK HELD_LOW "cavity = { pressure = 150.0; };", "",
     .seconds = 0.8},
    {"water ball probed",
     SPHERE2,
     0,
     0,
     BENDS,
     "shape = { angular_frequency = 15.0; damping_ratio = 2.0; };" HELD_LOW
     "cavity = { fluid = true; pressure = 300.0; };",
     "",
     0.012,
     {{0.0, 0.0, 0.066}, {0.0, 0.0, 0.056}, {0.0, 0.0, 0.056}},
     .seconds = 0.8},
    {"sheet pressed", SHEET, 0, 0, BENDS, CALM HELD_SIDES, LOAD(0.0, 0.0, 0.0, 0.0, 0.0, -0.1),
     .seconds = 0.8},
    {"sheet pressed, level 1", SHEET, 1, 0, BENDS, CALM HELD_SIDES,
     LOAD(0.0, 0.0, 0.0, 0.0, 0.0, -0.1), .seconds = 0.8},
    {"sheet pressed, thin", SHEET, 0, 0, SOFT, CALM HELD_SIDES, LOAD(0.0, 0.0, 0.0, 0.0, 0.0, -0.1),
     .seconds = 0.8},
    {"sheet drawn in plane", SHEET, 0, 0, SOFT, WEAK HELD_SIDES, LOAD(0.0, 0.0, 0.0, 0.3, 0.0, 0.0),
     .seconds = 0.8},
    {"sheet sags", SHEET, 0, 0, BENDS, WEAK HELD_SIDES, "gravity = [0.0, 0.0, -9.81];",
     .seconds = 1.2},
    {"sheet adapts to 2", SHEET, 0, 2, BENDS, CALM HELD_SIDES, LOAD(0.0, 0.0, 0.0, 0.0, 0.0, -0.1),
     .seconds = 0.8},
    {"sheet cut", SHEET, 0, 0, BENDS, CALM HELD_SIDES, LOAD(0.0, 0.01, 0.0, 0.0, 0.0, -0.03),
     .seconds = 0.8, .cuts = true,
     .cut = {{-0.041, 0.0, -0.05}, {-0.041, 0.0, 0.05}, {0.041, 0.0, -0.05}, {0.041, 0.0, 0.05}}},
    {"sheet probed",
     SHEET,
     0,
     0,
     BENDS,
     CALM HELD_SIDES,
     "",
     0.015,
     {{0.0, 0.0, 0.016}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}},
     .seconds = 0.8},
    {"stomach pressed", STOMACH, 0, 0, BENDS, CALM, LOAD(-0.1067, -0.0001, 0.0187, 0.05, 0.0, 0.0),
     .seconds = 0.8},
    {"stomach pinched", STOMACH, 0, 0, BENDS, CALM HELD_HEAD,
     "loads = (" ONE(-0.0367, 0.045, 0.0, 0.03, 0.0, -0.15, 0.0) "," ONE(-0.0367, -0.045, 0.0, 0.03,
                                                                         0.0, 0.15, 0.0) ");",
     .seconds = 0.8},
    {"stomach adapts to 2", STOMACH, 0, 2, BENDS, CALM,
     LOAD(-0.1067, -0.0001, 0.0187, 0.05, 0.0, 0.0), .seconds = 0.8},
    {"stomach sags", STOMACH, 0, 0, BENDS, WEAK HELD_HEAD, "gravity = [0.0, 0.0, -9.81];",
     .seconds = 1.2},
    {"stomach thin adapts to 1", STOMACH, 0, 1, SOFT, CALM,
     LOAD(-0.1067, -0.0001, 0.0187, 0.05, 0.0, 0.0), .seconds = 0.8},
    {"tube pressed", TUBE, 0, 0, BENDS, CALM HELD_ENDS, LOAD(0.0, 0.0, 0.02, 0.0, 0.0, -0.1),
     .seconds = 0.8},
    {"tube pinched", TUBE, 0, 0, BENDS, CALM HELD_ENDS,
     "loads = (" ONE(0.0, 0.0, 0.02, 0.015, 0.0, 0.0, -0.3) "," ONE(0.0, 0.0, -0.02, 0.015, 0.0,
                                                                    0.0, 0.3) ");",
     .seconds = 0.8},
    {"tube twisted, level 1", TUBE, 1, 0, BENDS, CALM HELD_ENDS,
     "loads = (" ONE(0.0, 0.0, 0.02, 0.02, 0.0, 0.3, 0.0) "," ONE(0.0, 0.0, -0.02, 0.02, 0.0, -0.3,
                                                                  0.0) ");",
     .seconds = 0.8},
    {"tube blown up", TUBE, 0, 0, BENDS " stiffening = { strain = 0.3; cap = 4.0; };",
     CALM HELD_ENDS, "loads = (" ONE(0.0, 0.0, 0.02, 0.015, 0.0, 0.0, 0.5) ");", .seconds = 0.8},
};
enum { CASE_COUNT = sizeof CASES / sizeof *CASES };

// An open tube of equilateral faces along x.
static void write_tube(const char *path)
{
    enum { AROUND = 14, ALONG = 18 };
    const double radius = 0.02;
    CLOSED FILE *file = fopen(path, "w");
    ASSERT(file != NULL);
    fprintf(file, "OFF\n%d %d 0\n", AROUND * ALONG, 2 * AROUND * (ALONG - 1));
    for (int i = 0; i < ALONG; i++)
        for (int k = 0; k < AROUND; k++) {
            const double at = 2.0 * M_PI * (k + 0.5 * (i % 2)) / AROUND;
            fprintf(file, "%.9g %.9g %.9g\n", -0.07 + 0.14 * i / (ALONG - 1), radius * sin(at),
                    radius * cos(at));
        }
    for (int i = 0; i + 1 < ALONG; i++)
        for (int k = 0; k < AROUND; k++) {
            const int a = i * AROUND + k, b = i * AROUND + (k + 1) % AROUND, odd = i % 2;
            const int c = a + AROUND, d = b + AROUND; // above
            if (odd)
                fprintf(file, "3 %d %d %d\n3 %d %d %d\n", a, d, b, a, c, d);
            else
                fprintf(file, "3 %d %d %d\n3 %d %d %d\n", a, c, b, b, c, d);
        }
}

static void read_case(const Case *what, bool truth, const char *folder, Scene *scene)
{
    char text[8192], path[512], levels[128] = "";
    const int finest = what->adapts > 0 ? what->adapts : what->level;
    if (truth)
        snprintf(levels, sizeof levels, "levels = %d; start_level = %d;", finest + 1, finest + 1);
    else if (what->adapts > 0)
        snprintf(levels, sizeof levels, "levels = %d; adapt = { force = 0.0025; };", finest);
    else if (what->level > 0)
        snprintf(levels, sizeof levels, "levels = %d; start_level = %d;", finest, finest);
    char tool[256] = "";
    if (what->radius > 0.0)
        snprintf(tool, sizeof tool,
                 "tools = ( { id = 1; kind = \"probe\"; max_force = 50.0; capsules = ( { radius = "
                 "%g; } ); } );\n",
                 what->radius);
    snprintf(text, sizeof text,
             "name = \"error\"; rate_hz = 1000.0; settle_s = 0.0;\nbodies = ( { name = \"a\"; mesh "
             "= { %s };"
             " material = { %s };\n%s %s %s } );\n%s%s\n",
             what->mesh, what->material, levels, what->body, what->cuts ? "cuttable = true;" : "",
             tool, what->tail);
    snprintf(path, sizeof path, "%s/error.cfg", folder);
    FILE *file = fopen(path, "w");
    ASSERT(file != NULL);
    fputs(text, file);
    fclose(file);
    Status status = {0};
    if (!scene_read(path, scene, &status)) {
        fprintf(stderr, "%s: %s\n", what->name, status.text);
        exit(1);
    }
    scene->body[0].surface.body.estimate_error = !truth;
}

static Vec3 way_at(const Case *what, double time)
{
    const double press = fmin(time / 0.3, 1.0), drag = fmin(fmax((time - 0.3) / 0.4, 0.0), 1.0);
    const Vec3 down = vec3_sub(what->way[1], what->way[0]),
               on = vec3_sub(what->way[2], what->way[1]);
    return vec3_madd(vec3_madd(what->way[0], press, down), drag, on);
}

typedef struct Outcome {
    int count, *id;
    Vec3 *x, *rest;
    double *area;
    double force; // on the tool, mean of the last ticks [N]
    int64_t rounds, ticks, step_ns, error_ns;
    BodyError error;
} Outcome;

static void outcome_destroy(Outcome *out)
{
    free(out->id), free(out->x), free(out->rest), free(out->area);
}

static void play(const Case *what, const Scene *scene, int budget, Outcome *out)
{
    SCOPED(world_destroy) World world;
    Status status = {0};
    if (!world_build(&world, scene, &(BuildOptions){.isa = "auto"}, &status)) {
        fprintf(stderr, "%s: %s\n", what->name, status.text);
        exit(1);
    }
    Sim *sim = world.sim;
    Body *body = sim_body(sim, 0);
    *out = (Outcome){.ticks = lround(what->seconds * 1000.0)};
    for (int64_t t = 0; t < out->ticks; t++) {
        if (what->cuts && t == 50) {
            char why[256];
            CutOutcome sum;
            const CutOptions cut = {.body = 0,
                                    .before = {{what->cut[0], what->cut[1]}},
                                    .after = {{what->cut[2], what->cut[3]}}};
            if (!sim_apply_cut(sim, &cut, &sum, why, sizeof why))
                fprintf(stderr, "%s: %s\n", what->name, why);
            fprintf(stderr, "%s: %s\n", what->name, why);
        }
        if (what->radius > 0.0) {
            const ToolPose pose = {.position = way_at(what, 0.001 * (double)t),
                                   .orientation = {1.0, 0.0, 0.0, 0.0},
                                   .active = true};
            sim_apply_pose(sim, 0, &pose, true);
        }
        int64_t begin = clock_thread_ns();
        sim_step(sim);
        out->step_ns += clock_thread_ns() - begin;
        const ToolWrench *wrench = what->radius > 0.0 ? sim_wrench(sim, 0) : NULL;
        if (wrench != NULL && t >= out->ticks - 50)
            out->force += vec3_length(wrench->force) / 50.0;
        if (budget == 0)
            continue;
        const bool touches = wrench != NULL && wrench->contact;
        const ErrorQuestion question = {touches, touches ? &wrench->point : NULL, &what->radius,
                                        touches ? &wrench->force : NULL,
                                        touches ? &wrench->depth : NULL};
        begin = clock_thread_ns();
        out->rounds += body->ops->estimate(body->model, &question, budget, &out->error);
        out->error_ns += clock_thread_ns() - begin;
    }
    const BodyMesh *mesh = &body->mesh;
    const size_t slots = (size_t)mesh->node_count;
    out->count = mesh->node_count;
    out->id = zeroed(slots, sizeof(int));
    out->x = zeroed(slots, sizeof(Vec3));
    out->rest = zeroed(slots, sizeof(Vec3));
    out->area = zeroed(slots, sizeof(double));
    FREED Vec3 *v = zeroed(slots, sizeof *v);
    FREED float *rest = zeroed(3 * slots, sizeof *rest);
    body->ops->read_state(body->model, out->id, out->x, v);
    body->ops->snapshot_rest(body->model, rest);
    for (size_t s = 0; s < slots; s++)
        out->rest[s] =
            (Vec3){(double)rest[3 * s], (double)rest[3 * s + 1], (double)rest[3 * s + 2]};
    // Areas of what is published.
    for (int f = 0; f < mesh->triangle_count; f++) {
        const int *n = mesh->triangle[f];
        if (n[0] == n[1])
            continue;
        const double area =
            0.5 * vec3_length(vec3_cross(vec3_sub(out->rest[n[1]], out->rest[n[0]]),
                                         vec3_sub(out->rest[n[2]], out->rest[n[0]])));
        for (int k = 0; k < 3; k++)
            out->area[n[k]] += area / 3.0;
    }
}

static void compare(const Outcome *own, const Outcome *truth, double *wrong, double *moved)
{
    int most = 0;
    for (int s = 0; s < truth->count; s++)
        most = truth->id[s] > most ? truth->id[s] : most;
    FREED int *slot = zeroed((size_t)most + 1, sizeof *slot);
    for (int s = 0; s < truth->count; s++)
        if (truth->id[s] >= 0)
            slot[truth->id[s]] = s + 1;
    double sum = 0.0, size = 0.0, area = 0.0;
    for (int s = 0; s < own->count; s++) {
        const int id = own->id[s], at = id >= 0 && id <= most ? slot[id] - 1 : -1;
        if (at < 0)
            continue;
        // Copies that a cut has made have numbers that the finer body gives to others.
        if (vec3_length(vec3_sub(own->rest[s], truth->rest[at])) > 3e-3)
            continue;
        const Vec3 u = vec3_sub(own->x[s], own->rest[s]),
                   w = vec3_sub(truth->x[at], truth->rest[at]), d = vec3_sub(u, w);
        if (getenv("SHOW") != NULL)
            printf("# %d %.4f %.4f %.4f  u %.5f %.5f %.5f  w %.5f %.5f %.5f\n", id, own->rest[s].x,
                   own->rest[s].y, own->rest[s].z, 1e3 * u.x, 1e3 * u.y, 1e3 * u.z, 1e3 * w.x,
                   1e3 * w.y, 1e3 * w.z);
        sum += own->area[s] * vec3_dot(d, d);
        size += own->area[s] * vec3_dot(u, u);
        area += own->area[s];
    }
    *wrong = sqrt(sum / area);
    *moved = sqrt(size / area);
}

int main(int argc, char **argv)
{
    char folder[] = "/tmp/pliant-error-XXXXXX", path[64];
    if (mkdtemp(folder) == NULL)
        return 1;
    const char *iterations = getenv("ITERATIONS"), *budgets = getenv("BUDGET"),
               *calm = getenv("SCALE");
    surface_error_tune(iterations ? atoi(iterations) : 12, calm ? atof(calm) : 1.0);
    const int budget = budgets ? atoi(budgets) : 20000;
    snprintf(path, sizeof path, "%s/tube.off", folder);
    write_tube(path);
    printf("scene\tu [mm]\ttrue [mm]\testimated [mm]\tratio\ttrue F [%%]\test F "
           "[%%]\tratio\trounds\tcost\n");
    for (int c = 0; c < CASE_COUNT; c++) {
        bool named = argc == 1;
        for (int a = 1; a < argc; a++)
            named |= strstr(CASES[c].name, argv[a]) != NULL;
        if (!named)
            continue;
        SCOPED(scene_destroy) Scene own, truth;
        Outcome a, b;
        read_case(&CASES[c], false, folder, &own);
        play(&CASES[c], &own, budget, &a);
        read_case(&CASES[c], true, folder, &truth);
        play(&CASES[c], &truth, 0, &b);
        double wrong, moved;
        compare(&a, &b, &wrong, &moved);
        printf("%-26s\t%.3f\t%.4f\t%.4f\t%.2f", CASES[c].name, 1e3 * moved, 1e3 * wrong,
               1e3 * a.error.displacement, a.error.displacement / wrong);
        if (CASES[c].radius > 0.0) {
            const double off = fabs(a.force - b.force) / a.force;
            printf("\t%.1f\t%.1f\t%.2f", 100.0 * off, 100.0 * a.error.force[0],
                   a.error.force[0] / off);
        } else {
            printf("\t\t\t");
        }
        printf("\t%d\t%.3f\t%.1f us\t%.2f ns\n", (int)a.rounds,
               (double)a.error_ns / (double)a.step_ns, 1e-3 * (double)a.step_ns / (double)a.ticks,
               (double)a.error_ns / (double)a.ticks / budget);
        fflush(stdout);
        outcome_destroy(&a), outcome_destroy(&b);
    }
    unlink(path);
    snprintf(path, sizeof path, "%s/error.cfg", folder);
    unlink(path);
    rmdir(folder);
    return 0;
}
