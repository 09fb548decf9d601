// SPDX-License-Identifier: MIT
#include "study/context.h"

#include "voxel/layout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double ERROR_HZ = 20.0; // estimates of the error, at most

bool study_copy_scene(const Scene *from, StudyScene *copy)
{
    size_t bytes = (size_t)from->body_count * sizeof *copy->body;
    *copy = (StudyScene){.scene = *from, .body = malloc(bytes)};
    if (copy->body == NULL)
        return false;
    memcpy(copy->body, from->body, bytes);
    copy->scene.body = copy->body;
    copy->scene.threads = 1; // the study measures the time of one processor
    copy->scene.prepared = NULL;
    copy->scene.publish.nodes = NODES_SURFACE;
    for (int b = 0; b < from->body_count; b++)
        copy->body[b].skin.file = NULL;
    return true;
}

void study_destroy_scene(StudyScene *copy)
{
    free(copy->body);
    *copy = (StudyScene){0};
}

static void change_surface(SurfaceOptions *surface, const StudyCase *what)
{
    surface->automatic = surface->automatic && what->is_scene;
    surface->adjust = what->paper_rule ? ADJUST_CHOI2005 : ADJUST_CONTINUUM;
    if (what->detail == DETAIL_SCENE)
        return;
    surface->adaptive = what->detail == DETAIL_ADAPTIVE;
    surface->start_level = surface->adaptive ? 0 : what->level;
    surface->adapt.coarsest = 0; // levels are the study's
    // Rules of levels need levels; a body held at level 0 gets one too.
    surface->body.levels = what->level > 0 ? what->level : 1;
    if (!surface->adaptive)
        return;
    if (!(surface->adapt.force > 0.0)) { // the scene does not set them
        SurfaceOptions preset = {0};
        scene_preset_surface(&preset);
        surface->adapt = preset.adapt;
    }
    surface->adapt.force *= what->threshold;
    surface->adapt.speed *= what->threshold;
    surface->adapt.curvature *= what->threshold;
}

static void change_voxel(SceneBody *body, const StudyCase *what)
{
    VoxelSource *voxels = &body->voxels;
    body->voxel.law = what->paper_rule ? VOXEL_MIYAZAKI2004 : VOXEL_AFFINE;
    if (what->detail == DETAIL_SCENE)
        return;
    const bool adapts = what->detail == DETAIL_ADAPTIVE;
    body->options.levels = what->level > 0 ? what->level : 0;
    body->voxel.surface_level = adapts ? what->level : 0;
    body->voxel.fine_count = adapts ? body->voxel.fine_count : 0;
    body->options.adapt_error = adapts && what->threshold < UNSTEERED ? what->threshold : 0.0;
    if (what->level >= 0)
        return;
    voxels->size *= 0.5;
    for (int k = 0; k < 3; k++)
        voxels->count[k] *= 2;
}

void study_change_scene(StudyScene *copy, const StudyCase *what, double sample_s)
{
    Scene *scene = &copy->scene;
    double step = what->time_step;
    // A step longer than the tick needs a longer tick, of which a whole number fits a sample.
    if (step > (1.0 + 1e-9) / scene->sim.rate_hz) {
        double ticks = ceil(sample_s / step * (1.0 - 1e-9));
        double rate = fmax(ticks, 1.0) / sample_s;
        step = fmin(step, 1.0 / rate);
        if (rate < scene->sim.rate_hz)
            scene->sim.rate_hz = rate;
    }
    // A method with adaptive steps is not bound to the tick, unless something is decided at ticks.
    if (what->step_doubling && !(what->threshold > 0.0) && scene->tool_count == 0)
        scene->sim.rate_hz = 1.0 / sample_s;
    // What belongs to each body.
    scene->precision = what->precision;
    for (int b = 0; b < scene->body_count; b++) {
        SceneBody *body = &copy->body[b];
        body->options.time_step = step;
        body->options.integrator = what->integrator;
        // Only the scene's own case may take a step that the scene calls unsafe.
        body->options.unsafe_time_step &= what->is_scene;
        if (body->model == MODEL_SURFACE) {
            change_surface(&body->surface, what);
            body->surface.adapt.check_hz = fmin(body->surface.adapt.check_hz, scene->sim.rate_hz);
        } else {
            change_voxel(body, what);
        }
    }
}

// Checks what the scene reader refuses and the builder relies on.
static bool check(const StudyScene *copy, Status *status)
{
    for (int b = 0; b < copy->scene.body_count; b++) {
        const SceneBody *body = &copy->body[b];
        // What the reader of scenes would refuse, for a scene that was changed behind its back.
        if (!scene_has_cells(body))
            continue;
        if (body->options.levels > VOXEL_LEVELS_MAX)
            return status_fail(status, STATUS_INVALID, "levels %d exceeds %d", body->options.levels,
                               VOXEL_LEVELS_MAX);
        if (!integrator_is_symplectic(body->options.integrator))
            return status_fail(status, STATUS_INVALID, "integrator %s means nothing to voxels",
                               integrator_name(body->options.integrator));
        for (int m = 0; m < body->voxel.material_count; m++)
            if (body->voxel.law == VOXEL_MIYAZAKI2004 && body->material[m].poisson_ratio > 0.0)
                return status_fail(status, STATUS_INVALID,
                                   "law miyazaki2004 knows only poisson_ratio 0, not %g",
                                   body->material[m].poisson_ratio);
    }
    return true;
}

// Asks for the bodies' own errors, and for nothing else that is published.
static void ask_for_errors(Scene *scene)
{
    scene->publish.error_hz = ERROR_HZ;
    scene->sim.error_whole = true;
    scene->publish.contact_stiffness = false;
    scene->sim.estimate_error = false;
}

bool study_build(const StudyContext *context, const StudyCase *what, bool estimates,
                 StudyScene *copy, World *world, Status *status)
{
    const BuildOptions options = {.isa = context->options.isa,
                                  .may_load = context->inputs.drive == DRIVE_LOG,
                                  .publishes = estimates};
    if (!study_copy_scene(&context->scene, copy))
        return status_fail(status, STATUS_FAILED, "out of memory");
    study_change_scene(copy, what, context->sample_s);
    if (estimates)
        ask_for_errors(&copy->scene);
    if (check(copy, status) && world_build(world, &copy->scene, &options, status))
        return true;
    study_destroy_scene(copy);
    return false;
}
