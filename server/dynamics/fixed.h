// Regions of fixed nodes.
#ifndef PLIANT_DYNAMICS_FIXED_H
#define PLIANT_DYNAMICS_FIXED_H

#include "base/vec.h"

#include <stdbool.h>

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

#endif
