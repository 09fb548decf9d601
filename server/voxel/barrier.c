// SPDX-License-Identifier: MIT
#include "voxel/barrier.h"

#include "voxel/rotation.h"

#include <math.h>

// Solves t (t - s) = n^2 for the positive t; returns their product.
static double stretches(const double s[3], double n, double t[3])
{
    double product = 1.0;
    for (int i = 0; i < 3; i++) {
        const double root = sqrt(s[i] * s[i] + 4.0 * n * n);
        t[i] = s[i] > 0.0 ? 0.5 * (root + s[i]) : 2.0 * n * n / (root - s[i]);
        product *= t[i];
    }
    return product;
}

// Finds the stretches t of the given product that are nearest to s; returns n^2. Where |t - s|^2 is
// least, t - s = n^2 / t with one n > 0. Each t rises with n and is convex, and so is the product:
// from above, Newton's method comes down to the root and never passes it.
static double nearest_stretches(const double s[3], double t[3])
{
    enum { DOUBLINGS = 200, STEPS = 100 };
    double n = 0.67; // of a point: the cube root of the product
    for (int i = 0; i < DOUBLINGS && stretches(s, n, t) < BARRIER_VOLUME; i++)
        n *= 2.0;
    for (int i = 0; i < STEPS; i++) {
        const double product = stretches(s, n, t);
        double slope = 0.0;
        for (int k = 0; k < 3; k++)
            slope += 2.0 * n / (t[k] * (2.0 * t[k] - s[k]));
        const double next = n - (product - BARRIER_VOLUME) / (product * slope);
        if (!(next < n))
            break;
        n = next;
    }
    stretches(s, n, t);
    return n * n;
}

// With F = R S, S symmetric: N = R T has the axes of S.
double barrier_gap(const double f[3][3], const double rotation[3][3], double gap[3][3])
{
    const double det = f[0][0] * (f[1][1] * f[2][2] - f[1][2] * f[2][1]) +
                       f[0][1] * (f[1][2] * f[2][0] - f[1][0] * f[2][2]) +
                       f[0][2] * (f[1][0] * f[2][1] - f[1][1] * f[2][0]);
    double a[JACOBI_MAX][JACOBI_MAX] = {{0.0}}, axis[JACOBI_MAX][JACOBI_MAX], s[3], t[3];
    double turned[3][3] = {{0.0}}, square = 0.0;
    for (int i = 0; i < 9; i++)
        gap[i / 3][i % 3] = 0.0;
    if (!(det < BARRIER_VOLUME))
        return 0.0;
    // The stretches of F, the least negative if it is inverted, and those of N.
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++)
                a[i][k] += 0.5 * (rotation[c][i] * f[c][k] + rotation[c][k] * f[c][i]);
    jacobi_diagonalise(3, a, axis);
    for (int i = 0; i < 3; i++)
        s[i] = a[i][i];
    const double m = nearest_stretches(s, t);
    // R (S - T), S - T = -m T^-1.
    for (int i = 0; i < 3; i++) {
        square += m / t[i] * (m / t[i]);
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                turned[c][i] += rotation[c][k] * axis[k][i];
    }
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++)
                gap[c][k] -= m / t[i] * turned[c][i] * axis[k][i];
    return 0.5 * square;
}
