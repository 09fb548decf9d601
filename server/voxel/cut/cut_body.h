// SPDX-License-Identifier: MIT
// What a voxel body with `cuttable = true` has and does besides others: its elements are stored so
// that blades can separate them while the body moves. Step thread, unless noted.
#ifndef PLIANT_VOXEL_CUT_CUT_BODY_H
#define PLIANT_VOXEL_CUT_CUT_BODY_H

#include "voxel/cut/cut_account.h"
#include "voxel/cut/cut_adapt.h"
#include "voxel/cut/cut_blade.h"
#include "voxel/cut/cut_carry.h"
#include "voxel/cut/cut_faces.h"
#include "voxel/cut/cut_fit.h"
#include "voxel/cut/cut_heat.h"
#include "voxel/cut/cut_masses.h"
#include "voxel/cut/cut_pieces.h"
#include "voxel/cut/cut_release.h"
#include "voxel/cut/cut_remove.h"
#include "voxel/cut/cut_tear.h"
#include "voxel/cut/cut_tension.h"
#include "voxel/cut/cut_windows.h"
#include "voxel/model.h"

typedef struct VoxelCuts {
    const char *name; // of the body
    CutLattice lattice;
    TemplateCache templates;
    CutWindows windows;
    CutMasses masses;
    CutCarry *carry;     // of a body that adapts, or NULL
    CutRelease *release; // likewise
    CutPieces pieces;
    CutAccount account;
    CutFaces faces;
    CutBlades blades;
    CutTear tear;           // of bodies that tear
    CutFit *fit;            // of a smooth surface, or NULL
    CutTension *tension;    // of tissue under tension at rest, or NULL
    CutReach *reach;        // of removers; NULL: cells cannot go
    int present;            // finest cells
    int *gone;              // [materials] cells that are gone, and
    double mass_at_load;    // of the body [kg]
    CutHeat *heat;          // of a body that diathermy acts on, or NULL
    CutAdapt *adapt;        // of a body that adapts, or NULL
    double lambda, damping; // Body's, while nothing is coagulated
    bool sound;             // the last derivation from the state succeeded
    int64_t refused;        // reconstructions left incomplete for lack of capacity, since the start
} VoxelCuts;

// --- operations of body/body.h that other bodies do not have ---
bool cut_body_cut(Body *body, const CutSweep *sweep, CutOutcome *outcome, TopologyChange *change);
bool cut_body_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change);
bool cut_body_conduct(Body *body, double tick, bool *shown);
bool cut_body_adapt(Body *body, int64_t step, double tick, TopologyChange *change);
void cut_body_approach(void *self, const Approach *approach, int count);
bool cut_body_reconstruct(Body *body, TopologyChange *change);
void cut_body_reserve_blades(void *self, int blades, Arena *arena, StateList *state); // load time

// Updates all data derived from elements and vertices. True if anything visible changed. `divided`:
// with divisions or merges.
bool cut_body_follow(VoxelCuts *cuts, Body *body, bool divided, bool pieces_came,
                     TopologyChange *change);
// Tells the body how many elements it has now.
void cut_body_count_elements(const VoxelCuts *cuts, Body *body);

// --- parts of operations that all voxel bodies have ---
// Keeps vertices without elements in their place, after the frame has followed the body.
void cut_body_committed(VoxelCuts *cuts);
// Reads positions and velocities, of carried vertices from what carries them.
void cut_body_read(const VoxelModel *model, const int *vertex, int count, Vec3 *position,
                   Vec3 *velocity);
// Records what pushes from outside; after vertices_begin.
void cut_body_feel(VoxelCuts *cuts);
// The same of impulses [N s] of a substep h [s] on some vertices.
void cut_body_feel_kick(VoxelCuts *cuts, const int *vertex, int count, const Vec3 *impulse,
                        double h);
// Forces [N], constant loads and impulses [N s] at vertices, of which some are carried: these go on
// to those that carry them. Forces and loads: before an evaluation; impulses: after it.
void cut_body_add_forces(VoxelModel *model, const int *vertex, int count, const Vec3 *force);
void cut_body_carry_loads(VoxelModel *model);
void cut_body_kick(VoxelModel *model, int vertex, Vec3 impulse, double drift);
// Cuts stay: broken bits are no numbers that a reset restores.
void cut_body_restore(VoxelCuts *cuts, RestoreMode mode);
// After the state list was restored: derives everything that follows from it.
void cut_body_restored(VoxelCuts *cuts, Body *body);
int cut_body_account(const void *self, TissueAccount *account, int capacity);
const BodySections *cut_body_sections(const void *self);
void cut_body_visit(void *self, Vec3 place);
void cut_body_explain(const VoxelCuts *cuts, FILE *out);

// --- cut_body_create.c: creation of what other bodies do not have; load time ---
// Finds what a body that adapts starts with, as coarse as it can be, so that it needs no room for
// more: moves its vertices to the front of the mesh. False with a status.
bool cut_body_find_rest(VoxelMaking *making, Status *status);
// Sets the capacity. False with a status: options that do not fit a body that can be cut.
bool cut_body_check(VoxelMaking *making, Status *status);
// Creates `cuts` with the elements; before the vertices. False with a status.
bool cut_body_create_elements(VoxelModel *model, const VoxelMaking *making, Arena *arena,
                              StateList *state, Status *status);
// Sets the masses of the vertices.
void cut_body_create_masses(VoxelModel *model, const VoxelMaking *making, Arena *arena);
void cut_body_create_batches(VoxelModel *model, const VoxelMaking *making, Arena *arena,
                             StateList *state);
// Creates the faces, and what cuts and tears find. False with a status.
bool cut_body_create_surface(VoxelModel *model, const VoxelMaking *making, Body *body, Arena *arena,
                             StateList *state, Status *status);

#endif
