// Gives islands of an implicit body the momentum that its forces from outside ask for (surface.md
// section 4): exactly, however far the solver came, and although the diagonal holds shape springs
// as if the world did. Step thread.
//
// With x' = x + h (v + theta dv) and v' = v + dv the angular momentum changes by
// sum m (x + (1 - theta) h v) x dv, exactly. So the rigid velocity V + W x r is sought for which
//
//     sum w (dv + V + W x r) = h sum f,    sum r x w (dv + V + W x r) = h sum y x f
//
// w = m + h_ gamma being the mass and what damping takes from dv, r = x + (1 - theta) h v from
// their middle, f the forces from outside, and y = x + h_ v where they act.
//
// Virtual nodes fixed in the world give momentum. But a body much stiffer than these springs moves
// nearly rigidly, and a solver that stops early knows that motion last: the rigid velocity that the
// solver's last residual asks for is added, w being the diagonal without springs. Both are nothing
// where the system is solved.
#ifndef PLIANT_SURFACE_KERNEL_IMPLICIT_MOMENTUM_H
#define PLIANT_SURFACE_KERNEL_IMPLICIT_MOMENTUM_H

#include "surface/implicit_quad.h"

#include <math.h>

INLINE Quad place(const Implicit *system, int i, double ahead)
{
    const int slot = system->slot[i];
    return quad_row(system->rows, slot, 0) + ahead * quad_row(system->rows, slot, 4);
}

// Solves m w = b, m symmetric and positive definite.
INLINE Quad solve_positive(double m[3][3], Quad b)
{
    for (int k = 0; k < 3; k++)
        for (int i = k + 1; i < 3; i++) {
            const double factor = m[i][k] / m[k][k];
            for (int j = k; j < 3; j++)
                m[i][j] -= factor * m[k][j];
            b[i] -= factor * b[k];
        }
    for (int k = 2; k >= 0; k--) {
        for (int j = k + 1; j < 3; j++)
            b[k] -= m[k][j] * b[j];
        b[k] /= m[k][k];
    }
    return b;
}

// What is added up over the nodes of an island.
typedef struct RigidSums {
    double weight;        // [kg]
    double inertia[3][3]; // about the middle [kg m2]
    Quad middle;          // [m]
    Quad missing, turn;   // momentum, and angular momentum about the middle [N s], [N s m]
} RigidSums;

INLINE void restore_island(Implicit *system, const int *member, int count)
{
    const double h = system->h, arm = (1.0 - system->theta) * h, ahead = system->theta * h;
    const double *inertia = system->anchored ? system->weight : system->inertia;
    RigidSums sum = {0};
    for (int k = 0; k < count; k++) {
        const int i = member[k];
        sum.weight += inertia[i];
        sum.middle += inertia[i] * place(system, i, arm);
    }
    sum.middle /= sum.weight;
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
    // Collapsed to a line or a point it has directions without inertia: no spin about these.
    const double soft =
        1e-15 * (sum.inertia[0][0] + sum.inertia[1][1] + sum.inertia[2][2]) + 1e-300;
    for (int a = 0; a < 3; a++)
        sum.inertia[a][a] += soft;
    const Quad velocity = sum.missing / sum.weight, spin = solve_positive(sum.inertia, sum.turn);
    for (int k = 0; k < count; k++) {
        const int i = member[k];
        system->change[i] += velocity + quad_cross(spin, place(system, i, arm) - sum.middle);
    }
}

static void restore_momentum(Implicit *system)
{
    for (int k = 0; k < system->island_count; k++)
        if (!system->held[k])
            restore_island(system, system->member + system->island_start[k],
                           system->island_start[k + 1] - system->island_start[k]);
}

#endif
