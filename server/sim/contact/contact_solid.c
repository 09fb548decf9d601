// SPDX-License-Identifier: MIT
// A law of contact: the tool's capsules against a solid (server/sim/README.md, "Contact of
// solids"). One potential of the capsules and the nodes, without memory and without branches that
// change a force by a jump, and its implicit impulses on the nodes of each substep, with the proxy
// as a massless part of the same solve. Step thread.
#include "sim/contact/contact_data.h"

#include "geometry/distance.h"

#include <string.h>

// Distance of the axis at which the barrier begins [radius]: shallow presses feel the points alone.
static const double BARRIER_FROM = 0.85;
// What is added to `contact.stiffness` for the points: without, a tool that is dragged rests on the
// barrier, and its force jumps from face to face, by a quarter.
static const double POINT_RATIO = 4.0;
// What is added to it for the barrier: with 32 and less the surface of block.cfg snapped past a
// probe pressed by two to four radii, and the force fell by a tenth.
static const double BARRIER_RATIO = 512.0;

static const double BARRIER_LEAST = 1e-3; // nearer, the barrier's force goes straight on [radius]
// Least pull towards the hand, as a share of the nodes' slope: where all pushes lie in a plane or
// on a line, the slope alone cannot be inverted, and little force is as nothing.
static const double LEAST_PULL = 1e-6;
enum { PASSES = 4 }; // at most, to find which nodes separate

// Of friction: speed from which on a tool moves [radius/s], and times in which its mean velocity
// and the coefficients follow [s]. Longer ones leave friction in a fold for too
// long after it was released.
static const double MOVING = 0.2, WAY_TIME = 0.015, FRICTION_TIME = 0.02;
// Cosine of the angle between a push and that of the first touch, from which on it is still a
// press, and up to which it is not.
static const double STRAIGHT = 0.99, TURNED = 0.95;
// Share of the pushes on nodes that cancel each other from which on tissue is closed around a tool:
// 0.08 for a ball pressed by 0.6 radii, 0.19 by one, 0.2 to 0.5 by more.
static const double CLOSED = 0.12;

// --- the start of a tick -------------------------------------------------------------------------

// Leads a tool that is inside of a solid out of it, where it is felt gently at first. One that was
// outside before, and over which the body was thrown, begins again where it last was clear of the
// body; one that appeared inside leaves by the nearest way.
static void lead_out(Contact *contact, bool fresh, double tick)
{
    Proxy *proxy = contact->proxy;
    Clear *clear = contact->clear;
    const ToolPlacement at = contact_here(contact);
    Vec3 out;
    const bool inside = contact_look(contact, &at, fresh, &out);
    if (inside) {
        if (clear->touched == 0)
            clear->position = vec3_add(proxy->position, out);
        proxy->position = clear->position;
        contact_forget_candidates(contact);
    } else if (!(contact->forces.depth > 0.0)) {
        clear->position = proxy->position;
    }
    clear->touched = 0;
    contact->touched_count = 0;
    contact_ease(contact, inside, tick);
}

static Vec3 solid_begin(Contact *contact, const ContactMotion *motion)
{
    const bool fresh = !contact->proxy->valid;
    if (contact->fit != NULL)
        contact->fit->step = motion->step;
    const double cap = contact_search(contact, motion, contact_margin(contact));
    lead_out(contact, fresh, motion->tick);
    return contact_go_free(contact, motion, cap);
}

static void solid_find(Contact *contact, const ToolPlacement *at, double margin)
{
    if (contact->fit != NULL)
        contact->fit->search++;
    contact_find_faces(contact, at, margin);
    if (contact->fit != NULL)
        contact_fit_gather(contact);
    contact_forget_numbers(contact);
}

// --- the potential -------------------------------------------------------------------------------

// Returns the derivative of the barrier -(s - s0)^2 log(s / s0) (Li et al. 2020, Incremental
// Potential Contact, equation 6), and its second one, at a distance of s radii.
static double barrier(double s, double *curvature)
{
    const double s0 = BARRIER_FROM, at = fmax(s, BARRIER_LEAST), off = at - s0;
    const double log_ratio = log(at / s0);
    const double slope = -2.0 * off * log_ratio - off * off / at;
    *curvature = -2.0 * log_ratio - 4.0 * off / at + off * off / (at * at);
    return slope + *curvature * (s - at);
}

static double barrier_energy(double s)
{
    const double s0 = BARRIER_FROM, at = fmax(s, BARRIER_LEAST), off = at - s0;
    double curvature, slope = barrier(at, &curvature);
    return -off * off * log(at / s0) + (s - at) * (slope + 0.5 * curvature * (s - at));
}

// Adds a push at a point of a face: a force on the tool along `normal`, the opposite on the nodes,
// and the stiffness with which it grows.
static void add_push(Contact *contact, const Candidate *candidate, const double weight[3],
                     Vec3 point, Vec3 normal, double force, double stiffness, double distance,
                     bool stays)
{
    ContactForces *sum = &contact->forces;
    sum->weight += force;
    sum->point = vec3_madd(sum->point, force, point);
    sum->normal = vec3_madd(sum->normal, force, normal);
    if (contact->spring != NULL)
        contact_note_spring(contact, candidate, weight, normal, stiffness, force / distance, stays);
    const Sym3 k = sym3_outer(stiffness, normal);
    for (int c = 0; c < 3; c++) {
        const int i = candidate->node[c];
        contact->f[i] = vec3_madd(contact->f[i], -weight[c] * force, normal);
        contact->lumped[i] = sym3_madd(contact->lumped[i], weight[c], k);
        if (weight[c] > 0.0)
            contact->pusher[i] = contact->shape;
    }
}

// Adds the pushes of points spread over a face: each as far as it lies inside the capsule.
static void push_points(Contact *contact, const Candidate *candidate, const Vec3 x[3], Vec3 p,
                        Vec3 q, double radius, double stiffness)
{
    const double share = stiffness / contact->point_count;
    const Vec3 axis = vec3_sub(q, p);
    const double length2 = vec3_dot(axis, axis);
    for (int k = 0; k < contact->point_count; k++) {
        const double *w = contact->point_weight[k];
        Vec3 z = vec3_madd(vec3_madd(vec3_scale(w[0], x[0]), w[1], x[1]), w[2], x[2]);
        Vec3 away = vec3_sub(p, z);
        if (length2 > 0.0)
            away = vec3_madd(away, fmin(1.0, fmax(0.0, -vec3_dot(away, axis) / length2)), axis);
        const double distance2 = vec3_dot(away, away);
        if (distance2 >= radius * radius || distance2 < CONTACT_TOUCHING * CONTACT_TOUCHING)
            continue;
        const double distance = sqrt(distance2), depth = radius - distance;
        ContactForces *sum = &contact->forces;
        sum->acting++;
        sum->depth = fmax(sum->depth, depth);
        sum->energy += 0.5 * share * depth * depth;
        add_push(contact, candidate, w, z, vec3_scale(1.0 / distance, away), share * depth, share,
                 distance, true);
    }
}

// Adds the barrier between a face and the capsule's axis, of the soft minimum of their distances
// (server/sim/README.md, "Capsules").
static void push_barrier(Contact *contact, const Candidate *candidate, const Vec3 x[3], Vec3 p,
                         Vec3 q, bool sphere, double radius, double stiffness)
{
    ContactForces *forces = &contact->forces;
    ClosestPair pair[DISTANCE_PAIRS];
    const ClosestPair *nearest;
    const int pairs = contact_find_pairs(x, p, q, sphere, pair, &nearest);
    if (pairs == 0) {
        forces->floor = 0.0; // inside: the next tick leads the proxy out
        return;
    }
    const double eps = CONTACT_SOFT * radius, least = nearest->distance;
    double share[DISTANCE_PAIRS], sum;
    const double s = contact_soft_minimum(pair, pairs, least, eps, share, &sum) / radius;
    forces->floor = fmin(forces->floor, least);
    if (s >= BARRIER_FROM)
        return;
    double curvature;
    const double force = -stiffness * radius * barrier(s, &curvature);
    forces->acting++;
    forces->depth = fmax(forces->depth, radius - least);
    forces->energy += stiffness * radius * radius * barrier_energy(s);
    for (int j = 0; j < pairs; j++) {
        if (share[j] == 0.0 || pair[j].distance < CONTACT_TOUCHING)
            continue;
        // Where two pairs are equally near, the force turns from one to the other within eps.
        const double part = share[j] / sum, turn = force * part * (1.0 - part) / eps;
        Vec3 normal =
            vec3_scale(1.0 / pair[j].distance, vec3_sub(pair[j].on_segment, pair[j].on_triangle));
        add_push(contact, candidate, pair[j].weight, pair[j].on_triangle, normal, part * force,
                 part * stiffness * curvature + turn, pair[j].distance, false);
    }
}

static void evaluate_shape(Contact *contact, const ToolPlacement *at, int shape, double approach)
{
    const Capsule *capsule = &contact->tool->capsule[shape];
    const bool sphere = contact_is_sphere(capsule);
    const double radius = capsule->radius;
    contact->shape = (unsigned char)shape;
    const double ratio = contact->body->contact_ratio;
    const double of_points = 1.0 + POINT_RATIO / ratio, of_barrier = 1.0 + BARRIER_RATIO / ratio;
    Vec3 p, q;
    contact_axis(capsule, at, &p, &q);
    for (int i = 0; i < contact->candidate_count; i++) {
        if (contact->gap_begin[shape][i] >= radius + approach)
            continue;
        const Candidate *candidate = &contact->candidate[i];
        Vec3 x[3];
        contact_corners(contact, candidate, x);
        const double stiffness = candidate->stiffness;
        push_points(contact, candidate, x, p, q, radius, of_points * stiffness);
        if (contact->gap_begin[shape][i] <
            (BARRIER_FROM + CONTACT_SOFT_REACH * CONTACT_SOFT) * radius + approach)
            push_barrier(contact, candidate, x, p, q, sphere, radius, of_barrier * stiffness);
    }
}

// Lists the nodes that are pushed, then the carriers that move with them, in ascending order.
static void list_touched(Contact *contact)
{
    Carriers *carriers = &contact->carriers;
    contact->pressed_count = contact->touched_count = 0;
    for (int i = 0; i < contact->local_count; i++)
        if (sym3_trace(contact->lumped[i]) > 0.0)
            contact->pressed[contact->pressed_count++].local = i;
    if (contact->fit != NULL)
        contact_fit_spread(contact);
    else
        carriers->count = contact->local_count;
    for (int i = 0; i < carriers->count; i++) {
        if (!(sym3_trace(carriers->lumped[i]) > 0.0))
            continue;
        carriers->touched[i] = contact->touched_count;
        contact->touched_node[contact->touched_count] = carriers->node[i];
        contact->touched[contact->touched_count++].carrier = i;
    }
}

static void solid_evaluate(Contact *contact, const ToolPlacement *at, double dt)
{
    (void)dt; // friction is a part of the impulses
    memset(contact->lumped, 0, (size_t)contact->local_count * sizeof *contact->lumped);
    const double approach = contact_approach(contact, at);
    for (int shape = 0; shape < contact->tool->capsule_count; shape++)
        evaluate_shape(contact, at, shape, approach);
    list_touched(contact);
}

// --- the substep ---------------------------------------------------------------------------------

// The hand's way, as far as it is safe: how much of it the proxy goes, solid_kick decides.
static void solid_move(Contact *contact, Vec3 target, Quat orientation, double h)
{
    Proxy *next = &contact->next;
    // Never across a face.
    const double cap =
        fmin(CONTACT_STEP_CAP * contact->smallest_radius, 0.5 * contact->forces.floor);
    contact_move_proxy(next, target, orientation, contact->lever,
                       contact_ease_step(contact, target, orientation, cap, h));
}

// Reads positions: velocities are felt after the body's own kick.
static void solid_read(Contact *contact)
{
    const Body *body = contact->body;
    if (contact->fit != NULL)
        contact_fit_read(contact);
    else
        body->ops->read_nodes(body->model, contact->node, contact->local_count, contact->x, NULL);
}

// The forces at the start of the substep, of which solid_kick makes impulses.
static void solid_apply(Contact *contact, double fraction, double weight, double h)
{
    (void)fraction;
    (void)weight;
    contact_read(contact);
    const ToolPlacement at = contact_placement(contact, 0.0, h);
    contact_evaluate(contact, &at, h);
}

// --- the impulses of a substep -------------------------------------------------------------------

// Adds s (1 - n n^T).
static void add_across(Sym3 *k, double s, Vec3 n)
{
    k->xx += s * (1.0 - n.x * n.x);
    k->yy += s * (1.0 - n.y * n.y);
    k->zz += s * (1.0 - n.z * n.z);
    k->yz -= s * n.y * n.z;
    k->zx -= s * n.x * n.z;
    k->xy -= s * n.x * n.y;
}

// Returns the mass with which a pressed node resists; 0: it cannot move.
static double mass_of(const Contact *contact, const CarrierWeight *weight, int count)
{
    double inverse = 0.0;
    for (int c = 0; c < count; c++) {
        const double m = contact->touched[contact->carriers.touched[weight[c].carrier]].mass;
        if (count == 1)
            return m;
        inverse += m > 0.0 ? weight[c].weight * weight[c].weight / m : 0.0;
    }
    return inverse > 0.0 ? 1.0 / inverse : 0.0;
}

// Adds the force on a node to its carriers, if the tool that moves at `u` pushes it. Damping must
// not pull: a node that separates faster than it is pushed is free.
static void add_pressed(Contact *contact, Pressed *pressed, Vec3 u, double h, double g)
{
    const Sym3 d = contact->lumped[pressed->local];
    const Vec3 f = contact->f[pressed->local],
               slip = vec3_sub(pressed->speed, vec3_add(u, pressed->swing));
    int count;
    CarrierWeight own;
    const CarrierWeight *weight = carriers_of(&contact->carriers, pressed->local, &own, &count);
    const double m = mass_of(contact, weight, count);
    const Sym3 k = m > 0.0 ? sym3_scale(g / m, d) : (Sym3){0};
    const Vec3 push = sym3_solve(k, 1.0, vec3_madd(vec3_scale(h, f), -g, sym3_times(d, slip)));
    pressed->acts = vec3_dot(push, f) > 0.0;
    for (int c = 0; c < count && pressed->acts; c++) {
        Touched *to = &contact->touched[contact->carriers.touched[weight[c].carrier]];
        to->force = vec3_madd(to->force, weight[c].weight, f);
        to->acts = true;
        to->shape = contact->pusher[pressed->local];
    }
}

// Returns the part of a carrier's impulse that friction counts: some carriers of a fitted surface
// pull a little and others push more, but their shares add up to the push on the surface.
static double friction_share(const Contact *contact, const Touched *touched)
{
    const Carriers *carriers = &contact->carriers;
    const double force = vec3_length(carriers->f[touched->carrier]);
    return carriers->push == NULL ? 1.0 : fmin(1.0, carriers->push[touched->carrier] / force);
}

// What a capsule does to the carriers that it pushes.
typedef struct CapsulePush {
    Vec3 net;     // sum of the impulses [N s]
    double gross; // sum of their sizes [N s]
} CapsulePush;

// Returns how much a tool slides over what it pushes along `net`: 0 for one that rests or is
// pressed on, or back while its push is still that of the press; 1 for one that goes aside or is
// drawn back.
static double sliding(const Contact *contact, Vec3 net)
{
    const Clear *clear = contact->clear;
    const double least = MOVING * contact->smallest_radius,
                 speed2 = vec3_dot(clear->way, clear->way), on = vec3_dot(clear->way, clear->press),
                 turned = vec3_dot(vec3_unit(net), clear->press),
                 straight = fmin(1.0, fmax(0.0, (turned - TURNED) / (STRAIGHT - TURNED))),
                 counts = on > 0.0 ? on : straight * on, aside = speed2 - counts * counts;
    // The square of the radius of a tool of no size is zero, as its speed may be.
    return aside > 0.0 ? aside / (speed2 + least * least) : 0.0;
}

// Returns the coefficient of friction that acts on the nodes under a capsule. One that slides has
// mu times the net push: the sides of a fold press each other for nothing. The more tissue closes
// around it, the more the push along the way counts as friction, up to all that mu allows: more
// would fold the tissue before the tool, and hold the fold; or behind one that is drawn out.
static double resisting(const Contact *contact, const CapsulePush *push, double mu)
{
    if (!(push->gross > 0.0))
        return mu;
    const Vec3 way = contact->clear->way;
    const double along = fabs(vec3_dot(push->net, way)),
                 across = vec3_length(vec3_cross(push->net, way)),
                 part = along < mu * across ? along / (mu * across) : 1.0,
                 net = fmin(1.0, vec3_length(push->net) / push->gross),
                 closed = fmin(1.0, (1.0 - net) / CLOSED),
                 left = net * (1.0 - closed * fmin(1.0, part * (1.0 + part)));
    return mu * (1.0 - sliding(contact, push->net) * (1.0 - left));
}

// Lets the coefficients under the capsules follow, not at once: a tool that turns rests for a
// moment.
static void find_friction(Contact *contact, double h, double mu)
{
    CapsulePush push[TOOL_SHAPES] = {{.gross = 0.0}};
    for (int t = 0; t < contact->touched_count; t++) {
        const Touched *touched = &contact->touched[t];
        CapsulePush *to = &push[touched->shape];
        const double length = vec3_length(contact->impulse[t]);
        if (!(length > 0.0))
            continue;
        to->gross += friction_share(contact, touched) * length;
        to->net = vec3_add(to->net, contact->impulse[t]);
    }
    for (int i = 0; i < contact->tool->capsule_count; i++) {
        const double before = fmin(contact->clear->friction[i], mu); // SET may lower it
        contact->friction[i] =
            before + h / (FRICTION_TIME + h) * (resisting(contact, &push[i], mu) - before);
    }
}

// Adds Coulomb friction: as much as stops the carrier beside the tool, at most `friction` times its
// share of the push. Implicit, so that what sticks does not creep.
static void add_friction(const Contact *contact, int t, double friction, Vec3 slip, Sym3 *slope)
{
    Vec3 *impulse = &contact->impulse[t];
    const double length = vec3_length(*impulse);
    if (!(length > 0.0))
        return;
    const double mass = contact->body->surface.node_mass[contact->touched_node[t]],
                 most = friction * friction_share(contact, &contact->touched[t]) * length;
    const Vec3 normal = vec3_scale(1.0 / length, *impulse);
    slip = vec3_madd(slip, -vec3_dot(slip, normal), normal);
    const double speed = vec3_length(slip), held = mass * speed > most ? most / speed : mass;
    *impulse = vec3_madd(*impulse, -held, slip);
    add_across(slope, held, normal);
}

// Computes the impulse on a carrier, m dv of
//   (m + g D) dv = h f - g D (v - u),   g = h (h + b),
// with the tool moving at u, and adds its derivative by u. One that cannot move gets what it
// withholds. Of a node that carries itself D is its stiffness K; where several nodes share carriers
// D bounds the stiffness of all, and contact_fit_solve starts from here, for those that can move.
static void find_impulse(Contact *contact, int t, Vec3 u, double h, double g, Sym3 *slope)
{
    const Touched *touched = &contact->touched[t];
    contact->impulse[t] = vec3(0.0, 0.0, 0.0);
    if (!touched->acts || (contact->fit != NULL && !(touched->mass > 0.0)))
        return;
    const double m = touched->mass;
    const Sym3 d = contact->carriers.lumped[touched->carrier];
    const Vec3 slip = vec3_sub(contact->v[t], vec3_add(u, touched->swing));
    const Sym3 k = m > 0.0 ? sym3_scale(g / m, d) : (Sym3){0};
    contact->impulse[t] =
        sym3_solve(k, 1.0, vec3_madd(vec3_scale(h, touched->force), -g, sym3_times(d, slip)));
    // m (m + g D)^-1 g D, column by column; symmetric.
    const Vec3 x = sym3_solve(k, 1.0, vec3(g * d.xx, g * d.xy, g * d.zx)),
               y = sym3_solve(k, 1.0, vec3(g * d.xy, g * d.yy, g * d.yz)),
               z = sym3_solve(k, 1.0, vec3(g * d.zx, g * d.yz, g * d.zz));
    *slope = sym3_madd(*slope, 1.0, (Sym3){x.x, y.y, z.z, y.z, x.z, x.y});
}

// Computes the impulses on all touched carriers with the proxy moving at `u`; returns their sum and
// in `slope` its derivative by u.
static Vec3 impulses(Contact *contact, Vec3 u, double h, double friction, Sym3 *slope)
{
    const double g = h * (h + contact->body->contact_damping);
    Vec3 sum = {0.0, 0.0, 0.0};
    *slope = (Sym3){0};
    for (int t = 0; t < contact->touched_count; t++) {
        contact->touched[t].force = sum;
        contact->touched[t].acts = false;
    }
    for (int p = 0; p < contact->pressed_count; p++)
        add_pressed(contact, &contact->pressed[p], u, h, g);
    for (int t = 0; t < contact->touched_count; t++)
        find_impulse(contact, t, u, h, g, slope);
    if (contact->fit != NULL)
        contact_fit_solve(contact, u, h, g, slope);
    if (friction > 0.0)
        find_friction(contact, h, friction);
    for (int t = 0; t < contact->touched_count; t++) {
        if (friction > 0.0)
            add_friction(contact, t, contact->friction[contact->touched[t].shape],
                         vec3_sub(contact->v[t], vec3_add(u, contact->touched[t].swing)), slope);
        sum = vec3_add(sum, contact->impulse[t]);
    }
    return sum;
}

// Returns how much slower than the hand the proxy moves, such that the impulse is the largest
// allowed one and leads towards the hand: (S + p 1) s = T, p |s| = most; |T| > most.
static Vec3 slack(Sym3 slope, Vec3 impulse, double most)
{
    enum { HALVINGS = 60 };
    const double size = vec3_length(impulse);
    const double trace = sym3_trace(slope);
    // p |s| rises with p, from 0 to |T|. S is below its trace.
    double low = 0.0, high = trace * most / (size - most) + 1e-300;
    for (int i = 0; i < HALVINGS && high - low > 1e-12 * high; i++) {
        const double pull = 0.5 * (low + high);
        if (pull * vec3_length(sym3_solve(slope, pull, impulse)) < most)
            low = pull;
        else
            high = pull;
    }
    return sym3_solve(slope, fmax(high, LEAST_PULL * trace), impulse);
}

// Reads the touched carriers after the body's own kick, and the tool's turn at each; then how fast
// the pressed nodes move with them.
static void read_touched(Contact *contact, double h)
{
    const Body *body = contact->body;
    const Carriers *carriers = &contact->carriers;
    const Proxy *from = contact->proxy, *next = &contact->next;
    const Quat turn = quat_multiply(next->orientation, quat_conjugate(from->orientation));
    // Of an implicit step h, the share b / (h + b) of what acts by the velocity is damping, which
    // feels the tool without the noise of its poses.
    const double b = body->contact_damping, damping = b / (h + b);
    const Vec3 angular = vec3_madd(vec3_scale(1.0 / h, quat_to_rotation(turn)), damping,
                                   contact->calm.angular),
               linear = vec3_scale(damping, contact->calm.linear);
    for (int t = 0; t < contact->touched_count; t++) {
        Touched *touched = &contact->touched[t];
        const int node = contact->touched_node[t];
        touched->mass =
            body->ops->is_fixed(body->model, node) ? 0.0 : body->surface.node_mass[node];
        touched->swing = vec3_add(
            linear, vec3_cross(angular, vec3_sub(carriers->x[touched->carrier], from->position)));
    }
    body->ops->read_nodes(body->model, contact->touched_node, contact->touched_count,
                          contact->impulse, contact->v); // positions are not needed
    for (int p = 0; p < contact->pressed_count; p++) {
        Pressed *pressed = &contact->pressed[p];
        pressed->swing = vec3_add(
            linear, vec3_cross(angular, vec3_sub(contact->x[pressed->local], from->position)));
        pressed->speed = vec3(0.0, 0.0, 0.0);
        int count;
        CarrierWeight own;
        const CarrierWeight *weight = carriers_of(&contact->carriers, pressed->local, &own, &count);
        for (int c = 0; c < count; c++) {
            const int t = carriers->touched[weight[c].carrier];
            pressed->speed = vec3_madd(pressed->speed, weight[c].weight, contact->v[t]);
        }
    }
}

// Remembers what friction needs: the tool's motion, at the velocity `u`, the push of the first
// touch, and the coefficients.
static void remember_way(Contact *contact, Vec3 u, double h)
{
    Clear *clear = contact->clear;
    const ContactForces *forces = &contact->forces;
    if (!(forces->weight > 1e-300)) // pushes of no depth have no point
        return;
    const Vec3 turn = quat_to_rotation(quat_multiply(contact->next.orientation,
                                                     quat_conjugate(contact->proxy->orientation))),
               arm = vec3_sub(vec3_scale(1.0 / forces->weight, forces->point),
                              contact->proxy->position),
               way = vec3_madd(u, 1.0 / h, vec3_cross(turn, arm));
    clear->way = vec3_madd(clear->way, h / (WAY_TIME + h), vec3_sub(way, clear->way));
    if (!(vec3_dot(clear->press, clear->press) > 0.0))
        clear->press = vec3_scale(-1.0, vec3_unit(forces->normal));
    memcpy(clear->friction, contact->friction, sizeof contact->friction);
}

// Moves the proxy as far towards the hand as its largest force allows, and computes the impulses of
// that motion. Returns a factor on them: 1, less where the passes were not enough.
static double follow_hand(Contact *contact, double h)
{
    const Proxy *from = contact->proxy;
    Proxy *next = &contact->next;
    const double friction = contact_friction(contact);
    const double most = contact->tool->kind == TOOL_STATIC ? (double)INFINITY : h * contact->limit;
    Vec3 u = vec3_scale(1.0 / h, vec3_sub(next->position, from->position));
    Sym3 slope;
    Vec3 sum = impulses(contact, u, h, friction, &slope);
    // Too much: it stays behind the hand. Each pass solves anew for how far, since nodes separate
    // and slide.
    const bool yields = vec3_length(sum) > most;
    Vec3 behind = {0.0, 0.0, 0.0};
    for (int pass = 0; pass < PASSES && yields; pass++) {
        const Vec3 whole = vec3_add(sum, sym3_times(slope, behind));
        const Vec3 step = vec3_length(whole) > most ? slack(slope, whole, most) : vec3(0, 0, 0);
        u = vec3_add(vec3_sub(u, step), behind);
        behind = step;
        sum = impulses(contact, u, h, friction, &slope);
    }
    next->position = vec3_madd(from->position, h, u);
    if (friction > 0.0)
        remember_way(contact, u, h);
    const double size = vec3_length(sum);
    return size > most ? most / size : 1.0;
}

static void solid_kick(Contact *contact, const Evaluation *evaluation, double h)
{
    if (contact->touched_count == 0) {
        contact->clear->press = vec3(0.0, 0.0, 0.0);
        return;
    }
    const Body *body = contact->body;
    ContactSums *sums = &contact->sums;
    read_touched(contact, h);
    const double scale = follow_hand(contact, h);
    // Impulses on the nodes, the opposite on the tool.
    for (int t = 0; t < contact->touched_count; t++) {
        const Touched *touched = &contact->touched[t];
        Vec3 *impulse = &contact->impulse[t];
        *impulse = vec3_scale(scale, *impulse);
        // The kick comes before the drift: it acts where the forces were evaluated.
        const Vec3 arm = vec3_sub(contact->carriers.x[touched->carrier], sums->about);
        sums->impulse = vec3_sub(sums->impulse, *impulse);
        sums->moment = vec3_sub(sums->moment, vec3_cross(arm, *impulse));
        const double by_mass = touched->mass > 0.0 ? 0.5 / touched->mass : 0.0;
        sums->work += vec3_dot(*impulse, vec3_madd(contact->v[t], by_mass, *impulse));
    }
    body->ops->kick_nodes(body->model, contact->touched_node, contact->touched_count,
                          contact->impulse, h, evaluation->advance * h);
    // Weighted means for the wrench.
    sums->point = vec3_madd(sums->point, h, contact->forces.point);
    sums->normal = vec3_madd(sums->normal, h, contact->forces.normal);
    sums->weight += h * contact->forces.weight;
    sums->depth = fmax(sums->depth, contact->forces.depth);
}

static void solid_end(Contact *contact)
{
    contact->clear->touched = contact_is_near(contact) && contact->touched_count > 0;
}

static void solid_clear(Contact *contact)
{
    if (contact_clear_proxy(contact))
        *contact->clear = (Clear){.touched = 0};
}

// --- creation ------------------------------------------------------------------------------------

// Divides every face into n x n equal triangles with a point in the middle of each, such that
// points lie closer than half a radius, where faces are not much larger than the tool.
static void spread_points(Contact *contact)
{
    const double edges = contact->body->surface.longest_edge / contact->smallest_radius;
    const int n = edges > 2.2 ? 4 : edges > 1.5 ? 3 : 2;
    const double third = 1.0 / 3.0;
    for (int i = 0; i < n; i++)
        for (int j = 0; i + j < n; j++)
            for (int turned = 0; turned < 2 && i + j + turned < n; turned++) {
                double *w = contact->point_weight[contact->point_count++];
                w[0] = (i + third * (1 + turned)) / n;
                w[1] = (j + third * (1 + turned)) / n;
                w[2] = 1.0 - w[0] - w[1];
            }
}

// Without a fitted surface the local nodes carry themselves.
static void carry_themselves(Contact *contact, const char *name, Arena *arena)
{
    Carriers *carriers = &contact->carriers;
    carriers->node = contact->node;
    carriers->x = contact->x;
    carriers->f = contact->f;
    carriers->lumped = contact->lumped;
    carriers->touched = ALLOCATE(ARENA_CONTACT, contact->node_capacity, int, "numbers");
}

static void solid_create(Contact *contact, const char *name, Arena *arena, StateList *state)
{
    contact_create_capsules(contact, name, arena);
    spread_points(contact);
    const int nodes = contact->node_capacity;
    contact->lumped = arena_allocate(arena, ARENA_CONTACT, (size_t)nodes, sizeof *contact->lumped,
                                     "%s/lumped stiffness", name);
    if (contact->body->mesh.fit.row_count > 0)
        contact_fit_create(contact, name, arena);
    contact->pusher = ALLOCATE(ARENA_CONTACT, nodes, unsigned char, "pushing capsules");
    const int carriers = contact->fit != NULL ? contact->fit->capacity : nodes;
    contact_create_nodes(contact, name, arena, nodes, carriers);
    if (contact->fit == NULL)
        carry_themselves(contact, name, arena);
    contact->pressed = ALLOCATE(ARENA_CONTACT, nodes, Pressed, "pressed nodes");
    contact->touched = ALLOCATE(ARENA_CONTACT, carriers, Touched, "touched nodes");
    if (contact->fit != NULL)
        contact->left = ALLOCATE(ARENA_CONTACT, carriers, TouchedLeft, "what impulses leave");
    contact->touched_node = ALLOCATE(ARENA_CONTACT, carriers, int, "touched node numbers");
    contact->clear = ALLOCATE(ARENA_CONTACT, 1, Clear, "clear of the body");
    state_add(state, contact->clear, sizeof *contact->clear, "%s/clear", name);
    contact->impulse = ALLOCATE(ARENA_CONTACT, carriers, Vec3, "impulses");
}

const ContactLaw contact_solid = {
    .share = 0.0, // implicit
    .has_springs = true,
    .ease_lag = 0.2,
    .create = solid_create,
    .begin = solid_begin,
    .find = solid_find,
    .move = solid_move,
    .read = solid_read,
    .evaluate = solid_evaluate,
    .apply = solid_apply,
    .kick = solid_kick,
    .end = solid_end,
    .clear = solid_clear,
};
