#include "surface/law.h"

#include <math.h>

double law_rigidity(const SurfaceMaterial *material)
{
    return maxwell_rigidity(material->branch_count, material->branch);
}

bool law_fits(const SurfaceOptions *options, Status *status)
{
    const SurfaceMaterial *material = &options->material;
    const IntegratorKind integrator = options->body.integrator;
    if (material->branch_count == 0 || options->automatic || integrator_is_symplectic(integrator))
        return true;
    return status_fail(status, STATUS_INVALID,
                       "material: %s needs integrator \"leapfrog\" or \"symplectic_euler\", not "
                       "\"%s\"",
                       material->loss_factor > 0.0 ? "loss_factor" : "relaxation",
                       integrator_name(integrator));
}

void law_choose(SurfaceModel *model, const SurfaceMaterial *material)
{
    model->law = material->branch_count > 0 ? SPRINGS_RELAX : 0;
    // The kernels of a law know prestress and damping, which may be zero.
    model->prestressed |= model->law != 0;
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
