// SPDX-License-Identifier: MIT
// A body without physics whose published mesh changes at random: two levels below a small base
// mesh, drawn without cracks. For tests of whatever follows a mesh (messages, files, clients).
#ifndef PLIANT_TESTS_MESH_TOY_H
#define PLIANT_TESTS_MESH_TOY_H

#include "base/memory.h"
#include "body/body.h"
#include "geometry/mesh.h"

enum {
    TOY_LEVELS = 2,
    TOY_BASE_FACES = 8,
    TOY_FACES = 16 * TOY_BASE_FACES, // of the finest level; as many triangles can be drawn
    TOY_NODES = 128,
};

// All that changes; plain data.
typedef struct MeshToyState {
    uint64_t random;
    int64_t moves; // drifts so far: where nodes are
    bool refined[TOY_LEVELS][TOY_FACES];
    int topology, node_count, triangle_count; // as published
    int slot_of[TOY_NODES];                   // by node, -1: not in the mesh
    int id[TOY_NODES], origin[TOY_NODES], parent[TOY_NODES][2], piece[TOY_NODES];
    signed char level[TOY_NODES];
    int triangle[TOY_FACES][3];
} MeshToyState;

typedef struct MeshToy {
    // constant
    TriMesh base;
    int nodes; // of all levels
    int node_parent[TOY_NODES][2];
    signed char node_level[TOY_NODES];
    Vec3 rest[TOY_NODES];
    int face_count[TOY_LEVELS + 1];
    int face[TOY_LEVELS + 1][TOY_FACES][3];
    MeshToyState state;
} MeshToy;

// An octahedron, or (`open`) a square sheet of eight triangles, nowhere refined. Ids are not node
// numbers: 10 + number at level 0, 1000 - number below, so that slots, ids and ages differ in
// order. The arena is not used; destroy frees the base mesh.
void mesh_toy_create(MeshToy *toy, bool open, uint64_t seed);
void mesh_toy_destroy(MeshToy *toy);
// Refines and coarsens some faces at random; true when the mesh changed (its topology number then
// went up by one).
bool mesh_toy_change(MeshToy *toy);
// Everything refined that can be.
void mesh_toy_refine_all(MeshToy *toy);
BodyMesh mesh_toy_mesh(const MeshToy *toy);
// Where the nodes are after so many drifts: by slot, 0 in free ones.
void mesh_toy_positions(const MeshToy *toy, Vec3 *position);
// A body over the toy, its state listed: adapt changes it at random, drift moves it. `adapts`
// false: a body with one level of detail to all callers.
Body mesh_toy_body(MeshToy *toy, const char *name, bool adapts, StateList *state);

#endif
