// SPDX-License-Identifier: MIT
// The vertices of a body that carry nodes of its surface (server/sim/README.md, "Contact on a
// smooth surface"): the nodes themselves, or on a fitted surface (body/fit.h) their own vertices
// and those around. Places of nodes are read through them, and forces go back by the same weights.
// One for each contact and each end of a touch. Step thread, except carriers_create.
#ifndef PLIANT_SIM_CARRIERS_H
#define PLIANT_SIM_CARRIERS_H

#include "base/memory.h"
#include "base/sym3.h"
#include "body/body.h"

typedef struct CarrierWeight {
    int carrier;
    double weight;
} CarrierWeight;

// A listed node is where its carriers put it: at the weighted sum of their positions, and `shift`.
typedef struct Follower {
    int first, count; // of Carriers.weight; the node's own vertex first
    double size;      // sum of all |weight|
    double rest[3];   // [m]
    Vec3 shift;       // of a fade [m]
} Follower;

typedef struct Carriers {
    const Body *body;
    int count, capacity;
    int *node;       // vertex of the body [count]
    Vec3 *x, *v, *f; // position [m], velocity [m/s], NULL if never read, force [N]
    // Of contacts with solids only.
    Sym3 *lumped; // stiffness [N/m]
    double *push; // share of the pushes on the surface [N]; NULL: the size of `f`
    int *touched; // number among the touched ones
    // Of a fitted surface only.
    int64_t step;       // ticks completed: how far fades are
    Follower *follower; // of the nodes in the order of the list; NULL: nodes carry themselves
    CarrierWeight *weight;
    int weight_count, weight_capacity; // one for each listed node's own vertex not counted
    int *carrier_of, *mark;            // by vertex: -1, as fit_weights has it
    // By node of the surface, what it follows from, by vertex; count 0: not known. NULL: not kept.
    Follower *known;
    FitWeight *kept;
    int kept_count, kept_capacity;
    // Of a search, where `read` by vertex and `found` by node of the surface have its number:
    // positions of vertices and places of nodes [m].
    int64_t search, *read, *found;
    Vec3 *vertex, *place;
} Carriers;

// Load time. Creates what is needed for up to `nodes` nodes of a fitted surface at a time and up to
// `capacity` vertices that carry them, without the columns that only some have. `keeps`: the same
// nodes are asked for in many ticks, so what they follow from is kept until it is forgotten.
void carriers_create(Carriers *carriers, const Body *body, int nodes, int capacity, bool keeps,
                     const char *name, Arena *arena);
// To be called after a change of topology, and in each tick in which nodes fade.
void carriers_forget(Carriers *carriers);
// Return the position of any vertex and the place of any node, listed or not, of a fitted surface
// when they were first asked for in this search [m].
Vec3 carriers_vertex(Carriers *carriers, int vertex);
Vec3 carriers_place(Carriers *carriers, int node);
// Lists what carries these nodes. Without memory for all of its carriers a node is where its vertex
// is, for which there always is. Returns how many those are.
int carriers_list(Carriers *carriers, const int *node, int count);
// Reads places and velocities of the listed nodes; `v` may be NULL.
void carriers_read(const Carriers *carriers, int count, Vec3 *x, Vec3 *v);
// Gives forces on the listed nodes to the body.
void carriers_give(const Carriers *carriers, int count, const Vec3 *f);

// Returns the weights of listed node `i`; `own` is written where it carries itself.
static inline const CarrierWeight *carriers_of(const Carriers *carriers, int i, CarrierWeight *own,
                                               int *count)
{
    *own = (CarrierWeight){i, 1.0};
    *count = carriers->follower == NULL ? 1 : carriers->follower[i].count;
    return carriers->follower == NULL ? own : carriers->weight + carriers->follower[i].first;
}

// Returns the sum of the sizes of its weights.
static inline double carriers_size(const Carriers *carriers, int i)
{
    return carriers->follower == NULL ? 1.0 : carriers->follower[i].size;
}

// Adds a force on listed node `i` of a fitted surface to its carriers.
static inline void carriers_push(const Carriers *carriers, int i, Vec3 force)
{
    const Follower *follower = &carriers->follower[i];
    for (int w = follower->first; w < follower->first + follower->count; w++) {
        Vec3 *f = &carriers->f[carriers->weight[w].carrier];
        *f = vec3_madd(*f, carriers->weight[w].weight, force);
    }
}

#endif
