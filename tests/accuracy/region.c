// SPDX-License-Identifier: MIT
// Fig. 11: the nodes displaced beyond a threshold after 2.3 s, as coarse, refined and adaptive
// models have them.
#include "accuracy.h"
#include "scoped.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>

static const double THRESHOLD = 0.005; // [m]
static const double TIME = 2.3;        // [s]
static const Model *const MODELS[] = {&MODEL_REFINED_2, &MODEL_COARSE, &MODEL_ADAPTIVE_1,
                                      &MODEL_ADAPTIVE_2};
enum { MODEL_COUNT = 4 };

// x, y, z [mm] and whether it is displaced that far, of the nodes that the model has.
static void write_points(const Experiment *experiment, const World *world, const Levels *levels,
                         const char *name)
{
    const Body *body = sim_body(world->sim, 0);
    const BodyMesh *mesh = &body->mesh;
    size_t slots = (size_t)mesh->node_count;
    FREED Vec3 *x = zeroed(slots, sizeof *x), *v = zeroed(slots, sizeof *v);
    body->ops->read_state(body->model, NULL, x, v);
    CLOSED FILE *out = experiment_open(experiment, name);
    fprintf(out, "x [mm]\ty [mm]\tz [mm]\tdisplaced\n");
    for (int s = 0; s < mesh->node_count; s++)
        if (mesh->id[s] >= 0)
            fprintf(out, "%.2f\t%.2f\t%.2f\t%d\n", 1e3 * x[s].x, 1e3 * x[s].y, 1e3 * x[s].z,
                    vec3_length(vec3_sub(x[s], levels->position[mesh->id[s]])) > THRESHOLD);
}

static double *measure_areas(const Levels *levels)
{
    const Level *level = &levels->level[levels->finest];
    double *area = zeroed((size_t)level->node_count, sizeof *area);
    for (int f = 0; f < level->face_count; f++) {
        const int *node = level->face[f];
        Vec3 a = levels->position[node[0]];
        Vec3 normal = vec3_cross(vec3_sub(levels->position[node[1]], a),
                                 vec3_sub(levels->position[node[2]], a));
        for (int k = 0; k < 3; k++)
            area[node[k]] += vec3_length(normal) / 6.0;
    }
    return area;
}

// Weight of what both have over that of what one of them has.
static double jaccard(const Vec3 *u, const Vec3 *reference, const double *weight, int count)
{
    double both = 0.0, either = 0.0;
    for (int i = 0; i < count; i++) {
        bool a = vec3_length(u[i]) > THRESHOLD, b = vec3_length(reference[i]) > THRESHOLD;
        double w = weight != NULL ? weight[i] : 1.0;
        both += a && b ? w : 0.0;
        either += a || b ? w : 0.0;
    }
    return both / either;
}

void displaced_region(const Experiment *experiment)
{
    CLOSED FILE *out = experiment_open(experiment, "fig11.tsv");
    fprintf(out,
            "rule\tmodel\tnodes of the coarse mesh beyond 5 mm\toverlap with refined, nodes of "
            "the coarse mesh [%%]\tby area [%%]\n");
    for (int r = 0; r < 2; r++) {
        SCOPED(scene_destroy) Scene scene;
        run_read(experiment->scenes, "spread", &scene);
        SurfaceAdjust rule = r == 0 ? ADJUST_CHOI2005 : ADJUST_CONTINUUM;
        scene.body[0].surface.adjust = rule;
        SCOPED(probe_destroy) Probe probe;
        Levels levels;
        SCOPED(arena_destroy) Arena arena = {0};
        Vec3 *u[MODEL_COUNT];
        probe_create(&scene, &probe);
        bool ok = levels_create(&levels, &probe.mesh, 2, "levels", &arena, &(Status){0});
        ASSERT(ok);
        FREED double *area = measure_areas(&levels);
        for (int m = 0; m < MODEL_COUNT; m++) {
            SCOPED(world_destroy) World world;
            run_build(&scene, MODELS[m], &world);
            for (int tick = 0; tick < lround(TIME * scene.sim.rate_hz); tick++)
                run_step(&world);
            u[m] = zeroed((size_t)levels.level[levels.finest].node_count, sizeof **u);
            run_displacements(&world, &levels, u[m]);
            int coarse = levels.level[0].node_count, beyond = 0;
            for (int i = 0; i < coarse; i++)
                beyond += vec3_length(u[m][i]) > THRESHOLD;
            fprintf(out, "%s\t%s\t%d\t%.1f\t%.1f\n", rule_name(rule), MODELS[m]->name, beyond,
                    100.0 * jaccard(u[m], u[0], NULL, coarse),
                    100.0 * jaccard(u[m], u[0], area, levels.level[levels.finest].node_count));
            char name[48];
            snprintf(name, sizeof name, "fig11-%d-%d.dat", r, m);
            write_points(experiment, &world, &levels, name);
        }
        for (int m = 0; m < MODEL_COUNT; m++)
            free(u[m]);
    }
}
