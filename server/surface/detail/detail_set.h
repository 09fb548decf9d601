// SPDX-License-Identifier: MIT
// The set of refined faces, from which everything else about a body with levels follows, and what
// is derived from it about faces and nodes. Private to the surface module.
//
// Words: a face exists when its parent is refined, and is a leaf when it is neither refined itself
// nor removed.
// Leaves across an edge differ by at most one level. A node is on when it is a corner of a leaf. It
// is a midpoint of an edge of the level above. If only one of the faces at that edge is refined, it
// hangs: with adjust = "continuum" it stays in the middle of the edge's ends, its masters, which
// carry its forces and mass; with "choi2005" it moves freely.
#ifndef PLIANT_SURFACE_DETAIL_SET_H
#define PLIANT_SURFACE_DETAIL_SET_H

#include "geometry/levels.h"

struct DetailCut;

// A face, and the corner of it that a node is.
typedef struct Leaf {
    int level, face, corner;
} Leaf;

typedef enum NodeStatus { NODE_OFF, NODE_FREE, NODE_HANGING } NodeStatus;

typedef struct LeafSet {
    // --- constant ---
    Levels levels;
    bool constrained;                 // hanging nodes are constrained: adjust = "continuum"
    int face_base[LEVELS_MAX + 2];    // number of the first face of each level
    int edge_base[LEVELS_MAX + 2];    // number of the first edge of each level
    int *root_ring_start, *root_ring; // faces of level 0 around each of its nodes
    int node_count, face_count;       // nodes and faces of the finest level, copies included
    struct DetailCut *cut;            // NULL: not cuttable

    // --- part of the state ---
    unsigned char *refined; // [faces above the finest level]

    // --- derived from the bits ---
    unsigned char *status; // [node_count] NodeStatus
    int leaf_count[LEVELS_MAX + 1];

    // --- scratch ---
    Leaf *ring[LEVELS_MAX + 4]; // leaves around a node, by depth of use
} LeafSet;

bool detail_is_refined(const LeafSet *set, int level, int face);
bool detail_exists(const LeafSet *set, int level, int face);
// True if a face of the finest level is removed.
bool detail_is_gone(const LeafSet *set, int level, int face);
bool detail_is_leaf(const LeafSet *set, int level, int face);
// Returns the node of the uncut mesh that a node is, or is a copy of.
int detail_original(const LeafSet *set, int node);
// Returns a face's corners in the uncut mesh.
const int *detail_uncut(const LeafSet *set, int level, int face);
// Lists the leaves that have the node as a corner, in an order that depends on the hierarchy alone;
// returns their number.
int detail_leaves_around(const LeafSet *set, int node, Leaf *leaf);
// Returns the most leaves that can be around a node.
int detail_most_leaves(const LeafSet *set, int node);
// Returns the midpoint of an edge if it is on, else -1.
int detail_midpoint(const LeafSet *set, int level, int edge);
// Returns the status that the bits give the midpoint of an edge of `level`.
NodeStatus detail_status_of_midpoint(const LeafSet *set, int level, int edge);
// Returns the status that the bits give a node: of the uncut mesh, or one of the copies made so
// far.
NodeStatus detail_status(const LeafSet *set, int node);
// Returns the first of the slots of a face.
int detail_face_slot(const LeafSet *set, int level, int face);

#endif
