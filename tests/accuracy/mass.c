// SPDX-License-Identifier: MIT
// Fig. 6 and Table 1's counts: what a refined patch adds, and what becomes of the total mass.
#include "accuracy.h"
#include "patch.h"
#include "scoped.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>

typedef struct MeshCase {
    const char *name, *scene;
} MeshCase;
static const MeshCase MESHES[] = {
    {"sphere", "sphere"}, {"stomach", "stomach"}, {"sheet", "fabric"}};
static const Model ADAPTIVE_3 = {"adaptive 3", MODEL_ADAPTIVE, 3};

static void open_world(const Experiment *experiment, const char *name, SurfaceAdjust rule,
                       const Model *model, Scene *scene, World *world)
{
    run_read(experiment->scenes, name, scene);
    scene->body[0].surface.adjust = rule;
    scene->body[0].options.fixed_count = 0; // every node counts
    run_build(scene, model, world);
}

static void close_world(Scene *scene, World *world)
{
    world_destroy(world);
    scene_destroy(scene);
}

// Eq 7's example: a node with five faces, two neighbouring ones of which are refined.
static void mixed_node(const Experiment *experiment)
{
    Scene scene;
    World world;
    open_world(experiment, "sphere", ADJUST_CHOI2005, &MODEL_ADAPTIVE_1, &scene, &world);
    const Detail *detail = patch_detail(&world);
    SurfaceModel *model = patch_body(&world)->model;
    int node = 0;
    while (patch_valence(&world, node) != 5)
        node++;
    patch_refine_two_faces(&world, node);
    const double *mass = detail->rules.mass;
    FILE *out = experiment_open(experiment, "fig6.tsv");
    fprintf(out, "what\tmass [g]\n");
    fprintf(out, "node of level 0, eq 6\t%.9f\n", 1e3 * mass[0]);
    fprintf(out, "node of level 1, eq 6\t%.9f\n", 1e3 * mass[1]);
    fprintf(out, "two edges of level 0, three of level 1: (2 m0 + 3 m1) / 5\t%.9f\n",
            1e3 * (2.0 * mass[0] + 3.0 * mass[1]) / 5.0);
    fprintf(out, "the same node in the running body\t%.9f\n", 1e3 * detail_mass(model, node));
    fclose(out);
    close_world(&scene, &world);
}

static double drift(World *world, double whole)
{
    return fabs(patch_body(world)->mass / whole - 1.0);
}

// Worst over all one-rings refined to a level.
static double worst_ring(World *world, int level)
{
    double worst = 0.0, whole = patch_body(world)->mass;
    for (int i = 0; i < patch_node_count(world); i++) {
        patch_refine_around(world, &i, 1, level);
        worst = fmax(worst, drift(world, whole));
        patch_clear(world);
    }
    return worst;
}

typedef struct Near {
    double distance;
    int node;
} Near;

static int nearer(const void *a, const void *b)
{
    double x = ((const Near *)a)->distance, y = ((const Near *)b)->distance;
    return (x > y) - (x < y);
}

// Worst over patches of a tenth to three quarters of the nodes, those nearest to a seed.
static double worst_patch(World *world)
{
    double worst = 0.0, whole = patch_body(world)->mass;
    const int nodes = patch_node_count(world);
    const Vec3 *rest = patch_detail(world)->set.levels.position;
    FREED Near *near = zeroed((size_t)nodes, sizeof *near);
    FREED int *chosen = zeroed((size_t)nodes, sizeof *chosen);
    for (int seed = 0; seed < nodes; seed += 4) {
        for (int i = 0; i < nodes; i++)
            near[i] = (Near){vec3_length(vec3_sub(rest[i], rest[seed])), i};
        qsort(near, (size_t)nodes, sizeof *near, nearer);
        for (int i = 0; i < nodes; i++)
            chosen[i] = near[i].node;
        static const double shares[] = {0.1, 0.25, 0.5, 0.75};
        for (int k = 0; k < 4; k++) {
            patch_refine_around(world, chosen, (int)(shares[k] * nodes), 1);
            worst = fmax(worst, drift(world, whole));
            patch_clear(world);
        }
    }
    return worst;
}

static void mass_drift(const Experiment *experiment)
{
    CLOSED FILE *out = experiment_open(experiment, "mass.tsv");
    fprintf(out, "mesh\trule\tone ring to level 1 [%%]\tto level 2 [%%]\tto level 3 [%%]\t"
                 "patches of 10 to 75 %% of the nodes [%%]\n");
    for (int m = 0; m < 3; m++)
        for (int r = 0; r < 2; r++) {
            SurfaceAdjust rule = r == 0 ? ADJUST_CHOI2005 : ADJUST_CONTINUUM;
            Scene scene;
            World world;
            open_world(experiment, MESHES[m].scene, rule, &ADAPTIVE_3, &scene, &world);
            fprintf(out, "%s\t%s", MESHES[m].name, rule_name(rule));
            for (int level = 1; level <= 3; level++)
                fprintf(out, "\t%.2g", 100.0 * worst_ring(&world, level));
            fprintf(out, "\t%.2g\n", 100.0 * worst_patch(&world));
            close_world(&scene, &world);
        }
}

static void counts(const Experiment *experiment)
{
    CLOSED FILE *out = experiment_open(experiment, "counts.tsv");
    fprintf(out,
            "mesh\trule\tcoarse\tlevel 1\tlevel 2\tpatch around two neighbours of valence 6\n");
    for (int m = 0; m < 2; m++)
        for (int r = 0; r < 2; r++) {
            static const Model *const held[] = {&MODEL_COARSE, &MODEL_REFINED_1, &MODEL_REFINED_2};
            SurfaceAdjust rule = r == 0 ? ADJUST_CHOI2005 : ADJUST_CONTINUUM;
            Scene scene;
            World world;
            fprintf(out, "%s\t%s", MESHES[m].name, rule_name(rule));
            for (int k = 0; k < 3; k++) {
                open_world(experiment, MESHES[m].scene, rule, held[k], &scene, &world);
                const Body *body = sim_body(world.sim, 0);
                fprintf(out, "\t%d / %d", body->mesh.node_count, body->spring_count);
                close_world(&scene, &world);
            }
            open_world(experiment, MESHES[m].scene, rule, &MODEL_ADAPTIVE_1, &scene, &world);
            int pair[2], springs = patch_body(&world)->spring_count;
            ASSERT(patch_find_pair(&world, pair));
            patch_refine_around(&world, pair, 2, 1);
            fprintf(out, "\t%+d / %+d\n",
                    patch_detail(&world)->pack.on_count - patch_node_count(&world),
                    patch_body(&world)->spring_count - springs);
            close_world(&scene, &world);
        }
}

void masses_and_counts(const Experiment *experiment)
{
    mixed_node(experiment);
    mass_drift(experiment);
    counts(experiment);
}
