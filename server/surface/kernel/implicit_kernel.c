// SPDX-License-Identifier: MIT
// The arithmetic of an implicit step, compiled once per instruction-set level with KERNEL_NAME and
// KERNEL_LEVEL: with AVX a Quad is one register. Nothing is contracted and every sum has a fixed
// order, so that all levels are bit-identical. Step thread.
#include "surface/kernel/implicit_assemble.h"
#include "surface/implicit_quad.h"

#include <math.h>

// ---------------------------------------------------------------------------------------------
// Momentum
//
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

INLINE Quad position(const Implicit *system, int i, double ahead)
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
        sum.middle += inertia[i] * position(system, i, arm);
    }
    sum.middle /= sum.weight;
    // Missing momentum, and the inertia about the middle.
    for (int k = 0; k < count; k++) {
        const int i = member[k];
        const double w = inertia[i];
        const Quad r = position(system, i, arm) - sum.middle,
                   y = position(system, i, ahead) - sum.middle;
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
        system->change[i] += velocity + quad_cross(spin, position(system, i, arm) - sum.middle);
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
        // Only springs under tension resist a rotation of their island.
        if (!(a > 0.0) || island < 0 || system->held[island])
            continue;
        const Quad d = position(system, end[0], 0.0) - position(system, end[1], 0.0);
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

// ---------------------------------------------------------------------------------------------
// The solver
//
// Conjugate gradients with block-Jacobi preconditioning (Hestenes and Stiefel 1952; Saad 2003,
// algorithm 9.1). Step thread.

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
    // Hinges: G G^T over their four nodes.
    for (int h = 0; h < system->hinge_count; h++) {
        const Quad *g = system->hinge[h];
        const int *at = system->corner[h];
        const double bend = (quad_dot(g[0], p[at[0]]) + quad_dot(g[1], p[at[1]])) +
                            (quad_dot(g[2], p[at[2]]) + quad_dot(g[3], p[at[3]]));
        for (int k = 0; k < 4; k++)
            q[at[k]] += bend * g[k];
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
    // Where to stop: at the tolerance, or at rounding.
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
        // A step along the search direction.
        const double alpha = rz / pq;
        for (int i = 0; i < moving; i++) {
            x[i] += alpha * p[i];
            r[i] -= alpha * q[i];
        }
        // The next direction, conjugate to all before.
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

extern const ImplicitKernel KERNEL_NAME;
const ImplicitKernel KERNEL_NAME = {
    .assemble = assemble,
    .solve = solve,
    .restore_momentum = restore_momentum,
};
