// SPDX-License-Identifier: MIT
// A law of contact: the tool's capsules against a hollow wall (server/sim/README.md, "Contact of
// faces"). Every face with depth > 0 pushes with its own stiffness kappa * rest area along the
// gradient of its distance; nothing is shared or merged at edges, so the sum is continuous and
// conservative. The proxy steps back beyond max_force. Step thread.
#include "sim/contact/contact_data.h"

#include "body/press.h"
#include "geometry/distance.h"
#include "sim/bristle.h"

#include <string.h>

static const double CREEP = 0.3; // of the floor: largest step in a substep of a proxy that is there
enum { RETREATS = 8 };           // steps back per substep before forces are scaled instead
// Share of the damping that a face has at once, and share of its stiffness from which on it has
// all. A node of the wall that a slow hand meets at full stiffness bounces off the tip; at full
// damping it is given its momentum in a tick: either way the force rises and is gone again.
static const double DAMPED_AT_ONCE = 0.2, DAMPED_FROM = 0.1;
// New nodes bulge towards the tool, by a millimetre of a coarse face, or away, until the wall has
// given way and come to rest: for a while the force changes by at most such a share of itself, and
// of max_force, in a tick.
static const double UNSETTLED_TIME = 0.06, CHANGE = 0.05, LEAST_CHANGE = 1e-3;
static const double AWAY_TIME = 0.1; // [s] after which a tool caught behind a wall is released

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

// How a face that the tool overlaps pushes.
typedef struct FaceLaw {
    double depth, slope; // as the force counts it [m], and its derivative by the true depth
    double damping;      // time [s]
} FaceLaw;

static FaceLaw law_at(const Body *body, double depth, double radius)
{
    const FacePress press = face_press(depth, radius, body->contact_barrier);
    const double at_once = fmin(1.0, press.share / DAMPED_FROM);
    const double damped = DAMPED_AT_ONCE + (1.0 - DAMPED_AT_ONCE) * at_once;
    return (FaceLaw){
        .depth = press.depth, .slope = press.slope, .damping = body->contact_damping * damped};
}

// Adds the push of one pair: `share` of the face's stiffness, along `normal`.
static void add_push(Contact *contact, const ToolPlacement *at, int index, const double weight[3],
                     Vec3 point, Vec3 normal, const FaceLaw *law, double share)
{
    const Candidate *candidate = &contact->candidate[index];
    ContactForces *sum = &contact->forces;
    const double stiffness = candidate->stiffness;
    Vec3 relative = vec3_sub(tool_velocity(at, point), node_velocity(contact, candidate, weight));
    double separating = vec3_dot(relative, normal);
    // Damped, but never adhesive; without the noise of poses.
    const Vec3 calm = vec3_add(contact->calm.linear,
                               vec3_cross(contact->calm.angular, vec3_sub(point, at->position)));
    const double damped = separating + vec3_dot(calm, normal);
    double force = share * stiffness * fmax(0.0, law->depth - law->damping * damped);
    add_force(contact, candidate, weight, point, vec3_scale(force, normal));

    // Sums for the wrench and for the proxy's steps.
    const double k = share * law->slope * stiffness;
    sum->stiffness = sym3_madd(sum->stiffness, 1.0, sym3_outer(k, normal));
    sum->damping = sym3_madd(sum->damping, law->damping, sym3_outer(share * stiffness, normal));
    sum->weight += force;
    sum->point = vec3_madd(sum->point, force, point);
    sum->normal = vec3_madd(sum->normal, force, normal);
    if (contact->spring != NULL)
        contact_note_spring(contact, candidate, weight, normal, k,
                            share * stiffness * law->depth * contact->spring_turn, false);
    // Friction needs the push again, with its slip.
    if (force > 0.0 && contact_friction(contact) > 0.0 &&
        contact->push_count < contact->push_capacity) {
        contact->push[contact->push_count++] =
            (Push){.candidate = index, .weight = {weight[0], weight[1], weight[2]}, .force = force};
        PushSums *sums = &contact->push_sums;
        sums->force += force;
        sums->stiffness += force * stiffness * fmin(1.0, law->slope);
        sums->normal = vec3_madd(sums->normal, force, normal);
        sums->slip = vec3_madd(sums->slip, force, vec3_madd(relative, -separating, normal));
    }
}

// --- one face and one capsule ---

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
    contact_corners(contact, candidate, x);
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
    contact_corners(contact, candidate, x);
    out->crossed = false;
    const ClosestPair *nearest;
    const bool sphere = contact_is_sphere(&contact->tool->capsule[shape]);
    out->pair_count = contact_find_pairs(x, p, q, sphere, out->pair, &nearest);
    if (out->pair_count == 0) {
        measure_crossed(contact, candidate, p, q, side, out);
        return;
    }
    out->distance = nearest->distance;
    out->turn = 1;
    if (contact->in_front[shape][index] <= approach) {
        int sign = contact_sign(contact, candidate, nearest->weight, nearest->on_triangle,
                                nearest->on_segment);
        out->turn = sign == 0 ? 1 : side * sign;
    }
    out->phi = out->turn * nearest->distance;
}

// Adds the pushes of one acting face.
static void push_face(Contact *contact, const ToolPlacement *at, int index,
                      const FaceDistance *face, int side, double radius)
{
    const Candidate *candidate = &contact->candidate[index];
    double share[DISTANCE_PAIRS] = {1.0}, sum = 1.0, phi = face->phi;
    if (!face->crossed)
        phi = face->turn * contact_soft_minimum(face->pair, face->pair_count, face->distance,
                                                CONTACT_SOFT * radius, share, &sum);
    double depth = radius - phi;
    if (!(depth > 0.0))
        return;
    // Figures of the whole contact.
    ContactForces *forces = &contact->forces;
    forces->acting++;
    forces->crossed += face->crossed || face->turn < 0;
    forces->depth = fmax(forces->depth, depth);
    const FaceLaw law = law_at(contact->body, depth, radius);
    const double above = phi - CONTACT_AXIS_FLOOR * radius;
    // Each pair pushes along its own direction; without a distance, along the face's normal.
    for (int j = 0; j < face->pair_count; j++) {
        if (share[j] == 0.0)
            continue;
        const ClosestPair *pair = &face->pair[j];
        Vec3 normal;
        bool flat = face->crossed || pair->distance < CONTACT_TOUCHING;
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
        add_push(contact, at, index, pair->weight, pair->on_triangle, normal, &law, share[j] / sum);
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
    const double reach = (1.0 + CONTACT_SOFT_REACH * CONTACT_SOFT) * capsule->radius;
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
    const Vec3 slip = vec3_scale(1.0 / normal_force, sums->slip); // mean
    const Vec3 force =
        bristle_force(bristle, slip, vec3_unit(sums->normal), sums->stiffness / normal_force,
                      contact->body->contact_damping, contact_friction(contact) * normal_force, dt);
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

// --- sides ---

// On which side of each face a tool is (server/sim/README.md, "Sides of hollow walls"): a hollow
// wall pushes the tool back to the side from which it came, even after the axis has crossed it.
// Once per tick. Only a face whose interior is nearest can be crossed. If the nearest point of a
// face is on an edge or a corner, a nearer neighbour there decides: in front of it, the tool is on
// the side that is seen, because it went around the edge; behind it, the tool has crossed both.
// Faces beyond a fold are seen from behind, through the wall, until the tool comes around to them,
// so a side seen from afar must not be remembered.

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
    Vec3 x[3];
    contact_corners(contact, candidate, x);
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

// Then the others: those of which a nearer neighbour decides.
static void follow_roots(Contact *contact, int shape)
{
    signed char *side = contact->side[shape];
    for (int i = 0; i < contact->candidate_count; i++) {
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
    const int count = contact->candidate_count;
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
    follow_roots(contact, shape);
    float *gap = contact->gap[shape];
    for (int i = 0; i < count && gap != NULL; i++)
        gap[contact->candidate[i].face] = (float)contact->distance[i];
}

// --- following refined and merged faces ---

// Refinement must not move a tool across a wall: new faces take the side of those that they
// replace. When several merge, the one that was nearest to the tool decides: others may have been
// seen across a fold.
static void follow_faces(Contact *contact, int shape, const TopologyChange *change)
{
    signed char *side = contact->side[shape], *old_side = contact->old_side;
    float *gap = contact->gap[shape], *old_gap = contact->old_gap;
    for (int i = 0; i < change->face_count; i++) {
        int from = change->face[i].from;
        if (from < 0)
            continue;
        old_side[from] = side[from];
        old_gap[from] = gap[from];
    }
    for (int i = 0; i < change->face_count; i++)
        side[change->face[i].face] = 0;
    for (int i = 0; i < change->face_count; i++) {
        int face = change->face[i].face, from = change->face[i].from;
        if (from < 0 || old_side[from] == 0 || (side[face] != 0 && gap[face] <= old_gap[from]))
            continue;
        side[face] = old_side[from];
        gap[face] = old_gap[from];
    }
}

static void wall_follow(Contact *contact, const TopologyChange *change)
{
    if (contact->proxy->valid)
        contact->proxy->unsettled = UNSETTLED_TIME;
    for (int shape = 0; shape < contact->tool->capsule_count; shape++)
        follow_faces(contact, shape, change);
}

// --- the proxy ---

// Watches for a tool caught behind a wall: only crossed faces act while the hand itself is clear of
// the body. Releases it after a while, since it would pull for ever.
static void watch_caught(Contact *contact, Vec3 pose, double margin, double tick)
{
    Proxy *proxy = contact->proxy;
    if (proxy->crossed_only != 0) {
        Region region = {.kind = REGION_CAPSULE, .from = pose, .to = pose};
        region.radius = contact->lever + contact->largest_radius + margin +
                        CONTACT_FACE_REACH * contact->body->surface.longest_edge;
        int node; // not used, only the count is
        const bool clear =
            contact->body->ops->find_nodes(contact->body->model, &region, &node, 0) == 0;
        proxy->crossed_only = clear ? proxy->crossed_only + 1 : 1;
    }
    if ((double)(proxy->crossed_only - 1) * tick > AWAY_TIME)
        contact_clear(contact);
}

// Returns the distance of the nearest candidate from its axis at the start of the tick.
static double least_gap(const Contact *contact)
{
    double least = (double)INFINITY;
    for (int shape = 0; shape < contact->tool->capsule_count; shape++)
        for (int i = 0; i < contact->candidate_count; i++)
            least = fmin(least, contact->gap_begin[shape][i]);
    return least;
}

static void forget_sides(Contact *contact)
{
    for (int shape = 0; shape < contact->tool->capsule_count; shape++)
        memset(contact->side[shape], 0, (size_t)contact->body->surface.face_count);
}

// A closed wall has an inside; a sheet, or what is cut open, has none.
static bool is_closed(const BodySurface *surface)
{
    for (int node = 0; node < surface->node_used; node++)
        for (int k = surface->node_face_start[node]; k < surface->node_face_end[node]; k++) {
            const int *across = surface->face_neighbor[surface->node_face[k]];
            if (across[0] < 0 || across[1] < 0 || across[2] < 0)
                return false;
        }
    return true;
}

// Leads a tool that has just appeared inside of a closed wall, or across it, out the nearest way,
// before its place is seen. One far from any face stays: it may be there, and the wall holds it in.
static bool lead_out(Contact *contact, double margin)
{
    enum { ROUNDS = 8 }; // out of a shaft's way through two walls, or of a corner
    Vec3 out;
    bool inside = false;
    for (int round = 0; round < ROUNDS; round++) {
        const ToolPlacement at = contact_here(contact);
        if (!contact_look(contact, &at, true, &out))
            return inside;
        if (round == 0 && !is_closed(&contact->body->surface))
            return false;
        inside = true;
        contact->proxy->position = vec3_add(contact->proxy->position, out);
        forget_sides(contact);
        const ToolPlacement there = contact_here(contact);
        contact_find_candidates(contact, &there, margin);
    }
    return inside;
}

static void limit_change(Contact *contact, double tick)
{
    Proxy *proxy = contact->proxy;
    contact->told = 0.0;
    if (!(proxy->unsettled > 0.0))
        return;
    const double least = LEAST_CHANGE * contact->tool->max_force;
    contact->limit = fmin(contact->limit, (1.0 + CHANGE) * proxy->felt + least);
    contact->told = fmin(contact->limit, (1.0 - CHANGE) * proxy->felt);
    proxy->unsettled = fmax(0.0, proxy->unsettled - tick);
}

static Vec3 wall_begin(Contact *contact, const ContactMotion *motion)
{
    const double r = contact->smallest_radius;
    const bool fresh = !contact->proxy->valid;
    if (contact->tool->kind != TOOL_STATIC && contact->proxy->valid)
        watch_caught(contact, motion->tool->begin_position, r, motion->tick);
    // Search early, so that sides are known before contact.
    const double cap = contact_search(contact, motion, r);
    const bool led_out = fresh && contact_is_near(contact) && lead_out(contact, r);
    contact_ease(contact, led_out, motion->tick);
    limit_change(contact, motion->tick);
    contact->forces.floor = least_gap(contact) - CONTACT_AXIS_FLOOR * r;
    return contact_go_free(contact, motion, cap);
}

static void wall_find(Contact *contact, const ToolPlacement *at, double margin)
{
    contact_find_faces(contact, at, margin);
    contact_find_all_normals(contact);
    for (int shape = 0; shape < contact->tool->capsule_count; shape++)
        update_shape(contact, at, shape);
}

// Steps back along the force until it is at most max_force and the axis is clear of the wall.
static void wall_move(Contact *contact, Vec3 target, Quat orientation, double h)
{
    const double r = contact->smallest_radius;
    Proxy *next = &contact->next;
    // Never beyond the wall that it lies on, of which only an end of its axis would be known;
    // slowly there, or it would step back by as much each time, now along one face, now along the
    // next.
    const double cap = fmin(CONTACT_STEP_CAP * r,
                            fmax(contact->forces.floor, 0.0) + CREEP * CONTACT_AXIS_FLOOR * r);
    contact_move_proxy(next, target, orientation, contact->lever,
                       contact_ease_step(contact, target, orientation, cap, h));
    contact_read(contact);
    for (int retreat = 0;; retreat++) {
        const ToolPlacement at = contact_placement(contact, 1.0, h);
        contact_evaluate(contact, &at, h);
        contact->fresh = true;
        const ContactForces *f = &contact->forces;
        double size = vec3_length(f->force);
        double excess = size - contact->limit;
        if ((excess <= 0.0 && f->floor >= 0.0) || retreat == RETREATS || !(size > 0.0))
            return;
        Vec3 n = vec3_scale(1.0 / size, f->force);
        double along = sym3_along(f->stiffness, n);
        // A step back also slows the approach.
        along += sym3_along(f->damping, n) / h;
        double back = along > 0.0 ? fmax(0.0, excess / along) : 0.0;
        next->position = vec3_madd(next->position, fmin(0.5 * r, back), n);
        if (f->floor < 0.0)
            next->position = vec3_madd(next->position, fmin(0.5 * r, -f->floor), f->floor_normal);
    }
}

static void wall_evaluate(Contact *contact, const ToolPlacement *at, double dt)
{
    contact->push_count = 0;
    for (int shape = 0; shape < contact->tool->capsule_count; shape++) {
        int first = contact->push_count;
        contact->push_sums = (PushSums){0};
        evaluate_capsule(contact, at, shape);
        contact->trial[shape] = contact->proxy->bristle[shape];
        add_friction(contact, first, &contact->trial[shape], dt);
    }
}

static void wall_end(Contact *contact)
{
    Proxy *next = &contact->next;
    for (int shape = 0; shape < contact->tool->capsule_count && contact->local_count > 0; shape++)
        next->bristle[shape] = contact->trial[shape];
    // A tool out of reach has no recent forces; the old ones are in no state.
    const ContactForces *last = &contact->forces;
    const bool crossed =
        contact_is_near(contact) && last->acting > 0 && last->acting == last->crossed;
    const ContactSums *sums = &contact->sums;
    next->felt = sums->time > 0.0 ? vec3_length(sums->impulse) / sums->time : 0.0;
    next->crossed_only = !crossed ? 0 : next->crossed_only > 0 ? next->crossed_only : 1;
}

static void wall_clear(Contact *contact)
{
    if (contact_clear_proxy(contact))
        forget_sides(contact);
}

// --- creation ---

// Allocates what following refined and merged faces needs.
static void create_memory(Contact *contact, const char *name, Arena *arena, StateList *state)
{
    int faces = contact->body->surface.face_count;
    contact->old_side = ALLOCATE(ARENA_CONTACT, faces, signed char, "sides before");
    contact->old_gap = ALLOCATE(ARENA_CONTACT, faces, float, "gaps before");
    for (int k = 0; k < contact->tool->capsule_count; k++) {
        contact->gap[k] = ALLOCATE(ARENA_CONTACT, faces, float, "gaps");
        state_add(state, contact->gap[k], (size_t)faces * sizeof(float), "%s/gaps%d", name, k);
    }
}

// The longest border of its faces has a strip one face wide, with as many nodes around as on it.
static void choose_ring(Contact *contact)
{
    const int nodes = contact->body->surface.node_count;
    contact->ring_capacity = 2 * contact->face_capacity + 16;
    if (contact->node_capacity == nodes || contact->ring_capacity > nodes)
        contact->ring_capacity = nodes + 3; // never full
}

static void wall_create(Contact *contact, const char *name, Arena *arena, StateList *state)
{
    contact_create_capsules(contact, name, arena);
    choose_ring(contact);
    contact_create_nodes(contact, name, arena, contact->ring_capacity, contact->node_capacity);
    const int faces = contact->body->surface.face_count, most = contact->face_capacity;
    for (int k = 0; k < contact->tool->capsule_count; k++) {
        contact->side[k] = ALLOCATE(ARENA_CONTACT, faces, signed char, "sides");
        state_add(state, contact->side[k], (size_t)faces, "%s/sides%d", name, k);
        contact->in_front[k] = ALLOCATE(ARENA_CONTACT, most, double, "sides that neighbours know");
    }
    if (body_changes(contact->body))
        create_memory(contact, name, arena, state);
    contact->distance = ALLOCATE(ARENA_CONTACT, most, double, "distances");
    contact->corners = ALLOCATE(ARENA_CONTACT, most, unsigned char, "nearest corners");
    contact->seen_side = ALLOCATE(ARENA_CONTACT, most, signed char, "seen sides");
    contact->has_side = ALLOCATE(ARENA_CONTACT, most, bool, "sides at all");
    contact->side_from = ALLOCATE(ARENA_CONTACT, most, int, "sides_from");
    contact->push_capacity = most < CONTACT_PUSHES ? most : CONTACT_PUSHES;
    contact->push = ALLOCATE(ARENA_CONTACT, contact->push_capacity, Push, "pushes");
}

const ContactLaw contact_wall = {
    .share = 1.0,
    .has_springs = true,
    .ease_lag = 0.5, // at 0.2 a thin wall was thrown, and bounced on the tip
    .create = wall_create,
    .begin = wall_begin,
    .find = wall_find,
    .move = wall_move,
    .read = contact_read_nodes,
    .evaluate = wall_evaluate,
    .apply = contact_apply_forces,
    .end = wall_end,
    .clear = wall_clear,
    .follow = wall_follow,
};
