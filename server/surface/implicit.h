// SPDX-License-Identifier: MIT
// Private to the surface module: the theta method with one Newton step, for bodies too stiff for
// explicit steps (README.md, "Implicit step"). With h the step, h_ = theta h, and at the current
// state the forces f, K = -df/dx and C = -df/dv,
//
//     (M + h_ C + h_^2 K) dv = h (f - h_ K v),    x += h (v + theta dv),    v += dv
//
// K_e = k ((1 - L/l)_+ I + (1 - (1 - L/l)_+) n n^T) of a spring drops the negative term across a
// compressed one, so that the matrix is positive definite in any state (Choi and Ko 2002); C_e =
// k_d n n^T. Shape springs and node damping are diagonal. With frame = "body" K v uses v relative
// to the frame's motion, and the momentum that the diagonal then removes is restored
// (kernel/implicit_kernel.c). Hanging nodes are not unknowns: before each product their rows are
// set to the means of their masters, and afterwards half of their product goes to each master.
//
// Conjugate gradients with the inverses of the diagonal 3 x 3 blocks solve the system, matrix free:
// a spring is one vector g, with g g^T its stiffness along it, and one number a, with a I its
// stiffness across. A hinge (bending.h) is its gradient at four nodes, with the root of its
// stiffness for length; how the gradient itself turns is left out. The solver would find the rigid
// motion last; it is corrected separately before the solve (so that only deformation is left to
// solve for, and nothing in free fall) and after it. All this runs in double precision, on one
// thread, from the state alone, and is therefore deterministic. theta is 1 for a step in which
// springs change by more than their length, or gain more energy by turning than the motion has.
//
// External forces (contacts, attachments) are not in the matrix. They are evaluated at x + h_ v,
// like the forces of the step, and are stable as in explicit steps (time_step.c).
#ifndef PLIANT_SURFACE_IMPLICIT_H
#define PLIANT_SURFACE_IMPLICIT_H

#include "surface/model.h"

#define IMPLICIT_THETA     0.55
#define IMPLICIT_TOLERANCE 1e-2
// Longest damping time, in steps. With a damper so strong that springs take many steps to return,
// the stretch of each turn (kernel/implicit_assemble.h) adds up to energy from nothing.
#define IMPLICIT_DAMPING 1.0
enum { IMPLICIT_ITERATIONS = 50 };

// Components x y z of a node; the fourth is zero or has a meaning of its own.
typedef double Quad __attribute__((vector_size(4 * sizeof(double))));

// A symmetric 3 x 3 matrix, by columns.
typedef struct Block {
    Quad column[3];
} Block;

struct Implicit;

// The functions of kernel/implicit_kernel.c for one instruction-set level.
typedef struct ImplicitKernel {
    // Builds the matrix, and the right-hand side in `residual`.
    void (*assemble)(SurfaceModel *model);
    // Solves for `change` from `residual`. False: the numbers are not finite.
    bool (*solve)(struct Implicit *system);
    // Adds to `change` the rigid motion of each island that gives it the momentum of the external
    // forces.
    void (*restore_momentum)(struct Implicit *system);
} ImplicitKernel;

typedef struct Implicit {
    // --- constant ---
    const ImplicitKernel *kernel;
    double theta, tolerance;
    int iterations;
    bool anchored; // virtual nodes are fixed in the world
    int edge_capacity;

    // --- of one step: rebuilt in each ---
    double h;
    double share; // theta of this step: 1 when the motion is violent (kernel/implicit_assemble.h)
    bool violent; // if so, floating islands turn on a circle
    const double *rows;   // at the start of the step
    int moving, hanging;  // nodes: numbers 0 .. moving - 1, then up to moving + hanging - 1; the
                          // next number stands for all fixed nodes
    int *number;          // [slots] number of a slot
    int *slot;            // [nodes] slot of a number
    int (*master)[2];     // [nodes] numbers of the masters of moving + i: finest level first
    unsigned char *frame; // [nodes] of pieces with their own rigid motion, else NULL
    int edge_count;
    Quad *spring;  // [edge_capacity] g and a, of h_^2 K + h_ C
    int (*end)[2]; // [edge_capacity] numbers

    int hinge_count;
    Quad (*hinge)[4]; // [hinge capacity] G of its nodes, whose products with one another are its
                      // part of h_^2 K + h_ C; NULL: no bending
    int (*corner)[4]; // [hinge capacity] numbers

    // by number
    Quad *outer;     // external forces, gravity included, and damping [N]
    double *inertia; // m + h_ gamma [kg]
    double *weight;  // of the diagonal without springs: inertia and shape springs [kg]
    Block *inverse;  // of the diagonal blocks [1/kg]
    Quad *change;    // dv [m/s]
    Quad *residual, *step, *product, *search;

    // --- islands: sets of nodes that share momentum (kernel/implicit_kernel.c) ---
    int island_count;
    int *island;       // [nodes] island of a moving node
    int *member;       // [nodes] moving nodes sorted by island
    int *island_start; // [nodes + 1]
    bool *held;        // [nodes] true if an island has a fixed node
    int *stamp;        // [pieces] scratch
    Block *resistance; // [nodes] anchored bodies: resistance of an island's springs to a rotation
                       // [kg m2]

    // --- statistics; not part of the state ---
    int64_t steps, iterations_done, stopped; // stopped: before the tolerance was reached
} Implicit;

// Returns theta of the options, or the default.
double implicit_theta(const SurfaceOptions *options);
// Load time, after the rest of the body exists.
void implicit_create(SurfaceModel *model, const SurfaceOptions *options, Arena *arena);
// The operations that differ from those of explicit steps.
void implicit_drift(void *self, double dt);
void implicit_evaluate(void *self, const Evaluation *evaluation, double h);
// Prints one line for --explain.
void implicit_explain(const Implicit *system, FILE *out);

#endif
