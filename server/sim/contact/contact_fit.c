// SPDX-License-Identifier: MIT
// Contact on a fitted surface (server/sim/README.md, "Contact on a smooth surface"): the stiffness
// of its carriers, and the impulses on those that several nodes share. Step thread, except
// contact_fit_create.
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
    const int vertices = body->state_capacity, nodes = contact->node_capacity;
    // Carriers are the surface and the layer below, thrice where it is rough.
    const int most = nodes < vertices / 4 ? 4 * nodes : vertices;
    Carriers *carriers = contact->fit = &contact->carriers;
    carriers_create(carriers, body, nodes, most, false, name, arena);
    carriers->push = ALLOCATE(ARENA_CONTACT, most, double, "carrier pushes");
    carriers->touched = ALLOCATE(ARENA_CONTACT, most, int, "numbers of carriers");
    carriers->lumped = arena_allocate(arena, ARENA_CONTACT, (size_t)most, sizeof *carriers->lumped,
                                      "%s/carrier stiffness", name);
    contact->reach = STRETCH * body->mesh.fit.reach;
    contact->density = mean_density(body);
}

void contact_fit_read(Contact *contact)
{
    carriers_read(contact->fit, contact->local_count, contact->x, NULL);
}

// ---------------------------------------------------------------------------------------------
// Start of a tick

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
    const Body *body = contact->body;
    contact->refused += carriers_list(contact->fit, contact->node, contact->local_count);
    const double per_area = body->contact_ratio * body->contact_lambda * contact->density;
    for (int i = 0; i < contact->candidate_count; i++)
        contact->candidate[i].stiffness = per_area * rest_area(contact, &contact->candidate[i]);
    contact_fit_read(contact);
}

void contact_fit_spread(Contact *contact)
{
    Carriers *carriers = contact->fit;
    memset(carriers->f, 0, (size_t)carriers->count * sizeof *carriers->f);
    memset(carriers->push, 0, (size_t)carriers->count * sizeof *carriers->push);
    memset(carriers->lumped, 0, (size_t)carriers->count * sizeof *carriers->lumped);
    for (int p = 0; p < contact->pressed_count; p++) {
        const int local = contact->pressed[p].local;
        const Follower *follower = &carriers->follower[local];
        const double push = vec3_length(contact->f[local]) / follower->size;
        carriers_push(carriers, local, contact->f[local]);
        for (int c = 0; c < follower->count; c++) {
            const CarrierWeight *weight = &carriers->weight[follower->first + c];
            const int i = weight->carrier;
            // k w w^T of a spring is at most k |w| (sum of |w|) on each carrier alone.
            const double share = fabs(weight->weight);
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
    const Carriers *fit = contact->fit;
    const Touched *touched = contact->touched;
    TouchedLeft *of = contact->left;
    const int *number = fit->touched;
    for (int t = 0; t < contact->touched_count; t++) {
        const double m = touched[t].mass;
        of[t].change = m > 0.0 ? vec3_scale(1.0 / m, contact->impulse[t]) : vec3(0.0, 0.0, 0.0);
        of[t].left = vec3_sub(vec3_scale(h, touched[t].force), contact->impulse[t]);
    }
    for (int p = 0; p < contact->pressed_count; p++) {
        const Pressed *pressed = &contact->pressed[p];
        if (!pressed->acts)
            continue;
        const Follower *follower = &fit->follower[pressed->local];
        const CarrierWeight *weight = fit->weight + follower->first;
        Vec3 move = vec3_sub(pressed->speed, vec3_add(u, pressed->swing));
        for (int c = 0; c < follower->count; c++)
            move = vec3_madd(move, weight[c].weight, of[number[weight[c].carrier]].change);
        const Vec3 push = vec3_scale(g, sym3_times(contact->lumped[pressed->local], move));
        for (int c = 0; c < follower->count; c++) {
            Vec3 *left = &of[number[weight[c].carrier]].left;
            *left = vec3_madd(*left, -weight[c].weight, push);
        }
    }
}

// Returns the velocity by which a carrier alone would answer its residual.
static Vec3 answer(const Contact *contact, int t, double g)
{
    const Touched *touched = &contact->touched[t];
    const double m = touched->mass;
    if (!(m > 0.0))
        return vec3(0.0, 0.0, 0.0);
    const Sym3 k = sym3_scale(g / m, contact->carriers.lumped[touched->carrier]);
    return vec3_scale(1.0 / m, sym3_solve(k, 1.0, contact->left[t].left));
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
    const Touched *touched = contact->touched;
    const int count = contact->touched_count;
    for (int round = 0; round < ROUNDS; round++) {
        find_left(contact, u, h, g);
        for (int t = 0; t < count; t++)
            contact->impulse[t] = vec3_madd(contact->impulse[t], STEPS[round] * touched[t].mass,
                                            answer(contact, t, g));
    }
    find_left(contact, u, h, g);
    // What cannot move withholds what is left. D would pull a tool that leaves.
    for (int t = 0; t < count; t++)
        if (!(touched[t].mass > 0.0))
            contact->impulse[t] = contact->left[t].left;
    add_withheld(contact, g, slope);
}

// ---------------------------------------------------------------------------------------------
// Stiffness

// Adds the CONTACT_MAIN largest carriers of a node, in descending order.
static void add_main(const Contact *contact, int local, double weight, ContactCarriers *to)
{
    const Carriers *fit = contact->fit;
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
        vertex[at] = fit->node[fit->weight[w].carrier];
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
