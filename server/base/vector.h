// SPDX-License-Identifier: MIT
// Private to the kernels: a vector of KERNEL_WIDTH numbers of type Real in the portable vector
// types of gcc and clang, with the few operations that these lack. Real is float (KERNEL_SINGLE)
// with widths 4, 8, 16, or double with widths 2, 4, 8. The float widths that only x86-64 has load
// and store rows by intrinsics: the shuffle unit is the bottleneck, and compilers do not find the
// forms that use it least.
#ifndef PLIANT_BASE_VECTOR_H
#define PLIANT_BASE_VECTOR_H

#include <math.h>
#include <stdbool.h>
#include <string.h>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

// Without this gcc 12 calls the larger functions, with all vectors in memory. Under a sanitizer the
// calls stay: inlining everything takes minutes to compile.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define INLINE static inline
#else
#define INLINE static inline __attribute__((always_inline))
#endif

enum { WIDTH = KERNEL_WIDTH };

#if KERNEL_SINGLE
typedef float Real;
typedef int Bits;
#else
typedef double Real;
typedef long long Bits;
#endif
#define REAL(value) ((Real)(value))

typedef Real Vector __attribute__((vector_size(sizeof(Real) * KERNEL_WIDTH)));
typedef Bits Mask __attribute__((vector_size(sizeof(Real) * KERNEL_WIDTH)));

static inline Vector vector_load(const Real *from)
{
    Vector v;
    memcpy(&v, from, sizeof v);
    return v;
}

static inline void vector_store(Real *to, Vector v)
{
    memcpy(to, &v, sizeof v);
}

static inline Vector vector_set(double value)
{
    return REAL(value) - (Vector){0};
}

// Exact square root of each lane.
static inline Vector vector_sqrt(Vector v)
{
#if !defined(__x86_64__)
    for (int i = 0; i < WIDTH; i++)
        v[i] = REAL(sqrt((double)v[i])); // rounded twice, still exact for float
    return v;
#elif KERNEL_SINGLE && KERNEL_WIDTH == 16
    return (Vector)_mm512_sqrt_ps((__m512)v);
#elif KERNEL_SINGLE && KERNEL_WIDTH == 8
    return (Vector)_mm256_sqrt_ps((__m256)v);
#elif KERNEL_SINGLE
    return (Vector)_mm_sqrt_ps((__m128)v);
#elif KERNEL_WIDTH == 8
    return (Vector)_mm512_sqrt_pd((__m512d)v);
#elif KERNEL_WIDTH == 4
    return (Vector)_mm256_sqrt_pd((__m256d)v);
#else
    return (Vector)_mm_sqrt_pd((__m128d)v);
#endif
}

// Returns a > b ? yes : no, lane by lane; `no` where a or b is NaN.
static inline Vector vector_select_greater(Vector a, Vector b, Vector yes, Vector no)
{
    Mask mask = a > b;
    return (Vector)((mask & (Mask)yes) | (~mask & (Mask)no));
}

// Returns a < b ? a : b, and a > b ? a : b, lane by lane.
static inline Vector vector_min(Vector a, Vector b)
{
#if !defined(__x86_64__)
    return vector_select_greater(b, a, a, b);
#elif KERNEL_SINGLE && KERNEL_WIDTH == 16
    return (Vector)_mm512_min_ps((__m512)a, (__m512)b);
#elif KERNEL_SINGLE && KERNEL_WIDTH == 8
    return (Vector)_mm256_min_ps((__m256)a, (__m256)b);
#elif KERNEL_SINGLE
    return (Vector)_mm_min_ps((__m128)a, (__m128)b);
#elif KERNEL_WIDTH == 8
    return (Vector)_mm512_min_pd((__m512d)a, (__m512d)b);
#elif KERNEL_WIDTH == 4
    return (Vector)_mm256_min_pd((__m256d)a, (__m256d)b);
#else
    return (Vector)_mm_min_pd((__m128d)a, (__m128d)b);
#endif
}

static inline Vector vector_max(Vector a, Vector b)
{
#if !defined(__x86_64__)
    return vector_select_greater(a, b, a, b);
#elif KERNEL_SINGLE && KERNEL_WIDTH == 16
    return (Vector)_mm512_max_ps((__m512)a, (__m512)b);
#elif KERNEL_SINGLE && KERNEL_WIDTH == 8
    return (Vector)_mm256_max_ps((__m256)a, (__m256)b);
#elif KERNEL_SINGLE
    return (Vector)_mm_max_ps((__m128)a, (__m128)b);
#elif KERNEL_WIDTH == 8
    return (Vector)_mm512_max_pd((__m512d)a, (__m512d)b);
#elif KERNEL_WIDTH == 4
    return (Vector)_mm256_max_pd((__m256d)a, (__m256d)b);
#else
    return (Vector)_mm_max_pd((__m128d)a, (__m128d)b);
#endif
}

// Returns all bits set in the lanes where |v| <= limit does not hold (NaN included).
static inline Vector vector_not_within(Vector v, Vector limit)
{
    Mask within = (v <= limit) & (v >= -limit);
    return (Vector)~within;
}

static inline Vector vector_or(Vector a, Vector b)
{
    return (Vector)((Mask)a | (Mask)b);
}

// Returns v, and 0 in the lanes of a mask.
static inline Vector vector_clear(Vector v, Vector mask)
{
    return (Vector)((Mask)v & ~(Mask)mask);
}

// Returns all bits set in the lanes where a > b does not hold (NaN included).
static inline Vector vector_not_greater(Vector a, Vector b)
{
    Mask greater = a > b;
    return (Vector)~greater;
}

static inline bool vector_any(Vector mask)
{
    Mask bits = (Mask)mask;
#if KERNEL_WIDTH == 16 && defined(__x86_64__)
    return _mm512_test_epi32_mask((__m512i)bits, (__m512i)bits) != 0;
#elif KERNEL_WIDTH == 8 && !KERNEL_SINGLE && defined(__x86_64__)
    return _mm512_test_epi64_mask((__m512i)bits, (__m512i)bits) != 0;
#endif
    Bits any = 0;
    for (int i = 0; i < WIDTH; i++)
        any |= bits[i];
    return any != 0;
}

// Rows are transposed in blocks of four: block b of the i-th vector holds four numbers of row 4 b +
// i, so that a transposition inside the blocks puts row 4 b + i into lane 4 b + i. The shuffles
// below never cross the 128 (float) or 256 bits (double) of a block.
#if KERNEL_SINGLE
typedef float Block __attribute__((vector_size(16)));
#else
typedef double Block __attribute__((vector_size(32)));
#endif

#if KERNEL_SINGLE && KERNEL_WIDTH == 8
#define INTERLEAVE_LOW(a, b)  __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13)
#define INTERLEAVE_HIGH(a, b) __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15)
#define PAIRS_LOW(a, b)       __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13)
#define PAIRS_HIGH(a, b)      __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15)
#elif KERNEL_SINGLE && KERNEL_WIDTH == 4
#define INTERLEAVE_LOW(a, b)  __builtin_shufflevector(a, b, 0, 4, 1, 5)
#define INTERLEAVE_HIGH(a, b) __builtin_shufflevector(a, b, 2, 6, 3, 7)
#define PAIRS_LOW(a, b)       __builtin_shufflevector(a, b, 0, 1, 4, 5)
#define PAIRS_HIGH(a, b)      __builtin_shufflevector(a, b, 2, 3, 6, 7)
#elif KERNEL_WIDTH == 8
#define EVENS(a, b)      __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14)
#define ODDS(a, b)       __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15)
#define PAIRS_LOW(a, b)  __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13)
#define PAIRS_HIGH(a, b) __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15)
#elif KERNEL_WIDTH == 4
#define EVENS(a, b)      __builtin_shufflevector(a, b, 0, 4, 2, 6)
#define ODDS(a, b)       __builtin_shufflevector(a, b, 1, 5, 3, 7)
#define PAIRS_LOW(a, b)  __builtin_shufflevector(a, b, 0, 1, 4, 5)
#define PAIRS_HIGH(a, b) __builtin_shufflevector(a, b, 2, 3, 6, 7)
#endif

#if KERNEL_WIDTH > 2
// Loads rows first, 4 + first, 8 + first ... side by side. Inserting from memory does not use the
// shuffle unit, which the transpositions keep busy; gcc does not find that form itself.
static inline Vector gather_blocks(const Real *const row[WIDTH], int first, int offset)
{
#if KERNEL_WIDTH == 16
    __m512 v = _mm512_castps128_ps512(_mm_loadu_ps(row[first] + offset));
    v = _mm512_mask_broadcast_f32x4(v, 0x00f0, _mm_loadu_ps(row[4 + first] + offset));
    v = _mm512_mask_broadcast_f32x4(v, 0x0f00, _mm_loadu_ps(row[8 + first] + offset));
    v = _mm512_mask_broadcast_f32x4(v, 0xf000, _mm_loadu_ps(row[12 + first] + offset));
    return (Vector)v;
#elif KERNEL_SINGLE && KERNEL_WIDTH == 8
    __m256 v = _mm256_castps128_ps256(_mm_loadu_ps(row[first] + offset));
    return (Vector)_mm256_insertf128_ps(v, _mm_loadu_ps(row[4 + first] + offset), 1);
#else
    Block block[WIDTH / 4];
    for (int b = 0; b < WIDTH / 4; b++)
        memcpy(&block[b], row[4 * b + first] + offset, sizeof block[b]);
#if KERNEL_WIDTH == 8
    return __builtin_shufflevector(block[0], block[1], 0, 1, 2, 3, 4, 5, 6, 7);
#else
    return block[0];
#endif
#endif
}

INLINE void scatter_blocks(Real *rows, const int *slot, int first, Vector v)
{
    Block block[WIDTH / 4];
    memcpy(block, &v, sizeof v);
    for (int b = 0; b < WIDTH / 4; b++)
        memcpy(rows + 8L * slot[4 * b + first], &block[b], sizeof block[b]);
}
#endif

#if KERNEL_WIDTH > 2
// Transposes the rows a b c d: their first, second and third numbers, in this order in every block.
INLINE void transpose(Vector a, Vector b, Vector c, Vector d, Vector *x, Vector *y, Vector *z)
{
#if KERNEL_WIDTH == 16
    // a a c c, then b and d into its odd lanes: two shuffles per result.
#define MERGED(n)                                                                                  \
    (Vector) _mm512_mask_shuffle_ps(_mm512_shuffle_ps((__m512)a, (__m512)c, (n)*0x55), 0xaaaa,     \
                                    (__m512)b, (__m512)d, (n)*0x55)
    *x = MERGED(0);
    *y = MERGED(1);
    *z = MERGED(2);
#undef MERGED
#elif KERNEL_SINGLE
    // Pair the numbers of neighbouring rows, then the pairs.
    Vector ab = INTERLEAVE_LOW(a, b), cd = INTERLEAVE_LOW(c, d);
    *x = PAIRS_LOW(ab, cd);
    *y = PAIRS_HIGH(ab, cd);
    *z = PAIRS_LOW(INTERLEAVE_HIGH(a, b), INTERLEAVE_HIGH(c, d));
#else
    Vector ab = EVENS(a, b), cd = EVENS(c, d);
    *x = PAIRS_LOW(ab, cd);
    *y = PAIRS_LOW(ODDS(a, b), ODDS(c, d));
    *z = PAIRS_HIGH(ab, cd);
#endif
}
#endif

#if KERNEL_WIDTH == 16
// Loads whole rows, two per vector: half the loads and a third of the insertions of gather_blocks.
INLINE void load_whole_rows(const float *rows, const int *slot, Vector first[3], Vector second[3])
{
    Vector part[2][3]; // of rows 0 to 7 and 8 to 15: four of `first`, four of `second`, twice
    for (int half = 0; half < 2; half++) {
        Vector pair[4]; // row i of four and row i of the next four
        // Four pairs of rows fill a vector each and are transposed together.
        for (int i = 0; i < 4; i++) {
            const float *a = rows + 8L * slot[8 * half + i],
                        *b = rows + 8L * slot[8 * half + 4 + i];
            __m512 v = _mm512_castps256_ps512(_mm256_loadu_ps(a));
            pair[i] = (Vector)_mm512_insertf32x8(v, _mm256_loadu_ps(b), 1);
        }
        transpose(pair[0], pair[1], pair[2], pair[3], &part[half][0], &part[half][1],
                  &part[half][2]);
    }
    // Sort the interleaved halves into positions and velocities.
    for (int c = 0; c < 3; c++) {
        first[c] = (Vector)_mm512_shuffle_f32x4((__m512)part[0][c], (__m512)part[1][c], 0x88);
        second[c] = (Vector)_mm512_shuffle_f32x4((__m512)part[0][c], (__m512)part[1][c], 0xdd);
    }
}
#endif

// Loads x, y, z of the rows that begin at rows + 8 * slot[i], and with `both` also of the same rows
// four numbers further on. Works row by row, so that few addresses are alive at a time.
INLINE void vector_load_rows(const Real *rows, const int *slot, bool both, Vector first[3],
                             Vector second[3])
{
#if KERNEL_WIDTH == 2
    // Two rows: each vector takes one coordinate of both.
    const Real *r0 = rows + 8L * slot[0], *r1 = rows + 8L * slot[1];
    Vector a = vector_load(r0), b = vector_load(r1);
    first[0] = __builtin_shufflevector(a, b, 0, 2);
    first[1] = __builtin_shufflevector(a, b, 1, 3);
    first[2] = (Vector){r0[2], r1[2]};
    if (both) {
        a = vector_load(r0 + 4), b = vector_load(r1 + 4);
        second[0] = __builtin_shufflevector(a, b, 0, 2);
        second[1] = __builtin_shufflevector(a, b, 1, 3);
        second[2] = (Vector){r0[6], r1[6]};
    }
#else
#if KERNEL_WIDTH == 16
    if (both) {
        load_whole_rows(rows, slot, first, second);
        return;
    }
#endif
    // Four rows at a time, one per block of lanes.
    Vector p[4], v[4];
    for (int i = 0; i < 4; i++) {
        const Real *row[WIDTH];
        for (int b = 0; b < WIDTH / 4; b++)
            row[4 * b + i] = rows + 8L * slot[4 * b + i];
        p[i] = gather_blocks(row, i, 0);
        if (both)
            v[i] = gather_blocks(row, i, 4);
    }
    // From one vector per row to one per coordinate.
    transpose(p[0], p[1], p[2], p[3], &first[0], &first[1], &first[2]);
    if (both)
        transpose(v[0], v[1], v[2], v[3], &second[0], &second[1], &second[2]);
#endif
}

#if KERNEL_WIDTH > 2
// The reverse of transpose: x y z 0 of four lanes in every block.
INLINE void transpose_back(Vector x, Vector y, Vector z, Vector row[4])
{
#if KERNEL_WIDTH == 16
    // Interleave x and y, then add z and a zero to each row.
    __m512 low = _mm512_unpacklo_ps((__m512)x, (__m512)y),
           high = _mm512_unpackhi_ps((__m512)x, (__m512)y), last = (__m512)z;
    row[0] = (Vector)_mm512_maskz_shuffle_ps(0x7777, low, last, 0x04);
    row[1] = (Vector)_mm512_maskz_shuffle_ps(0x7777, low, last, 0x5e);
    row[2] = (Vector)_mm512_maskz_shuffle_ps(0x7777, high, last, 0xa4);
    row[3] = (Vector)_mm512_maskz_shuffle_ps(0x7777, high, last, 0xfe);
#elif KERNEL_SINGLE
    const Vector zero = {0};
    Vector low = INTERLEAVE_LOW(x, y), high = INTERLEAVE_HIGH(x, y);
    Vector zlow = INTERLEAVE_LOW(z, zero), zhigh = INTERLEAVE_HIGH(z, zero);
    row[0] = PAIRS_LOW(low, zlow);
    row[1] = PAIRS_HIGH(low, zlow);
    row[2] = PAIRS_LOW(high, zhigh);
    row[3] = PAIRS_HIGH(high, zhigh);
#else
    Vector zero = {0};
#if defined(__SANITIZE_THREAD__) && defined(__x86_64__)
    // gcc 12.2, with this sanitizer and 8 lanes, mistakes z for the known zero (vmovddup).
    __asm__("" : "+v"(zero));
#endif
    Vector evens = EVENS(x, y), odds = ODDS(x, y), zevens = EVENS(z, zero), zodds = ODDS(z, zero);
    row[0] = PAIRS_LOW(evens, zevens);
    row[1] = PAIRS_LOW(odds, zodds);
    row[2] = PAIRS_HIGH(evens, zevens);
    row[3] = PAIRS_HIGH(odds, zodds);
#endif
}
#endif

// The reverse of vector_load_rows: writes x y z 0 at the start of the rows.
INLINE void vector_store_rows(Real *rows, const int *slot, Vector x, Vector y, Vector z)
{
#if KERNEL_WIDTH == 2
    const Vector zero = {0};
    Real *r0 = rows + 8L * slot[0], *r1 = rows + 8L * slot[1];
    vector_store(r0, __builtin_shufflevector(x, y, 0, 2));
    vector_store(r1, __builtin_shufflevector(x, y, 1, 3));
    vector_store(r0 + 2, __builtin_shufflevector(z, zero, 0, 2));
    vector_store(r1 + 2, __builtin_shufflevector(z, zero, 1, 3));
#else
    Vector row[4];
    transpose_back(x, y, z, row);
    for (int i = 0; i < 4; i++)
        scatter_blocks(rows, slot, i, row[i]);
#endif
}

// Writes x y z 0 of each lane as rows of four numbers one after another, in the cheapest order: the
// row of lane i begins at rows + vector_row_at(i).
INLINE void vector_spread_rows(Real rows[4 * WIDTH], Vector x, Vector y, Vector z)
{
#if KERNEL_WIDTH == 2
    const Vector zero = {0};
    vector_store(rows, __builtin_shufflevector(x, y, 0, 2));
    vector_store(rows + 2, __builtin_shufflevector(z, zero, 0, 2));
    vector_store(rows + 4, __builtin_shufflevector(x, y, 1, 3));
    vector_store(rows + 6, __builtin_shufflevector(z, zero, 1, 3));
#else
    Vector row[4];
    transpose_back(x, y, z, row);
    for (int i = 0; i < 4; i++)
        vector_store(rows + i * WIDTH, row[i]);
#endif
}

INLINE int vector_row_at(int lane)
{
    return WIDTH == 2 ? 4 * lane : lane % 4 * WIDTH + lane / 4 * 4;
}

#endif
