// SPDX-License-Identifier: MIT
// The law of contact (server/sim/README.md, "Contact of faces"): every face with depth > 0 pushes
// with its own stiffness kappa * rest area along the gradient of its distance; nothing is shared or
// merged at edges, so the sum is continuous and conservative. Step thread.
#include "sim/contact/contact_data.h"

#include "geometry/distance.h"

#include <string.h>

// Width of the soft minimum over a capsule's pairs, relative to the radius. At 0.01 the torque of a
// capsule that tilts over an edge changes by under 1 % per 0.005 degrees.
static const double SOFT = 0.01;
// log 5, rounded up: largest distance, in widths, of the soft minimum of five pairs below them all.
static const double SOFT_REACH = 1.61;
static const double TOUCHING = 1e-9; // [m] closer, a pair has no direction of its own

Vec3 contact_face_normal(const Contact *contact, const Candidate *candidate)
{
    const Vec3 *x = contact->x;
    Vec3 a = x[candidate->node[0]], b = x[candidate->node[1]], c = x[candidate->node[2]];
    return vec3_unit(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)));
}

bool contact_is_sphere(const Capsule *capsule)
{
    return vec3_length(vec3_sub(capsule->to, capsule->from)) < TOUCHING;
}

void contact_axis(const Capsule *capsule, const ToolPlacement *at, Vec3 *p, Vec3 *q)
{
    *p = vec3_add(at->position, quat_rotate(at->orientation, capsule->from));
    *q = vec3_add(at->position, quat_rotate(at->orientation, capsule->to));
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

// --- pushes ---

static Vec3 node_velocity(const Contact *contact, const Candidate *candidate,
                          const double weight[3])
{
    Vec3 v = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; k++)
        v = vec3_madd(v, weight[k], contact->v[candidate->node[k]]);
    return v;
}

static Vec3 tool_velocity(const ToolPlacement *at, Vec3 point)
{
    return vec3_add(at->linear, vec3_cross(at->angular, vec3_sub(point, at->position)));
}

// Adds a force on the tool at a point, and the opposite on the nodes of a face.
static void add_force(Contact *contact, const Candidate *candidate, const double weight[3], Vec3 at,
                      Vec3 force)
{
    ContactForces *sum = &contact->forces;
    sum->force = vec3_add(sum->force, force);
    sum->moment = vec3_add(sum->moment, vec3_cross(vec3_sub(at, contact->sums.about), force));
    for (int k = 0; k < 3; k++)
        contact->f[candidate->node[k]] =
            vec3_madd(contact->f[candidate->node[k]], -weight[k], force);
}

double contact_face_stiffness(const Body *body, int face)
{
    double stiffness = body->contact_kappa * body->surface.face_area[face];
    const double *firmness = body->surface.face_firmness;
    return firmness != NULL ? stiffness * firmness[face] : stiffness;
}

// Returns the contact stiffness of a node against a plane [N/m].
static double node_stiffness(const Body *body, int node)
{
    double stiffness = body->contact_kappa * body->surface.node_area[node];
    const double *firmness = body->surface.node_firmness;
    return firmness != NULL ? stiffness * firmness[node] : stiffness;
}

double contact_friction(const Contact *contact)
{
    return contact->tool->has_friction ? contact->tool->friction : contact->body->tuning.friction;
}

void contact_note_spring(Contact *contact, const Candidate *candidate, const double weight[3],
                         Vec3 normal, double stiffness, double yield, bool stays)
{
    int i = contact->spring_count++;
    if (i >= contact->spring_capacity)
        return;
    ContactSpring *spring = &contact->spring[i];
    for (int k = 0; k < 3; k++) {
        spring->local[k] = candidate->node[k];
        spring->node[k] = contact->node[candidate->node[k]];
        spring->weight[k] = weight[k];
    }
    spring->normal = normal;
    spring->stiffness = stiffness;
    spring->yield = yield;
    spring->stays = stays;
}

// Adds the push of one pair: `share` of the face's stiffness, along `normal`, for an overlap
// `depth`.
static void add_push(Contact *contact, const ToolPlacement *at, int index, const double weight[3],
                     Vec3 point, Vec3 normal, double depth, double share)
{
    const Candidate *candidate = &contact->candidate[index];
    ContactForces *sum = &contact->forces;
    double stiffness = contact_face_stiffness(contact->body, candidate->face);
    Vec3 relative = vec3_sub(tool_velocity(at, point), node_velocity(contact, candidate, weight));
    double separating = vec3_dot(relative, normal);
    // Damped, but never adhesive.
    double force =
        share * stiffness * fmax(0.0, depth - contact->body->contact_damping * separating);
    add_force(contact, candidate, weight, point, vec3_scale(force, normal));

    // Sums for the wrench and for the proxy's steps.
    const double k = share * stiffness;
    sum->stiffness = sym3_madd(sum->stiffness, 1.0, sym3_outer(k, normal));
    sum->weight += force;
    sum->point = vec3_madd(sum->point, force, point);
    sum->normal = vec3_madd(sum->normal, force, normal);
    if (contact->spring != NULL)
        contact_note_spring(contact, candidate, weight, normal, k, k * depth * contact->spring_turn,
                            false);
    // Friction needs the push again, with its slip.
    if (force > 0.0 && contact_friction(contact) > 0.0 &&
        contact->push_count < contact->push_capacity) {
        contact->push[contact->push_count++] =
            (Push){.candidate = index, .weight = {weight[0], weight[1], weight[2]}, .force = force};
        PushSums *sums = &contact->push_sums;
        sums->force += force;
        sums->stiffness += force * stiffness;
        sums->normal = vec3_madd(sums->normal, force, normal);
        sums->slip = vec3_madd(sums->slip, force, vec3_madd(relative, -separating, normal));
    }
}

// --- one face and one capsule ---

static void face_corners(const Contact *contact, const Candidate *candidate, Vec3 x[3])
{
    for (int k = 0; k < 3; k++)
        x[k] = contact->x[candidate->node[k]];
}

// Signed distance of a capsule's axis to a face, and the pairs that determine its gradient.
typedef struct FaceDistance {
    double phi;      // [m]
    double distance; // unsigned, of the nearest pair [m]
    bool crossed;    // the axis passes through the face: a single pair along the face's normal
    int turn;        // +1: along (c - z), -1: against it
    int pair_count;
    ClosestPair pair[DISTANCE_PAIRS];
} FaceDistance;

static void measure_crossed(const Contact *contact, const Candidate *candidate, Vec3 p, Vec3 q,
                            int side, FaceDistance *out)
{
    Vec3 x[3];
    face_corners(contact, candidate, x);
    Vec3 normal = contact_face_normal(contact, candidate);
    double at_p = side * vec3_dot(vec3_sub(p, x[0]), normal);
    double at_q = side * vec3_dot(vec3_sub(q, x[0]), normal);
    distance_point_triangle(at_p < at_q ? p : q, x, &out->pair[0]);
    out->pair_count = 1;
    out->crossed = true;
    out->turn = 1;
    out->phi = fmin(at_p, at_q);
    out->distance = 0.0;
}

// `approach`: of contact_approach.
static void measure_face(const Contact *contact, int shape, int index, Vec3 p, Vec3 q, int side,
                         double approach, FaceDistance *out)
{
    const Candidate *candidate = &contact->candidate[index];
    Vec3 x[3];
    face_corners(contact, candidate, x);
    out->crossed = false;
    if (contact_is_sphere(&contact->tool->capsule[shape])) {
        distance_point_triangle(p, x, &out->pair[0]);
        out->pair[0].on_segment = p;
        out->pair_count = 1;
    } else {
        double along, weight[3];
        if (distance_segment_crosses(p, q, x, &along, weight)) {
            measure_crossed(contact, candidate, p, q, side, out);
            return;
        }
        distance_segment_triangle_pairs(p, q, x, out->pair);
        out->pair_count = DISTANCE_PAIRS;
    }
    const ClosestPair *nearest = &out->pair[0];
    for (int j = 1; j < out->pair_count; j++)
        if (out->pair[j].distance < nearest->distance)
            nearest = &out->pair[j];
    out->distance = nearest->distance;
    out->turn = 1;
    if (contact->in_front[shape][index] <= approach) {
        int sign = contact_sign(contact, candidate, nearest->weight, nearest->on_triangle,
                                nearest->on_segment);
        out->turn = sign == 0 ? 1 : side * sign;
    }
    out->phi = out->turn * nearest->distance;
}

// Adds the pushes of one acting face. Soft minimum of the pairs: d = d_min - eps log sum exp(-(d_j
// - d_min)/eps); its gradient distributes the force over the pairs by their exponentials
// (server/sim/README.md, "Capsules").
static void push_face(Contact *contact, const ToolPlacement *at, int index,
                      const FaceDistance *face, int side, double radius)
{
    const Candidate *candidate = &contact->candidate[index];
    const double eps = SOFT * radius;
    double share[DISTANCE_PAIRS], sum = 0.0;
    for (int j = 0; j < face->pair_count; j++) {
        double farther = face->pair[j].distance - face->distance;
        share[j] = face->crossed ? 1.0 : farther > 20.0 * eps ? 0.0 : exp(-farther / eps);
        sum += share[j];
    }
    double phi = face->crossed ? face->phi : face->turn * (face->distance - eps * log(sum));
    double depth = radius - phi;
    if (!(depth > 0.0))
        return;
    // Figures of the whole contact.
    ContactForces *forces = &contact->forces;
    forces->acting++;
    forces->crossed += face->crossed || face->turn < 0;
    forces->depth = fmax(forces->depth, depth);
    const double above = phi - CONTACT_AXIS_FLOOR * radius;
    // Each pair pushes along its own direction; without a distance, along the face's normal.
    for (int j = 0; j < face->pair_count; j++) {
        if (share[j] == 0.0)
            continue;
        const ClosestPair *pair = &face->pair[j];
        Vec3 normal;
        bool flat = face->crossed || pair->distance < TOUCHING;
        contact->spring_turn = flat ? 0.0 : face->turn / pair->distance;
        if (flat)
            normal = vec3_scale(side, contact_face_normal(contact, candidate));
        else
            normal = vec3_scale(face->turn / pair->distance,
                                vec3_sub(pair->on_segment, pair->on_triangle));
        if (share[j] == 1.0 && above < forces->floor) { // the nearest pair
            forces->floor = above;
            forces->floor_normal = normal;
        }
        add_push(contact, at, index, pair->weight, pair->on_triangle, normal, depth,
                 share[j] / sum);
    }
}

// True if no candidate that shares a node with a crossed face is nearer. Only then the face acts;
// otherwise neighbours would count their growing distance as depth (server/sim/README.md, "Sides of
// hollow walls").
static bool is_locally_nearest(const Contact *contact, int index)
{
    const Candidate *own = &contact->candidate[index];
    double distance = contact->distance[index];
    for (int i = 0; i < contact->candidate_count; i++) {
        if (i == index || contact->distance[i] > distance)
            continue;
        if (contact->distance[i] == distance && i > index)
            continue;
        const Candidate *other = &contact->candidate[i];
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                if (own->node[a] == other->node[b])
                    return false;
    }
    return true;
}

double contact_approach(const Contact *contact, const ToolPlacement *at)
{
    const ToolPlacement *begin = &contact->begin;
    Quat turn = quat_multiply(at->orientation, quat_conjugate(begin->orientation));
    return contact->yielded + vec3_length(vec3_sub(at->position, begin->position)) +
           vec3_length(quat_to_rotation(turn)) * contact->lever;
}

// Pushes out of the walls that the capsule crossed, of which the locally nearest faces push: that
// needs all distances first.
static void push_crossed(Contact *contact, const ToolPlacement *at, int shape, double reach)
{
    const Capsule *capsule = &contact->tool->capsule[shape];
    const signed char *sides = contact->side[shape];
    const double approach = contact_approach(contact, at);
    FaceDistance face;
    Vec3 p, q;
    contact_axis(capsule, at, &p, &q);
    for (int i = 0; i < contact->candidate_count; i++) {
        int side = sides[contact->candidate[i].face];
        measure_face(contact, shape, i, p, q, side == 0 ? 1 : side, approach, &face);
        contact->distance[i] = face.distance;
    }
    for (int i = 0; i < contact->candidate_count; i++) {
        int side = sides[contact->candidate[i].face];
        if (side == 0 || contact->distance[i] >= reach)
            continue;
        measure_face(contact, shape, i, p, q, side, approach, &face);
        if (face.phi < 0.0 && is_locally_nearest(contact, i))
            push_face(contact, at, i, &face, side, capsule->radius);
    }
}

static void evaluate_capsule(Contact *contact, const ToolPlacement *at, int shape)
{
    const Capsule *capsule = &contact->tool->capsule[shape];
    const double reach = (1.0 + SOFT_REACH * SOFT) * capsule->radius;
    const double crossed_reach = contact->tool->kind == TOOL_STATIC
                                     ? (double)INFINITY
                                     : CONTACT_CROSSED_REACH * capsule->radius;
    Vec3 p, q;
    contact_axis(capsule, at, &p, &q);
    bool crossed = false;
    const double approach = contact_approach(contact, at);
    const double may_act = fmax(reach, crossed_reach) + approach;
    FaceDistance face;
    for (int i = 0; i < contact->candidate_count; i++) {
        int side = contact->side[shape][contact->candidate[i].face];
        if (side == 0 || contact->gap_begin[shape][i] > may_act)
            continue;
        measure_face(contact, shape, i, p, q, side, approach, &face);
        if (face.phi < 0.0 && face.distance < crossed_reach)
            crossed = true;
        else if (face.phi >= 0.0 && face.phi < reach)
            push_face(contact, at, i, &face, side, capsule->radius);
    }
    if (crossed)
        push_crossed(contact, at, shape, crossed_reach);
}

// Adds bristle friction (server/sim/README.md, "Friction"): one tangential spring per capsule with
// a Coulomb cap, distributed over the pushes in proportion to their normal forces.
static void add_friction(Contact *contact, int first, Vec3 *bristle, double dt)
{
    const PushSums *sums = &contact->push_sums;
    const double normal_force = sums->force;
    if (!(normal_force > 0.0)) {
        *bristle = (Vec3){0.0, 0.0, 0.0};
        return;
    }
    // The bristle follows the mean slip and stays tangential.
    Vec3 normal = vec3_unit(sums->normal), slip = vec3_scale(1.0 / normal_force, sums->slip);
    double stiffness = sums->stiffness / normal_force;
    Vec3 s = vec3_madd(*bristle, dt, slip);
    s = vec3_madd(s, -vec3_dot(s, normal), normal);
    const double cap = contact_friction(contact) * normal_force;
    double stretch = stiffness * vec3_length(s);
    Vec3 force;
    if (stretch > cap) { // sliding
        s = vec3_scale(cap / stretch, s);
        force = vec3_scale(-stiffness, s);
    } else {
        force = vec3_scale(-stiffness, vec3_madd(s, contact->body->contact_damping, slip));
        double size = vec3_length(force);
        if (size > cap)
            force = vec3_scale(cap / size, force);
    }
    *bristle = s;
    // Distribute the force over the pushes.
    for (int i = first; i < contact->push_count; i++) {
        const Push *push = &contact->push[i];
        const Candidate *candidate = &contact->candidate[push->candidate];
        Vec3 at = {0.0, 0.0, 0.0};
        for (int k = 0; k < 3; k++)
            at = vec3_madd(at, push->weight[k], contact->x[candidate->node[k]]);
        add_force(contact, candidate, push->weight, at,
                  vec3_scale(push->force / normal_force, force));
    }
}

// Evaluates a plane against flat faces: the deepest point of a face is a node, so nodes are exact.
// Each node has its own friction.
static void evaluate_plane(Contact *contact, double dt)
{
    const Plane *plane = &contact->tool->plane;
    const Body *body = contact->body;
    ContactForces *sum = &contact->forces;
    for (int i = 0; i < contact->local_count; i++) {
        double height = vec3_dot(vec3_sub(contact->x[i], plane->point), plane->normal);
        Vec3 bristle = {0.0, 0.0, 0.0};
        if (height < 0.0) {
            double stiffness = node_stiffness(body, contact->node[i]);
            double leaving = vec3_dot(contact->v[i], plane->normal);
            double push = stiffness * fmax(0.0, -height - body->contact_damping * leaving);
            Vec3 force = vec3_scale(push, plane->normal); // on the node
            // Friction as for capsules, one bristle per node.
            const double cap = contact_friction(contact) * push;
            if (cap > 0.0) {
                Vec3 slip = vec3_madd(contact->v[i], -leaving, plane->normal);
                bristle = vec3_madd(contact->plane_bristle[contact->node[i]], dt, slip);
                double stretch = stiffness * vec3_length(bristle);
                Vec3 hold = vec3_madd(bristle, body->contact_damping, slip);
                if (stretch > cap) {
                    bristle = vec3_scale(cap / stretch, bristle);
                    hold = bristle;
                }
                double size = stiffness * vec3_length(hold);
                force = vec3_madd(force, size > cap ? -cap / size * stiffness : -stiffness, hold);
            }
            contact->f[i] = vec3_add(contact->f[i], force);
            // Action and reaction: the sums are those on the tool.
            Vec3 on_tool = vec3_scale(-1.0, force);
            sum->force = vec3_add(sum->force, on_tool);
            sum->moment = vec3_add(
                sum->moment, vec3_cross(vec3_sub(contact->x[i], contact->sums.about), on_tool));
            sum->weight += push;
            sum->point = vec3_madd(sum->point, push, contact->x[i]);
            sum->normal = vec3_madd(sum->normal, -push, plane->normal);
            sum->depth = fmax(sum->depth, -height);
            sum->acting++;
        }
        contact->plane_trial[i] = bristle;
    }
}

void contact_evaluate(Contact *contact, const ToolPlacement *at, double dt)
{
    contact->forces = (ContactForces){.floor = (double)INFINITY};
    contact->push_count = 0;
    memset(contact->f, 0, (size_t)contact->local_count * sizeof *contact->f);
    if (contact->is_plane) {
        evaluate_plane(contact, dt);
        return;
    }
    for (int shape = 0; shape < contact->tool->capsule_count; shape++) {
        int first = contact->push_count;
        contact->push_sums = (PushSums){0};
        evaluate_capsule(contact, at, shape);
        contact->trial[shape] = contact->proxy->bristle[shape];
        add_friction(contact, first, &contact->trial[shape], dt);
    }
}
