// SPDX-License-Identifier: MIT
#include "voxel/rotation.h"

#include <float.h>
#include <math.h>

// ---------------------------------------------------------------------------------------------
// Eigenvalues by Jacobi's method

// Zeroes a[p][q] by a rotation in the plane of p and q.
static void turn(int n, double a[JACOBI_MAX][JACOBI_MAX], double v[JACOBI_MAX][JACOBI_MAX], int p,
                 int q)
{
    double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    // An infinite theta (a[p][q] far below the diagonal's difference) gives the rotation 0.
    double t = copysign(1.0 / (fabs(theta) + sqrt(theta * theta + 1.0)), theta);
    double c = 1.0 / sqrt(t * t + 1.0), s = t * c;
    double shift = t * a[p][q];
    a[p][p] -= shift;
    a[q][q] += shift;
    a[p][q] = a[q][p] = 0.0;
    for (int k = 0; k < n; k++) {
        if (k != p && k != q) {
            double x = a[k][p], y = a[k][q];
            a[k][p] = a[p][k] = c * x - s * y;
            a[k][q] = a[q][k] = s * x + c * y;
        }
        double x = v[k][p], y = v[k][q];
        v[k][p] = c * x - s * y;
        v[k][q] = s * x + c * y;
    }
}

void jacobi_diagonalise(int n, double a[JACOBI_MAX][JACOBI_MAX], double v[JACOBI_MAX][JACOBI_MAX])
{
    // Start from no rotation; the largest entry sets the scale of rounding.
    double norm = 0.0;
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < n; k++) {
            v[i][k] = i == k ? 1.0 : 0.0;
            norm = fmax(norm, fabs(a[i][k]));
        }
    }
    // Convergence is quadratic: 4 x 4 takes five or six sweeps; no known input takes ten.
    for (int sweep = 0; sweep < 16; sweep++) {
        double off = 0.0;
        for (int p = 0; p < n; p++) {
            for (int q = p + 1; q < n; q++) {
                off = fmax(off, fabs(a[p][q]));
                if (fabs(a[p][q]) > 1e-3 * DBL_EPSILON * norm)
                    turn(n, a, v, p, q);
            }
        }
        if (!(off > 1e-3 * DBL_EPSILON * norm))
            break;
    }
}

// ---------------------------------------------------------------------------------------------
// Rotations

typedef struct Foam {
    double trace; // lambda: s1 + s2 + s3, the singular values, s3 with the sign of det A
    double zeta;  // (s1 + s2) (s2 + s3) (s3 + s1)
} Foam;

// Markley (1993), "Attitude determination using vector observations: a fast optimal matrix
// algorithm": Newton's method from above for the largest root of (lambda^2 - |A|^2)^2 - 8 lambda
// det A - 4 |cof A|^2, then R as a polynomial in A. As that polynomial keeps A's singular vectors,
// A R^T is symmetric to rounding even where lambda has not yet converged; only R's orthogonality
// suffers.
static Foam foam(const double a[3][3], int steps, double r[3][3])
{
    // Invariants of A.
    double cofactor[3][3], norm = 0.0, cofactor_norm = 0.0;
    for (int i = 0; i < 3; i++) {
        int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
        for (int k = 0; k < 3; k++) {
            int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
            cofactor[i][k] = a[i1][k1] * a[i2][k2] - a[i1][k2] * a[i2][k1];
            norm += a[i][k] * a[i][k];
            cofactor_norm += cofactor[i][k] * cofactor[i][k];
        }
    }
    double det = a[0][0] * cofactor[0][0] + a[0][1] * cofactor[0][1] + a[0][2] * cofactor[0][2];
    double lambda = sqrt(3.0 * norm);
    // Newton's method from above.
    for (int n = 0; n < steps; n++) {
        double u = lambda * lambda - norm;
        double slope = 4.0 * lambda * u - 8.0 * det;
        if (!(slope > 0.0)) // a double root, reached exactly
            break;
        lambda -= (u * u - 8.0 * lambda * det - 4.0 * cofactor_norm) / slope;
    }
    // The rotation as a polynomial in A.
    double kappa = 0.5 * (lambda * lambda - norm), zeta = kappa * lambda - det;
    double gram[3][3]; // A^T A
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            gram[i][k] = a[0][i] * a[0][k] + a[1][i] * a[1][k] + a[2][i] * a[2][k];
    }
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            double cubed = a[i][0] * gram[0][k] + a[i][1] * gram[1][k] + a[i][2] * gram[2][k];
            r[i][k] = ((kappa + norm) * a[i][k] - cubed + lambda * cofactor[i][k]) / zeta;
        }
    }
    return (Foam){lambda, zeta};
}

bool rotation_foam(const double a[3][3], int steps, double rotation[3][3], double *trace)
{
    Foam result = foam(a, steps, rotation);
    *trace = result.trace;
    return result.zeta >= 0.1 * result.trace * result.trace * result.trace && result.zeta > 0.0;
}

// R <- R (3 - R^T R) / 2 keeps the singular vectors and squares the distance from a rotation.
// Returns that distance before the step.
static double orthogonalise(double r[3][3])
{
    double out[3][3], gram[3][3], error = 0.0;
    // How far R^T R is from 1, then one step of Newton and Schulz.
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            gram[i][k] = r[0][i] * r[0][k] + r[1][i] * r[1][k] + r[2][i] * r[2][k];
            error = fmax(error, fabs(gram[i][k] - (i == k ? 1.0 : 0.0)));
        }
    }
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            out[i][k] = 1.5 * r[i][k] -
                        0.5 * (r[i][0] * gram[0][k] + r[i][1] * gram[1][k] + r[i][2] * gram[2][k]);
    }
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            r[i][k] = out[i][k];
    }
    return error;
}

static void to_matrix(Quat q, double r[3][3])
{
    r[0][0] = 1.0 - 2.0 * (q.y * q.y + q.z * q.z);
    r[0][1] = 2.0 * (q.x * q.y - q.w * q.z);
    r[0][2] = 2.0 * (q.x * q.z + q.w * q.y);
    r[1][0] = 2.0 * (q.x * q.y + q.w * q.z);
    r[1][1] = 1.0 - 2.0 * (q.x * q.x + q.z * q.z);
    r[1][2] = 2.0 * (q.y * q.z - q.w * q.x);
    r[2][0] = 2.0 * (q.x * q.z - q.w * q.y);
    r[2][1] = 2.0 * (q.y * q.z + q.w * q.x);
    r[2][2] = 1.0 - 2.0 * (q.x * q.x + q.y * q.y);
}

// Uses the largest of the four components, whose square is at least 1/4.
static Quat to_quat(const double r[3][3])
{
    double square[4] = {r[0][0] + r[1][1] + r[2][2], r[0][0] - r[1][1] - r[2][2],
                        r[1][1] - r[0][0] - r[2][2], r[2][2] - r[0][0] - r[1][1]};
    // The largest component is divided by: it is at least 1/2.
    int largest = 0;
    for (int i = 1; i < 4; i++) {
        if (square[i] > square[largest])
            largest = i;
    }
    double w = r[2][1] - r[1][2], y = r[0][2] - r[2][0], z = r[1][0] - r[0][1];
    double xy = r[0][1] + r[1][0], xz = r[0][2] + r[2][0], yz = r[1][2] + r[2][1];
    double s = 1.0 + square[largest];
    switch (largest) {
    case 0:
        return quat_unit((Quat){s, w, y, z});
    case 1:
        return quat_unit((Quat){w, s, xy, xz});
    case 2:
        return quat_unit((Quat){y, xy, s, yz});
    default:
        return quat_unit((Quat){z, xz, yz, s});
    }
}

// Returns the quaternion q with the largest q^T K q = tr(R(q)^T A) (Davenport; Horn 1987). Where
// several eigenvalues are the largest to rounding, projects `last` on their space.
static Quat davenport(const double a[3][3], Quat last)
{
    // The quaternion of the best rotation is the eigenvector of the largest eigenvalue.
    double k[4][4] = {
        {a[0][0] + a[1][1] + a[2][2], a[2][1] - a[1][2], a[0][2] - a[2][0], a[1][0] - a[0][1]},
        {a[2][1] - a[1][2], a[0][0] - a[1][1] - a[2][2], a[0][1] + a[1][0], a[0][2] + a[2][0]},
        {a[0][2] - a[2][0], a[0][1] + a[1][0], a[1][1] - a[0][0] - a[2][2], a[1][2] + a[2][1]},
        {a[1][0] - a[0][1], a[0][2] + a[2][0], a[1][2] + a[2][1], a[2][2] - a[0][0] - a[1][1]},
    };
    double v[4][4], start[4] = {last.w, last.x, last.y, last.z}, q[4] = {0.0, 0.0, 0.0, 0.0};
    jacobi_diagonalise(4, k, v);
    int best = 0;
    double norm = 0.0, length = 0.0;
    for (int i = 0; i < 4; i++) {
        norm = fmax(norm, fabs(k[i][i]));
        if (k[i][i] > k[best][best])
            best = i;
    }
    // A mixture of eigenvectors whose values differ by d leaves a moment of d: stay near rounding.
    for (int i = 0; i < 4; i++) {
        if (k[i][i] < k[best][best] - 64.0 * DBL_EPSILON * norm)
            continue;
        double part = 0.0;
        for (int c = 0; c < 4; c++)
            part += v[c][i] * start[c];
        for (int c = 0; c < 4; c++)
            q[c] += part * v[c][i];
        length += part * part;
    }
    if (length < 1e-16) // `last` is orthogonal to all of them: any will do
        return quat_unit((Quat){v[0][best], v[1][best], v[2][best], v[3][best]});
    return quat_unit((Quat){q[0], q[1], q[2], q[3]});
}

void rotation_fit(const double a[3][3], double rotation[3][3], Quat *last)
{
    double largest = 0.0, b[3][3];
    bool finite = true;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            finite = finite && isfinite(a[i][k]);
            largest = fmax(largest, fabs(a[i][k]));
        }
    }
    Quat start = isfinite(last->w) && isfinite(last->x) && isfinite(last->y) && isfinite(last->z)
                     ? quat_unit(*last)
                     : (Quat){1.0, 0.0, 0.0, 0.0};
    *last = start;
    to_matrix(start, rotation);
    if (!finite || largest == 0.0)
        return;
    // Scaling by a power of two brings entries to 1, exactly: their fourth powers must stay in
    // range.
    int exponent;
    frexp(largest, &exponent);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            b[i][k] = ldexp(a[i][k], -exponent);
    }
    double r[3][3];
    Foam result = foam((const double(*)[3])b, 12, r);
    // Newton's error halves until it is below the distance of the two largest roots, then squares:
    // twelve steps are enough above this limit, and the orthogonality error shows whether they
    // were.
    bool fits = result.zeta > 0.01 * result.trace * result.trace * result.trace &&
                orthogonalise(r) < 1e-6 && orthogonalise(r) < 1e-10;
    if (fits) {
        for (int i = 0; i < 3; i++) {
            for (int k = 0; k < 3; k++)
                rotation[i][k] = r[i][k];
        }
        *last = to_quat((const double(*)[3])r);
        return;
    }
    // Near flat and inverted states: the eigenvector is exact.
    *last = davenport((const double(*)[3])b, start);
    to_matrix(*last, rotation);
}
