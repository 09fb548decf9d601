// SPDX-License-Identifier: MIT
// Private to the module sim: where nodes of a body are, as a box around them.
#ifndef PLIANT_SIM_PLACES_H
#define PLIANT_SIM_PLACES_H

#include "body/body.h"
#include "geometry/box.h"

enum { PLACES_AT_ONCE = 64 };

// Nodes wait until there are enough to be read together.
typedef struct Places {
    const Body *body;
    Box box;   // [m] around those that were read
    bool flat; // what acts on them does not act on what is above them
    int count, node[PLACES_AT_ONCE];
} Places;

static inline Places places_of(const Body *body)
{
    return (Places){.body = body, .box = box_empty()};
}

// Reads the nodes that wait: the box is then complete.
static inline void places_read(Places *places)
{
    Vec3 x[PLACES_AT_ONCE];
    places->body->ops->read_nodes(places->body->model, places->node, places->count, x, NULL);
    for (int i = 0; i < places->count; i++)
        box_add(&places->box, x[i]);
    places->count = 0;
}

static inline void places_add(Places *places, int node)
{
    if (places->count == PLACES_AT_ONCE)
        places_read(places);
    places->node[places->count++] = node;
}

#endif
