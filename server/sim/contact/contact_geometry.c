// SPDX-License-Identifier: MIT
// Geometry of a capsule and the faces around it, for all laws and for holding. Step thread.
#include "sim/contact/contact_data.h"

#include "geometry/distance.h"

bool contact_is_sphere(const Capsule *capsule)
{
    return vec3_length(vec3_sub(capsule->to, capsule->from)) < CONTACT_TOUCHING;
}

void contact_axis(const Capsule *capsule, const ToolPlacement *at, Vec3 *p, Vec3 *q)
{
    *p = vec3_add(at->position, quat_rotate(at->orientation, capsule->from));
    *q = vec3_add(at->position, quat_rotate(at->orientation, capsule->to));
}

Vec3 contact_face_normal(const Contact *contact, const Candidate *candidate)
{
    const Vec3 *x = contact->x;
    Vec3 a = x[candidate->node[0]], b = x[candidate->node[1]], c = x[candidate->node[2]];
    return vec3_unit(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)));
}

int contact_sign(const Contact *contact, const Candidate *candidate, const double weight[3],
                 Vec3 on_face, Vec3 on_axis)
{
    Vec3 normal = {0.0, 0.0, 0.0};
    int corners = (weight[0] > 0.0) + (weight[1] > 0.0) + (weight[2] > 0.0);
    for (int k = 0; k < 3 && corners < 3; k++) {
        bool on_edge = weight[(k + 2) % 3] <= 0.0; // on edge k, or at one of its ends
        if (on_edge && candidate->border[k])
            return 0;
        normal = vec3_madd(normal, weight[k], contact->node_normal[candidate->node[k]]);
    }
    if (vec3_dot(normal, normal) == 0.0) { // inside the face, or border nodes only
        if (corners == 1)
            return 0;
        normal = contact_face_normal(contact, candidate);
    }
    return vec3_dot(vec3_sub(on_axis, on_face), normal) < 0.0 ? -1 : 1;
}

void contact_nearest_pair(const Vec3 x[3], Vec3 p, Vec3 q, bool sphere, ClosestPair *nearest)
{
    distance_point_triangle(p, x, nearest);
    if (sphere)
        return;
    for (int k = 0; k < 3; k++) {
        int to = (k + 1) % 3;
        double s, t;
        distance_segment_segment(p, q, x[k], x[to], &s, &t);
        Vec3 on_segment = s == 1.0 ? q : vec3_madd(p, s, vec3_sub(q, p));
        Vec3 on_side = t == 1.0 ? x[to] : vec3_madd(x[k], t, vec3_sub(x[to], x[k]));
        double distance = vec3_length(vec3_sub(on_segment, on_side));
        if (distance < nearest->distance) {
            *nearest = (ClosestPair){
                .distance = distance, .along = s, .on_triangle = on_side, .on_segment = on_segment};
            nearest->weight[k] = 1.0 - t;
            nearest->weight[to] = t;
        }
    }
    // The other end is nearest only above the inside: then it is nearer to the corners than far
    // ends are.
    Vec3 to_corner = vec3_sub(q, x[0]);
    double reach =
        nearest->distance + vec3_length(vec3_sub(x[1], x[0])) + vec3_length(vec3_sub(x[2], x[0]));
    if (vec3_dot(to_corner, to_corner) < reach * reach) {
        ClosestPair end;
        distance_point_triangle(q, x, &end);
        end.along = 1.0;
        if (end.distance < nearest->distance)
            *nearest = end;
    }
    double along, weight[3];
    if (distance_segment_crosses(p, q, x, &along, weight))
        nearest->distance = 0.0;
}

double contact_approach(const Contact *contact, const ToolPlacement *at)
{
    const ToolPlacement *begin = &contact->begin;
    Quat turn = quat_multiply(at->orientation, quat_conjugate(begin->orientation));
    return contact->yielded + vec3_length(vec3_sub(at->position, begin->position)) +
           vec3_length(quat_to_rotation(turn)) * contact->lever;
}

void contact_corners(const Contact *contact, const Candidate *candidate, Vec3 x[3])
{
    for (int k = 0; k < 3; k++)
        x[k] = contact->x[candidate->node[k]];
}

int contact_find_pairs(const Vec3 x[3], Vec3 p, Vec3 q, bool sphere,
                       ClosestPair pair[DISTANCE_PAIRS], const ClosestPair **nearest)
{
    double along, weight[3];
    *nearest = &pair[0];
    if (sphere) {
        distance_point_triangle(p, x, &pair[0]);
        pair[0].on_segment = p;
        return 1;
    }
    if (distance_segment_crosses(p, q, x, &along, weight))
        return 0;
    distance_segment_triangle_pairs(p, q, x, pair);
    for (int j = 1; j < DISTANCE_PAIRS; j++)
        if (pair[j].distance < (*nearest)->distance)
            *nearest = &pair[j];
    return DISTANCE_PAIRS;
}

double contact_soft_minimum(const ClosestPair *pair, int count, double least, double eps,
                            double share[DISTANCE_PAIRS], double *sum)
{
    *sum = 0.0;
    for (int j = 0; j < count; j++) {
        const double farther = pair[j].distance - least;
        share[j] = farther > 20.0 * eps ? 0.0 : exp(-farther / eps);
        *sum += share[j];
    }
    return least - eps * log(*sum);
}
