// Arithmetic of an implicit body's nodes. Whatever takes or returns a Quad by value is inline:
// without AVX there is no agreed way to call it.
#ifndef PLIANT_SURFACE_IMPLICIT_QUAD_H
#define PLIANT_SURFACE_IMPLICIT_QUAD_H

#include "surface/implicit.h"

#define INLINE static inline __attribute__((always_inline))

// Three numbers of a row: 0 its position, 4 its velocity.
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

#endif
