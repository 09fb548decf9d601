// SPDX-License-Identifier: MIT
// The step after the forces, in both precisions and at every instruction-set level.
#include "test.h"
#include "random.h"

#include "body/kernel.h"

enum { MOST = 67 };
static const double H = 1.7e-3, GRAVITY[3] = {0.3, -0.2, -9.81};

// Rows and forces of some vertices, in one precision; numbers that fit into float.
typedef struct State {
    bool single;
    int count;
    _Alignas(64) unsigned char rows[MOST * ROW * 8], next[MOST * ROW * 8], force[MOST * 4 * 8],
        inverse_mass[MOST * 8];
} State;

static double get(const State *s, const void *from, int at)
{
    return s->single ? (double)((const float *)from)[at] : ((const double *)from)[at];
}

static void put(const State *s, void *to, int at, double value)
{
    if (s->single)
        ((float *)to)[at] = (float)value;
    else
        ((double *)to)[at] = (double)(float)value;
}

static void make_state(State *s, Precision precision, int count)
{
    memset(s, 0, sizeof *s);
    s->single = precision == PRECISION_SINGLE;
    s->count = count;
    uint64_t random = 3 + (uint64_t)count;
    for (int i = 0; i < count; i++) {
        bool fixed = i % 5 == 2;
        put(s, s->inverse_mass, i, fixed ? 0.0 : random_between(&random, 1e3, 1e5));
        for (int c = 0; c < 3; c++) {
            put(s, s->rows, i * ROW + c, random_between(&random, -0.01, 0.01));
            put(s, s->rows, i * ROW + 4 + c, fixed ? 0.0 : random_between(&random, -1.0, 1.0));
            put(s, s->force, i * 4 + c, random_between(&random, -0.1, 0.1));
        }
    }
}

static AdvancePass pass_of(State *s)
{
    return (AdvancePass){
        .present = s->rows,
        .next = s->next,
        .force = s->force,
        .inverse_mass = s->inverse_mass,
        .vertex_count = s->count,
        .h = H,
        .advance = 0.75,
        .gravity = {GRAVITY[0], GRAVITY[1], GRAVITY[2]},
        .position_limit = 100.0,
        .check = true,
    };
}

#define EACH_KERNEL(kernels)                                                                       \
    for (int precision = 0; precision < PRECISION_COUNT; precision++)                              \
        for (const char *const *level = isa_available(); *level != NULL; level++)                  \
            for (const VertexKernels *kernels = vertex_kernels_find((Precision)precision, *level); \
                 kernels != NULL; kernels = NULL)

TEST(vertices_are_kicked_then_drift)
{
    EACH_KERNEL(kernels)
    {
        for (int count = 1; count <= MOST; count++) {
            State s, before;
            make_state(&s, kernels->precision, count);
            before = s;
            AdvancePass pass = pass_of(&s);
            assert_true(kernels->advance(&pass));
            // two or three roundings of the largest of the numbers that are added
            double unit = s.single ? 1e-7 : 2e-16;
            for (int i = 0; i < count; i++)
                for (int c = 0; c < 3; c++) {
                    double m = get(&s, s.inverse_mass, i);
                    double u = get(&before, before.rows, i * ROW + c),
                           v = get(&before, before.rows, i * ROW + 4 + c);
                    if (m > 0.0) {
                        v += H * (get(&before, before.force, i * 4 + c) * m + GRAVITY[c]);
                        u += 0.75 * H * v;
                    }
                    expect_near(get(&s, s.next, i * ROW + 4 + c), v, m > 0.0 ? 30.0 * unit : 0.0);
                    expect_near(get(&s, s.next, i * ROW + c), u, m > 0.0 ? 0.1 * unit : 0.0);
                }
            assert_memory_equal(s.rows, before.rows, sizeof s.rows);
            for (size_t i = 0; i < sizeof s.force; i++)
                assert_int_equal(s.force[i], 0);
            // Nothing is written behind the last vertex.
            for (int i = count * ROW; i < MOST * ROW; i++)
                assert_true(get(&s, s.next, i) == 0.0);
        }
    }
}

TEST(levels_give_the_same_bits_in_place_or_not)
{
    for (int count = MOST - 5; count <= MOST; count++) {
        State first[PRECISION_COUNT];
        bool known[PRECISION_COUNT] = {false};
        EACH_KERNEL(kernels)
        {
            State s, in_place;
            make_state(&s, kernels->precision, count);
            in_place = s;
            AdvancePass pass = pass_of(&s);
            kernels->advance(&pass);
            pass = pass_of(&in_place);
            pass.next = in_place.rows;
            pass.check = false;
            kernels->advance(&pass);
            assert_memory_equal(in_place.rows, s.next, sizeof s.next);
            if (!known[precision])
                first[precision] = s;
            known[precision] = true;
            assert_memory_equal(s.next, first[precision].next, sizeof s.next);
            kernels->drift(s.next, s.rows, count, 3e-3);
            make_state(&in_place, kernels->precision, count);
            memcpy(in_place.rows, s.next, sizeof s.next);
            kernels->drift(in_place.rows, in_place.rows, count, 3e-3);
            assert_memory_equal(in_place.rows, s.rows, sizeof s.rows);
        }
    }
}

TEST(drift_moves_by_the_velocities)
{
    EACH_KERNEL(kernels)
    {
        State s;
        make_state(&s, kernels->precision, MOST);
        kernels->drift(s.rows, s.next, MOST, H);
        for (int i = 0; i < MOST; i++)
            for (int c = 0; c < 4; c++) {
                double v = get(&s, s.rows, i * ROW + 4 + c);
                expect_near(get(&s, s.next, i * ROW + c), get(&s, s.rows, i * ROW + c) + H * v,
                            s.single ? 2e-9 : 4e-18); // rounding of 0.01
                assert_true(get(&s, s.next, i * ROW + 4 + c) == v);
            }
    }
}

TEST(numbers_out_of_bounds_are_found_at_every_vertex)
{
    EACH_KERNEL(kernels)
    {
        const double fast = 2.0 * SPEED_LIMIT;
        const double bad[] = {(double)NAN, HUGE_VAL, -HUGE_VAL, fast, -fast};
        for (int i = 0; i < MOST; i++) {
            if (i % 5 == 2)
                continue; // fixed
            for (int c = 0; c < 3; c++) {
                State s;
                for (int k = 0; k < 5; k++) {
                    make_state(&s, kernels->precision, MOST);
                    put(&s, s.rows, i * ROW + 4 + c, 0.0);
                    AdvancePass pass = pass_of(&s);
                    if (s.single)
                        ((float *)s.rows)[i * ROW + 4 + c] = (float)bad[k];
                    else
                        ((double *)s.rows)[i * ROW + 4 + c] = bad[k];
                    assert_false(kernels->advance(&pass));
                }
                make_state(&s, kernels->precision, MOST);
                put(&s, s.rows, i * ROW + c, -101.0);
                AdvancePass pass = pass_of(&s);
                assert_false(kernels->advance(&pass));
            }
        }
    }
}

TEST(fixed_vertices_stay_whatever_pulls)
{
    EACH_KERNEL(kernels)
    {
        State s;
        make_state(&s, kernels->precision, MOST);
        for (int c = 0; c < 3; c++)
            put(&s, s.force, 2 * 4 + c, 1e30);
        AdvancePass pass = pass_of(&s);
        assert_true(kernels->advance(&pass));
        const size_t row = ROW * (s.single ? 4 : 8);
        assert_memory_equal(s.next + 2 * row, s.rows + 2 * row, row);
    }
}
