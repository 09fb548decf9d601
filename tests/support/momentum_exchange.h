// SPDX-License-Identifier: MIT
// A free body struck by a turning capsule: in every tick the change of its momentum is minus the
// impulse on the tool.
#ifndef PLIANT_TESTS_MOMENTUM_EXCHANGE_H
#define PLIANT_TESTS_MOMENTUM_EXCHANGE_H

#include "sim_steps.h"

typedef struct MomentumExchange {
    double impulse, moment;         // the largest of a tick [N s, N m s], about the origin
    double impulse_lost, turn_lost; // the largest that a tick neither took nor gave
} MomentumExchange;

// The momentum of the body at the end of a tick, about the origin.
typedef Momentum (*ReadMomentum)(void *world);

// Moves tool 0 for so many ticks: down from z = 0.058 by `depth` [m] and back, at `rate` [rad/s].
static inline MomentumExchange exchange_momentum(Sim *sim, int ticks, double depth, double rate,
                                                 ReadMomentum read, void *world)
{
    MomentumExchange sum = {0.0, 0.0, 0.0, 0.0};
    const double tick = sim_tick(sim);
    Momentum last = read(world);
    for (int i = 0; i < ticks; i++) {
        const double t = i * tick;
        const ToolPose pose = {
            .position = {0.02 * sin(9.0 * t), 0.01, 0.058 - depth * sin(rate * t)},
            .orientation = quat_from_rotation(vec3(0.4 * sin(11.0 * t), 0.3 * t, 2.0 * t)),
            .active = true};
        sim_apply_pose(sim, 0, &pose, true);
        sim_step(sim);
        const ToolWrench *wrench = sim_wrench(sim, 0);
        const Vec3 impulse = vec3_scale(tick, wrench->force);
        const Vec3 moment =
            vec3_scale(tick, vec3_add(wrench->torque, vec3_cross(wrench->position, wrench->force)));
        const Momentum now = read(world);
        const Vec3 lost = vec3_add(vec3_sub(now.linear, last.linear), impulse);
        const Vec3 turn = vec3_add(vec3_sub(now.angular, last.angular), moment);
        sum.impulse = fmax(sum.impulse, vec3_length(impulse));
        sum.moment = fmax(sum.moment, vec3_length(moment));
        sum.impulse_lost = fmax(sum.impulse_lost, vec3_length(lost));
        sum.turn_lost = fmax(sum.turn_lost, vec3_length(turn));
        last = now;
    }
    return sum;
}

#endif
