// SPDX-License-Identifier: MIT
// Writes the scene of a tensile test, and runs it.
#include "fit/strip.h"

#include "scene/build.h"
#include "fit/results.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SOLID_CELLS = 3, SOLID_LENGTH = 24, SHEET_ROWS = 5, SHEET_LENGTH = 48, MARK_NODES = 256 };
static const double EDGE = 1e-3; // of cells and triangles [m]

// Returns the length of a strip at rest [m]. Edges that only thin the strip are weak beside those
// that stiffen: the clamps of a surface show further than those of a solid.
static double length_of(SceneModel model)
{
    return EDGE * (model == MODEL_VOXEL ? SOLID_LENGTH : SHEET_LENGTH);
}

// --- the scene -----------------------------------------------------------------------------------

// Rows of equilateral triangles with edges along the pull: these alone carry it, since the strip is
// free to thin until the others have their rest lengths.
static void write_sheet(FILE *out)
{
    // Every other row has one node less, half an edge further in.
    int first[SHEET_ROWS + 1] = {0};
    for (int r = 0; r < SHEET_ROWS; r++)
        first[r + 1] = first[r] + SHEET_LENGTH + 1 - r % 2;
    fprintf(out, "OFF\n%d %d 0\n", first[SHEET_ROWS], (SHEET_ROWS - 1) * (2 * SHEET_LENGTH - 1));
    for (int r = 0; r < SHEET_ROWS; r++)
        for (int c = first[r]; c < first[r + 1]; c++)
            fprintf(out, "%.9g %.17g 0\n", EDGE * (c - first[r] - 0.5 * (SHEET_LENGTH - r % 2)),
                    0.5 * sqrt(3.0) * EDGE * (r - 0.5 * (SHEET_ROWS - 1)));
    // Between a long row and a short one: triangles that stand on the long one, and on the short.
    for (int r = 0; r + 1 < SHEET_ROWS; r++) {
        const bool turned = r % 2 != 0;
        const int near = first[turned ? r + 1 : r], far = first[turned ? r : r + 1];
        for (int c = 0; c < SHEET_LENGTH; c++) {
            const int left = near + c, right = left + 1, tip = far + c;
            fprintf(out, "3 %d %d %d\n", turned ? right : left, turned ? left : right, tip);
            if (c + 1 < SHEET_LENGTH)
                fprintf(out, "3 %d %d %d\n", right, turned ? tip : tip + 1, turned ? tip + 1 : tip);
        }
    }
}

static void write_scene(FILE *out, const char *name, SceneModel model, const char *material,
                        const char *note)
{
    const double end = 0.5 * length_of(model);
    // A surface's end is a row of nodes at its border, and one half an edge further in.
    const double clamp = end - (model == MODEL_VOXEL ? 0.1 : 0.6) * EDGE;
    fprintf(out,
            "# A tensile test, written by pliant-fit: one end is fixed, tool 1 pulls the other "
            "along x.\n%s\nname = \"%s\";\nrate_hz = 1000.0;\ngravity = [0.0, 0.0, 0.0];\n"
            "precision = \"double\";\n\nbodies = (\n  {\n    name = \"strip\";\n",
            note, name);
    if (model == MODEL_VOXEL)
        fprintf(out,
                "    model = \"voxel\";  levels = 0;\n"
                "    voxels = { generator = \"box\";  count = [%d, %d, %d];  size = %g; };\n",
                SOLID_LENGTH, SOLID_CELLS, SOLID_CELLS, EDGE);
    else
        fprintf(out, "    mesh = { file = \"%s.off\"; };\n", name);
    fprintf(out,
            "    fixed = ( { box = ([-1.0, -1.0, -1.0], [%g, 1.0, 1.0]); } );\n"
            "    material = { %s };\n  }\n);\n\n"
            "tools = ( { id = 1;  kind = \"probe\";  max_force = 1e6;\n"
            "            capsules = ( { from = [0.0, 0.0, 1.0];  radius = 0.001; } ); } );\n"
            "attachments = ( { body = \"strip\";  tool = 1;  stiffness = 1.0;\n"
            "                  box = ([%g, -1.0, -1.0], [1.0, 1.0, 1.0]); } );\n",
            -clamp, material, clamp);
}

bool strip_write(const char *folder, const char *name, SceneModel model, const char *material,
                 const char *note, Status *status)
{
    char path[RESULTS_PATH], file[NAME_MAX + 1];
    snprintf(file, sizeof file, "%s.cfg", name);
    FILE *out = results_create(folder, file, path, status);
    if (out == NULL)
        return false;
    write_scene(out, name, model, material, note);
    if (!results_close(out, path, status))
        return false;
    if (model == MODEL_VOXEL)
        return true;
    snprintf(file, sizeof file, "%s.off", name);
    out = results_create(folder, file, path, status);
    if (out == NULL)
        return false;
    write_sheet(out);
    return results_close(out, path, status);
}

// --- the pull ------------------------------------------------------------------------------------

// Nodes that lie in one section of the strip at rest.
typedef struct Mark {
    int count, node[MARK_NODES];
    double rest; // mean of their x [m]
} Mark;

static double mark_place(const Body *body, const Mark *mark)
{
    Vec3 x[MARK_NODES];
    double sum = 0.0;
    body->ops->read_nodes(body->model, mark->node, mark->count, x, NULL);
    for (int i = 0; i < mark->count; i++)
        sum += x[i].x;
    return sum / mark->count;
}

static bool mark_find(const Body *body, double place, Mark *mark)
{
    mark->count = 0;
    for (int i = 0; i < body->surface.node_used && mark->count < MARK_NODES; i++) {
        Vec3 x;
        body->ops->read_nodes(body->model, &i, 1, &x, NULL);
        // Rows of a surface lie half an edge apart.
        if (fabs(x.x - place) < 0.2 * EDGE)
            mark->node[mark->count++] = i;
    }
    if (mark->count == 0)
        return false;
    mark->rest = mark_place(body, mark);
    return true;
}

typedef struct Pull {
    World world;
    const Body *body;
    Mark mark[2];
    double length;  // at rest [m]
    double section; // [m], or [m2] of a solid
    double tick;
} Pull;

static bool begin(Pull *pull, const Scene *scene, Status *status)
{
    const BuildOptions options = {.isa = "auto"};
    if (!world_build(&pull->world, scene, &options, status))
        return false;
    pull->length = length_of(scene->body[0].model);
    pull->body = sim_body(pull->world.sim, 0);
    pull->tick = sim_tick(pull->world.sim);
    pull->section = scene->body[0].model == MODEL_VOXEL ? SOLID_CELLS * EDGE * SOLID_CELLS * EDGE
                                                        : 0.5 * sqrt(3.0) * EDGE * (SHEET_ROWS - 1);
    if (mark_find(pull->body, -pull->length / 6.0, &pull->mark[0]) &&
        mark_find(pull->body, pull->length / 6.0, &pull->mark[1]))
        return true;
    world_destroy(&pull->world);
    return status_fail(status, STATUS_INVALID, "%s: is no strip", scene->path);
}

// Returns how far the pulled end is [m]: its speed grows from 0 within a twentieth of the way, so
// that the strip does not swing.
static double way_at(double time, double duration, double speed)
{
    const double rise = 0.05 * duration;
    return time < rise ? 0.5 * speed * time * time / rise : speed * (time - 0.5 * rise);
}

static void step(Pull *pull, int tick, double way)
{
    const ToolPose pose = {.utime = llround(1e6 * pull->tick * (tick + 1)),
                           .position = {way, 0.0, 0.0},
                           .orientation = {1.0, 0.0, 0.0, 0.0},
                           .active = true};
    sim_apply_pose(pull->world.sim, 0, &pose, false);
    sim_step(pull->world.sim);
}

static bool run(Pull *pull, double strain, double rate, StripCurve *curve, Status *status)
{
    const double duration = strain / rate;
    const double rest = pull->mark[1].rest - pull->mark[0].rest;
    // Stiff clamped ends take a part of the way: the middle needs more time than all of the strip.
    const int most = (int)ceil(2.0 * duration / pull->tick);
    curve->strain = calloc((size_t)most + 1, sizeof *curve->strain);
    curve->stress = calloc((size_t)most + 1, sizeof *curve->stress);
    if (curve->strain == NULL || curve->stress == NULL)
        return status_fail(status, STATUS_FAILED, "pliant-fit: no memory");
    curve->count = 1; // at rest
    double before = 0.0;
    for (int i = 0; i < most; i++) {
        step(pull, i, way_at((i + 1) * pull->tick, duration, rate * pull->length));
        if (sim_resets(pull->world.sim) > 0)
            return status_fail(status, STATUS_FAILED, "the strip was restored at a strain of %g",
                               curve->strain[curve->count - 1]);
        // The wrench is the mean of the tick, so the strain is, too.
        const double now =
            (mark_place(pull->body, &pull->mark[1]) - mark_place(pull->body, &pull->mark[0])) /
                rest -
            1.0;
        curve->strain[curve->count] = 0.5 * (before + now);
        curve->stress[curve->count] = -sim_wrench(pull->world.sim, 0)->force.x / pull->section;
        before = now;
        if (curve->strain[curve->count++] >= strain)
            return true;
    }
    return status_fail(status, STATUS_FAILED, "the strip was pulled to a strain of %g, not %g",
                       curve->strain[curve->count - 1], strain);
}

bool strip_pull(const char *path, double strain, double rate, StripCurve *curve, Status *status)
{
    Scene scene = {0};
    Pull pull;
    *curve = (StripCurve){0};
    bool ok = scene_read(path, &scene, status) && begin(&pull, &scene, status);
    if (ok) {
        ok = run(&pull, strain, rate, curve, status);
        world_destroy(&pull.world);
    }
    scene_destroy(&scene);
    if (!ok)
        strip_destroy(curve);
    return ok;
}

void strip_destroy(StripCurve *curve)
{
    free(curve->strain);
    free(curve->stress);
    *curve = (StripCurve){0};
}

double strip_stress_at(const StripCurve *curve, double strain)
{
    // The strains rise but for the first swings; the last stretch that begins below is meant.
    int high = curve->count - 1;
    if (curve->count < 2 || !(strain <= curve->strain[high]))
        return (double)NAN;
    while (high > 1 && curve->strain[high - 1] >= strain)
        high--;
    const double from = curve->strain[high - 1], to = curve->strain[high];
    const double share = to > from ? (strain - from) / (to - from) : 1.0;
    return curve->stress[high - 1] + share * (curve->stress[high] - curve->stress[high - 1]);
}
