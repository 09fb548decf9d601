// SPDX-License-Identifier: MIT
#include "surface/law.h"

#include <math.h>

double law_rigidity(const SurfaceMaterial *material)
{
    return stiffening_cap(&material->stiffening) +
           (maxwell_rigidity(material->branch_count, material->branch) - 1.0);
}

bool law_is_explicit(const SurfaceMaterial *material)
{
    return material->branch_count > 0 || stiffening_is_on(&material->stiffening);
}

bool surface_law_fits(const SurfaceOptions *options, const char **key, const char **needs)
{
    const SurfaceMaterial *material = &options->material;
    const IntegratorKind integrator = options->body.integrator;
    if (material->branch_count > 0 && !options->automatic &&
        !integrator_is_symplectic(integrator)) {
        *key = material->loss_factor > 0.0 ? "loss_factor" : "relaxation";
        *needs = "integrator \"leapfrog\" or \"symplectic_euler\"";
        return false;
    }
    *key = "stiffening";
    *needs = "an explicit integrator";
    return !stiffening_is_on(&material->stiffening) || options->automatic ||
           integrator < INTEGRATOR_EXPLICIT;
}

void law_choose(SurfaceModel *model, const SurfaceOptions *options)
{
    const SurfaceMaterial *material = &options->material;
    const bool stiffens = stiffening_is_on(&material->stiffening);
    model->kind = options->cavity.wanted                   ? SPRINGS_CAVITY
                  : material->branch_count > 0 || stiffens ? SPRINGS_LAW
                  : model->damped                          ? SPRINGS_DAMPED
                                                           : SPRINGS_PLAIN;
    if (stiffens) {
        const StiffeningCurve curve = stiffening_curve(material->stiffening.cap);
        model->stiffening =
            (SpringStiffening){.strain = material->stiffening.strain,
                               .curve = curve,
                               .knee = material->stiffening.strain * sqrt(curve.knee)};
    }
}

void law_create(SurfaceModel *model, const SurfaceMaterial *material, size_t entries,
                const char *name, Arena *arena, StateList *state)
{
    if (material->branch_count == 0)
        return;
    const RelaxationLayout layout = {(int)(entries / LANES), LANES, 1, model->basis.precision};
    model->relaxation =
        relaxation_create(material->branch_count, material->branch, &layout, name, arena, state);
}

// With a prestress the springs are longer than r at rest.
void law_rest(SurfaceModel *model)
{
    const SpringTable *springs = &model->springs;
    if (model->relaxation == NULL)
        return;
    relaxation_forget(model->relaxation);
    for (int s = 0; s < model->basis.count && model->prestress > 0.0; s++) {
        if (model->node[s] < 0)
            continue;
        const int lane = model_lane_of(model, s), chunk = lane / LANES;
        for (int e = springs->start[chunk]; e < springs->end[chunk]; e++) {
            const long at = (long)e * LANES + lane % LANES;
            const double r = model_get(model, springs->rest_length, at),
                         d = r * model->prestress / (1.0 - model->prestress),
                         same[RELAXATION_NUMBERS] = {d, d, d};
            relaxation_put(model->relaxation, (int)at, same);
        }
    }
}

LawSpring law_spring(const SurfaceModel *model, long at, double x, double duration)
{
    LawSpring spring = {0.5 * x * x, x, 1.0};
    const Relaxation *relaxation = model->relaxation;
    if (model->springs.inverse != NULL && x > 0.0) {
        const StiffeningCurve *curve = &model->stiffening.curve;
        const double unit =
            model->stiffening.strain * model_get(model, model->springs.rest_length, at);
        const double q = x * x / (unit * unit);
        spring = (LawSpring){0.5 * unit * unit * stiffening_energy(curve, q),
                             stiffening_factor(curve, q) * x, stiffening_tangent(curve, q)};
    }
    if (relaxation == NULL)
        return spring;
    double d[RELAXATION_NUMBERS];
    relaxation_take(relaxation, (int)at, d);
    for (int i = 0; i < relaxation->count; i++) {
        const double e = relaxation->branch[i].share * relaxation->rigidity;
        spring.energy += 0.5 * e * (x - d[i]) * (x - d[i]);
        spring.pull += e * (x - d[i]);
        // As much as a motion of that duration feels of it, in its middle.
        spring.tangent += e * exp(-0.5 * duration / relaxation->branch[i].time);
    }
    return spring;
}
