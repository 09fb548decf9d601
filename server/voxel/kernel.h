// The seam of the element kernels: batches of 16 elements of one kind, and what one evaluation of
// all forces reads and writes. The kernel is one source (kernel/voxel_kernel.c) compiled once for
// each precision and instruction-set level; additions keep one order at every width and nothing is
// contracted, so that every level of a precision gives the same bits.
//
// Rows hold displacements u from the rest place, in the body's base frame, in both precisions: an
// element's deformation is F = 1 + (1/V) sum u_i a_i^T, so that rounding is relative to the
// deformation and not to the place.
#ifndef PLIANT_VOXEL_KERNEL_H
#define PLIANT_VOXEL_KERNEL_H

#include "base/isa.h"
#include "base/precision.h"
#include "dynamics/rows.h"
#include "voxel/element.h"

#include <stdbool.h>
#include <stdint.h>

enum { LANES = 16 }; // elements in a batch

// Real below is float or double, by the kernel's precision.

// What all elements of a batch have in common, in the terms of their rest shape scaled to H.
typedef struct ElementClass {
    double size;     // H [m]
    double mu;       // [Pa]
    double lambda;   // [Pa]
    double residual; // alpha k, k = mu H [N/m]; k of the paper's law, which needs no mu and lambda
    double damping;  // beta k [N s/m]; 0: none
} ElementClass;

// Cubes with 8 corners and no other vertex. Batches of one class follow one another; lanes left
// over in a class's last batch hold the spare vertex eight times.
typedef struct PlainBatches {
    int batch_count;
    const int *vertex;        // [batch][8][LANES], corners as in template.h
    const int *element_class; // [batch]
} PlainBatches;

// Elements with hanging vertices: batches of one template, then mixed ones, made of what is left
// over of all templates (an organ has many, most of them of few elements).
typedef struct HangingBatches {
    int batch_count, mixed_count; // the last mixed_count are mixed
    const int *start;             // [batch + 1] of its rows of `vertex`
    const int *vertex;            // [rows][LANES]; lanes with fewer vertices end in the spare one
    const int *table;             // [batch] index into VoxelPass.tables
    const int (*element_class)[LANES]; // [batch]
} HangingBatches;

// Rest shapes of a batch, for one law and precision, made by tables.h: Real [TABLE_HEAD], then
// [count][TABLE_ROW]; of mixed batches each of these numbers is [LANES].
enum {
    TABLE_HEAD = 8, // sum w, 1 / sum w; Miyazaki's law: A at rest less 1, as xx yy zz yz zx xy
    TABLE_ROW = 10, // a x y z; w; X x y z; w M^-1 X x y z
};
typedef struct RestTable {
    int count; // vertices
    const void *number;
} RestTable;

typedef struct VoxelPass {
    const PlainBatches *plain;
    const HangingBatches *hanging;
    const RestTable *tables; // of the law
    const ElementClass *classes;
    VoxelLaw law;
    bool damped;
    const void *rows; // Real [vertex][ROW]: u and velocity in the base frame
    void *force;      // Real [vertex][4]; added to
    // Quaternions w x y z [plain batches, then hanging ones][LANES]: the rotation that an element
    // had when it was last too flat or inverted for the fast path. Written by those only. State.
    double (*last)[LANES][4];
    // The first multiplies all forces, also of damping (which is beta k); the second those alone.
    double stiffness_scale, damping_scale;
} VoxelPass;

typedef void VoxelKernel(const VoxelPass *pass);
// The elastic energy of all elements [J]; `force` is not used, and nothing is changed.
typedef double VoxelEnergy(const VoxelPass *pass);

// Which elements are under more stress than `limit` [Pa]: bit `lane` of high[batch], hanging
// batches after the plain ones, is set where |P| > limit (Frobenius norm of the nominal stress,
// scales included), and of elements too flat or inverted for the fast path. `force` and `last` are
// not used, and nothing is changed.
typedef void VoxelStress(const VoxelPass *pass, double limit, uint16_t *high);

// After all forces: v += h (f / m + g), u += advance h v, forces to zero. Vertices with inverse
// mass 0 stay. `next` may be `present`. Returns whether every |u| stays within position_limit and
// every |v| within the speed limit; if `check` is not set it may return true without having looked.
typedef struct AdvancePass {
    const void *present;      // Real [vertex][ROW]
    void *next;               // Real [vertex][ROW]
    void *force;              // Real [vertex][4]
    void *more;               // NULL, or forces to be added to these, likewise
    const void *inverse_mass; // Real [vertex] [1/kg]
    int vertex_count;         // with the spare one
    double h, advance;
    double gravity[3]; // in the base frame [m/s2]
    double position_limit;
    bool check;
} AdvancePass;

typedef bool AdvanceKernel(const AdvancePass *pass);
typedef void VoxelDrift(const void *present, void *next, int vertex_count, double dt);

typedef struct VoxelKernels {
    const char *level;
    Precision precision;
    VoxelKernel *evaluate;
    AdvanceKernel *advance;
    VoxelDrift *drift;
    VoxelEnergy *energy;
    VoxelStress *stress;
} VoxelKernels;

// NULL when that level was not compiled in or does not run here.
const VoxelKernels *voxel_kernels_find(Precision precision, const char *level);

#endif
