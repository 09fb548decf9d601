#include "voxel/stiffness.h"

#include <math.h>

double voxel_critical_step(const SolidMaterial *material, double size)
{
    return size * sqrt(material->density * (1.0 - 2.0 * material->poisson_ratio) /
                       material->youngs_modulus);
}

// Returns k for the paper's unit weights: an element with hanging vertices then has the energy of
// one with 8 corners under the same uniform stretch, averaged over the axes.
static double paper_stiffness(const Template *shape, double mu, double edge)
{
    return mu * edge * 6.0 / template_spread(shape); // 8 corners of the unit cube: 6
}

// The largest eigenvalue of M^-1 K of a plain cube is max(4 (2 mu + 3 lambda), 8 alpha mu) / (rho
// H^2) (README.md, "Critical time step"); with hanging vertices it is at most twice that of its own
// cube (tests/voxel/test_voxel_bound.c: 1.81 with nu = 0, less with larger nu).
ElementBounds stiffness_of_element(VoxelLaw law, const SolidMaterial *material, double edge,
                                   const Template *shape, ElementClass *out)
{
    const double nu = material->poisson_ratio;
    const double mu = material->youngs_modulus / (2.0 * (1.0 + nu));
    const double lambda = 2.0 * mu * nu / (1.0 - 2.0 * nu), alpha = (1.0 + nu) / 3.0;
    *out = (ElementClass){.size = edge,
                          .mu = mu,
                          .lambda = lambda,
                          .residual = alpha * mu * edge,
                          .damping = mu * edge};
    const double mass = material->density * edge * edge * edge;
    double most = 8.0 * mu + 12.0 * lambda, rate = 8.0 * out->damping / mass;
    if (law == VOXEL_MIYAZAKI2004) {
        out->residual = out->damping = paper_stiffness(shape, mu, edge);
        rate = shape->count * out->residual / mass;
        most = rate * material->density * edge * edge;
    } else if (shape->mask != 0) {
        most *= 2.0, rate *= 2.0;
    }
    return (ElementBounds){
        .lambda = most / (material->density * edge * edge),
        .damping = rate,
        .step = voxel_critical_step(material, edge),
    };
}
