#include "dynamics/fixed.h"

bool fixed_contains(const FixedRegion *region, Vec3 x)
{
    if (region->kind == FIXED_BOX)
        return x.x >= region->low.x && x.y >= region->low.y && x.z >= region->low.z &&
               x.x <= region->high.x && x.y <= region->high.y && x.z <= region->high.z;
    return vec3_length(vec3_sub(x, region->center)) <= region->radius;
}
