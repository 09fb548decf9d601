// SPDX-License-Identifier: MIT
// What holds of a body whose material relaxes or stiffens, whichever model it is of.
#ifndef PLIANT_TESTS_LAW_TRIAL_H
#define PLIANT_TESTS_LAW_TRIAL_H

#include "body/stiffening.h"
#include "sim/sim.h"

typedef struct LawBody {
    const char *name; // of the row, for the report
    Sim *sim;
    Body *body;
    double length; // of the body [m]
    int count;     // nodes
    const double *mass;
    Vec3 *x, *v; // [count] as read last
    void *of;    // what the functions are called with
    void (*read)(void *of);
    void (*write)(void *of, const Vec3 *x, const Vec3 *v);
    // Forces of the material on the nodes, at rest where they were written last.
    void (*forces)(void *of, Vec3 *force);
} LawBody;

// Fails unless forces at x are the slope of the energy along a random direction, and have neither
// resultant nor moment.
void law_expect_gradient(const LawBody *body, const Vec3 *x, uint64_t *random);
// Fails unless a free body, which moves, keeps its momentum for so many ticks, the angular one to
// within `angular` in single precision, and at the end has less than `left` of its energy.
void law_expect_momentum(const LawBody *body, int ticks, Precision precision, double angular,
                         double left);
// Plucks a body by velocities; fails unless its swing, of that shape, decays at the loss factor.
void law_expect_loss(const LawBody *body, const Vec3 *shape, double speed, double loss);

// How energy goes, over the first.
typedef struct LawFall {
    double most, growth, left; // at any time; in one tick; at the end
} LawFall;

LawFall law_fall(const LawBody *body, const Vec3 *x, const Vec3 *v, int ticks);

// The stress of a stretched strip over its modulus: e exp((e / s)^2) up to the strain from which on
// it is a straight line of slope cap: there the derivative of that law, (1 + 2 q) exp(q), is cap.
double law_stress(Stiffening law, double strain);

#endif
