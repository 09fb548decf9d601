// SPDX-License-Identifier: MIT
// Contact between bodies on a smooth surface (server/sim/README.md, "Contact between bodies"): the
// places of its nodes follow linearly from vertices, the carriers, and forces go back to these by
// the same weights. Step thread, except touch_fit_create.
#include "sim/touch/touch_data.h"

#include <string.h>

void touch_fit_create(TouchEnd *end, const char *name, Arena *arena)
{
    const int nodes = end->body->surface.node_count, vertices = end->body->state_capacity;
    TouchFit *fit = ALLOCATE(ARENA_CONTACT, 1, TouchFit, "fit");
    end->fit = fit;
    fit->weight_capacity = FIT_MEAN_WEIGHTS * nodes;
    fit->weight = ALLOCATE(ARENA_CONTACT, fit->weight_capacity, FitWeight, "weights");
    fit->first = ALLOCATE(ARENA_CONTACT, nodes, int, "first weights");
    fit->weights = ALLOCATE(ARENA_CONTACT, nodes, int, "numbers of weights");
    fit->shift = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "shifts");
    fit->mark = ALLOCATE(ARENA_CONTACT, vertices, int, "marks");
    fit->vertex = ALLOCATE(ARENA_CONTACT, vertices, int, "carriers");
    fit->number = ALLOCATE(ARENA_CONTACT, vertices, int, "carriers of vertices");
    fit->x = ALLOCATE(ARENA_CONTACT, vertices, Vec3, "carrier positions");
    fit->v = ALLOCATE(ARENA_CONTACT, vertices, Vec3, "carrier velocities");
    fit->f = ALLOCATE(ARENA_CONTACT, vertices, Vec3, "carrier forces");
    memset(fit->mark, -1, (size_t)vertices * sizeof *fit->mark);
    memset(fit->number, -1, (size_t)vertices * sizeof *fit->number);
    touch_fit_forget(end);
}

void touch_fit_forget(const TouchEnd *end)
{
    TouchFit *fit = end->fit;
    fit->weight_count = 0;
    memset(fit->first, -1, (size_t)end->body->surface.node_count * sizeof *fit->first);
}

// Finds what carries a node, if that is not known. Without memory for it, the node is where its
// vertex is.
static void find_carriers(const TouchEnd *end, int node)
{
    TouchFit *fit = end->fit;
    FitNode from;
    FitWeight weight[FIT_WEIGHTS];
    if (fit->first[node] >= 0)
        return;
    end->body->ops->fit_node(end->body->model, node, fit->step, &from);
    const int count = fit_weights(&from, node, fit->mark, weight);
    const bool fits = fit->weight_count + count <= fit->weight_capacity;
    fit->first[node] = fits ? fit->weight_count : 0;
    fit->weights[node] = fits ? count : 0;
    fit->shift[node] = from.shift;
    if (fits)
        memcpy(fit->weight + fit->weight_count, weight, (size_t)count * sizeof *weight);
    fit->weight_count += fits ? count : 0;
    fit->refused += !fits;
}

const FitWeight *touch_weights(const TouchEnd *end, int node, FitWeight *own, int *count)
{
    *own = (FitWeight){node, 1.0};
    *count = 1;
    if (end->fit == NULL)
        return own;
    find_carriers(end, node);
    if (end->fit->weights[node] == 0)
        return own;
    *count = end->fit->weights[node];
    return end->fit->weight + end->fit->first[node];
}

double touch_size(const TouchEnd *end, int node)
{
    FitWeight own;
    int count;
    double sum = 0.0;
    const FitWeight *weight = touch_weights(end, node, &own, &count);
    for (int w = 0; w < count; w++)
        sum += fabs(weight[w].weight);
    return sum;
}

void touch_fit_list(const TouchEnd *end, const int *node, int nodes)
{
    TouchFit *fit = end->fit;
    for (int i = 0; i < fit->count; i++)
        fit->number[fit->vertex[i]] = -1;
    fit->count = 0;
    for (int i = 0; i < nodes; i++) {
        FitWeight own;
        int count;
        const FitWeight *weight = touch_weights(end, node[i], &own, &count);
        for (int w = 0; w < count; w++) {
            int *number = &fit->number[weight[w].vertex];
            if (*number >= 0)
                continue;
            *number = fit->count;
            fit->vertex[fit->count++] = weight[w].vertex;
        }
    }
}

// Returns the weighted sum of what carriers have.
static Vec3 carry(const TouchEnd *end, int node, const Vec3 *of)
{
    FitWeight own;
    int count;
    Vec3 sum = {0.0, 0.0, 0.0};
    const FitWeight *weight = touch_weights(end, node, &own, &count);
    for (int w = 0; w < count; w++)
        sum = vec3_madd(sum, weight[w].weight, of[end->fit->number[weight[w].vertex]]);
    return sum;
}

void touch_fit_read(const TouchEnd *end, const int *node, int nodes, Vec3 *x, Vec3 *v)
{
    const TouchFit *fit = end->fit;
    end->body->ops->read_nodes(end->body->model, fit->vertex, fit->count, fit->x,
                               v == NULL ? NULL : fit->v);
    for (int i = 0; i < nodes; i++) {
        x[i] = vec3_add(carry(end, node[i], fit->x), fit->shift[node[i]]);
        if (v != NULL)
            v[i] = carry(end, node[i], fit->v);
    }
}

void touch_fit_push(const TouchEnd *end)
{
    const TouchFit *fit = end->fit;
    memset(fit->f, 0, (size_t)fit->count * sizeof *fit->f);
    for (int i = 0; i < end->count; i++) {
        FitWeight own;
        int count;
        const FitWeight *weight = touch_weights(end, end->node[i], &own, &count);
        for (int w = 0; w < count; w++) {
            Vec3 *f = &fit->f[fit->number[weight[w].vertex]];
            *f = vec3_madd(*f, weight[w].weight, end->f[i]);
        }
    }
    end->body->ops->add_forces(end->body->model, fit->vertex, fit->count, fit->f);
}
