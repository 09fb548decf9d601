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

#endif
