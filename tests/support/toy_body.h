// SPDX-License-Identifier: MIT
// A body without physics, for tests of whatever follows a body's topology: a flat sheet that either
// splits and joins its edges on command, or is cut by blades. Nodes stay where they are put; forces
// and loads are added up, for the test to look at.
#ifndef PLIANT_TESTS_TOY_BODY_H
#define PLIANT_TESTS_TOY_BODY_H

#include "sim/sim.h"
#include "geometry/mesh.h"

#define TOY_DENSITY 4.2  // [kg/m2]
#define TOY_LAMBDA  1e5  // of the body as created [1/s2]; times 4 where anything is split
#define TOY_DAMPING 20.0 // likewise [1/s]

enum { TOY_CALLS = 4096 };

typedef struct Toy Toy;

// Edges that split: one level of midpoints, drawn without cracks. The midpoint of edge e is node
// base_nodes + e; face f of the mesh owns face slots 4 f .. 4 f + 3 and uses as many as it is drawn
// with.
typedef struct ToySplits {
    int edges;
    int (*corner)[3];     // [base_faces]
    int (*face_edge)[3];  // [base_faces] edge k joins corners k and (k + 1) % 3
    int (*parent)[2];     // [edges]
    Vec3 *rest;           // [base_nodes + edges]
    bool *split, *wanted; // [edges] the state

    // of the last change
    FaceChange *change; // [16 base_faces]
    int *gone, (*gone_parent)[2];

    // what the body does by itself, or NULL: before it adapts, and in each evaluation
    void (*decide)(Toy *toy), (*labour)(const Toy *toy);
} ToySplits;

// One call of BodyOps.cut.
typedef struct ToyCall {
    CutSweep sweep;
    int64_t under_way; // of its stroke
} ToyCall;

// Faces joined by links across edges: blades break links by the exact test, and the faces round a
// node that links still join share a copy of it.
typedef struct ToyCuts {
    int links;
    int (*link)[2];   // [links] the two faces, the lower one first
    int (*across)[3]; // [base_faces] link across edge k; -1: a border
    int node_limit;   // most nodes; what needs more is refused
    LinkFinder finder;

    // the state
    bool *broken;     // [links]
    int *used;        // nodes
    CutPoint *center; // [blades][base_faces] where links were when the last tick ended
    CutPoint *edge;   // [blades][2] likewise the blade
    int64_t *begun;   // [blades] 1: nothing was tested yet in this stroke

    // for the test to look at, to set and to clear
    ToyCall *call;                         // [TOY_CALLS], the first ones
    int calls, reconstructions, tear_next; // links [0, tear_next) are to be torn
    bool bad;                              // the next commit reports numbers that went bad
} ToyCuts;

struct Toy {
    int base_nodes, base_faces; // of the mesh
    int nodes, faces;           // slots
    ToySplits *splits;          // one of the two is NULL
    ToyCuts *cuts;

    // the state
    Vec3 *position;    // [nodes]
    Vec3 *load;        // [nodes] as added
    double *parameter; // [BODY_ADAPT_LEVEL + 1] as set last
    int (*face)[3];    // [faces] corners; state of a body that is cut, else derived

    // derived from the topology
    int (*neighbor)[3];                  // [faces]
    double *face_area, *finest_area;     // [faces]
    int *face_start, *face_end, *around; // faces around a node
    double *node_area, *node_mass;       // [nodes]

    NodeBirth *born; // of the last change
    Vec3 *force;     // [nodes] as added since the last toy_scene_step began
    int changes;     // of topology, since the creation
};

typedef struct ToyOptions {
    bool cuttable;  // cut by blades; else its edges split
    bool tears;     // if cuttable
    double quantum; // of the exact test, if cuttable [m]
    double size;    // of a cell, if cuttable [m]
} ToyOptions;

// A body on a mesh, as yet whole; what it has belongs to the arena.
Body toy_body(Toy **toy, const char *name, const TriMesh *mesh, const ToyOptions *options,
              Arena *arena, StateList *state);
// Moves a node, or all that are in use.
void toy_move_node(Toy *toy, int node, Vec3 by);
void toy_move(Toy *toy, Vec3 by);

// Splits or joins an edge when the body adapts next.
void toy_want(Toy *toy, int edge, bool split);
void toy_want_all(Toy *toy, bool split);
// Each edge with a chance of one in `odds`.
void toy_want_some(Toy *toy, int odds, uint64_t *random);
int toy_midpoint(const Toy *toy, int edge); // its node

int toy_broken(const Toy *toy); // links
int toy_pieces(const Toy *toy);

// A scene of one or two such bodies, "wall" and "twin".
typedef struct ToyScene {
    Arena arena;
    StateList state;
    TriMesh mesh;
    Sim *sim;
    int count;
    Body *body[2];
    Toy *toy[2];
} ToyScene;

typedef struct ToySceneOptions {
    int cells;   // the sheet: cells x cells squares round the origin in z = 0,
    double cell; // of this side [m]
    int count;   // of bodies; 0: one
    bool cuttable, tears;
    double rate_hz;
    double time_step; // [s]; 0: of the bound
    bool unsafe_time_step, may_load;
    bool lockstep;          // tools that are not moved stay, however long
    double contact_damping; // [s]
    int tool_count;
    const ToolOptions *tool;
} ToySceneOptions;

// A flat sheet of cells x cells squares of side `cell` [m], two triangles each, normal +z.
TriMesh toy_sheet(int cells, double cell);
// False with `status` when the scene is refused; to be destroyed all the same.
bool toy_scene_try(ToyScene *scene, const ToySceneOptions *options, Status *status);
void toy_scene_create(ToyScene *scene, const ToySceneOptions *options); // aborts when refused
// One body and one tool, in lockstep at 1 kHz.
void toy_scene_touched(ToyScene *scene, int cells, double cell, const ToolOptions *tool);
void toy_scene_destroy(ToyScene *scene);
// A tick; forces are those of this tick.
void toy_scene_step(ToyScene *scene);

#endif
