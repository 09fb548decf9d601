// SPDX-License-Identifier: MIT
// Figs. 9 and 10: a sheet of fabric, coarse against wholly refined, by both rules. With shape
// springs of 50 rad/s as the other scenes have them; with 5 rad/s, so that the springs of the sheet
// carry the load; and then also pulled in its plane, where stiffness alone decides.
#include "accuracy.h"
#include "scoped.h"

#include <math.h>

typedef struct Way {
    const char *name;
    double frequency; // of the shape springs [rad/s]
    bool in_plane;
} Way;

static const Way WAYS[] = {{"pressed", 50.0, false},
                           {"pressed, soft shape springs", 5.0, false},
                           {"pulled in its plane, soft shape springs", 5.0, true}};
static const Model *const MODELS[] = {&MODEL_COARSE, &MODEL_REFINED_1, &MODEL_REFINED_2,
                                      &MODEL_ADAPTIVE_1, &MODEL_ADAPTIVE_2};
enum { WAY_COUNT = 3, MODEL_COUNT = 5 };

static double at_end(const Trace *trace)
{
    return trace->displacement[59]; // of the second of pressing, 60 ticks
}

void coarse_against_refined(const Experiment *experiment)
{
    static Trace trace[2][MODEL_COUNT];
    CLOSED FILE *table = experiment_open(experiment, "fig10.tsv");
    fprintf(table, "sheet\trule\tmodel\tdisplacement after 1 s [mm]\tagainst coarse [%%]\t"
                   "curve difference to coarse [%%]\n");
    for (int w = 0; w < WAY_COUNT; w++) {
        SCOPED(scene_destroy) Scene scene;
        run_read(experiment->scenes, "fabric", &scene);
        scene.body[0].surface.shape.angular_frequency = WAYS[w].frequency;
        if (WAYS[w].in_plane) {
            Vec3 *force = &scene.load[0].load.force;
            *force = (Vec3){vec3_length(*force), 0.0, 0.0};
        }
        for (int r = 0; r < 2; r++) {
            SurfaceAdjust rule = r == 0 ? ADJUST_CHOI2005 : ADJUST_CONTINUUM;
            scene.body[0].surface.adjust = rule;
            SCOPED(probe_destroy) Probe probe;
            probe_create(&scene, &probe);
            for (int m = 0; m < MODEL_COUNT; m++) {
                Trace *t = &trace[r][m];
                run_trace(&scene, MODELS[m], &probe, 1.5, t);
                fprintf(table, "%s\t%s\t%s\t%.2f\t%+.1f\t%.1f\n", WAYS[w].name, rule_name(rule),
                        MODELS[m]->name, 1e3 * at_end(t),
                        100.0 * (at_end(t) / at_end(&trace[r][0]) - 1.0),
                        100.0 * trace_difference(t, &trace[r][0]));
            }
        }
        char name[32];
        snprintf(name, sizeof name, "fig10-%d.dat", w);
        CLOSED FILE *curves = experiment_open(experiment, name);
        fprintf(curves, "time [s]; then by choi2005 and continuum [mm]: coarse, refined 1, refined "
                        "2, adaptive 1, adaptive 2\n");
        for (int i = 0; i < trace[0][0].count; i++) {
            fprintf(curves, "%.4f", trace[0][0].time[i]);
            for (int k = 0; k < 2 * MODEL_COUNT; k++)
                fprintf(curves, "\t%.4f",
                        1e3 * trace[k / MODEL_COUNT][k % MODEL_COUNT].displacement[i]);
            fputc('\n', curves);
        }
    }
}
