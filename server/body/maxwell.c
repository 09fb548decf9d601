// SPDX-License-Identifier: MIT
#include "body/maxwell.h"

static const double PI = 3.14159265358979323846;

double maxwell_rigidity(int count, const MaxwellBranch *branch)
{
    double left = 1.0;
    for (int i = 0; i < count; i++)
        left -= branch[i].share;
    return 1.0 / left;
}

// With e_k the stiffness of branch k over that of the elastic law and x = 2 pi f time_k,
//   loss = sum e_k x / (1 + x^2) / (1 + sum e_k x^2 / (1 + x^2)):
// linear in e at each frequency. Branches a decade apart overlap, and are fitted between their
// peaks: from 1 to 100 Hz a loss factor of 0.1 varies by 8 %, one of 0.2 by 11 %.
bool maxwell_of_loss(double loss, MaxwellBranch branch[MAXWELL_BRANCHES])
{
    static const double HZ[MAXWELL_BRANCHES] = {1.0, 10.0, 100.0}, AT[] = {2.0, 10.0, 50.0};
    enum { N = MAXWELL_BRANCHES };
    double a[N][N + 1], left = 1.0;
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < N; k++) {
            const double x = AT[i] / HZ[k];
            a[i][k] = (x - loss * x * x) / (1.0 + x * x);
        }
        a[i][N] = loss;
    }
    // Gauss, without pivots: the diagonal is the largest.
    for (int i = 0; i < N; i++)
        for (int row = 0; row < N; row++) {
            const double by = a[row][i] / a[i][i];
            for (int k = i; k <= N && row != i; k++)
                a[row][k] -= by * a[i][k];
        }
    for (int k = 0; k < N; k++)
        left += a[k][N] / a[k][k];
    for (int k = 0; k < N; k++) {
        const double e = a[k][N] / a[k][k];
        branch[k] = (MaxwellBranch){1.0 / (2.0 * PI * HZ[k]), e / left, true};
        if (!(e >= 0.0) || !(e < 1e3))
            return false;
    }
    return true;
}

double maxwell_loss(int count, const MaxwellBranch *branch, double damping_time, double hz)
{
    const double omega = 2.0 * PI * hz, rigidity = maxwell_rigidity(count, branch);
    double loss = omega * damping_time, storage = 1.0;
    for (int k = 0; k < count; k++) {
        const double x = omega * branch[k].time, e = branch[k].share * rigidity;
        loss += e * x / (1.0 + x * x);
        storage += e * x * x / (1.0 + x * x);
    }
    return loss / storage;
}
