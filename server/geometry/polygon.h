// Cuts one polygon of a mesh into triangles. Load time only, private to geometry.
#ifndef PLIANT_GEOMETRY_POLYGON_H
#define PLIANT_GEOMETRY_POLYGON_H

#include "base/vec.h"

#include <stdbool.h>

enum { POLYGON_CORNERS = 1024 }; // most corners of a polygon that is not convex

// Writes count - 2 triangles, corners as indices in [0, count), turning as the polygon turns. A
// concave polygon is cut inside itself, one whose corners lie in a line is cut anyhow. The same
// polygon is cut alike wherever its list of corners begins and whichever way it runs. `key` says
// which corners are the same node; count >= 3, no two corners in a row have the same key. False for
// a polygon that crosses itself, or that is concave and has more than POLYGON_CORNERS corners.
bool polygon_triangulate(const Vec3 *corner, const int *key, int count, int (*triangle)[3]);

#endif
