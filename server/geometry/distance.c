// SPDX-License-Identifier: MIT
// Closest points for contact: pure double arithmetic, no allocation, safe on the step thread.
//
// Point against triangle and segment against segment are one problem: the point of a + u d + v e
// that is nearest to p, with (u, v) in a triangle or a square. The nearest point of the plane comes
// from Gram-Schmidt (v from the part of e across d, then u from the remainder) and not from the
// normal equations: their determinant cancels for slivers and nearly parallel segments, with a
// first-order error along the long side. If that point is outside, the nearest one is on a side
// that separates it from the inside, so that only sides whose bound is violated are tried.
#include "geometry/distance.h"

// Directions whose part across is below this fraction (squared) count as parallel. The error is
// then smaller than the rounding of the coordinates.
static const double PARALLEL = 1e-30;

// Returns the parameter in [0, 1] of the point of a + t d nearest to p; 0 if d vanishes.
static double nearest_along(Vec3 p, Vec3 a, Vec3 d)
{
    double dd = vec3_dot(d, d);
    if (!(dd > 0.0))
        return 0.0;
    double t = vec3_dot(vec3_sub(p, a), d) / dd;
    return t > 0.0 ? (t < 1.0 ? t : 1.0) : 0.0;
}

// Finds the minimum of |r - u d - v e| over all u, v; false if d and e do not span a plane.
static bool nearest_in_plane(Vec3 r, Vec3 d, Vec3 e, double *u, double *v)
{
    double dd = vec3_dot(d, d);
    if (!(dd > 0.0))
        return false;
    Vec3 across = vec3_madd(e, -vec3_dot(e, d) / dd, d);
    double aa = vec3_dot(across, across);
    if (!(aa > PARALLEL * vec3_dot(e, e)))
        return false;
    *v = vec3_dot(r, across) / aa;
    *u = vec3_dot(vec3_madd(r, -*v, e), d) / dd;
    return true;
}

void distance_point_triangle(Vec3 p, const Vec3 x[3], ClosestPair *pair)
{
    // The foot of the point in the triangle's plane, by its weights.
    Vec3 ab = vec3_sub(x[1], x[0]), ac = vec3_sub(x[2], x[0]);
    double weight[3] = {-1.0, -1.0, -1.0}; // without a plane every side is tried
    double u, v;
    if (nearest_in_plane(vec3_sub(p, x[0]), ab, ac, &u, &v)) {
        weight[0] = 1.0 - u - v;
        weight[1] = u;
        weight[2] = v;
    }
    pair->along = 0.0;
    pair->on_segment = p;
    // Nearest in the plane and inside: done.
    if (weight[0] >= 0.0 && weight[1] >= 0.0 && weight[2] >= 0.0) {
        for (int k = 0; k < 3; k++)
            pair->weight[k] = weight[k];
        pair->on_triangle = vec3_madd(vec3_madd(x[0], weight[1], ab), weight[2], ac);
        pair->distance = vec3_length(vec3_sub(p, pair->on_triangle));
        return;
    }
    // Otherwise the best of corner 0 and the sides that the point is beyond.
    pair->on_triangle = x[0];
    pair->weight[0] = 1.0;
    pair->weight[1] = pair->weight[2] = 0.0;
    pair->distance = vec3_length(vec3_sub(p, x[0]));
    for (int k = 0; k < 3; k++) {
        if (weight[k] >= 0.0)
            continue;
        int from = (k + 1) % 3, to = (k + 2) % 3; // the side opposite corner k
        Vec3 side = vec3_sub(x[to], x[from]);
        double t = nearest_along(p, x[from], side);
        Vec3 nearest = t == 1.0 ? x[to] : vec3_madd(x[from], t, side);
        double distance = vec3_length(vec3_sub(p, nearest));
        if (distance < pair->distance) {
            pair->distance = distance;
            pair->on_triangle = nearest;
            pair->weight[k] = 0.0;
            pair->weight[from] = 1.0 - t;
            pair->weight[to] = t;
        }
    }
}

// Keeps (s, t) if its points are nearer than the best so far.
static void try_pair(Vec3 r, Vec3 d, Vec3 e, double s, double t, double *best, double *best_s,
                     double *best_t)
{
    Vec3 gap = vec3_madd(vec3_madd(r, -s, d), t, e);
    double squared = vec3_dot(gap, gap);
    if (squared < *best) {
        *best = squared;
        *best_s = s;
        *best_t = t;
    }
}

void distance_segment_segment(Vec3 p, Vec3 q, Vec3 a, Vec3 b, double *s, double *t)
{
    // The unconstrained optimum, if it lies within both segments.
    Vec3 d = vec3_sub(q, p), e = vec3_sub(b, a), r = vec3_sub(a, p); // gap: r + t e - s d
    double u = (double)NAN, v = u; // comparisons with NaN fail: without a plane every side is tried
    if (nearest_in_plane(r, d, vec3_scale(-1.0, e), &u, &v) && u >= 0.0 && u <= 1.0 && v >= 0.0 &&
        v <= 1.0) {
        *s = u;
        *t = v;
        return;
    }
    // Otherwise one end is nearest: try the ends that the optimum lies beyond.
    double best = HUGE_VAL;
    *s = *t = 0.0;
    if (!(u >= 0.0))
        try_pair(r, d, e, 0.0, nearest_along(p, a, e), &best, s, t);
    if (!(u <= 1.0))
        try_pair(r, d, e, 1.0, nearest_along(q, a, e), &best, s, t);
    if (!(v >= 0.0))
        try_pair(r, d, e, nearest_along(a, p, d), 0.0, &best, s, t);
    if (!(v <= 1.0))
        try_pair(r, d, e, nearest_along(b, p, d), 1.0, &best, s, t);
}

// Returns the point p + along d, exact at both ends.
static Vec3 point_along(Vec3 p, Vec3 q, double along)
{
    return along == 1.0 ? q : vec3_madd(p, along, vec3_sub(q, p));
}

void distance_segment_triangle_pairs(Vec3 p, Vec3 q, const Vec3 x[3],
                                     ClosestPair pair[DISTANCE_PAIRS])
{
    // Both ends against the face.
    distance_point_triangle(p, x, &pair[0]);
    distance_point_triangle(q, x, &pair[1]);
    pair[1].along = 1.0;
    // The segment against each side.
    for (int k = 0; k < 3; k++) {
        ClosestPair *side = &pair[2 + k];
        int from = k, to = (k + 1) % 3;
        double t;
        distance_segment_segment(p, q, x[from], x[to], &side->along, &t);
        side->weight[from] = 1.0 - t;
        side->weight[to] = t;
        side->weight[(k + 2) % 3] = 0.0;
        side->on_segment = point_along(p, q, side->along);
        side->on_triangle = point_along(x[from], x[to], t);
        side->distance = vec3_length(vec3_sub(side->on_segment, side->on_triangle));
    }
}

bool distance_segment_crosses(Vec3 p, Vec3 q, const Vec3 x[3], double *along, double weight[3])
{
    // Both ends on the same side of the plane: no crossing.
    Vec3 normal = vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0]));
    double above = vec3_dot(normal, vec3_sub(p, x[0]));
    double below = vec3_dot(normal, vec3_sub(q, x[0]));
    if ((above > 0.0 && below > 0.0) || (above < 0.0 && below < 0.0) || above == below)
        return false;

    // Volumes spanned by the segment and each side. Swapping a side's ends flips the sign exactly,
    // so that a segment cannot slip between two triangles that share the side.
    Vec3 d = vec3_sub(q, p);
    Vec3 r[3] = {vec3_sub(x[0], p), vec3_sub(x[1], p), vec3_sub(x[2], p)};
    double volume[3], sum = 0.0;
    bool positive = false, negative = false;
    for (int k = 0; k < 3; k++) {
        volume[k] = vec3_dot(d, vec3_cross(r[(k + 1) % 3], r[(k + 2) % 3]));
        positive = positive || volume[k] > 0.0;
        negative = negative || volume[k] < 0.0;
        sum += volume[k];
    }
    if (positive == negative) // both signs: beside the triangle; neither: in its plane
        return false;
    *along = above / (above - below);
    for (int k = 0; k < 3; k++)
        weight[k] = volume[k] / sum;
    return true;
}

double distance_point_segment(Vec3 point, Vec3 p, Vec3 q)
{
    double t = nearest_along(point, p, vec3_sub(q, p));
    return vec3_length(vec3_sub(point, point_along(p, q, t)));
}
