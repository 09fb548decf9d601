// SPDX-License-Identifier: MIT
// Closest points between points, segments and triangles. Pure functions, no state; valid for
// degenerate segments and triangles too.
#ifndef PLIANT_GEOMETRY_DISTANCE_H
#define PLIANT_GEOMETRY_DISTANCE_H

#include "base/vec.h"

#include <stdbool.h>

// The closest pair of a point or segment and a triangle.
typedef struct ClosestPair {
    double distance;  // [m]
    double weight[3]; // barycentric weights of the closest point on the triangle, >= 0, sum 1
    double along;     // parameter of the closest point on the segment, in [0, 1]
    // Positions of the pair [m]; of a point, on_segment is the point itself.
    Vec3 on_triangle;
    Vec3 on_segment;
} ClosestPair;

// Finds the closest point of triangle x to p (Ericson, Real-Time Collision Detection, 5.1.5, with
// fall-backs for triangles without area).
void distance_point_triangle(Vec3 p, const Vec3 x[3], ClosestPair *pair);

// Finds the closest points of the segments p q and a b; parameters in [0, 1].
void distance_segment_segment(Vec3 p, Vec3 q, Vec3 a, Vec3 b, double *s, double *t);

// Fills the five candidates for the closest pair of a segment and a triangle that do not cross: p
// and q against the face, the segment against the edges (x0,x1), (x1,x2), (x2,x0).
enum { DISTANCE_PAIRS = 5 };
void distance_segment_triangle_pairs(Vec3 p, Vec3 q, const Vec3 x[3],
                                     ClosestPair pair[DISTANCE_PAIRS]);

// True if the segment p q passes through the triangle; fills the crossing's parameter and weights.
bool distance_segment_crosses(Vec3 p, Vec3 q, const Vec3 x[3], double *along, double weight[3]);

// Returns the distance of a point to a segment [m].
double distance_point_segment(Vec3 point, Vec3 p, Vec3 q);

#endif
