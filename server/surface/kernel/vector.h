// Private to the kernels: a vector of KERNEL_WIDTH doubles in gcc's and clang's portable vector
// types, with the few operations that these lack. Widths 2, 4 and 8.
#ifndef PLIANT_SURFACE_KERNEL_VECTOR_H
#define PLIANT_SURFACE_KERNEL_VECTOR_H

#include <math.h>
#include <stdbool.h>
#include <string.h>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

enum { WIDTH = KERNEL_WIDTH };

typedef double Vector __attribute__((vector_size(8 * KERNEL_WIDTH)));
typedef long long Mask __attribute__((vector_size(8 * KERNEL_WIDTH)));

static inline Vector vector_load(const double *from)
{
    Vector v;
    memcpy(&v, from, sizeof v);
    return v;
}

static inline void vector_store(double *to, Vector v)
{
    memcpy(to, &v, sizeof v);
}

static inline Vector vector_set(double value)
{
    return value - (Vector){0};
}

// Exact square root of each lane.
static inline Vector vector_sqrt(Vector v)
{
#if defined(__x86_64__) && KERNEL_WIDTH == 8
    return (Vector)_mm512_sqrt_pd((__m512d)v);
#elif defined(__x86_64__) && KERNEL_WIDTH == 4
    return (Vector)_mm256_sqrt_pd((__m256d)v);
#elif defined(__x86_64__) && KERNEL_WIDTH == 2
    return (Vector)_mm_sqrt_pd((__m128d)v);
#else
    for (int i = 0; i < WIDTH; i++)
        v[i] = sqrt(v[i]);
    return v;
#endif
}

// a > b ? yes : no, lane by lane; `no` where a or b is not a number.
static inline Vector vector_select_greater(Vector a, Vector b, Vector yes, Vector no)
{
    Mask mask = a > b;
    return (Vector)((mask & (Mask)yes) | (~mask & (Mask)no));
}

// All bits set where |v| <= limit does not hold (not-a-number included).
static inline Vector vector_not_within(Vector v, Vector limit)
{
    Mask within = (v <= limit) & (v >= -limit);
    return (Vector)~within;
}

static inline Vector vector_or(Vector a, Vector b)
{
    return (Vector)((Mask)a | (Mask)b);
}

static inline bool vector_any(Vector mask)
{
    Mask bits = (Mask)mask;
    long long any = 0;
    for (int i = 0; i < WIDTH; i++)
        any |= bits[i];
    return any != 0;
}

// x, y, z of WIDTH rows: row[i][offset], [offset + 1], [offset + 2].
static inline void vector_load_transposed(const double *const row[WIDTH], int offset, Vector *x,
                                          Vector *y, Vector *z)
{
#if KERNEL_WIDTH == 2
    Vector a = vector_load(row[0] + offset), b = vector_load(row[1] + offset);
    *x = __builtin_shufflevector(a, b, 0, 2);
    *y = __builtin_shufflevector(a, b, 1, 3);
    *z = (Vector){row[0][offset + 2], row[1][offset + 2]};
#elif KERNEL_WIDTH == 4
    Vector a = vector_load(row[0] + offset), b = vector_load(row[1] + offset),
           c = vector_load(row[2] + offset), d = vector_load(row[3] + offset);
    Vector ab = __builtin_shufflevector(a, b, 0, 4, 2, 6),
           cd = __builtin_shufflevector(c, d, 0, 4, 2, 6);
    *x = __builtin_shufflevector(ab, cd, 0, 1, 4, 5);
    *z = __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
    ab = __builtin_shufflevector(a, b, 1, 5, 3, 7);
    cd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    *y = __builtin_shufflevector(ab, cd, 0, 1, 4, 5);
#else
    typedef double Half __attribute__((vector_size(32)));
    Half low[4], high[4];
    Vector v[4]; // row i below row i + 4
    for (int i = 0; i < 4; i++) {
        memcpy(&low[i], row[i] + offset, sizeof low[i]);
        memcpy(&high[i], row[i + 4] + offset, sizeof high[i]);
        v[i] = __builtin_shufflevector(low[i], high[i], 0, 1, 2, 3, 4, 5, 6, 7);
    }
    Vector ab = __builtin_shufflevector(v[0], v[1], 0, 8, 2, 10, 4, 12, 6, 14);
    Vector cd = __builtin_shufflevector(v[2], v[3], 0, 8, 2, 10, 4, 12, 6, 14);
    *x = __builtin_shufflevector(ab, cd, 0, 1, 8, 9, 4, 5, 12, 13);
    *z = __builtin_shufflevector(ab, cd, 2, 3, 10, 11, 6, 7, 14, 15);
    ab = __builtin_shufflevector(v[0], v[1], 1, 9, 3, 11, 5, 13, 7, 15);
    cd = __builtin_shufflevector(v[2], v[3], 1, 9, 3, 11, 5, 13, 7, 15);
    *y = __builtin_shufflevector(ab, cd, 0, 1, 8, 9, 4, 5, 12, 13);
#endif
}

// The reverse: rows of 8 doubles, x y z 0 written at the start of each.
static inline void vector_store_transposed(double *rows, Vector x, Vector y, Vector z)
{
    const Vector zero = {0};
#if KERNEL_WIDTH == 2
    vector_store(rows, __builtin_shufflevector(x, y, 0, 2));
    vector_store(rows + 8, __builtin_shufflevector(x, y, 1, 3));
    vector_store(rows + 2, __builtin_shufflevector(z, zero, 0, 2));
    vector_store(rows + 10, __builtin_shufflevector(z, zero, 1, 3));
#elif KERNEL_WIDTH == 4
    Vector low = __builtin_shufflevector(x, y, 0, 4, 2, 6),
           high = __builtin_shufflevector(x, y, 1, 5, 3, 7);
    Vector zlow = __builtin_shufflevector(z, zero, 0, 4, 2, 6),
           zhigh = __builtin_shufflevector(z, zero, 1, 5, 3, 7);
    vector_store(rows, __builtin_shufflevector(low, zlow, 0, 1, 4, 5));
    vector_store(rows + 8, __builtin_shufflevector(high, zhigh, 0, 1, 4, 5));
    vector_store(rows + 16, __builtin_shufflevector(low, zlow, 2, 3, 6, 7));
    vector_store(rows + 24, __builtin_shufflevector(high, zhigh, 2, 3, 6, 7));
#else
    typedef double Half __attribute__((vector_size(32)));
    Vector low = __builtin_shufflevector(x, y, 0, 8, 2, 10, 4, 12, 6, 14);
    Vector high = __builtin_shufflevector(x, y, 1, 9, 3, 11, 5, 13, 7, 15);
    Vector zlow = __builtin_shufflevector(z, zero, 0, 8, 2, 10, 4, 12, 6, 14);
    Vector zhigh = __builtin_shufflevector(z, zero, 1, 9, 3, 11, 5, 13, 7, 15);
    Vector row[4] = {__builtin_shufflevector(low, zlow, 0, 1, 8, 9, 4, 5, 12, 13),
                     __builtin_shufflevector(high, zhigh, 0, 1, 8, 9, 4, 5, 12, 13),
                     __builtin_shufflevector(low, zlow, 2, 3, 10, 11, 6, 7, 14, 15),
                     __builtin_shufflevector(high, zhigh, 2, 3, 10, 11, 6, 7, 14, 15)};
    for (int i = 0; i < 4; i++) {
        Half first = __builtin_shufflevector(row[i], row[i], 0, 1, 2, 3);
        Half second = __builtin_shufflevector(row[i], row[i], 4, 5, 6, 7);
        memcpy(rows + 8 * i, &first, sizeof first);
        memcpy(rows + 8 * (i + 4), &second, sizeof second);
    }
#endif
}

#endif
