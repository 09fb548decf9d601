// Scenes of bodies that touch, and what is measured of them. For one source file of a test.
#ifndef PLIANT_TESTS_TOUCHING_BODIES_H
#define PLIANT_TESTS_TOUCHING_BODIES_H

#include "expect.h"
#include "random.h"
#include "world_run.h"

#include "dynamics/sim_data.h"
#include "dynamics/touch_data.h"

#include <stdlib.h>

#define DOUBLE "precision = \"double\";\n"
// A cube of tissue of 4 cells along each edge, and a hollow ball; both free, of 40 mm.
#define CUBE(name, place, more)                                                                    \
    "{ name = \"" name "\"; model = \"voxel\";\n"                                                  \
    "  voxels = { generator = \"box\"; count = [4, 4, 4]; size = 0.01;\n"                          \
    "  place = { " place " }; };\n"                                                                \
    "  integrator = \"leapfrog\"; " more " }"
#define BALL(name, place, more)                                                                    \
    "{ name = \"" name "\"; mesh = { generator = \"sphere\"; nodes = 162; radius = 0.02;\n"        \
    "  place = { " place " }; };\n"                                                                \
    "  integrator = \"leapfrog\"; " more " }"
#define TOUCH(more) "touch = ( { bodies = [\"one\", \"two\"]; " more " } );\n"

static inline Touch *touch_of(Run *run)
{
    return run->world.sim->touch[0];
}

// Reads the ends of a touch as an evaluation does, with no speed.
static inline void read_still(Touch *touch)
{
    for (int e = 0; e < 2; e++) {
        TouchEnd *end = &touch->end[e];
        if (end->count > 0)
            end->body->ops->read_nodes(end->body->model, end->node, end->count, end->x, end->v);
        for (int i = 0; i < end->count; i++)
            end->v[i] = (Vec3){0, 0, 0};
    }
}

#endif
