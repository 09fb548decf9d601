// SPDX-License-Identifier: MIT
// pliant-adaptive-curves CONFIG [SCENE]: error against run time of solids that are pressed, with
// and without elements that follow the tool, a line for each way to run a scene, or all of them.
// CONFIG: the folder of the shipped scenes. The truth is the same body all cells of which are
// elements; what the cells themselves leave out is in errors.md.
#include "scoped.h"

#include "base/check.h"
#include "base/clock.h"
#include "base/sets.h"
#include "scene/build.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct Pressed {
    const char *name, *file;
    int cells;           // along each edge of a box, instead of the file's; 0: as it is
    double radius, rate; // [m], [Hz]; 0: those of the file
} Pressed;

static const Pressed PRESSED[] = {
    {.name = "block", .file = "block.cfg"},
    {.name = "organ-volume", .file = "organ-volume.cfg"},
    {.name = "cube", .file = "cube.cfg", .radius = 0.015},
    {.name = "cube-64", .file = "cube.cfg", .cells = 64, .radius = 0.005, .rate = 1000.0},
    {.name = "liver-fine", .file = "liver-fine.cfg"},
};

// One way to run it. The first is what others are compared with.
typedef struct Way {
    const char *name;
    int levels;
    bool adapts;
    double error; // target; 0: none
} Way;

static const Way WAYS[] = {
    {"levels 0", 0, false, 0.0},          {"levels 1", 1, false, 0.0},
    {"levels 2", 2, false, 0.0},          {"levels 3", 3, false, 0.0},
    {"adaptive 1", 1, true, 0.0},         {"adaptive 2", 2, true, 0.0},
    {"adaptive 2 to 2 %", 2, true, 0.02}, {"adaptive 2 to 5 %", 2, true, 0.05},
    {"adaptive 2 to 10 %", 2, true, 0.1}, {"adaptive 3", 3, true, 0.0},
};
enum { WAY_COUNT = sizeof WAYS / sizeof WAYS[0], TICKS_MOST = 4096 };

static const double CLEAR = 0.1, DOWN = 0.3, END = 0.8; // [s]: down from, to, and until
static const double MEAN = 0.1; // at the end, over which forces and times of ticks are taken [s]

// What a run is judged by.
typedef struct Outcome {
    int nodes;
    int *id;      // [nodes] published
    float *place; // [nodes][3] at the end [m]
    float *rest;
    Vec3 force; // mean [N]
    int elements;
    double tick, slowest;              // of the mean and of 99 of 100 ticks under contact [s]
    double estimated, estimated_force; // relative
} Outcome;

static void release(Outcome *outcome)
{
    free(outcome->id);
    free(outcome->place);
    free(outcome->rest);
}

static void change(Scene *scene, const Pressed *pressed, const Way *way)
{
    SceneBody *body = &scene->body[0];
    body->options.levels = way->levels;
    body->voxel.surface_level = way->adapts ? way->levels : 0;
    body->options.adapt_error = way->error;
    if (pressed->cells > 0) {
        body->voxels.size *= (double)body->voxels.count[0] / pressed->cells;
        for (int d = 0; d < 3; d++)
            body->voxels.count[d] = pressed->cells;
    }
    if (pressed->rate > 0.0)
        scene->sim.rate_hz = pressed->rate;
    for (int c = 0; c < scene->tool[0].capsule_count && pressed->radius > 0.0; c++)
        scene->tool[0].capsule[c].radius = pressed->radius;
    scene->tool[0].max_force = 1e3; // it goes where it is put
    scene->threads = 1;
    scene->publish.error_hz = 1.05 / (END - MEAN); // at the begin, and at the end
    scene->publish.contact_stiffness = false;
    scene->sim.error_whole = true;
}

// Returns the highest point of a body, where it is pressed.
static Vec3 find_top(const Body *body)
{
    Vec3 top = {0.0, 0.0, -HUGE_VAL}, sum = {0.0, 0.0, 0.0};
    int count = 0;
    // The middle of what is nearly as high, for boxes.
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < body->surface.node_used; i++) {
            Vec3 at;
            body->ops->read_nodes(body->model, &i, 1, &at, NULL);
            if (body->surface.node_face_end[i] == body->surface.node_face_start[i])
                continue;
            if (pass == 0 && at.z > top.z)
                top = at;
            if (pass == 1 && at.z > top.z - 1e-6) {
                sum = vec3_add(sum, at);
                count++;
            }
        }
    return vec3_scale(1.0 / count, sum);
}

static void take_nodes(const Body *body, Outcome *out)
{
    const BodyMesh *mesh = &body->mesh;
    out->nodes = mesh->node_count;
    out->id = zeroed((size_t)out->nodes, sizeof *out->id);
    out->place = zeroed((size_t)out->nodes, 3 * sizeof *out->place);
    out->rest = zeroed((size_t)out->nodes, 3 * sizeof *out->rest);
    memcpy(out->id, mesh->id, (size_t)out->nodes * sizeof *out->id);
    body->ops->snapshot(body->model, out->place, NULL);
    body->ops->snapshot_rest(body->model, out->rest);
}

static void press(World *world, Outcome *out)
{
    Sim *sim = world->sim;
    static double spent[TICKS_MOST];
    const Body *body = sim_body(sim, 0);
    double radius = 0.0;
    for (int c = 0; c < sim_tool(sim, 0)->capsule_count; c++)
        radius = fmax(radius, sim_tool(sim, 0)->capsule[c].radius);
    const Vec3 top = find_top(body);
    double driven;
    const bool steers = body->ops->get(body->model, BODY_ADAPT_ERROR, &driven);
    int touched = 0, averaged = 0;
    for (double time = 0.0; time < END; time = sim_time(sim)) {
        const double down = fmin(1.0, fmax(0.0, (time - CLEAR) / (DOWN - CLEAR)));
        const ToolPose pose = {.utime = (int64_t)(1e6 * time),
                               .position = vec3(top.x, top.y,
                                                top.z + radius +
                                                    0.005 * (1.0 - time / CLEAR) * (time < CLEAR) -
                                                    0.6 * radius * down),
                               .orientation = QUAT_NONE,
                               .active = true};
        sim_apply_pose(sim, 0, &pose, true);
        const int64_t estimates = sim_stage_ns(sim, STAGE_ERROR), begin = clock_thread_ns();
        sim_step(sim);
        const int64_t ns = clock_thread_ns() - begin;
        // Estimates count where the motion follows from them.
        const bool estimated = sim_stage_ns(sim, STAGE_ERROR) - estimates > 10000;
        if (sim_wrench(sim, 0)->contact && touched < TICKS_MOST && (steers || !estimated))
            spent[touched++] = 1e-9 * (double)ns;
        out->elements = body->element_count > out->elements ? body->element_count : out->elements;
        if (time < END - MEAN)
            continue;
        averaged++;
        out->force = vec3_add(out->force, sim_wrench(sim, 0)->force);
    }
    out->force = vec3_scale(1.0 / averaged, out->force);
    for (int k = 0; k < touched; k++)
        out->tick += spent[k] / touched;
    qsort(spent, (size_t)touched, sizeof *spent, compare_doubles);
    out->slowest = touched > 0 ? spent[touched * 99 / 100] : 0.0;
    SimError error;
    SimToolError tool[ERROR_TOOLS];
    sim_error(sim, 0, &error);
    sim_tool_errors(sim, tool);
    out->estimated = error.space >= 0.0 ? error.space * error.relative / error.total : -1.0;
    out->estimated_force = tool[0].error >= 0.0 ? tool[0].error / tool[0].force : -1.0;
}

static bool run(const char *folder, const Pressed *pressed, const Way *way, Outcome *out)
{
    char path[4096];
    Scene scene;
    World world;
    Status status = {0};
    *out = (Outcome){.nodes = 0};
    snprintf(path, sizeof path, "%s/%s", folder, pressed->file);
    if (!scene_read(path, &scene, &status)) {
        fprintf(stderr, "%s\n", status.text);
        return false;
    }
    change(&scene, pressed, way);
    const BuildOptions options = {.isa = "auto", .publishes = true};
    const bool built = world_build(&world, &scene, &options, &status);
    if (built) {
        press(&world, out);
        take_nodes(sim_body(world.sim, 0), out);
        world_destroy(&world);
    } else {
        fprintf(stderr, "%s, %s: %s\n", pressed->name, way->name, status.text);
    }
    scene_destroy(&scene);
    return built;
}

// Returns the rms distance of the published nodes from those of another run, over that of their
// displacements; -1: they are others.
static double differ(const Outcome *a, const Outcome *truth)
{
    double off = 0.0, moved = 0.0;
    if (a->nodes != truth->nodes || memcmp(a->id, truth->id, (size_t)a->nodes * sizeof *a->id) != 0)
        return -1.0;
    for (int i = 0; i < 3 * a->nodes; i++) {
        off += pow((double)a->place[i] - (double)truth->place[i], 2);
        moved += pow((double)truth->place[i] - (double)truth->rest[i], 2);
    }
    return sqrt(off / moved);
}

static void study(const char *folder, const Pressed *pressed)
{
    Outcome truth = {0};
    for (int w = 0; w < WAY_COUNT; w++) {
        Outcome out;
        if (!run(folder, pressed, &WAYS[w], &out))
            continue;
        if (w == 0)
            truth = out;
        const double force = vec3_length(truth.force);
        printf("%s\t%s\t%d\t%d\t%.3f\t%.3f\t%.2f\t%.2f\t%.2f\t%.2f\n", pressed->name, WAYS[w].name,
               WAYS[w].adapts, out.elements, 1e3 * out.tick, 1e3 * out.slowest,
               100.0 * differ(&out, &truth),
               100.0 * vec3_length(vec3_sub(out.force, truth.force)) / force, 100.0 * out.estimated,
               100.0 * out.estimated_force);
        fflush(stdout);
        if (w > 0)
            release(&out);
    }
    release(&truth);
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        fprintf(stderr, "usage: pliant-adaptive-curves CONFIG [SCENE]\n");
        return 2;
    }
    printf(
        "scene\tway\tadapts\telements at most\ttick [ms]\t99 of 100 below [ms]\tdisplacements off "
        "[%%]\tforce off [%%]\testimated: displacements [%%]\tforce [%%]\n");
    for (size_t s = 0; s < sizeof PRESSED / sizeof PRESSED[0]; s++)
        if (argc < 3 || strcmp(PRESSED[s].name, argv[2]) == 0)
            study(argv[1], &PRESSED[s]);
    return 0;
}
