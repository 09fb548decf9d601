// SPDX-License-Identifier: MIT
#include "study/study.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// The grid under construction.
typedef struct Grid {
    const Scene *scene;
    const StudyOptions *options;
    StudyCase own; // the scene itself
    IntegratorKind kind[INTEGRATOR_COUNT];
    int kind_count;
    int levels; // finest level of detail to try
    StudyCase *cases;
    int count;
} Grid;

static bool is_voxel(const Scene *scene)
{
    return scene_has_cells(&scene->body[0]);
}

// True if the elements of the first body can follow tools (levels.surface).
static bool can_adapt(const Scene *scene)
{
    const SceneBody *body = &scene->body[0];
    return body->model == MODEL_VOXEL && body->voxel.law == VOXEL_AFFINE && body->initial == NULL &&
           body->voxel.weight_count == 0 && body->voxel.fine_count == 0 &&
           body->options.levels > 0 && scene->tool_count > 0;
}

StudyCase study_scene_case(const Scene *scene)
{
    const SceneBody *body = &scene->body[0];
    const SurfaceOptions *surface = &body->surface;
    // What the scene says, in the terms of cases.
    StudyCase own = {.precision = scene->precision,
                     .detail = DETAIL_SCENE,
                     .is_scene = true,
                     .integrator = body->options.integrator,
                     .time_step = body->options.time_step};
    // Detail means levels of the lattice, or of the surface.
    if (is_voxel(scene)) {
        const double error = body->options.adapt_error;
        own.level = body->options.levels;
        own.threshold = body->voxel.surface_level == 0 ? 0.0 : error > 0.0 ? error : UNSTEERED;
        own.paper_rule = body->voxel.law == VOXEL_MIYAZAKI2004;
    } else {
        own.level = surface->adaptive ? surface->body.levels : surface->start_level;
        own.threshold = surface->adaptive ? 1.0 : 0.0;
        own.paper_rule = surface->adjust == ADJUST_CHOI2005;
    }
    study_name_case(scene, &own);
    return own;
}

bool study_same_mesh(const StudyCase *a, const StudyCase *b)
{
    return a->level == b->level && a->threshold == b->threshold && a->paper_rule == b->paper_rule;
}

void study_name_mesh(const Scene *scene, const StudyCase *what, char *name, size_t size)
{
    char times[24] = "";
    // Only what differs from the usual is in the name.
    const char *rule = "";
    if (what->threshold > 0.0 && what->threshold != 1.0)
        snprintf(times, sizeof times, is_voxel(scene) ? " to %g %%" : " x %g",
                 is_voxel(scene) ? 100.0 * what->threshold : what->threshold);
    if (what->paper_rule)
        rule = is_voxel(scene) ? ", miyazaki2004" : ", choi2005";
    if (is_voxel(scene) && what->level < 0)
        snprintf(name, size, "half cells%s", rule);
    else
        snprintf(name, size, "%s %d%s%s",
                 what->threshold > 0.0 ? "adaptive"
                 : is_voxel(scene)     ? "levels"
                                       : "level",
                 what->level, times, rule);
}

void study_name_case(const Scene *scene, StudyCase *what)
{
    char step[24] = "bound", mesh[32];
    if (what->step_doubling)
        snprintf(step, sizeof step, "doubling %g", what->tolerance);
    else if (what->time_step > 0.0)
        snprintf(step, sizeof step, "%g ms", 1e3 * what->time_step);
    study_name_mesh(scene, what, mesh, sizeof mesh);
    bool chooses = what->is_scene && !is_voxel(scene) && scene->body[0].surface.automatic;
    snprintf(what->name, sizeof what->name, "%s %s %s, %s",
             chooses ? "auto" : integrator_name(what->integrator), step,
             what->precision == PRECISION_SINGLE ? "single" : "double", mesh);
}

// Adds a case to the list unless it exists or was not selected.
static void add(Grid *grid, StudyCase what)
{
    const char *only = grid->options->only;
    what.is_scene = false;
    if (what.integrator == INTEGRATOR_IMPLICIT) // has no other precision
        what.precision = PRECISION_DOUBLE;
    study_name_case(grid->scene, &what);
    for (int i = 0; i < grid->count; i++)
        if (strcmp(grid->cases[i].name, what.name) == 0)
            return;
    if (only != NULL && strstr(what.name, only) == NULL)
        return;
    if (grid->count < STUDY_CASES)
        grid->cases[grid->count++] = what;
}

static StudyCase with_detail(const Grid *grid, StudyDetail detail, int level, double threshold)
{
    StudyCase what = grid->own;
    what.detail = detail;
    what.level = level;
    what.threshold = detail == DETAIL_ADAPTIVE ? threshold : 0.0;
    if (study_same_mesh(&what, &grid->own))
        what.detail = DETAIL_SCENE;
    return what;
}

// Adds integrator x time step on one mesh.
static void add_steps(Grid *grid, StudyCase what)
{
    static const double all[] = {0.01, 0.005, 0.0025, 0.002, 0.001, 0.0005, 0.00025, 0.0001, 0.0};
    static const double few[] = {0.0025, 0.002, 0.001, 0.00025, 0.0};
    const bool quick = grid->options->quick;
    const double *step = quick ? few : all;
    const size_t steps = quick ? sizeof few / sizeof *few : sizeof all / sizeof *all;
    for (int k = 0; k < grid->kind_count; k++)
        for (size_t s = 0; s < steps; s++) {
            what.integrator = grid->kind[k];
            what.time_step = step[s];
            add(grid, what);
        }
}

// Adds RK4 with adaptive steps.
static void add_doubling(Grid *grid, StudyCase what)
{
    const bool quick = grid->options->quick;
    what.integrator = INTEGRATOR_RK4;
    what.step_doubling = true;
    what.time_step = 0.0;
    for (double tolerance = 1e-3; tolerance > 0.5e-6; tolerance *= quick ? 0.01 : 0.1) {
        // Round to the decimal text, however the power of ten was computed.
        char text[24];
        snprintf(text, sizeof text, "%.0e", tolerance);
        sscanf(text, "%lf", &what.tolerance);
        add(grid, what);
    }
}

// Adds one mesh with the scene's integrator, the default one and the paper's.
static void add_mesh(Grid *grid, StudyCase what)
{
    add(grid, what);
    what.time_step = 0.0;
    what.integrator = is_voxel(grid->scene) ? INTEGRATOR_SYMPLECTIC_EULER : INTEGRATOR_LEAPFROG;
    add(grid, what);
    what.integrator = is_voxel(grid->scene) ? INTEGRATOR_LEAPFROG : INTEGRATOR_RK4;
    add(grid, what);
}

// Adds a solid whose elements follow the tools, as far as usual, and steered by its own error.
static void add_steered(Grid *grid)
{
    static const double ERROR[] = {UNSTEERED, 0.05, 0.02, 0.1};
    for (int k = 0; k < (grid->options->quick ? 2 : 4); k++) {
        StudyCase what = with_detail(grid, DETAIL_ADAPTIVE, grid->levels, ERROR[k]);
        what.time_step = 0.0;
        add(grid, what);
    }
}

static void add_details(Grid *grid)
{
    const bool quick = grid->options->quick;
    for (int level = 0; level <= grid->levels; level++)
        add_mesh(grid, with_detail(grid, DETAIL_HELD, level, 0.0));
    if (can_adapt(grid->scene))
        add_steered(grid);
    if (is_voxel(grid->scene))
        return;
    for (double times = quick ? 1.0 : 0.5; times <= 4.0; times *= quick ? 4.0 : 2.0)
        add_mesh(grid, with_detail(grid, DETAIL_ADAPTIVE, grid->levels, times));
    for (int level = 1; level < grid->levels && !quick; level++)
        add_mesh(grid, with_detail(grid, DETAIL_ADAPTIVE, level, 1.0));
}

// Adds the other rule of adaptation, for cases that adapt.
static void add_rules(Grid *grid)
{
    const bool voxel = is_voxel(grid->scene);
    // The other rule on each mesh,
    for (int level = voxel ? 0 : 1; level <= grid->levels; level++) {
        StudyCase what = with_detail(grid, DETAIL_HELD, level, 0.0);
        if (grid->options->quick && level != grid->levels)
            continue;
        what.paper_rule = !what.paper_rule;
        what.detail = DETAIL_HELD;
        add_mesh(grid, what);
    }
    // and on the mesh that adapts.
    if (voxel)
        return;
    StudyCase what = with_detail(grid, DETAIL_ADAPTIVE, grid->levels, 1.0);
    what.paper_rule = !what.paper_rule;
    what.detail = DETAIL_ADAPTIVE;
    add_mesh(grid, what);
}

// Adds the other precision, on the scene's mesh and on the coarsest.
static void add_precisions(Grid *grid)
{
    StudyCase what = grid->own;
    what.precision = what.precision == PRECISION_SINGLE ? PRECISION_DOUBLE : PRECISION_SINGLE;
    add_mesh(grid, what);
    if (is_voxel(grid->scene))
        return;
    StudyCase coarse = with_detail(grid, DETAIL_HELD, 0, 0.0);
    coarse.precision = what.precision;
    add_mesh(grid, coarse);
}

// Chooses the integrators of the model.
static void choose_kinds(Grid *grid)
{
    for (int kind = 0; kind < INTEGRATOR_COUNT; kind++)
        if (!is_voxel(grid->scene) || integrator_is_symplectic((IntegratorKind)kind))
            grid->kind[grid->kind_count++] = (IntegratorKind)kind;
}

int study_make_cases(const Scene *scene, const StudyOptions *options, StudyCase *cases)
{
    Grid grid = {.scene = scene, .options = options, .cases = cases};
    // The scene's own case first; implicit steps are computed in double.
    grid.own = study_scene_case(scene);
    if (grid.own.integrator == INTEGRATOR_IMPLICIT)
        grid.own.precision = PRECISION_DOUBLE;
    // Without levels of its own a surface is tried with one.
    const SceneBody *body = &scene->body[0];
    grid.levels = body->options.levels;
    if (!is_voxel(scene) && grid.levels < 1)
        grid.levels = 1;
    cases[grid.count++] = grid.own;
    // Each axis alone, around the scene's choice.
    choose_kinds(&grid);
    add_steps(&grid, grid.own);
    if (!is_voxel(scene)) {
        add_doubling(&grid, grid.own);
        add_steps(&grid, with_detail(&grid, DETAIL_HELD, 0, 0.0));
    }
    add_precisions(&grid);
    add_details(&grid);
    add_rules(&grid);
    return grid.count;
}
