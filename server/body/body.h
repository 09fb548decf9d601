// SPDX-License-Identifier: MIT
// The interface between the pipeline and the models of bodies: a table of operations, independent
// of springs and elements. An operation that a body does not need is NULL.
#ifndef PLIANT_BODY_BODY_H
#define PLIANT_BODY_BODY_H

#include "base/isa.h"
#include "base/memory.h"
#include "base/mesh_columns.h"
#include "base/team.h"
#include "base/vec.h"
#include "body/approach.h"
#include "body/cut.h"
#include "body/error.h"
#include "body/fit.h"
#include "body/integrator.h"
#include "body/patch.h"
#include "body/region.h"
#include "body/remove.h"
#include "geometry/box.h"

#include <limits.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

enum { BODY_NAME_MAX = 32 };

// The faces that tools and loads act on: a conforming mesh. Its nodes need not be those of
// BodyMesh, nor all nodes of the body. Owned by the model, constant between changes of topology. A
// body with levels has slots for all nodes and faces that it can ever have; unused slots are in no
// list of faces.
typedef struct BodySurface {
    int node_count, face_count; // slots
    int node_used, face_used;   // slots beyond were never in use; only grow
    const int (*face)[3];       // counter-clockwise seen from outside
    const double *face_area;    // at rest [m2]
    const double *finest_area;  // [face_count] smallest areas that faces can have, for capacities;
                                // read at load time only
    const int (*face_neighbor)[3]; // face across edge (k, k+1), -1 at a border
    const int *node_face_start;    // faces of node i: node_face[start[i] .. end[i])
    const int *node_face_end;
    const int *node_face;
    const double *node_area; // a third of the surrounding faces [m2]
    const double *node_mass; // [kg]
    double longest_edge;     // at rest, of the coarsest level [m]: constant
    bool solid; // closed and filled: tools are felt by contact_solid.c, through kick_nodes
    bool alike; // all faces have the area of the first, which alone is there
    // Factors on contact_kappa: contact stiffness of a face, and of a node against a plane. Both
    // NULL: 1. The model's memory, set by contact_set_stiffness, for bodies whose nodes have very
    // different masses per area.
    double *face_firmness; // [face_count]
    double *node_firmness; // [node_count]
} BodySurface;

// Returns the area of a face at rest [m2].
static inline double body_face_area(const BodySurface *surface, int face)
{
    return surface->face_area[surface->alike ? 0 : face];
}

// Figures for status and summary; computed on request.
typedef struct BodyMeasure {
    double kinetic;          // [J]
    double elastic;          // [J]
    double max_displacement; // from rest positions [m]
    double outer;            // potential of gravity and constant loads, up to a constant [J]
    int64_t refused;         // subdivisions of faces beyond the capacity, since the start
} BodyMeasure;

// The mesh that clients get (lcmtypes/mesh_t.lcm), published and recorded (mesh_columns.h). It may
// differ from BodySurface: finer, coarser or with other nodes. All arrays by node or triangle slot.
// A free node slot has id -1, a free triangle is 0 0 0. Constant between changes of topology.
typedef struct BodyMesh {
    int topology; // incremented by every change and every restore of the state, so that a number is
                  // unique among 2^31 meshes of a run; counted by the pipeline, part of no state.
                  // Positive: 1 follows INT_MAX
    int node_count, triangle_count; // slots in use so far
    int node_capacity, triangle_capacity;
    MESH_COLUMNS(MESH_READ_ROWS)
    int first_wall; // triangles from this slot on are walls of cuts; 0: the body has none
    BodyFit fit;    // row_count 0: nodes are published where their vertices are
} BodyMesh;

// A face slot with a new face. It replaces the face in slot `from`, which was (at least partly) in
// its location; -1: the slot is now free. A face that replaces several has an entry for each.
typedef struct FaceChange {
    int face, from;
} FaceChange;

// A new node and the two nodes that it is between; a copy has its original twice.
typedef struct NodeBirth {
    int node, parent[2];
} NodeBirth;

enum {
    NODE_NONE = -1
}; // in place of a parent: the node went with its tissue, to which no node is heir

// Effect of one change of topology on BodySurface; owned by the model, valid until the next change.
typedef struct TopologyChange {
    int face_count, born_count, gone_count;
    const FaceChange *face;      // `from` is a slot before the change
    const NodeBirth *born;       // parents before their children
    const int *gone;             // children before their parents
    const int (*gone_parent)[2]; // [gone_count] nodes that they were between, or both NODE_NONE
    int pieces;  // of reconstruct: how many there are, if it may have separated some; else 0
    bool again;  // call once more in this tick: new faces may have to be divided in turn
    bool inside; // elements were divided or merged, while nodes, faces and what they weigh stayed
} TopologyChange;

// Parameters that can change while a scene runs.
typedef enum BodyParameter {
    BODY_GRAVITY_X,
    BODY_GRAVITY_Y,
    BODY_GRAVITY_Z,       // [m/s2]
    BODY_STIFFNESS_SCALE, // factor on the stiffness of springs, as loaded
    BODY_DAMPING_SCALE,   // factor on damping and drag, as loaded
    BODY_PRESSURE,        // of a cavity, above that outside [Pa]
    BODY_VOLUME,          // of the gas or fluid in a cavity, without pressure [m3]
    BODY_SUPPLY,          // 0: a gas or fluid has come to rest at its pressure: seal it
    // thresholds of refinement (server/surface/detail/README.md, "Refinement criteria")
    BODY_ADAPT_FORCE,
    BODY_ADAPT_SPEED,
    BODY_ADAPT_CURVATURE,
    BODY_ADAPT_SCALE, // factor on all three thresholds, of the time budget; solids: divides how far
                      // around tools elements are fine
    BODY_ADAPT_LEVEL, // finest level allowed, of the time budget; may exceed the levels of the
                      // body. Solids: by how many levels tools make elements finer than the
                      // coarsest
    BODY_ADAPT_ERROR, // relative error to which detail is steered; not for other bodies
    BODY_ADAPT_FINENESS, // by how much that changes it: divides the thresholds; solids: multiplies
                         // how far around tools elements are fine
} BodyParameter;

// Ranges of what a scene gives and SET changes, as both print them; bounds included.
#define FRICTION_RANGE 0, 10
#define PRESSURE_RANGE -1e6, 1e6
#define ADAPT_RANGE    0, 1e+09
#define ERROR_RANGE    0.0001, 1

typedef struct Body Body;
typedef struct BodyLook BodyLook; // body/look.h

// How much of the state before a tick is restored. The topology stays in any case.
typedef enum RestoreMode {
    RESTORE_POSITIONS, // positions, with zero velocity
    RESTORE_SHAPE,     // the rest shape, with zero velocity
    RESTORE_MOTION,    // positions and velocities
} RestoreMode;

typedef struct BodyOps {
    const char *model; // "surface"

    // --- a tick, in this order; called by the step thread ---
    // Refines and coarsens by the current state; NULL: the body has one level of detail. Returns
    // true if the topology changed: `change` describes it, and the body's surface, mesh, mass,
    // bounds and counts are updated. `step` restarts from 0 after settling. A solid's faces stay:
    // it sets change->inside, and returns true only if clients need another mesh to show it.
    bool (*adapt)(Body *body, int64_t step, double tick, TopologyChange *change);
    // Tells where tools will be soon, and where something holds, loads or touches the body, before
    // adapt, in each tick; at most APPROACH_MOST. NULL: the body does not look ahead.
    void (*approach)(void *model, const Approach *approach, int count);
    // Breaks the links that a blade's edge crosses (cut.h); NULL: the body is not cuttable. Sets
    // `outcome`; if it returns false, only its verdict is valid and nothing was changed. Returns
    // true if the topology changed, as for adapt; change->again: call once more with the same
    // sweep, and the counts of all calls add up. CUT_ENDS may do work that an earlier tick
    // postponed. A verdict that refuses (cut_refuses) ends the stroke: CUT_ENDS follows.
    bool (*cut)(Body *body, const CutSweep *sweep, CutOutcome *outcome, TopologyChange *change);
    // Breaks links whose strain in the current state exceeds the tissue's strength; NULL: the body
    // does not tear. As cut.
    bool (*tear)(Body *body, double tick, CutOutcome *outcome, TopologyChange *change);
    // Takes away tissue within a remover's reach (remove.h), at most as much as fits a tick; NULL:
    // nothing can be taken from the body. As cut.
    bool (*remove)(Body *body, const Removal *removal, RemovalOutcome *outcome,
                   TopologyChange *change);
    // Lets heat of diathermy spread in the body for a tick [s], which coagulates tissue; NULL:
    // nothing can heat it. True if it became stiffer: bounds of the step may have changed.
    // `shown`: what snapshot_coagulated writes has changed.
    bool (*conduct)(Body *body, double tick, bool *shown);
    // Refines the surroundings of cuts, as much as fits a tick; NULL: never needed. As adapt.
    bool (*reconstruct)(Body *body, TopologyChange *change);
    // Moves positions by dt [s] with the current velocities; schemes of kicks only.
    void (*drift)(void *model, double dt);
    // Evaluates all forces at the current rows, fused with the algebra of the scheme.
    void (*evaluate)(void *model, const Evaluation *evaluation, double h);
    // Ends the tick after the last evaluation. Returns true if every number is finite and in
    // bounds: the result becomes the current state. If false, the state before the tick is still
    // intact: restore it.
    bool (*commit)(void *model);
    // Discards all evaluations since the last commit: the current state is again that of the
    // commit. Warm starts and measured forces stay changed. NULL: steps cannot be tried.
    void (*abandon)(void *model);
    // True if every number of the current state is finite and in bounds; called after reading a
    // checkpoint.
    bool (*check)(const void *model);
    // Restores the state before the tick, to the extent of `mode`. Nodes created in this tick exist
    // in it already, between their parents (adapt, cut), since topology changes before the forces
    // are evaluated.
    void (*restore)(void *model, RestoreMode mode);

    // --- nodes by their index in BodySurface ---
    // Reads positions [m] and velocities [m/s] of the current rows; velocity may be NULL.
    void (*read_nodes)(const void *model, const int *node, int count, Vec3 *position,
                       Vec3 *velocity);
    // Bounds the motion of all nodes, as rows_bound_motion does: many times faster than reading
    // them. NULL: unknown.
    void (*bound_motion)(const void *model, double *displacement, double *speed);
    // Tells what the place of a node follows from, of a body with BodyMesh.fit. `step`: ticks
    // completed. NULL: no body of the model has any.
    void (*fit_node)(const void *model, int node, int64_t step, FitNode *fit);
    // Whether the node is held by the scene (does not move).
    bool (*is_fixed)(const void *model, int node);
    // Adds forces [N] for the next evaluation only.
    void (*add_forces)(void *model, const int *node, int count, const Vec3 *force);
    // Gives nodes impulses [N s] after an evaluate of kicks, as if they had been part of it: as
    // forces over `h` [s], and positions follow by `drift` [s]. NULL: the body is implicit.
    void (*kick_nodes)(void *model, const int *node, int count, const Vec3 *impulse, double h,
                       double drift);
    // Finds the nodes of faces inside a region, in an order that depends on the topology alone.
    // Returns their number, writes at most `capacity` of them; skips free slots.
    int (*find_nodes)(const void *model, const Region *region, int *node, int capacity);
    // Adds a constant force to a node [N], kept until cleared, part of the model's state. After a
    // change of topology they are cleared and added again.
    void (*add_load)(void *model, int node, Vec3 force);
    void (*clear_loads)(void *model);
    // Announces a new load, so that the next ticks check the criteria of adaptation. Not called for
    // loads that only follow a change of topology. NULL: the body does not adapt.
    void (*look)(void *model);

    // Collects the stiffness of a region's free nodes against small motions, from the state after a
    // tick (patch.h). Continues where the last call stopped, for about `budget` nodes. Returns true
    // when complete or full. NULL: unknown, and contacts have no stiffness.
    bool (*gather_patch)(const void *model, Patch *patch, int budget);

    // --- out ---
    // Writes float positions (and velocities unless NULL) of all nodes, in the order of BodyMesh.
    void (*snapshot)(const void *model, float *position, float *velocity);
    // Writes those of the rows that the nodes follow from instead (BodyMesh.fit): less work, for
    // the step thread. NULL: no body of the model has any.
    void (*snapshot_rows)(const void *model, float *position, float *velocity);
    // Writes the rest positions of these nodes in the world, as the scene placed the body; constant
    // between changes of topology. NULL: the body has none. Values in free slots are undefined.
    void (*snapshot_rest)(const void *model, float *position);
    // Writes how much of the tissue around each node is coagulated, 0 to 255. NULL: nothing heats
    // the body.
    void (*snapshot_coagulated)(const void *model, unsigned char *share);
    // Reads the exact state of all moving nodes, for checkpoints: id (may be NULL), position [m]
    // and velocity [m/s] in an order that is constant between changes of topology; free slots have
    // id -1 and zeros. Returns the number of rows, at most state_capacity, for a state that passes
    // check. The ids of a body that does not change (body_changes) are constant.
    int (*read_state)(const void *model, int *id, Vec3 *position, Vec3 *velocity);
    void (*measure)(const void *model, BodyMeasure *measure);
    // Estimates the error of the discretisation in space (error.h) from the current state: goes on
    // where the last call stopped, for about `budget` elements or springs. Returns true when a
    // round is complete and `error` is set; the next call begins another. Changes no state. Only
    // for bodies with BodyOptions.estimate_error. NULL: unknown.
    bool (*estimate)(void *model, const ErrorQuestion *question, int budget, BodyError *error);
    // Writes the share of the body's error around each of the published nodes [first, end), 0 to
    // 255 of the largest, of the last complete round. Comes with `estimate`.
    void (*snapshot_error)(const void *model, int first, int end, unsigned char *share);
    // Tells of squares [first, end) of the published mesh, two triangles each, how wide the element
    // there is, 2^level cells, and a number that differs from those of all elements that touch it;
    // zeros of free squares. Only with Body.element_at_level.
    void (*snapshot_elements)(const Body *body, int first, int end, unsigned char *level,
                              uint16_t *tag);
    // Accounts for the body's tissues, by label; returns their number, writes at most `capacity`.
    // NULL: nothing can be cut off or taken from it.
    int (*account)(const void *model, TissueAccount *account, int capacity);
    // Returns the areas that were opened, and how near that was to watched regions. NULL: unknown,
    // and the account changes with the topology alone.
    const BodySections *(*sections)(const void *model);
    // Notes that a tool is there in this tick [m], for the watched regions, which move with the
    // tissue. Comes with `sections`.
    void (*visit)(void *model, Vec3 place);

    // --- changes while running (SET): false when the model has no such parameter ---
    bool (*set)(void *model, BodyParameter parameter, double value);
    // Reads what it is now; the pressure of a sealed cavity is that which it has.
    bool (*get)(const void *model, BodyParameter parameter, double *value);
    // Reads the range of BODY_PRESSURE or BODY_VOLUME, without `low`; returns false while SET may
    // not change it. NULL: no body of the model has a cavity.
    bool (*range)(const void *model, BodyParameter parameter, double *low, double *high);

    // Recomputes what depends on the state list after it was restored (checkpoint, reset); may be
    // NULL. The bytes may come from any file: check detects an invalid state afterwards.
    void (*restored)(Body *body);

    // --- load time ---
    // Reserves memory for the links around so many blades, before the first cut. NULL as cut.
    void (*reserve_blades)(void *model, int blades, Arena *arena, StateList *state);
    // Reserves memory for forces on so many nodes in one evaluation, before the first add_forces.
    // NULL: not needed.
    void (*reserve_forces)(void *model, const char *name, int count, Arena *arena);
    // Prints the kernel variant and the disabled features, one line each, for --explain.
    void (*explain)(const void *model, FILE *out);
    // Returns the instruction-set level of its kernels.
    const char *(*isa)(const void *model);
} BodyOps;

// Parameters changed by SET and by the guard; plain data, part of the state.
typedef struct BodyTuning {
    double friction; // mu
    double stiffness_scale, damping_scale;
    int64_t bad_in_a_row; // consecutive ticks that ended in bad numbers
} BodyTuning;

// One body of a scene.
struct Body {
    char name[BODY_NAME_MAX];
    const BodyOps *ops;
    void *model;         // owned by the arena of the scene
    BodySurface surface; // valid after creation
    BodyMesh mesh;       // valid after creation
    // Texture coordinates by node id in BodyMesh; a node with a higher id is a copy and has those
    // of its origin. Owned by the creator; NULL: none, or not used.
    const float (*texture)[2];
    int texture_count;
    const BodyLook *look;  // owned by the creator; NULL: the scene says nothing of it
    int state_capacity;    // most rows of read_state
    double half_thickness; // [m] of a plane body: distance of the nodes of `surface` above and
                           // below its state's positions; else 0
    IntegratorKind integrator;
    double mass; // [kg]
    int spring_count, element_count;
    int fine_elements; // of a solid that adapts: as many if all of its surface were finest; else 0
    int spare_nodes;   // of it: for what tools need fine and cuts add
    int finest_level;  // finest level in use
    const int *element_at_level; // [element_levels] of a solid whose elements can be told at its
    int element_levels;          // surface (snapshot_elements): how many there are now; else NULL
    int64_t element_changes;     // grows whenever elements have changed, restored ones included

    // Bounds of the body alone, for the step and for the stiffness of contacts.
    double lambda;         // of M^-1 K [1/s2]
    double damping;        // of M^-1 C [1/s], without drag
    double damping_time;   // of solids: beta, C = beta K + drag M [s]
    double drag;           // of solids [1/s]
    double contact_lambda; // lambda of the coarsest level, so that contact is equally stiff at
                           // every level
    double theta;          // implicit bodies: the method's, else 0
    double bears;          // pressure inside that its wall can balance, about [Pa]
    double
        contact_share; // implicit bodies: fraction of that lambda which their step leaves; else 1
    double finest_lambda, finest_damping; // of the finest level at rest; 0: one level, or unknown

    // Contact law (server/sim/README.md, "Contact stiffness"), set by sim_create from `lambda`.
    double contact_density; // least ratio of a node's mass to the sum of its face areas [kg/m2]
    double contact_kappa;   // stiffness per rest area [N/m3], times firmness
    double contact_ratio;   // a: share of the body's own stiffness
    double contact_damping; // b_c: damping time [s]
    BodyTuning tuning;

    // The time step, set by sim_seal and whenever the bounds change.
    double time_step_limit;  // of the stability bound, contacts included [s]
    double time_step_wanted; // of the scene; 0: none
    double contact_barrier;  // hollow walls: stiffness that contact gains near a tool's axis, times
                             // contact_kappa
    bool unsafe_time_step;
    int substeps;        // per tick
    int auto_substeps;   // from more on "auto" is implicit; 0: not asked
    int finest_substeps; // at the finest level as loaded, if known: the maximum
    double h;            // tick / substeps [s]

    int64_t resets; // restores of the last good state
    int64_t step;   // ticks completed before the newest change of topology
};

// Returns the number of the next mesh.
static inline int topology_after(int topology)
{
    return topology < INT_MAX ? topology + 1 : 1;
}

// True if a positive number is ahead of another by less than half the range; 0 is no mesh.
static inline bool topology_is_newer(int topology, int than)
{
    const int ahead = topology - than;
    return than == 0 || (ahead > 0 && ahead <= INT_MAX / 2) || ahead < -(INT_MAX / 2);
}

// True if the topology can change while the body runs.
static inline bool body_changes(const Body *body)
{
    return body->ops->adapt != NULL || body->ops->cut != NULL || body->ops->tear != NULL;
}

// Returns the number of pieces: different values of BodyMesh.piece. Not for the step thread.
int body_count_pieces(const BodyMesh *mesh);

// Parameters that SET can change for every body while a scene runs; plain data, part of the state.
typedef struct BodyParameters {
    double gravity[3]; // world frame [m/s2]
    double stiffness_scale, damping_scale;
} BodyParameters;

// Returns the parameters as loaded: scales of 1.
static inline BodyParameters body_parameters(Vec3 gravity)
{
    return (BodyParameters){{gravity.x, gravity.y, gravity.z}, 1.0, 1.0};
}

// Implements BodyOps.set for these; returns false for others, and for damping without a damped
// kernel.
bool body_parameters_set(BodyParameters *parameters, bool damped, BodyParameter parameter,
                         double value);
// Implements BodyOps.get likewise.
bool body_parameters_get(const BodyParameters *parameters, bool damped, BodyParameter parameter,
                         double *value);

// --- options ---
// What a body of any model is created from; the options of each model begin with these.

typedef struct BodyOptions {
    const char *name;
    int levels;     // surface: finest level of detail; voxel: coarsest level of elements; from 0
    bool cuttable;  // blades can cut it
    bool removable; // and tools take it away: the scene has a remover
    IntegratorKind integrator;
    double time_step; // [s]; 0: from the stability bound
    bool unsafe_time_step;
    double contact_ratio, contact_damping, friction; // see body/body.h
    int node_capacity, face_capacity; // most in use at the same time; 0: enough for all levels. Of
                                      // a voxel body that can be cut: vertices and outer triangles
    int fixed_count;
    const FixedRegion *fixed;
    int watch_count; // of a body that can be cut: regions of its account
    const WatchedRegion *watch;
    // Initial state [m], [m/s], or NULL: at rest; [initial_count] in mesh order, of a voxel body by
    // ascending vertex id. A surface body has one for each node of its mesh.
    int initial_count;
    const Vec3 *initial_position, *initial_velocity;
    Vec3 gravity;
    Precision precision;   // of the kernels: single is faster, double is the reference
    bool without_contacts; // nothing can touch or attach to it: no arrays for such forces
    bool without_loads;    // no loads can act on it: no array for external forces
    bool estimate_error;   // BodyOps.estimate may be called: reserves what it needs
    double adapt_error;    // relative error to which a body that adapts steers its detail, with
                           // estimate_error; the round under way is then part of its state. 0: none
    const char *isa;       // "auto" or a name of isa.h
    Team *team;            // shares the work of large bodies; NULL: one thread; outlives the body
} BodyOptions;

// An isotropic elastic material, of bodies that are made of elements.
typedef struct SolidMaterial {
    double youngs_modulus; // E [Pa]
    double poisson_ratio;  // nu, [0, 0.49]; 0 with the law of Miyazaki et al. 2004
    double density;        // rho [kg/m3]
    // Tension at rest, which opens cuts of solids [Pa], and its direction in the world at load, of
    // any length; 0: the same in all directions.
    double prestress;
    Vec3 prestress_axis;
} SolidMaterial;

// Returns a body with the fields that follow from the options; the model sets the others.
static inline Body body_of_options(const BodyOptions *options, const BodyOps *ops, void *model)
{
    Body body = {
        .ops = ops,
        .model = model,
        .integrator = options->integrator,
        .contact_share = 1.0,
        .bears = (double)INFINITY,
        .contact_ratio = options->contact_ratio,
        .contact_damping = options->contact_damping,
        .tuning = {.friction = options->friction, .stiffness_scale = 1.0, .damping_scale = 1.0},
        .time_step_wanted = options->time_step,
        .unsafe_time_step = options->unsafe_time_step,
    };
    snprintf(body.name, sizeof body.name, "%s", options->name);
    return body;
}

// --- figures for people ---
// Dimensions of a body's surface: its box, and the number of fixed nodes. Load time only.

typedef struct BodyOutline {
    int nodes, fixed; // of the surface that tools act on
    Box box;          // [m]
} BodyOutline;

BodyOutline body_outline(const Body *body);

// Estimates the time of a body's tick before it runs. Load time only.

// Returns the seconds of a tick of `substeps`, pressed by a probe, on one core of 2 GHz. Calibrated
// with the tables of the front page ("Tuning"), within a third for walls and within a factor of 1.8
// for solids. Not measured on this machine.
double cost_tick(const Body *body, int substeps);

// Returns the least time of an implicit wall with so many springs [s].
double cost_implicit(int springs);

// Budget of the bodies in a tick of 1 ms [s]; the rest is for the machine and messages.
#define COST_BUDGET 6e-4

#endif
