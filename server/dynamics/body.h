// The seam between the pipeline and the models of bodies: a table of operations. Nothing here knows
// springs or elements. An operation that a body does not need is NULL.
#ifndef PLIANT_DYNAMICS_BODY_H
#define PLIANT_DYNAMICS_BODY_H

#include "base/arena.h"
#include "base/state.h"
#include "base/vec.h"
#include "dynamics/cut.h"
#include "dynamics/integrator.h"
#include "dynamics/patch.h"
#include "dynamics/region.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

enum { BODY_NAME_MAX = 32 };

// The faces that tools and loads meet: a conforming mesh. Its nodes need not be those of BodyMesh,
// nor all that the body has. Owned by the model, constant between
// changes of topology. A body with levels has places for all nodes and faces that it may ever have;
// those that are not in use belong to nobody's list of faces.
typedef struct BodySurface {
    int node_count, face_count;    // places
    int node_used, face_used;      // those beyond were never in use; only ever grow
    const int (*face)[3];          // counter-clockwise seen from outside
    const double *face_area;       // at rest [m2]
    const double *finest_area;     // [face_count] for capacities: the smallest that faces can be;
                                   // read at load only
    const int (*face_neighbor)[3]; // face across edge (k, k+1), -1 at a border
    const int *node_face_start;    // faces of node i: node_face[start[i] .. end[i])
    const int *node_face_end;
    const int *node_face;
    const double *node_area; // a third of the faces around [m2]
    const double *node_mass; // [kg]
    double longest_edge;     // at rest, of the coarsest level [m]: constant
    bool solid;              // closed, with nothing but matter inside: every face stands against
                             // its front alone, and a tool that is inside is pushed out
    // Times contact_kappa, the contact stiffness of a face and that of a node against a plane;
    // NULL, both: 1. Memory of the model's, filled by contact_set_stiffness: for bodies whose nodes
    // carry masses that differ much for their area.
    double *face_firmness; // [face_count]
    double *node_firmness; // [node_count]
} BodySurface;

// Figures for status and summary; computed when asked.
typedef struct BodyMeasure {
    double kinetic;          // [J]
    double elastic;          // [J]
    double max_displacement; // from rest [m]
    int64_t refused;         // divisions of faces that did not fit, since the start
} BodyMeasure;

// What a client's mesh looks like (lcmtypes/mesh_t.lcm): what is published and recorded, which may
// be another mesh than BodySurface, finer, coarser or of other nodes. All arrays by node or
// triangle slot. A free node slot has id -1, a free triangle is 0 0 0. Constant between changes of
// topology.
typedef struct BodyMesh {
    int topology; // goes up by one with every change and every restore of the state, so that no
                  // number ever names two meshes of a run; the pipeline counts, and no state has it
    int node_count, triangle_count; // slots in use so far
    int node_capacity, triangle_capacity;
    const int (*triangle)[3];
    const int *id;
    const int *origin;
    const int (*parent)[2];
    const int *piece;
    const signed char *level;
} BodyMesh;

// A place for a face that changed hands. The face there takes over from the one in place `from`,
// which lay (at least partly) where it lies; -1: the place is free now. A face that takes over from
// several has an entry for each.
typedef struct FaceChange {
    int face, from;
} FaceChange;

// A node that came, and the two between which it lies; a copy of another: that one twice.
typedef struct NodeBirth {
    int node, parent[2];
} NodeBirth;

// What one change of topology did to BodySurface; owned by the model, valid until the next change.
typedef struct TopologyChange {
    int face_count, born_count, gone_count;
    const FaceChange *face;      // `from` speaks of the places before the change
    const NodeBirth *born;       // parents before their children
    const int *gone;             // children before their parents
    const int (*gone_parent)[2]; // [gone_count] between which they lay
    bool again; // ask once more in this tick: what came may have to be divided in turn
} TopologyChange;

// What can be changed while a scene runs.
typedef enum BodyParameter {
    BODY_GRAVITY_X,
    BODY_GRAVITY_Y,
    BODY_GRAVITY_Z,       // [m/s2]
    BODY_STIFFNESS_SCALE, // times the stiffness of springs, as loaded
    BODY_DAMPING_SCALE,   // times the damping of springs, as loaded
    BODY_ADAPT_FORCE,     // thresholds of refinement (surface.md section 6)
    BODY_ADAPT_SPEED,
    BODY_ADAPT_CURVATURE,
    BODY_ADAPT_SCALE, // times all three thresholds: the time budget's
    BODY_ADAPT_LEVEL, // finest level that may be used: the time budget's. May be more than there
                      // are
} BodyParameter;

typedef struct Body Body;

// How much of the state before a tick a body gets back. Its topology stays as it is in any case.
typedef enum RestoreMode {
    RESTORE_PLACES, // positions, at rest
    RESTORE_SHAPE,  // the rest shape, at rest
    RESTORE_MOTION, // positions and velocities
} RestoreMode;

typedef struct BodyOps {
    const char *model; // "surface"

    // --- a tick, in this order; called by the step thread ---
    // Refines and coarsens where the present state asks for it; NULL: the body has one level of
    // detail. True when the topology changed: `change` says how, and the body's surface, mesh,
    // mass, bounds and counts have changed with it. `step` counts from 0 again after settling.
    bool (*adapt)(Body *body, int64_t step, double tick, TopologyChange *change);
    // Breaks the links that a blade's edge meets (cut.h); NULL: the body is not cuttable. Says what
    // happened in `outcome`, whose verdict alone matters when it returns false: then nothing was
    // changed. True when the topology changed, as with adapt; change->again: call once more with
    // the same sweep, and the counts of all calls add up. What an earlier tick put off may be done
    // with CUT_ENDS. A verdict that refuses (cut_refuses) ends the stroke: CUT_ENDS follows.
    bool (*cut)(Body *body, const CutSweep *sweep, CutOutcome *outcome, TopologyChange *change);
    // Breaks links that are strained beyond the tissue's strength, by the present state; NULL: it
    // does not tear. As cut.
    bool (*tear)(Body *body, double tick, CutOutcome *outcome, TopologyChange *change);
    // Refines what a cut has left to be refined, as much as fits a tick; NULL: nothing ever has to
    // be. As adapt.
    bool (*reconstruct)(Body *body, TopologyChange *change);
    // Kicks only: moves positions by dt [s] with the present velocities.
    void (*drift)(void *model, double dt);
    // One evaluation of all forces at the present rows, fused with the stage's algebra.
    void (*evaluate)(void *model, const Stage *stage, double h);
    // After the last stage: true when every number is finite and in bounds; the result becomes the
    // present state. Otherwise false, and the state before the tick is still whole: restore it.
    bool (*commit)(void *model);
    // Forgets what was evaluated since the last commit, as if it had not been: the present state is
    // that after it again. Warm starts and what is felt stay changed. NULL: steps cannot be tried.
    void (*abandon)(void *model);
    // Whether every number of the present state is finite and in bounds: after a checkpoint was
    // read.
    bool (*check)(const void *model);
    // Back to the state before the tick, as much of it as `mode` says. Nodes that came in this tick
    // are in it already, between their parents (adapt, cut), since topology changes before the
    // forces do.
    void (*restore)(void *model, RestoreMode mode);

    // --- nodes by their index in BodySurface ---
    // Positions [m] and velocities [m/s] of the present rows; velocity may be NULL.
    void (*read_nodes)(const void *model, const int *node, int count, Vec3 *position,
                       Vec3 *velocity);
    // Whether the node is held by the scene (does not move).
    bool (*is_fixed)(const void *model, int node);
    // Adds forces [N] for the next evaluation only.
    void (*add_forces)(void *model, const int *node, int count, const Vec3 *force);
    // Nodes of faces inside a region, in an order that depends on the topology alone; returns how
    // many there are, writes at most `capacity` of them. Places of nobody are not among them.
    int (*find_nodes)(const void *model, const Region *region, int *node, int capacity);
    // Constant forces on nodes [N], kept until cleared and part of the model's state; after a
    // change of topology they are cleared and added anew.
    void (*add_load)(void *model, int node, Vec3 force);
    void (*clear_loads)(void *model);
    // A new load is among them: what it asks of a body that adapts is looked at in the next ticks.
    // Not called for loads that only follow a change of topology. NULL: the body does not adapt.
    void (*look)(void *model);

    // The stiffness of the free nodes of a region against small motions, of the state after a tick
    // (patch.h): goes on where the last call stopped, for about `budget` nodes looked at. True when
    // it is complete, or full. NULL: not known, and contacts tell no stiffness.
    bool (*gather_patch)(const void *model, Patch *patch, int budget);

    // --- out ---
    // Float positions (and velocities unless NULL) of all nodes, in the order of BodyMesh.
    void (*snapshot)(const void *model, float *position, float *velocity);
    // Where these nodes are when nothing acts, in the world, as the scene placed the body; constant
    // between changes of topology. NULL: the body has no such places. What stands in free slots
    // means nothing.
    void (*snapshot_rest)(const void *model, float *position);
    // The exact state of all that moves, for checkpoints: id (NULL: not asked for), position [m]
    // and velocity [m/s] in a constant order between changes of topology; id -1 and zeros: nobody's
    // place. Returns how many, at most state_capacity; of a state that check calls sound. The ids
    // of a body that does not change (body_changes) are always the same.
    int (*read_state)(const void *model, int *id, Vec3 *position, Vec3 *velocity);
    void (*measure)(const void *model, BodyMeasure *measure);

    // --- changes while running (SET): false when the model has no such parameter ---
    bool (*set)(void *model, BodyParameter parameter, double value);

    // After the state list was restored (checkpoint, reset): whatever follows from it; may be NULL.
    // The bytes may come from any file: of a state that cannot be, check says so afterwards.
    void (*restored)(Body *body);

    // --- load time ---
    // Before the first cut: memory for the links around so many blades. NULL as cut.
    void (*reserve_blades)(void *model, int blades, Arena *arena, StateList *state);
    // Before the first add_forces: memory for forces on so many nodes in one evaluation. NULL: it
    // needs none.
    void (*reserve_forces)(void *model, const char *name, int count, Arena *arena);
    // Kernel variant and what was left out, one line each, for --explain.
    void (*explain)(const void *model, FILE *out);
    // The instruction-set level of its kernels.
    const char *(*isa)(const void *model);
} BodyOps;

// What SET and the check of numbers change; plain data, part of the state.
typedef struct BodyTuning {
    double friction; // mu
    double stiffness_scale, damping_scale;
    int64_t bad_in_a_row; // ticks that ended in bad numbers, without a good one between
} BodyTuning;

// One body of a scene.
struct Body {
    char name[BODY_NAME_MAX];
    const BodyOps *ops;
    void *model;         // owned by the arena of the scene
    BodySurface surface; // valid after creation
    BodyMesh mesh;       // valid after creation
    // Texture coordinates by a node's id in BodyMesh; a node whose id is beyond them is a copy and
    // has those of its origin. Owned by whom it was made by; NULL: none, or nobody asks for them.
    const float (*texture)[2];
    int texture_count;
    int state_capacity; // most that read_state may ever give
    IntegratorKind integrator;
    double mass; // [kg]
    int spring_count, element_count;
    int finest_level; // finest level in use

    // Bounds of the body alone, for the step and for the stiffness of contacts.
    double lambda;         // of M^-1 K [1/s2]
    double damping;        // of M^-1 C [1/s]
    double contact_lambda; // lambda of the coarsest level: contact is as stiff at every level
    double theta;          // implicit bodies: the method's, else 0
    double contact_share;  // of that lambda, what the step of an implicit body has left; else 1
    double finest_lambda, finest_damping; // of the finest level at rest; 0: one level, or not known

    // Contact law (contact.md 2.1), set by sim_create from `lambda`.
    double contact_density; // least mass of a node over the sum of the face areas at it [kg/m2]
    double contact_kappa;   // stiffness per rest area [N/m3], times firmness
    double contact_ratio;   // a: share of the body's own stiffness
    double contact_damping; // b_c: damping time [s]
    BodyTuning tuning;

    // The time step, set by sim_seal and again whenever the bounds change.
    double time_step_limit;  // of the stability bound, contacts included [s]
    double time_step_wanted; // of the scene; 0: none
    bool unsafe_time_step;
    int substeps;        // a tick
    int finest_substeps; // at the finest level as loaded, where that is known: the most
    double h;            // tick / substeps [s]

    int64_t resets; // restores of the last good state
};

// Whether its topology can change while it runs.
static inline bool body_changes(const Body *body)
{
    return body->ops->adapt != NULL || body->ops->cut != NULL || body->ops->tear != NULL;
}

// Pieces: different values of BodyMesh.piece. Not for the step thread.
int body_count_pieces(const BodyMesh *mesh);

#endif
