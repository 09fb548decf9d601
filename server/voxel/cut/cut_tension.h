// SPDX-License-Identifier: MIT
// Tension of the tissue at rest, which opens cuts (README.md, "Tension at rest"). An uncut body is
// in equilibrium with it, so it acts only where that was broken: from each side of a broken face a
// fibre runs into the tissue behind it, along the tension, to the next side that is free. A fibre
// pulls its points together with the tension times the area that it stands for. So its forces have
// no resultant and no moment in any state, and a potential.
//
// Step thread, except cut_tension_create.
#ifndef PLIANT_VOXEL_CUT_CUT_TENSION_H
#define PLIANT_VOXEL_CUT_CUT_TENSION_H

#include "voxel/cut/cut_carry.h"
#include "voxel/cut/cut_faces.h"

// A point of a fibre, on a face of a finest cell.
typedef struct TensionPoint {
    int vertex[4];   // of the face
    float weight[4]; // their shares; multiples of 2^-20, so that the sum is exactly 1
    double along[3]; // to the next point at rest [m], in the axes of the rows
    double pull;     // between the two [N]; 0: the fibre ends here
} TensionPoint;

typedef struct CutTension {
    const CutFaces *faces;
    const Vertices *vertices;
    CutCarry *carry;              // of a body that adapts, or NULL
    double size;                  // edge of a finest cell [m]
    int spacing;                  // most cells between two points of a fibre, where there is room
    const double *stress;         // [material] [Pa]
    const double (*direction)[3]; // [material] unit, in the axes of the rows
    const bool *all;              // [material] the same in all directions
    double most;                  // largest stress [Pa]
    // --- follows from the lattice and the squares ---
    int count, capacity;
    TensionPoint *point;
    int *carried, carried_count; // carried vertices of these points, some more than once
    int *leaf, leaf_count;       // their elements
} CutTension;

// Load time. Returns the tension of the materials, owned by the arena; NULL: they have none.
CutTension *cut_tension_create(const CutFaces *faces, CutCarry *carry, const VoxelMaking *making,
                               Arena *arena);
// Lists the fibres again, after squares or vertices have changed.
void cut_tension_follow(CutTension *tension);
// Adds the forces at `rows`, both as Vertices has them; `scale`: of the stiffness.
void cut_tension_add_forces(const CutTension *tension, const void *rows, void *force, double scale);
// Returns the potential of these forces, 0 at rest [J].
double cut_tension_energy(const CutTension *tension, const void *rows, double scale);
// Adds the tension of a material to the nominal stress P of an element with rotation R, both [3][3]
// [Pa].
void cut_tension_add_stress(const CutTension *tension, int material, double scale,
                            const double (*rotation)[3], double (*stress)[3]);

#endif
