// SPDX-License-Identifier: MIT
// Finds the faces (or nodes) that a tool can reach in a tick: first nodes near an axis, then the
// faces around them by exact distance (server/sim/README.md, "Candidate faces"). Computes the
// normals at the nodes of hollow walls; those of solids only where they are asked for
// (contact_find_normals). Step thread, once per tick.
#include "sim/contact/contact_data.h"

#include "base/bits.h"
#include "geometry/distance.h"

#include <string.h>

// Marks the faces around every node near a capsule, and the existing candidates.
static void mark_faces(Contact *contact, const ToolPlacement *at, double margin)
{
    const BodySurface *surface = &contact->body->surface;
    memset(contact->mark, 0, (size_t)bits_words(surface->face_used) * sizeof *contact->mark);
    for (int shape = 0; shape < contact->tool->capsule_count; shape++) {
        Region region = {.kind = REGION_CAPSULE};
        contact_axis(&contact->tool->capsule[shape], at, &region.from, &region.to);
        region.radius = contact->tool->capsule[shape].radius + margin +
                        CONTACT_FACE_REACH * surface->longest_edge + contact->reach;
        int count = contact->body->ops->find_nodes(contact->body->model, &region, contact->node,
                                                   surface->node_count);
        for (int i = 0; i < count; i++) {
            int node = contact->node[i];
            for (int k = surface->node_face_start[node]; k < surface->node_face_end[node]; k++)
                bits_add(contact->mark, surface->node_face[k]);
        }
        const signed char *side = contact->side[shape];
        for (int f = 0; side != NULL && f < surface->face_used; f++) {
            uint64_t eight; // nearly all are 0: check eight at a time
            while (f + 8 <= surface->face_used && (memcpy(&eight, side + f, 8), eight == 0))
                f += 8;
            if (f < surface->face_used && side[f] != 0)
                bits_add(contact->mark, f);
        }
    }
}

static int local_number(Contact *contact, int node)
{
    if (contact->local[node] < 0) {
        contact->local[node] = contact->local_count;
        contact->node[contact->local_count++] = node;
    }
    return contact->local[node];
}

// Computes cheap bounds of the distance between a face and an axis, from the face's centre, which
// is on the face.
static void face_bounds(const Vec3 x[3], Vec3 p, Vec3 q, double *lower, double *upper)
{
    Vec3 center = vec3_scale(1.0 / 3.0, vec3_add(vec3_add(x[0], x[1]), x[2]));
    double radius2 = 0.0;
    for (int k = 0; k < 3; k++) {
        Vec3 arm = vec3_sub(x[k], center);
        radius2 = fmax(radius2, vec3_dot(arm, arm));
    }
    *upper = distance_point_segment(center, p, q);
    *lower = *upper - sqrt(radius2);
}

// An axis of the tool, and how far its capsule reaches in this search.
typedef struct Reach {
    Vec3 p, q;
    double reach;
    bool sphere;
} Reach;

static bool within_reach(const Reach *axis, int count, const Vec3 x[3])
{
    for (int shape = 0; shape < count; shape++) {
        const Vec3 p = axis[shape].p, q = axis[shape].q;
        const double reach = axis[shape].reach;
        double lower, upper;
        face_bounds(x, p, q, &lower, &upper);
        if (upper <= reach)
            return true;
        if (lower > reach)
            continue;
        for (int k = 0; k < 3; k++)
            if (distance_point_segment(x[k], p, q) <= reach)
                return true;
        ClosestPair nearest;
        contact_nearest_pair(x, p, q, axis[shape].sphere, &nearest);
        if (nearest.distance <= reach)
            return true;
    }
    return false;
}

// Reads the corners of a face; those with a local number are known.
static void read_corners(const Contact *contact, const int *corner, Vec3 x[3])
{
    const Body *body = contact->body;
    for (int k = 0; k < 3; k++) {
        const int local = contact->local[corner[k]];
        if (local >= 0)
            x[k] = contact->x[local];
        else if (contact->fit != NULL)
            x[k] = carriers_place(contact->fit, corner[k]);
        else
            body->ops->read_nodes(body->model, &corner[k], 1, &x[k], NULL);
    }
}

// Returns the stiffness of the contact of a face [N/m].
static double face_stiffness(const Body *body, int face)
{
    double stiffness = body->contact_kappa * body_face_area(&body->surface, face);
    const double *firmness = body->surface.face_firmness;
    return firmness != NULL ? stiffness * firmness[face] : stiffness;
}

// Makes a face with corners at `x` the next candidate; returns false if it or its nodes exceed the
// capacity.
static bool add_candidate(Contact *contact, int face, const Vec3 x[3])
{
    const BodySurface *surface = &contact->body->surface;
    int fresh = 0;
    for (int k = 0; k < 3; k++)
        fresh += contact->local[surface->face[face][k]] < 0;
    if (contact->candidate_count == contact->face_capacity ||
        contact->local_count + fresh > contact->node_capacity)
        return false;
    Candidate *candidate = &contact->candidate[contact->candidate_count++];
    candidate->face = face;
    candidate->stiffness = face_stiffness(contact->body, face);
    for (int k = 0; k < 3; k++) {
        candidate->border[k] = surface->face_neighbor[face][k] < 0;
        candidate->node[k] = local_number(contact, surface->face[face][k]);
        contact->x[candidate->node[k]] = x[k];
    }
    return true;
}

// Turns the marked faces within exact reach into candidates, ascending; the others lose their mark
// and their side.
static void keep_candidates(Contact *contact, const ToolPlacement *at, double margin)
{
    const BodySurface *surface = &contact->body->surface;
    const int shapes = contact->tool->capsule_count;
    Reach axis[TOOL_SHAPES], wide[TOOL_SHAPES]; // wide: of the vertices of a fitted surface
    for (int shape = 0; shape < shapes; shape++) {
        const Capsule *capsule = &contact->tool->capsule[shape];
        contact_axis(capsule, at, &axis[shape].p, &axis[shape].q);
        axis[shape].reach = capsule->radius + margin;
        axis[shape].sphere = contact_is_sphere(capsule);
        wide[shape] = axis[shape];
        wide[shape].reach += contact->reach;
    }
    for (int word = 0; word < bits_words(surface->face_used); word++) {
        contact->rank[word] = contact->candidate_count;
        for (uint64_t left = contact->mark[word]; left != 0;) {
            const int face = bits_take(&left, word);
            Vec3 x[3];
            bool reached = true;
            if (contact->fit != NULL) {
                for (int k = 0; k < 3; k++)
                    x[k] = carriers_vertex(contact->fit, surface->face[face][k]);
                reached = within_reach(wide, shapes, x);
            }
            if (reached) {
                read_corners(contact, surface->face[face], x);
                reached = within_reach(axis, shapes, x);
            }
            if (reached && add_candidate(contact, face, x))
                continue;
            contact->refused += reached;
            bits_remove(contact->mark, face);
            for (int shape = 0; shape < shapes; shape++)
                if (contact->side[shape] != NULL)
                    contact->side[shape][face] = 0;
        }
    }
}

int contact_find_candidate(const Contact *contact, int face)
{
    return bits_has(contact->mark, face)
               ? contact->rank[face / 64] + bits_before(contact->mark, face)
               : -1;
}

// Returns the area-weighted normal at a node, from all faces around it; zero at a node of a free
// border, which has no sides.
static Vec3 node_normal(const Contact *contact, int node)
{
    const BodySurface *surface = &contact->body->surface;
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int k = surface->node_face_start[node]; k < surface->node_face_end[node]; k++) {
        int face = surface->node_face[k];
        const int *corner = surface->face[face];
        for (int c = 0; c < 3; c++)
            if (surface->face_neighbor[face][c] < 0 &&
                (corner[c] == node || corner[(c + 1) % 3] == node))
                return (Vec3){0.0, 0.0, 0.0};
        Vec3 x[3];
        read_corners(contact, corner, x);
        sum = vec3_add(sum, vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0])));
    }
    return sum;
}

void contact_find_normals(Contact *contact, const Candidate *candidate)
{
    for (int c = 0; c < 3; c++)
        contact->node_normal[candidate->node[c]] =
            node_normal(contact, contact->node[candidate->node[c]]);
}

void contact_forget_numbers(Contact *contact)
{
    for (int i = 0; i < contact->local_count; i++)
        contact->local[contact->node[i]] = -1;
}

void contact_find_all_normals(Contact *contact)
{
    const BodySurface *surface = &contact->body->surface;
    const Body *body = contact->body;
    int own = contact->local_count, whole = own; // nodes with a complete ring
    for (int i = 0; i < own && whole == own; i++)
        for (int k = surface->node_face_start[contact->node[i]];
             k < surface->node_face_end[contact->node[i]]; k++) {
            if (contact->local_count + 3 > contact->ring_capacity) {
                whole = i;
                contact->refused += own - i;
                break;
            }
            for (int c = 0; c < 3; c++)
                local_number(contact, surface->face[surface->node_face[k]][c]);
        }
    body->ops->read_nodes(body->model, contact->node + own, contact->local_count - own,
                          contact->x + own, NULL);
    for (int i = 0; i < own; i++) // without a ring, as on a border: the face's own normal decides
        contact->node_normal[i] =
            i < whole ? node_normal(contact, contact->node[i]) : (Vec3){0.0, 0.0, 0.0};
    contact_forget_numbers(contact);
    contact->local_count = own; // the ring was needed for the normals only
}

void contact_find_faces(Contact *contact, const ToolPlacement *at, double margin)
{
    mark_faces(contact, at, margin);
    keep_candidates(contact, at, margin);
}

void contact_forget_candidates(Contact *contact)
{
    contact->candidate_count = contact->local_count = 0;
}

void contact_find_candidates(Contact *contact, const ToolPlacement *at, double margin)
{
    contact_forget_candidates(contact);
    contact->law->find(contact, at, margin);
    contact->begin = *at;
    if (contact->candidate_count > 0) // of capsules only
        memcpy(contact->x_begin, contact->x, (size_t)contact->local_count * sizeof *contact->x);
}
