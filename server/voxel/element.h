// SPDX-License-Identifier: MIT
// The elastic element, for any number of vertices at any positions: the reference in double
// precision against which the kernels are tested, and a readable form of what they do (README.md,
// "The element of the paper" and "The affine law").
#ifndef PLIANT_VOXEL_ELEMENT_H
#define PLIANT_VOXEL_ELEMENT_H

#include "base/vec.h"
#include "body/stiffening.h"

typedef enum VoxelLaw {
    VOXEL_AFFINE,       // area vectors for the uniform part, weighted residual for the rest
    VOXEL_MIYAZAKI2004, // the paper's force k w_i (R R0_i - r_i)
} VoxelLaw;

// Rest shape; the caller owns the arrays.
typedef struct Element {
    int count;
    const Vec3 *rest;     // X_i [m]
    const double *weight; // w_i > 0; only ratios matter
    const Vec3 *area;     // a_i [m2], sum 0, sum X_i a_i^T = volume * 1 (VOXEL_AFFINE)
    double volume;        // [m3]
} Element;

// Computes area vectors [m2] and volume [m3] of a polyhedron with outward triangles: a_i = a third
// of the area vectors of its triangles (exact for fields that are linear on each triangle).
void element_polyhedron(const Vec3 *position, int count, const int (*triangle)[3],
                        int triangle_count, Vec3 *area, double *volume);

typedef struct ElementStiffness {
    VoxelLaw law;
    double mu, lambda; // Lame's [Pa] (VOXEL_AFFINE)
    double residual;   // alpha k: stiffness of the residual (VOXEL_AFFINE), or k of the paper [N/m]
    double damping;    // beta k: damps the velocity without its rigid part [N s/m]
    // Instead of it, beta: damps all in proportion to its stiffness (VOXEL_AFFINE) [s].
    double damping_time;
    Stiffening stiffening; // VOXEL_AFFINE
} ElementStiffness;

// Returns c, the scale of the energy per volume of elements that stiffen [Pa], E s^2 / 2.
static inline double element_energy_scale(double mu, double lambda, double strain)
{
    return 0.5 * mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu) * strain * strain;
}

// Adds forces [N] to `force`; returns the energy [J]. velocity may be NULL (no damping). `last` as
// in rotation_fit.
double element_forces(const Element *element, const ElementStiffness *stiffness,
                      const Vec3 *position, const Vec3 *velocity, Quat *last, Vec3 *force);

#endif
