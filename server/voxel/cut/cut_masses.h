// The vertices of a cut body: those that come, masses by the elements around, and the momentum that
// divisions leave as it was. Step thread, but for cut_masses_create.
#ifndef PLIANT_VOXEL_CUT_CUT_MASSES_H
#define PLIANT_VOXEL_CUT_CUT_MASSES_H

#include "voxel/cut/cut_lattice.h"
#include "voxel/cut/template_cache.h"
#include "voxel/vertices.h"

typedef struct CutMasses {
    // --- constant ---
    const CutLattice *lattice;
    TemplateCache *templates;
    Vertices *vertices;
    VoxelLaw law;
    double size;        // of a cell [m]
    double middle[3];   // of the lattice, in cells: from where rows count
    const double *mass; // [level * materials + material - 1] of an element [kg]
    int material_count;
    const unsigned char *held; // [lattice point] bit s: what holds together with the cell in slot s
                               // there is fixed

    // --- follows from the lattice ---
    double (*share)[NODE_COUNT]; // [element - level_first[1]] of leaves: what of its mass the
                                 // vertex at a node bears [kg]

    // --- within a change ---
    int *touched;        // vertices
    int *group;          // [vertex] towards the lowest that shares a changed element with it; -1:
                         // not touched
    int *next, *last;    // [vertex] of the group; the last one of a group, by its lowest
    double *mass_before; // [vertex] of the touched
    int touched_count;
} CutMasses;

// After the constant ones: memory for the rest.
void cut_masses_create(CutMasses *masses, const char *name, Arena *arena);
// Rows, places and masses after changes of the lattice; `divided`: with divisions among them, after
// which the momentum of the vertices around is put right: linear and angular, of each group of
// elements that hang together.
void cut_masses_follow(CutMasses *masses, bool divided);
// Places and masses of all vertices, from scratch; rows stay.
void cut_masses_derive(CutMasses *masses);

#endif
