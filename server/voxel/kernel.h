// SPDX-License-Identifier: MIT
// Interface of the element kernels: batches of 16 elements of one kind, and what one evaluation of
// all forces reads and writes. The kernel is one source (kernel/voxel_kernel.c), compiled for each
// precision and instruction-set level. Additions keep one order at every width and nothing is
// contracted, so that all levels of a precision are bit-identical.
//
// Rows hold displacements u from the rest position, in the body's base frame, in both precisions:
// an element's deformation is F = 1 + (1/V) sum u_i a_i^T, so that rounding is relative to the
// deformation and not to the distance from the origin.
#ifndef PLIANT_VOXEL_KERNEL_H
#define PLIANT_VOXEL_KERNEL_H

#include "base/isa.h"
#include "body/relaxation.h"
#include "body/rows.h"
#include "body/stiffening.h"
#include "voxel/element.h"

#include <stdbool.h>
#include <stdint.h>

enum { LANES = 16 }; // elements per batch

// Real is float or double below, depending on the kernel's precision.

// Parameters that all elements of a batch share, for their rest shape scaled to H. Those of a
// partly filled element are averages over its whole cube: they have the share as a factor, which
// the area vectors of its table are divided by.
typedef struct ElementClass {
    double size;     // H [m]
    double mu;       // [Pa]
    double lambda;   // [Pa]
    double residual; // alpha k, k = mu H [N/m]; for the paper's law k, and mu and lambda are unused
    double damping;  // beta k [N s/m]; 0: none
    double share;    // of the cube that is solid: its stress is larger by 1 / share
} ElementClass;

// Cubes with 8 corners and no other vertex. Batches of one class are consecutive; unused lanes of a
// class's last batch hold the spare vertex eight times.
typedef struct PlainBatches {
    int batch_count;
    const int *vertex;        // [batch][8][LANES], corners as in template.h
    const int *element_class; // [batch]
} PlainBatches;

// Elements with hanging vertices.
typedef struct HangingBatches {
    int batch_count;
    const int *start;  // [batch + 1] first row of a batch in `vertex`
    const int *vertex; // [rows][LANES]; lanes with fewer vertices are padded with the spare one
    const int *table;  // [batch] index into VoxelPass.tables
    const int (*element_class)[LANES]; // [batch]
} HangingBatches;

// Rest shapes of a batch, for one law and precision, made by template.h: Real [TABLE_HEAD], then
// [count][TABLE_ROW], each for every lane or once for all.
enum {
    TABLE_HEAD = 8, // sum w, 1 / sum w; Miyazaki's law: A at rest minus 1, as xx yy zz yz zx xy
    TABLE_ROW = 10, // a / share x y z; w; X x y z; w M^-1 X x y z
};
typedef struct RestTable {
    int count;  // vertices
    int stride; // between numbers: LANES or 1
    const void *number;
} RestTable;

// The law of a body that stiffens (README.md, "Stiffening").
typedef struct VoxelStiffening {
    double strain; // s
    StiffeningCurve curve;
} VoxelStiffening;

typedef struct VoxelPass {
    const PlainBatches *plain;
    const HangingBatches *hanging;
    const RestTable *tables; // for the law
    const ElementClass *classes;
    VoxelLaw law;
    bool damped;
    bool viscous;     // damped: by beta K, if the law is affine; else by beta k alone
    const void *rows; // Real [vertex][ROW]: u [m] and velocity [m/s] in the base frame
    void *force;      // Real [vertex][4] [N]; added to
    // Quaternions w x y z [plain batches, then hanging ones][LANES]: an element's rotation when it
    // was last too flat or inverted for the fast path; only such elements write it. Part of the
    // state.
    double (*last)[LANES][4];
    // stiffness_scale multiplies all forces, damping included (which is beta k); damping_scale only
    // damping.
    double stiffness_scale, damping_scale;
    const VoxelStiffening *stiffening; // affine law; NULL: linear
    RelaxationPass relaxation; // affine law: strains as xx yy zz yz zx xy, hanging batches last
} VoxelPass;

typedef void VoxelKernel(const VoxelPass *pass);
// Returns the elastic energy of all elements [J]; `force` is not used, and nothing is changed.
typedef double VoxelEnergy(const VoxelPass *pass);

// Finds the elements with more stress than `limit` [Pa]: sets bit `lane` of high[batch], hanging
// batches after the plain ones, where |P| > limit (Frobenius norm of the nominal stress, scales
// included), and for elements too flat or inverted for the fast path, and crushed ones. `force` and
// `last` are not used, and nothing is changed.
typedef void VoxelStress(const VoxelPass *pass, double limit, uint16_t *high);

typedef struct VoxelKernels {
    const char *level;
    Precision precision;
    VoxelKernel *evaluate;
    VoxelEnergy *energy;
    VoxelStress *stress;
} VoxelKernels;

// Finds the kernels of a level; NULL if it was not compiled in or does not run on this machine.
const VoxelKernels *voxel_kernels_find(Precision precision, const char *level);

#endif
