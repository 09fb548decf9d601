// A contact's stiffness and memory. Load time only.
#include "dynamics/contact_data.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

// Mass of a node over the sum of the face areas around it [kg/m2]. node_area is a third of that
// sum.
static double mass_per_area(const BodySurface *surface, int node)
{
    return surface->node_mass[node] / (3.0 * surface->node_area[node]);
}

// With firmness_f = min over the nodes i of f of (m_i / sum of A at i) / least, every face around a
// node is at most as firm as that node, so that still sum_f k_f <= a lambda_b m_i. Held nodes
// cannot swing and do not count, unless all of the face are held.
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
    // a lambda_b to the bound (contact.md 2.1). node_area is 0 where no face is.
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

void contact_bounds(const Body *body, const ToolOptions *tool, double *lambda, double *damping)
{
    // A face penalty adds at most a lambda_b a capsule; a plane acts on nodes: a third of that.
    double of_capsule = body->surface.solid ? CONTACT_SOLID_BOUND : 1.0;
    double count = of_capsule * tool->capsule_count + (tool->has_plane ? 1.0 / 3.0 : 0.0);
    *lambda = count * body->contact_ratio * body->contact_lambda;
    *damping = body->contact_damping * *lambda;
}

// ---------------------------------------------------------------------------------------------
// Capacity

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// The most faces of a body whose areas at rest sum up to `area`: its smallest.
static int count_faces(const BodySurface *surface, double area)
{
    size_t faces = (size_t)surface->face_count;
    double *sorted = calloc(faces + 1, sizeof *sorted);
    ASSERT(sorted != NULL);
    memcpy(sorted, surface->finest_area, faces * sizeof *sorted);
    qsort(sorted, faces, sizeof *sorted, compare);
    int count = 0;
    for (double sum = sorted[0]; count < surface->face_count && sum <= area; sum += sorted[count])
        count++;
    free(sorted);
    return count;
}

// How many faces the tool may reach in a tick, more are refused and counted: those that cover, at
// rest, the whole outside of all that its capsules reach in the tick's largest step, which takes a
// wall that wraps them all round, or three that they cut through. Small bodies fit as a whole.
static int choose_face_capacity(const Contact *contact)
{
    enum { LEAST = 512 }; // a tool that is small against the faces
    const double pi = 3.14159265358979323846;
    const BodySurface *surface = &contact->body->surface;
    double step = contact->body->finest_substeps * CONTACT_STEP_CAP * contact->smallest_radius;
    double area = 0.0;
    for (int k = 0; k < contact->tool->capsule_count; k++) {
        const Capsule *capsule = &contact->tool->capsule[k];
        double reach = capsule->radius + contact->smallest_radius + 2.0 * step; // way and swing
        reach += surface->longest_edge;                                         // faces stick out
        double length = vec3_length(vec3_sub(capsule->to, capsule->from));
        area += 2.0 * pi * reach * length + 4.0 * pi * reach * reach;
    }
    int count = count_faces(surface, area);
    count = count < LEAST ? LEAST : count;
    return count < surface->face_count ? count : surface->face_count;
}

// Nodes of so many faces, and of these with the faces around them. The longest border for its faces
// has a strip one face wide: a node a face and two, and as many around.
static void choose_capacity(Contact *contact)
{
    int nodes = contact->body->surface.node_count;
    contact->face_capacity = choose_face_capacity(contact);
    contact->node_capacity = contact->face_capacity + 2;
    contact->ring_capacity = 2 * contact->face_capacity + 16;
    contact->push_capacity =
        contact->face_capacity < CONTACT_PUSHES ? contact->face_capacity : CONTACT_PUSHES;
    if (contact->face_capacity == contact->body->surface.face_count ||
        contact->node_capacity > nodes)
        contact->node_capacity = nodes;
    if (contact->node_capacity == nodes || contact->ring_capacity > nodes)
        contact->ring_capacity = nodes + 3; // never full
}

// ---------------------------------------------------------------------------------------------
// Creation

#define ALLOCATE(count, type, label)                                                               \
    (type *)arena_allocate(arena, ARENA_CONTACT, (size_t)(count), sizeof(type), "%s/%s", name,     \
                           label)

static void create_for_plane(Contact *contact, const char *name, Arena *arena, StateList *state)
{
    int nodes = contact->body->surface.node_count;
    contact->node_capacity = nodes;
    contact->plane_bristle = ALLOCATE(nodes, Vec3, "plane bristles");
    contact->plane_trial = ALLOCATE(nodes, Vec3, "plane bristles, trial");
    state_add(state, contact->plane_bristle, (size_t)nodes * sizeof(Vec3), "%s/bristles", name);
    contact->node = ALLOCATE(nodes, int, "nodes");
    contact->x = ALLOCATE(nodes, Vec3, "positions");
}

// What it takes to follow faces that are divided and merged.
static void create_memory(Contact *contact, const char *name, Arena *arena, StateList *state)
{
    int faces = contact->body->surface.face_count;
    contact->old_side = ALLOCATE(faces, signed char, "sides before");
    contact->old_gap = ALLOCATE(faces, float, "gaps before");
    for (int k = 0; k < contact->tool->capsule_count; k++) {
        contact->gap[k] = ALLOCATE(faces, float, "gaps");
        state_add(state, contact->gap[k], (size_t)faces * sizeof(float), "%s/gaps%d", name, k);
    }
}

static void create_for_capsules(Contact *contact, const char *name, Arena *arena, StateList *state)
{
    int nodes = contact->body->surface.node_count, faces = contact->body->surface.face_count;
    const ToolOptions *tool = contact->tool;
    contact->smallest_radius = (double)INFINITY;
    for (int k = 0; k < tool->capsule_count; k++) {
        const Capsule *capsule = &tool->capsule[k];
        contact->largest_radius = fmax(contact->largest_radius, capsule->radius);
        contact->smallest_radius = fmin(contact->smallest_radius, capsule->radius);
        contact->lever =
            fmax(contact->lever, fmax(vec3_length(capsule->from), vec3_length(capsule->to)));
        contact->side[k] = ALLOCATE(faces, signed char, "sides");
        state_add(state, contact->side[k], (size_t)faces, "%s/sides%d", name, k);
    }
    if (body_changes(contact->body))
        create_memory(contact, name, arena, state);
    contact->node = ALLOCATE(nodes, int, "nodes");
    contact->local = ALLOCATE(nodes, int, "local numbers");
    for (int i = 0; i < nodes; i++)
        contact->local[i] = -1;
    contact->mark = ALLOCATE((faces + 63) / 64, uint64_t, "face marks");
    contact->rank = ALLOCATE((faces + 63) / 64, int, "face ranks");

    choose_capacity(contact);
    for (int k = 0; k < tool->capsule_count; k++)
        contact->gap_begin[k] = ALLOCATE(contact->face_capacity, double, "distances before");
    contact->candidate = ALLOCATE(contact->face_capacity, Candidate, "candidates");
    contact->distance = ALLOCATE(contact->face_capacity, double, "distances");
    contact->corners = ALLOCATE(contact->face_capacity, unsigned char, "nearest corners");
    contact->seen_side = ALLOCATE(contact->face_capacity, signed char, "seen sides");
    contact->has_side = ALLOCATE(contact->face_capacity, bool, "sides at all");
    contact->teller = ALLOCATE(contact->face_capacity, int, "tellers");
    contact->push = ALLOCATE(contact->push_capacity, Push, "pushes");
    contact->x = ALLOCATE(contact->ring_capacity, Vec3, "positions");
    contact->x_begin = ALLOCATE(contact->node_capacity, Vec3, "positions before");
    contact->node_normal = ALLOCATE(contact->node_capacity, Vec3, "node normals");
    if (contact->body->surface.solid)
        contact->ridge = ALLOCATE(contact->node_capacity, double, "ridges");
}

Contact *contact_create(const char *name, const ToolOptions *tool, bool plane, Body *body,
                        Arena *arena, StateList *state)
{
    Contact *contact = ALLOCATE(1, Contact, "contact");
    contact->is_plane = plane;
    contact->tool = tool;
    contact->body = body;
    contact->proxy = ALLOCATE(1, Proxy, "proxy");
    contact->proxy->orientation.w = 1.0;
    if (plane)
        create_for_plane(contact, name, arena, state);
    else
        create_for_capsules(contact, name, arena, state);
    state_add(state, contact->proxy, sizeof *contact->proxy, "%s/proxy", name);
    contact->v = ALLOCATE(contact->node_capacity, Vec3, "velocities");
    contact->f = ALLOCATE(contact->node_capacity, Vec3, "forces");
    return contact;
}

int contact_node_capacity(const Contact *contact)
{
    return contact->node_capacity;
}
