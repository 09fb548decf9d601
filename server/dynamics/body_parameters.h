// What SET can change of every body while a scene runs; plain data, part of a body's state.
#ifndef PLIANT_DYNAMICS_BODY_PARAMETERS_H
#define PLIANT_DYNAMICS_BODY_PARAMETERS_H

#include "dynamics/body.h"

typedef struct BodyParameters {
    double gravity[3]; // in the world [m/s2]
    double stiffness_scale, damping_scale;
} BodyParameters;

// As loaded: scales of 1.
static inline BodyParameters body_parameters(Vec3 gravity)
{
    return (BodyParameters){{gravity.x, gravity.y, gravity.z}, 1.0, 1.0};
}

// BodyOps.set for these; false for all others, and for the damping of a body whose kernel has none.
bool body_parameters_set(BodyParameters *parameters, bool damped, BodyParameter parameter,
                         double value);

#endif
