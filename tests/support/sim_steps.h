// SPDX-License-Identifier: MIT
// What tests ask of a simulation again and again: ticks, poses, loads, settings, figures, states.
#ifndef PLIANT_TESTS_SIM_STEPS_H
#define PLIANT_TESTS_SIM_STEPS_H

#include "expect.h"

#include "sim/sim.h"

// In the braces of ToolOptions: a ball, or a capsule of so much between its ends along x.
#define PROBE(radius_m, force)                                                                     \
    .id = 1, .kind = TOOL_PROBE, .capsule_count = 1, .capsule = {{.radius = (radius_m)}},          \
    .max_force = (force)
#define CAPSULE(length, radius_m, force)                                                           \
    .id = 1, .kind = TOOL_PROBE, .capsule_count = 1,                                               \
    .capsule = {{{-0.5 * (length), 0.0, 0.0}, {0.5 * (length), 0.0, 0.0}, (radius_m)}},            \
    .max_force = (force)

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

// Fail the test with the reason where it is refused.
static inline void load_or_fail(Sim *sim, const LoadOptions *load)
{
    char why[256] = "";
    if (!sim_apply_load(sim, load, why, sizeof why))
        fail_msg("%s", why);
}

static inline void set_or_fail(Sim *sim, const char *key, double value)
{
    char why[256] = "";
    if (!sim_apply_set(sim, key, value, why, sizeof why))
        fail_msg("%s", why);
}

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
    Vec3 linear, angular; // about the origin
} Momentum;

static inline Momentum momentum_of(int count, const double *mass, const Vec3 *x, const Vec3 *v)
{
    Momentum sum = {0};
    for (int i = 0; i < count; i++) {
        const Vec3 p = vec3_scale(mass[i], v[i]);
        sum.linear = vec3_add(sum.linear, p);
        sum.angular = vec3_add(sum.angular, vec3_cross(x[i], p));
    }
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
