// SPDX-License-Identifier: MIT
// A solid organ from a label volume (config/organ-volume.cfg): its elements, its surface at rest
// and pressed, the time of a step, and what its stiff inclusion does.
#include "voxel_accuracy.h"

#include "base/check.h"
#include "base/clock.h"
#include "scene/build_parts.h"
#include "scene/build.h"
#include "picture.h"
#include "scoped.h"
#include "voxel/layout.h"
#include "voxel/model.h"

#include <math.h>
#include <stdlib.h>

static const double DEPTH = 0.015; // pressed in [m]
static const double FIRM = 1e5;    // see organ_create [Pa]

// The tip of the probe, which comes along +y, from the front, over the inclusion at
// (-0.05, -0.01, 0.008); beside it the wall is as thick, without it.
static const double TIP_X = -0.05, TIP_Z = 0.008;

static void need(bool good, const Status *status)
{
    if (!good) {
        fprintf(stderr, "pliant-voxel-accuracy: %s\n", status->text);
        exit(1);
    }
}

typedef struct Organ {
    Scene scene;
    World world;
    Body *body;
    int count;      // published nodes
    Vec3 *x, *rest; // [count]
    double front;   // y of the wall before the probe [m]
} Organ;

static void read_positions(const Organ *organ, Vec3 *x)
{
    for (int i = 0; i < organ->count; i++)
        organ->body->ops->read_nodes(organ->body->model, &i, 1, &x[i], NULL);
}

// stiffness: E of the inclusion [Pa]; 0: as the scene has it. levels -1: likewise.
static void organ_create(Organ *organ, const char *path, double stiffness, int levels)
{
    Status status = {0};
    const BuildOptions options = {.isa = "auto"};
    *organ = (Organ){.front = 1.0};
    need(scene_read(path, &organ->scene, &status), &status);
    SceneBody *body = &organ->scene.body[0];
    // Firm enough for the probe to be where its pose is, and alike: the usual contact is as firm as
    // the stiffest of a body's materials asks for.
    double stiffest = stiffness > 0.0 ? stiffness : body->material[1].youngs_modulus;
    body->voxel.body.contact_ratio *= FIRM / stiffest;
    body->voxel.body.contact_damping *= stiffest / FIRM;
    if (stiffness > 0.0)
        body->material[1].youngs_modulus = stiffness;
    if (levels >= 0)
        body->voxel.body.levels = levels;
    need(world_build(&organ->world, &organ->scene, &options, &status), &status);
    sim_set_lockstep(organ->world.sim, true);
    organ->body = sim_body(organ->world.sim, 0);
    organ->count = organ->body->mesh.node_count;
    organ->x = zeroed((size_t)organ->count, sizeof *organ->x);
    organ->rest = zeroed((size_t)organ->count, sizeof *organ->rest);
    read_positions(organ, organ->rest);
    for (int i = 0; i < organ->count; i++) {
        Vec3 p = organ->rest[i];
        if (hypot(p.x - TIP_X, p.z - TIP_Z) < 0.006)
            organ->front = fmin(organ->front, p.y);
    }
}

static void organ_destroy(Organ *organ)
{
    free(organ->x);
    free(organ->rest);
    world_destroy(&organ->world);
    scene_destroy(&organ->scene);
}

// The tool's force along its way over the last 0.2 s of a press that is held [N].
typedef struct Held {
    double mean, least, most;
} Held;

// Lowered in 0.3 s, then held for 1.2 s.
static Held organ_press(Organ *organ)
{
    Sim *sim = organ->world.sim;
    double radius = organ->scene.tool[0].capsule[0].radius;
    Held held = {.least = HUGE_VAL, .most = -HUGE_VAL};
    long ticks = lround(1.5 / sim_tick(sim)), last = lround(0.2 / sim_tick(sim));
    for (long k = 0; k < ticks; k++) {
        double depth = DEPTH * fmin(1.0, (double)k * sim_tick(sim) / 0.3);
        // Turned so that the shaft, +z of the tool, points to the front, -y.
        ToolPose pose = {.position = {TIP_X, organ->front - radius + depth, TIP_Z},
                         .orientation = {M_SQRT1_2, M_SQRT1_2, 0.0, 0.0},
                         .active = true};
        sim_apply_pose(sim, 0, &pose, true);
        sim_step(sim);
        if (k < ticks - last)
            continue;
        double force = -sim_wrench(sim, 0)->force.y;
        held.mean += force / (double)last;
        held.least = fmin(held.least, force);
        held.most = fmax(held.most, force);
    }
    ASSERT(sim_resets(sim) == 0);
    read_positions(organ, organ->x);
    return held;
}

static void time_step(Organ *organ, double *least_us, double *least_forces_us)
{
    Sim *sim = organ->world.sim;
    double steps = 1e3 * organ->body->substeps; // a tick's, short enough to be left alone
    int64_t begin = clock_thread_ns(), forces = sim_stage_ns(sim, STAGE_FORCES);
    sim_step(sim);
    keep_least(least_forces_us, (double)(sim_stage_ns(sim, STAGE_FORCES) - forces) / steps);
    keep_least(least_us, (double)(clock_thread_ns() - begin) / steps);
}

// ---------------------------------------------------------------------------------------------
// Pictures

static void draw_surface(const Experiment *experiment, const char *name, const Organ *organ,
                         const Vec3 *x)
{
    SCOPED(picture_destroy) Picture picture;
    picture_create(&picture, vec3(-0.5, -1.0, 0.3));
    const BodyMesh *mesh = &organ->body->mesh;
    for (int t = 0; t < mesh->triangle_count; t++) {
        Vec3 corner[3];
        double moved = 0.0;
        for (int c = 0; c < 3; c++) {
            int node = mesh->triangle[t][c];
            corner[c] = x[node];
            moved += vec3_length(vec3_sub(x[node], organ->rest[node])) / 3.0;
        }
        picture_add(&picture, corner, 3, colour_mix(0xe0b8a4, 0xb01818, moved / DEPTH));
    }
    CLOSED FILE *out = experiment_open(experiment, name);
    picture_write(&picture, false, out);
}

// The elements in the horizontal layer of cells that holds the inclusion's middle.
static void draw_layer(const Experiment *experiment, const Lattice *lattice, const Layout *layout)
{
    SCOPED(picture_destroy) Picture picture;
    picture_create(&picture, vec3(0.0, -1e-6, 1.0));
    double height = lattice_point(lattice, 0.0, 0.0, 0.0).z;
    int layer = (int)floor((TIP_Z - height) / lattice->size);
    for (int l = 0; l < layout->leaf_count; l++) {
        const Leaf *leaf = &layout->leaf[l];
        int size = 1 << leaf->level;
        if (layer < leaf->cell[2] || layer >= leaf->cell[2] + size)
            continue;
        int i = leaf->cell[0], j = leaf->cell[1];
        Vec3 corner[4] = {lattice_point(lattice, i, j, 0.0),
                          lattice_point(lattice, i + size, j, 0.0),
                          lattice_point(lattice, i + size, j + size, 0.0),
                          lattice_point(lattice, i, j + size, 0.0)};
        unsigned colour = LEVEL_COLOUR[leaf->level];
        if (leaf->material > 1)
            colour = colour_mix(colour, 0x2a8a3a, 0.65);
        picture_add(&picture, corner, 4, colour);
    }
    CLOSED FILE *out = experiment_open(experiment, "organ-layer.gp");
    picture_write(&picture, true, out);
}

// ---------------------------------------------------------------------------------------------

static void write_layout(const Experiment *experiment, const Organ *organ)
{
    Status status = {0};
    SCOPED(lattice_destroy) Lattice lattice;
    Layout layout;
    need(body_voxels_make(&organ->scene.body[0].voxels, &lattice, &status), &status);
    CLOSED FILE *out = experiment_open(experiment, "organ-layout.tsv");
    fprintf(out,
            "levels\tcells\telements\tlevel 0\t1\t2\t3\tof them stiff\telements of cells [%%]\n");
    for (int levels = 0; levels <= 3; levels++) {
        layout_create(&layout, &lattice, levels);
        int count[4] = {0}, stiff = 0;
        for (int l = 0; l < layout.leaf_count; l++) {
            count[layout.leaf[l].level]++;
            stiff += layout.leaf[l].material > 1;
        }
        long solid = lattice_solid(&lattice);
        fprintf(out, "%d\t%ld\t%d\t%d\t%d\t%d\t%d\t%d\t%.1f\n", levels, solid, layout.leaf_count,
                count[0], count[1], count[2], count[3], stiff,
                100.0 * layout.leaf_count / (double)solid);
        if (levels == organ->scene.body[0].voxel.body.levels)
            draw_layer(experiment, &lattice, &layout);
        layout_destroy(&layout);
    }
}

void organ(const Experiment *experiment)
{
    enum { GRADED, EVEN, FULL, ORGANS };
    static const char *const NAMES[ORGANS] = {"as the scene has it",
                                              "inclusion as soft as the rest",
                                              "as the scene has it, every cell an element"};
    static Organ organs[ORGANS];
    char path[4096];
    Held force[ORGANS];
    double step_us[ORGANS] = {0.0}, forces_us[ORGANS] = {0.0};
    snprintf(path, sizeof path, "%s/../../../config/organ-volume.cfg", experiment->scenes);
    for (int o = 0; o < ORGANS; o++) {
        organ_create(&organs[o], path, o == EVEN ? 5000.0 : 0.0, o == FULL ? 0 : -1);
        force[o] = organ_press(&organs[o]);
    }
    for (int round = 0; round < 40 * experiment->repeats; round++)
        for (int o = 0; o < ORGANS; o++)
            time_step(&organs[o], &step_us[o], &forces_us[o]);
    FILE *out = experiment_open(experiment, "organ.tsv");
    fprintf(
        out,
        "liver\telements\tforce at %g mm, mean of 0.2 s [N]\tfrom\tto\tlargest displacement "
        "[mm]\tbatches, plain\twith "
        "hanging vertices\tstep [us]\tof it forces and update [us]\tthe time it stands for [us]\n",
        1e3 * DEPTH);
    for (int o = 0; o < ORGANS; o++) {
        double most = 0.0;
        for (int i = 0; i < organs[o].count; i++)
            most = fmax(most, vec3_length(vec3_sub(organs[o].x[i], organs[o].rest[i])));
        const VoxelModel *model = organs[o].body->model;
        fprintf(out, "%s\t%d\t%.3f\t%.3f\t%.3f\t%.1f\t%d\t%d\t%.0f\t%.0f\t%.0f\n", NAMES[o],
                organs[o].body->element_count, force[o].mean, force[o].least, force[o].most,
                1e3 * most, model->batches->plain.batch_count, model->batches->hanging.batch_count,
                step_us[o], forces_us[o], 1e6 * organs[o].body->h);
    }
    fclose(out);
    write_layout(experiment, &organs[GRADED]);
    draw_surface(experiment, "organ-rest.gp", &organs[GRADED], organs[GRADED].rest);
    draw_surface(experiment, "organ-pressed.gp", &organs[GRADED], organs[GRADED].x);
    for (int o = 0; o < ORGANS; o++)
        organ_destroy(&organs[o]);
}
