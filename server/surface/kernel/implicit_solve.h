// Conjugate gradients with block-Jacobi preconditioning (Hestenes and Stiefel 1952; Saad 2003,
// algorithm 9.1). Step thread.
#ifndef PLIANT_SURFACE_KERNEL_IMPLICIT_SOLVE_H
#define PLIANT_SURFACE_KERNEL_IMPLICIT_SOLVE_H

#include "surface/kernel/implicit_momentum.h"

#include <math.h>

// Fraction of the right-hand side below which the residual is rounding.
#define SOLVE_ROUNDING 1e-14

// Computes q = A p for moving nodes; returns p . q.
static double multiply(const Implicit *system, Quad *restrict p, Quad *restrict q)
{
    const int moving = system->moving, hanging = system->hanging, count = moving + hanging;
    for (int i = hanging - 1; i >= 0; i--) // coarsest level first
        p[moving + i] = 0.5 * (p[system->master[i][0]] + p[system->master[i][1]]);
    for (int i = 0; i < moving; i++)
        q[i] = system->weight[i] * p[i];
    for (int i = moving; i <= count; i++)
        q[i] = (Quad){0};
    // Springs: a I across, g g^T along.
    for (int e = 0; e < system->edge_count; e++) {
        const int i = system->end[e][0], j = system->end[e][1];
        Quad g = system->spring[e];
        const Quad d = p[i] - p[j];
        const double a = g[3];
        g[3] = 0.0;
        const Quad pull = a * d + quad_dot(g, d) * g;
        q[i] += pull;
        q[j] -= pull;
    }
    // Hanging nodes pass half of their product to each master.
    for (int i = 0; i < hanging; i++)
        for (int k = 0; k < 2; k++)
            q[system->master[i][k]] += 0.5 * q[moving + i];
    double sum = 0.0;
    for (int i = 0; i < moving; i++)
        sum += quad_dot(p[i], q[i]);
    return sum;
}

// Computes z = B r with the inverse blocks; returns r . z.
static double precondition(const Implicit *system, const Quad *restrict r, Quad *restrict z)
{
    double sum = 0.0;
    for (int i = 0; i < system->moving; i++) {
        const Block *b = &system->inverse[i];
        z[i] = r[i][0] * b->column[0] + r[i][1] * b->column[1] + r[i][2] * b->column[2];
        sum += quad_dot(r[i], z[i]);
    }
    return sum;
}

// Subtracts A times the motion in `change` from the residual; fixed nodes do not move.
static void take_start(Implicit *system)
{
    Quad *x = system->change, *r = system->residual, *q = system->product;
    x[system->moving + system->hanging] = (Quad){0};
    multiply(system, x, q);
    for (int i = 0; i < system->moving; i++)
        r[i] -= q[i];
}

static bool solve(Implicit *system)
{
    Quad *x = system->change, *r = system->residual, *z = system->step, *p = system->search,
         *q = system->product;
    const int moving = system->moving;
    // The start is the rigid motion of the external forces: only deformation is left to solve for.
    const double asked = precondition(system, r, z);
    for (int i = 0; i < moving; i++)
        x[i] = (Quad){0};
    restore_momentum(system);
    take_start(system);
    double rz = precondition(system, r, z);
    if (!isfinite(rz))
        return false;
    const double enough =
        fmax(system->tolerance * system->tolerance * rz, SOLVE_ROUNDING * SOLVE_ROUNDING * asked);
    for (int i = 0; i < moving; i++)
        p[i] = z[i];
    p[moving + system->hanging] = (Quad){0}; // fixed nodes do not move
    int iteration = 0;
    while (rz > enough && iteration < system->iterations) {
        const double pq = multiply(system, p, q);
        if (!(pq > 0.0))
            break;
        const double alpha = rz / pq;
        for (int i = 0; i < moving; i++) {
            x[i] += alpha * p[i];
            r[i] -= alpha * q[i];
        }
        const double before = rz;
        rz = precondition(system, r, z);
        const double beta = rz / before;
        for (int i = 0; i < moving; i++)
            p[i] = z[i] + beta * p[i];
        iteration++;
    }
    system->steps++;
    system->iterations_done += iteration;
    system->stopped += rz > enough;
    return isfinite(rz);
}

#endif
