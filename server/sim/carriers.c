// SPDX-License-Identifier: MIT
#include "sim/carriers.h"

#include <string.h>

void carriers_create(Carriers *carriers, const Body *body, int nodes, int capacity, bool keeps,
                     const char *name, Arena *arena)
{
    const int vertices = body->state_capacity, slots = body->surface.node_count;
    *carriers = (Carriers){
        .body = body, .capacity = capacity, .weight_capacity = nodes * (FIT_MEAN_WEIGHTS - 1)};
    carriers->node = ALLOCATE(ARENA_CONTACT, capacity, int, "carriers");
    carriers->x = ALLOCATE(ARENA_CONTACT, capacity, Vec3, "carrier positions");
    carriers->f = ALLOCATE(ARENA_CONTACT, capacity, Vec3, "carrier forces");
    carriers->follower = ALLOCATE(ARENA_CONTACT, nodes, Follower, "nodes that follow");
    carriers->weight =
        ALLOCATE(ARENA_CONTACT, carriers->weight_capacity + nodes, CarrierWeight, "weights");
    carriers->carrier_of = ALLOCATE(ARENA_CONTACT, vertices, int, "carriers of vertices");
    memset(carriers->carrier_of, -1, (size_t)vertices * sizeof *carriers->carrier_of);
    carriers->mark = ALLOCATE(ARENA_CONTACT, vertices, int, "weights of vertices");
    memset(carriers->mark, -1, (size_t)vertices * sizeof *carriers->mark);
    carriers->read = ALLOCATE(ARENA_CONTACT, vertices, int64_t, "searches of vertices");
    carriers->vertex = ALLOCATE(ARENA_CONTACT, vertices, Vec3, "vertices read");
    carriers->found = ALLOCATE(ARENA_CONTACT, slots, int64_t, "searches of nodes");
    carriers->place = ALLOCATE(ARENA_CONTACT, slots, Vec3, "places of nodes");
    if (!keeps)
        return;
    carriers->known = ALLOCATE(ARENA_CONTACT, slots, Follower, "known nodes");
    carriers->kept_capacity = FIT_MEAN_WEIGHTS * slots;
    carriers->kept = ALLOCATE(ARENA_CONTACT, carriers->kept_capacity, FitWeight, "known weights");
}

void carriers_forget(Carriers *carriers)
{
    const size_t slots = (size_t)carriers->body->surface.node_count;
    carriers->kept_count = 0;
    if (carriers->known != NULL)
        memset(carriers->known, 0, slots * sizeof *carriers->known);
}

// Finds what a node follows from, unless it is known: all of `to` but `first`. Returns the weights,
// `found` or kept ones.
static const FitWeight *find_weights(Carriers *carriers, int node, Follower *to,
                                     FitWeight found[FIT_WEIGHTS])
{
    const Body *body = carriers->body;
    Follower *known = carriers->known == NULL ? NULL : &carriers->known[node];
    if (known != NULL && known->count > 0) {
        *to = *known;
        return carriers->kept + known->first;
    }
    FitNode from;
    body->ops->fit_node(body->model, node, carriers->step, &from);
    *to = (Follower){.first = carriers->kept_count, .shift = from.shift};
    memcpy(to->rest, from.rest, sizeof to->rest);
    to->count = fit_weights(&from, node, carriers->mark, found);
    for (int w = 0; w < to->count; w++)
        to->size += fabs(found[w].weight);
    if (known != NULL && carriers->kept_count + to->count <= carriers->kept_capacity) {
        *known = *to;
        memcpy(carriers->kept + to->first, found, (size_t)to->count * sizeof *found);
        carriers->kept_count += to->count;
    }
    return found;
}

Vec3 carriers_vertex(Carriers *carriers, int vertex)
{
    const Body *body = carriers->body;
    if (carriers->read[vertex] != carriers->search) {
        carriers->read[vertex] = carriers->search;
        body->ops->read_nodes(body->model, &vertex, 1, &carriers->vertex[vertex], NULL);
    }
    return carriers->vertex[vertex];
}

static Vec3 find_place(Carriers *carriers, int node)
{
    Follower of;
    FitWeight found[FIT_WEIGHTS];
    const FitWeight *weight = find_weights(carriers, node, &of, found);
    Vec3 place = of.shift;
    for (int w = 0; w < of.count; w++)
        place = vec3_madd(place, weight[w].weight, carriers_vertex(carriers, weight[w].vertex));
    return place;
}

Vec3 carriers_place(Carriers *carriers, int node)
{
    if (carriers->found[node] != carriers->search) {
        carriers->found[node] = carriers->search;
        carriers->place[node] = find_place(carriers, node);
    }
    return carriers->place[node];
}

static int carrier_for(Carriers *carriers, int vertex)
{
    int *carrier = &carriers->carrier_of[vertex];
    if (*carrier < 0 && carriers->count < carriers->capacity) {
        *carrier = carriers->count;
        carriers->node[carriers->count++] = vertex;
    }
    return *carrier;
}

// Finds what carries a node; returns false without memory for all of it.
static bool list_node(Carriers *carriers, int node, Follower *to)
{
    FitWeight found[FIT_WEIGHTS];
    const FitWeight *weight = find_weights(carriers, node, to, found), own = {node, 1.0};
    to->first = carriers->weight_count;
    bool fits = carriers->weight_count + to->count <= carriers->weight_capacity;
    for (int w = 0; w < to->count && fits; w++)
        fits = carrier_for(carriers, weight[w].vertex) >= 0;
    if (!fits) {
        weight = &own;
        to->size = to->count = 1;
    }
    for (int w = 0; w < to->count; w++)
        carriers->weight[carriers->weight_count++] =
            (CarrierWeight){carrier_for(carriers, weight[w].vertex), weight[w].weight};
    return fits;
}

int carriers_list(Carriers *carriers, const int *node, int count)
{
    int refused = 0;
    carriers->count = carriers->follower == NULL ? count : 0;
    carriers->weight_count = 0;
    if (carriers->follower == NULL)
        return 0;
    // The nodes' own vertices first: there is room for them.
    for (int i = 0; i < count; i++)
        carrier_for(carriers, node[i]);
    for (int i = 0; i < count; i++)
        refused += !list_node(carriers, node[i], &carriers->follower[i]);
    for (int i = 0; i < carriers->count; i++)
        carriers->carrier_of[carriers->node[i]] = -1;
    return refused;
}

// Returns the weighted sum of what carriers have, on top of `sum`.
static Vec3 carry(const Carriers *carriers, int i, const Vec3 *of, Vec3 sum)
{
    const Follower *follower = &carriers->follower[i];
    const CarrierWeight *weight = carriers->weight + follower->first;
    for (int w = 0; w < follower->count; w++)
        sum = vec3_madd(sum, weight[w].weight, of[weight[w].carrier]);
    return sum;
}

void carriers_read(const Carriers *carriers, int count, Vec3 *x, Vec3 *v)
{
    const Body *body = carriers->body;
    if (carriers->follower == NULL) {
        body->ops->read_nodes(body->model, carriers->node, count, x, v);
        return;
    }
    body->ops->read_nodes(body->model, carriers->node, carriers->count, carriers->x,
                          v == NULL ? NULL : carriers->v);
    for (int i = 0; i < count; i++) {
        x[i] = carry(carriers, i, carriers->x, carriers->follower[i].shift);
        if (v != NULL)
            v[i] = carry(carriers, i, carriers->v, (Vec3){0.0, 0.0, 0.0});
    }
}

void carriers_give(const Carriers *carriers, int count, const Vec3 *f)
{
    const Body *body = carriers->body;
    if (carriers->follower == NULL) {
        body->ops->add_forces(body->model, carriers->node, count, f);
        return;
    }
    memset(carriers->f, 0, (size_t)carriers->count * sizeof *carriers->f);
    for (int i = 0; i < count; i++)
        carriers_push(carriers, i, f[i]);
    body->ops->add_forces(body->model, carriers->node, carriers->count, carriers->f);
}
