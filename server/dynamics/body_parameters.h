// Parameters that SET can change for every body while a scene runs; plain data, part of the state.
#ifndef PLIANT_DYNAMICS_BODY_PARAMETERS_H
#define PLIANT_DYNAMICS_BODY_PARAMETERS_H

#include "dynamics/body.h"

typedef struct BodyParameters {
    double gravity[3]; // world frame [m/s2]
    double stiffness_scale, damping_scale;
} BodyParameters;

// Returns the parameters as loaded: scales of 1.
static inline BodyParameters body_parameters(Vec3 gravity)
{
    return (BodyParameters){{gravity.x, gravity.y, gravity.z}, 1.0, 1.0};
}

// Implements BodyOps.set for these; returns false for others, and for damping without a damped
// kernel.
bool body_parameters_set(BodyParameters *parameters, bool damped, BodyParameter parameter,
                         double value);

#endif
