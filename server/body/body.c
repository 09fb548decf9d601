// SPDX-License-Identifier: MIT
// What bodies of all models have in common: parameters, dimensions, the expected time of a tick.
#include "body/body.h"

#include <math.h>

// Returns where a parameter that every model has is; NULL: levels and cavities are the models' own
// business, and a body without a damped kernel has no damping.
static double *find_parameter(BodyParameters *parameters, bool damped, BodyParameter parameter)
{
    if (parameter <= BODY_GRAVITY_Z)
        return &parameters->gravity[parameter - BODY_GRAVITY_X];
    if (parameter == BODY_STIFFNESS_SCALE)
        return &parameters->stiffness_scale;
    return damped && parameter == BODY_DAMPING_SCALE ? &parameters->damping_scale : NULL;
}

bool body_parameters_set(BodyParameters *parameters, bool damped, BodyParameter parameter,
                         double value)
{
    double *at = find_parameter(parameters, damped, parameter);
    if (at != NULL)
        *at = value;
    return at != NULL;
}

bool body_parameters_get(const BodyParameters *parameters, bool damped, BodyParameter parameter,
                         double *value)
{
    BodyParameters copy = *parameters;
    const double *at = find_parameter(&copy, damped, parameter);
    if (at != NULL)
        *value = *at;
    return at != NULL;
}

// Rounding of rows that hold displacements is nothing to show.
static double without_rounding(double x, double size)
{
    return fabs(x) < 1e-12 * size ? 0.0 : x;
}

BodyOutline body_outline(const Body *body)
{
    const BodySurface *surface = &body->surface; // more than there are nodes, where a body adapts
    BodyOutline outline = {.box = box_empty()};
    Box *box = &outline.box;
    // Nodes of outer faces only.
    for (int i = 0; i < surface->node_count; i++) {
        if (surface->node_face_end[i] <= surface->node_face_start[i])
            continue;
        Vec3 x;
        body->ops->read_nodes(body->model, &i, 1, &x, NULL);
        box_add(box, x);
        outline.nodes++;
        outline.fixed += body->ops->is_fixed != NULL && body->ops->is_fixed(body->model, i);
    }
    // The size by which rounding is judged.
    const double size = vec3_length(box_low(box)) + vec3_length(box_high(box));
    for (int c = 0; c < 3; c++) {
        box->low[c] = without_rounding(box->low[c], size);
        box->high[c] = without_rounding(box->high[c], size);
    }
    return outline;
}

// Time per spring and per element, each substep [s]: 24 walls of 500 and 2000 nodes took 13 to 17
// ns per node, which has three springs; 8 solids 38 to 78 ns per element, more for larger ones.
static const double SPRING = 5e-9, ELEMENT = 4.5e-8;
// Time of every substep, however small the body [s]: contact and loops of 50 to 200 nodes.
static const double SUBSTEP = 5e-7;
// Time per spring of each linear solve of the implicit step [s]: 330 to 450 us with 2000 nodes.
static const double IMPLICIT_SPRING = 7e-8;

double cost_tick(const Body *body, int substeps)
{
    double each = (double)body->spring_count * SPRING;
    if (body->spring_count == 0)
        each = (double)body->element_count * ELEMENT;
    else if (body->integrator == INTEGRATOR_IMPLICIT)
        each = cost_implicit(body->spring_count);
    else
        each *= integrator_get(body->integrator)->evaluation_count; // evaluations of the forces
    return (double)substeps * (each + SUBSTEP);
}

double cost_implicit(int springs)
{
    return (double)springs * IMPLICIT_SPRING;
}
