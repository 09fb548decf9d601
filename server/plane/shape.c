// SPDX-License-Identifier: MIT
#include "plane/shape.h"

#include "base/check.h"

#include <stdbool.h>
#include <math.h>
#include <string.h>

// Returns the quarter on one side of a place, sides in the order x + 2 y; -1: none.
static int quarter_beside(int place, int side)
{
    int x = place % 3 - 1 + (side & 1), y = place / 3 - 1 + (side >> 1);
    return x < 0 || y < 0 || x > 1 || y > 1 ? -1 : x + 2 * y;
}

PlanePassing plane_passing(unsigned quarters, int place)
{
    unsigned own = 0;
    for (int side = 0; side < 4; side++) {
        int q = quarter_beside(place, side);
        if (q >= 0 && quarters >> q & 1)
            own |= 1u << side;
    }
    if (own == 0 || own == 15)
        return PLANE_ABSENT;
    bool two = own == 3 || own == 5 || own == 10 || own == 12;
    return two ? PLANE_STRAIGHT : PLANE_CORNER;
}

// Returns the place at corner c = x + 2 y of quarter q.
static int corner_of(int q, int c)
{
    return (q & 1) + (c & 1) + 3 * ((q >> 1) + (c >> 1));
}

int plane_outline(unsigned quarters, int place[PLANE_PLACES])
{
    static const int turn[5] = {0, 1, 3, 2, 0}; // corners counter-clockwise
    int next[PLANE_PLACES], count = 0;
    bool side[PLANE_PLACES][PLANE_PLACES] = {{false}};
    // Sides of all quarters; those that two quarters share are inside.
    for (int q = 0; q < 4; q++)
        for (int k = 0; k < 4 && quarters >> q & 1; k++)
            side[corner_of(q, turn[k])][corner_of(q, turn[k + 1])] = true;
    for (int a = 0; a < PLANE_PLACES; a++) {
        next[a] = -1;
        for (int b = 0; b < PLANE_PLACES; b++)
            if (side[a][b] && !side[b][a])
                next[a] = b;
    }
    // Follow the rest from the first place on.
    int first = 0;
    while (first < PLANE_PLACES && next[first] < 0)
        first++;
    ASSERT(first < PLANE_PLACES);
    for (int at = first; count == 0 || at != first; at = next[at])
        place[count++] = at;
    return count;
}

// Returns the ends of the straight edge that contains a place.
static void ends_of(unsigned quarters, int place, int end[2])
{
    int outline[PLANE_PLACES], count = plane_outline(quarters, outline);
    for (int k = 0; k < count; k++)
        if (outline[k] == place) {
            end[0] = outline[(k + count - 1) % count];
            end[1] = outline[(k + 1) % count];
            return;
        }
    ASSERT(false);
}

// Sums area vectors and vertex areas of all places as if all were present.
static void add_quarters(unsigned quarters, double area[PLANE_PLACES][2], double *part)
{
    for (int q = 0; q < 4; q++)
        for (int c = 0; c < 4 && quarters >> q & 1; c++) {
            int at = corner_of(q, c);
            area[at][0] += c & 1 ? 0.25 : -0.25;
            area[at][1] += c >> 1 ? 0.25 : -0.25;
            part[at] += 1.0 / 16.0;
        }
}

static void list_vertices(PlaneShape *shape, PlaneLaw law, const double area[PLANE_PLACES][2],
                          const double *part)
{
    for (int at = 0; at < PLANE_PLACES; at++) {
        if (!(shape->present >> at & 1))
            continue;
        int i = shape->count++;
        shape->at[i] = at;
        shape->rest[i][0] = 0.5 * (at % 3) - 0.5;
        shape->rest[i][1] = 0.5 * (at / 3) - 0.5;
        memcpy(shape->area[i], area[at], sizeof shape->area[i]);
        // Share of mass: by cones of the whole square, else by quarters; the paper's are equal.
        double cone = 0.5 * (area[at][0] * shape->rest[i][0] + area[at][1] * shape->rest[i][1]);
        shape->share[i] = (shape->quarters == 15 ? cone : part[at]) / shape->extent;
    }
    for (int i = 0; i < shape->count && law == PLANE_MIYAZAKI2004; i++)
        shape->share[i] = 1.0 / shape->count;
}

void plane_shape_create(PlaneShape *shape, PlaneLaw law, unsigned quarters, unsigned present)
{
    *shape = (PlaneShape){.quarters = quarters, .present = present};
    double area[PLANE_PLACES][2] = {{0.0}}, part[PLANE_PLACES] = {0.0};
    add_quarters(quarters, area, part);
    for (int q = 0; q < 4; q++)
        shape->extent += quarters >> q & 1 ? 0.25 : 0.0;
    // The centre first: the middles of edges to which it may give its vector are corners then.
    static const int order[PLANE_PLACES] = {PLANE_CENTER, 0, 1, 2, 3, 5, 6, 7, 8};
    for (int k = 0; k < PLANE_PLACES; k++) {
        int at = order[k], end[2];
        PlanePassing passing = plane_passing(quarters, at);
        bool there = present >> at & 1;
        ASSERT(there ? passing != PLANE_ABSENT : passing != PLANE_CORNER);
        if (there || passing == PLANE_ABSENT)
            continue;
        ends_of(quarters, at, end);
        for (int e = 0; e < 2; e++) {
            area[end[e]][0] += 0.5 * area[at][0];
            area[end[e]][1] += 0.5 * area[at][1];
            part[end[e]] += 0.5 * part[at];
        }
    }
    // Then positions relative to their mean.
    list_vertices(shape, law, (const double(*)[2])area, part);
    for (int i = 0; i < shape->count; i++)
        for (int d = 0; d < 2; d++)
            shape->mean[d] += shape->share[i] * shape->rest[i][d];
    for (int i = 0; i < shape->count; i++)
        for (int d = 0; d < 2; d++)
            shape->rest[i][d] -= shape->mean[d];
}

// ---------------------------------------------------------------------------------------------
// Forces

static double spread(const PlaneShape *shape)
{
    double sum = 0.0;
    for (int i = 0; i < shape->count; i++)
        sum += shape->rest[i][0] * shape->rest[i][0] + shape->rest[i][1] * shape->rest[i][1];
    return sum;
}

void plane_stiffness(PlaneStiffness *stiffness, const PlaneShape *shape, double youngs_modulus,
                     double poisson_ratio, double thickness, double beta)
{
    const double e = youngs_modulus * thickness, nu = poisson_ratio;
    const PlaneLaw law = stiffness->law;
    *stiffness = (PlaneStiffness){.law = law, .mu = 0.5 * e / (1.0 + nu)};
    // The paper's springs have one constant.
    if (law == PLANE_MIYAZAKI2004) {
        stiffness->residual = shape->count * 2.0 * e * shape->extent / spread(shape);
        stiffness->damping = beta * stiffness->residual;
        return;
    }
    // Plane stress, with the residual that makes bending exact.
    stiffness->lambda = e * nu / (1.0 - nu * nu);
    stiffness->damping = beta * 4.0 * 2.0 * stiffness->mu;
    stiffness->residual = (1.0 + nu) / 3.0 * 4.0 * 2.0 * stiffness->mu;
}

// Returns the rotation that fits A best: argmax of tr(R^T A). If A does not determine it, none.
static void fit(const double a[2][2], double scale, double turn[2])
{
    double p = a[0][0] + a[1][1], q = a[1][0] - a[0][1], n = sqrt(p * p + q * q);
    bool none = !(n > 1e-12 * scale);
    turn[0] = none ? 1.0 : p / n;
    turn[1] = none ? 0.0 : q / n;
}

// The paper's law: f_i = k (R R0_i - r_i).
static double paper_forces(const PlaneShape *shape, double k, double size, const double (*r)[2],
                           double (*force)[2])
{
    double a[2][2] = {{0.0}}, turn[2], energy = 0.0;
    // The rotation that fits best.
    for (int i = 0; i < shape->count; i++)
        for (int d = 0; d < 2; d++)
            for (int e = 0; e < 2; e++)
                a[d][e] += r[i][d] * size * shape->rest[i][e];
    fit((const double(*)[2])a, spread(shape) * size * size, turn);
    for (int i = 0; i < shape->count; i++) {
        double x = size * shape->rest[i][0], y = size * shape->rest[i][1];
        double away[2] = {turn[0] * x - turn[1] * y - r[i][0], turn[1] * x + turn[0] * y - r[i][1]};
        for (int d = 0; d < 2; d++) {
            force[i][d] += k * away[d];
            energy += 0.5 * k * away[d] * away[d];
        }
    }
    return energy;
}

// Computes sum share r X^T M^-1: the best linear map.
static void fit_linear(const PlaneShape *shape, double size, const double (*r)[2], double g[2][2])
{
    double a[2][2] = {{0.0}}, m[2][2] = {{0.0}};
    // Moments of positions with rest positions, and of these with themselves.
    for (int i = 0; i < shape->count; i++)
        for (int d = 0; d < 2; d++)
            for (int e = 0; e < 2; e++) {
                a[d][e] += shape->share[i] * r[i][d] * size * shape->rest[i][e];
                m[d][e] += shape->share[i] * size * size * shape->rest[i][d] * shape->rest[i][e];
            }
    double det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    for (int d = 0; d < 2; d++) {
        g[d][0] = (a[d][0] * m[1][1] - a[d][1] * m[1][0]) / det;
        g[d][1] = (a[d][1] * m[0][0] - a[d][0] * m[0][1]) / det;
    }
}

// f_i = -P a_i - share_i residual e_i with P = R (2 mu D + lambda tr(D) 1), D = R^T F - 1.
static double affine_forces(const PlaneShape *shape, const PlaneStiffness *stiffness, double size,
                            const double (*r)[2], double (*force)[2])
{
    const double extent = shape->extent * size * size;
    double f[2][2] = {{0.0}}, g[2][2], turn[2], p[2][2];
    for (int i = 0; i < shape->count; i++)
        for (int d = 0; d < 2; d++)
            for (int e = 0; e < 2; e++)
                f[d][e] += r[i][d] * size * shape->area[i][e] / extent;
    fit((const double(*)[2])f, 1.0, turn);
    const double rotation[2][2] = {{turn[0], -turn[1]}, {turn[1], turn[0]}};
    // Uniform part: stress from F - R and the trace.
    double trace = -2.0, square = 0.0;
    for (int d = 0; d < 2; d++)
        for (int e = 0; e < 2; e++) {
            double away = f[d][e] - rotation[d][e];
            trace += rotation[d][e] * f[d][e];
            square += away * away;
            p[d][e] = 2.0 * stiffness->mu * away;
        }
    for (int d = 0; d < 2; d++)
        for (int e = 0; e < 2; e++)
            p[d][e] += stiffness->lambda * trace * rotation[d][e];
    double energy = extent * (stiffness->mu * square + 0.5 * stiffness->lambda * trace * trace);
    // Residual: what the best linear map leaves.
    fit_linear(shape, size, r, g);
    for (int i = 0; i < shape->count; i++) {
        const double k = stiffness->residual * shape->share[i];
        for (int d = 0; d < 2; d++) {
            double e = r[i][d] - size * (g[d][0] * shape->rest[i][0] + g[d][1] * shape->rest[i][1]);
            force[i][d] -=
                size * (p[d][0] * shape->area[i][0] + p[d][1] * shape->area[i][1]) + k * e;
            energy += 0.5 * k * e * e;
        }
    }
    return energy;
}

// Damps the velocity without the element's rigid motion: changes neither momentum nor moment.
static void damp(const PlaneShape *shape, double damping, double size, const double (*r)[2],
                 const double (*velocity)[2], double (*force)[2])
{
    // The rigid motion of the vertices.
    double mean[2] = {0.0, 0.0}, spin = 0.0, inertia = 0.0;
    for (int i = 0; i < shape->count; i++) {
        const double w = shape->share[i];
        for (int d = 0; d < 2; d++)
            mean[d] += w * velocity[i][d];
        spin += w * (r[i][0] * velocity[i][1] - r[i][1] * velocity[i][0]);
        inertia += w * (r[i][0] * r[i][0] + r[i][1] * r[i][1]);
    }
    // It is not damped.
    spin /= inertia + 1e-12 * size * size;
    for (int i = 0; i < shape->count; i++) {
        const double c = damping * shape->share[i];
        force[i][0] -= c * (velocity[i][0] - mean[0] + spin * r[i][1]);
        force[i][1] -= c * (velocity[i][1] - mean[1] - spin * r[i][0]);
    }
}

double plane_shape_forces(const PlaneShape *shape, const PlaneStiffness *stiffness, double size,
                          const double (*position)[2], const double (*velocity)[2],
                          double (*force)[2])
{
    // Forces depend on positions relative to the mean alone.
    double mean[2] = {0.0, 0.0}, r[PLANE_PLACES][2];
    for (int i = 0; i < shape->count; i++)
        for (int d = 0; d < 2; d++)
            mean[d] += shape->share[i] * position[i][d];
    for (int i = 0; i < shape->count; i++)
        for (int d = 0; d < 2; d++)
            r[i][d] = position[i][d] - mean[d];
    const double(*from)[2] = (const double(*)[2])r;
    if (velocity != NULL && stiffness->damping > 0.0)
        damp(shape, stiffness->damping, size, from, velocity, force);
    if (stiffness->law == PLANE_MIYAZAKI2004)
        return paper_forces(shape, stiffness->residual / shape->count, size, from, force);
    return affine_forces(shape, stiffness, size, from, force);
}

// ---------------------------------------------------------------------------------------------
// Eigenvalues

enum { MOST = 2 * PLANE_PLACES };

// One rotation that makes a[p][q] vanish (Golub and van Loan, Matrix Computations, 8.5).
static void rotate_away(double a[MOST][MOST], int n, int p, int q)
{
    if (a[p][q] == 0.0)
        return;
    // The smaller of the two angles that make the entry vanish.
    double tau = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    double t = (tau >= 0.0 ? 1.0 : -1.0) / (fabs(tau) + sqrt(1.0 + tau * tau));
    double c = 1.0 / sqrt(1.0 + t * t), s = t * c;
    for (int k = 0; k < n; k++) {
        double x = a[k][p], y = a[k][q];
        a[k][p] = c * x - s * y;
        a[k][q] = s * x + c * y;
    }
    for (int k = 0; k < n; k++) {
        double x = a[p][k], y = a[q][k];
        a[p][k] = c * x - s * y;
        a[q][k] = s * x + c * y;
    }
}

double plane_shape_eigenvalue(const PlaneShape *shape, const PlaneStiffness *stiffness)
{
    enum { SWEEPS = 12 }; // converges quadratically after three or four
    const double step = 1e-6;
    const int n = 2 * shape->count;
    double a[MOST][MOST] = {{0.0}};
    // Columns of the stiffness by central differences: exact to step^2, far more than a bound
    // needs.
    for (int k = 0; k < n; k++) {
        double f[2][PLANE_PLACES][2] = {{{0.0}}};
        for (int side = 0; side < 2; side++) {
            double x[PLANE_PLACES][2];
            memcpy(x, shape->rest, sizeof x);
            x[k / 2][k % 2] += side == 0 ? step : -step;
            plane_shape_forces(shape, stiffness, 1.0, (const double(*)[2])x, NULL, f[side]);
        }
        for (int i = 0; i < n; i++)
            a[i][k] = (f[1][i / 2][i % 2] - f[0][i / 2][i % 2]) / (2.0 * step) /
                      sqrt(shape->share[i / 2] * shape->share[k / 2]);
    }
    // Symmetrize, then diagonalise by Jacobi sweeps.
    for (int i = 0; i < n; i++)
        for (int k = 0; k < i; k++)
            a[i][k] = a[k][i] = 0.5 * (a[i][k] + a[k][i]);
    for (int sweep = 0; sweep < SWEEPS; sweep++)
        for (int p = 0; p < n; p++)
            for (int q = p + 1; q < n; q++)
                rotate_away(a, n, p, q);
    double most = 0.0;
    for (int i = 0; i < n; i++)
        most = fmax(most, a[i][i]);
    return most;
}
