// SPDX-License-Identifier: MIT
// Taking tissue away, as the interface between pipeline and bodies: what a remover takes in a tick,
// and the account of a body's tissue. As cuts (cut.h): a model marks cells or faces as gone, once
// for all, and all else follows from the marks. Step thread.
#ifndef PLIANT_BODY_REMOVE_H
#define PLIANT_BODY_REMOVE_H

#include "body/cut.h"
#include "body/region.h"

typedef enum RemoverKind {
    REMOVER_NONE,
    REMOVER_SUCTION,   // takes what is in its mouth, the nearest first, at a rate
    REMOVER_DRILL,     // takes what its burr overlaps
    REMOVER_DIATHERMY, // heats what is near its electrode, and takes what boils
} RemoverKind;

// Walls have no thickness: an amount of theirs is an area times this [m].
#define REMOVED_THICKNESS 1e-3

// What a tool takes from one body in one tick, in the world frame.
typedef struct Removal {
    RemoverKind kind;
    Region mouth;  // a capsule: mouth, burr or electrode
    double volume; // most that may go in this call, at rest [m3]; INFINITY: no limit; of a wall
                   // REMOVED_THICKNESS times its area
    double heat;   // that diathermy gives to the tissue in this tick [J]
    double tick;   // [s]
} Removal;

typedef struct RemovalOutcome {
    CutVerdict verdict; // CUT_DONE: tissue is within reach, taken or still to be taken;
                        // CUT_MET_NOTHING; or one that refuses: then nothing was changed
    int removed;        // cells of a solid, faces of a wall
    double volume;      // of these at rest [m3]; of a wall 0
    double area;        // of a wall [m2]; of a solid 0
    double mass;        // [kg]
    Vec3 momentum;      // that left with it [N s]
    double heat;        // that diathermy gave [J]
    double coagulated;  // volume of the body that is coagulated now, if diathermy acts [m3]
    int nodes_added, pieces, small_pieces; // of the body, after it; as CutOutcome
    int needed, room;                      // of CUT_NO_NODES, CUT_NO_FACES
} RemovalOutcome;

// What opened or took tissue.
typedef enum AccountCause {
    ACCOUNT_NOTHING,
    ACCOUNT_CUT,
    ACCOUNT_TEAR,
    ACCOUNT_REMOVAL,
    ACCOUNT_CAUSES,
} AccountCause;

// The account of one tissue of a body: of a label, or of all of it. Amounts at rest: volumes [m3]
// of solids, areas [m2] of walls. At any time at_load = attached + cut_off + removed.
typedef struct TissueAccount {
    const char *name; // of the label; owned by the model
    double density;   // mass per amount [kg/m3], [kg/m2]
    double at_load;
    double attached; // in the main piece: that with the most of what is fixed, else the largest
    double cut_off;  // in all other pieces
    double removed;
    double coagulated; // of what is present
} TissueAccount;

// Tissue whose distance to all that is cut or removed is of interest, as it is at rest.
typedef struct WatchedRegion {
    FixedRegion region; // a box or a sphere, world frame at load
    int material;       // not 0: instead the cells of this material, from 1; -1: none of the body's
} WatchedRegion;

typedef struct RegionAccount {
    double distance;    // shortest one so far [m]; INFINITY: nothing was cut or removed
    AccountCause cause; // of what is there
    bool touched;       // something inside was cut or removed
    int64_t visits;     // ticks that tools were inside, of each tool
} RegionAccount;

// What was opened in a body, owned by the model.
typedef struct BodySections {
    int64_t version;  // another one whenever this or the account has changed
    double cut, torn; // areas at rest, one side counts [m2]
    int64_t visits;   // of all regions; no part of the version
    int region_count;
    const RegionAccount *region; // by BodyOptions.watch
} BodySections;

#endif
