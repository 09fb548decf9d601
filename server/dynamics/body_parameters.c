#include "dynamics/body_parameters.h"

bool body_parameters_set(BodyParameters *parameters, bool damped, BodyParameter parameter,
                         double value)
{
    switch (parameter) {
    case BODY_GRAVITY_X:
    case BODY_GRAVITY_Y:
    case BODY_GRAVITY_Z:
        parameters->gravity[parameter - BODY_GRAVITY_X] = value;
        return true;
    case BODY_STIFFNESS_SCALE:
        parameters->stiffness_scale = value;
        return true;
    case BODY_DAMPING_SCALE:
        if (damped)
            parameters->damping_scale = value;
        return damped;
    case BODY_ADAPT_FORCE:
    case BODY_ADAPT_SPEED:
    case BODY_ADAPT_CURVATURE:
    case BODY_ADAPT_SCALE:
    case BODY_ADAPT_LEVEL:
        return false;
    }
    return false;
}
