// SPDX-License-Identifier: MIT
// Interface of the plane kernels: what one evaluation of all forces reads and writes. The kernel is
// one source (server/plane/kernel/plane_kernel.c), compiled for each precision and instruction-set
// level; all levels of a precision are bit-identical: elements of a batch are computed side by side
// and added one after the other.
//
// Rows (body/rows.h) hold displacements u in the body's base frame; only x, y, vx and vy are
// used, the other numbers stay 0.
#ifndef PLIANT_PLANE_KERNEL_H
#define PLIANT_PLANE_KERNEL_H

#include "base/isa.h"
#include "body/rows.h"
#include "plane/shape.h"

enum { PLANE_LANES = 16 }; // elements per batch

// Real is float or double below, depending on the kernel's precision.

// Squares with four corners and no other vertex, in whole batches of one class; both laws coincide
// here (the paper's has alpha = 1 and nu = 0). Their common parameters, by class:
typedef enum PlaneSquareNumber {
    SQUARE_PLACE,    // half an edge [m]
    SQUARE_GRADIENT, // 1 / (2 edge) [1/m]
    SQUARE_SHEAR,    // mu t edge / 2 [N]: half of 2 mu, along half an edge
    SQUARE_TRACE,    // (mu + lambda) t edge / 2 [N]
    SQUARE_RESIDUAL, // per vertex, over four [N/m]
    SQUARE_DAMPING,  // per vertex [N s/m]
    SQUARE_NUMBERS,
} PlaneSquareNumber;

// All other elements have parameters of their own, per vertex
typedef enum PlaneNodeNumber {
    NODE_X,
    NODE_Y, // X_i from the mean [m]
    NODE_GRADIENT_X,
    NODE_GRADIENT_Y, // a_i / area [1/m]; the paper's law: 2 X_i / sum |X|^2
    NODE_SHARE,      // fraction of the mass
    NODE_RESIDUAL,   // of the vertex [N/m]; the paper's law: k
    NODE_PAPER_NUMBERS,
    NODE_AREA_X = NODE_PAPER_NUMBERS, // this and what follows: PLANE_AFFINE only
    NODE_AREA_Y,                      // a_i [m]
    NODE_LINEAR_X,
    NODE_LINEAR_Y, // share_i M^-1 X_i [1/m]
    NODE_NUMBERS,
} PlaneNodeNumber;

// and per element.
typedef enum PlaneWholeNumber {
    WHOLE_SHEAR,   // mu t [N/m]: half of 2 mu
    WHOLE_TRACE,   // (mu + lambda) t [N/m]
    WHOLE_DAMPING, // total [N s/m]
    WHOLE_SPREAD,  // 1e-12 of the square of its edge, for states without extent [m2]
    WHOLE_NUMBERS,
} PlaneWholeNumber;

// Unused lanes of the other elements hold the spare vertex. Constant after creation.
typedef struct PlaneBatches {
    int square_count;  // batches
    int *square;       // [batch][4][LANES] vertices by corner x + 2 y
    int *square_class; // [batch]
    void *class;       // Real [class][SQUARE_NUMBERS]
    int other_count;   // batches with one number of vertices each, 4 to 8
    int *start;        // [batch + 1] first row of a batch
    int *vertex;       // [row][LANES]
    void *node;        // Real [row][NODE_NUMBERS or NODE_PAPER_NUMBERS][LANES]
    void *whole;       // Real [batch][WHOLE_NUMBERS][LANES]
} PlaneBatches;

typedef struct PlanePass {
    const PlaneBatches *batches;
    PlaneLaw law;
    bool damped;
    const void *rows; // Real [vertex][ROW]
    void *force;      // Real [vertex][4]; x and y are added to
    double stiffness_scale, damping_scale;
} PlanePass;

typedef struct PlaneKernels {
    const char *level;
    Precision precision;
    void (*evaluate)(const PlanePass *pass);
} PlaneKernels;

// Finds kernels by level, the best ones for "auto"; NULL if unknown or not runnable on this
// machine.
const PlaneKernels *plane_kernels_find(Precision precision, const char *level);

#endif
