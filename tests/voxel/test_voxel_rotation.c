// SPDX-License-Identifier: MIT
// The best rotation of a deformation, against one that shares nothing with the code: singula//
// tr(R^T A) / |A| values by one-sided Jacobi in quadruple precision, R = U diag(1, 1, det) V^T.
#include "effort.h"
#include "test.h"
#include "random.h"

#include "voxel/rotation.h"

#include <float.h>

__extension__ typedef __float128 Quad;

static Quad quad_sqrt(Quad x)
{
    if (!(x > 0))
        return 0;
    Quad y = (Quad)sqrtl((long double)x);
    y = (y + x / y) / 2;
    return (y + x / y) / 2;
}

typedef struct Reference {
    double rotation[3][3];
    double singular[3]; // falling; the last has the sign of the determinant
} Reference;

static void cross(const Quad a[3], const Quad b[3], Quad out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static Quad dot(const Quad a[3], const Quad b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Columns of A V made orthogonal. Only for A of rank two and more; magnitudes around 1.
static Reference reference_rotation(const double a[3][3])
{
    Quad b[3][3], v[3][3]; // [column][row]
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 3; i++) {
            b[k][i] = (Quad)a[i][k];
            v[k][i] = i == k;
        }
    }
    for (int sweep = 0; sweep < 30; sweep++) {
        for (int p = 0; p < 3; p++) {
            for (int q = p + 1; q < 3; q++) {
                Quad off = dot(b[p], b[q]), theta;
                if (off == 0)
                    continue;
                theta = (dot(b[q], b[q]) - dot(b[p], b[p])) / (2 * off);
                Quad size = theta < 0 ? -theta : theta;
                Quad t = (theta < 0 ? -1 : 1) / (size + quad_sqrt(1 + theta * theta));
                Quad c = 1 / quad_sqrt(1 + t * t), s = t * c;
                for (int i = 0; i < 3; i++) {
                    Quad x = b[p][i], y = b[q][i];
                    b[p][i] = c * x - s * y;
                    b[q][i] = s * x + c * y;
                    x = v[p][i];
                    y = v[q][i];
                    v[p][i] = c * x - s * y;
                    v[q][i] = s * x + c * y;
                }
            }
        }
    }
    int order[3] = {0, 1, 2};
    for (int i = 0; i < 3; i++) {
        for (int k = i + 1; k < 3; k++) {
            if (dot(b[order[k]], b[order[k]]) > dot(b[order[i]], b[order[i]])) {
                int swap = order[i];
                order[i] = order[k];
                order[k] = swap;
            }
        }
    }
    // R maps v0, v1 and v0 x v1 to u0, u1 and u0 x u1.
    Reference out;
    Quad u[3][3], w[3][3];
    for (int k = 0; k < 2; k++) {
        Quad length = quad_sqrt(dot(b[order[k]], b[order[k]]));
        out.singular[k] = (double)length;
        for (int i = 0; i < 3; i++) {
            u[k][i] = b[order[k]][i] / length;
            w[k][i] = v[order[k]][i];
        }
    }
    cross(u[0], u[1], u[2]);
    cross(w[0], w[1], w[2]);
    Quad third = 0;
    for (int i = 0; i < 3; i++) {
        Quad row = 0;
        for (int k = 0; k < 3; k++) {
            row += (Quad)a[i][k] * w[2][k];
            out.rotation[i][k] =
                (double)(u[0][i] * w[0][k] + u[1][i] * w[1][k] + u[2][i] * w[2][k]);
        }
        third += u[2][i] * row;
    }
    out.singular[2] = (double)third;
    return out;
}

static Quat random_quat(uint64_t *random)
{
    Quat q;
    do {
        q = (Quat){random_between(random, -1.0, 1.0), random_between(random, -1.0, 1.0),
                   random_between(random, -1.0, 1.0), random_between(random, -1.0, 1.0)};
    } while (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z > 1.0);
    return quat_unit(q);
}

// Columns: the axes turned.
static void turned(Quat q, double r[3][3])
{
    for (int k = 0; k < 3; k++) {
        Vec3 column = quat_rotate(q, vec3(k == 0, k == 1, k == 2));
        r[0][k] = column.x;
        r[1][k] = column.y;
        r[2][k] = column.z;
    }
}

// U diag(s) V^T of random turns.
static void random_matrix(uint64_t *random, const double s[3], double a[3][3])
{
    double u[3][3], v[3][3];
    turned(random_quat(random), u);
    turned(random_quat(random), v);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            a[i][k] =
                u[i][0] * s[0] * v[k][0] + u[i][1] * s[1] * v[k][1] + u[i][2] * s[2] * v[k][2];
    }
}

static double norm(const double a[3][3])
{
    double largest = 0.0;
    for (int i = 0; i < 9; i++)
        largest = fmax(largest, fabs(a[i / 3][i % 3]));
    return largest;
}

// tr(R^T A) / |A|, and the largest entry of A R^T - R A^T over |A|.
static double fit(const double a[3][3], const double r[3][3])
{
    double trace = 0.0, size = norm(a);
    for (int i = 0; i < 9; i++)
        trace += a[i / 3][i % 3] / size * r[i / 3][i % 3];
    return trace;
}

// The largest entry of A R^T - R A^T over |A|.
static double moment(const double a[3][3], const double r[3][3])
{
    double worst = 0.0, size = norm(a);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < i; k++) {
            double skew = 0.0;
            for (int c = 0; c < 3; c++)
                skew += a[i][c] / size * r[k][c] - a[k][c] / size * r[i][c];
            worst = fmax(worst, fabs(skew));
        }
    }
    return worst;
}

// Orthogonal to 1e-14 (nine products of entries below 1), and not a reflection.
static void expect_rotation(const double r[3][3])
{
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            double product = r[i][0] * r[k][0] + r[i][1] * r[k][1] + r[i][2] * r[k][2];
            expect_near(product, i == k ? 1.0 : 0.0, 1e-14);
        }
    }
    double det = r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) -
                 r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0]) +
                 r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
    expect_near(det, 1.0, 1e-14);
}

static void expect_same(const double a[3][3], const double b[3][3], double tolerance)
{
    for (int i = 0; i < 9; i++)
        expect_near(a[i / 3][i % 3], b[i / 3][i % 3], tolerance);
}

// What holds for every A: a rotation, no moment, no worse than `last`, `last` is the result, and
// once more from there gives the same.
static void fit_soundly(const double a[3][3], Quat *last, double r[3][3])
{
    double before[3][3], again[3][3];
    Quat start = quat_unit(*last);
    turned(start, before);
    Quat repeat = *last;
    rotation_fit(a, r, last);
    expect_rotation((const double(*)[3])r);
    if (norm(a) > 0.0) {
        // Products of entries of at most 1, nine at a time.
        expect_at_most(moment(a, (const double(*)[3])r), 1e-13);
        expect_at_least(fit(a, (const double(*)[3])r), fit(a, (const double(*)[3])before) - 1e-13);
    }
    turned(*last, again);
    expect_same((const double(*)[3])again, (const double(*)[3])r, 1e-14);
    // The same bits from the same state.
    rotation_fit(a, again, &repeat);
    assert_memory_equal(again, r, sizeof again);
    assert_memory_equal(&repeat, last, sizeof repeat);
}

// Against the reference; s2 + s3 is the distance from ambiguity.
static void expect_fits_reference(uint64_t *random, const double s[3], double scale)
{
    double a[3][3], r[3][3];
    random_matrix(random, s, a);
    Reference expected = reference_rotation((const double(*)[3])a);
    for (int i = 0; i < 9; i++)
        a[i / 3][i % 3] *= scale;
    Quat last = random_quat(random);
    fit_soundly((const double(*)[3])a, &last, r);
    // Rounding of A (1e-16 |A|, some ten operations) turns the best rotation by that over s2 + s3.
    double gap = (expected.singular[1] + expected.singular[2]) / expected.singular[0];
    expect_same((const double(*)[3])r, (const double(*)[3])expected.rotation, 1e-14 / gap);
}

TEST(small_strains_give_the_polar_rotation)
{
    uint64_t random = 11;
    for (int n = 0; n < EFFORT(4000); n++) {
        double s[3];
        for (int i = 0; i < 3; i++)
            s[i] = random_between(&random, 0.9, 1.1);
        expect_fits_reference(&random, s, 1.0);
    }
}

TEST(large_stretches_give_the_polar_rotation)
{
    uint64_t random = 12;
    for (int n = 0; n < EFFORT(4000); n++) {
        double s[3];
        for (int i = 0; i < 3; i++)
            s[i] = random_between(&random, 0.3, 2.3);
        expect_fits_reference(&random, s, 1.0);
    }
}

TEST(inverted_states_give_the_best_rotation_not_a_reflection)
{
    uint64_t random = 13;
    for (int n = 0; n < EFFORT(4000); n++) {
        double s[3] = {random_between(&random, 0.5, 1.5), random_between(&random, 0.5, 1.5),
                       random_between(&random, -0.45, -0.05)};
        expect_fits_reference(&random, s, 1.0);
    }
}

TEST(flat_states_give_the_best_rotation)
{
    uint64_t random = 14;
    for (int n = 0; n < EFFORT(4000); n++) {
        double s[3] = {random_between(&random, 0.3, 2.3), random_between(&random, 0.3, 2.3), 0.0};
        expect_fits_reference(&random, s, 1.0);
    }
}

// Down to a distance of 1e-12 from the line and from the mirror image, through both ways of
// fitting.
TEST(nearly_ambiguous_states_give_the_best_rotation)
{
    uint64_t random = 15;
    for (int n = 0; n < EFFORT(4000); n++) {
        double gap = pow(10.0, random_between(&random, -12.0, 0.0));
        double second = n % 2 == 0 ? gap : random_between(&random, 0.5, 1.0);
        double s[3] = {1.0, second, -second + gap};
        expect_fits_reference(&random, s, 1.0);
    }
}

TEST(magnitude_does_not_matter)
{
    uint64_t random = 16;
    static const double SCALE[] = {1e-6, 1e6, 0x1p-900, 0x1p+900};
    for (int n = 0; n < EFFORT(4000); n++) {
        double s[3] = {random_between(&random, 0.3, 2.3), random_between(&random, 0.3, 2.3),
                       random_between(&random, -0.2, 2.3)};
        expect_fits_reference(&random, s, SCALE[n % 4]);
    }
    // Powers of two change nothing at all, down to where entries lose bits.
    for (int n = 0; n < EFFORT(2000); n++) {
        double s[3] = {1.0, random_between(&random, -1.0, 1.0), random_between(&random, -1.0, 1.0)};
        double a[3][3], b[3][3], r[3][3], q[3][3];
        random_matrix(&random, s, a);
        for (int i = 0; i < 9; i++)
            b[i / 3][i % 3] = ldexp(a[i / 3][i % 3], n % 1800 - 900);
        Quat last = random_quat(&random), other = last;
        rotation_fit((const double(*)[3])a, r, &last);
        rotation_fit((const double(*)[3])b, q, &other);
        assert_memory_equal(r, q, sizeof r);
    }
    for (int n = 0; n < EFFORT(2000); n++) {
        double a[3][3], r[3][3];
        for (int i = 0; i < 9; i++)
            a[i / 3][i % 3] = ldexp((double)random_below(&random, 9) - 4.0, -1074);
        Quat last = random_quat(&random);
        fit_soundly((const double(*)[3])a, &last, r);
        for (int i = 0; i < 9; i++)
            a[i / 3][i % 3] = DBL_MAX * random_between(&random, -1.0, 1.0);
        fit_soundly((const double(*)[3])a, &last, r);
    }
}

// Exactly ambiguous: a point, lines along axes, mirror images along axes. Nothing else in A says
// which, so the result is the nearest of the best to `last`: it turns only as far as A asks.
TEST(where_the_state_does_not_decide_the_last_rotation_does)
{
    uint64_t random = 17;
    for (int n = 0; n < EFFORT(2000); n++) {
        static const double POINT[3][3], LINE[3][3] = {{2.0}};
        static const double MIRROR[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, -1.0}};
        double r[3][3], before[3][3];
        Quat start = random_quat(&random), last = start;
        turned(start, before);
        fit_soundly(POINT, &last, r);
        expect_same((const double(*)[3])r, (const double(*)[3])before, 4e-15);
        // The least turn that takes the line's rest direction to where it lies: about R x x x.
        last = start;
        fit_soundly(LINE, &last, r);
        expect_near(r[0][0], 1.0, 1e-14);
        Vec3 x = vec3(before[0][0], before[1][0], before[2][0]);
        Vec3 axis = vec3_unit(vec3_cross(x, vec3(1.0, 0.0, 0.0)));
        Quat least = quat_from_rotation(vec3_scale(acos(fmin(fmax(x.x, -1.0), 1.0)), axis));
        double expected[3][3];
        turned(quat_multiply(least, start), expected);
        // acos loses half the digits near 0 and pi.
        expect_same((const double(*)[3])r, (const double(*)[3])expected, 1e-6);
        // tr(R^T A) is 1 at best: half turns about axes in the plane, and no turn (x y plane).
        last = start;
        fit_soundly(MIRROR, &last, r);
        expect_near(fit(MIRROR, (const double(*)[3])r), 1.0, 1e-14);
    }
}

// The result depends on `last` only where A leaves the choice.
TEST(otherwise_the_last_rotation_does_not_matter)
{
    uint64_t random = 18;
    for (int n = 0; n < EFFORT(2000); n++) {
        double s[3] = {1.0, random_between(&random, 0.5, 1.0), random_between(&random, -0.4, 1.0)};
        double a[3][3], r[3][3], q[3][3];
        random_matrix(&random, s, a);
        Quat last = random_quat(&random), nothing = {0.0, 0.0, 0.0, 0.0};
        rotation_fit((const double(*)[3])a, r, &last);
        rotation_fit((const double(*)[3])a, q, &nothing);
        expect_same((const double(*)[3])r, (const double(*)[3])q, 1e-14);
    }
}

TEST(what_is_not_a_number_leaves_the_last_rotation)
{
    static const double BAD[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    for (int n = 0; n < 27; n++) {
        double a[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}, r[3][3], before[3][3];
        a[n / 3 / 3][n / 3 % 3] = BAD[n % 3];
        Quat last = {0.5, 0.5, 0.5, -0.5};
        turned(last, before);
        rotation_fit((const double(*)[3])a, r, &last);
        expect_same((const double(*)[3])r, (const double(*)[3])before, 4e-15);
        // And neither does a `last` that is none survive.
        Quat broken = {(double)NAN, 0.0, (double)INFINITY, 1.0};
        static const double POINT[3][3];
        rotation_fit(POINT, r, &broken);
        expect_rotation((const double(*)[3])r);
    }
}

// As the kernels use it: exact where it says so with enough steps, and no moment in any case.
TEST(foam_alone_says_where_it_is_exact)
{
    uint64_t random = 19;
    for (int n = 0; n < EFFORT(4000); n++) {
        double s[3] = {random_between(&random, 0.3, 2.3), random_between(&random, 0.3, 2.3),
                       random_between(&random, -1.0, 2.3)};
        double a[3][3], r[3][3], trace;
        random_matrix(&random, s, a);
        Reference expected = reference_rotation((const double(*)[3])a);
        const double *t = expected.singular;
        double lambda = t[0] + t[1] + t[2];
        double ratio = (t[0] + t[1]) * (t[1] + t[2]) * (t[2] + t[0]) / (lambda * lambda * lambda);
        bool exact = rotation_foam((const double(*)[3])a, 12, r, &trace);
        if (fabs(ratio - 0.1) > 1e-6) {
            if (exact != (ratio > 0.1))
                fail_msg("zeta / lambda^3 = %g, said to be %s", ratio, exact ? "exact" : "not");
        }
        if (!exact)
            continue;
        // Two divisions by zeta, at least a tenth.
        expect_same((const double(*)[3])r, (const double(*)[3])expected.rotation, 1e-13);
        expect_near(trace, lambda, 1e-13);
        expect_at_most(moment((const double(*)[3])a, (const double(*)[3])r), 1e-14);
        rotation_foam((const double(*)[3])a, 3, r, &trace);
        // Not orthogonal yet, but nothing turns: the polynomial keeps the singular vectors.
        expect_at_most(moment((const double(*)[3])a, (const double(*)[3])r), 1e-14);
    }
    static const double POINT[3][3];
    double r[3][3], trace;
    assert_false(rotation_foam(POINT, 6, r, &trace));
}
