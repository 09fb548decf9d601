// SPDX-License-Identifier: MIT
// A law of contact: the tool's plane against the nodes of any body (server/sim/README.md,
// "Contact of faces"). The deepest point of a flat face is a node, so nodes are exact. Step thread.
#include "sim/contact/contact_data.h"

#include "sim/bristle.h"

#include <string.h>

// Returns the contact stiffness of a node against a plane [N/m].
static double node_stiffness(const Body *body, int node)
{
    double stiffness = body->contact_kappa * body->surface.node_area[node];
    const double *firmness = body->surface.node_firmness;
    return firmness != NULL ? stiffness * firmness[node] : stiffness;
}

static void plane_create(Contact *contact, const char *name, Arena *arena, StateList *state)
{
    const int nodes = contact->body->surface.node_count;
    contact->node_capacity = nodes;
    contact->plane_bristle = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "plane bristles");
    contact->plane_trial = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "plane bristles, trial");
    state_add(state, contact->plane_bristle, (size_t)nodes * sizeof(Vec3), "%s/bristles", name);
    contact_create_nodes(contact, name, arena, nodes, nodes);
}

static Vec3 plane_begin(Contact *contact, const ContactMotion *motion)
{
    (void)motion; // planes are static
    // Nodes just above the plane may reach it within the tick.
    const ToolPlacement unmoved = {.orientation = {1.0, 0.0, 0.0, 0.0}};
    contact_find_candidates(contact, &unmoved, 0.25 * contact->body->surface.longest_edge);
    return contact->tool->plane.point;
}

static void plane_find(Contact *contact, const ToolPlacement *at, double margin)
{
    (void)at;
    const Body *body = contact->body;
    const Region region = {.kind = REGION_BELOW_PLANE,
                           .from = contact->tool->plane.point,
                           .to = contact->tool->plane.normal,
                           .radius = margin};
    contact->local_count =
        body->ops->find_nodes(body->model, &region, contact->node, body->surface.node_count);
}

// Pushes a node that is below the plane; returns its new bristle.
static Vec3 push_node(Contact *contact, int i, double height, double dt)
{
    const Plane *plane = &contact->tool->plane;
    const Body *body = contact->body;
    ContactForces *sum = &contact->forces;
    Vec3 bristle = {0.0, 0.0, 0.0};
    const double stiffness = node_stiffness(body, contact->node[i]);
    const double leaving = vec3_dot(contact->v[i], plane->normal);
    const double push = stiffness * fmax(0.0, -height - body->contact_damping * leaving);
    Vec3 force = vec3_scale(push, plane->normal); // on the node
    const double cap = contact_friction(contact) * push;
    if (cap > 0.0) {
        const Vec3 slip = vec3_madd(contact->v[i], -leaving, plane->normal);
        bristle = contact->plane_bristle[contact->node[i]];
        force = vec3_add(force, bristle_force(&bristle, slip, plane->normal, stiffness,
                                              body->contact_damping, cap, dt));
    }
    contact->f[i] = vec3_add(contact->f[i], force);
    // Action and reaction: the sums are those on the tool.
    const Vec3 on_tool = vec3_scale(-1.0, force);
    sum->force = vec3_add(sum->force, on_tool);
    sum->moment =
        vec3_add(sum->moment, vec3_cross(vec3_sub(contact->x[i], contact->sums.about), on_tool));
    sum->weight += push;
    sum->point = vec3_madd(sum->point, push, contact->x[i]);
    sum->normal = vec3_madd(sum->normal, -push, plane->normal);
    sum->depth = fmax(sum->depth, -height);
    sum->acting++;
    return bristle;
}

static void plane_evaluate(Contact *contact, const ToolPlacement *at, double dt)
{
    (void)at;
    const Plane *plane = &contact->tool->plane;
    for (int i = 0; i < contact->local_count; i++) {
        const double height = vec3_dot(vec3_sub(contact->x[i], plane->point), plane->normal);
        contact->plane_trial[i] =
            height < 0.0 ? push_node(contact, i, height, dt) : (Vec3){0.0, 0.0, 0.0};
    }
}

static void plane_end(Contact *contact)
{
    for (int i = 0; i < contact->local_count; i++)
        contact->plane_bristle[contact->node[i]] = contact->plane_trial[i];
}

static void plane_clear(Contact *contact)
{
    memset(contact->plane_bristle, 0,
           (size_t)contact->body->surface.node_count * sizeof *contact->plane_bristle);
}

// Gives a new node on the plane the mean bristle of its parents.
static void plane_follow(Contact *contact, const TopologyChange *change)
{
    Vec3 *bristle = contact->plane_bristle;
    for (int i = 0; i < change->gone_count; i++)
        bristle[change->gone[i]] = (Vec3){0.0, 0.0, 0.0};
    for (int i = 0; i < change->born_count; i++) {
        const NodeBirth *born = &change->born[i];
        bristle[born->node] =
            vec3_scale(0.5, vec3_add(bristle[born->parent[0]], bristle[born->parent[1]]));
    }
}

const ContactLaw contact_plane = {
    .share = 1.0 / 3.0,
    .create = plane_create,
    .begin = plane_begin,
    .find = plane_find,
    .read = contact_read_nodes,
    .evaluate = plane_evaluate,
    .apply = contact_apply_forces,
    .end = plane_end,
    .clear = plane_clear,
    .follow = plane_follow,
};
