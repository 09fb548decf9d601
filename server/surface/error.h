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

// A node of the finer wall: one of the wall itself, or the midpoint of an edge.
typedef struct ErrorNode {
    int model;     // node of the body; -1: a new midpoint
    int parent[2]; // of a midpoint, also of one that hangs; -1: none
    int wing[2];   // the nodes opposite the edge; -1: none
    bool hangs;    // in the wall itself
    bool tied;     // hangs in the finer wall: stays between its parents
    bool fixed;
    double area;  // of the wall itself, 0 for a new midpoint [m2]
    double finer; // of the finer wall [m2]
    Vec3 rest[2]; // in the wall itself, and in the finer one [m]
} ErrorNode;

typedef enum ErrorStage {
    ERROR_GATHER,
    ERROR_COPY,
    ERROR_PLACE,
    ERROR_COARSE_LINKS,
    ERROR_COARSE_HINGES,
    ERROR_SPREAD,
    ERROR_LINKS,
    ERROR_HINGES,
    ERROR_PREPARE,
    ERROR_PRODUCT_LINKS,
    ERROR_PRODUCT_HINGES,
    ERROR_CURVATURE,
    ERROR_MOVE,
    ERROR_TURN,
    ERROR_SUM,
    ERROR_SHARE,
} ErrorStage;

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

    // --- what is compared; valid for one topology ---
    int64_t topology; // -1: none
    int level, face;  // progress of gathering
    ErrorNet net[2];  // the wall itself, the finer one
    ErrorNode *node;  // [node_count]
    int node_count;
    bool full;
    int *of_node; // [nodes of the body] or -1
    int *of_edge; // [edges of all levels] midpoints, or -1
    int *of_lip;  // [edges of the finest level] of the right side of a broken edge

    // --- a round ---
    ErrorStage stage;
    int next, iteration;
    char *rows;         // copy of the body's rows
    Vec3 *coarse;       // [node_count] forces in the wall itself [N]
    Vec3 *x, *moved;    // positions in the finer wall, and how far from where they were put [m]
    Vec3 *rest_force;   // [N] r
    Vec3 *way, *change; // p, K p
    Sym3 *inverse;
    ErrorPull *pull;
    ErrorTurn *turn;
    signed char *tool;         // [nodes] that holds it, or -1
    double product, curvature; // r z, p K p
    double step, ratio;
    double sums[4];
    int tool_count;
    Vec3 tool_at[ERROR_TOOLS], tool_force[ERROR_TOOLS], taken[ERROR_TOOLS];
    double tool_size[ERROR_TOOLS];

    // --- the last complete round ---
    float *size; // [nodes of the body] of its error [m]
    float largest;
} SurfaceError;

// Load time, of a body with BodyOptions.estimate_error, once all else is created.
void surface_error_create(SurfaceModel *model, const TriMesh *mesh, const SpringNetwork *network,
                          const SurfaceOptions *options, Arena *arena);
// BodyOps.estimate and .snapshot_error.
bool surface_estimate(void *self, const ErrorQuestion *question, int budget, BodyError *error);
void surface_snapshot_error(const void *self, unsigned char *share);

// --- error_mesh.c ---
// Forgets what is compared.
void surface_error_forget(SurfaceError *error);
// Adds a leaf, with its midpoints, springs and hinges.
void surface_error_add_leaf(const SurfaceModel *model, int level, int face);
// Returns the angle of a hinge between these points [rad].
double surface_error_angle(const Vec3 x[4]);

#endif
