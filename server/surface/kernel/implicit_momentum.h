// Gives the islands of an implicit body the momentum of its external forces: exactly, however early
// the solver stopped, and although the diagonal treats shape springs as anchored in the world
// (server/surface/README.md, "Implicit step"). Step thread.
//
// With x' = x + h (v + theta dv) and v' = v + dv the angular momentum changes by sum m (x + (1 -
// theta) h v) x dv, exactly. So the rigid velocity V + W x r must satisfy
//
//     sum w (dv + V + W x r) = h sum f,    sum r x w (dv + V + W x r) = h sum y x f
//
// with w = m + h_ gamma the mass and what damping takes from dv, r = x + (1 - theta) h v relative
// to the middle of these points, f the external forces, and y = x + h_ v where they act.
//
// Virtual nodes fixed in the world do change the momentum. But a body much stiffer than its shape
// springs moves nearly rigidly, and a solver that stops early finds that motion last. So the rigid
// velocity is added for which the solver's last residual r, projected on rigid motions R, vanishes:
// with (R^T A R) (V, W) = R^T r the error is smallest in the norm of A (a coarse space of one rigid
// motion). Here the arms are at x, for which g of a spring does not resist a rotation; a resists it
// with a (d^2 I - d d^T). All these corrections vanish where the system is solved.
#ifndef PLIANT_SURFACE_KERNEL_IMPLICIT_MOMENTUM_H
#define PLIANT_SURFACE_KERNEL_IMPLICIT_MOMENTUM_H

#include "surface/implicit_quad.h"

#include <math.h>

INLINE Quad place(const Implicit *system, int i, double ahead)
{
    const int slot = system->slot[i];
    return quad_row(system->rows, slot, 0) + ahead * quad_row(system->rows, slot, 4);
}

// Sums over the nodes of an island.
typedef struct RigidSums {
    double weight;        // [kg]
    double inertia[3][3]; // about the middle [kg m2]
    Quad middle;          // [m]
    Quad missing, turn;   // momentum, and angular momentum about the middle [N s], [N s m]
} RigidSums;

INLINE void restore_island(Implicit *system, int island)
{
    const int first = system->island_start[island], *member = system->member + first;
    const int count = system->island_start[island + 1] - first;
    const double h = system->h, ahead = system->theta * h,
                 arm = system->anchored ? 0.0 : (1.0 - system->share) * h;
    const double *inertia = system->anchored ? system->weight : system->inertia;
    // Mass and middle of the island.
    RigidSums sum = {0};
    for (int k = 0; k < count; k++) {
        const int i = member[k];
        sum.weight += inertia[i];
        sum.middle += inertia[i] * place(system, i, arm);
    }
    sum.middle /= sum.weight;
    // Missing momentum, and the inertia about the middle.
    for (int k = 0; k < count; k++) {
        const int i = member[k];
        const double w = inertia[i];
        const Quad r = place(system, i, arm) - sum.middle, y = place(system, i, ahead) - sum.middle;
        if (system->anchored) {
            sum.missing += system->residual[i];
            sum.turn += quad_cross(r, system->residual[i]);
        } else {
            sum.missing += h * system->outer[i] - w * system->change[i];
            sum.turn += h * quad_cross(y, system->outer[i]) - w * quad_cross(r, system->change[i]);
        }
        const double square = quad_dot(r, r);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                sum.inertia[a][b] += w * ((a == b ? square : 0.0) - r[a] * r[b]);
    }
    if (system->anchored)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                sum.inertia[a][b] += system->resistance[island].column[a][b];
    // An island collapsed to a line or a point has directions without inertia: no spin about these.
    const double soft =
        1e-15 * (sum.inertia[0][0] + sum.inertia[1][1] + sum.inertia[2][2]) + 1e-300;
    for (int a = 0; a < 3; a++)
        sum.inertia[a][a] += soft;
    const Quad velocity = sum.missing / sum.weight,
               spin = quad_solve_positive(sum.inertia, sum.turn);
    for (int k = 0; k < count; k++) {
        const int i = member[k];
        system->change[i] += velocity + quad_cross(spin, place(system, i, arm) - sum.middle);
    }
}

// Returns the island of a number, through its masters when it hangs; -1: fixed.
static int island_of(const Implicit *system, int number)
{
    while (number >= system->moving) {
        if (number == system->moving + system->hanging)
            return -1;
        number = system->master[number - system->moving][0];
    }
    return system->island[number];
}

// Sums the resistance of the springs' stiffness across their direction to a rotation of each
// island.
static void sum_resistance(Implicit *system)
{
    for (int k = 0; k < system->island_count; k++)
        system->resistance[k] = (Block){0};
    for (int e = 0; e < system->edge_count; e++) {
        const double a = system->spring[e][3];
        const int *end = system->end[e], island = island_of(system, end[0]);
        if (!(a > 0.0) || island < 0 || system->held[island])
            continue;
        const Quad d = place(system, end[0], 0.0) - place(system, end[1], 0.0);
        Block *block = &system->resistance[island];
        for (int c = 0; c < 3; c++) {
            block->column[c] -= (a * d[c]) * d;
            block->column[c][c] += a * quad_dot(d, d);
        }
    }
}

static void restore_momentum(Implicit *system)
{
    if (system->anchored)
        sum_resistance(system);
    for (int k = 0; k < system->island_count; k++)
        if (!system->held[k])
            restore_island(system, k);
}

#endif
