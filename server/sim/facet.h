// SPDX-License-Identifier: MIT
// Places that the corners of a face carry, on its plane (also beyond its sides) and at a height
// above it: ends of springs between bodies (joint.c), points that rub on another body (touch.c).
// The place is z = sum_j w_j x_j + d n, with x_j the corners, n the unit normal; a force there goes
// to the corners by the transpose of dz/dx_j, so that its moment is kept.
#ifndef PLIANT_SIM_FACET_H
#define PLIANT_SIM_FACET_H

#include "base/vec.h"

#include <stdbool.h>

// A face's two sides from its first corner [m], twice its area [m2] and its unit normal.
typedef struct Facet {
    Vec3 a, b, normal;
    double twice;
} Facet;

// A place that it carries; plain data.
typedef struct FacetPlace {
    double weight[3]; // sum 1, some negative beyond the sides
    double offset;    // along the normal [m]
} FacetPlace;

// `x`: the corners [m].
static inline Facet facet_of(const Vec3 x[3])
{
    Facet facet = {.a = vec3_sub(x[1], x[0]), .b = vec3_sub(x[2], x[0])};
    const Vec3 cross = vec3_cross(facet.a, facet.b);
    facet.twice = vec3_length(cross);
    facet.normal = vec3_unit(cross);
    return facet;
}

// Finds how a face whose first corner is `corner` carries `target`. Returns false for a face
// without area, which carries nothing.
static inline bool facet_place(const Facet *facet, Vec3 corner, Vec3 target, FacetPlace *place)
{
    if (!(facet->twice > 1e-12 * vec3_dot(facet->a, facet->a)))
        return false;
    const Vec3 arm = vec3_sub(target, corner);
    place->offset = vec3_dot(arm, facet->normal);
    place->weight[1] = vec3_dot(vec3_cross(arm, facet->b), facet->normal) / facet->twice;
    place->weight[2] = vec3_dot(vec3_cross(facet->a, arm), facet->normal) / facet->twice;
    place->weight[0] = 1.0 - place->weight[1] - place->weight[2];
    return true;
}

static inline Vec3 facet_position(const Facet *facet, const FacetPlace *place, const Vec3 x[3])
{
    Vec3 z = vec3_scale(place->offset, facet->normal);
    for (int k = 0; k < 3; k++)
        z = vec3_madd(z, place->weight[k], x[k]);
    return z;
}

// `v`: velocities of the corners [m/s].
static inline Vec3 facet_velocity(const Facet *facet, const FacetPlace *place, const Vec3 v[3])
{
    const Vec3 a = vec3_sub(v[1], v[0]), b = vec3_sub(v[2], v[0]);
    Vec3 turn = vec3_add(vec3_cross(a, facet->b), vec3_cross(facet->a, b));
    turn = vec3_madd(turn, -vec3_dot(turn, facet->normal), facet->normal);
    Vec3 sum = vec3_scale(facet->twice > 0.0 ? place->offset / facet->twice : 0.0, turn);
    for (int k = 0; k < 3; k++)
        sum = vec3_madd(sum, place->weight[k], v[k]);
    return sum;
}

// Distributes a force at the place to the corners: `on` [N]. F . d dn = G . (da x b + a x db) with
// G = d (F - (F . n) n) / |a x b|.
static inline void facet_distribute(const Facet *facet, const FacetPlace *place, Vec3 force,
                                    Vec3 on[3])
{
    const Vec3 across = vec3_madd(force, -vec3_dot(force, facet->normal), facet->normal);
    const Vec3 g = vec3_scale(facet->twice > 0.0 ? place->offset / facet->twice : 0.0, across);
    const Vec3 first = vec3_cross(facet->b, g), second = vec3_cross(g, facet->a);
    on[0] = vec3_sub(vec3_scale(place->weight[0], force), vec3_add(first, second));
    on[1] = vec3_madd(first, place->weight[1], force);
    on[2] = vec3_madd(second, place->weight[2], force);
}

#endif
