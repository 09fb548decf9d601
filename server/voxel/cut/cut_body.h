// Voxel bodies with `cuttable = true`: the same elements, kernels and vertices as in voxel.c,
// stored so that blades can separate them while the body moves.
#ifndef PLIANT_VOXEL_CUT_CUT_BODY_H
#define PLIANT_VOXEL_CUT_CUT_BODY_H

#include "voxel/cut/cut_blade.h"
#include "voxel/cut/cut_faces.h"
#include "voxel/cut/cut_masses.h"
#include "voxel/cut/cut_pieces.h"
#include "voxel/cut/cut_tear.h"
#include "voxel/cut/cut_windows.h"
#include "voxel/voxel.h"

typedef struct CutModel {
    const char *name; // of the body
    VoxelLaw law;
    CutLattice lattice;
    TemplateCache templates;
    CutWindows windows;
    Vertices vertices; // ids are the lattice's
    CutMasses masses;
    CutPieces pieces;
    CutFaces faces;
    CutBlades blades;
    CutTear tear;    // of bodies that tear
    bool sound;      // the last derivation from the state succeeded
    int64_t refused; // reconstructions left incomplete for lack of capacity, since the start
} CutModel;

extern const BodyOps cut_body_ops, cut_body_ops_tearing;

// cut_patch.c: BodyOps.gather_patch.
bool cut_body_gather_patch(const void *self, Patch *patch, int budget);
// Creates a cuttable body in space; called by voxel_create, with the same contract.
bool cut_body_create(Body *body, const VoxelOptions *options, Arena *arena, StateList *state,
                     Status *status);
// Derives everything that follows from bits and vertices. False: an impossible state.
bool cut_body_derive(CutModel *model, Body *body);

#endif
