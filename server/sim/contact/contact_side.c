// SPDX-License-Identifier: MIT
// On which side of each face a tool is (server/sim/README.md, "Sides of hollow walls"): a hollow
// wall pushes the tool back to the side from which it came, even after the axis has crossed it.
// Step thread, once per tick. Only a face whose interior is nearest can be crossed. If the nearest
// point of a face is on an edge or a corner, a nearer neighbour there decides: in front of it, the
// tool is on the side that is seen, because it went around the edge; behind it, the tool has
// crossed both. Faces beyond a fold are seen from behind, through the wall, until the tool comes
// around to them, so a side seen from afar must not be remembered. Solids have no sides:
// contact_solid.c.
#include "sim/contact/contact_data.h"

#include "geometry/distance.h"

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

static bool is_nearer(const Contact *contact, int a, int b)
{
    double da = contact->distance[a], db = contact->distance[b];
    return da < db || (da == db && a < b);
}

// Returns the nearest candidate around the edge or corner of candidate `index`'s nearest point;
// itself if that point is inside the face, or if no neighbour is nearer.
static int nearest_around(const Contact *contact, int index)
{
    const BodySurface *surface = &contact->body->surface;
    int face = contact->candidate[index].face, best = index, corner = -1, corners = 0;
    for (int k = 0; k < 3; k++)
        if (contact->corners[index] >> k & 1) {
            corners++;
            corner = k;
        }
    if (corners == 2) {
        int edge = contact->corners[index] == 6 ? 1 : contact->corners[index] == 5 ? 2 : 0;
        int across = surface->face_neighbor[face][edge];
        int other = across >= 0 ? contact_find_candidate(contact, across) : -1;
        return other >= 0 && is_nearer(contact, other, index) ? other : index;
    }
    if (corners == 1) {
        int node = surface->face[face][corner];
        for (int k = surface->node_face_start[node]; k < surface->node_face_end[node]; k++) {
            int other = contact_find_candidate(contact, surface->node_face[k]);
            if (other >= 0 && is_nearer(contact, other, best))
                best = other;
        }
    }
    return best;
}

// Returns the side that neighbours across edges give to a new candidate.
static signed char inherited_side(const Contact *contact, const Candidate *candidate,
                                  const signed char *side)
{
    const int *across = contact->body->surface.face_neighbor[candidate->face];
    for (int k = 0; k < 3; k++)
        if (across[k] >= 0 && side[across[k]] != 0)
            return side[across[k]];
    return 0;
}

// Measures a candidate: its distance, the visible side, and the candidate that decides its side.
static void look_at(Contact *contact, int index, Vec3 p, Vec3 q, bool sphere)
{
    const Candidate *candidate = &contact->candidate[index];
    ClosestPair nearest;
    Vec3 x[3] = {contact->x[candidate->node[0]], contact->x[candidate->node[1]],
                 contact->x[candidate->node[2]]};
    contact_nearest_pair(x, p, q, sphere, &nearest);
    int sign =
        contact_sign(contact, candidate, nearest.weight, nearest.on_triangle, nearest.on_segment);
    contact->has_side[index] = sign != 0;
    if (sign == 0) { // at a free border: the side of the face's plane
        Vec3 normal = contact_face_normal(contact, candidate);
        Vec3 away = vec3_sub(nearest.on_segment, nearest.on_triangle);
        sign = vec3_dot(away, normal) < 0.0 ? -1 : 1;
    }
    contact->seen_side[index] = (signed char)sign;
    contact->distance[index] = nearest.distance;
    contact->corners[index] = 0;
    for (int k = 0; k < 3; k++)
        contact->corners[index] |= (unsigned char)((nearest.weight[k] > 0.0) << k);
}

static void update_shape(Contact *contact, const ToolPlacement *at, int shape)
{
    const Capsule *capsule = &contact->tool->capsule[shape];
    signed char *side = contact->side[shape];
    // Static tools have no proxy that keeps them in front: every face is on the same side, however
    // far behind.
    const double remember_within = contact->tool->kind == TOOL_STATIC
                                       ? (double)INFINITY
                                       : CONTACT_CROSSED_REACH * capsule->radius;
    int count = contact->candidate_count;
    Vec3 p, q;
    contact_axis(capsule, at, &p, &q);
    for (int i = 0; i < count; i++) {
        look_at(contact, i, p, q, contact_is_sphere(capsule));
        contact->gap_begin[shape][i] = contact->distance[i];
    }
    for (int i = 0; i < count; i++)
        contact->side_from[i] = nearest_around(contact, i);

    // First the faces that decide themselves: by the remembered, inherited or visible side.
    for (int i = 0; i < count; i++) {
        const Candidate *candidate = &contact->candidate[i];
        if (contact->side_from[i] != i)
            continue;
        // A wall out of contact has not been crossed.
        if (!contact->has_side[i] || contact->distance[i] > remember_within)
            side[candidate->face] = contact->seen_side[i];
        if (side[candidate->face] == 0 && contact->distance[i] < remember_within)
            side[candidate->face] = inherited_side(contact, candidate, side);
        if (side[candidate->face] == 0)
            side[candidate->face] = contact->seen_side[i];
    }
    for (int i = 0; i < count; i++) {
        int root = i;
        while (contact->side_from[root] != root) // distances decrease, so it ends
            root = contact->side_from[root];
        contact->in_front[shape][i] = 0.0;
        if (root == i)
            continue;
        signed char *own = &side[contact->candidate[i].face];
        signed char told = side[contact->candidate[root].face];
        if (contact->distance[root] > 0.0 || *own == 0)
            *own = (signed char)(told * contact->seen_side[root] * contact->seen_side[i]);
        // At a corner that is not the nearest one, the sign may change while the tool slides on.
        if (*own == contact->seen_side[i])
            contact->in_front[shape][i] = contact->distance[root];
    }
    float *gap = contact->gap[shape];
    for (int i = 0; i < count && gap != NULL; i++)
        gap[contact->candidate[i].face] = (float)contact->distance[i];
}

void contact_update_sides(Contact *contact, const ToolPlacement *at)
{
    for (int shape = 0; shape < contact->tool->capsule_count; shape++)
        update_shape(contact, at, shape);
}
