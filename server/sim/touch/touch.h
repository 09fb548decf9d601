// SPDX-License-Identifier: MIT
// Contact between the surfaces of two bodies, or of a body with itself: the pieces that it is cut
// into, its folds, and a solid's lips of cuts (server/sim/README.md, "Contact between bodies").
// Both sides feel exactly opposite forces. Step thread unless stated.
#ifndef PLIANT_SIM_TOUCH_H
#define PLIANT_SIM_TOUCH_H

#include "body/body.h"
#include "sim/places.h"

typedef struct TouchOptions {
    int body[2];      // indices; twice the same: the body with itself
    double stiffness; // g: share of the bodies' own stiffness that it may add
    double friction;  // mu
    double thickness; // distance at which the surfaces rest on each other [m]; negative: 0, or of a
                      // hollow body with itself TOUCH_THICKNESS edges
} TouchOptions;

static const double TOUCH_THICKNESS = 0.1; // of the body's longest edge

typedef struct Touch Touch;

// Returns the number of bodies, 2 or 1; loops over TouchOptions.body end there.
static inline int touch_bodies(const TouchOptions *options)
{
    return options->body[0] == options->body[1] ? 1 : 2;
}

// Load time. The bodies, in the order of the options, outlive it. Memory is from `arena`; what it
// remembers is listed in `state`.
Touch *touch_create(const char *name, const TouchOptions *options, Body *first, Body *second,
                    double tick, Arena *arena, StateList *state);
const TouchOptions *touch_options(const Touch *touch);
// Returns the most nodes of a body, by index in the options (0 or 1), that it pushes in one
// evaluation.
int touch_node_capacity(const Touch *touch, int which);

// Returns the thickness of options for bodies that exist [m].
double touch_thickness(const TouchOptions *options, const Body *first);

// Returns what it adds to the bounds of M^-1 K [1/s2] and M^-1 C [1/s] of one of its bodies.
void touch_bounds(const TouchOptions *options, const Body *body, double *lambda, double *damping);

// Finds what can touch within the tick, if that is not known yet. Returns true if touch_shortens
// has changed. `step`: ticks completed.
bool touch_begin_tick(Touch *touch, int64_t step);
// True while the steps of its bodies have to allow for it: always but for a whole body with itself,
// in ticks in which nothing of it is near.
bool touch_shortens(const Touch *touch);
// True if anything can touch in this tick: without, an evaluation does nothing.
bool touch_is_near(const Touch *touch);
// Adds the forces of one evaluation to both bodies. `dt`: time since the start of the substep [s].
void touch_apply(Touch *touch, double dt);
// Keeps what friction remembers.
void touch_end_substep(Touch *touch);
// True if friction remembers what can be: a tick that ends otherwise is a bad one.
bool touch_can_rub(const Touch *touch);
// Forgets friction: a body was restored, whose bristles are of another motion.
void touch_forget_friction(Touch *touch);

// Adds the nodes of a body that something of the other, or of itself, is near, and where the other
// will be within `ahead` [s] as both move now.
void touch_add_places(const Touch *touch, double ahead, Places *places);

// Follows a change of topology of the body with this index of the options.
void touch_topology_changed(Touch *touch, int which, const TopologyChange *change);
// Recomputes what depends on the state after it was restored. `step`: ticks completed.
void touch_restored(Touch *touch, int64_t step);
// True if the state read from a checkpoint is consistent.
bool touch_check(const Touch *touch);

// Since the start, summed over searches: points and faces near each other beyond the capacity, and
// nodes of smooth surfaces without memory for what carries them.
int64_t touch_refused(const Touch *touch);

#endif
