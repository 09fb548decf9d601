// SPDX-License-Identifier: MIT
// Scenes of a ball and a bar that are held and tied, and what is measured of them. For one source
// file of a test.
#ifndef PLIANT_TESTS_TIED_BODIES_H
#define PLIANT_TESTS_TIED_BODIES_H

#include "expect.h"
#include "world_run.h"

#include "sim/sim_data.h"

// A ball of tissue without shape springs, and a bar of eight cells beside it.
#define BALL(name, place, more)                                                                    \
    "{ name = \"" name "\"; mesh = { generator = \"sphere\"; nodes = 162; radius = 0.05;\n"        \
    "  place = { translation = " place "; }; };\n"                                                 \
    "  integrator = \"leapfrog\"; " more " }"
#define BAR(name, more)                                                                            \
    "{ name = \"" name "\"; model = \"voxel\";\n"                                                  \
    "  voxels = { generator = \"box\"; count = [8, 1, 1]; size = 0.01;\n"                          \
    "  place = { translation = [0.1, 0, 0]; }; };\n"                                               \
    "  integrator = \"leapfrog\"; " more " }"
#define DOUBLE "precision = \"double\";\n"

typedef struct Momentum {
    double mass;
    Vec3 linear, angular;
} Momentum;

// Of bodies all whose vertices lie outside.
static inline Momentum momentum_of(Run *run)
{
    Momentum sum = {0};
    for (int b = 0; b < sim_body_count(run->world.sim); b++) {
        const Body *body = sim_body(run->world.sim, b);
        for (int i = 0; i < body->surface.node_count; i++) {
            Vec3 x, v;
            if (body->surface.node_face_end[i] <= body->surface.node_face_start[i])
                continue;
            body->ops->read_nodes(body->model, &i, 1, &x, &v);
            double mass = body->surface.node_mass[i];
            sum.mass += mass;
            sum.linear = vec3_madd(sum.linear, mass, v);
            sum.angular = vec3_madd(sum.angular, mass, vec3_cross(x, v));
        }
    }
    return sum;
}

#endif
