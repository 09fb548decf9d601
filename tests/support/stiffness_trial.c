// SPDX-License-Identifier: MIT
#include "stiffness_trial.h"

#include "expect.h"

#include "sim/contact/stiffness.h"

static const double STEP = 20e-6, RAMP = 0.5; // [m], [s]

// The force after the tool has gone by `way` in RAMP, from the state in `start`.
static Vec3 ramped(Sim *sim, StateList *state, const void *start, Vec3 from, Vec3 way)
{
    state_copy_in(state, start);
    int ticks = (int)lround(RAMP / sim_tick(sim));
    for (int i = 1; i <= ticks; i++) {
        ToolPose pose = {.position = vec3_madd(from, (double)i / ticks, way),
                         .orientation = {1.0, 0.0, 0.0, 0.0},
                         .active = true};
        sim_apply_pose(sim, 0, &pose, true);
        sim_step(sim);
    }
    return sim_wrench(sim, 0)->force;
}

// -dF/dx by central differences, its symmetric part.
static Sym3 measure(Sim *sim, StateList *state, Vec3 from)
{
    FREED void *start = malloc(state_bytes(state));
    state_copy_out(state, start);
    double m[3][3];
    for (int c = 0; c < 3; c++) {
        Vec3 way = {c == 0 ? STEP : 0.0, c == 1 ? STEP : 0.0, c == 2 ? STEP : 0.0};
        Vec3 ahead = ramped(sim, state, start, from, way);
        Vec3 back = ramped(sim, state, start, from, vec3_scale(-1.0, way));
        Vec3 d = vec3_scale(-0.5 / STEP, vec3_sub(ahead, back));
        m[0][c] = d.x, m[1][c] = d.y, m[2][c] = d.z;
    }
    return (Sym3){m[0][0],
                  m[1][1],
                  m[2][2],
                  0.5 * (m[1][2] + m[2][1]),
                  0.5 * (m[2][0] + m[0][2]),
                  0.5 * (m[0][1] + m[1][0])};
}

static double norm(Sym3 k)
{
    return sqrt(k.xx * k.xx + k.yy * k.yy + k.zz * k.zz +
                2.0 * (k.yz * k.yz + k.zx * k.zx + k.xy * k.xy));
}

StiffnessVerdict stiffness_judge(Sim *sim, StateList *state)
{
    const ToolWrench reported = *sim_wrench(sim, 0);
    double least, most;
    StiffnessVerdict verdict;
    assert_true(reported.contact);
    const Sym3 measured = measure(sim, state, reported.position);
    const Sym3 difference = sym3_madd(reported.stiffness, -1.0, measured);
    stiffness_eigenvalues(reported.stiffness, &verdict.reported_least, &verdict.reported_most);
    stiffness_eigenvalues(measured, &least, &most);
    verdict.error = norm(difference) / norm(measured);
    verdict.normal =
        sym3_along(reported.stiffness, reported.normal) / sym3_along(measured, reported.normal);
    stiffness_eigenvalues(difference, &least, &verdict.short_by);
    verdict.short_by = fmin(0.0, least) / most;
    printf("reported %.3g to %.3g N/m, damping %.3g, error %.2f, along the normal %.2f, short by "
           "%.2f\n",
           verdict.reported_least, verdict.reported_most, reported.damping, verdict.error,
           verdict.normal, verdict.short_by);
    expect_at_least(verdict.reported_least, -1e-7 * verdict.reported_most); // an arc cosine
    expect_at_least(reported.damping, 0.0);
    return verdict;
}
