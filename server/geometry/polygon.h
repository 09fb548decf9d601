// Cuts one polygon of a mesh into triangles. Load time only, private to geometry.
#ifndef PLIANT_GEOMETRY_POLYGON_H
#define PLIANT_GEOMETRY_POLYGON_H

#include "base/vec.h"

#include <stdbool.h>

enum { POLYGON_CORNERS = 1024 }; // most corners of a polygon that is not convex

// Writes count - 2 triangles, corners as indices in [0, count), with the orientation of the
// polygon. A concave polygon is cut along inner diagonals; one with collinear corners is cut
// arbitrarily. The cut does not depend on the corner at which the list begins nor on its direction.
// Corners with equal `key` are the same node; count >= 3, no two successive corners have the same
// key. False for a polygon that crosses itself, or is concave and has more than POLYGON_CORNERS
// corners.
bool polygon_triangulate(const Vec3 *corner, const int *key, int count, int (*triangle)[3]);

#endif
