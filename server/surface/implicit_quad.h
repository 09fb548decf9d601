// SPDX-License-Identifier: MIT
// Arithmetic for the nodes of an implicit body. Functions that take or return a Quad by value are
// inline: without AVX compilers do not agree on how to pass one.
#ifndef PLIANT_SURFACE_IMPLICIT_QUAD_H
#define PLIANT_SURFACE_IMPLICIT_QUAD_H

#include "surface/implicit.h"

#define INLINE static inline __attribute__((always_inline))

// Loads three numbers of a row: from 0 the position, from 4 the velocity.
INLINE Quad quad_row(const double *rows, int slot, int from)
{
    const double *row = rows + (long)slot * ROW + from;
    return (Quad){row[0], row[1], row[2], 0.0};
}

INLINE double quad_dot(Quad a, Quad b)
{
    const Quad product = a * b;
    return (product[0] + product[1]) + (product[2] + product[3]);
}

INLINE Quad quad_cross(Quad a, Quad b)
{
    return (Quad){a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
                  0.0};
}

// Solves m w = b for a symmetric, positive definite m; overwrites m.
INLINE Quad quad_solve_positive(double m[3][3], Quad b)
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

#endif
