// SPDX-License-Identifier: MIT
// Private to the surface module: a body whose faces are refined and coarsened while it runs (Choi
// et al. 2005; README.md derives the rules). Everything here follows from one set of bits, which
// faces are refined: tables, masses, sums and their order are a pure function of it, and every
// local update gives the same bits as rebuilding everything (detail_rebuild).
//
// A node has a slot for its rows, in an order of the hierarchy that keeps neighbours together,
// level by level, and, while it is on, a lane in the kernel's tables.
#ifndef PLIANT_SURFACE_DETAIL_DETAIL_H
#define PLIANT_SURFACE_DETAIL_DETAIL_H

#include "geometry/levels.h"
#include "surface/detail/detail_cut.h"
#include "surface/detail/detail_faces.h"
#include "surface/detail/detail_pieces.h"
#include "surface/detail/detail_pack.h"
#include "surface/detail/detail_set.h"
#include "surface/detail/detail_sweep.h"
#include "surface/network.h"
#include "surface/model.h"

// Scratch of a change: the springs of the windows that are packed again, as they were.
typedef struct DetailLaw {
    bool *saved;       // [window_count]
    int *lane;         // [slots]
    int *start, *end;  // [chunks]
    int *neighbour;    // [entry][LANES]
    void *rest_length; // Real [entry][LANES]
    int *before;       // [node_count] the node that it was copied from in this change, or itself
} DetailLaw;

typedef struct Detail {
    // --- constant ---
    SurfaceOptions options;
    StateList *state; // load time only
    LevelRules rules;
    bool *fixed; // [node_count]

    LeafSet set;          // which faces are refined: what follows derives from it
    DetailPack pack;      // how nodes are packed into the kernel's tables
    DetailLists lists;    // what each evaluation visits
    DetailFaces faces;    // triangles for contact and display
    DetailReport report;  // the change in progress
    DetailFolds folds;    // angles at rest
    DetailAdapt adapt;    // progress of the sweep over the criteria
    DetailFrames *frames; // NULL: not cuttable, or virtual nodes follow no frame
    DetailLaw *law;       // NULL: springs do not relax
    bool is_valid;        // detail_check succeeded, or was not called
} Detail;

// --- detail_pack.c: builds the kernel's tables from the bits ---
// Returns the mass that moves with a node [kg]: a third of the leaves around it, and half of the
// mass of each hanging node whose master it is; with choi2005 eq 7.
double detail_mass(const SurfaceModel *model, int node);
// Packs the stale windows, then updates the sums over windows. `changed`: in a change; else the
// tables follow from a state whose dashpots stay as they are.
void detail_pack(SurfaceModel *model, bool changed);

// --- detail_law.c: dashpots of springs ---
// Load time, once the springs have their tables; model->detail exists.
void detail_law_create(SurfaceModel *model, const SurfaceMaterial *material, size_t entries,
                       const char *name, Arena *arena, StateList *state);
// Before stale windows are packed: saves their springs; after: gives the new ones their dashpots.
void detail_law_save(SurfaceModel *model);
void detail_law_move(SurfaceModel *model);

// --- detail_bend.c: hinges between leaves ---
// Load time: the table of hinges and the bounds of each level; the first packing fills it.
void detail_bend_create(SurfaceModel *model, double stiffness, const char *name, Arena *arena);
// Packs the hinges of a stale window, before its marks are cleared.
void detail_bend_pack(SurfaceModel *model, int window);
// After packing: lists the groups in use.
void detail_bend_list(SurfaceModel *model);

// --- detail_rows.c: rows of nodes that hang, are created or removed ---
// Returns the velocity of a node that is on, from its masters if it hangs [m/s].
Vec3 detail_velocity(const SurfaceModel *model, int node);
// Changes the velocity of the nodes that carry a node by an impulse [N s].
void detail_push(SurfaceModel *model, int node, Vec3 impulse);
// Sets the rest position that a node's status requires.
void detail_set_rest(SurfaceModel *model, int node);
// The same for a node that no longer hangs; its displacement stays.
void detail_release(SurfaceModel *model, int node);
void detail_give_birth(SurfaceModel *model, int node);
// Creates a node at the position of another, with the same motion.
void detail_copy_row(SurfaceModel *model, int node, int from);
void detail_switch_off(SurfaceModel *model, int node);

// --- detail_set.c: refining and coarsening ---
// Begins a change; faces are refined and coarsened until detail_end_change.
void detail_begin_change(SurfaceModel *model);
// Marks a node whose springs or mass change, to be packed again.
void detail_mark(SurfaceModel *model, int node);
// Refines a leaf, after the refinements that balance requires. False: the capacity is too small.
bool detail_refine(SurfaceModel *model, int level, int face);
// Coarsen a refined face whose four children must be leaves; detail_may_coarsen: true if balance
// allows it.
bool detail_may_coarsen(const LeafSet *set, int level, int face);
void detail_coarsen(SurfaceModel *model, int level, int face);
// Ends a change. True if something changed.
bool detail_end_change(Body *body);
// The same after edges were broken, which may have changed no node.
void detail_end_cut(Body *body);

// --- detail_sweep.c: refinement criteria ---
// Returns the cosine of the angle by which two leaves at an edge have turned against each other
// since rest; 1 if one of them has no area and so no direction. node: the edge's ends in the order
// of one leaf, its third corner, and that of the other leaf; x: their positions [m].
double detail_cos_of_turn(const SurfaceModel *model, int level, int edge, const int node[4],
                          const Vec3 x[4]);

// Examines the next faces, refines and coarsens. True if the topology changed.
bool detail_sweep(Body *body, int64_t step, double tick);

// --- detail_create.c ---
// Creates a body with levels: fills in a model, whose kernels, precision and damping are set, and
// its body, from the mesh of level 0 and options->hierarchy.
void detail_create(Body *body, SurfaceModel *model, const TriMesh *mesh, const WingedMesh *winged,
                   const SpringNetwork *network, const SurfaceOptions *options, Arena *arena,
                   StateList *state);
// Rebuilds everything that is derived from the bits.
void detail_rebuild(Body *body);
// Publishes the body's derived quantities: mass, bounds, counts, mesh.
void detail_publish(Body *body);
// Returns the topology number of its mesh.
int detail_topology(const Detail *detail);

// --- detail_body.c: what levels add to the operations of a surface body ---
// After the state was overwritten: true if everything else can be derived from it.
bool detail_check(const Detail *detail);
bool detail_adapt(Body *body, int64_t step, double tick, TopologyChange *change);
// A new load refines the body to its final level in as many sweeps as there are levels.
void detail_look(void *self);
// Runs the kernels over the nodes in use.
void detail_evaluate(SurfaceModel *model, SpringPass *pass);
void detail_restored(Body *body);
// Clears what refers to the past: after a return to the rest shape nothing has been stretched, and
// forces of a tick that is undone must not divide faces.
void detail_forget(Detail *detail, RestoreMode mode);
// Sets a parameter of adaptation; false for others, and for a body that does not adapt.
bool detail_set(Detail *detail, BodyParameter parameter, double value);
bool detail_get(const Detail *detail, BodyParameter parameter, double *value);
// Prints what depends on levels, for --explain.
void detail_explain(const Detail *detail, FILE *out);

#endif
