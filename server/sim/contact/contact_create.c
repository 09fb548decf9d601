// SPDX-License-Identifier: MIT
// The choice of a contact's law, its stiffness and memory. Load time only.
#include "sim/contact/contact_data.h"

#include "base/bits.h"
#include "base/check.h"
#include "base/sets.h"

#include <stdlib.h>
#include <string.h>

// Returns a node's mass over the sum of the face areas around it [kg/m2]. node_area is a third of
// that sum.
static double mass_per_area(const BodySurface *surface, int node)
{
    return surface->node_mass[node] / (3.0 * surface->node_area[node]);
}

// With firmness_f = min over the nodes i of f of (m_i / sum of A at i) / least, every face around a
// node is at most as firm as that node, so that still sum_f k_f <= a lambda_b m_i. Fixed nodes
// cannot oscillate and do not count, unless all nodes of the face are fixed.
static void set_firmness(Body *body, double least)
{
    const BodySurface *surface = &body->surface;
    for (int i = 0; i < surface->node_used; i++)
        surface->node_firmness[i] =
            surface->node_area[i] > 0.0 ? fmax(1.0, mass_per_area(surface, i) / least) : 1.0;
    for (int f = 0; f < surface->face_used; f++) {
        double of_free = (double)INFINITY, of_all = (double)INFINITY;
        for (int k = 0; k < 3; k++) {
            int node = surface->face[f][k];
            of_all = fmin(of_all, surface->node_firmness[node]);
            if (!body->ops->is_fixed(body->model, node))
                of_free = fmin(of_free, surface->node_firmness[node]);
        }
        surface->face_firmness[f] = of_free < (double)INFINITY ? of_free : of_all;
    }
}

void contact_set_stiffness(Body *body)
{
    // kappa = a lambda_b min_i (m_i / sum of the face areas at i), so that contact adds at most
    // a lambda_b to the bound (server/sim/README.md, "Contact stiffness"). node_area is 0 where no
    // face is.
    const BodySurface *surface = &body->surface;
    const double *area = surface->node_area;
    double least = (double)INFINITY;
    bool any_free = false;
    for (int i = 0; i < surface->node_used; i++)
        any_free |= area[i] > 0.0 && !body->ops->is_fixed(body->model, i);
    for (int i = 0; i < surface->node_used; i++)
        if (area[i] > 0.0 && (!any_free || !body->ops->is_fixed(body->model, i)))
            least = fmin(least, mass_per_area(surface, i));
    body->contact_density = least;
    body->contact_kappa = body->contact_ratio * body->contact_lambda * least;
    if (surface->face_firmness != NULL)
        set_firmness(body, least);
}

// Counts an undamped contact more than once: it switches on and off, and while both states are
// stable, switching between them is not. Leapfrog and symplectic Euler preserve areas of x and v,
// so a node between its springs and a tool can bounce at a multiple of the step and gain energy at
// each turn. With this factor the steps are 0.7 instead of 0.9 of the longest stable one at the
// stiffest contact: the largest growth per step of one such node, over all shares of stiffness,
// falls from 8 to 2 %.
static const double UNDAMPED = 1.65;
// Damping ratio of a node on the contact alone from which damping dissipates that gain; the factor
// fades towards it. Balls dropped on contacts of 7 and 20 times their own stiffness, in steps
// without the factor, had 3.6 to 6.9 times the energy of the drop at ratios up to 0.04, 3.4 at
// 0.08, 1.9 at 0.15 and 1.3 at 0.3.
static const double ENOUGH = 0.2;
// Contacts up to this stiffness, relative to the body's own, need the factor only without damping:
// up to 1.7 the same drops had at most 1.3 times the energy, at any ratio.
static const double FIRM = 2.0;

static const ContactLaw *choose_law(const Body *body, bool plane)
{
    return plane ? &contact_plane : body->surface.solid ? &contact_solid : &contact_wall;
}

// Returns the stiffness of the contacts with a tool, relative to the body's own.
static double share_of(const Body *body, const ToolOptions *tool)
{
    const double count = choose_law(body, false)->share * tool->capsule_count +
                         (tool->has_plane ? choose_law(body, true)->share : 0.0);
    return count * body->contact_ratio;
}

double contact_bounce_share(const Body *body, const ToolOptions *tool)
{
    return contact_bounce_of(body, share_of(body, tool));
}

double contact_bounce_of(const Body *body, double share)
{
    const double ratio = 0.5 * body->contact_damping * sqrt(share * body->contact_lambda);
    if (!integrator_is_symplectic(body->integrator))
        return 1.0;
    if (body->contact_damping > 0.0 && share <= FIRM)
        return 1.0;
    return 1.0 + (UNDAMPED - 1.0) * fmax(0.0, 1.0 - ratio / ENOUGH);
}

void contact_bounds(const Body *body, const ToolOptions *tool, double *lambda, double *damping)
{
    *lambda = share_of(body, tool) * body->contact_lambda * contact_bounce_share(body, tool);
    *damping = body->contact_damping * *lambda;
}

// ---------------------------------------------------------------------------------------------
// Capacity

// Returns the largest number of faces of a body whose rest areas sum up to `area`: its smallest.
static int count_faces(const BodySurface *surface, double area)
{
    size_t faces = (size_t)surface->face_count;
    double *sorted = calloc(faces + 1, sizeof *sorted);
    ASSERT(sorted != NULL);
    for (size_t f = 0; f < faces; f++)
        sorted[f] = surface->finest_area[surface->alike ? 0 : f];
    qsort(sorted, faces, sizeof *sorted, compare_doubles);
    int count = 0;
    for (double sum = sorted[0]; count < surface->face_count && sum <= area; sum += sorted[count])
        count++;
    free(sorted);
    return count;
}

// Chooses how many faces the tool can reach per tick; more are refused and counted. Enough to
// cover, at rest, the surface of everything within reach of its capsules in the tick's largest
// step, as for a wall that wraps around them, or three walls that they cut through. Small bodies
// fit completely.
static int choose_face_capacity(const Contact *contact)
{
    enum { LEAST = 512 }; // for a tool that is small relative to the faces
    const double pi = 3.14159265358979323846;
    const BodySurface *surface = &contact->body->surface;
    double step = contact->body->finest_substeps * CONTACT_STEP_CAP * contact->smallest_radius;
    double area = 0.0;
    for (int k = 0; k < contact->tool->capsule_count; k++) {
        const Capsule *capsule = &contact->tool->capsule[k];
        double reach = capsule->radius + contact_margin(contact) + 2.0 * step; // moves and turns
        reach += surface->longest_edge; // faces extend beyond their nodes
        double length = vec3_length(vec3_sub(capsule->to, capsule->from));
        area += 2.0 * pi * reach * length + 4.0 * pi * reach * reach;
    }
    int count = count_faces(surface, area);
    count = count < LEAST ? LEAST : count;
    return count < surface->face_count ? count : surface->face_count;
}

// Chooses the nodes of so many faces: half as many, and half the edges of their border. The longest
// border for its faces has a strip one face wide. Solids are closed, so that theirs is where the
// reach ends: on three walls along a rod of 100 faces' length a sixth of this.
static void choose_capacity(Contact *contact)
{
    enum { BORDER = 4096 }; // edges
    int nodes = contact->body->surface.node_count;
    contact->face_capacity = choose_face_capacity(contact);
    contact->node_capacity = contact->face_capacity + 2;
    if (contact->body->surface.solid && contact->face_capacity > BORDER)
        contact->node_capacity = (contact->face_capacity + BORDER) / 2;
    if (contact->face_capacity == contact->body->surface.face_count ||
        contact->node_capacity > nodes)
        contact->node_capacity = nodes;
}

// ---------------------------------------------------------------------------------------------
// Creation

void contact_create_nodes(Contact *contact, const char *name, Arena *arena, int positions,
                          int velocities)
{
    contact->node = ALLOCATE(ARENA_CONTACT, contact->body->surface.node_count, int, "nodes");
    contact->x = ALLOCATE(ARENA_CONTACT, positions, Vec3, "positions");
    contact->v = ALLOCATE(ARENA_CONTACT, velocities, Vec3, "velocities");
    contact->f = ALLOCATE(ARENA_CONTACT, contact->node_capacity, Vec3, "forces");
}

void contact_create_capsules(Contact *contact, const char *name, Arena *arena)
{
    const int nodes = contact->body->surface.node_count, faces = contact->body->surface.face_count;
    const ToolOptions *tool = contact->tool;
    contact->smallest_radius = (double)INFINITY;
    for (int k = 0; k < tool->capsule_count; k++) {
        const Capsule *capsule = &tool->capsule[k];
        contact->largest_radius = fmax(contact->largest_radius, capsule->radius);
        contact->smallest_radius = fmin(contact->smallest_radius, capsule->radius);
        contact->lever =
            fmax(contact->lever, fmax(vec3_length(capsule->from), vec3_length(capsule->to)));
    }
    contact->local = ALLOCATE(ARENA_CONTACT, nodes, int, "local numbers");
    for (int i = 0; i < nodes; i++)
        contact->local[i] = -1;
    contact->mark = ALLOCATE(ARENA_CONTACT, bits_words(faces), uint64_t, "face marks");
    contact->rank = ALLOCATE(ARENA_CONTACT, bits_words(faces), int, "face ranks");
    choose_capacity(contact);
    for (int k = 0; k < tool->capsule_count; k++)
        contact->gap_begin[k] =
            ALLOCATE(ARENA_CONTACT, contact->face_capacity, double, "distances before");
    contact->candidate = ALLOCATE(ARENA_CONTACT, contact->face_capacity, Candidate, "candidates");
    contact->x_begin = ALLOCATE(ARENA_CONTACT, contact->node_capacity, Vec3, "positions before");
    contact->node_normal = ALLOCATE(ARENA_CONTACT, contact->node_capacity, Vec3, "node normals");
}

Contact *contact_create(const char *name, const ToolOptions *tool, bool plane, Body *body,
                        Arena *arena, StateList *state)
{
    Contact *contact = ALLOCATE(ARENA_CONTACT, 1, Contact, "contact");
    contact->law = choose_law(body, plane);
    contact->tool = tool;
    contact->body = body;
    contact->proxy = ALLOCATE(ARENA_CONTACT, 1, Proxy, "proxy");
    contact->proxy->orientation.w = 1.0;
    contact->law->create(contact, name, arena, state);
    state_add(state, contact->proxy, sizeof *contact->proxy, "%s/proxy", name);
    return contact;
}

int contact_node_capacity(const Contact *contact)
{
    return contact->node_capacity;
}
