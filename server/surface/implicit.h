// Private to the surface room: the theta method with one Newton step (surface.md section 3), for
// bodies too stiff for explicit steps. With h the step, h_ = theta h, and at the present state the
// forces f, K = -df/dx and C = -df/dv,
//
//     (M + h_ C + h_^2 K) dv = h (f - h_ K v),    x += h (v + theta dv),    v += dv
//
// K_e = k ((1 - L/l)_+ I + (1 - (1 - L/l)_+) n n^T) of a spring leaves out what is negative across
// a compressed one, so that the matrix is positive definite whatever the state (Choi and Ko 2002);
// C_e = k_d n n^T. Shape springs and node damping are diagonal; with frame = "body" K v takes v
// against the frame's motion, and what the diagonal then takes from the momentum is given back
// (kernel/implicit_momentum.h). Nodes that hang have no motion of their own: their rows are the
// masters' middles before each product, and the product's go half and half to them.
//
// The system is solved by conjugate gradients with the inverses of the diagonal 3 x 3 blocks,
// matrix free: a spring is kept as one vector g, g g^T its share along it, and one number a, a I
// its share across. A solver that stops early leaves a body slower than it should be, not wilder;
// its rigid motion, which would come last, is made right apart. All in double precision, on one
// thread, from zero: the bits depend on the state alone. A step in which springs change by more
// than their length takes theta = 1.
//
// Forces from outside (contacts, attachments) are not in the matrix. They are evaluated at
// x + h_ v, where the step's forces are taken, and stay stable as explicit ones do (time_step.c).
#ifndef PLIANT_SURFACE_IMPLICIT_H
#define PLIANT_SURFACE_IMPLICIT_H

#include "surface/model.h"

#define IMPLICIT_THETA     0.55
#define IMPLICIT_TOLERANCE 1e-2
enum { IMPLICIT_ITERATIONS = 50 };

// Components x y z of a node, and one that is zero or says something else.
typedef double Quad __attribute__((vector_size(4 * sizeof(double))));

// Symmetric 3 x 3: its columns.
typedef struct Block {
    Quad column[3];
} Block;

struct Implicit;

// kernel/implicit_kernel.c, for one instruction-set level.
typedef struct ImplicitKernel {
    // The matrix, and the right side in `residual`.
    void (*assemble)(SurfaceModel *model);
    // `change` from `residual`. False: the numbers are not finite.
    bool (*solve)(struct Implicit *system);
    // Adds to `change` the rigid motion of each island that gives it the momentum that the forces
    // from outside ask for.
    void (*restore_momentum)(struct Implicit *system);
} ImplicitKernel;

typedef struct Implicit {
    // --- constant ---
    const ImplicitKernel *kernel;
    double theta, tolerance;
    int iterations;
    bool anchored; // its virtual nodes are fixed in the world
    int edge_capacity;
    const BodyOps *explicit_ops; // of the same body with another integrator

    // --- of the step: made anew in each ---
    double h;
    double share;         // its theta: 1 when the motion is violent (kernel/implicit_assemble.h)
    const double *rows;   // at its start
    int moving, hanging;  // nodes: numbers 0 .. moving - 1, and on to moving + hanging - 1;
                          // the next one stands for all that are fixed
    int *number;          // [slots]
    int *slot;            // [nodes] of a number
    int (*master)[2];     // [nodes] numbers, of moving + i: finest level first
    unsigned char *frame; // [nodes] of pieces with a rigid motion of their own, else NULL
    int edge_count;
    Quad *spring;  // [edge_capacity] g and a, of h_^2 K + h_ C
    int (*end)[2]; // [edge_capacity] numbers

    // by number
    Quad *outer;     // forces from outside, gravity too, and what damping takes [N]
    double *inertia; // m + h_ gamma [kg]
    double *weight;  // of the diagonal, springs left out: inertia and shape springs [kg]
    Block *inverse;  // of the diagonal blocks [1/kg]
    Quad *change;    // dv [m/s]
    Quad *residual, *step, *product, *search;

    // --- islands: what shares momentum (kernel/implicit_momentum.h) ---
    int island_count;
    int *island;       // [nodes] of a moving node
    int *member;       // [nodes] moving nodes by island
    int *island_start; // [nodes + 1]
    bool *held;        // [nodes] an island has a fixed node
    int *stamp;        // [pieces] scratch
    Block *resistance; // [nodes] anchored bodies: of an island's springs against a turn [kg m2]

    // --- figures; not part of the state ---
    int64_t steps, iterations_done, stopped; // stopped: before the tolerance was reached
} Implicit;

// --- implicit.c ---
double implicit_theta(const SurfaceOptions *options);
// Load time, after all else of the body: memory, and its operations.
void implicit_create(Body *body, const SurfaceOptions *options, Arena *arena);

// --- implicit_number.c ---
// Which nodes move and which hang; to which island each belongs.
void implicit_number(SurfaceModel *model);

#endif
