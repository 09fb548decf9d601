#include "voxel/jacobi.h"

#include <float.h>
#include <math.h>

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
