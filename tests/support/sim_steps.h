// SPDX-License-Identifier: MIT
// What tests ask of a simulation again and again: ticks, poses, loads, settings, figures, states.
#ifndef PLIANT_TESTS_SIM_STEPS_H
#define PLIANT_TESTS_SIM_STEPS_H

#include "expect.h"

#include "base/team.h"
#include "sim/sim.h"

// In the braces of ToolOptions: a ball, or a capsule of so much between its ends along x.
#define PROBE(radius_m, force)                                                                     \
    .id = 1, .kind = TOOL_PROBE, .capsule_count = 1, .capsule = {{.radius = (radius_m)}},          \
    .max_force = (force)
#define CAPSULE(length, radius_m, force)                                                           \
    .id = 1, .kind = TOOL_PROBE, .capsule_count = 1,                                               \
    .capsule = {{{-0.5 * (length), 0.0, 0.0}, {0.5 * (length), 0.0, 0.0}, (radius_m)}},            \
    .max_force = (force)

// For SCOPED, above what uses the team.
static inline void team_end(Team **team)
{
    team_destroy(*team);
}

static inline void fix_within(BodyOptions *body, const FixedRegion *region)
{
    body->fixed = region;
    body->fixed_count = 1;
}

static inline void sim_ticks(Sim *sim, long count)
{
    for (long i = 0; i < count; i++)
        sim_step(sim);
}

// Moves a tool there at once, not turned.
static inline void put_tool(Sim *sim, int tool, Vec3 position)
{
    const ToolPose pose = {
        .position = position, .orientation = {1.0, 0.0, 0.0, 0.0}, .active = true};
    sim_apply_pose(sim, tool, &pose, true);
}

static inline void withdraw_tool(Sim *sim, int tool)
{
    const ToolPose pose = {.orientation = {1.0, 0.0, 0.0, 0.0}};
    sim_apply_pose(sim, tool, &pose, true);
}

// sim_apply_...(...) with these arguments takes effect; fails with why it does not.
#define apply_well(function, ...)                                                                  \
    do {                                                                                           \
        char why_[256] = "";                                                                       \
        if (!function(__VA_ARGS__, why_, sizeof why_))                                             \
            fail_msg("%s", why_);                                                                  \
    } while (0)

static inline BodyMeasure measure_of(const Body *body)
{
    BodyMeasure measure;
    body->ops->measure(body->model, &measure);
    return measure;
}

// Kinetic and elastic [J].
static inline double energy_of(const Body *body)
{
    const BodyMeasure now = measure_of(body);
    return now.kinetic + now.elastic;
}

typedef struct Momentum {
    double mass;
    Vec3 linear, angular; // about the origin
} Momentum;

static inline void momentum_add(Momentum *sum, double mass, Vec3 x, Vec3 v)
{
    sum->mass += mass;
    sum->linear = vec3_madd(sum->linear, mass, v);
    sum->angular = vec3_madd(sum->angular, mass, vec3_cross(x, v));
}

static inline Momentum momentum_of(int count, const double *mass, const Vec3 *x, const Vec3 *v)
{
    Momentum sum = {0};
    for (int i = 0; i < count; i++)
        momentum_add(&sum, mass[i], x[i], v[i]);
    return sum;
}

// Returns a copy, to be freed.
static inline void *copy_state(const StateList *state)
{
    void *copy = malloc(state_bytes(state));
    assert_non_null(copy);
    state_copy_out(state, copy);
    return copy;
}

// Goes on from a copied state, of this simulation or of one like it.
static inline void resume(StateList *state, Sim *sim, const void *copy)
{
    state_copy_in(state, copy);
    sim_restored(sim);
}

#endif
