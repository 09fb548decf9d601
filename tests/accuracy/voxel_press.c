// SPDX-License-Identifier: MIT
// Fig. 3: a ball pressed into a cube, graded against full: shapes in the middle plane, the surface,
// the tool's force, the time of a step, and how many steps a frame of 1/30 s holds.
#include "voxel_accuracy.h"
#include "sim_steps.h"

#include "base/check.h"
#include "base/clock.h"
#include "voxel/layout.h"
#include "voxel_world.h"
#include "scoped.h"

#include <stdlib.h>

static const double EDGE = 0.1, RADIUS = 0.03, DEPTH = 0.02; // [m]

typedef struct PressModel {
    const char *name;
    int n, levels;
} PressModel;

enum { PRESSED_MODELS = 6, FULL = 0, SHOWN = 2 };
static const PressModel MODELS[PRESSED_MODELS] = {
    {"voxel 32 (full)", 32, 0},    {"graded 32, level 1", 32, 1}, {"graded 32, level 2", 32, 2},
    {"graded 32, level 3", 32, 3}, {"voxel 16", 16, 0},           {"voxel 8", 8, 0}};

// A cube in its world, and where its lattice points' vertices are.
typedef struct Pressed {
    const PressModel *model;
    VoxelWorld world;
    Layout layout;
    int elements, points;
    int *vertex;         // [(n + 1)^3] -1: none
    double force, depth; // on the tool, upwards [N]; how far the ball is in the faces [m]
    double speed;        // largest that is left [m/s]
    double step_us;      // CPU time of a step
    double usual_force, usual_depth; // the same with the usual contact
    int steps;                       // in a tick
    double h;                        // of the timed step [s]
} Pressed;

// `firm`: contact stiff enough for the ball to be where its pose is, the same at every n. The usual
// one is chosen so that it costs no time step, and gives way by a good part of a cell.
static VoxelWorldOptions press_options(const PressModel *model, Precision precision, bool firm)
{
    static const FixedRegion BOTTOM = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.0499}};
    VoxelWorldOptions options = voxel_world_cube(model->n);
    options.body.body.levels = model->levels;
    options.body.body.precision = precision;
    fix_within(&options.body.body, &BOTTOM);
    if (firm) {
        double stiffer = 40.0 * 32.0 / model->n;
        options.body.body.contact_ratio *= stiffer;
        options.body.body.contact_damping /= stiffer;
        options.body.body.friction = 0.0; // what is left at rest does not depend on the way there
    }
    options.rate_hz = 500.0;
    options.tool[options.tool_count++] = (ToolOptions){.id = 1,
                                                       .kind = TOOL_PROBE,
                                                       .capsule_count = 1,
                                                       .capsule = {{.radius = RADIUS}},
                                                       .max_force = 100.0}; // does not give way
    return options;
}

static void create(Pressed *pressed, const PressModel *model, Precision precision, bool firm)
{
    VoxelWorldOptions options = press_options(model, precision, firm);
    *pressed = (Pressed){.model = model};
    voxel_world_create(&pressed->world, &options);
    sim_set_lockstep(pressed->world.sim, true);
    layout_create(&pressed->layout, &pressed->world.lattice, model->levels);
    pressed->elements = pressed->layout.leaf_count;
    pressed->steps = pressed->world.body->substeps;
    int side = model->n + 1;
    pressed->points = side * side * side;
    pressed->vertex = zeroed((size_t)pressed->points, sizeof *pressed->vertex);
    for (int p = 0; p < pressed->points; p++)
        pressed->vertex[p] = -1;
    for (int v = 0; v < pressed->world.count; v++)
        pressed->vertex[pressed->world.id[v]] = v;
}

static void destroy(Pressed *pressed)
{
    layout_destroy(&pressed->layout);
    free(pressed->vertex);
    voxel_world_destroy(&pressed->world);
}

static void lower(Pressed *pressed, double depth)
{
    ToolPose pose = {.position = {0.0, 0.0, 0.5 * EDGE + RADIUS - depth},
                     .orientation = {1.0, 0.0, 0.0, 0.0},
                     .active = true};
    sim_apply_pose(pressed->world.sim, 0, &pose, true);
}

static double kinetic(const Pressed *pressed)
{
    BodyMeasure measure;
    pressed->world.body->ops->measure(pressed->world.body->model, &measure);
    return measure.kinetic;
}

// The tool comes down in 0.1 s.
static void press(Pressed *pressed)
{
    long ticks = lround(0.1 / sim_tick(pressed->world.sim));
    for (long k = 1; k <= ticks; k++) {
        lower(pressed, DEPTH * (double)k / (double)ticks);
        sim_step(pressed->world.sim);
    }
}

// To rest: whenever the kinetic energy has passed a maximum all velocities are taken away (dynamic
// relaxation; Cundall 1976).
static void relax(Pressed *pressed)
{
    VoxelWorld *world = &pressed->world;
    FREED Vec3 *still = zeroed((size_t)world->count, sizeof *still);
    double before = 0.0;
    // At 1e-14 J a vertex moves by less than 1e-4 m/s.
    for (int tick = 0, quiet = 0; tick < 1000 && quiet < 20; tick++) {
        sim_step(world->sim);
        double now = kinetic(pressed);
        quiet = now < 1e-14 ? quiet + 1 : 0;
        if (now < before) {
            voxel_world_read(world);
            voxel_world_write(world, world->x, still);
            now = 0.0;
        }
        before = now;
    }
    voxel_world_read(world);
    for (int v = 0; v < world->count; v++)
        pressed->speed = fmax(pressed->speed, vec3_length(world->v[v]));
    pressed->force = sim_wrench(world->sim, 0)->force.z;
    pressed->depth = sim_wrench(world->sim, 0)->depth;
    ASSERT(sim_resets(world->sim) == 0);
}

// ---------------------------------------------------------------------------------------------
// Shapes

static int vertex_at(const Pressed *pressed, int i, int j, int k)
{
    int side = pressed->model->n + 1;
    return pressed->vertex[(k * side + j) * side + i];
}

static bool is_surface(int n, int i, int j, int k)
{
    return i == 0 || j == 0 || k == 0 || i == n || j == n || k == n;
}

static Vec3 displacement(const Pressed *pressed, int i, int j, int k)
{
    int v = vertex_at(pressed, i, j, k);
    ASSERT(v >= 0);
    return vec3_sub(pressed->world.x[v], lattice_point(&pressed->world.lattice, i, j, k));
}

typedef struct Difference {
    double relative; // root of sum |u - reference|^2 / sum |reference|^2
    double worst;    // largest |u - reference| [m]
} Difference;

// Of the surface points that both have.
static Difference surface_difference(const Pressed *pressed, const Pressed *reference)
{
    Difference out = {0.0, 0.0};
    double square = 0.0, all = 0.0;
    int n = pressed->model->n, ratio = reference->model->n / n;
    for (int k = 0; k <= n; k++)
        for (int j = 0; j <= n; j++)
            for (int i = 0; i <= n; i++) {
                if (!is_surface(n, i, j, k))
                    continue;
                Vec3 u = displacement(reference, i * ratio, j * ratio, k * ratio);
                Vec3 d = vec3_sub(displacement(pressed, i, j, k), u);
                square += vec3_dot(d, d);
                all += vec3_dot(u, u);
                out.worst = fmax(out.worst, vec3_length(d));
            }
    out.relative = sqrt(square / all);
    return out;
}

static void write_point(const Pressed *pressed, int i, int k, FILE *out)
{
    Vec3 x = pressed->world.x[vertex_at(pressed, i, pressed->model->n / 2, k)];
    fprintf(out, "%.4f\t%.4f\n", 1e3 * x.x, 1e3 * x.z);
}

// Around a square of the middle plane, from vertex to vertex, back to its first.
static void write_square(const Pressed *pressed, int i, int k, int size, FILE *out)
{
    static const int WAY[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    int at[2] = {i, k};
    for (int side = 0; side < 4; side++)
        for (int step = 0; step < size; step++) {
            if (vertex_at(pressed, at[0], pressed->model->n / 2, at[1]) >= 0)
                write_point(pressed, at[0], at[1], out);
            at[0] += WAY[side][0], at[1] += WAY[side][1];
        }
    write_point(pressed, i, k, out);
    fprintf(out, "\n");
}

// The elements behind the middle plane, level by level, then the outline.
static void write_slice(const Experiment *experiment, const char *name, const Pressed *pressed)
{
    CLOSED FILE *out = experiment_open(experiment, name);
    for (int level = 0; level <= 3; level++) {
        for (int l = 0; l < pressed->layout.leaf_count; l++) {
            const Leaf *leaf = &pressed->layout.leaf[l];
            if (leaf->level == level && leaf->cell[1] == pressed->model->n / 2)
                write_square(pressed, leaf->cell[0], leaf->cell[2], 1 << level, out);
        }
        fprintf(out, "%s", "1000\t1000\n\n\n");
    }
    write_square(pressed, 0, 0, pressed->model->n, out);
}

// ---------------------------------------------------------------------------------------------
// Times

// Pressed cubes in single precision, all models taking turns.
static void measure_times(const Experiment *experiment, Pressed *pressed)
{
    static Pressed timed[PRESSED_MODELS];
    for (int m = 0; m < PRESSED_MODELS; m++) {
        create(&timed[m], &MODELS[m], PRECISION_SINGLE, false);
        press(&timed[m]);
    }
    for (int round = 0; round < 20 * experiment->repeats; round++)
        for (int m = 0; m < PRESSED_MODELS; m++) {
            Sim *sim = timed[m].world.sim;
            int ticks = 30000 / timed[m].elements / timed[m].steps + 1;
            int64_t begin = clock_thread_ns();
            for (int k = 0; k < ticks; k++)
                sim_step(sim);
            double steps = 1e3 * ticks * timed[m].steps;
            keep_least(&pressed[m].step_us, (double)(clock_thread_ns() - begin) / steps);
        }
    for (int m = 0; m < PRESSED_MODELS; m++) {
        // The mean of 2 s, in which the cube swings on.
        enum { TICKS = 1000 };
        for (int tick = 0; tick < TICKS; tick++) {
            sim_step(timed[m].world.sim);
            pressed[m].usual_force += sim_wrench(timed[m].world.sim, 0)->force.z / TICKS;
            pressed[m].usual_depth += sim_wrench(timed[m].world.sim, 0)->depth / TICKS;
        }
        pressed[m].h = timed[m].world.body->h;
        destroy(&timed[m]);
    }
}

static void write_frames(const Experiment *experiment, const Pressed *pressed)
{
    CLOSED FILE *out = experiment_open(experiment, "press-frames.tsv");
    fprintf(out, "model\telements\tof the full model [%%]\ttime of a step, of the full model "
                 "[%%]\tsteps in 1/30 s\tsimulated time in them [s]\n");
    for (int m = 0; m < PRESSED_MODELS; m++) {
        const Pressed *p = &pressed[m], *full = &pressed[FULL];
        if (p->model->n != full->model->n)
            continue;
        double steps = 1e6 / 30.0 / p->step_us;
        fprintf(out, "%s\t%d\t%.1f\t%.1f\t%.0f\t%.3f\n", p->model->name, p->elements,
                100.0 * p->elements / full->elements, 100.0 * p->step_us / full->step_us, steps,
                steps * p->h);
    }
}

void press_test(const Experiment *experiment)
{
    static Pressed pressed[PRESSED_MODELS];
    for (int m = 0; m < PRESSED_MODELS; m++) {
        create(&pressed[m], &MODELS[m], PRECISION_DOUBLE, true);
        press(&pressed[m]);
        relax(&pressed[m]);
    }
    measure_times(experiment, pressed);
    FILE *out = experiment_open(experiment, "press.tsv");
    fprintf(out, "model\telements\tvertices\tsurface differs [%%]\tmost, of the depth "
                 "[%%]\tforce [N]\tball in the faces [mm]\tleft at rest [m/s]\tstep "
                 "[us]\tspeed-up\tusual contact: force [N]\tball in the faces [mm]\n");
    for (int m = 0; m < PRESSED_MODELS; m++) {
        const Pressed *p = &pressed[m];
        Difference d = surface_difference(p, &pressed[FULL]);
        fprintf(out, "%s\t%d\t%d\t", p->model->name, p->elements, p->world.count);
        if (m == FULL)
            fprintf(out, "-\t-");
        else
            fprintf(out, "%.2f\t%.2f", 100.0 * d.relative, 100.0 * d.worst / DEPTH);
        fprintf(out, "\t%.3f\t%.2f\t%.0e\t%.0f\t%.2f\t%.2f\t%.1f\n", p->force, 1e3 * p->depth,
                p->speed, p->step_us, pressed[FULL].step_us / p->step_us, p->usual_force,
                1e3 * p->usual_depth);
    }
    fclose(out);
    write_frames(experiment, pressed);
    write_slice(experiment, "press-full.dat", &pressed[FULL]);
    write_slice(experiment, "press-graded.dat", &pressed[SHOWN]);
    for (int m = 0; m < PRESSED_MODELS; m++)
        destroy(&pressed[m]);
}
