// SPDX-License-Identifier: MIT
// The smooth surface of a body that can be cut (README.md, "Smooth walls"): offsets of the outer
// points are those of the uncut body, those of a cut wall follow from where the blade met the links
// around. An offset is a pure function of the broken bits and the crossings. Where a change would
// let a node jump, it goes there within FIT_FADE_TIME instead.
//
// Step thread, except cut_fit_create.
#ifndef PLIANT_VOXEL_CUT_CUT_FIT_H
#define PLIANT_VOXEL_CUT_CUT_FIT_H

#include "voxel/cut/cut_cross.h"
#include "voxel/cut/cut_faces.h"
#include "voxel/fitted_body.h"

#define FIT_FADE_TIME 0.2 // [s]

// The place of a vertex when its fade began.
typedef struct CutFade {
    float from[3]; // from the vertex, in the world's axes [m]
    int step;      // 0: never
} CutFade;

// A lattice point around which something changed.
typedef struct CutMoved {
    int index, point[3];
    int leaf[8];     // around it, by slot: cut_fit_around
    bool moved;      // its offset is not that of before:
    float before[3]; // [cells]
} CutMoved;

typedef struct CutFit {
    CutFaces *faces;
    CutLattice *lattice;
    const Vertices *vertices;
    // --- constant ---
    SurfaceField field; // its values belong to the arena
    double level;
    const float (*outer)[3];       // [point] offsets of the uncut body [cells]; 0 inside
    const unsigned char *is_outer; // [point]

    // --- part of the state ---
    CutCrossing (*crossing)[3]; // [cell] of its broken faces, by axis
    CutFade *fade;              // [vertex_capacity]

    // --- derived from the state ---
    FittedBody fitted;        // rows, cells and fades that clients' nodes follow from
    float (*point_offset)[3]; // [point] present offsets [cells]
    int *vertex;              // [row]
    int *row_of;              // [vertex] -1: none
    int *row;                 // [slot]
    float (*offset)[3];       // [row]; zero unless it is a node's
    int *cell_at;             // [cell] in `cell`; -1: not needed
    int (*cell)[FIT_CORNERS]; // rows
    int *of_cell;             // the cells of these; NULL: they stay
    FitFade *fading;
    int *fading_vertex, fading_count;
    int newest_count;         // vertices whose fade is as new as that of any
    unsigned char *is_fading; // [vertex]
    int slots;                // that have been processed
    int64_t step;             // ticks completed after the current one

    // --- scratch ---
    CutMoved *moved; // those of the current change
    int moved_count;
    unsigned char *is_listed; // [point]
    int *origin;              // [vertex] born in the current change: its copy's original; else -1
    double (*gradient)[3][3]; // [cell] by axis; valid where `known` has the current stamp
    int *known, stamp;
    int *entered;           // [cell] stamp of its last entry
    int *seen_square, seen; // stamps
} CutFit;

// Load time. Makes the published mesh smooth; after cut_faces_create.
void cut_fit_create(CutFit *fit, CutFaces *faces, CutLattice *lattice, const VoxelMaking *making,
                    Body *body, Arena *arena, StateList *state);
// Keeps the crossings of faces {cell, axis}; NULL: those of tears.
void cut_fit_keep(CutFit *fit, const int (*face)[2], const CutCrossing *crossing, int count);
// Updates the surface after changes of the lattice, after cut_faces_follow. True if anything that
// clients see changed.
bool cut_fit_follow(CutFit *fit, bool divided, Body *body);
// BodyOps.fit_node. A pure function of the state.
void cut_fit_node(const CutFit *fit, int vertex, int64_t step, FitNode *out);
// Derives everything that follows from the state.
void cut_fit_derive(CutFit *fit, Body *body);

#endif
