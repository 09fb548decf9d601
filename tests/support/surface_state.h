// SPDX-License-Identifier: MIT
// The state of a surface body, for tests.
#ifndef PLIANT_TESTS_SURFACE_STATE_H
#define PLIANT_TESTS_SURFACE_STATE_H

#include "body/body.h"

// Reads positions [m] and velocities [m/s] in double precision: [node_count] in mesh order.
static inline void surface_read_state(const Body *body, Vec3 *position, Vec3 *velocity)
{
    body->ops->read_state(body->model, NULL, position, velocity);
}

#endif
