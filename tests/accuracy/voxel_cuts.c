// SPDX-License-Identifier: MIT
// Figs 6, 8 and 9: the plane case is torn by a rigid circle, and its elements are made anew.
#include "voxel_accuracy.h"
#include "sim_steps.h"

#include "plane_world.h"
#include "scoped.h"
#include "plane/cut.h"

enum { FRAMES = 4, SQUARE_CELLS = 16, CUT_LEVELS = 3 };

// Outlines of all elements by level, where they are now; then the rigid circle [m].
static void write_frame(const Experiment *experiment, const char *name, const PlaneWorld *world,
                        bool deformed, Vec3 circle, double radius)
{
    const PlaneCut *cut = world->model->cut;
    const Rows *rows = &world->model->vertices.rows;
    CLOSED FILE *out = experiment_open(experiment, name);
    for (int level = 0; level <= CUT_LEVELS; level++) {
        for (int e = 0; e < cut->layout.element_count; e++) {
            const PlaneElement *element = &cut->layout.element[e];
            if (element->level != level || element->quarters == 0)
                continue;
            int place[PLANE_PLACES], count = plane_outline(element->quarters, place);
            int first = -1;
            for (int k = 0; k <= count; k++) {
                int row = cut->vertex[e][place[k % count]];
                if (k == count)
                    row = first;
                if (row < 0)
                    continue;
                first = first < 0 ? row : first;
                Vec3 x = rows_rest(rows, row), v;
                if (deformed)
                    plane_world_read(world, row, &x, &v);
                fprintf(out, "%g\t%g\n", 1e3 * x.x, 1e3 * x.y);
            }
            fprintf(out, "\n");
        }
        fprintf(out, "%s", "-1000\t-1000\n\n\n"); // no empty index, whatever levels there are
    }
    for (int k = 0; k <= 64; k++) {
        double angle = k * (2.0 * 3.14159265358979 / 64.0);
        fprintf(out, "%g\t%g\n", 1e3 * (circle.x + radius * cos(angle)),
                1e3 * (circle.y + radius * sin(angle)));
    }
}

static void write_count(FILE *out, const char *when, const PlaneWorld *world, int ticks)
{
    const PlaneModel *model = world->model;
    CutOutcome pieces = {0};
    plane_cut_count_pieces(model->cut, &pieces);
    int broken = 0;
    for (int cell = 0; cell < model->cut->cell_count; cell++)
        broken += (model->cut->broken[cell] & 1) + (model->cut->broken[cell] >> 1);
    fprintf(out, "%s\t%d\t%d\t%d\t%d + %d + %d + %d\t%d\t%d\n", when, ticks, broken,
            model->element_count, model->element_at_level[0], model->element_at_level[1],
            model->element_at_level[2], model->element_at_level[3], model->vertices.count,
            pieces.pieces);
}

static const char HEADER[] = "\tticks\tbroken edges\telements\tof levels 0 + 1 + 2 + 3\tvertices\t"
                             "pieces\n";

// Figs 6 and 8: edges from the border to the middle of a square are broken at once; each tick every
// element is replaced with its quarters at most once.
static void carve_square(const Experiment *experiment)
{
    PlaneWorldOptions options = plane_world_disc(4);
    lattice_destroy(&options.lattice);
    if (!lattice_box(&options.lattice, (int[3]){SQUARE_CELLS, SQUARE_CELLS, 1}, 0.002,
                     &(Status){0}))
        abort();
    options.body.body.cuttable = true;
    options.body.law = PLANE_MIYAZAKI2004;
    options.body.body.levels = CUT_LEVELS;
    SCOPED(plane_world_destroy) PlaneWorld world;
    plane_world_create(&world, &options);
    CLOSED FILE *out = experiment_open(experiment, "plane-carved.tsv");
    fputs(HEADER, out);
    write_count(out, "before", &world, 0);
    write_frame(experiment, "carved-0.dat", &world, false, vec3(-2, 0, 0), 0.0);
    const CutOptions cut = {
        .body = -1,
        .before = {{vec3(0.0, -0.02, -0.01), vec3(0.0, -0.02, 0.01)}},
        .after = {{vec3(0.0, 0.0, -0.01), vec3(0.0, 0.0, 0.01)}},
    };
    CutOutcome sum;
    char why[192], name[32];
    sim_apply_cut(world.sim, &cut, &sum, why, sizeof why);
    int ticks = 0, elements = 0, frame = 1;
    while (elements != world.model->element_count && ticks < 16) {
        elements = world.model->element_count;
        sim_step(world.sim);
        ticks++;
        if (elements == world.model->element_count)
            break;
        snprintf(name, sizeof name, "after tick %d", ticks);
        write_count(out, name, &world, ticks);
        snprintf(name, sizeof name, "carved-%d.dat", frame < FRAMES ? frame++ : FRAMES - 1);
        write_frame(experiment, name, &world, false, vec3(-2, 0, 0), 0.0);
    }
    for (; frame < FRAMES; frame++) {
        snprintf(name, sizeof name, "carved-%d.dat", frame);
        write_frame(experiment, name, &world, false, vec3(-2, 0, 0), 0.0);
    }
}

// Fig. 9: a rigid circle is pushed into the disc; collisions beyond a force separate.
static void tear_disc(const Experiment *experiment)
{
    PlaneWorldOptions options = plane_world_disc(16);
    const double radius = 0.004;
    const FixedRegion held = {.kind = FIXED_SPHERE, .center = {0.0, 0.03, 0.0}, .radius = 0.014};
    fix_within(&options.body.body, &held);
    options.body.body.cuttable = true;
    options.body.law = PLANE_MIYAZAKI2004;
    options.body.tear_force = 3e-3;
    options.tool[options.tool_count++] =
        (ToolOptions){.id = 1,
                      .kind = TOOL_PROBE,
                      .capsule_count = 1,
                      .capsule = {{.from = {0, 0, -0.02}, .to = {0, 0, 0.02}, .radius = radius}},
                      .max_force = 3.3};
    SCOPED(plane_world_destroy) PlaneWorld world;
    plane_world_create(&world, &options);
    FILE *out = experiment_open(experiment, "plane-torn.tsv");
    fputs(HEADER, out);
    const int last = 1200;
    int changes = 0, frame = 0;
    double whole_us = 0.0;
    char name[32];
    for (int tick = 0; tick <= last; tick++) {
        if (tick == frame * last / (FRAMES - 1)) {
            const double y = -0.0365 + 0.021 * tick / last;
            snprintf(name, sizeof name, "%.0f mm deep", 21.0 * tick / last);
            write_count(out, name, &world, tick);
            snprintf(name, sizeof name, "torn-%d.dat", frame++);
            write_frame(experiment, name, &world, true, vec3(0.0005, y, 0.0), radius);
        }
        const int topology = world.body->mesh.topology;
        plane_world_place(&world, 0, vec3(0.0005, -0.0365 + 0.021 * tick / last, 0.0));
        const int64_t before =
            sim_stage_ns(world.sim, STAGE_CUT) + sim_stage_ns(world.sim, STAGE_RECONSTRUCT);
        sim_step(world.sim);
        if (world.body->mesh.topology == topology)
            continue;
        changes += world.body->mesh.topology - topology;
        whole_us += 1e-3 * (double)(sim_stage_ns(world.sim, STAGE_CUT) +
                                    sim_stage_ns(world.sim, STAGE_RECONSTRUCT) - before);
    }
    fclose(out);
    out = experiment_open(experiment, "plane-reconstruct.tsv");
    fprintf(out,
            "changes in %d ticks\tus a change\tns an element and change\tns an element and "
            "tick\tthe paper's b [ns an element and step]\n",
            last);
    const int elements = world.model->element_count;
    fprintf(out, "%d\t%.0f\t%.0f\t%.0f\t230 to 330\n", changes, whole_us / changes,
            1e3 * whole_us / changes / elements, 1e3 * whole_us / last / elements);
    fclose(out);
}

void cuts(const Experiment *experiment)
{
    carve_square(experiment);
    tear_disc(experiment);
}
