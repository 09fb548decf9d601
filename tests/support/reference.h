// SPDX-License-Identifier: MIT
// A plain mass-spring solver to compare the server with: textbook arrays and loops in double,
// written from the equations alone (Choi et al. 2005, eq 1, 2 and 10 with damping on the full
// vector or as printed; Horn 1987 for the best fit). It shares no code with the server, and builds
// its own edges, areas and masses.
#ifndef PLIANT_TESTS_REFERENCE_H
#define PLIANT_TESTS_REFERENCE_H

#include <stdbool.h>

typedef enum ReferenceShape {
    REFERENCE_NO_SHAPE,
    REFERENCE_WORLD,
    REFERENCE_BODY,
} ReferenceShape;

typedef enum ReferenceScheme {
    REFERENCE_RK4,
    REFERENCE_LEAPFROG,
    REFERENCE_SYMPLECTIC_EULER,
} ReferenceScheme;

typedef struct ReferenceOptions {
    bool uniform;                                          // the paper's values, else physical ones
    double youngs_modulus_2d, areal_density, damping_time; // [N/m], [kg/m2], [s]
    double spring_stiffness, spring_damping, node_mass;    // [N/m], [N s/m], [kg]
    double node_damping;                                   // gamma of eq 1 [N s/m]
    ReferenceShape shape;
    double angular_frequency, damping_ratio; // k' = m w^2, d' = 2 z w m
    bool radial;                             // REFERENCE_WORLD: eq 10 as printed
    bool per_node;                           // shape_stiffness, shape_damping instead
    double shape_stiffness, shape_damping;   // [N/m], [N s/m]
    double prestress;
    double gravity[3]; // [m/s2]
} ReferenceOptions;

typedef struct ReferenceSpring {
    int a, b;
    double rest_length, stiffness, damping;
} ReferenceSpring;

typedef struct Reference {
    int node_count, spring_count;
    ReferenceOptions options;
    ReferenceSpring *spring;
    double *area, *mass, *shape_stiffness, *shape_damping; // [node_count]
    bool *fixed;                                           // [node_count], set by the test
    double (*load)[3];                                     // [node_count], set by the test [N]
    double (*rest)[3], (*x)[3], (*v)[3];                   // [node_count]
} Reference;

// The rigid motion that fits best: x = center + rotation (X - rest_center), weights k'.
typedef struct ReferenceFrame {
    double center[3], rest_center[3], velocity[3], angular[3], rotation[3][3];
} ReferenceFrame;

// At rest: x is the rest shape, v is zero. All arrays are owned by the reference.
void reference_create(Reference *reference, int node_count, const double (*position)[3],
                      int triangle_count, const int (*triangle)[3],
                      const ReferenceOptions *options);
void reference_destroy(Reference *reference);

// Spring forces alone [N], and their sizes summed (what rounding errors are relative to).
void reference_spring_forces(const Reference *reference, const double (*x)[3], const double (*v)[3],
                             double (*force)[3], double *scale);
// Accelerations of eq 1 [m/s2]; zero for fixed nodes.
void reference_accelerations(const Reference *reference, const double (*x)[3], const double (*v)[3],
                             double (*acceleration)[3]);
// Energy of springs and shape-preserving springs, with the best fit for REFERENCE_BODY [J].
double reference_elastic_energy(const Reference *reference, const double (*x)[3]);
double reference_kinetic_energy(const Reference *reference);
void reference_fit(const Reference *reference, const double (*x)[3], const double (*v)[3],
                   ReferenceFrame *frame);

// One step of h seconds.
void reference_step(Reference *reference, ReferenceScheme scheme, double h);

// Largest eigenvalue of M^-1 K at the rest shape, with its fixed nodes, by `iterations` of power
// iteration [1/s2]. `mode` (or NULL) receives the eigenvector, largest component 1.
double reference_largest_eigenvalue(const Reference *reference, int iterations, double (*mode)[3]);

#endif
