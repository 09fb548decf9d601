// SPDX-License-Identifier: MIT
// Proxy (server/sim/README.md, "The proxy") and bookkeeping of a contact; contact_force.c has the
// law. Step thread.
#include "sim/contact/contact_data.h"

#include <string.h>

enum { RETREATS = 8 };               // steps back per substep before forces are scaled instead
static const double AWAY_TIME = 0.1; // [s] after which a tool caught behind a wall is released
static const double EASE_TIME = 0.1; // [s] in which the force of a tool that was inside grows
static const double EASE_LAG = 0.2;  // of the time left: in it the tool goes the rest of the way

// ---------------------------------------------------------------------------------------------
// Start of a tick

// Watches for a tool caught behind a wall: only crossed faces act while the hand itself is clear of
// the body. Releases it after a while, since it would pull for ever.
static void watch_caught(Contact *contact, Vec3 pose, double margin, double tick)
{
    Proxy *proxy = contact->proxy;
    bool caught = proxy->crossed_only != 0;
    if (caught) {
        Region region = {.kind = REGION_CAPSULE, .from = pose, .to = pose};
        region.radius = contact->lever + contact->largest_radius + margin +
                        CONTACT_FACE_REACH * contact->body->surface.longest_edge;
        int node; // not used, only the count is
        caught = contact->body->ops->find_nodes(contact->body->model, &region, &node, 0) == 0;
    }
    proxy->away = caught ? proxy->away + tick : 0.0;
    if (proxy->away > AWAY_TIME)
        contact_clear(contact);
}

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

// Returns how far a proxy is from a pose, at any point of the tool [m].
static double way_to(const Proxy *proxy, Vec3 target, Quat orientation, double lever)
{
    Vec3 turn = quat_to_rotation(quat_multiply(orientation, quat_conjugate(proxy->orientation)));
    return fmax(vec3_length(vec3_sub(target, proxy->position)), vec3_length(turn) * lever);
}

// Moves a proxy towards a pose, by at most `cap` [m] at any point of the tool.
static void move_towards(Proxy *proxy, Vec3 target, Quat orientation, double lever, double cap)
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

// Leads a tool that is inside of a solid out of it, where it is felt gently at first. One that was
// outside before, and over which the body was thrown, begins again where it last was clear of the
// body; one that appeared inside leaves by the nearest way.
static void begin_tick_solid(Contact *contact, const ToolPlacement *at, bool fresh, double tick)
{
    Proxy *proxy = contact->proxy;
    Clear *clear = contact->clear;
    Vec3 out;
    proxy->away = fmax(0.0, proxy->away - tick);
    if (contact_solid_look(contact, at, fresh, &out)) {
        if (clear->touched == 0)
            clear->position = vec3_add(proxy->position, out);
        proxy->position = clear->position;
        proxy->away = EASE_TIME;
        contact_forget_candidates(contact);
    } else if (!(contact->forces.depth > 0.0)) {
        clear->position = proxy->position;
    }
    clear->touched = 0;
    contact->touched_count = 0;
    const double eased = 1.0 - proxy->away / EASE_TIME; // its cube: 3 N is 0.03 N after 20 ms
    contact->limit = contact->tool->max_force * eased * eased * eased;
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

static void begin_tick_plane(Contact *contact)
{
    // Nodes just above the plane may reach it within the tick.
    contact->sums = (ContactSums){.about = contact->tool->plane.point};
    ToolPlacement unmoved = {.orientation = {1.0, 0.0, 0.0, 0.0}};
    contact_find_candidates(contact, &unmoved, 0.25 * contact->body->surface.longest_edge);
}

void contact_begin_tick(Contact *contact, Vec3 begin, Vec3 end, Quat orientation, double tick,
                        int64_t step)
{
    contact->kicked = 0.0;
    if (contact->is_plane) {
        begin_tick_plane(contact);
        return;
    }
    Proxy *proxy = contact->proxy;
    const double r = contact->smallest_radius;
    const bool solid = contact->is_solid, fresh = !proxy->valid;
    if (contact->tool->kind != TOOL_STATIC && proxy->valid && !solid)
        watch_caught(contact, begin, r, tick);
    if (fresh) {
        proxy->valid = 1;
        proxy->position = begin;
        proxy->orientation = orientation;
    }
    contact->forces = (ContactForces){0};
    if (contact->fit != NULL)
        contact->fit->step = step;

    ToolPlacement at = {.position = proxy->position, .orientation = proxy->orientation};
    Quat turn = quat_multiply(orientation, quat_conjugate(proxy->orientation));
    double way = vec3_length(vec3_sub(end, proxy->position));
    double swing = vec3_length(quat_to_rotation(turn)) * contact->lever;
    double cap = contact->body->substeps * CONTACT_STEP_CAP * r; // of translation and rotation
    contact_forget_candidates(contact);
    bool clear = way + swing > cap && !may_meet(contact, &at, way + swing);
    // Search walls of hollow bodies early, so that sides are known before contact. A solid's faces
    // approach by their own motion alone: by an edge per tick in a sound body.
    const BodySurface *surface = &contact->body->surface;
    double margin = solid ? fmin(r, surface->longest_edge) : r;
    if (!clear)
        contact_find_candidates(contact, &at, margin + fmin(way, cap) + fmin(swing, cap));
    if (solid)
        begin_tick_solid(contact, &at, fresh, tick);
    else
        contact->forces.floor = least_gap(contact) - CONTACT_AXIS_FLOOR * r;
    // Near a body the proxy moves in small steps, substep by substep; in free air it follows
    // immediately, or as far as the search reached.
    if (contact->local_count == 0 && proxy->away < EASE_TIME)
        move_towards(proxy, end, orientation, contact->lever, clear ? (double)INFINITY : cap);
    contact->sums = (ContactSums){.about = proxy->position};
    contact->next = *proxy;
}

bool contact_is_near(const Contact *contact)
{
    return contact->local_count > 0;
}

// ---------------------------------------------------------------------------------------------
// Proxy, once per substep

static double limited(double size, double cap)
{
    return size > cap ? cap / size : 1.0;
}

// Returns the proxy's motion over the substep from its position to `next`.
static ToolPlacement placement(const Contact *contact, double fraction, double h)
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

static void read_local_nodes(Contact *contact)
{
    const Body *body = contact->body;
    // Solids feel velocities after the body's own kick.
    if (contact->fit != NULL)
        contact_fit_read(contact);
    else
        body->ops->read_nodes(body->model, contact->node, contact->local_count, contact->x,
                              contact->is_solid ? NULL : contact->v);
    if (contact->kicked > 0.0)
        add_work(contact); // of the last forces
    contact->kicked = 0.0;
    if (contact->is_plane)
        return;
    double farthest = 0.0;
    for (int i = 0; i < contact->local_count; i++) {
        Vec3 moved = vec3_sub(contact->x[i], contact->x_begin[i]);
        farthest = fmax(farthest, vec3_dot(moved, moved));
    }
    contact->yielded = sqrt(farthest);
}

void contact_begin_substep(Contact *contact, Vec3 target, Quat orientation, double h)
{
    contact->next = *contact->proxy;
    contact->fresh = false;
    if (contact->tool->kind == TOOL_STATIC)
        return;
    const double r = contact->smallest_radius;
    Proxy *next = &contact->next;
    double cap = CONTACT_STEP_CAP * r;
    if (contact->is_solid) // never across a face
        cap = fmin(cap, 0.5 * contact->forces.floor);
    else // or beyond the wall that it lies on, of which only an end of its axis would be known
        cap = fmin(cap, fmax(contact->forces.floor, 0.0) + 0.9 * CONTACT_AXIS_FLOOR * r);
    if (contact->is_solid && next->away > 0.0) // rather than run into the hand with all its force
        cap = fmin(cap, way_to(next, target, orientation, contact->lever) * h /
                            (EASE_LAG * next->away + h));
    move_towards(next, target, orientation, contact->lever, cap);
    if (contact->is_solid)
        return; // contact_kick decides

    // Step back along the force until it is at most max_force and the axis is clear of the wall.
    read_local_nodes(contact);
    for (int retreat = 0;; retreat++) {
        ToolPlacement at = placement(contact, 1.0, h);
        contact_evaluate(contact, &at, h);
        contact->fresh = true;
        const ContactForces *f = &contact->forces;
        double size = vec3_length(f->force);
        double excess = size - contact->tool->max_force;
        if ((excess <= 0.0 && f->floor >= 0.0) || retreat == RETREATS || !(size > 0.0))
            return;
        Vec3 n = vec3_scale(1.0 / size, f->force);
        double along = sym3_along(f->stiffness, n);
        along *= 1.0 + contact->body->contact_damping / h; // a step back also slows the approach
        double back = along > 0.0 ? fmax(0.0, excess / along) : 0.0;
        next->position = vec3_madd(next->position, fmin(0.5 * r, back), n);
        if (f->floor < 0.0)
            next->position = vec3_madd(next->position, fmin(0.5 * r, -f->floor), f->floor_normal);
    }
}

void contact_apply(Contact *contact, double fraction, double weight, double h)
{
    if (contact->is_solid) {
        read_local_nodes(contact);
        ToolPlacement at = placement(contact, 0.0, h);
        contact_solid_evaluate(contact, &at);
        return;
    }
    // Evaluate unless the last evaluation of the substep was at this very placement.
    if (!contact->fresh || fraction != 1.0) {
        read_local_nodes(contact);
        ToolPlacement at = placement(contact, fraction, h);
        contact_evaluate(contact, &at, fraction * h);
    }
    contact->fresh = false;
    ContactForces *f = &contact->forces;
    contact->sums.depth = fmax(contact->sums.depth, f->depth);
    if (f->acting == 0)
        return;

    // If stepping back was not enough, scale the force on body and tool alike.
    double scale = 1.0;
    if (contact->tool->kind != TOOL_STATIC)
        scale = limited(vec3_length(f->force), contact->tool->max_force);
    if (scale < 1.0)
        for (int i = 0; i < contact->local_count; i++)
            contact->f[i] = vec3_scale(scale, contact->f[i]);
    contact->body->ops->add_forces(contact->body->model, contact->node, contact->local_count,
                                   contact->f);
    // Impulse, moment and weighted means for the wrench.
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
    if (contact->is_solid)
        contact_solid_kick(contact, evaluation, h);
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
    if (contact->is_plane) {
        for (int i = 0; i < contact->local_count; i++)
            contact->plane_bristle[contact->node[i]] = contact->plane_trial[i];
        return;
    }
    if (contact->is_solid) {
        contact->next.away = contact->proxy->away;
        *contact->proxy = contact->next;
        contact->clear->touched = contact_is_near(contact) && contact->touched_count > 0;
        return;
    }
    for (int shape = 0; shape < contact->tool->capsule_count && contact->local_count > 0; shape++)
        contact->next.bristle[shape] = contact->trial[shape];
    const ContactForces *last = &contact->forces;
    // A tool out of reach has no recent forces; the old ones are in no state.
    contact->next.crossed_only =
        contact_is_near(contact) && last->acting > 0 && last->acting == last->crossed;
    contact->next.away = contact->proxy->away;
    *contact->proxy = contact->next;
}

void contact_clear(Contact *contact)
{
    if (contact->is_plane) {
        memset(contact->plane_bristle, 0,
               (size_t)contact->body->surface.node_count * sizeof *contact->plane_bristle);
    } else if (contact->proxy->valid) {
        memset(contact->proxy, 0, sizeof *contact->proxy);
        contact->proxy->orientation.w = 1.0;
        for (int shape = 0; shape < contact->tool->capsule_count; shape++)
            if (contact->side[shape] != NULL)
                memset(contact->side[shape], 0, (size_t)contact->body->surface.face_count);
        if (contact->clear != NULL)
            *contact->clear = (Clear){.touched = 0};
    }
    contact_forget_candidates(contact);
    contact->sums = (ContactSums){.about = contact->proxy->position};
    contact->next = *contact->proxy; // the end of a substep must not restore the old proxy
}

int contact_springs(Contact *contact, ContactSpring *spring, int capacity)
{
    contact->spring = spring;
    contact->spring_capacity = capacity;
    contact->spring_count = 0;
    read_local_nodes(contact);
    ToolPlacement at = {.position = contact->proxy->position,
                        .orientation = contact->proxy->orientation};
    if (contact->is_solid)
        contact_solid_evaluate(contact, &at);
    else
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
