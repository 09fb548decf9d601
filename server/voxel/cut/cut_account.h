// SPDX-License-Identifier: MIT
// What became of the tissue of a body that can be cut: cells attached, cut off and removed by
// material, areas of sections, and how near to watched regions anything was cut (README.md,
// "Account"). Step thread.
#ifndef PLIANT_VOXEL_CUT_CUT_ACCOUNT_H
#define PLIANT_VOXEL_CUT_CUT_ACCOUNT_H

#include "body/remove.h"
#include "body/rows.h"
#include "voxel/cut/cut_cross.h"
#include "voxel/cut/cut_pieces.h"

// Part of the state, but the motion does not depend on it.
typedef struct CutAccountRegion {
    double nearest; // 0: nothing yet, else 1 + its distance [cells]
    int64_t cause;  // AccountCause
    int64_t touched;
    int64_t visits;
} CutAccountRegion;

// A cell of which corners are fixed.
typedef struct HeldCell {
    int cell, corners;
} HeldCell;

typedef struct CutAccount {
    // --- constant ---
    const CutPieces *pieces;
    double size;    // of a cell [m]
    HeldCell *held; // [held_count] with fixed corners, by their cells
    int held_count;
    int64_t *at_load; // [material] cells
    const WatchedRegion *watch;
    int **nearest; // [region][cell] nearest cell of the region; NULL: it is a box or a sphere
    Vec3 origin, along[3]; // of the lattice: world frame [m], and its axes, a cell long

    // --- part of the state ---
    int64_t *section;         // [ACCOUNT_CAUSES] sums of broken faces on the sheet of the blade:
                              // each the normal's share along the face's, times CROSSING_UNIT
    CutAccountRegion *region; // [sections.region_count]

    // --- follows from the pieces ---
    int main_piece;    // its number
    int64_t *attached; // [material] cells of the main piece
    int *sum;          // [piece] its fixed corners, by its number

    // --- of others; NULL: none ---
    const int *gone, *coagulated; // [material] cells

    // --- what others get ---
    int tissue_count;
    TissueAccount *tissues; // [tissue_count] name, density and amount at load; the others are 0
    int64_t version;        // changes so far
    BodySections sections;
    RegionAccount *regions; // sections.region
} CutAccount;

// Load time. `held` as of CutMasses.
void cut_account_create(CutAccount *account, const CutPieces *pieces, const VoxelMaking *making,
                        const unsigned char *held, Arena *arena, StateList *state);
// After faces {cell, axis} were broken, met at the crossings (NULL: in the middle).
void cut_account_break(CutAccount *account, AccountCause cause, const int (*face)[2],
                       const CutCrossing *crossing, int count);
// After pieces came: counts the main one again.
void cut_account_count(CutAccount *account);
// Before cells go: takes them out of the piece that they are of. Call cut_account_follow then.
void cut_account_remove(CutAccount *account, const int *cell, int count);
// After cells went; `came`: also pieces came.
void cut_account_follow(CutAccount *account, bool came);
// As BodyOps.account and BodyOps.sections.
int cut_account_tissues(const CutAccount *account, TissueAccount *to, int capacity);
const BodySections *cut_account_sections(CutAccount *account);
// As BodyOps.visit, in this state of the rows.
void cut_account_visit(CutAccount *account, const Rows *rows, const void *row, Vec3 place);
// After the state was replaced.
void cut_account_derive(CutAccount *account);

#endif
