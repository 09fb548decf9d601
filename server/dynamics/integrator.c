#include "dynamics/integrator.h"

#include <string.h>

static const char *const names[INTEGRATOR_COUNT] = {"rk4", "leapfrog", "symplectic_euler",
                                                    "implicit"};

static const Integrator integrators[INTEGRATOR_COUNT] = {
    [INTEGRATOR_RK4] = {.order = 4,
                        .stage_count = 4,
                        .stage = {{STAGE_RK4_FIRST, 0.0, 1.0 / 6.0, 0.5, false},
                                  {STAGE_RK4_MIDDLE, 0.5, 1.0 / 3.0, 0.5, false},
                                  {STAGE_RK4_MIDDLE, 0.5, 1.0 / 3.0, 1.0, false},
                                  {STAGE_RK4_LAST, 1.0, 1.0 / 6.0, 0.0, false}}},
    [INTEGRATOR_LEAPFROG] = {.order = 2,
                             .stage_count = 1,
                             .stage = {{STAGE_KICK, 0.5, 1.0, 1.0, false}},
                             .kicks = true,
                             .first_drift = 0.5,
                             .last_drift = 0.5},
    [INTEGRATOR_SYMPLECTIC_EULER] = {.order = 1,
                                     .stage_count = 1,
                                     .stage = {{STAGE_KICK, 0.0, 1.0, 1.0, false}},
                                     .kicks = true,
                                     .first_drift = 0.0,
                                     .last_drift = 1.0},
    [INTEGRATOR_IMPLICIT] = {.order = 1,
                             .stage_count = 1,
                             .stage = {{STAGE_IMPLICIT, 0.5, 1.0, 1.0, false}},
                             .kicks = true,
                             .first_drift = 1.0,
                             .last_drift = 1.0},
};

const char *integrator_name(IntegratorKind kind)
{
    return names[kind];
}

bool integrator_parse(const char *name, IntegratorKind *kind)
{
    for (int i = 0; i < INTEGRATOR_COUNT; i++) {
        if (strcmp(name, names[i]) == 0) {
            *kind = (IntegratorKind)i;
            return true;
        }
    }
    return false;
}

const Integrator *integrator_get(IntegratorKind kind)
{
    return &integrators[kind];
}

Stage integrator_stage(const Integrator *integrator, int s, bool last)
{
    Stage stage = integrator->stage[s];
    stage.last = last;
    if (integrator->kicks && last)
        stage.advance = integrator->last_drift;
    return stage;
}
