// Convex hull of points in convex position (every point is a corner), such as points on a sphere.
// Load time only, private to geometry.
#ifndef PLIANT_GEOMETRY_HULL_H
#define PLIANT_GEOMETRY_HULL_H

#include "base/vec.h"

#include <stdbool.h>

// Writes the 2 count - 4 triangles of the hull, outward. The points are distinct, of size about 1
// and not all in one plane; count >= 4. Four points coplanar within rounding get either diagonal.
// False, with undefined triangles, if some point is not a corner of the hull.
bool hull_triangulate(const Vec3 *point, int count, int (*triangle)[3]);

#endif
