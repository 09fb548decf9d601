// SPDX-License-Identifier: MIT
// pliant-adaptive-accuracy SCENES OUT [REPEATS [PART...]]: solids whose elements are not all of the
// finest size against the same cells all of which are elements: forces on tools that press and
// drag, displacements near the tool and far from it, elements, times of a tick, and what a change
// of the elements does to what is shown. One table for each part, OUT/adaptive-PART.tsv.
#include "experiment.h"
#include "scoped.h"

#include "base/check.h"
#include "base/clock.h"
#include "base/sets.h"
#include "scene/build.h"

#include <math.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// What is tried

typedef struct Place {
    double time, at[3]; // [s], [m]
} Place;

enum { TOOLS_MOST = 2, PLACES_MOST = 6 };

// A scene of one body, and the ways of its tools, straight from place to place; each ends where its
// last place is. Without tools: what is shown alone is compared.
typedef struct Trial {
    const char *name, *tells;
    const char *scene, *voxels, *body; // keys, beside the levels
    double rate, size;                 // [Hz], of a cell [m]
    double seconds, from;              // forces are compared from here to the end [s]
    int tools;
    double radius; // [m]
    Place way[TOOLS_MOST][PLACES_MOST];
} Trial;

// Levels of the body, the finest of which is what the others are compared with.
typedef struct Layout {
    const char *name, *keys;
} Layout;

static const Layout LAYOUTS[] = {
    {"all finest", "levels = 0;"},
    {"levels 1", "levels = 1;"},
    {"levels 2", "levels = 2;"},
    {"levels 3", "levels = 3;"},
    {"adapts, 1", "levels = { inside = 1;  surface = 1; };"},
    {"adapts, 2", "levels = { inside = 2;  surface = 2; };"},
    {"adapts, 3", "levels = { inside = 3;  surface = 3; };"},
};
enum { LAYOUTS_COUNT = sizeof LAYOUTS / sizeof *LAYOUTS, FINEST = 0 };

// Comes to rest within half a second: ten times the usual damping, contact eight times as firm, no
// friction. The finest body's own ball stands 0.3 mm in its faces.
#define STATIC                                                                                     \
    "contact = { stiffness = 4.0;  friction = 0.0; };\n"                                           \
    "material = { youngs_modulus = 1.0e4;  poisson_ratio = 0.3;  density = 1000.0;"                \
    "  damping = 2.0; };\n"
#define MOVING     "material = { youngs_modulus = 1.0e4;  poisson_ratio = 0.3;  density = 1000.0; };\n"
#define ON_A_TABLE "fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0499]); } );\n"
// Half of critical damping of its slowest swing.
#define BAR                                                                                        \
    "material = { youngs_modulus = 6.0e4;  poisson_ratio = 0.3;  density = 1000.0;  drag = 20.0; " \
    "};\nfixed = ( { box = ([-1.0, -1.0, -1.0], [-0.0479, 1.0, 1.0]); } );\n"
#define DOUBLE     "precision = \"double\";\n"
#define CUBE_OF_32 "{ generator = \"box\";  count = 32;  size = 0.003125; }"
#define CUBE_OF_64 "{ generator = \"box\";  count = 64;  size = 0.0015625; }"

#define PLACE(t, x, y, z)                                                                          \
    {                                                                                              \
        t,                                                                                         \
        {                                                                                          \
            x, y, z                                                                                \
        }                                                                                          \
    }
// A tool of radius r over (x, y) of the cube's top that is lowered by `depth` from 0.02 to 0.12 s.
#define PRESSED(x, y, r, depth)                                                                    \
    PLACE(0.0, x, y, 0.0501 + (r)), PLACE(0.02, x, y, 0.0501 + (r)),                               \
        PLACE(0.12, x, y, 0.05 + (r) - (depth))
// The same, dragged along x by 50 mm, from 0.22 s on, at 100 mm/s, and lifted.
#define DRAGGED(r, depth)                                                                          \
    PRESSED(-0.025, 0.0, r, depth), PLACE(0.22, -0.025, 0.0, 0.05 + (r) - (depth)),                \
        PLACE(0.72, 0.025, 0.0, 0.05 + (r) - (depth)), PLACE(0.77, 0.025, 0.0, 0.06 + (r))

// Those of cubes 0.1 m wide.
#define STATIC_OF_32                                                                               \
    .scene = DOUBLE, .voxels = CUBE_OF_32, .body = STATIC ON_A_TABLE, .rate = 500.0,               \
    .size = 0.003125, .seconds = 0.8, .from = 0.75
#define MOVING_CUBE(cells, edge)                                                                   \
    .scene = "", .voxels = cells, .body = MOVING ON_A_TABLE, .rate = 1000.0, .size = (edge),       \
    .seconds = 1.0, .from = 0.25

static const Trial TRIALS[] = {
    {"ball", "32^3 cells, a ball of r 15 mm pressed by 10 mm", STATIC_OF_32, .tools = 1,
     .radius = 0.015, .way = {{PRESSED(0.0, 0.0, 0.015, 0.01)}}},
    {"small", "32^3 cells, a ball of r 5 mm pressed by 4 mm", STATIC_OF_32, .tools = 1,
     .radius = 0.005, .way = {{PRESSED(0.0, 0.0, 0.005, 0.004)}}},
    {"needle", "32^3 cells, a ball of r 1.5 mm, smaller than a cell, pressed by 3 mm", STATIC_OF_32,
     .tools = 1, .radius = 0.0015, .way = {{PRESSED(0.0008, 0.0004, 0.0015, 0.003)}}},
    {"deep", "32^3 cells, a ball of r 8 mm pressed by 12 mm, deeper than its radius", STATIC_OF_32,
     .tools = 1, .radius = 0.008, .way = {{PRESSED(0.0, 0.0, 0.008, 0.012)}}},
    {"two", "32^3 cells, two balls of r 8 mm, 40 mm apart, pressed by 6 mm", STATIC_OF_32,
     .tools = 2, .radius = 0.008,
     .way = {{PRESSED(-0.02, 0.0, 0.008, 0.006)}, {PRESSED(0.02, 0.01, 0.008, 0.006)}}},
    {"bent", "a bar of 48 x 12 x 12 cells of 2 mm, fixed at one end, bent by its weight",
     .scene = DOUBLE "gravity = [0.0, 0.0, -9.81];\n",
     .voxels = "{ generator = \"box\";  count = [48, 12, 12];  size = 0.002; }", .body = BAR,
     .rate = 500.0, .size = 0.002, .seconds = 1.5, .from = 1.45},
    {"drag", "32^3 cells, a ball of r 15 mm pressed by 5 mm and dragged at 100 mm/s",
     MOVING_CUBE(CUBE_OF_32, 0.003125), .tools = 1, .radius = 0.015,
     .way = {{DRAGGED(0.015, 0.005)}}},
    {"drag-fast", "32^3 cells, the same at 200 mm/s, obliquely, with friction", .scene = "",
     .voxels = CUBE_OF_32, .body = "contact = { friction = 0.5; };\n" MOVING ON_A_TABLE,
     .rate = 1000.0, .size = 0.003125, .seconds = 0.8, .from = 0.25, .tools = 1, .radius = 0.015,
     .way = {{PRESSED(-0.0217, -0.0125, 0.015, 0.005), PLACE(0.22, -0.0217, -0.0125, 0.06),
              PLACE(0.47, 0.0217, 0.0125, 0.06), PLACE(0.52, 0.0217, 0.0125, 0.075)}}},
    {"probe", "64^3 cells, a ball of r 5 mm pressed by 5 mm", .scene = "", .voxels = CUBE_OF_64,
     .body = STATIC ON_A_TABLE, .rate = 500.0, .size = 0.0015625, .seconds = 0.6, .from = 0.55,
     .tools = 1, .radius = 0.005, .way = {{PRESSED(0.0, 0.0, 0.005, 0.005)}}},
    {"probe-drag", "64^3 cells, a ball of r 5 mm pressed by 4 mm and dragged at 100 mm/s",
     MOVING_CUBE(CUBE_OF_64, 0.0015625), .tools = 1, .radius = 0.005,
     .way = {{DRAGGED(0.005, 0.004)}}},
};
enum { TRIALS_COUNT = sizeof TRIALS / sizeof *TRIALS };

// ---------------------------------------------------------------------------------------------
// A run of one layout

// What changes of the elements do, between the state before and after each.
typedef struct Watch {
    const BodyOps *ops; // the body's own
    int changes;        // calls of adapt that changed something
    int64_t ns;         // time that watching took
    float *before, *after;
    double jump;   // largest of a shown node [m]
    double energy; // largest change of the elastic energy [J]
} Watch;

typedef struct Run {
    const Trial *trial;
    Scene scene;
    World world;
    Body *body;
    int count;           // shown nodes
    int *by_id;          // [count] nodes in the order of their ids
    float *rest, *shown; // [3 count] at load, at the end of the comparison
    int ticks, end;      // of the comparison
    Vec3 *force;         // [ticks] on all tools [N]
    double *us;          // [ticks] thread time
    double elements;     // mean from `from` on
    int most, last;      // elements
    double speed;        // largest left at the end, of what is shown [m/s]
} Run;

static Watch watch; // the body's operations have no place for it

static bool watched_adapt(Body *body, int64_t step, double tick, TopologyChange *change)
{
    const int numbers = 3 * body->mesh.node_count;
    BodyMeasure was, is;
    int64_t begin = clock_thread_ns();
    watch.ops->snapshot(body->model, watch.before, NULL);
    watch.ops->measure(body->model, &was);
    watch.ns += clock_thread_ns() - begin;
    const bool shown = watch.ops->adapt(body, step, tick, change);
    if (!shown && !change->inside)
        return false;
    begin = clock_thread_ns();
    watch.changes++;
    watch.ops->snapshot(body->model, watch.after, NULL);
    watch.ops->measure(body->model, &is);
    for (int i = 0; i < numbers; i++)
        watch.jump = fmax(watch.jump, fabs((double)watch.after[i] - (double)watch.before[i]));
    watch.energy = fmax(watch.energy, fabs(is.elastic - was.elastic));
    watch.ns += clock_thread_ns() - begin;
    return shown;
}

static void watch_body(Body *body)
{
    static BodyOps ops;
    watch = (Watch){.ops = body->ops};
    if (body->ops->adapt == NULL)
        return;
    watch.before = zeroed(3 * (size_t)body->mesh.node_capacity, sizeof *watch.before);
    watch.after = zeroed(3 * (size_t)body->mesh.node_capacity, sizeof *watch.after);
    ops = *body->ops;
    ops.adapt = watched_adapt;
    body->ops = &ops;
}

static void write_scene(const char *path, const Trial *trial, const Layout *layout)
{
    CLOSED FILE *file = fopen(path, "w");
    ASSERT(file != NULL);
    fprintf(file,
            "name = \"%s\";\nrate_hz = %g;\n%s"
            "bodies = ( { name = \"body\";  model = \"voxel\";  surface = \"blocks\";\n"
            "voxels = %s;\n%s%s } );\n",
            trial->name, trial->rate, trial->scene, trial->voxels, layout->keys, trial->body);
    for (int t = 0; t < trial->tools; t++)
        fprintf(
            file,
            "%s{ id = %d;  kind = \"probe\";  max_force = 100.0;\n"
            "  capsules = ( { from = [0.0, 0.0, 0.0];  to = [0.0, 0.0, 0.1];  radius = %g; } ); "
            "}\n%s",
            t == 0 ? "tools = ( " : ", ", t + 1, trial->radius,
            t == trial->tools - 1 ? ");\n" : "");
}

static const int *compared_id;

static int compare_ids(const void *a, const void *b)
{
    const int x = compared_id[*(const int *)a], y = compared_id[*(const int *)b];
    return (x > y) - (x < y);
}

static void need(bool good, const char *what)
{
    if (good)
        return;
    fprintf(stderr, "pliant-adaptive-accuracy: %s\n", what);
    exit(1);
}

static void run_create(Run *run, const Experiment *experiment, const Trial *trial,
                       const Layout *layout)
{
    char path[4096];
    Status status = {0};
    const BuildOptions options = {.isa = "auto", .may_load = true};
    *run = (Run){.trial = trial};
    snprintf(path, sizeof path, "%s/adaptive-%s.cfg", experiment->out, trial->name);
    write_scene(path, trial, layout);
    need(scene_read(path, &run->scene, &status) &&
             world_build(&run->world, &run->scene, &options, &status),
         status.text);
    sim_set_lockstep(run->world.sim, true);
    run->body = sim_body(run->world.sim, 0);
    // What is shown, by its ids.
    const BodyMesh *mesh = &run->body->mesh;
    const size_t count = (size_t)mesh->node_count;
    run->count = mesh->node_count;
    run->by_id = zeroed(count, sizeof *run->by_id);
    run->rest = zeroed(3 * count, sizeof *run->rest);
    run->shown = zeroed(3 * count, sizeof *run->shown);
    for (int i = 0; i < run->count; i++)
        run->by_id[i] = i;
    compared_id = mesh->id;
    qsort(run->by_id, count, sizeof *run->by_id, compare_ids);
    run->body->ops->snapshot(run->body->model, run->rest, NULL);
    run->ticks = run->end = (int)lround(trial->seconds * trial->rate);
    // While tools drag: up to the place before the last one.
    for (int k = 1; k + 1 < PLACES_MOST && trial->tools > 0; k++)
        if (trial->way[0][k].time > trial->from &&
            trial->way[0][k + 1].time > trial->way[0][k].time)
            run->end = (int)lround(trial->way[0][k].time * trial->rate);
    run->force = zeroed((size_t)run->ticks, sizeof *run->force);
    run->us = zeroed((size_t)run->ticks, sizeof *run->us);
    watch_body(run->body);
}

static void run_destroy(Run *run)
{
    free(run->by_id);
    free(run->rest);
    free(run->shown);
    free(run->force);
    free(run->us);
    world_destroy(&run->world);
    scene_destroy(&run->scene);
}

static Vec3 place_at(const Place *way, double time)
{
    int k = 0;
    while (k + 1 < PLACES_MOST && way[k + 1].time > way[k].time && way[k + 1].time <= time)
        k++;
    const Place *from = &way[k], *to = k + 1 < PLACES_MOST ? &way[k + 1] : from;
    const double part = to->time > from->time ? (time - from->time) / (to->time - from->time) : 0.0;
    return vec3(from->at[0] + part * (to->at[0] - from->at[0]),
                from->at[1] + part * (to->at[1] - from->at[1]),
                from->at[2] + part * (to->at[2] - from->at[2]));
}

static void run_tick(Run *run, int tick)
{
    const Trial *trial = run->trial;
    Sim *sim = run->world.sim;
    const double time = (tick + 1) / trial->rate;
    for (int t = 0; t < trial->tools; t++) {
        const ToolPose pose = {.utime = llround(1e6 * time),
                               .position = place_at(trial->way[t], time),
                               .orientation = {1.0, 0.0, 0.0, 0.0},
                               .active = true};
        sim_apply_pose(sim, t, &pose, true);
    }
    const int64_t begin = clock_thread_ns() - watch.ns;
    sim_step(sim);
    run->us[tick] = 1e-3 * (double)(clock_thread_ns() - watch.ns - begin);
    for (int t = 0; t < trial->tools; t++)
        run->force[tick] = vec3_add(run->force[tick], sim_wrench(sim, t)->force);
}

static double largest_speed(const Run *run)
{
    const size_t numbers = 3 * (size_t)run->count;
    FREED float *x = zeroed(numbers, sizeof *x), *v = zeroed(numbers, sizeof *v);
    run->body->ops->snapshot(run->body->model, x, v);
    double most = 0.0;
    for (size_t i = 0; i < numbers; i++)
        most = fmax(most, fabs((double)v[i]));
    return most;
}

static void run_all(Run *run)
{
    const int from = (int)lround(run->trial->from * run->trial->rate);
    for (int tick = 0; tick < run->ticks; tick++) {
        run_tick(run, tick);
        const int elements = run->body->element_count;
        run->most = elements > run->most ? elements : run->most;
        if (tick >= from)
            run->elements += (double)elements / (run->ticks - from);
        if (tick == run->end - 1)
            run->body->ops->snapshot(run->body->model, run->shown, NULL);
    }
    run->last = run->body->element_count;
    run->speed = largest_speed(run);
    need(sim_resets(run->world.sim) == 0, "a body was restored");
}

// ---------------------------------------------------------------------------------------------
// Comparisons

typedef struct Forces {
    double mean;           // of the finest body [N]
    double offset;         // of the mean, relative
    double rms, most;      // of the difference, over the mean
    double step, own_step; // largest change in a tick, over the mean; that of the finest body
} Forces;

static Forces compare_forces(const Run *run, const Run *finest)
{
    Forces out = {0};
    const Trial *trial = run->trial;
    const int from = (int)lround(trial->from * trial->rate);
    const int end = run->end;
    double mean = 0.0, own = 0.0, square = 0.0;
    for (int tick = from; tick < end; tick++) {
        const Vec3 off = vec3_sub(run->force[tick], finest->force[tick]);
        mean += vec3_length(finest->force[tick]) / (end - from);
        own += vec3_length(run->force[tick]) / (end - from);
        square += vec3_dot(off, off) / (end - from);
        out.most = fmax(out.most, vec3_length(off));
        const Vec3 step = vec3_sub(run->force[tick], run->force[tick - 1]),
                   own_step = vec3_sub(finest->force[tick], finest->force[tick - 1]);
        out.step = fmax(out.step, vec3_length(step));
        out.own_step = fmax(out.own_step, vec3_length(own_step));
    }
    if (!(mean > 0.0))
        return out;
    return (Forces){mean,
                    own / mean - 1.0,
                    sqrt(square) / mean,
                    out.most / mean,
                    out.step / mean,
                    out.own_step / mean};
}

typedef struct Shape {
    double relative, most; // L2 of displacements over that of the finest body's; [m]
} Shape;

// Of the shown points nearer than three radii to where a tool ends, or of all others.
static Shape compare_shapes(const Run *run, const Run *finest, bool near)
{
    const Trial *trial = run->trial;
    double square = 0.0, all = 0.0, most = 0.0;
    need(run->count == finest->count, "other nodes are shown");
    for (int k = 0; k < run->count; k++) {
        const int i = run->by_id[k], j = finest->by_id[k];
        need(run->body->mesh.id[i] == finest->body->mesh.id[j], "other nodes are shown");
        bool is_near = false;
        for (int t = 0; t < trial->tools; t++) {
            const Vec3 tip = place_at(trial->way[t], run->end / trial->rate);
            const double off[2] = {(double)run->rest[3 * i] - tip.x,
                                   (double)run->rest[3 * i + 1] - tip.y};
            is_near |= hypot(hypot(off[0], off[1]), (double)run->rest[3 * i + 2] - 0.05) <
                       3.0 * trial->radius;
        }
        if (is_near != near)
            continue;
        double difference = 0.0;
        for (int c = 0; c < 3; c++) {
            const double expected =
                (double)finest->shown[3 * j + c] - (double)finest->rest[3 * j + c];
            const double u = (double)run->shown[3 * i + c] - (double)run->rest[3 * i + c];
            difference += (u - expected) * (u - expected);
            all += expected * expected;
        }
        square += difference;
        most = fmax(most, sqrt(difference));
    }
    return (Shape){all > 0.0 ? sqrt(square / all) : 0.0, most};
}

static void write_row(FILE *out, const Layout *layout, const Run *run, const Run *finest)
{
    const Forces forces = compare_forces(run, finest);
    const Shape near = compare_shapes(run, finest, true), far = compare_shapes(run, finest, false);
    const int from = (int)lround(run->trial->from * run->trial->rate), timed = run->ticks - from;
    qsort(run->us + from, (size_t)timed, sizeof *run->us, compare_doubles);
    fprintf(out, "%s\t%.0f\t%d\t%d\t%d", layout->name, run->elements, run->most, run->last,
            run->body->substeps);
    fprintf(out, "\t%.4f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f", forces.mean * (1.0 + forces.offset),
            100.0 * forces.offset, 100.0 * forces.rms, 100.0 * forces.most, 100.0 * forces.step,
            100.0 * forces.own_step);
    fprintf(out, "\t%.2f\t%.3f\t%.2f\t%.3f", 100.0 * near.relative, 1e3 * near.most,
            100.0 * far.relative, 1e3 * far.most);
    fprintf(out, "\t%d\t%.4f\t%.1e\t%.0e\t%.0f\t%.0f\n", watch.changes,
            watch.jump / run->trial->size, watch.energy, run->speed, run->us[from + timed / 2],
            run->us[from + timed * 99 / 100]);
    fflush(out);
}

static void try_layouts(const Experiment *experiment, const Trial *trial)
{
    char name[64];
    snprintf(name, sizeof name, "adaptive-%s.tsv", trial->name);
    CLOSED FILE *out = experiment_open(experiment, name);
    fprintf(out,
            "layout\telements\tmost\tat the end\tsubsteps\tforce [N]\toff [%%]\trms [%%]\tmost "
            "[%%]\tlargest change in a tick [%%]\tthat of the finest [%%]\tnear [%%]\tmost "
            "[mm]\tfar [%%]\tmost [mm]\tticks with changes\tlargest jump [cells]\tof the energy "
            "[J]\tspeed left [m/s]\ttick, median [us]\tp99 [us]\n");
    fprintf(stderr, "%s: %s\n", trial->name, trial->tells);
    static Run finest, run;
    for (int l = 0; l < LAYOUTS_COUNT; l++) {
        Run *now = l == FINEST ? &finest : &run;
        run_create(now, experiment, trial, &LAYOUTS[l]);
        run_all(now);
        write_row(out, &LAYOUTS[l], now, &finest);
        free(watch.before);
        free(watch.after);
        if (l != FINEST)
            run_destroy(now);
    }
    run_destroy(&finest);
}

// ---------------------------------------------------------------------------------------------

// One function a trial, as experiment_main takes them.
#define PART(k)                                                                                    \
    static void try_##k(const Experiment *experiment)                                              \
    {                                                                                              \
        try_layouts(experiment, &TRIALS[k]);                                                       \
    }
PART(0)
PART(1)
PART(2)
PART(3)
PART(4)
PART(5)
PART(6)
PART(7)
PART(8)
PART(9)

int main(int argc, char **argv)
{
    static void (*const run[TRIALS_COUNT])(const Experiment *) = {
        try_0, try_1, try_2, try_3, try_4, try_5, try_6, try_7, try_8, try_9};
    ExperimentPart parts[TRIALS_COUNT];
    for (int k = 0; k < TRIALS_COUNT; k++)
        parts[k] = (ExperimentPart){TRIALS[k].name, run[k]};
    return experiment_main(argc, argv, parts, TRIALS_COUNT);
}
