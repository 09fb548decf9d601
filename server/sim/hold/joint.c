// SPDX-License-Identifier: MIT
// The other end of node i's spring is z = sum_j w_j x_j + d n, with x_j the corners of a face of
// the other body, n its unit normal, and z = x_i at the start. A force F at z is distributed to the
// corners by the transpose of dz/dx_j: forces and moments of both ends cancel exactly, and the
// springs' energy depends on distances alone.
// With e_j >= |dz/dx_j| and S = sum_j e_j, the row of node i in M^-1 K is at most k (1 + S) / m_i,
// that of corner j the sum over its springs of k e_j (1 + S) / m_j. So
//     k = g min(lambda_a m_i, lambda_b min_j m_j / sum_springs e_j) / (1 + S),
// with lambda_a and lambda_b bounding the bodies at their coarsest levels, adds at most g times its
// own lambda to the bound of either; damping c = 2 zeta k / sqrt(g max(lambda_a, lambda_b)) adds at
// most 2 zeta sqrt(g lambda) likewise.
// Joined bodies advance together, evaluation by evaluation: both ends act at the same time.
#include "base/check.h"
#include "sim/hold/attachment_data.h"
#include "geometry/distance.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// Faces

Vec3 joint_end(const Attachment *joint, const Tie *tie)
{
    Vec3 x[3];
    attachment_read_face(joint->other, tie->face, x);
    Facet facet = facet_of(x);
    return facet_position(&facet, &tie->end, x);
}

// Lets the face's corners x carry the point `target`.
static void fit_to(Tie *tie, const Vec3 x[3], const Facet *facet, Vec3 target)
{
    ClosestPair pair;
    if (facet_place(facet, x[0], target, &tie->end))
        return;
    distance_point_triangle(target, x, &pair);
    memcpy(tie->end.weight, pair.weight, sizeof tie->end.weight);
    tie->end.offset = 0.0;
}

static void fit(const Attachment *joint, Tie *tie, int64_t face, Vec3 target)
{
    Vec3 x[3];
    attachment_read_face(joint->other, face, x);
    Facet facet = facet_of(x);
    tie->face = face;
    fit_to(tie, x, &facet, target);
}

// --- stiffness ---

// Bounds |dz/dx_j|: a corner that moves by 1 rotates the normal by at most the opposite side over
// twice the area.
static double find_pulls(const Tie *tie, const Vec3 x[3], const Facet *facet, double e[3])
{
    double turn = facet->twice > 0.0 ? fabs(tie->end.offset) / facet->twice : 0.0, sum = 0.0;
    for (int k = 0; k < 3; k++) {
        double side = vec3_length(vec3_sub(x[(k + 1) % 3], x[(k + 2) % 3]));
        e[k] = fabs(tie->end.weight[k]) + turn * side;
        sum += e[k];
    }
    return sum;
}

static double read_pulls(const Attachment *joint, const Tie *tie, double e[3])
{
    Vec3 x[3];
    attachment_read_face(joint->other, tie->face, x);
    Facet facet = facet_of(x);
    return find_pulls(tie, x, &facet, e);
}

// Recomputes all springs. Fixed and hanging corners do not limit the stiffness.
void joint_stiffen(Attachment *joint)
{
    const Body *body = joint->body, *other = joint->other;
    const BodySurface *surface = &other->surface;
    const double g = joint->options.stiffness;
    double e[3];
    // How much of each corner all ties ask for: sum of e_j.
    memset(joint->pulls, 0, (size_t)surface->node_count * sizeof *joint->pulls);
    for (int64_t i = 0; i < *joint->ties; i++) {
        read_pulls(joint, &joint->tie[i], e);
        for (int k = 0; k < 3; k++)
            joint->pulls[surface->face[joint->tie[i].face][k]] += e[k];
    }
    // The weaker end decides the stiffness of a tie.
    for (int64_t i = 0; i < *joint->ties; i++) {
        Tie *tie = &joint->tie[i];
        double sum = read_pulls(joint, tie, e);
        // What the node allows, and then each free corner by its share.
        double least = body->contact_lambda * body->surface.node_mass[tie->node];
        for (int k = 0; k < 3; k++) {
            int corner = surface->face[tie->face][k];
            double mass = surface->node_mass[corner];
            if (mass > 0.0 && joint->pulls[corner] > 0.0 &&
                !other->ops->is_fixed(other->model, corner))
                least = fmin(least, other->contact_lambda * mass / joint->pulls[corner]);
        }
        // Derived at the top of this file.
        tie->stiffness = g * least / (1.0 + sum);
        tie->damping = 2.0 * joint->options.damping_ratio * tie->stiffness /
                       sqrt(g * fmax(body->contact_lambda, other->contact_lambda));
    }
}

// ---------------------------------------------------------------------------------------------
// Creation

static int64_t nearest_face(const Attachment *joint, Vec3 from, double *distance)
{
    // All faces, once at load: no structure to search in.
    int64_t nearest = -1;
    *distance = (double)INFINITY;
    for (int64_t f = 0; f < joint->other->surface.face_used; f++) {
        Vec3 x[3];
        ClosestPair pair;
        if (!attachment_is_face(&joint->other->surface, f))
            continue;
        attachment_read_face(joint->other, f, x);
        distance_point_triangle(from, x, &pair);
        if (pair.distance < *distance) {
            *distance = pair.distance;
            nearest = f;
        }
    }
    return nearest;
}

bool joint_tie(Attachment *joint, const int *node, int count, Status *status)
{
    const Body *body = joint->body, *other = joint->other;
    // Each node at the nearest face of the other body, which must be near.
    for (int i = 0; i < count; i++) {
        Vec3 x;
        double distance;
        body->ops->read_nodes(body->model, &node[i], 1, &x, NULL);
        int64_t face = nearest_face(joint, x, &distance);
        if (face < 0 || distance > JOINT_REACH * other->surface.longest_edge)
            return status_fail(
                status, STATUS_INVALID,
                "a node at (%.6g, %.6g, %.6g) m of body %s is %.4g m from body %s, at "
                "most %.4g m, twice its longest edge",
                x.x, x.y, x.z, body->name, distance, other->name,
                JOINT_REACH * other->surface.longest_edge);
        joint_add(joint, node[i], (int)face); // the distance stays what it is now
    }
    joint_stiffen(joint);
    return true;
}

void joint_add(Attachment *joint, int node, int face)
{
    Tie *tie = &joint->tie[*joint->ties];
    Vec3 x;
    ASSERT(*joint->ties < joint->capacity);
    ASSERT(*joint->ties == 0 || tie[-1].node < node);
    joint->body->ops->read_nodes(joint->body->model, &node, 1, &x, NULL);
    tie->node = node;
    fit(joint, tie, face, x);
    ++*joint->ties;
}

void joint_close(Attachment *joint, double way)
{
    for (int64_t i = 0; i < *joint->ties; i++) {
        double *offset = &joint->tie[i].end.offset;
        *offset = copysign(fmax(0.0, fabs(*offset) - way), *offset);
    }
}

double joint_gap(const Attachment *joint)
{
    double gap = 0.0;
    for (int64_t i = 0; i < *joint->ties; i++)
        gap = fmax(gap, fabs(joint->tie[i].end.offset));
    return gap;
}

// ---------------------------------------------------------------------------------------------
// Forces

// Adds the damping. A dashpot does not act along its spring: its moments cancel only if both ends
// act at the same point, the node; if stretching has moved that far off the face, it is weakened so
// that it requires no shorter steps than at the start.
static Vec3 damp(Attachment *joint, int i, const Vec3 x[3], const Facet *facet)
{
    Tie here = joint->tie[i];
    double e[3], on_start = find_pulls(&here, x, facet, e);
    fit_to(&here, x, facet, joint->x[i]);
    double weak = on_start / fmax(on_start, find_pulls(&here, x, facet, e));
    Vec3 speed = vec3_sub(joint->v[i], facet_velocity(facet, &here.end, &joint->corner_v[3 * i]));
    Vec3 force = vec3_scale(weak * weak * here.damping, speed), on[3];
    facet_distribute(facet, &here.end, force, on);
    for (int k = 0; k < 3; k++)
        joint->corner_f[3 * i + k] = vec3_add(joint->corner_f[3 * i + k], on[k]);
    return force;
}

void joint_apply(Attachment *joint, double share)
{
    const Body *body = joint->body, *other = joint->other;
    const int count = (int)*joint->ties;
    // Both ends are read in one call each.
    for (int i = 0; i < count; i++) {
        joint->carrier[i] = (int)joint->tie[i].node;
        memcpy(&joint->corner[3 * i], other->surface.face[joint->tie[i].face],
               3 * sizeof *joint->corner);
    }
    body->ops->read_nodes(body->model, joint->carrier, count, joint->x, joint->v);
    other->ops->read_nodes(other->model, joint->corner, 3 * count, joint->corner_x,
                           joint->corner_v);
    // The spring pulls along the line between both ends; what it takes from one it gives to the
    // other.
    for (int i = 0; i < count; i++) {
        const Tie *tie = &joint->tie[i];
        const Vec3 *x = &joint->corner_x[3 * i];
        const Facet facet = facet_of(x);
        const Vec3 stretch = vec3_sub(joint->x[i], facet_position(&facet, &tie->end, x));
        Vec3 force = vec3_scale(tie->stiffness, stretch);
        facet_distribute(&facet, &tie->end, force, &joint->corner_f[3 * i]);
        // Damping, likewise at both ends.
        force = vec3_add(force, damp(joint, i, x, &facet));
        joint->f[i] = vec3_scale(-1.0, force);
        joint->sums.impulse = vec3_madd(joint->sums.impulse, share, force); // what breaks a tie
    }
    // The sums go to both bodies.
    body->ops->add_forces(body->model, joint->carrier, count, joint->f);
    other->ops->add_forces(other->model, joint->corner, 3 * count, joint->corner_f);
}

// ---------------------------------------------------------------------------------------------
// Topology

void joint_other_changed(Attachment *joint, const TopologyChange *change)
{
    int64_t kept = 0;
    for (int64_t i = 0; i < *joint->ties; i++) {
        Tie tie = joint->tie[i];
        double weight[3];
        const int64_t heir =
            attachment_heir(joint->other, change, tie.face, joint->before[i], weight);
        if (heir == FACE_ENDS)
            continue;
        // The tie goes on from where its end was.
        if (heir >= 0)
            fit(joint, &tie, heir, joint->before[i]);
        joint->tie[kept++] = tie;
    }
    memset(&joint->tie[kept], 0, (size_t)(*joint->ties - kept) * sizeof *joint->tie);
    *joint->ties = kept;
}

// Finds the face nearest to `target`, walking across sides from the tie's own.
static void walk(const Attachment *joint, Tie *tie, Vec3 target)
{
    enum { STEPS = 64 };
    fit(joint, tie, tie->face, target);
    for (int step = 0; step < STEPS; step++) {
        int worst = 0;
        for (int k = 1; k < 3; k++)
            if (tie->end.weight[k] < tie->end.weight[worst])
                worst = k;
        int next = joint->other->surface.face_neighbor[tie->face][(worst + 1) % 3];
        if (tie->end.weight[worst] >= 0.0 || next < 0)
            return;
        fit(joint, tie, next, target);
    }
}

static bool carries_always(const void *row)
{
    (void)row;
    return true;
}

// Ties a new node between two tied ones between their ends; a copy like its original.
static bool tie_between(const Attachment *joint, const NodeBirth *born, const void *from,
                        const void *to, void *row)
{
    const Tie *one = from, *two = to;
    Tie tie = *one;
    if (joint->body->ops->is_fixed(joint->body->model, born->node))
        return false;
    if (one != two)
        walk(joint, &tie, vec3_scale(0.5, vec3_add(joint_end(joint, one), joint_end(joint, two))));
    *(Tie *)row = tie;
    return true;
}

// Ties a parent of the last tied nodes where it is now.
static bool inherit_tie(Attachment *joint, int parent, const void *went, const void *known,
                        void *row)
{
    const Body *body = joint->body;
    Tie tie = *(const Tie *)went;
    Vec3 x;
    if (known != NULL || body->ops->is_fixed(body->model, parent))
        return false;
    body->ops->read_nodes(body->model, &parent, 1, &x, NULL);
    walk(joint, &tie, x);
    *(Tie *)row = tie;
    return true;
}

const HoldRow FACET_ROW = {sizeof(Tie), carries_always, tie_between, inherit_tie};

bool joint_is_sensible(const Tie *tie)
{
    double sum = 0.0;
    // Weights sum to 1.
    for (int k = 0; k < 3; k++) {
        sum += tie->end.weight[k];
        if (!(fabs(tie->end.weight[k]) < 1e12)) // far beyond the thinnest face
            return false;
    }
    return fabs(sum - 1.0) < 1e-6 && fabs(tie->end.offset) < 1e6 && tie->stiffness >= 0.0 &&
           tie->stiffness < 1e15 && tie->damping >= 0.0 && tie->damping < 1e15;
}
