// SPDX-License-Identifier: MIT
// Regions of space: those in which a scene fixes or attaches nodes, and those in which nodes are
// searched.
#ifndef PLIANT_BODY_REGION_H
#define PLIANT_BODY_REGION_H

#include "base/vec.h"

#include <math.h>
#include <stdbool.h>

// --- of a scene ---

typedef enum FixedKind { FIXED_BOX, FIXED_SPHERE, FIXED_NODES } FixedKind;
typedef struct FixedRegion {
    FixedKind kind;
    Vec3 low, high;  // box [m]
    Vec3 center;     // sphere [m]
    double radius;   // [m]
    const int *node; // indices in the mesh file [node_count], owned by the scene
    int node_count;
} FixedRegion;

// True if a point is in the box or sphere, borders included.
static inline bool fixed_contains(const FixedRegion *region, Vec3 x)
{
    if (region->kind == FIXED_BOX)
        return x.x >= region->low.x && x.y >= region->low.y && x.z >= region->low.z &&
               x.x <= region->high.x && x.y <= region->high.y && x.z <= region->high.z;
    return vec3_length(vec3_sub(x, region->center)) <= region->radius;
}

// --- to search ---

typedef enum RegionKind { REGION_CAPSULE, REGION_BELOW_PLANE } RegionKind;
typedef struct Region {
    RegionKind kind;
    Vec3 from, to; // axis of the capsule; or point and unit normal of the plane
    double radius; // [m]; for the plane: signed height below which nodes are found
} Region;

// Returns the distance of a point from a capsule's axis [m].
static inline double region_distance(const Region *capsule, Vec3 x)
{
    const Vec3 axis = vec3_sub(capsule->to, capsule->from), d = vec3_sub(x, capsule->from);
    const double square = vec3_dot(axis, axis);
    const double t = square > 0.0 ? fmax(0.0, fmin(1.0, vec3_dot(d, axis) / square)) : 0.0;
    return vec3_length(vec3_madd(d, -t, axis));
}

// A region prepared for testing many points, most of which lie outside of a box around it.
typedef struct RegionTest {
    bool plane;
    Vec3 from, axis;      // from -> to, or the plane's normal
    double square;        // of the axis
    double limit;         // square of the radius, or height
    Vec3 middle, halfway; // of a box around it, and from there to the sides
} RegionTest;

static inline RegionTest region_test(const Region *region)
{
    if (region->kind == REGION_BELOW_PLANE)
        return (RegionTest){.plane = true,
                            .from = region->from,
                            .axis = region->to,
                            .limit = region->radius,
                            .halfway = {(double)INFINITY, (double)INFINITY, (double)INFINITY}};
    const Vec3 axis = vec3_sub(region->to, region->from);
    // Larger by more than all that is rounded.
    const double size = region->radius + fabs(axis.x) + fabs(axis.y) + fabs(axis.z),
                 reach = region->radius + 1e-6 * size;
    return (RegionTest){.from = region->from,
                        .axis = axis,
                        .square = vec3_dot(axis, axis),
                        .limit = region->radius * region->radius,
                        .middle = vec3_madd(region->from, 0.5, axis),
                        .halfway = {0.5 * fabs(axis.x) + reach, 0.5 * fabs(axis.y) + reach,
                                    0.5 * fabs(axis.z) + reach}};
}

static inline bool region_contains(const RegionTest *test, Vec3 x)
{
    Vec3 d = vec3_sub(x, test->middle);
    if (fabs(d.x) > test->halfway.x || fabs(d.y) > test->halfway.y || fabs(d.z) > test->halfway.z)
        return false;
    d = vec3_sub(x, test->from);
    double along = vec3_dot(d, test->axis);
    if (test->plane)
        return along < test->limit;
    double t = test->square > 0.0 ? along / test->square : 0.0;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    d = vec3_madd(d, -t, test->axis);
    return vec3_dot(d, d) <= test->limit;
}

#endif
