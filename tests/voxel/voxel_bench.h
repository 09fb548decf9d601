// SPDX-License-Identifier: MIT
// A voxel body put together from the readable parts alone (layout, mesh, templates and element.h),
// in double precision: what tests of statics and dynamics ask of the model, and what the real body
// is compared with.
#ifndef PLIANT_TESTS_VOXEL_BENCH_H
#define PLIANT_TESTS_VOXEL_BENCH_H

#include "voxel/element.h"
#include "voxel/lattice_mesh.h"
#include "voxel/layout.h"
#include "voxel/template.h"

#include <stdint.h>

typedef struct VoxelBenchOptions {
    int levels;
    // Elements of this level also at the surface, partly filled, by voxel_coarse.h in place of the
    // layout and mesh of the server; `levels` has no effect, surface_count is 0. 0: none.
    int coarse;
    // True if a block may be one element; NULL: all may.
    bool (*may_be_coarse)(const int cell[3], int level);
    VoxelLaw law;
    // VOXEL_MIYAZAKI2004: weights of 1, as the paper has them, and k so that tr M = 6 H^2 as with
    // eight corners; otherwise those of the template.
    bool unit_weights;
    double youngs_modulus; // [Pa]
    double poisson_ratio;
    double density; // [kg/m3]
    double alpha;   // of the residual; 0: (1 + nu) / 3
    double damping; // beta in units of dt0
} VoxelBenchOptions;

// All elements of one template and level.
typedef struct VoxelBenchClass {
    int level;
    uint64_t solid[1 << (3 * 3 - 6)]; // its solid cells, if it may be partly filled
    Template shape;
    Vec3 rest[NODE_COUNT], area[NODE_COUNT]; // scaled to the size
    double weight[NODE_COUNT];
    Element element;
    ElementStiffness stiffness;
    double *matrix; // [3 count][3 count] stiffness at rest [N/m]
} VoxelBenchClass;

typedef struct VoxelBench {
    Lattice lattice;
    Layout layout;
    LatticeMesh mesh;
    int class_count;
    VoxelBenchClass *class;
    int *class_of;                            // [element]
    int element_count, vertex_count;          // as in the mesh
    Vec3 *rest, *position, *velocity, *force; // [vertex]; rest: lattice_point
    double *mass;                             // [vertex] [kg]
    Quat *last;                               // [element]
    double size;                              // of a cell [m]
    double mu, lambda;                        // [Pa]
    double critical_step;                     // dt0 [s]
} VoxelBench;

// Defaults: affine, nu 0, 10 kPa, 1000 kg/m3, no damping.
VoxelBenchOptions voxel_bench_options(int levels);
// Takes the lattice over.
void voxel_bench_create(VoxelBench *bench, Lattice *lattice, const VoxelBenchOptions *options);
void voxel_bench_box(VoxelBench *bench, int x, int y, int z, double size,
                     const VoxelBenchOptions *options);
// A random solid in a block of n^3 cells: a union of boxes and balls, joined through faces.
void voxel_bench_blob(VoxelBench *bench, int n, double size, uint64_t *random,
                      const VoxelBenchOptions *options);
void voxel_bench_destroy(VoxelBench *bench);

// Where an element's vertices are; count of them.
int voxel_bench_gather(const VoxelBench *bench, int element, const Vec3 *from, Vec3 *out);
// Sets `force` to that of the elements; returns their energy [J].
double voxel_bench_forces(VoxelBench *bench);
// One step of symplectic Euler of all vertices.
void voxel_bench_step(VoxelBench *bench, double dt);
double voxel_bench_kinetic(const VoxelBench *bench);
void voxel_bench_momentum(const VoxelBench *bench, Vec3 *linear, Vec3 *angular);
// Elements whose F = sum x a^T / V has no positive determinant.
int voxel_bench_inverted(const VoxelBench *bench);

// Statics. `fixed` and `load` are per vertex and axis, [3 vertex]; load [N] may be NULL.
// Displacements from rest under a small load; relative residual 1e-12.
void voxel_bench_solve_linear(VoxelBench *bench, const bool *fixed, const double *load,
                              Vec3 *displacement);
// Moves what is not fixed until forces balance to `tolerance` [N] (the largest), by Newton's method
// with each element's stiffness at rest turned as the element is. False: not reached.
bool voxel_bench_solve(VoxelBench *bench, const bool *fixed, const double *load, double tolerance);

#endif
