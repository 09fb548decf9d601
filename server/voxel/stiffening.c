// SPDX-License-Identifier: MIT
#include "voxel/stiffening.h"

double stiff_residual(const StiffElement *element)
{
    // The mean, and the slope G = sum u (w M^-1 X)^T by columns.
    Vec3 mean = {0.0, 0.0, 0.0}, g[3] = {{0.0, 0.0, 0.0}};
    double total = 0.0, sum = 0.0;
    for (int i = 0; i < element->count; i++) {
        const Vec3 u = element->u[i], lever = element->lever[i];
        mean = vec3_madd(mean, element->weight[i], u);
        total += element->weight[i];
        g[0] = vec3_madd(g[0], lever.x, u);
        g[1] = vec3_madd(g[1], lever.y, u);
        g[2] = vec3_madd(g[2], lever.z, u);
    }
    mean = vec3_scale(1.0 / total, mean);
    for (int i = 0; i < element->count; i++) {
        const Vec3 x = element->rest[i];
        Vec3 e = vec3_sub(element->u[i], mean);
        e = vec3_madd(e, -x.x, g[0]);
        e = vec3_madd(e, -x.y, g[1]);
        e = vec3_madd(e, -x.z, g[2]);
        sum += element->weight[i] * vec3_dot(e, e);
    }
    return sum;
}

double stiff_q(const VoxelStiffening *stiffening, const ElementClass *by, const double f[3][3],
               const double r[3][3], double residual)
{
    double square = 0.0, trace = -3.0;
    for (int i = 0; i < 9; i++) {
        const double d = f[i / 3][i % 3] - r[i / 3][i % 3];
        square += d * d;
        trace += r[i / 3][i % 3] * f[i / 3][i % 3];
    }
    return (by->mu * square + 0.5 * by->lambda * trace * trace +
            0.5 * by->residual / by->size * residual) /
           element_energy_scale(by->mu, by->lambda, stiffening->strain);
}
