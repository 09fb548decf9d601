// SPDX-License-Identifier: MIT
#include "voxel/element.h"

#include "base/check.h"
#include "voxel/barrier.h"
#include "voxel/rotation.h"

#include <float.h>
#include <stdbool.h>
#include <stddef.h>

void element_polyhedron(const Vec3 *position, int count, const int (*triangle)[3],
                        int triangle_count, Vec3 *area, double *volume)
{
    double sum = 0.0;
    for (int i = 0; i < count; i++)
        area[i] = vec3(0.0, 0.0, 0.0);
    for (int t = 0; t < triangle_count; t++) {
        const int *corner = triangle[t];
        // Relative to one vertex of the body, so that the distance from the origin costs no digits.
        Vec3 a = vec3_sub(position[corner[0]], position[0]),
             b = vec3_sub(position[corner[1]], position[0]);
        Vec3 c = vec3_sub(position[corner[2]], position[0]);
        Vec3 twice = vec3_cross(vec3_sub(b, a), vec3_sub(c, a)); // twice its area vector
        for (int k = 0; k < 3; k++)
            area[corner[k]] = vec3_madd(area[corner[k]], 1.0 / 6.0, twice);
        sum += vec3_dot(a, twice) / 6.0;
    }
    *volume = sum;
}

// m += s a b^T.
static void add_outer(double m[3][3], double s, Vec3 a, Vec3 b)
{
    double left[3] = {s * a.x, s * a.y, s * a.z}, right[3] = {b.x, b.y, b.z};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            m[i][k] += left[i] * right[k];
    }
}

static Vec3 multiply(const double m[3][3], Vec3 a)
{
    return vec3(m[0][0] * a.x + m[0][1] * a.y + m[0][2] * a.z,
                m[1][0] * a.x + m[1][1] * a.y + m[1][2] * a.z,
                m[2][0] * a.x + m[2][1] * a.y + m[2][2] * a.z);
}

// Returns sum w_i a_i / sum w_i.
static Vec3 mean(const Element *element, const Vec3 *a)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    double total = 0.0;
    for (int i = 0; i < element->count; i++) {
        sum = vec3_madd(sum, element->weight[i], a[i]);
        total += element->weight[i];
    }
    return vec3_scale(1.0 / total, sum);
}

// Computes the principal axes of a symmetric matrix as columns; returns its largest eigenvalue.
static double principal_axes(const double m[3][3], Vec3 axis[3], double value[3])
{
    double a[JACOBI_MAX][JACOBI_MAX] = {{0.0}}, v[JACOBI_MAX][JACOBI_MAX], size = 0.0;
    for (int i = 0; i < 3; i++)
        size = fmax(size, fabs(m[i][i]));
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            a[i][k] = size > 0.0 ? m[i][k] / size : 0.0;
    }
    jacobi_diagonalise(3, a, v);
    for (int i = 0; i < 3; i++) {
        axis[i] = vec3(v[0][i], v[1][i], v[2][i]);
        value[i] = size * a[i][i];
    }
    return fmax(value[0], fmax(value[1], value[2]));
}

// Computes G = (sum w r X^T) M^+, M = sum w X X^T: the affine map of the rest shape that is nearest
// to the vertices. Where these are in a plane or on a line, M has no inverse, and the map across is
// undefined.
static void affine_fit(const Element *element, Vec3 rest_centre, const Vec3 *position, Vec3 centre,
                       double g[3][3])
{
    double moment[3][3] = {{0.0}}, spread[3][3] = {{0.0}}, value[3];
    Vec3 axis[3];
    for (int i = 0; i < element->count; i++) {
        Vec3 rest = vec3_sub(element->rest[i], rest_centre);
        add_outer(moment, element->weight[i], vec3_sub(position[i], centre), rest);
        add_outer(spread, element->weight[i], rest, rest);
    }
    double largest = principal_axes((const double(*)[3])spread, axis, value);
    for (int i = 0; i < 9; i++)
        g[i / 3][i % 3] = 0.0;
    for (int k = 0; k < 3; k++) {
        // Thinner than a millionth of its length: flat to rounding.
        if (value[k] > 1e-12 * largest)
            add_outer(g, 1.0 / value[k], multiply((const double(*)[3])moment, axis[k]), axis[k]);
    }
}

// Returns e_i = r_i - G X_i.
static Vec3 residual_at(const Element *element, int i, Vec3 rest_centre, const double g[3][3],
                        Vec3 position)
{
    return vec3_sub(position, multiply(g, vec3_sub(element->rest[i], rest_centre)));
}

// Replaces the energy of the linear law; returns the factor of its forces, and that of the damping.
static double stiffen(const ElementStiffness *stiffness, double volume, double *energy,
                      double *damping)
{
    const Stiffening *by = &stiffness->stiffening;
    *damping = 1.0;
    if (!stiffening_is_on(by))
        return 1.0;
    const StiffeningCurve curve = stiffening_curve(by->cap);
    const double scale =
        volume * element_energy_scale(stiffness->mu, stiffness->lambda, by->strain);
    const double q = *energy / scale;
    *energy = scale * stiffening_energy(&curve, q);
    *damping = stiffening_damping(&curve, q);
    return stiffening_factor(&curve, q);
}

// Computes force and energy of the uniform part and the residual (VOXEL_AFFINE).
//   F = sum r_i a_i^T / V,  R = argmax tr(R^T F),  P = 2 mu (F - R) + lambda tr(R^T F - 1) R
//   f_i = -P a_i - alpha k w_i e_i,  e_i = r_i - G X_i
// is the negative gradient of V (mu |F - R|^2 + lambda/2 tr^2) + alpha k/2 sum w_i |e_i|^2, as the
// derivative by R vanishes at the best R, and that by G at the least squares. The barrier
// (barrier.h) adds k_b (F - N) to P and k_b/2 |F - N|^2 to the energy, N being the nearest matrix
// that is not crushed. The uniform part and the residual have no resultant, as sum a_i = 0 and
// sum w_i e_i = 0; nor a moment, as P F^T is symmetric for the best R and sum w_i e_i X_i^T = 0.
// Stiffening makes c V G(W / (c V)) of the energy W of both parts, so that their forces are
// multiplied by G'; the barrier stays as it is. `damping` gets the factor of the damping.
static double affine_forces(const Element *element, const ElementStiffness *stiffness,
                            const Vec3 *position, Vec3 centre, Quat *last, Vec3 *force,
                            double *damping)
{
    double f[3][3] = {{0.0}}, r[3][3], g[3][3], gap[3][3], stress[3][3];
    // Uniform part: deformation gradient, best rotation, stress.
    for (int i = 0; i < element->count; i++)
        add_outer(f, 1.0 / element->volume, vec3_sub(position[i], centre), element->area[i]);
    rotation_fit((const double(*)[3])f, r, last);
    // Strain R^T F - 1: its trace, and the square of its norm.
    double trace = -3.0, square = 0.0;
    for (int i = 0; i < 9; i++) {
        double difference = f[i / 3][i % 3] - r[i / 3][i % 3];
        trace += r[i / 3][i % 3] * f[i / 3][i % 3];
        square += difference * difference;
    }
    // Residual: what the best affine map leaves.
    Vec3 rest_centre = mean(element, element->rest);
    affine_fit(element, rest_centre, position, centre, g);
    double residual = 0.0;
    for (int i = 0; i < element->count; i++) {
        const Vec3 e = residual_at(element, i, rest_centre, (const double(*)[3])g,
                                   vec3_sub(position[i], centre));
        residual += element->weight[i] * vec3_dot(e, e);
    }
    // Energy of both parts, and the factor of their forces.
    const double mu = stiffness->mu, lambda = stiffness->lambda;
    double energy = element->volume * (mu * square + 0.5 * lambda * trace * trace) +
                    0.5 * stiffness->residual * residual;
    const double factor = stiffen(stiffness, element->volume, &energy, damping);
    // First Piola-Kirchhoff stress, and the barrier in crushed elements.
    const double barrier = barrier_stiffness(mu, lambda);
    const double half = barrier_gap((const double(*)[3])f, (const double(*)[3])r, gap);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            stress[i][k] = factor * (2.0 * mu * (f[i][k] - r[i][k]) + lambda * trace * r[i][k]) +
                           barrier * gap[i][k];
    for (int i = 0; i < element->count; i++) {
        const Vec3 e = residual_at(element, i, rest_centre, (const double(*)[3])g,
                                   vec3_sub(position[i], centre));
        force[i] = vec3_sub(force[i], multiply((const double(*)[3])stress, element->area[i]));
        force[i] = vec3_madd(force[i], -factor * stiffness->residual * element->weight[i], e);
    }
    return energy + element->volume * barrier * half;
}

// Computes Miyazaki et al. (2004), section 2.2: f_i = k w_i (R R0_i - r_i), with the R for which
// the moment vanishes (Eq. 1): where tr(R^T A), A = sum w_i r_i R0_i^T, is largest. The negative
// gradient of k/2 sum w_i |r_i - R R0_i|^2.
static double paper_forces(const Element *element, const ElementStiffness *stiffness,
                           const Vec3 *position, Vec3 centre, Quat *last, Vec3 *force)
{
    Vec3 rest_centre = mean(element, element->rest);
    double a[3][3] = {{0.0}}, r[3][3], square = 0.0;
    for (int i = 0; i < element->count; i++)
        add_outer(a, element->weight[i], vec3_sub(position[i], centre),
                  vec3_sub(element->rest[i], rest_centre));
    rotation_fit((const double(*)[3])a, r, last);
    for (int i = 0; i < element->count; i++) {
        Vec3 goal = multiply((const double(*)[3])r, vec3_sub(element->rest[i], rest_centre));
        Vec3 d = vec3_sub(goal, vec3_sub(position[i], centre));
        square += element->weight[i] * vec3_dot(d, d);
        force[i] = vec3_madd(force[i], stiffness->residual * element->weight[i], d);
    }
    return 0.5 * stiffness->residual * square;
}

// Solves m x = b for the symmetric positive matrix of inertia m; a row that is zero to rounding
// gives zero. Each unknown is measured in units of its own diagonal, so that a small one keeps its
// digits.
static Vec3 solve_scaled(const double m[3][3], Vec3 b)
{
    double scale[3], l[3][3] = {{0.0}}, x[3] = {b.x, b.y, b.z};
    double largest = fmax(m[0][0], fmax(m[1][1], m[2][2]));
    for (int i = 0; i < 3; i++) {
        // A body whose width is 1e-14 of its length gets at most that fraction of the moment.
        bool turns = m[i][i] > 1e-28 * largest && m[i][i] > DBL_MIN;
        scale[i] = turns ? 1.0 / sqrt(m[i][i]) : 0.0;
        x[i] *= scale[i];
    }
    // Cholesky factors of the scaled matrix, then forward and backward substitution.
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k <= i; k++) {
            double sum = i == k ? 1.0 : m[i][k] * scale[i] * scale[k];
            for (int c = 0; c < k; c++)
                sum -= l[i][c] * l[k][c];
            // Below rounding: two axes that cannot be distinguished.
            l[i][k] = i != k ? sum / l[k][k] : sqrt(fmax(sum, DBL_EPSILON));
        }
    }
    for (int i = 0; i < 3; i++) {
        for (int c = 0; c < i; c++)
            x[i] -= l[i][c] * x[c];
        x[i] /= l[i][i];
    }
    for (int i = 2; i >= 0; i--) {
        for (int c = i + 1; c < 3; c++)
            x[i] -= l[c][i] * x[c];
        x[i] /= l[i][i];
    }
    return vec3(scale[0] * x[0], scale[1] * x[1], scale[2] * x[2]);
}

// Returns the coordinates along three axes.
static Vec3 along(const Vec3 axis[3], Vec3 a)
{
    return vec3(vec3_dot(a, axis[0]), vec3_dot(a, axis[1]), vec3_dot(a, axis[2]));
}

// Adds -beta k w_i (v_i - v_c - omega x r_i), I omega = sum w r x v: damps the non-rigid part of
// the velocities. This is a projection, so that linear and angular momentum stay, and energy only
// falls. Without a unique omega (a line, a point) any solution will do, because its factor is zero.
// Near such a state omega is so large that a small moment of inertia must keep its digits;
// otherwise a moment remains, and a resultant from a centre that is wrong by rounding. Hence all of
// it is computed in the principal axes, relative to the centre that the coordinates have there.
static void damping_forces(const Element *element, double damping, const Vec3 *position,
                           Vec3 centre, const Vec3 *velocity, Vec3 *force)
{
    Vec3 drift = mean(element, velocity), axis[3], moment = {0.0, 0.0, 0.0};
    double spread[3][3] = {{0.0}}, inertia[3][3] = {{0.0}}, value[3];
    // Principal axes of the vertices.
    for (int i = 0; i < element->count; i++) {
        Vec3 r = vec3_sub(position[i], centre);
        add_outer(spread, element->weight[i], r, r);
    }
    principal_axes((const double(*)[3])spread, axis, value);
    // The centre again, from the rotated coordinates.
    Vec3 own = {0.0, 0.0, 0.0};
    double total = 0.0;
    for (int i = 0; i < element->count; i++) {
        own = vec3_madd(own, element->weight[i], along(axis, vec3_sub(position[i], centre)));
        total += element->weight[i];
    }
    own = vec3_scale(1.0 / total, own);
    // Moment and inertia in these axes.
    for (int i = 0; i < element->count; i++) {
        double w = element->weight[i];
        Vec3 r = vec3_sub(along(axis, vec3_sub(position[i], centre)), own);
        moment = vec3_madd(moment, w, vec3_cross(r, along(axis, vec3_sub(velocity[i], drift))));
        inertia[0][0] += w * (r.y * r.y + r.z * r.z);
        inertia[1][1] += w * (r.z * r.z + r.x * r.x);
        inertia[2][2] += w * (r.x * r.x + r.y * r.y);
        inertia[1][0] -= w * r.x * r.y;
        inertia[2][0] -= w * r.x * r.z;
        inertia[2][1] -= w * r.y * r.z;
    }
    Vec3 omega = solve_scaled((const double(*)[3])inertia, moment);
    // Remove the rigid rotation, then damp the rest.
    for (int i = 0; i < element->count; i++) {
        Vec3 r = vec3_sub(along(axis, vec3_sub(position[i], centre)), own);
        Vec3 turn = vec3_cross(omega, r);
        Vec3 v = vec3_sub(velocity[i], drift);
        for (int k = 0; k < 3; k++)
            v = vec3_madd(v, k == 0 ? -turn.x : k == 1 ? -turn.y : -turn.z, axis[k]);
        force[i] = vec3_madd(force[i], -damping * element->weight[i], v);
    }
}

// Computes what is left of a field of vectors when its mean and its best affine map G are removed.
static void residual_of(const Element *element, const Vec3 *field, Vec3 *out)
{
    const Vec3 rest_centre = mean(element, element->rest), centre = mean(element, field);
    double g[3][3];
    affine_fit(element, rest_centre, field, centre, g);
    for (int i = 0; i < element->count; i++)
        out[i] = vec3_sub(vec3_sub(field[i], centre),
                          multiply((const double(*)[3])g, vec3_sub(element->rest[i], rest_centre)));
}

// s += w (|a|^2 1 - a a^T), moment += w a x b.
static void add_arm(double w, Vec3 a, Vec3 b, double inertia[3][3], Vec3 *moment)
{
    *moment = vec3_madd(*moment, w, vec3_cross(a, b));
    add_outer(inertia, -w, a, a);
    for (int i = 0; i < 3; i++)
        inertia[i][i] += w * vec3_dot(a, a);
}

// Adds beta times the derivative of
//   V (mu |F' - omega x F|^2 + lambda/2 (R : F')^2) + alpha k/2 sum w |e'_i - omega x e_i|^2
// by the velocities, ' = d/dt, with the omega that makes it least: at rest beta K v, exactly. A
// rigid motion does not change it, so that linear and angular momentum stay; it is a sum of
// squares, so that energy only falls; and it is at most what it is at rest, so that the bound of
// the step holds in every state. R : F' is the rate of tr(R^T F), which R leaves stationary.
static void viscous_forces(const Element *element, const ElementStiffness *stiffness, double beta,
                           const Vec3 *position, Vec3 centre, const Vec3 *velocity, Quat *last,
                           Vec3 *force)
{
    double f[3][3] = {{0.0}}, rate[3][3] = {{0.0}}, r[3][3], inertia[3][3] = {{0.0}};
    const double stretch = 2.0 * stiffness->mu * element->volume;
    enum { MOST = 64 }; // vertices
    ASSERT(element->count <= MOST);
    Vec3 e[MOST], e_rate[MOST], moment = {0.0, 0.0, 0.0};
    for (int i = 0; i < element->count; i++) {
        add_outer(f, 1.0 / element->volume, vec3_sub(position[i], centre), element->area[i]);
        add_outer(rate, 1.0 / element->volume, velocity[i], element->area[i]);
    }
    rotation_fit((const double(*)[3])f, r, last);
    residual_of(element, position, e);
    residual_of(element, velocity, e_rate);
    for (int k = 0; k < 3; k++)
        add_arm(stretch, vec3(f[0][k], f[1][k], f[2][k]), vec3(rate[0][k], rate[1][k], rate[2][k]),
                inertia, &moment);
    for (int i = 0; i < element->count; i++)
        add_arm(stiffness->residual * element->weight[i], e[i], e_rate[i], inertia, &moment);
    const Vec3 omega = solve_scaled((const double(*)[3])inertia, moment);
    double dilation = 0.0, stress[3][3];
    for (int i = 0; i < 9; i++)
        dilation += r[i / 3][i % 3] * rate[i / 3][i % 3];
    for (int k = 0; k < 3; k++) {
        const Vec3 turn = vec3_cross(omega, vec3(f[0][k], f[1][k], f[2][k]));
        const double turned[3] = {turn.x, turn.y, turn.z};
        for (int i = 0; i < 3; i++)
            stress[i][k] = 2.0 * stiffness->mu * (rate[i][k] - turned[i]) +
                           stiffness->lambda * dilation * r[i][k];
    }
    for (int i = 0; i < element->count; i++) {
        const Vec3 left = vec3_sub(e_rate[i], vec3_cross(omega, e[i]));
        force[i] =
            vec3_madd(force[i], -beta, multiply((const double(*)[3])stress, element->area[i]));
        force[i] = vec3_madd(force[i], -beta * stiffness->residual * element->weight[i], left);
    }
}

double element_forces(const Element *element, const ElementStiffness *stiffness,
                      const Vec3 *position, const Vec3 *velocity, Quat *last, Vec3 *force)
{
    Vec3 centre = mean(element, position);
    double damping = 1.0;
    double energy = stiffness->law == VOXEL_AFFINE
                        ? affine_forces(element, stiffness, position, centre, last, force, &damping)
                        : paper_forces(element, stiffness, position, centre, last, force);
    if (velocity != NULL && stiffness->damping_time > 0.0)
        viscous_forces(element, stiffness, damping * stiffness->damping_time, position, centre,
                       velocity, last, force);
    else if (velocity != NULL && stiffness->damping > 0.0)
        damping_forces(element, damping * stiffness->damping, position, centre, velocity, force);
    return energy;
}
