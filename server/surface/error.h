// SPDX-License-Identifier: MIT
// The error of a wall's faces: what would change if each of them were divided once more
// (README.md, "The error of the faces"). Private to the surface module.
//
// A round copies the state, puts the midpoints of all edges where subdivision puts them, and finds
// the forces that the finer wall would not balance (its defect). Some steps of conjugate gradients
// then move the finer wall towards its own equilibrium. The correction is kept for the next round,
// which goes on from it, so that it converges while the body is at rest. Step thread: no
// allocation, bounded by the budget of a call, except for the copy of the rows.
#ifndef PLIANT_SURFACE_ERROR_H
#define PLIANT_SURFACE_ERROR_H

#include "base/sym3.h"
#include "geometry/edges.h"
#include "surface/model.h"
#include "surface/network.h"

// A spring between two nodes of a wall: stiffness [N/m], length at rest [m].
typedef struct ErrorLink {
    int node[2];
    double stiffness, length;
} ErrorLink;

// A hinge: the ends of its edge, and the third nodes of its left and right face; k [N m], angle at
// rest [rad].
typedef struct ErrorHinge {
    int node[4];
    double stiffness, angle;
} ErrorHinge;

// The springs and hinges of the wall as it is, or of the finer one.
typedef struct ErrorNet {
    ErrorLink *link;
    ErrorHinge *hinge;
    int link_count, hinge_count;
} ErrorNet;

// Tangents of a link and of a hinge of the finer wall.
typedef struct ErrorPull {
    Vec3 along;        // unit vector from the second node to the first
    double along_k, k; // stiffness along it, and across [N/m]
} ErrorPull;
typedef struct ErrorTurn {
    Vec3 slope[3]; // of the angle with nodes 1 to 3 [1/m]; that of node 0 balances them
} ErrorTurn;

// How a face pushes a tool, and is pushed by it.
typedef struct ErrorPush {
    int node[3], tool;
    double weight[3]; // of the nodes where it is nearest to the tool's axis
    Vec3 normal;      // from there to the axis
    double force, k;  // along the normal, and its derivative by the depth [N], [N/m]
} ErrorPush;

// A node of the finer wall: one of the wall itself, or the midpoint of an edge.
typedef struct ErrorNode {
    int model;     // node of the body; -1: a new midpoint
    int parent[2]; // of a midpoint, also of one that hangs; -1: none
    int wing[2];   // the nodes opposite the edge; -1: none
    int keep;      // index in `kept`: that of the node of the body that it is, or will be
    // 0 or 1, the last ones always 0: without them some bytes of the state would be undefined.
    unsigned char hangs; // in the wall itself
    unsigned char tied;  // hangs in the finer wall: stays between its parents
    unsigned char fixed, none[5];
    double area;    // of the wall itself, 0 for a new midpoint [m2]
    double carried; // the same, with that of what hangs between others [m2]
    double finer;   // of the finer wall [m2]
    Vec3 rest[2];   // in the wall itself, and in the finer one [m]
} ErrorNode;

// The stages of a round, in order. Those from START to TURN are repeated.
typedef enum ErrorStage {
    ERROR_GATHER,          // list both walls, after a change of topology
    ERROR_COPY,            // of the rows
    ERROR_PLACE,           // put the nodes of the finer wall
    ERROR_COARSE_LINKS,    // forces in the wall itself
    ERROR_COARSE_HINGES,   //
    ERROR_COARSE_PRESSURE, //
    ERROR_COARSE_TOUCH,    //
    ERROR_COARSE_PUSH,     //
    ERROR_COARSE_HOLD,     //
    ERROR_REACH,           // how far tools reach that hold something
    ERROR_SPREAD,          // what balances those forces, for the finer wall
    ERROR_BEGIN,           // forces in the finer wall
    ERROR_PRESSURE,        //
    ERROR_SWELL,           //
    ERROR_LINKS,           //
    ERROR_HINGES,          //
    ERROR_TOUCH,           //
    ERROR_PUSH,            //
    ERROR_HAND,            //
    ERROR_PREPARE,         // first direction
    ERROR_START,           // stiffness times direction
    ERROR_PRODUCT_LINKS,   //
    ERROR_PRODUCT_HINGES,  //
    ERROR_PRODUCT_PUSHES,  //
    ERROR_GROW,            //
    ERROR_RESIST,          //
    ERROR_PASS,            //
    ERROR_CURVATURE,       //
    ERROR_MOVE,            // a step
    ERROR_TURN,            // next direction
    ERROR_SUM,             // what was found
    ERROR_STAGES,
} ErrorStage;

enum { ERROR_FIRST = 6 }; // rounds after which an error is known, however slowly it grows

typedef struct SurfaceError {
    // --- constant ---
    SurfaceOptions options;
    LevelRules own_rules;
    const LevelRules *rules;
    const Levels *levels;
    Levels own_levels;  // of a body without levels
    const Vec3 *middle; // [edges of the finest level] where subdivision puts their midpoints [m]
    int edge_base[LEVELS_MAX + 2];
    double bending;       // D [N m]; 0: none
    double hold, inertia; // per area, against all motion: of shape springs and masses [N/m3]
    int node_capacity, leaf_capacity;

    // --- what is compared: the wall as it was when the round began ---
    int64_t topology; // -1: none
    int level, at;    // progress of gathering
    ErrorNet net[2];  // the wall itself, the finer one
    ErrorNode *node;  // [node_count]
    int node_count;
    int full;       // 1: it has more nodes
    int (*face)[6]; // [face_count] corners of the leaves, midpoints of their edges
    int face_count;
    double rest_volume[2]; // of a cavity, with the faces as they are and with finer ones [m3]
    int *tied;             // [tied_count] nodes
    int tied_count;
    double order; // by how much errors are larger than what one more level changes
    int *of_node; // [nodes of the body] or -1
    int *of_edge; // [edges of all levels] midpoints, or -1
    int *of_lip;  // [edges of the finest level] of the right side of a broken edge

    // --- a round ---
    ErrorStage stage;
    int next, iteration;
    char *rows;        // copy of the body's rows
    Vec3 *coarse;      // [node_count] forces in the wall itself [N]
    Vec3 *density;     // [node_count] what balances them [N/m2]
    Vec3 *x;           // [node_count] where nodes of the finer wall are put [m]
    Vec3 *moved;       // [node_count] how far they have moved from there, over all rounds [m]
    Vec3 *defect;      // [node_count] forces that the finer wall does not balance [N]
    Vec3 *way;         // [node_count] direction of the step
    Vec3 *change;      // [node_count] stiffness times that; then the defect over the diagonal
    Sym3 *diagonal;    // [node_count] of the stiffness [N/m], then its inverse
    ErrorPull *pull;   // [links of the finer wall]
    ErrorTurn *turn;   // [hinges of the finer wall]
    signed char *tool; // [node_count] that holds it, or -1
    ErrorPush *push;   // [push_count] of faces of the wall itself, then of the finer one
    int push_count, push_capacity;
    Vec3 *swell;                       // of a cavity: dV/dx of the finer wall [m2]
    double stiffness;                  // BodyTuning.stiffness_scale of the finer wall's tangents
    double volume[2], pressure, yield; // of a cavity [m3], [Pa], - dp/dV [Pa/m3]
    double grows;                      // dV/dx times the direction
    double product[2], curvature;      // of defect and direction, before and after a step
    int tool_count;
    Vec3 tool_at[ERROR_TOOLS];                              // points of their axes [m]
    Vec3 tool_force[ERROR_TOOLS];                           // on them [N]
    double tool_size[ERROR_TOOLS], tool_reach[ERROR_TOOLS]; // [m]
    double tool_kappa[ERROR_TOOLS];                         // ErrorQuestion.kappa
    Vec3 tool_coarse[ERROR_TOOLS], tool_finer[ERROR_TOOLS]; // that both walls give [N]
    Vec3 tool_rest[ERROR_TOOLS];                            // friction and damping over the pushes
    double tool_pushes[ERROR_TOOLS];                        // sum of pushes of the wall itself [N]
    Vec3 tool_slope[ERROR_TOOLS]; // change of its force along the direction
    double barrier;               // ErrorQuestion.barrier
    // Area, and squares of errors, displacements and their changes since the last round times area.
    double sums[4];
    // --- of complete rounds ---
    // Where lists made again begin: how far nodes of the body and midpoints of its edges, those of
    // the finest ones last, have moved; 0: not known [m].
    Vec3 *kept; // [keep_count]
    int keep_count;
    Vec3 *was;           // [nodes of the body] displacement [m]
    double size_of_last; // rms of errors [m]
    double growth;       // since the round before, less what is due to motion [m]
    int rounds;          // complete, up to ERROR_FIRST

    // --- what is shown of the last complete round, and what the present one writes ---
    float *size[2];   // [nodes of the body] of their errors [m]
    float largest[2]; // [m]
    int shown;        // which of them

    bool driven; // by its error: the round is part of the state
} SurfaceError;

// Load time, of a body with BodyOptions.estimate_error, once all else is created.
void surface_error_create(SurfaceModel *model, const TriMesh *mesh, const SpringNetwork *network,
                          const SurfaceOptions *options, Arena *arena);
// BodyOps.estimate and .snapshot_error.
bool surface_estimate(void *self, const ErrorQuestion *question, int budget, BodyError *error);
void surface_snapshot_error(const void *self, int first, int end, unsigned char *share);

// --- error_state.c: of bodies that are driven by their error ---
enum { SURFACE_ERROR_MOST = 1000 }; // iterations that a state may claim
// Load time: adds the round to the state.
void surface_error_list(SurfaceModel *model, const char *name, StateList *state);
// True if the round belongs to the body's topology; ask before a restored body gets another number.
bool surface_error_is_current(const SurfaceModel *model);
// After the body was restored: makes the lists again.
void surface_error_restored(SurfaceModel *model, bool is_current);
// True if the round is one that the body can have.
bool surface_error_check(const SurfaceModel *model);

// --- error_mesh.c ---
// Forgets what is compared.
void surface_error_forget(SurfaceError *error);
// Forgets the numbers of midpoints.
void surface_error_forget_edges(SurfaceError *error);
// Adds a leaf, with its midpoints, springs and hinges.
void surface_error_add_leaf(const SurfaceModel *model, int level, int face);
// Returns the angle of a hinge between these points [rad].
double surface_error_angle(const Vec3 x[4]);
// Returns the volume between a face and the origin [m3].
double surface_error_volume(Vec3 a, Vec3 b, Vec3 c);
// Writes the corners of child k of a face with its midpoints.
void surface_error_child(const int face[6], int k, int corner[3]);

// --- error_force.c, error_touch.c, error_solve.c ---
// The stages, each for a part of its list.
typedef void ErrorPart(const SurfaceModel *model, int first, int end);
ErrorPart surface_error_place, surface_error_coarse_links, surface_error_coarse_hinges,
    surface_error_coarse_pressure, surface_error_coarse_touch, surface_error_coarse_push,
    surface_error_coarse_hold, surface_error_reach, surface_error_spread, surface_error_begin,
    surface_error_pressure, surface_error_swell, surface_error_links, surface_error_hinges,
    surface_error_touch, surface_error_push, surface_error_hand;
ErrorPart surface_error_prepare, surface_error_start, surface_error_product_links,
    surface_error_product_hinges, surface_error_product_pushes, surface_error_grow,
    surface_error_resist, surface_error_pass, surface_error_curvature, surface_error_move,
    surface_error_turn;
// Returns where a node is in the wall itself [m].
Vec3 surface_error_coarse_place(const SurfaceModel *model, int node);
// Adds the forces of a hinge with a moment [N m].
void surface_error_turn_by(const ErrorHinge *hinge, double moment, const Vec3 slope[3],
                           Vec3 *force);
// Lists the pushes of some faces of the wall itself (0), or of the finer one (1).
void surface_error_touches(const SurfaceModel *model, int which, int first, int end);
// Finds the tangents of the finer wall again, which follow from where its nodes are put.
void surface_error_tangents(const SurfaceModel *model);
// Returns what resists all motion of an area of the wall [N/m3].
double surface_error_floor(const SurfaceError *error);

#endif
