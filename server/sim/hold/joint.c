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
#include "sim/hold/attachment.h"
#include "sim/hold/attachment_data.h"
#include "sim/facet.h"
#include "geometry/distance.h"

#include <stdlib.h>
#include <string.h>

// Whole words: no padding in the state.
typedef struct Tie {
    int64_t node;              // of the body
    int64_t face;              // of the other
    FacetPlace end;            // on the face
    double stiffness, damping; // [N/m], [N s/m]
} Tie;

struct Joint {
    AttachmentOptions options;
    Body *body, *other;
    int capacity;
    bool of_tie; // made by message: the impulse of the tick is summed

    // --- part of the state; 0 beyond what is in use ---
    int64_t *count;
    Tie *tie; // [capacity] by node

    // --- of an evaluation ---
    int *node, *corner;       // [capacity], [3 capacity]
    Vec3 *x, *v, *f;          // of the nodes
    Vec3 *at, *velocity, *on; // of the corners

    // --- scratch ---
    Vec3 *before;   // [capacity] the other ends' positions before a change [m]
    double *demand; // [node slots of the other] sums of e_j
    Vec3 impulse;   // on the nodes, of this tick [N s]
    int64_t refused;
};

// ---------------------------------------------------------------------------------------------
// Faces

static void read_face(const Joint *joint, int64_t face, Vec3 x[3])
{
    const Body *other = joint->other;
    other->ops->read_nodes(other->model, other->surface.face[face], 3, x, NULL);
}

static Vec3 find_end(const Joint *joint, const Tie *tie)
{
    Vec3 x[3];
    read_face(joint, tie->face, x);
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

static void fit(const Joint *joint, Tie *tie, int64_t face, Vec3 target)
{
    Vec3 x[3];
    read_face(joint, face, x);
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

static double read_pulls(const Joint *joint, const Tie *tie, double e[3])
{
    Vec3 x[3];
    read_face(joint, tie->face, x);
    Facet facet = facet_of(x);
    return find_pulls(tie, x, &facet, e);
}

// Recomputes all springs. Fixed and hanging corners do not limit the stiffness.
void joint_stiffen(Joint *joint)
{
    const Body *body = joint->body, *other = joint->other;
    const BodySurface *surface = &other->surface;
    const double g = joint->options.stiffness;
    double e[3];
    // How much of each corner all ties ask for: sum of e_j.
    memset(joint->demand, 0, (size_t)surface->node_count * sizeof *joint->demand);
    for (int64_t i = 0; i < *joint->count; i++) {
        read_pulls(joint, &joint->tie[i], e);
        for (int k = 0; k < 3; k++)
            joint->demand[surface->face[joint->tie[i].face][k]] += e[k];
    }
    // The weaker end decides the stiffness of a tie.
    for (int64_t i = 0; i < *joint->count; i++) {
        Tie *tie = &joint->tie[i];
        double sum = read_pulls(joint, tie, e);
        // What the node allows, and then each free corner by its share.
        double least = body->contact_lambda * body->surface.node_mass[tie->node];
        for (int k = 0; k < 3; k++) {
            int corner = surface->face[tie->face][k];
            double mass = surface->node_mass[corner];
            if (mass > 0.0 && joint->demand[corner] > 0.0 &&
                !other->ops->is_fixed(other->model, corner))
                least = fmin(least, other->contact_lambda * mass / joint->demand[corner]);
        }
        // Derived at the top of this file.
        tie->stiffness = g * least / (1.0 + sum);
        tie->damping = 2.0 * joint->options.damping_ratio * tie->stiffness /
                       sqrt(g * fmax(body->contact_lambda, other->contact_lambda));
    }
}

// ---------------------------------------------------------------------------------------------
// Creation

static bool is_used_face(const BodySurface *surface, int64_t face)
{
    const int *corner = surface->face[face];
    if (corner[0] == corner[1] || corner[1] == corner[2])
        return false; // a free slot
    for (int k = 0; k < 3; k++)
        if (corner[k] < 0 || corner[k] >= surface->node_count ||
            surface->node_face_end[corner[k]] <= surface->node_face_start[corner[k]])
            return false;
    return true;
}

static int64_t nearest_face(const Joint *joint, Vec3 from, double *distance)
{
    // All faces, once at load: no structure to search in.
    int64_t nearest = -1;
    *distance = (double)INFINITY;
    for (int64_t f = 0; f < joint->other->surface.face_used; f++) {
        Vec3 x[3];
        ClosestPair pair;
        if (!is_used_face(&joint->other->surface, f))
            continue;
        read_face(joint, f, x);
        distance_point_triangle(from, x, &pair);
        if (pair.distance < *distance) {
            *distance = pair.distance;
            nearest = f;
        }
    }
    return nearest;
}

static bool tie_all(Joint *joint, const int *node, int count, Status *status)
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
        // The distance stays what it is now.
        joint->tie[i].node = node[i];
        fit(joint, &joint->tie[i], face, x);
    }
    // All ties exist: share the corners among them.
    *joint->count = count;
    joint_stiffen(joint);
    return true;
}

static Joint *create_memory(const char *name, int capacity, Arena *arena, StateList *state)
{
    Joint *joint = ALLOCATE(ARENA_CONTACT, 1, Joint, "joint");
    joint->capacity = capacity;
    // Ties are part of the state.
    joint->count = ALLOCATE(ARENA_CONTACT, 1, int64_t, "count");
    joint->tie = ALLOCATE(ARENA_CONTACT, capacity, Tie, "ties");
    state_add(state, joint->count, sizeof *joint->count, "%s/count", name);
    state_add(state, joint->tie, (size_t)capacity * sizeof(Tie), "%s/ties", name);
    joint->before = ALLOCATE(ARENA_CONTACT, capacity, Vec3, "ends before");
    return joint;
}

// Allocates scratch memory of an evaluation: nodes on one side, corners on the other.
static void create_evaluation(Joint *joint, const char *name, Arena *arena)
{
    const int capacity = joint->capacity;
    joint->node = ALLOCATE(ARENA_CONTACT, capacity, int, "nodes");
    joint->corner = ALLOCATE(ARENA_CONTACT, 3 * capacity, int, "corners");
    joint->x = ALLOCATE(ARENA_CONTACT, capacity, Vec3, "positions");
    joint->v = ALLOCATE(ARENA_CONTACT, capacity, Vec3, "velocities");
    joint->f = ALLOCATE(ARENA_CONTACT, capacity, Vec3, "forces");
    joint->at = ALLOCATE(ARENA_CONTACT, 3 * capacity, Vec3, "corners' positions");
    joint->velocity = ALLOCATE(ARENA_CONTACT, 3 * capacity, Vec3, "corners' velocities");
    joint->on = ALLOCATE(ARENA_CONTACT, 3 * capacity, Vec3, "corners' forces");
}

Joint *joint_create(const char *name, const AttachmentOptions *options, Body *body, Body *other,
                    Arena *arena, StateList *state, Status *status)
{
    // The nodes to tie are those of the region.
    int *node = NULL, count = 0;
    if (!attachment_find_region(body, &options->region, &node, &count, status)) {
        free(node);
        return NULL;
    }
    ASSERT(body->integrator == other->integrator);
    // It belongs to both bodies for good, with space for the nodes that these may become.
    Joint *joint = create_memory(name, attachment_region_capacity(body, count), arena, state);
    create_evaluation(joint, name, arena);
    joint_assign(joint, options, body, other);
    joint->demand = ALLOCATE(ARENA_CONTACT, other->surface.node_count, double, "demand");
    // Tie each node to what is beside it now.
    bool ok = tie_all(joint, node, count, status);
    free(node);
    return ok ? joint : NULL;
}

// --- ties by message ---

Joint *joint_reserve(const char *name, int capacity, const TieScratch *scratch, Arena *arena,
                     StateList *state)
{
    Joint *joint = create_memory(name, capacity, arena, state);
    joint->of_tie = true;
    joint->demand = scratch->demand;
    joint->node = scratch->node;
    joint->corner = scratch->corner;
    joint->x = scratch->x;
    joint->v = scratch->v;
    joint->f = scratch->f;
    joint->at = scratch->at;
    joint->velocity = scratch->velocity;
    joint->on = scratch->on;
    return joint;
}

void joint_assign(Joint *joint, const AttachmentOptions *options, Body *body, Body *other)
{
    joint->options = *options;
    joint->body = body;
    joint->other = other;
}

void joint_add(Joint *joint, int node, int face)
{
    Tie *tie = &joint->tie[*joint->count];
    Vec3 x;
    ASSERT(*joint->count < joint->capacity);
    ASSERT(*joint->count == 0 || tie[-1].node < node);
    joint->body->ops->read_nodes(joint->body->model, &node, 1, &x, NULL);
    tie->node = node;
    fit(joint, tie, face, x);
    ++*joint->count;
}

void joint_drop(Joint *joint)
{
    memset(joint->tie, 0, (size_t)*joint->count * sizeof *joint->tie);
    *joint->count = 0;
    joint->impulse = (Vec3){0.0, 0.0, 0.0};
}

void joint_close(Joint *joint, double way)
{
    for (int64_t i = 0; i < *joint->count; i++) {
        double *offset = &joint->tie[i].end.offset;
        *offset = copysign(fmax(0.0, fabs(*offset) - way), *offset);
    }
}

double joint_gap(const Joint *joint)
{
    double gap = 0.0;
    for (int64_t i = 0; i < *joint->count; i++)
        gap = fmax(gap, fabs(joint->tie[i].end.offset));
    return gap;
}

void joint_add_shares(const Joint *joint, const Body *of, double share, double *sum)
{
    for (int64_t i = 0; i < *joint->count && joint->body == of; i++)
        sum[joint->tie[i].node] += share;
    if (joint->other != of)
        return;
    // A corner has its share once, however many springs divide it.
    memset(joint->demand, 0, (size_t)of->surface.node_count * sizeof *joint->demand);
    for (int64_t i = 0; i < *joint->count; i++) {
        for (int k = 0; k < 3; k++) {
            const int corner = of->surface.face[joint->tie[i].face][k];
            sum[corner] += joint->demand[corner] == 0.0 ? share : 0.0;
            joint->demand[corner] = 1.0;
        }
    }
}

void joint_begin_tick(Joint *joint)
{
    joint->impulse = (Vec3){0.0, 0.0, 0.0};
}

Vec3 joint_impulse(const Joint *joint)
{
    return joint->impulse;
}

const AttachmentOptions *joint_options(const Joint *joint)
{
    return &joint->options;
}

int joint_node_capacity(const Joint *joint)
{
    return joint->capacity;
}

int joint_other_capacity(const Joint *joint)
{
    return 3 * joint->capacity;
}

// ---------------------------------------------------------------------------------------------
// Forces

// Adds the damping. A dashpot does not act along its spring: its moments cancel only if both ends
// act at the same point, the node; if stretching has moved that far off the face, it is weakened so
// that it requires no shorter steps than at the start.
static Vec3 damp(Joint *joint, int i, const Vec3 x[3], const Facet *facet)
{
    Tie here = joint->tie[i];
    double e[3], on_start = find_pulls(&here, x, facet, e);
    fit_to(&here, x, facet, joint->x[i]);
    double weak = on_start / fmax(on_start, find_pulls(&here, x, facet, e));
    Vec3 speed = vec3_sub(joint->v[i], facet_velocity(facet, &here.end, &joint->velocity[3 * i]));
    Vec3 force = vec3_scale(weak * weak * here.damping, speed), on[3];
    facet_distribute(facet, &here.end, force, on);
    for (int k = 0; k < 3; k++)
        joint->on[3 * i + k] = vec3_add(joint->on[3 * i + k], on[k]);
    return force;
}

void joint_apply(Joint *joint, double share)
{
    const Body *body = joint->body, *other = joint->other;
    const int count = (int)*joint->count;
    // Both ends are read in one call each.
    for (int i = 0; i < count; i++) {
        joint->node[i] = (int)joint->tie[i].node;
        memcpy(&joint->corner[3 * i], other->surface.face[joint->tie[i].face],
               3 * sizeof *joint->corner);
    }
    body->ops->read_nodes(body->model, joint->node, count, joint->x, joint->v);
    other->ops->read_nodes(other->model, joint->corner, 3 * count, joint->at, joint->velocity);
    // The spring pulls along the line between both ends; what it takes from one it gives to the
    // other.
    for (int i = 0; i < count; i++) {
        const Tie *tie = &joint->tie[i];
        const Vec3 *x = &joint->at[3 * i];
        Facet facet = facet_of(x);
        Vec3 stretch = vec3_sub(joint->x[i], facet_position(&facet, &tie->end, x));
        Vec3 force = vec3_scale(tie->stiffness, stretch);
        facet_distribute(&facet, &tie->end, force, &joint->on[3 * i]);
        // Damping, likewise at both ends.
        force = vec3_add(force, damp(joint, i, x, &facet));
        joint->f[i] = vec3_scale(-1.0, force);
    }
    // What breaks a tie.
    for (int i = 0; i < count && joint->of_tie; i++)
        joint->impulse = vec3_madd(joint->impulse, share, joint->f[i]);
    // The sums go to both bodies.
    body->ops->add_forces(body->model, joint->node, count, joint->f);
    other->ops->add_forces(other->model, joint->corner, 3 * count, joint->on);
}

// ---------------------------------------------------------------------------------------------
// Topology

void joint_remember(Joint *joint)
{
    for (int64_t i = 0; i < *joint->count; i++)
        joint->before[i] = find_end(joint, &joint->tie[i]);
}

static void remove_tie(Joint *joint, int64_t at)
{
    memmove(&joint->tie[at], &joint->tie[at + 1],
            (size_t)(*joint->count - at - 1) * sizeof *joint->tie);
    memset(&joint->tie[--*joint->count], 0, sizeof *joint->tie);
}

// Moves the end to the nearest of the faces that replaced its own; its position stays.
void joint_other_changed(Joint *joint, const TopologyChange *change)
{
    const int64_t ties = *joint->count;
    // Backwards, since ties that end leave the list.
    for (int64_t i = ties - 1; i >= 0; i--) {
        Tie *tie = &joint->tie[i];
        int64_t heir = -1;
        bool replaced = false;
        double least = (double)INFINITY;
        // The nearest of the faces that replaced the tie's own.
        for (int c = 0; c < change->face_count; c++) {
            const FaceChange *face = &change->face[c];
            replaced |= face->face == tie->face;
            if (face->from != tie->face)
                continue;
            Vec3 x[3];
            ClosestPair pair;
            read_face(joint, face->face, x);
            distance_point_triangle(joint->before[i], x, &pair);
            if (pair.distance >= least)
                continue;
            least = pair.distance;
            heir = face->face;
        }
        // The tie goes on from where its end was.
        if (heir >= 0)
            fit(joint, tie, heir, joint->before[i]);
        else if (replaced)
            remove_tie(joint, i); // its matter is gone
    }
    // Corners have other shares and masses now.
    joint_stiffen(joint);
}

static int64_t find_tie(const Joint *joint, int node)
{
    int64_t low = 0, high = *joint->count;
    while (low < high) {
        int64_t middle = (low + high) / 2;
        if (joint->tie[middle].node < node)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static Tie *tie_of(Joint *joint, int node)
{
    int64_t at = find_tie(joint, node);
    return at < *joint->count && joint->tie[at].node == node ? &joint->tie[at] : NULL;
}

// Finds the face nearest to `target`, walking across sides from the tie's own.
static void walk(const Joint *joint, Tie *tie, Vec3 target)
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

// Inserts a tie where its node belongs: ties ascend by node.
static void insert(Joint *joint, const Tie *tie)
{
    int64_t at = find_tie(joint, (int)tie->node);
    memmove(&joint->tie[at + 1], &joint->tie[at],
            (size_t)(*joint->count - at) * sizeof *joint->tie);
    joint->tie[at] = *tie;
    ++*joint->count;
}

// Ties a parent of the last tied node where it is now.
static void inherit(Joint *joint, const Tie *went, int parent)
{
    const Body *body = joint->body;
    Tie tie = *went;
    Vec3 x;
    if (body->ops->is_fixed(body->model, parent) || tie_of(joint, parent) != NULL ||
        *joint->count == joint->capacity)
        return;
    body->ops->read_nodes(body->model, &parent, 1, &x, NULL);
    tie.node = parent;
    walk(joint, &tie, x);
    insert(joint, &tie);
}

// Ties a new node between two tied ones between their ends; a copy like its original.
void joint_topology_changed(Joint *joint, const TopologyChange *change)
{
    const Body *body = joint->body;
    // Ties of nodes that are gone end; the last ones go on at the nodes between which these were.
    for (int i = 0; i < change->gone_count; i++) {
        Tie *tie = tie_of(joint, change->gone[i]);
        if (tie == NULL)
            continue;
        const Tie went = *tie;
        remove_tie(joint, tie - joint->tie);
        const bool last = joint->of_tie && *joint->count == 0;
        for (int k = 0; k < 2 && last; k++)
            inherit(joint, &went, change->gone_parent[i][k]);
    }
    // A new node between two tied ones is tied, too.
    for (int i = 0; i < change->born_count; i++) {
        const NodeBirth *born = &change->born[i];
        const Tie *from = tie_of(joint, born->parent[0]), *to = tie_of(joint, born->parent[1]);
        if (from == NULL || to == NULL || body->ops->is_fixed(body->model, born->node))
            continue;
        if (*joint->count == joint->capacity) {
            joint->refused++;
            continue;
        }
        // Its end lies between those of its parents.
        Tie tie = *from;
        tie.node = born->node;
        if (from != to)
            walk(joint, &tie,
                 vec3_scale(0.5, vec3_add(find_end(joint, from), find_end(joint, to))));
        insert(joint, &tie);
    }
    // Masses have been divided.
    joint_stiffen(joint);
}

// ---------------------------------------------------------------------------------------------
// Queries

bool joint_check(const Joint *joint)
{
    // As many as there is space for.
    const BodySurface *mine = &joint->body->surface, *theirs = &joint->other->surface;
    if (*joint->count < 0 || *joint->count > joint->capacity)
        return false;
    // Nodes and faces exist, and nodes ascend.
    for (int64_t i = 0; i < *joint->count; i++) {
        const Tie *tie = &joint->tie[i];
        double sum = 0.0;
        if (tie->node < 0 || tie->node >= mine->node_count ||
            mine->node_face_end[tie->node] <= mine->node_face_start[tie->node] ||
            (i > 0 && tie->node <= joint->tie[i - 1].node) || tie->face < 0 ||
            tie->face >= theirs->face_count || !is_used_face(theirs, tie->face))
            return false;
        // Weights sum to 1, and all numbers are sensible.
        for (int k = 0; k < 3; k++) {
            sum += tie->end.weight[k];
            if (!(fabs(tie->end.weight[k]) < 1e12)) // far beyond the thinnest face
                return false;
        }
        if (!(fabs(sum - 1.0) < 1e-6) || !(fabs(tie->end.offset) < 1e6) ||
            !(tie->stiffness >= 0.0) || !(tie->stiffness < 1e15) || !(tie->damping >= 0.0) ||
            !(tie->damping < 1e15))
            return false;
    }
    return true;
}

int joint_count(const Joint *joint)
{
    return (int)*joint->count;
}

int64_t joint_refused(const Joint *joint)
{
    return joint->refused;
}
