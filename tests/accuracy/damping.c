// SPDX-License-Identifier: MIT
// Eq 10: shape springs that damp the whole velocity of a node against those that damp its part
// along the spring, as printed: what is left of a motion's energy after it was let go.
#include "accuracy.h"
#include "scoped.h"

#include <math.h>

enum { DIRECTIONS = 2, TIMES = 3 };
static const double TIME[TIMES] = {0.1, 0.5, 2.0}; // [s] after the release
static const double FREQUENCY = 50.0;              // of the scene's shape springs [rad/s]

static double energy_of(const Body *body)
{
    BodyMeasure measure;
    body->ops->measure(body->model, &measure);
    return measure.kinetic + measure.elastic;
}

// Runs a scene whose loads end at `release` [s] and prints a line of shares of the energy then.
static void follow(const Scene *scene, const char *motion, double release, FILE *out)
{
    static const char *const NAMES[DIRECTIONS] = {"all", "radial"};
    for (int d = 0; d < DIRECTIONS; d++) {
        SceneBody body = scene->body[0];
        Scene changed = *scene;
        body.surface.shape.direction = d == 0 ? SHAPE_DAMPS_ALL : SHAPE_DAMPS_RADIAL;
        changed.body = &body;
        SCOPED(world_destroy) World world;
        run_build(&changed, &MODEL_COARSE, &world);
        const int64_t begin = llround(release * scene->sim.rate_hz);
        while (sim_steps(world.sim) < begin)
            run_step(&world);
        const double at_release = energy_of(sim_body(world.sim, 0));
        fprintf(out, "%s\t%s", motion, NAMES[d]);
        for (int t = 0; t < TIMES; t++) {
            while (sim_steps(world.sim) < begin + llround(TIME[t] * scene->sim.rate_hz))
                run_step(&world);
            fprintf(out, "\t%.3g", 100.0 * energy_of(sim_body(world.sim, 0)) / at_release);
        }
        fprintf(out, "\n");
    }
}

// The whole sphere, held by nothing but its shape springs, is drawn aside by `away` [m] and let go,
// or set on a circle about its place by a blow across.
static void swing(const Scene *scene, bool circle, double away, FILE *out)
{
    const double area = 4.0 * acos(-1.0) * 0.05 * 0.05, drawn = 2.0; // [m2], [s]
    const double mass = scene->body[0].surface.material.areal_density * area;
    SceneBody body = scene->body[0];
    SceneLoad load[2] = {scene->load[0], scene->load[0]};
    LoadOptions *draw = &load[0].load, *blow = &load[1].load;
    Scene changed = *scene;
    changed.sim.rate_hz = 1000.0; // a blow of one tick
    changed.load = load;
    changed.load_count = circle ? 2 : 1;
    body.options.fixed_count = 0;
    changed.body = &body;
    draw->center = blow->center = vec3(0.0, 0.0, 0.0);
    draw->radius = blow->radius = 1.0;
    draw->force = vec3(mass * FREQUENCY * FREQUENCY * away, 0.0, 0.0);
    draw->duration = drawn;
    blow->force = vec3(0.0, mass * FREQUENCY * away * changed.sim.rate_hz, 0.0);
    blow->start = drawn;
    blow->duration = 1.0 / changed.sim.rate_hz;
    follow(&changed, circle ? "circles about its place" : "swings through its place",
           drawn + (circle ? blow->duration : 0.0), out);
}

void damping_of_shape_springs(const Experiment *experiment)
{
    CLOSED FILE *out = experiment_open(experiment, "eq10.tsv");
    fprintf(out, "motion\tdamped\tenergy left after 0.1 s [%%]\t0.5 s [%%]\t2 s [%%]\n");
    for (int f = 0; f < 2; f++) {
        SCOPED(scene_destroy) Scene scene;
        run_read(experiment->scenes, "collapse", &scene);
        scene_scale_loads(&scene, f == 0 ? 1.0 : 4.0);
        follow(&scene, f == 0 ? "pressed by 1 N" : "pressed by 4 N", 2.0, out);
    }
    for (int circle = 0; circle < 2; circle++) {
        SCOPED(scene_destroy) Scene scene;
        run_read(experiment->scenes, "collapse", &scene);
        swing(&scene, circle == 1, 0.01, out);
    }
}
