// SPDX-License-Identifier: MIT
// Fig. 8: what is left of a press 2 s after its end, with shape springs of several stiffnesses.
#include "accuracy.h"
#include "scoped.h"

#include <math.h>

static double residual(const Scene *scene, double *pressed)
{
    SCOPED(world_destroy) World world;
    run_build(scene, &MODEL_COARSE, &world);
    const Body *body = sim_body(world.sim, 0);
    BodyMeasure measure;
    const double radius = 0.05; // of the scene's sphere [m]
    for (int tick = 0; tick < lround(4.0 * scene->sim.rate_hz); tick++) {
        run_step(&world);
        if (tick + 1 == lround(2.0 * scene->sim.rate_hz)) {
            body->ops->measure(body->model, &measure);
            *pressed = measure.max_displacement / radius;
        }
    }
    const TriMesh *mesh = &world.mesh[0];
    double sum = 0.0;
    for (int i = 0; i < mesh->node_count; i++) {
        Vec3 x;
        body->ops->read_nodes(body->model, &i, 1, &x, NULL);
        x = vec3_sub(x, mesh->position[i]);
        sum += vec3_dot(x, x);
    }
    double rms = sqrt(sum / mesh->node_count);
    return rms / radius;
}

void collapse_and_recovery(const Experiment *experiment)
{
    static const double frequencies[] = {0.0, 10.0, 20.0, 50.0};
    static const double measured[][2] = {{2.2, 0.96}, {0.39, 0.34}, {0.018, 0.20}, {0.0, 0.0}};
    CLOSED FILE *out = experiment_open(experiment, "fig8.tsv");
    fprintf(out, "shape springs [rad/s]\tforce [N]\tlargest displacement when released / R\t"
                 "rms left after 2 s / R\tprototype\n");
    for (int w = 0; w < 4; w++)
        for (int f = 0; f < 2; f++) {
            SCOPED(scene_destroy) Scene scene;
            run_read(experiment->scenes, "collapse", &scene);
            scene.body[0].surface.shape.wanted = frequencies[w] > 0.0;
            scene.body[0].surface.shape.angular_frequency = frequencies[w];
            double force = f == 0 ? 1.0 : 4.0, pressed = 0.0;
            scene_scale_loads(&scene, force);
            double left = residual(&scene, &pressed);
            fprintf(out, "%g\t%g\t%.2f\t%.2g\t%.2g\n", frequencies[w], force, pressed, left,
                    measured[w][f]);
        }
}
