// SPDX-License-Identifier: MIT
// Interface of the spring kernel: what one evaluation of all forces reads and writes. The kernel is
// one source (kernel/spring_kernel.c), compiled for each precision and instruction-set level.
// Additions keep one order at every width and nothing is contracted, so that all levels of a
// precision are bit-identical.
//
// Double precision stores positions. Single precision stores displacements u = x - X, so that
// rounding is relative to the deformation and not to the distance from the origin: a spring's
// extension is ((2 e + du) . du + |e|^2 - r^2) / (l + r) with its rest vector e
// (server/PERFORMANCE.md, "Displacements in single precision"). X may follow the rigid motion of
// the body (BaseFrame in rows.h); the kernel works in those coordinates.
#ifndef PLIANT_SURFACE_KERNEL_H
#define PLIANT_SURFACE_KERNEL_H

#include "base/isa.h"
#include "body/integrator.h"
#include "body/relaxation.h"
#include "body/rows.h"
#include "body/stiffening.h"

#include <stdbool.h>

enum { LANES = 16 }; // nodes per chunk

// Real is float or double below, depending on the kernel's precision.

// The springs of all chunks. Chunk c has the entries start[c] .. start[c + 1), LANES springs each.
typedef struct SpringTable {
    int chunk_count;
    int *start;        // [chunk_count + 1]
    int *end;          // [chunk_count] end of a chunk's entries
    int *own;          // scattered only: [chunk][LANES] slot of the rows of a lane
    int *neighbour;    // [entry][LANES] slot of the other end; padding refers to its own node, but
                       // of a node inside the wall of a cavity to its first neighbour
    void *rest_length; // Real [entry][LANES] r [m]
    void *stiffness;   // Real [entry][LANES] k_s [N/m]; 0 for padding
    void *rest_vector; // single: Real [entry][3][LANES] e = X_own - X_other [m]
    void
        *inverse; // springs that stiffen: Real [entry][LANES] law_root / (s r) [1/m]; 0 for padding
    void *preload; // single with prestress: Real [entry][LANES] |e|^2 - r^2 [m2]
} SpringTable;

// Constants of a chunk's own nodes, by slot unless noted.
typedef struct NodeTable {
    void *inverse_mass; // Real [1/kg]; 0: fixed
    void *rest; // Real [chunk][3][LANES] [m]; double: rest position of the virtual node; single:
                // its arm from the frame's rest centre (scattered: its rest position),
                // SHAPE_FRAME_BODY only
    void *shape_rate; // Real k'_s / m [1/s2]; 0: fixed
    void *shape_drag; // Real k'_d / m [1/s], relative to the frame's velocity or along the spring
                      // (shape_drag_is_apart); 0: fixed
    void *drag;       // Real gamma / m (and k'_d / m, unless apart) [1/s]; 0: fixed
} NodeTable;

// The numbers of a hinge: k [N m], the angle at rest [rad], twice 1 / (the square of twice the area
// of a face at rest) [1/m4], and, in single precision, the rest vectors from the first node to the
// others [m].
enum { HINGE_STIFFNESS, HINGE_ANGLE, HINGE_FADE, HINGE_REST = HINGE_FADE + 2, HINGE_VECTORS = 9 };

// Hinges between faces (bending.h), LANES to a group.
typedef struct HingeTable {
    int values;  // per hinge: HINGE_REST, in single precision HINGE_VECTORS more
    int *slot;   // [group][4][LANES] both ends of the edge, the third nodes of its left and right
                 // face; padding: one node four times
    void *value; // Real [group][values][LANES]
} HingeTable;

// One pass over the groups of hinges that are listed, by one thread.
typedef struct BendPass {
    const HingeTable *hinges;
    const int *group; // [group_count]
    int group_count;
    const void *present; // Real rows to be evaluated
    void *force; // Real rows, x y z 0 and four unused numbers, to which forces are added [N]
    double damping_time; // of the springs, scaled [s]
} BendPass;

typedef void BendKernel(const BendPass *pass);

// Measures LANES hinges: Real angle[LANES] [rad] and squares[2][LANES] of twice the areas of both
// faces [m4] from Real vectors[HINGE_VECTORS][LANES], in the arithmetic of a BendKernel, so that
// bodies at rest feel no force.
typedef void BendMeasureKernel(const void *vectors, void *angle, void *squares);

// Writes what the springs' kernel reads as external forces: Real to[chunk][3][LANES] becomes
// `scale` times the rows of forces, plus `external`, unless NULL.
typedef void BendGatherKernel(const void *force, double scale, const void *external,
                              int chunk_count, void *to);

// What a pass needs of a cavity (cavity.h), and returns of its volume.
typedef struct CavityPass {
    double pressure;   // above that outside [Pa]
    const void *place; // single: Real [chunk][3][LANES] rest positions [m]
    // Real [chunk][LANES] what each node adds to the volume of the rows evaluated, and to its
    // change up to the rows written [m3]; NULL: not wanted.
    void *volume, *change;
} CavityPass;

// The classes of kernels, each of which serves bodies of those above it, more slowly: linear
// springs, with damping, springs that relax or stiffen, walls around a cavity.
typedef enum SpringClass {
    SPRINGS_PLAIN,
    SPRINGS_DAMPED,
    SPRINGS_LAW,
    SPRINGS_CAVITY, // linear or not
    SPRING_CLASSES
} SpringClass;

typedef struct SpringStiffening {
    double strain; // s
    StiffeningCurve curve;
    double knee; // strain from which on the pull is a straight line, s sqrt(q_c)
} SpringStiffening;

// One pass over the chunks first_chunk to last_chunk - 1.
typedef struct SpringPass {
    int first_chunk, last_chunk;
    const SpringTable *springs;
    const NodeTable *nodes;
    const void *present;    // Real rows to be evaluated
    const void *base;       // Real rows at the start of the substep (EVALUATION_RK4_MIDDLE)
    void *sum;              // Real [chunk][6][LANES] (RK4)
    void *next;             // Real rows written; never `present`
    const void *external;   // Real [chunk][3][LANES] external forces [N]; NULL: none
    const FramePose *frame; // SHAPE_FRAME_BODY: the motion that the virtual nodes follow
    Evaluation evaluation;
    double h;            // substep [s]
    double damping_time; // k_d / k_s, scaled [s]
    double stiffness_scale;
    double gravity[3];
    RelaxationPass relaxation; // laws that relax: extensions by entry [m]
    SpringStiffening stiffening;
    double position_limit; // a row longer than this counts as bad [m]
    const int *chunk; // scattered only: the chunks to process; first and last chunk are indices
                      // into this list
    // Scattered only: rows of forces that are transferred from hanging nodes, and those of hinges,
    // Real x y z 0 and four unused numbers [N]; those of hanging nodes are written by the `sum`
    // kernels.
    void *handed;
    const unsigned char *carries; // [chunk] true if any of its nodes receives such a force
    const CavityPass *cavity;     // SPRINGS_CAVITY only
    bool *bad; // set, never cleared, when the row of a completed substep is not finite or out of
               // bounds
} SpringPass;

typedef void SpringKernel(const SpringPass *pass);

// How virtual nodes move, and which part of a node's velocity is damped; selects the kernel
// variant.
typedef enum ShapeVariant {
    SHAPE_FRAME_NONE,
    SHAPE_FRAME_WORLD,
    SHAPE_FRAME_BODY,
    SHAPE_FRAME_WORLD_RADIAL, // damped along the spring only (eq 10 as printed)
    SHAPE_VARIANTS
} ShapeVariant;

// True if virtual nodes are fixed in the world.
static inline bool shape_stands(ShapeVariant shape)
{
    return shape == SHAPE_FRAME_WORLD || shape == SHAPE_FRAME_WORLD_RADIAL;
}

// True if the damping of shape springs is not simply a drag on the node's velocity.
static inline bool shape_drag_is_apart(ShapeVariant shape)
{
    return shape == SHAPE_FRAME_BODY || shape == SHAPE_FRAME_WORLD_RADIAL;
}

// Moves positions (and nothing else) by dt with the current velocities: `next` from `present`.
typedef void DriftKernel(const void *present, void *next, int slot_count, double dt);

// The variants of one precision at one instruction-set level.
typedef struct SpringKernels {
    const char *level; // "x86-64-v4" ...
    Precision precision;
    SpringKernel *evaluate[SPRING_CLASSES][SHAPE_VARIANTS];
    // For bodies whose nodes are created and removed: process a list of chunks whose nodes may have
    // their rows anywhere; `sum` stores forces and moves nothing.
    SpringKernel *scattered[SPRING_CLASSES][SHAPE_VARIANTS];
    SpringKernel *sum[SPRING_CLASSES];
    double law_root;     // factor of SpringTable.inverse
    BendKernel *bend[2]; // [damped]
    BendMeasureKernel *bend_measure;
    BendGatherKernel *bend_gather;
    DriftKernel *drift;
} SpringKernels;

// Finds a level by name, the best one for "auto"; NULL if unknown or not runnable on this machine.
const SpringKernels *kernels_find(Precision precision, const char *level);

#endif
