// SPDX-License-Identifier: MIT
// A real beam (scenes/beam.cfg) against its measurement: stiffness and damping fitted on the run
// under gravity alone, then the run with a weight predicted.
#include "voxel_accuracy.h"

#include "extreme.h"
#include "scoped.h"

#include "base/check.h"
#include "scene/build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MARKERS = 3, TICKS = 3000, MOST_PEAKS = 64 };

// Where the markers were before the release, from the middle of the free end [m], and how far they
// had dropped at rest [m].
typedef struct Measured {
    const char *name;
    double mass; // that hung on the end [kg]
    Vec3 marker[MARKERS];
    double drop[MARKERS];
    // Of their mean: at rest and in the first swing [m], period [s], logarithmic decrement.
    double rest, swing, period, decrement;
} Measured;

// Dubied, Michelis, Spielberg, Katzschmann 2022 (arXiv 2201.12560), srl-ethz/diffPD_sim2real,
// realbeam_experiments/Measurement_data, MIT licence, copyright 2021 Soft Robotics Lab, ETH Zurich.
// Repeats of one case differ by 1 to 4 %, noise is 0.02 mm.
static const Measured RUNS[] = {
    {"gravity alone",
     0.0,
     {{0.0004, 0.0201, 0.0}, {0.0208, 0.0088, 0.0005}, {-0.0209, -0.0088, -0.0042}},
     {6.63e-3, 6.52e-3, 6.20e-3},
     6.45e-3,
     10.1e-3,
     0.130,
     0.333},
    {"with 0.510 N",
     0.052,
     {{0.0004, 0.0201, 0.0}, {0.0211, 0.0091, -0.0003}, {-0.0202, -0.0097, -0.0014}},
     {17.45e-3, 17.30e-3, 15.95e-3},
     16.9e-3,
     24.7e-3,
     0.231,
     0.370},
};
enum { GRAVITY_RUN, WEIGHT_RUN, RUN_COUNT };

// What a beam is made of.
typedef struct Beam {
    bool fine;             // cells of half the scene's edge
    double youngs_modulus; // instead of the scene's, if positive [Pa]
    double damping;        // over that of the scene
    double drag;           // instead of the scene's, if positive [1/s]
} Beam;

typedef struct Result {
    double drop[MARKERS], rest, swing, period, decrement; // as in Measured
    double curve[TICKS]; // drop of the markers' mean after each tick [m]
    int count;
} Result;

static void need(bool good, const Status *status)
{
    if (good)
        return;
    fprintf(stderr, "pliant-voxel-accuracy: %s\n", status->text);
    exit(1);
}

static void build(const Experiment *experiment, const Beam *beam, double mass, Scene *scene,
                  World *world)
{
    char path[512];
    Status status = {0};
    const BuildOptions options = {.isa = "auto"};
    snprintf(path, sizeof path, "%s/beam.cfg", experiment->scenes);
    need(scene_read(path, scene, &status), &status);
    SceneBody *body = &scene->body[0];
    body->weight[0].mass = mass;
    if (beam->youngs_modulus > 0.0)
        body->material[0].youngs_modulus = beam->youngs_modulus;
    body->voxel.branch[0].share *= beam->damping;
    body->voxel.drag = beam->drag > 0.0 ? beam->drag : beam->damping * body->voxel.drag;
    if (beam->fine) {
        body->voxels.size *= 0.5;
        for (int c = 0; c < 3; c++)
            body->voxels.count[c] *= 2;
    }
    need(world_build(world, scene, &options, &status), &status);
}

// The vertices of the free end, at rest and now.
typedef struct End {
    int count;
    int *vertex;
    Vec3 *rest, *now;
    Vec3 middle; // at rest
} End;

static void end_create(End *end, const Body *body)
{
    const int most = body->surface.node_count;
    end->vertex = zeroed((size_t)most, sizeof *end->vertex);
    end->rest = zeroed((size_t)most, sizeof *end->rest);
    end->now = zeroed((size_t)most, sizeof *end->now);
    double farthest = -1.0;
    for (int pass = 0; pass < 2; pass++)
        for (int v = 0; v < most; v++) {
            Vec3 x;
            body->ops->read_nodes(body->model, &v, 1, &x, NULL);
            if (pass == 0) {
                farthest = fmax(farthest, x.z);
            } else if (x.z > farthest - 1e-6) {
                end->vertex[end->count] = v;
                end->rest[end->count++] = x;
            }
        }
    for (int i = 0; i < end->count; i++)
        end->middle = vec3_madd(end->middle, 1.0 / end->count, end->rest[i]);
}

static void end_destroy(End *end)
{
    free(end->vertex);
    free(end->rest);
    free(end->now);
}

// Finds where markers are that stand on the free end: its axes are the mean directions of what was
// along x and y.
static void find_markers(End *end, const Body *body, const Vec3 marker[MARKERS],
                         double drop[MARKERS])
{
    body->ops->read_nodes(body->model, end->vertex, end->count, end->now, NULL);
    Vec3 middle = {0, 0, 0}, across = {0, 0, 0}, up = {0, 0, 0};
    for (int i = 0; i < end->count; i++) {
        const Vec3 arm = vec3_sub(end->rest[i], end->middle);
        middle = vec3_madd(middle, 1.0 / end->count, end->now[i]);
        across = vec3_madd(across, arm.x, end->now[i]);
        up = vec3_madd(up, arm.y, end->now[i]);
    }
    across = vec3_unit(across);
    up = vec3_unit(vec3_madd(up, -vec3_dot(up, across), across));
    const Vec3 out = vec3_cross(across, up);
    for (int m = 0; m < MARKERS; m++) {
        Vec3 at = middle;
        at = vec3_madd(at, marker[m].x, across);
        at = vec3_madd(at, marker[m].y, up);
        at = vec3_madd(at, marker[m].z, out);
        drop[m] = end->middle.y + marker[m].y - at.y;
    }
}

// Finds period and decrement from the extremes about the rest: a mean over half swings, of what
// lies between two extremes.
static void find_swing(Result *result)
{
    double at[MOST_PEAKS], size[MOST_PEAKS];
    int found = 0;
    result->swing = 0.0;
    for (int i = 1; i + 1 < result->count && found < MOST_PEAKS; i++) {
        double place, value;
        result->swing = fmax(result->swing, result->curve[i]);
        if (!find_extreme(&result->curve[i - 1], &place, &value) ||
            fabs(value - result->rest) < 0.02 * result->rest)
            continue;
        at[found] = i + place;
        size[found++] = value;
    }
    // As many half swings as the measured ones.
    const int halves = found > 9 ? 8 : found - 2;
    if (halves < 2)
        return;
    result->period = 2e-3 * (at[halves] - at[0]) / halves;
    result->decrement =
        2.0 * log(fabs(size[1] - size[0]) / fabs(size[halves] - size[halves - 1])) / (halves - 1);
}

static void run(const Experiment *experiment, const Beam *beam, const Measured *measured, int ticks,
                Result *result)
{
    SCOPED(scene_destroy) Scene scene;
    SCOPED(world_destroy) World world;
    SCOPED(end_destroy) End end = {0};
    build(experiment, beam, measured->mass, &scene, &world);
    const Body *body = sim_body(world.sim, 0);
    *result = (Result){.count = ticks};
    end_create(&end, body);
    for (int i = 0; i < ticks; i++) {
        sim_step(world.sim);
        find_markers(&end, body, measured->marker, result->drop);
        result->curve[i] = (result->drop[0] + result->drop[1] + result->drop[2]) / MARKERS;
    }
    result->rest = result->curve[ticks - 1];
    find_swing(result);
}

// Fits Young's modulus on the drop at rest, then damping on the decay, without a weight.
static Beam fit(const Experiment *experiment)
{
    enum { ROUNDS = 3 }; // enough for four digits
    Beam beam = {.youngs_modulus = 2e5, .damping = 1.0};
    Result result;
    for (int round = 0; round < ROUNDS; round++) {
        Beam still = beam;
        still.drag = 80.0; // comes to rest at once
        run(experiment, &still, &RUNS[GRAVITY_RUN], 1000, &result);
        beam.youngs_modulus *= result.rest / RUNS[GRAVITY_RUN].rest;
    }
    for (int round = 0; round < ROUNDS; round++) {
        run(experiment, &beam, &RUNS[GRAVITY_RUN], TICKS, &result);
        beam.damping *= RUNS[GRAVITY_RUN].decrement / result.decrement;
    }
    return beam;
}

static void write_row(FILE *out, const char *run, const char *what, double scale, double measured,
                      double got)
{
    fprintf(out, "%s\t%s\t%.4g\t%.4g\t%+.1f\n", run, what, scale * measured, scale * got,
            100.0 * (got / measured - 1.0));
}

// Writes both runs as the scene has them: a table, and curves [s], [mm].
static void compare(const Experiment *experiment, bool fine, const char *table)
{
    char name[64];
    CLOSED FILE *out = experiment_open(experiment, table);
    fprintf(out, "run\tcells of %s mm\tmeasured\tcomputed\toff by %%\n", fine ? "2.5" : "5");
    for (int r = 0; r < RUN_COUNT; r++) {
        const Measured *measured = &RUNS[r];
        Result result;
        run(experiment, &(Beam){.fine = fine, .damping = 1.0}, measured, TICKS, &result);
        for (int m = 0; m < MARKERS; m++) {
            snprintf(name, sizeof name, "drop of marker %d at rest, mm", m + 1);
            write_row(out, measured->name, name, 1e3, measured->drop[m], result.drop[m]);
        }
        write_row(out, measured->name, "drop of their mean, mm", 1e3, measured->rest, result.rest);
        write_row(out, measured->name, "first swing, mm", 1e3, measured->swing, result.swing);
        write_row(out, measured->name, "period, s", 1.0, measured->period, result.period);
        write_row(out, measured->name, "log decrement", 1.0, measured->decrement, result.decrement);
        snprintf(name, sizeof name, "reality-%d%s.dat", r, fine ? "-fine" : "");
        CLOSED FILE *curve = experiment_open(experiment, name);
        for (int i = 0; i < TICKS; i++)
            fprintf(curve, "%g\t%.4f\n", 1e-3 * (i + 1), 1e3 * result.curve[i]);
    }
}

void real_beam(const Experiment *experiment)
{
    compare(experiment, false, "reality.tsv");
}

void real_beam_finely(const Experiment *experiment)
{
    compare(experiment, true, "reality-fine.tsv");
}

void fit_to_the_beam(const Experiment *experiment)
{
    SCOPED(scene_destroy) Scene scene;
    SCOPED(world_destroy) World world;
    build(experiment, &(Beam){.damping = 1.0}, 0.0, &scene, &world);
    const double modulus = scene.body[0].material[0].youngs_modulus,
                 share = scene.body[0].voxel.branch[0].share, drag = scene.body[0].voxel.drag;
    const Beam beam = fit(experiment);
    CLOSED FILE *out = experiment_open(experiment, "reality-fit.tsv");
    fprintf(out, "fitted to gravity alone, cells of 5 mm\tin beam.cfg\tfit\n");
    fprintf(out, "youngs_modulus, kPa\t%.4g\t%.4g\n", 1e-3 * modulus, 1e-3 * beam.youngs_modulus);
    fprintf(out, "relaxation share\t%.3g\t%.3g\n", share, share * beam.damping);
    fprintf(out, "drag, 1/s\t%.3g\t%.3g\n", drag, drag * beam.damping);
}
