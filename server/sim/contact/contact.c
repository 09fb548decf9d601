// SPDX-License-Identifier: MIT
// Walks the table of laws: contact_plane.c, contact_wall.c, contact_solid.c. What they share: the
// proxy of capsules (server/sim/README.md, "The proxy"), forces on the nodes, sums. Step thread.
#include "sim/contact/contact_data.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// Start of a tick

// True if any node is so near that a capsule could reach a face within `travel`.
static bool may_meet(const Contact *contact, const ToolPlacement *at, double travel)
{
    const Body *body = contact->body;
    for (int shape = 0; shape < contact->tool->capsule_count; shape++) {
        Region region = {.kind = REGION_CAPSULE};
        contact_axis(&contact->tool->capsule[shape], at, &region.from, &region.to);
        region.radius = contact->tool->capsule[shape].radius + contact->smallest_radius + travel +
                        CONTACT_FACE_REACH * body->surface.longest_edge + contact->reach;
        int node; // not used, only the count is
        if (body->ops->find_nodes(body->model, &region, &node, 0) > 0)
            return true;
    }
    return false;
}

void contact_move_proxy(Proxy *proxy, Vec3 target, Quat orientation, double lever, double cap)
{
    Vec3 step = vec3_sub(target, proxy->position);
    Vec3 turn = quat_to_rotation(quat_multiply(orientation, quat_conjugate(proxy->orientation)));
    double distance = vec3_length(step), swing = vec3_length(turn) * lever;
    if (distance <= cap && swing <= cap) {
        proxy->position = target;
        proxy->orientation = orientation;
        return;
    }
    proxy->position = vec3_madd(proxy->position, distance > cap ? cap / distance : 1.0, step);
    turn = vec3_scale(swing > cap ? cap / swing : 1.0, turn);
    proxy->orientation = quat_unit(quat_multiply(quat_from_rotation(turn), proxy->orientation));
}

ToolPlacement contact_here(const Contact *contact)
{
    return (ToolPlacement){.position = contact->proxy->position,
                           .orientation = contact->proxy->orientation};
}

double contact_search(Contact *contact, const ContactMotion *motion, double margin)
{
    Proxy *proxy = contact->proxy;
    if (!proxy->valid) { // it appears at the hand
        proxy->valid = 1;
        proxy->position = motion->tool->begin_position;
        proxy->orientation = motion->tool->begin_orientation;
    }
    const ToolPlacement at = contact_here(contact);
    const Quat turn = quat_multiply(motion->tool->end_orientation, quat_conjugate(at.orientation));
    const double way = vec3_length(vec3_sub(motion->tool->end_position, at.position));
    const double swing = vec3_length(quat_to_rotation(turn)) * contact->lever;
    // Of translation and rotation.
    const double cap = contact->body->substeps * CONTACT_STEP_CAP * contact->smallest_radius;
    contact->forces = (ContactForces){0};
    contact_forget_candidates(contact);
    if (way + swing > cap && !may_meet(contact, &at, way + swing))
        return (double)INFINITY;
    contact_find_candidates(contact, &at, margin + fmin(way, cap) + fmin(swing, cap));
    return cap;
}

// The way out for an axis that passes through a face, or whose nearest face shows its back; of a
// tool that has just appeared also for one in front that is too near.
static bool leads_out(Contact *contact, const Candidate *candidate, const ClosestPair *nearest,
                      Vec3 p, Vec3 q, double radius, bool fresh, Vec3 *out)
{
    const Vec3 normal = contact_face_normal(contact, candidate);
    if (!(nearest->distance >
          CONTACT_TOUCHING)) { // crossed: the end behind the face leaves by its front
        const Vec3 x = contact->x[candidate->node[0]];
        const double at_p = vec3_dot(vec3_sub(p, x), normal),
                     at_q = vec3_dot(vec3_sub(q, x), normal);
        *out = vec3_scale(radius - fmin(at_p, at_q), normal);
        return true;
    }
    // A tool that touched the body was outside: it cannot have gone so far through in a tick, and
    // sees the back of a fold.
    if (contact->clear != NULL && contact->clear->touched != 0 &&
        nearest->distance > CONTACT_CROSSED_REACH * radius)
        return false;
    contact_find_normals(contact, candidate);
    const bool behind = contact_sign(contact, candidate, nearest->weight, nearest->on_triangle,
                                     nearest->on_segment) < 0;
    const Vec3 towards = vec3_sub(nearest->on_triangle, nearest->on_segment);
    *out =
        vec3_scale((nearest->distance + (behind ? radius : -radius)) / nearest->distance, towards);
    return behind || (fresh && nearest->distance < radius);
}

bool contact_look(Contact *contact, const ToolPlacement *at, bool fresh, Vec3 *out)
{
    bool inside = false;
    contact->forces.depth = 0.0;
    contact->forces.floor = (double)INFINITY;
    for (int shape = 0; shape < contact->tool->capsule_count && !inside; shape++) {
        const Capsule *capsule = &contact->tool->capsule[shape];
        ClosestPair nearest, least = {.distance = (double)INFINITY};
        int way = -1;
        Vec3 p, q;
        contact_axis(capsule, at, &p, &q);
        for (int i = 0; i < contact->candidate_count; i++) {
            const Candidate *candidate = &contact->candidate[i];
            Vec3 x[3];
            contact_corners(contact, candidate, x);
            nearest = (ClosestPair){0};
            contact_nearest_pair(x, p, q, contact_is_sphere(capsule), &nearest);
            contact->gap_begin[shape][i] = nearest.distance;
            if (nearest.distance < least.distance) {
                least = nearest;
                way = i;
            }
        }
        contact->forces.depth = fmax(contact->forces.depth, capsule->radius - least.distance);
        contact->forces.floor = fmin(contact->forces.floor, least.distance);
        if (way >= 0 && contact->tool->kind != TOOL_STATIC) // which never leaves
            inside = leads_out(contact, &contact->candidate[way], &least, p, q, capsule->radius,
                               fresh, out);
    }
    return inside;
}

void contact_ease(Contact *contact, bool led_out, double tick)
{
    Proxy *proxy = contact->proxy;
    proxy->away = led_out ? CONTACT_EASE_TIME : fmax(0.0, proxy->away - tick);
    // Its cube: 3 N is 0.03 N after 20 ms.
    const double eased = 1.0 - proxy->away / CONTACT_EASE_TIME;
    contact->limit = contact->tool->max_force * eased * eased * eased;
}

// Returns how far a proxy is from a pose, at any point of the tool [m].
static double way_to(const Proxy *proxy, Vec3 target, Quat orientation, double lever)
{
    Vec3 turn = quat_to_rotation(quat_multiply(orientation, quat_conjugate(proxy->orientation)));
    return fmax(vec3_length(vec3_sub(target, proxy->position)), vec3_length(turn) * lever);
}

double contact_ease_step(const Contact *contact, Vec3 target, Quat orientation, double cap,
                         double h)
{
    const Proxy *next = &contact->next;
    if (!(next->away > 0.0))
        return cap;
    const double way = way_to(next, target, orientation, contact->lever);
    const double lag = contact->law->ease_lag * next->away;
    return fmin(cap, way * h / (lag + h));
}

Vec3 contact_go_free(Contact *contact, const ContactMotion *motion, double cap)
{
    // Near a body the proxy moves in small steps, substep by substep; in free air it follows
    // immediately, or as far as the search reached.
    Proxy *proxy = contact->proxy;
    if (contact->local_count == 0 && proxy->away < CONTACT_EASE_TIME)
        contact_move_proxy(proxy, motion->tool->end_position, motion->tool->end_orientation,
                           contact->lever, cap);
    return proxy->position;
}

// What dampers feel less, or more, of the tool's motion in this tick than there is: its noise.
static void read_calm(Contact *contact, const ToolMotion *motion, double tick)
{
    const ToolPlacement now = tool_motion_within(motion, 0.0, tick);
    contact->calm = (ToolPlacement){.linear = vec3_sub(motion->calm_linear, now.linear),
                                    .angular = vec3_sub(motion->calm_angular, now.angular)};
}

void contact_begin_tick(Contact *contact, const ToolMotion *tool, double tick, int64_t step)
{
    const ContactMotion motion = {tool, tick, step};
    read_calm(contact, tool, tick);
    contact->kicked = 0.0;
    contact->sums = (ContactSums){.about = contact->law->begin(contact, &motion)};
    contact->next = *contact->proxy;
}

bool contact_is_easing(const Contact *contact)
{
    // In the tick in which it is led out, candidates are not known yet.
    const double away = contact->proxy->away;
    return away == CONTACT_EASE_TIME || (away > 0.0 && contact_is_near(contact));
}

bool contact_is_near(const Contact *contact)
{
    return contact->local_count > 0;
}

// ---------------------------------------------------------------------------------------------
// Proxy, once per substep

// The most that a tool is told, of the force that there is: it must end where contact ends.
static const double TOLD_MORE = 1.5;

static double limited(double size, double cap)
{
    return size > cap ? cap / size : 1.0;
}

ToolPlacement contact_placement(const Contact *contact, double fraction, double h)
{
    const Proxy *from = contact->proxy, *to = &contact->next;
    Quat turn = quat_multiply(to->orientation, quat_conjugate(from->orientation));
    Vec3 rotation = quat_to_rotation(turn);
    Vec3 move = vec3_sub(to->position, from->position);
    ToolPlacement at = {.linear = vec3_scale(1.0 / h, move),
                        .angular = vec3_scale(1.0 / h, rotation)};
    if (fraction == 1.0) {
        at.position = to->position;
        at.orientation = to->orientation;
    } else {
        at.position = vec3_madd(from->position, fraction, move);
        at.orientation = quat_unit(
            quat_multiply(quat_from_rotation(vec3_scale(fraction, rotation)), from->orientation));
    }
    return at;
}

// Adds the work of the forces: a force acts with the mean of the nodes' velocities before and after
// its kick, which also moves them.
static void add_work(Contact *contact)
{
    double work = 0.0;
    for (int i = 0; i < contact->local_count; i++)
        work += vec3_dot(contact->f[i], contact->v[i]);
    contact->sums.work += contact->kicked * work;
}

void contact_read_nodes(Contact *contact)
{
    const Body *body = contact->body;
    body->ops->read_nodes(body->model, contact->node, contact->local_count, contact->x, contact->v);
}

void contact_read(Contact *contact)
{
    contact->law->read(contact);
    if (contact->kicked > 0.0)
        add_work(contact); // of the last forces
    contact->kicked = 0.0;
    double farthest = 0.0; // of capsules only, which have candidates
    for (int i = 0; i < contact->local_count && contact->candidate_count > 0; i++) {
        Vec3 moved = vec3_sub(contact->x[i], contact->x_begin[i]);
        farthest = fmax(farthest, vec3_dot(moved, moved));
    }
    contact->yielded = sqrt(farthest);
}

void contact_evaluate(Contact *contact, const ToolPlacement *at, double dt)
{
    contact->forces = (ContactForces){.floor = (double)INFINITY};
    memset(contact->f, 0, (size_t)contact->local_count * sizeof *contact->f);
    contact->law->evaluate(contact, at, dt);
}

void contact_begin_substep(Contact *contact, Vec3 target, Quat orientation, double h)
{
    contact->next = *contact->proxy;
    contact->fresh = false;
    if (contact->tool->kind != TOOL_STATIC && contact->law->move != NULL)
        contact->law->move(contact, target, orientation, h);
}

void contact_apply(Contact *contact, double fraction, double weight, double h)
{
    contact->law->apply(contact, fraction, weight, h);
}

void contact_apply_forces(Contact *contact, double fraction, double weight, double h)
{
    // Evaluate unless the last evaluation of the substep was at this very placement.
    if (!contact->fresh || fraction != 1.0) {
        contact_read(contact);
        ToolPlacement at = contact_placement(contact, fraction, h);
        contact_evaluate(contact, &at, fraction * h);
    }
    contact->fresh = false;
    ContactForces *f = &contact->forces;
    contact->sums.depth = fmax(contact->sums.depth, f->depth);
    contact->sums.time += weight * h;
    if (f->acting == 0)
        return;

    // If stepping back was not enough, scale the force on body and tool alike.
    double scale = 1.0;
    const double size = vec3_length(f->force);
    if (contact->tool->kind != TOOL_STATIC)
        scale = limited(size, contact->limit);
    if (scale < 1.0)
        for (int i = 0; i < contact->local_count; i++)
            contact->f[i] = vec3_scale(scale, contact->f[i]);
    contact->body->ops->add_forces(contact->body->model, contact->node, contact->local_count,
                                   contact->f);
    // Impulse, moment and weighted means for the wrench.
    if (scale * size < contact->told)
        scale = fmin(contact->told / size, TOLD_MORE);
    double share = scale * weight * h;
    ContactSums *sums = &contact->sums;
    sums->impulse = vec3_madd(sums->impulse, share, f->force);
    sums->moment = vec3_madd(sums->moment, share, f->moment);
    sums->point = vec3_madd(sums->point, share, f->point);
    sums->normal = vec3_madd(sums->normal, share, f->normal);
    sums->weight += share * f->weight;
    // RK4 has the whole work at once; kicks get the other half with the next velocities.
    const bool kicks = integrator_get(contact->body->integrator)->kicks;
    contact->kicked = kicks ? 0.5 * weight * h : weight * h;
    add_work(contact);
    contact->kicked = kicks ? contact->kicked : 0.0;
}

void contact_kick(Contact *contact, const Evaluation *evaluation, double h)
{
    if (contact->law->kick != NULL)
        contact->law->kick(contact, evaluation, h);
}

void contact_end_tick(Contact *contact)
{
    enum { AT_ONCE = 64 };
    int node[AT_ONCE];
    Vec3 f[AT_ONCE], x[AT_ONCE], v[AT_ONCE]; // other results of the evaluation stay unchanged
    const Body *body = contact->body;
    double work = 0.0;
    for (int i = 0; i < contact->local_count && contact->kicked > 0.0;) {
        // Of all nodes within reach, read only those that were pushed.
        int count = 0;
        for (; i < contact->local_count && count < AT_ONCE; i++) {
            const Vec3 *own = &contact->f[i];
            node[count] = contact->node[i];
            f[count] = *own;
            count += own->x != 0.0 || own->y != 0.0 || own->z != 0.0;
        }
        body->ops->read_nodes(body->model, node, count, x, v);
        for (int k = 0; k < count; k++)
            work += vec3_dot(f[k], v[k]);
    }
    contact->sums.work += contact->kicked * work;
    contact->kicked = 0.0;
}

void contact_end_substep(Contact *contact)
{
    contact->law->end(contact);
    contact->next.away = contact->proxy->away;
    *contact->proxy = contact->next;
}

bool contact_clear_proxy(Contact *contact)
{
    if (!contact->proxy->valid)
        return false;
    *contact->proxy = (Proxy){.orientation.w = 1.0};
    return true;
}

static bool clear_is_sound(const Clear *clear)
{
    bool good = vec3_length(clear->position) < 1e9 && vec3_length(clear->way) < 1e9 &&
                vec3_length(clear->press) <= 1.0 + 1e-9 &&
                (clear->touched == 0 || clear->touched == 1);
    for (int i = 0; i < TOOL_SHAPES; i++)
        good = good && clear->friction[i] >= 0.0 && clear->friction[i] < 1e9;
    return good;
}

bool contact_check(const Contact *contact)
{
    const Proxy *p = contact->proxy;
    const Quat q = p->orientation;
    const double size = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
    bool good = (p->valid == 0 || p->valid == 1) && vec3_length(p->position) < 1e9 &&
                fabs(size - 1.0) < 1e-3 && p->crossed_only >= 0 &&
                p->crossed_only < INT64_MAX / 2 && p->felt >= 0.0 && p->felt < 1e18 &&
                p->unsettled >= 0.0 && p->unsettled < 1.0 && p->away >= 0.0 &&
                p->away <= CONTACT_EASE_TIME;
    for (int shape = 0; shape < TOOL_SHAPES; shape++)
        good = good && vec3_length(p->bristle[shape]) < 1e9;
    if (contact->clear != NULL)
        good = good && clear_is_sound(contact->clear);
    return good;
}

void contact_clear(Contact *contact)
{
    contact->law->clear(contact);
    contact_forget_candidates(contact);
    contact->sums = (ContactSums){.about = contact->proxy->position};
    contact->next = *contact->proxy; // the end of a substep must not restore the old proxy
}

void contact_topology_changed(Contact *contact, const TopologyChange *change)
{
    if (contact->law->follow != NULL)
        contact->law->follow(contact, change);
    contact_forget_candidates(contact);
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

int contact_springs(Contact *contact, ContactSpring *spring, int capacity)
{
    contact->spring = spring;
    contact->spring_capacity = capacity;
    contact->spring_count = 0;
    contact_read(contact);
    const ToolPlacement at = contact_here(contact);
    contact_evaluate(contact, &at, 0.0);
    contact->fresh = false;
    contact->spring = NULL;
    return contact->spring_count > capacity ? -1 : contact->spring_count;
}

const ContactSums *contact_sums(const Contact *contact)
{
    return &contact->sums;
}

void contact_proxy(const Contact *contact, Vec3 *position, Quat *orientation)
{
    *position = contact->proxy->position;
    *orientation = contact->proxy->orientation;
}

int64_t contact_refused(const Contact *contact)
{
    return contact->refused;
}
