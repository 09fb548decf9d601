// SPDX-License-Identifier: MIT
// The voxel element of the textbook, to compare with: an array of structures, one element at a
// time, double precision, loops over matrices, an iterated polar decomposition, forces added to the
// vertices, then one semi-implicit Euler step. What one would write from Miyazaki et al. (2004),
// section 2.2, with the area vectors, Lame's constants and the damping of server/voxel/element.h,
// so that it does the same work as the server's kernels.
#ifndef PLIANT_TESTS_BENCH_VOXEL_TEXTBOOK_H
#define PLIANT_TESTS_BENCH_VOXEL_TEXTBOOK_H

typedef struct VoxelTextbookVertex {
    double x[3], v[3], f[3]; // [m], [m/s], [N]
    double mass;             // [kg]
    int fixed;               // does not move
} VoxelTextbookVertex;

typedef struct VoxelTextbookElement {
    int vertex[8];         // corners, x fastest
    double rest[8][3];     // X_i [m], from the middle
    double mu, lambda;     // [Pa]
    double residual;       // alpha k [N/m]
    double damping;        // beta k [N s/m]; 0: none
    double size;           // H [m]
    double rotation[3][3]; // of the step before; where the next search begins
} VoxelTextbookElement;

typedef struct VoxelTextbook {
    int vertex_count, element_count;
    VoxelTextbookVertex *vertex;   // owned
    VoxelTextbookElement *element; // owned
    double gravity[3];             // [m/s2]
} VoxelTextbook;

// Cubes of edge `size` [m] at rest: `position` are rest places [n][3], `velocity` [n][3] or NULL,
// `element` corners [m][8], x fastest; youngs_modulus [Pa], density [kg/m3], beta [s]. Poisson's
// ratio `nu` sets lambda and the residual's factor (1 + nu) / 3. Masses are an eighth of each
// cube's.
void voxel_textbook_create(VoxelTextbook *textbook, int vertex_count, const double (*position)[3],
                           const double (*velocity)[3], int element_count, const int (*element)[8],
                           double size, double youngs_modulus, double nu, double density,
                           double beta);
void voxel_textbook_destroy(VoxelTextbook *textbook);

// Forces of all elements into the vertices; what a step begins with.
void voxel_textbook_forces(VoxelTextbook *textbook);
// One step of semi-implicit Euler of dt seconds.
void voxel_textbook_step(VoxelTextbook *textbook, double dt);

#endif
