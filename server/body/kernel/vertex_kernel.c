// SPDX-License-Identifier: MIT
// Computes the next rows from forces. Number by number, so that the result does not depend on the
// width.
//
// Compiled once per precision and level with KERNEL_NAME, KERNEL_LEVEL, KERNEL_SINGLE and
// KERNEL_WIDTH.
#include "body/kernel.h"

#include "base/vector.h"

// WIDTH numbers of the positions x y z 0 and of the velocities: of WIDTH / 4 vertices or, where a
// vector is shorter than that, a part of one vertex.
enum { TOGETHER = WIDTH < 4 ? 1 : WIDTH / 4 };

#if KERNEL_WIDTH == 16
#define ALL_PLACES(a, b)                                                                           \
    __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26, 27)
#define ALL_VELOCITIES(a, b)                                                                       \
    __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15, 20, 21, 22, 23, 28, 29, 30, 31)
#define FIRST_ROWS(u, v)                                                                           \
    __builtin_shufflevector(u, v, 0, 1, 2, 3, 16, 17, 18, 19, 4, 5, 6, 7, 20, 21, 22, 23)
#define LAST_ROWS(u, v)                                                                            \
    __builtin_shufflevector(u, v, 8, 9, 10, 11, 24, 25, 26, 27, 12, 13, 14, 15, 28, 29, 30, 31)
#elif KERNEL_WIDTH == 8
#define ALL_PLACES(a, b)     __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11)
#define ALL_VELOCITIES(a, b) __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15)
#define FIRST_ROWS(u, v)     __builtin_shufflevector(u, v, 0, 1, 2, 3, 8, 9, 10, 11)
#define LAST_ROWS(u, v)      __builtin_shufflevector(u, v, 4, 5, 6, 7, 12, 13, 14, 15)
#endif

INLINE void load_places(const Real *row, Vector *u, Vector *v)
{
#if KERNEL_WIDTH > 4
    Vector a = vector_load(row), b = vector_load(row + WIDTH);
    *u = ALL_PLACES(a, b);
    *v = ALL_VELOCITIES(a, b);
#else
    *u = vector_load(row);
    *v = vector_load(row + 4);
#endif
}

INLINE void store_places(Real *row, Vector u, Vector v)
{
#if KERNEL_WIDTH > 4
    vector_store(row, FIRST_ROWS(u, v));
    vector_store(row + WIDTH, LAST_ROWS(u, v));
#else
    vector_store(row, u);
    vector_store(row + 4, v);
#endif
}

// Loads the inverse masses of TOGETHER vertices, each four times.
INLINE Vector load_inverse_mass(const Real *from)
{
#if KERNEL_WIDTH == 16
    const __m512i each = _mm512_set_epi32(3, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1, 0, 0, 0, 0);
    return (Vector)_mm512_permutexvar_ps(each, _mm512_castps128_ps512(_mm_loadu_ps(from)));
#elif KERNEL_WIDTH == 8
    Block first = from[0] - (Block){0}, second = from[1] - (Block){0};
    return __builtin_shufflevector(first, second, 0, 1, 2, 3, 4, 5, 6, 7);
#else
    return from[0] - (Vector){0};
#endif
}

typedef struct AdvanceFactors {
    Real h, advance, loss;
    Vector gravity[2]; // by the numbers of a vertex; the second where WIDTH is 2
    Vector position_limit, speed_limit;
} AdvanceFactors;

INLINE AdvanceFactors advance_factors(const AdvancePass *pass)
{
    Real gravity[WIDTH < 4 ? 4 : WIDTH];
    for (int i = 0; i < (WIDTH < 4 ? 4 : WIDTH); i++)
        gravity[i] = i % 4 == 3 ? REAL(0.0) : (Real)pass->gravity[i % 4];
    AdvanceFactors by = {
        .h = (Real)pass->h,
        .advance = (Real)(pass->advance * pass->h),
        .loss = (Real)pass->loss,
        .gravity = {vector_load(gravity), vector_load(gravity + (WIDTH < 4 ? 2 : 0))},
        .position_limit = vector_set(pass->position_limit),
        .speed_limit = vector_set(SPEED_LIMIT),
    };
    return by;
}

// Advances the vertices from `i` on. Returns bits set where a limit is exceeded.
INLINE Vector advance_vertices(const AdvancePass *pass, const AdvanceFactors *by, bool two,
                               bool drag, long i)
{
    const Vector zero = vector_set(0.0);
    Vector inverse_mass = load_inverse_mass((const Real *)pass->inverse_mass + i), bad = zero;
    // Fixed vertices have no inverse mass, and do not move.
    Vector move = vector_select_greater(inverse_mass, zero, by->advance - zero, zero);
    for (int part = 0; part < 4; part += WIDTH) {
        Real *force = (Real *)pass->force + 4 * i + part;
        Vector u, v, sum = vector_load(force);
        // Forces of the second half are added and cleared.
        if (two) {
            Real *more = (Real *)pass->more + 4 * i + part;
            sum += vector_load(more);
            vector_store(more, zero);
        }
        // Kick, then drift by the new velocity.
        load_places((const Real *)pass->present + ROW * i + part, &u, &v);
        Vector kick = by->h * (sum * inverse_mass + by->gravity[part / 2]);
        if (drag)
            kick -= by->loss * v;
        v += vector_select_greater(inverse_mass, zero, kick, zero);
        u += move * v;
        store_places((Real *)pass->next + ROW * i + part, u, v);
        vector_store(force, zero); // for the next evaluation
        // Remember any lane out of bounds.
        if (pass->check)
            bad = vector_or(bad, vector_or(vector_not_within(u, by->position_limit),
                                           vector_not_within(v, by->speed_limit)));
    }
    return bad;
}

INLINE bool advance_by(const AdvancePass *pass, bool two, bool drag)
{
    const AdvanceFactors by = advance_factors(pass);
    Vector bad = vector_set(0.0);
    // Whole groups of vertices.
    const int together = pass->vertex_count / TOGETHER * TOGETHER;
    for (int i = 0; i < together; i += TOGETHER)
        bad = vector_or(bad, advance_vertices(pass, &by, two, drag, i));
    if (together == pass->vertex_count)
        return !vector_any(bad);
    // The last few vertices, padded, in copies.
    _Alignas(64) Real row[TOGETHER * ROW] = {0}, force[TOGETHER * 4] = {0},
                                     more[TOGETHER * 4] = {0}, inverse_mass[TOGETHER] = {0};
    const size_t rest = (size_t)(pass->vertex_count - together), forces = rest * 4 * sizeof(Real);
    memcpy(row, (const Real *)pass->present + (long)together * ROW, rest * ROW * sizeof(Real));
    memcpy(force, (const Real *)pass->force + 4L * together, forces);
    if (two)
        memcpy(more, (const Real *)pass->more + 4L * together, forces);
    memcpy(inverse_mass, (const Real *)pass->inverse_mass + together, rest * sizeof(Real));
    // The same pass over the copies.
    AdvancePass last = *pass;
    last.present = last.next = row;
    last.force = force;
    last.more = more;
    last.inverse_mass = inverse_mass;
    bad = vector_or(bad, advance_vertices(&last, &by, two, drag, 0));
    // Copy the results back; forces are cleared as in whole groups.
    memcpy((Real *)pass->next + (long)together * ROW, row, rest * ROW * sizeof(Real));
    memset((Real *)pass->force + 4L * together, 0, forces);
    if (two)
        memset((Real *)pass->more + 4L * together, 0, forces);
    return !vector_any(bad);
}

static bool advance(const AdvancePass *pass)
{
    if (pass->loss > 0.0)
        return pass->more != NULL ? advance_by(pass, true, true) : advance_by(pass, false, true);
    return pass->more != NULL ? advance_by(pass, true, false) : advance_by(pass, false, false);
}

// In groups of four: otherwise gcc 12 shuffles several rows together and takes twice as long.
static void drift(const void *present, void *next, int vertex_count, double dt)
{
    const Real step = (Real)dt;
    for (long i = 0; i < (long)vertex_count * ROW; i += ROW) {
        Block place, velocity;
        memcpy(&place, (const Real *)present + i, sizeof place);
        memcpy(&velocity, (const Real *)present + i + 4, sizeof velocity);
        place += step * velocity;
        memcpy((Real *)next + i, &place, sizeof place);
        memcpy((Real *)next + i + 4, &velocity, sizeof velocity);
    }
}

// Sums for drag (drag.h), in double precision: x y z and an unused number side by side.
typedef double Four __attribute__((vector_size(32)));
#define NEXT(a)  __builtin_shufflevector(a, a, 1, 2, 0, 3)
#define AFTER(a) __builtin_shufflevector(a, a, 2, 0, 1, 3)
// The vertex `i` of a pass: x and v.
#define READ_VERTEX(pass, i, x, v)                                                                 \
    Four x, v;                                                                                     \
    {                                                                                              \
        Block place, speed;                                                                        \
        memcpy(&x, (pass)->rest[i], sizeof x);                                                     \
        memcpy(&place, (const Real *)(pass)->row + (long)(i)*ROW, sizeof place);                   \
        memcpy(&speed, (const Real *)(pass)->row + (long)(i)*ROW + 4, sizeof speed);               \
        x += __builtin_convertvector(place, Four);                                                 \
        v = __builtin_convertvector(speed, Four);                                                  \
    }

static void sum(const SlowPass *pass, int first, int end, RigidSums *sums)
{
    double mass = 0.0;
    Four moment = {0}, momentum = {0}, square = {0}, product = {0}, spin = {0};
    for (int i = first; i < end; i++) {
        READ_VERTEX(pass, i, x, v)
        const double m = pass->mass[i];
        const Four mx = m * x;
        mass += m;
        moment += mx;
        momentum += m * v;
        square += mx * x;
        product += NEXT(mx) * AFTER(x);
        spin += NEXT(mx) * AFTER(v) - AFTER(mx) * NEXT(v);
    }
    sums->mass = mass;
    memcpy(sums->first, &moment, sizeof moment);
    memcpy(sums->momentum, &momentum, sizeof momentum);
    memcpy(sums->square, &square, sizeof square);
    memcpy(sums->product, &product, sizeof product);
    memcpy(sums->spin, &spin, sizeof spin);
}

static void slow(const SlowPass *pass, int first, int end)
{
    Four velocity, turn;
    memcpy(&velocity, pass->velocity, sizeof velocity);
    memcpy(&turn, pass->turn, sizeof turn);
    const Four next = NEXT(turn), after = AFTER(turn);
    for (int i = first; i < end; i++) {
        READ_VERTEX(pass, i, x, v)
        v -= pass->loss * (v - velocity - (next * AFTER(x) - after * NEXT(x)));
        const Block slower = __builtin_convertvector(v, Block);
        memcpy((Real *)pass->row + (long)i * ROW + 4, &slower, sizeof slower);
    }
}

extern const VertexKernels KERNEL_NAME;
const VertexKernels KERNEL_NAME = {
    .level = KERNEL_LEVEL,
    .precision = KERNEL_SINGLE ? PRECISION_SINGLE : PRECISION_DOUBLE,
    .advance = advance,
    .drift = drift,
    .sum = sum,
    .slow = slow,
};
