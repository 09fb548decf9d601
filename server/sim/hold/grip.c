// SPDX-License-Identifier: MIT
// The law of attachments (server/sim/README.md, "Holding"): springs from held nodes, or points of
// faces, to their places in the frame. Those of jaws are implicit and GRIP_RATIO times as stiff
// where the body moves by kicks; all others explicit, since implicit ones would damp the
// oscillation that a scene's stiffness promises. Jaws that would pull harder than they can slip:
// the places move along. Step thread.
#include "base/bits.h"
#include "sim/hold/attachment_data.h"

#include <string.h>

// Implicit springs cost no substeps, so tissue may hang less behind the jaws: at the default
// stiffness by 0.01 mm where explicit ones let 0.9 (test_contact_grasp.c).
static const double GRIP_RATIO = 100.0;

bool attachment_is_implicit(const Attachment *attachment)
{
    return attachment->grasper && attachment->body->ops->kick_nodes != NULL &&
           integrator_is_symplectic(attachment->body->integrator);
}

// Returns the springs of a unit of mass [1/s2, 1/s].
static void find_spring(const Attachment *attachment, double *stiffness, double *damping)
{
    const double ratio = attachment_is_implicit(attachment) ? GRIP_RATIO : 1.0;
    attachment_bounds(attachment->body, ratio * attachment->options.stiffness,
                      attachment->options.damping_ratio, stiffness, damping);
}

// Returns the mass of which a face has a share [kg].
static double face_mass(const Body *body, int face)
{
    const BodySurface *surface = &body->surface;
    double least = (double)INFINITY; // [kg/m2]; node_area is a third of the sum
    for (int k = 0; k < 3; k++) {
        int node = surface->face[face][k];
        double mass = surface->node_mass[node]; // a hanging node has none
        least = fmin(least,
                     mass > 0.0 ? mass / (3.0 * surface->node_area[node]) : body->contact_density);
    }
    return body_face_area(surface, face) * least;
}

// --- carriers: the nodes on which the springs act ---

static void add_carrier(Attachment *attachment, int node)
{
    if (bits_has(attachment->mark, node))
        return;
    bits_add(attachment->mark, node);
    attachment->found[node] = attachment->carrier_count;
    attachment->carrier[attachment->carrier_count++] = node;
}

// Lists the held nodes, or the corners of the held points, each once. Their numbers stay in
// `found`.
static void list_carriers(Attachment *attachment)
{
    const Body *body = attachment->body;
    attachment->carrier_count = 0;
    for (int i = 0; i < (int)attachment->hold->count; i++)
        if (attachment->held[i].share > 0.0 && body->surface.node_mass[attachment->node[i]] > 0.0)
            add_carrier(attachment, attachment->node[i]);
    for (int i = 0; i < (int)attachment->hold->points; i++)
        for (int k = 0; k < 3; k++)
            add_carrier(attachment, body->surface.face[attachment->point[i].face][k]);
    for (int c = 0; c < attachment->carrier_count; c++)
        bits_remove(attachment->mark, attachment->carrier[c]);
}

// What a spring pulls: a node, or a point of a face.
typedef struct Grip {
    Vec3 *local;
    double weight[3]; // of its carriers
    int carrier[3], count;
    double mass;
    double share; // below 1: it leaves, and is pulled with so much of max_force at most
} Grip;

static bool leaves(const Grip *grip)
{
    return grip->share < 1.0;
}

static int count_held(const Attachment *attachment)
{
    return (int)(attachment->hold->count + attachment->hold->points);
}

// Returns held thing number `i` of the nodes and then the points; false: no force acts on it.
static bool grip_at(const Attachment *attachment, int i, Grip *grip)
{
    const BodySurface *surface = &attachment->body->surface;
    const int nodes = (int)attachment->hold->count;
    if (i < nodes) {
        const int node = attachment->node[i];
        *grip = (Grip){.local = &attachment->held[i].local,
                       .weight = {1.0},
                       .carrier = {attachment->found[node]},
                       .count = 1,
                       .mass = surface->node_mass[node],
                       .share = attachment->held[i].share};
        return grip->share > 0.0 && grip->mass > 0.0;
    }
    HeldPoint *point = &attachment->point[i - nodes];
    *grip = (Grip){.local = &point->local,
                   .count = 3,
                   .mass = face_mass(attachment->body, (int)point->face),
                   .share = held_point_share(point)};
    for (int k = 0; k < 3; k++) {
        grip->weight[k] = point->weight[k] / grip->share;
        grip->carrier[k] = attachment->found[surface->face[point->face][k]];
    }
    return true;
}

// Returns how far a held thing is from its place [m]; `ahead` [s] later, with the velocities `v`.
static Vec3 stretch(const Attachment *attachment, const Grip *grip, double ahead)
{
    const ToolPlacement *at = &attachment->at;
    const Vec3 arm = quat_rotate(at->orientation, *grip->local);
    Vec3 away = vec3_madd(vec3_add(at->position, arm), ahead,
                          vec3_add(at->linear, vec3_cross(at->angular, arm)));
    for (int k = 0; k < grip->count; k++) {
        const int c = grip->carrier[k];
        away =
            vec3_madd(away, -grip->weight[k], vec3_madd(attachment->x[c], ahead, attachment->v[c]));
    }
    return away;
}

// Returns the force of a spring. One that leaves pulls no harder than its share allows.
static Vec3 pull(const Attachment *attachment, Grip *grip, double stiffness)
{
    const Vec3 force = vec3_scale(stiffness * grip->mass, stretch(attachment, grip, 0.0));
    if (!leaves(grip))
        return force;
    const double most = grip->share * attachment->tool->max_force,
                 kept = most / fmax(most, vec3_length(force));
    if (kept < 1.0) // then it pulls as hard whatever the motion: an implicit spring would add to it
        grip->mass = 0.0;
    return vec3_scale(kept, force);
}

// --- forces and impulses ---

// Caps what jaws that open, or from which the last tissue has slipped, still pull: the sum of the
// sizes of `f`, so that torque fades too.
static void ease(Attachment *attachment, double weight)
{
    const HoldState *hold = attachment->hold;
    if (!(hold->ease > 0.0))
        return;
    double size = 0.0;
    for (int c = 0; c < attachment->carrier_count; c++)
        size += vec3_length(attachment->f[c]);
    const double most = weight * hold->strength * hold->ease / GRIP_EASE_TIME;
    for (int c = 0; c < attachment->carrier_count && size > most; c++)
        attachment->f[c] = vec3_scale(most / size, attachment->f[c]);
}

static Vec3 sum_of_forces(const Attachment *attachment)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int c = 0; c < attachment->carrier_count; c++)
        sum = vec3_add(sum, attachment->f[c]);
    return sum;
}

// Returns how fast a carrier moves against the jaws.
static Vec3 slide(const Attachment *attachment, int c)
{
    const ToolPlacement *at = &attachment->at;
    const Vec3 arm = vec3_sub(attachment->x[c], at->position);
    return vec3_sub(attachment->v[c], vec3_add(at->linear, vec3_cross(at->angular, arm)));
}

Vec3 attachment_evaluate(Attachment *attachment, const ToolPlacement *at)
{
    const Body *body = attachment->body;
    const int held = count_held(attachment);
    double stiffness, damping;
    find_spring(attachment, &stiffness, &damping);
    attachment->at = *at;
    list_carriers(attachment);
    const int carriers = attachment->carrier_count;
    body->ops->read_nodes(body->model, attachment->carrier, carriers, attachment->x, attachment->v);
    memset(attachment->f, 0, (size_t)carriers * sizeof *attachment->f);
    memset(attachment->demand, 0, (size_t)carriers * sizeof *attachment->demand);
    for (int i = 0; i < held; i++) {
        Grip grip;
        if (!grip_at(attachment, i, &grip))
            continue;
        const Vec3 force = pull(attachment, &grip, stiffness);
        for (int k = 0; k < grip.count; k++) {
            const int c = grip.carrier[k];
            attachment->f[c] = vec3_madd(attachment->f[c], grip.weight[k], force);
            attachment->demand[c] += grip.weight[k] * grip.mass;
        }
    }
    if (attachment_is_implicit(attachment)) // damping comes with the impulses
        return vec3(0.0, 0.0, 0.0);
    for (int c = 0; c < carriers; c++)
        attachment->f[c] =
            vec3_madd(attachment->f[c], -damping * attachment->demand[c], slide(attachment, c));
    ease(attachment, 1.0);
    return sum_of_forces(attachment);
}

// As contact of solids (server/sim/README.md): a carrier of mass m gets m dv of
//   (m + s D) dv = h f - s D (v - u),   s = h (h stiffness + damping),
// with D the mass that the springs hold there: at most m, since a face has its share of it.
Vec3 grip_impulses(Attachment *attachment, double h)
{
    const Body *body = attachment->body;
    double stiffness, damping;
    find_spring(attachment, &stiffness, &damping);
    const double s = h * (h * stiffness + damping);
    body->ops->read_nodes(body->model, attachment->carrier, attachment->carrier_count,
                          attachment->unused, attachment->v);
    for (int c = 0; c < attachment->carrier_count; c++) {
        const int node = attachment->carrier[c];
        const double d = attachment->demand[c], mass = body->surface.node_mass[node];
        Vec3 *f = &attachment->f[c];
        *f = vec3_scale(h, *f);
        if (body->ops->is_fixed(body->model, node)) // withholds it
            continue;
        // A hanging node resists with the masses of its masters: by D alone it gets less.
        const double share = mass > 0.0 ? d / mass : 1.0;
        *f = vec3_scale(1.0 / (1.0 + s * share), vec3_madd(*f, -s * d, slide(attachment, c)));
        const double moves = mass > 0.0 ? mass : d; // 0: a corner that carries nothing
        if (moves > 0.0)
            attachment->v[c] = vec3_madd(attachment->v[c], 1.0 / moves, *f);
    }
    ease(attachment, h);
    return sum_of_forces(attachment);
}

// Moves the places after what slips, such that the springs keep a share of their stretch.
static void slip(Attachment *attachment, double kept, double ahead)
{
    const int held = count_held(attachment);
    const Quat back = quat_conjugate(attachment->at.orientation);
    Grip grip;
    for (int i = 0; i < held; i++)
        if (grip_at(attachment, i, &grip))
            *grip.local = vec3_madd(*grip.local, kept - 1.0,
                                    quat_rotate(back, stretch(attachment, &grip, ahead)));
    attachment->hold->slips = 1;
}

// Adds `share` times the forces, scaled, to the sums. Jaws slip, by the state `ahead` [s] later;
// negative: not in this evaluation.
static void add_sums(Attachment *attachment, double scale, double share, double ahead)
{
    ContactSums *sums = &attachment->sums;
    for (int c = 0; c < attachment->carrier_count; c++) {
        const Vec3 f = vec3_scale(scale, attachment->f[c]), x = attachment->x[c];
        const double size = share * vec3_length(f);
        attachment->f[c] = f;
        sums->impulse = vec3_madd(sums->impulse, -share, f);
        sums->moment = vec3_madd(sums->moment, -share, vec3_cross(vec3_sub(x, sums->about), f));
        sums->point = vec3_madd(sums->point, size, x);
        sums->weight += size;
    }
    attachment->force = vec3_scale(-1.0, sum_of_forces(attachment));
    if (attachment->grasper && scale < 1.0 && ahead >= 0.0 && attachment->hold->ease == 0.0)
        slip(attachment, scale, ahead);
}

void attachment_apply(Attachment *attachment, double scale, double share, bool ends)
{
    const Body *body = attachment->body;
    add_sums(attachment, scale, share, ends ? 0.0 : -1.0);
    body->ops->add_forces(body->model, attachment->carrier, attachment->carrier_count,
                          attachment->f);
}

void grip_kick(Attachment *attachment, double scale, double h, double drift)
{
    const Body *body = attachment->body;
    add_sums(attachment, scale, 1.0, h);
    body->ops->kick_nodes(body->model, attachment->carrier, attachment->carrier_count,
                          attachment->f, h, drift);
}

// --- the end of a grip ---

static void set_share(Attachment *attachment, int i, const Grip *grip, double share)
{
    const int nodes = (int)attachment->hold->count;
    if (i < nodes)
        attachment->held[i].share = share;
    for (int k = 0; k < 3 && i >= nodes; k++)
        attachment->point[i - nodes].weight[k] = share * grip->weight[k];
}

// Lets what has slipped out of the jaws leave, with what it is pulled with at the start of the
// tick, at most max_force together. Returns false if nothing would be left.
static bool drop_slipped(Attachment *attachment, const ToolPlacement *at)
{
    const double most = attachment->tool->max_force;
    double stiffness, damping;
    Grip grip;
    int within = 0;
    find_spring(attachment, &stiffness, &damping);
    attachment_evaluate(attachment, at);
    const double sum = vec3_length(sum_of_forces(attachment));
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < count_held(attachment); i++) {
            if (!grip_at(attachment, i, &grip) || leaves(&grip))
                continue;
            const bool in = attachment_is_within(attachment, *grip.local);
            within += in;
            if (pass == 1 && !in)
                set_share(attachment, i, &grip,
                          fmin(vec3_length(pull(attachment, &grip, stiffness)) / fmax(sum, most),
                               LEAVES_BELOW));
        }
        if (within == 0)
            return false;
    }
    return true;
}

// All that leaves together is pulled with less by FADE of max_force in GRIP_EASE_TIME, until it is
// released. Tissue that recoils unloads its neighbours, too, so that the hand feels a little more.
static const double FADE = 0.5;

static void fade(Attachment *attachment, double tick)
{
    HoldState *hold = attachment->hold;
    int leaving = 0, points = 0;
    Grip grip;
    for (int i = 0; i < count_held(attachment); i++)
        leaving += grip_at(attachment, i, &grip) && leaves(&grip);
    for (int i = 0; i < count_held(attachment) && leaving > 0; i++)
        if (grip_at(attachment, i, &grip) && leaves(&grip))
            set_share(attachment, i, &grip,
                      fmax(0.0, grip.share - FADE * tick / (GRIP_EASE_TIME * leaving)));
    for (int i = 0; i < (int)hold->points; i++)
        if (held_point_share(&attachment->point[i]) > 0.0)
            attachment->point[points++] = attachment->point[i];
    // The state is zero beyond what is in use.
    if (points < hold->points)
        memset(&attachment->point[points], 0,
               (size_t)(hold->points - points) * sizeof *attachment->point);
    hold->points = points;
}

void grip_open(Attachment *attachment, Vec3 position, Quat orientation)
{
    HoldState *hold = attachment->hold;
    const ToolPlacement at = {.position = position, .orientation = orientation};
    if (hold->holding == 0 || hold->ease > 0.0)
        return;
    // What they pull now, whatever way the tool goes from here.
    attachment_evaluate(attachment, &at);
    for (int c = 0; c < attachment->carrier_count; c++)
        hold->strength += vec3_length(attachment->f[c]);
    hold->ease = GRIP_EASE_TIME;
}

void grip_begin_tick(Attachment *attachment, Vec3 position, Quat orientation, double tick)
{
    HoldState *hold = attachment->hold;
    if (hold->ease > 0.0) {
        hold->ease -= tick;
        if (!(hold->ease > 0.5 * tick)) // rounding of its ticks
            attachment_release(attachment);
    } else {
        const ToolPlacement at = {.position = position, .orientation = orientation};
        if (hold->slips != 0 && !drop_slipped(attachment, &at)) {
            grip_open(attachment, position, orientation);
            attachment->slipped++;
        }
        fade(attachment, tick);
    }
    hold->slips = 0;
}
