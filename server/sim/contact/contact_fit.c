// SPDX-License-Identifier: MIT
// Contact on a fitted surface (server/sim/README.md, "Contact on a smooth surface"): its nodes
// follow linearly from the vertices of the cells around them, the carriers; forces go back to these
// by the same weights. Step thread, except contact_fit_create.
#include "sim/contact/contact_data.h"

#include <math.h>
#include <string.h>

// Faces may be stretched to twice their size, and offsets with them.
static const double STRETCH = 2.0;

// Returns the mean mass of the nodes over the mean area of the faces around them [kg/m2]. The
// surface of a whole organ is as stiff everywhere, however its cells are cut off.
static double mean_density(const Body *body)
{
    double mass = 0.0, area = 0.0;
    for (int i = 0; i < body->surface.node_used; i++) {
        mass += body->surface.node_area[i] > 0.0 ? body->surface.node_mass[i] : 0.0;
        area += 3.0 * body->surface.node_area[i];
    }
    return mass / area;
}

void contact_fit_create(Contact *contact, const char *name, Arena *arena)
{
    const Body *body = contact->body;
    const int vertices = body->state_capacity;
    const int nodes = contact->node_capacity;
    ContactFit *fit = ALLOCATE(ARENA_CONTACT, 1, ContactFit, "fit");
    contact->fit = fit;
    contact->reach = STRETCH * body->mesh.fit.reach;
    fit->density = mean_density(body);
    // Carriers are the surface and the layer below, thrice where it is rough.
    fit->capacity = nodes < vertices / 4 ? 4 * nodes : vertices;
    fit->weight_capacity = nodes * (FIT_MEAN_WEIGHTS - 1); // and one for each node's own vertex
    const int slots = body->surface.node_count;
    fit->read = ALLOCATE(ARENA_CONTACT, vertices, int64_t, "searches of vertices");
    fit->vertex = ALLOCATE(ARENA_CONTACT, vertices, Vec3, "vertices read");
    fit->found = ALLOCATE(ARENA_CONTACT, slots, int64_t, "searches of nodes");
    fit->place = ALLOCATE(ARENA_CONTACT, slots, Vec3, "places of nodes");
    fit->carrier_of = ALLOCATE(ARENA_CONTACT, vertices, int, "carriers of vertices");
    memset(fit->carrier_of, -1, (size_t)vertices * sizeof *fit->carrier_of);
    fit->mark = ALLOCATE(ARENA_CONTACT, vertices, int, "weights of vertices");
    memset(fit->mark, -1, (size_t)vertices * sizeof *fit->mark);
    fit->weight = ALLOCATE(ARENA_CONTACT, fit->weight_capacity + nodes, CarrierWeight, "weights");
    fit->follower = ALLOCATE(ARENA_CONTACT, nodes, Follower, "nodes that follow");
    Carriers *carriers = &contact->carriers;
    carriers->node = ALLOCATE(ARENA_CONTACT, fit->capacity, int, "carriers");
    carriers->x = ALLOCATE(ARENA_CONTACT, fit->capacity, Vec3, "carrier positions");
    carriers->f = ALLOCATE(ARENA_CONTACT, fit->capacity, Vec3, "carrier forces");
    carriers->push = ALLOCATE(ARENA_CONTACT, fit->capacity, double, "carrier pushes");
    carriers->touched = ALLOCATE(ARENA_CONTACT, fit->capacity, int, "numbers of carriers");
    carriers->lumped = arena_allocate(arena, ARENA_CONTACT, (size_t)fit->capacity,
                                      sizeof *carriers->lumped, "%s/carrier stiffness", name);
}

// ---------------------------------------------------------------------------------------------
// Places

// Computes the mean gradient of a cell with corners at `x`, times an edge: its columns by axis.
static void find_gradient(const Vec3 x[FIT_CORNERS], Vec3 gradient[3])
{
    for (int axis = 0; axis < 3; axis++) {
        gradient[axis] = vec3(0.0, 0.0, 0.0);
        for (int k = 0; k < FIT_CORNERS; k++)
            gradient[axis] = vec3_madd(gradient[axis], k >> axis & 1 ? 0.25 : -0.25, x[k]);
    }
}

// Returns the position of a vertex [m]; each is read once in a search, with its neighbours.
static void read_vertices(const Contact *contact, const int *vertex, int count, Vec3 *x)
{
    const ContactFit *fit = contact->fit;
    const Body *body = contact->body;
    bool known = true;
    for (int k = 0; k < count; k++) {
        known = known && fit->read[vertex[k]] == fit->search;
        x[k] = fit->vertex[vertex[k]];
    }
    if (known)
        return;
    body->ops->read_nodes(body->model, vertex, count, x, NULL);
    for (int k = 0; k < count; k++) {
        fit->read[vertex[k]] = fit->search;
        fit->vertex[vertex[k]] = x[k];
    }
}

void contact_fit_read_vertices(const Contact *contact, const int corner[3], Vec3 x[3])
{
    read_vertices(contact, corner, 3, x);
}

static Vec3 find_place(const Contact *contact, int node)
{
    const Body *body = contact->body;
    FitNode fit;
    Vec3 place;
    body->ops->fit_node(body->model, node, contact->fit->step, &fit);
    read_vertices(contact, &node, 1, &place);
    place = vec3_add(place, fit.shift);
    for (int c = 0; c < fit.cell_count; c++) {
        Vec3 x[FIT_CORNERS], gradient[3];
        read_vertices(contact, fit.corner[c], FIT_CORNERS, x);
        find_gradient((const Vec3 *)x, gradient);
        for (int axis = 0; axis < 3; axis++)
            place = vec3_madd(place, fit.offset[axis] / fit.cell_count, gradient[axis]);
    }
    return place;
}

Vec3 contact_fit_place(const Contact *contact, int node)
{
    const ContactFit *fit = contact->fit;
    if (fit->found[node] != fit->search) {
        fit->found[node] = fit->search;
        fit->place[node] = find_place(contact, node);
    }
    return fit->place[node];
}

void contact_fit_read(Contact *contact)
{
    const ContactFit *fit = contact->fit;
    const Carriers *carriers = &contact->carriers;
    const Body *body = contact->body;
    body->ops->read_nodes(body->model, carriers->node, carriers->count, carriers->x, NULL);
    for (int i = 0; i < contact->local_count; i++) {
        const Follower *follower = &fit->follower[i];
        const CarrierWeight *weight = fit->weight + follower->first;
        Vec3 place = follower->shift;
        for (int c = 0; c < follower->count; c++)
            place = vec3_madd(place, weight[c].weight, carriers->x[weight[c].carrier]);
        contact->x[i] = place;
    }
}

// ---------------------------------------------------------------------------------------------
// Start of a tick

static int carrier_for(Contact *contact, int vertex)
{
    int *carrier = &contact->fit->carrier_of[vertex];
    if (*carrier < 0 && contact->carriers.count < contact->fit->capacity) {
        *carrier = contact->carriers.count;
        contact->carriers.node[contact->carriers.count++] = vertex;
    }
    return *carrier;
}

// Finds the carriers of a local node. Without memory for all of them it is where its vertex is, for
// which there always is.
static void gather_node(Contact *contact, int local)
{
    ContactFit *fit = contact->fit;
    const Body *body = contact->body;
    Follower *to = &fit->follower[local];
    FitNode from;
    FitWeight weight[FIT_WEIGHTS];
    body->ops->fit_node(body->model, contact->node[local], fit->step, &from);
    int count = fit_weights(&from, contact->node[local], fit->mark, weight);
    *to = (Follower){.first = fit->weight_count, .shift = from.shift};
    memcpy(to->rest, from.rest, sizeof to->rest);
    bool fits = fit->weight_count + count <= fit->weight_capacity;
    for (int w = 0; w < count && fits; w++)
        fits = carrier_for(contact, weight[w].vertex) >= 0;
    if (!fits) {
        contact->refused++;
        weight[0] = (FitWeight){contact->node[local], 1.0};
        count = 1;
    }
    for (int w = 0; w < count; w++) {
        fit->weight[fit->weight_count++] = (CarrierWeight){
            .carrier = carrier_for(contact, weight[w].vertex), .weight = weight[w].weight};
        to->size += fabs(weight[w].weight);
    }
    to->count = count;
}

// Returns the area of a candidate at rest [m2].
static double rest_area(const Contact *contact, const Candidate *candidate)
{
    Vec3 x[3];
    for (int k = 0; k < 3; k++) {
        const double *rest = contact->fit->follower[candidate->node[k]].rest;
        x[k] = vec3(rest[0], rest[1], rest[2]);
    }
    return 0.5 * vec3_length(vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0])));
}

void contact_fit_gather(Contact *contact)
{
    ContactFit *fit = contact->fit;
    const Body *body = contact->body;
    contact->carriers.count = fit->weight_count = 0;
    // The local nodes' own vertices first: there is room for them.
    for (int i = 0; i < contact->local_count; i++)
        carrier_for(contact, contact->node[i]);
    for (int i = 0; i < contact->local_count; i++)
        gather_node(contact, i);
    for (int i = 0; i < contact->carriers.count; i++)
        fit->carrier_of[contact->carriers.node[i]] = -1;
    const double per_area = body->contact_ratio * body->contact_lambda * fit->density;
    for (int i = 0; i < contact->candidate_count; i++)
        contact->candidate[i].stiffness = per_area * rest_area(contact, &contact->candidate[i]);
    contact_fit_read(contact);
}

void contact_fit_spread(Contact *contact)
{
    const ContactFit *fit = contact->fit;
    Carriers *carriers = &contact->carriers;
    memset(carriers->f, 0, (size_t)carriers->count * sizeof *carriers->f);
    memset(carriers->push, 0, (size_t)carriers->count * sizeof *carriers->push);
    memset(carriers->lumped, 0, (size_t)carriers->count * sizeof *carriers->lumped);
    for (int p = 0; p < contact->pressed_count; p++) {
        const int local = contact->pressed[p].local;
        const Follower *follower = &fit->follower[local];
        const Vec3 f = contact->f[local];
        const double push = vec3_length(f) / follower->size;
        for (int c = 0; c < follower->count; c++) {
            const CarrierWeight *weight = &fit->weight[follower->first + c];
            const int i = weight->carrier;
            // k w w^T of a spring is at most k |w| (sum of |w|) on each carrier alone.
            const double share = fabs(weight->weight);
            carriers->f[i] = vec3_madd(carriers->f[i], weight->weight, f);
            carriers->push[i] += share * push;
            carriers->lumped[i] =
                sym3_madd(carriers->lumped[i], share * follower->size, contact->lumped[local]);
        }
    }
}

// ---------------------------------------------------------------------------------------------
// Impulses

// Rounds of Richardson's iteration (Saad 2003, 12.3), two with each step. With L the matrix over
// M + g D, at most 1, the start has the error 1 - L, and all rounds (1 - L) q(L)^2, with q the
// Chebyshev polynomial of degree 2 on 0.2 to 1. It lies between 0 and 1 for every mode, so that
// the step is the exact one of contact somewhat stiffer or more damped, which is stable. Conjugate
// gradients overshoot in some modes while others settle: pressed by five radii, nodes trembled by
// 0.6 m/s.
enum { ROUNDS = 4 };
static const double STEPS[ROUNDS] = {1.0 / 0.8828, 1.0 / 0.8828, 1.0 / 0.3172, 1.0 / 0.3172};

// Finds what the present impulses leave of the right side.
static void find_left(Contact *contact, Vec3 u, double h, double g)
{
    const ContactFit *fit = contact->fit;
    Touched *touched = contact->touched;
    const int *number = contact->carriers.touched;
    for (int t = 0; t < contact->touched_count; t++) {
        const double m = touched[t].mass;
        touched[t].change =
            m > 0.0 ? vec3_scale(1.0 / m, contact->impulse[t]) : vec3(0.0, 0.0, 0.0);
        touched[t].left = vec3_sub(vec3_scale(h, touched[t].force), contact->impulse[t]);
    }
    for (int p = 0; p < contact->pressed_count; p++) {
        const Pressed *pressed = &contact->pressed[p];
        if (!pressed->acts)
            continue;
        const Follower *follower = &fit->follower[pressed->local];
        const CarrierWeight *weight = fit->weight + follower->first;
        Vec3 move = vec3_sub(pressed->speed, vec3_add(u, pressed->swing));
        for (int c = 0; c < follower->count; c++)
            move = vec3_madd(move, weight[c].weight, touched[number[weight[c].carrier]].change);
        const Vec3 push = vec3_scale(g, sym3_times(contact->lumped[pressed->local], move));
        for (int c = 0; c < follower->count; c++) {
            Vec3 *left = &touched[number[weight[c].carrier]].left;
            *left = vec3_madd(*left, -weight[c].weight, push);
        }
    }
}

// Returns the velocity by which a carrier alone would answer its residual.
static Vec3 answer(const Contact *contact, const Touched *touched, double g)
{
    const double m = touched->mass;
    if (!(m > 0.0))
        return vec3(0.0, 0.0, 0.0);
    const Sym3 k = sym3_scale(g / m, contact->carriers.lumped[touched->carrier]);
    return vec3_scale(1.0 / m, sym3_solve(k, 1.0, touched->left));
}

// Adds the derivative, by the tool's velocity, of what carriers that cannot move withhold. More, as
// by D, would let a hand that pulls at its largest force drag the proxy into a rigid surface.
static void add_withheld(const Contact *contact, double g, Sym3 *slope)
{
    for (int p = 0; p < contact->pressed_count; p++) {
        const Pressed *pressed = &contact->pressed[p];
        if (!pressed->acts)
            continue;
        const Follower *follower = &contact->fit->follower[pressed->local];
        const CarrierWeight *weight = contact->fit->weight + follower->first;
        double share = 0.0;
        for (int c = 0; c < follower->count; c++) {
            const int t = contact->carriers.touched[weight[c].carrier];
            share += contact->touched[t].mass > 0.0 ? 0.0 : weight[c].weight;
        }
        if (share > 0.0)
            *slope = sym3_madd(*slope, share * g, contact->lumped[pressed->local]);
    }
}

void contact_fit_solve(Contact *contact, Vec3 u, double h, double g, Sym3 *slope)
{
    Touched *touched = contact->touched;
    const int count = contact->touched_count;
    for (int round = 0; round < ROUNDS; round++) {
        find_left(contact, u, h, g);
        for (int t = 0; t < count; t++)
            contact->impulse[t] = vec3_madd(contact->impulse[t], STEPS[round] * touched[t].mass,
                                            answer(contact, &touched[t], g));
    }
    find_left(contact, u, h, g);
    // What cannot move withholds what is left. D would pull a tool that leaves.
    for (int t = 0; t < count; t++)
        if (!(touched[t].mass > 0.0))
            contact->impulse[t] = touched[t].left;
    add_withheld(contact, g, slope);
}

// ---------------------------------------------------------------------------------------------
// Stiffness

// Adds the CONTACT_MAIN largest carriers of a node, in descending order.
static void add_main(const Contact *contact, int local, double weight, ContactCarriers *to)
{
    const ContactFit *fit = contact->fit;
    const Follower *follower = &fit->follower[local];
    int *vertex = to->vertex + to->count, count = 0;
    float *share = to->share + to->count, sum = 0.0F;
    for (int w = follower->first; w < follower->first + follower->count; w++) {
        const float own = (float)fit->weight[w].weight;
        int at = count;
        while (at > 0 && fabsf(share[at - 1]) < fabsf(own))
            at--;
        if (at == CONTACT_MAIN)
            continue;
        count += count < CONTACT_MAIN;
        for (int k = count - 1; k > at; k--) {
            vertex[k] = vertex[k - 1];
            share[k] = share[k - 1];
        }
        vertex[at] = contact->carriers.node[fit->weight[w].carrier];
        share[at] = own;
    }
    for (int k = 0; k < count; k++)
        sum += share[k];
    for (int k = 0; k < count; k++)
        share[k] *= (float)weight / sum;
    to->count += count;
}

void contact_find_carriers(const Contact *contact, const ContactSpring *spring,
                           ContactCarriers *carriers)
{
    carriers->count = 0;
    for (int k = 0; k < 3; k++)
        add_main(contact, spring->local[k], spring->weight[k], carriers);
}
