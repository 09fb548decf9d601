// SPDX-License-Identifier: MIT
// Constant forces on sets of nodes for a while: a scene's loads and load_t messages. Called by
// sim.c.
#ifndef PLIANT_SIM_LOAD_H
#define PLIANT_SIM_LOAD_H

#include "base/memory.h"
#include "body/body.h"
#include "sim/places.h"

enum { LOAD_CAPACITY = 64 }; // active at a time

// An active load: plain data, part of the state. Its nodes are in the pool.
typedef struct Load {
    int64_t end_step;     // first tick without it
    Vec3 force;           // total [N]
    Vec3 center;          // of the sphere in which its nodes were found [m]
    double radius;        // [m]
    double area;          // of the nodes taken [m2]
    int64_t first, count; // in the pool
} Load;

// Bad ticks with a known cause (sim.h); plain data, part of the state, 0: none yet.
typedef struct Blame {
    int64_t since, last; // ticks of the first and the newest of them, counted from 1
    int64_t count;
} Blame;

// Sender of a load; plain data, part of the state, all 0: one of the scene's, without bad ticks.
typedef struct LoadRecord {
    int64_t sender, id; // of the message
    Blame blame;
} LoadRecord;

// A load's data of a node that it may act on.
typedef struct LoadNode {
    Vec3 start;   // its position when the load began [m]
    double share; // 1: inside, or 0
} LoadNode;

// A load is a traction: its force is distributed in proportion to nodal area. On bodies that change
// it acts on a patch of the surface at any level: a new node is included if it would have been
// inside the sphere at the start, between its parents, so the pool also has the surrounding nodes.
// Removed nodes leave their share to the others; the sum of the forces is constant.
typedef struct LoadSet {
    int64_t *count;     // active loads
    int64_t *used;      // pool entries in use
    Load *load;         // [LOAD_CAPACITY]
    LoadRecord *record; // [LOAD_CAPACITY] of the active loads, 0 beyond
    int *pool; // [pool_capacity] nodes, counted on from body to body; 0 beyond `used`. On bodies
               // that change they ascend
    int pool_capacity;

    // Only where a body changes (body_changes), else NULL.
    LoadNode *node;  // [pool_capacity] of the pool's nodes: part of the state, 0 beyond `used`
    LoadNode *given; // [node places of the largest body] scratch
    uint64_t *mark;  // one bit per node in `given`: all 0 between calls
} LoadSet;

void loads_create(LoadSet *set, const Body *bodies, int body_count, Arena *arena, StateList *state);
// Takes the nodes inside the sphere, of one body or (body < 0) of all. Returns false with a
// sentence.
bool loads_start(LoadSet *set, Body *bodies, int body_count, int body, Vec3 center, double radius,
                 Vec3 force, int64_t end_step, char *why, size_t why_size);
// Follows a change of a body's topology: new and removed nodes, areas. If the pool is full, a load
// omits the nodes of the highest numbers.
void loads_follow(LoadSet *set, Body *bodies, int body_count, int changed,
                  const TopologyChange *change);
// True if a load pushes one of `node_count` nodes from `first_node` on, counted over all bodies.
bool loads_act_on(const LoadSet *set, int64_t load, int first_node, int node_count);
// Adds the nodes of a body that a load pushes; `first_node`: of the body.
void loads_add_places(const LoadSet *set, int64_t load, int first_node, Places *places);
// Ends the loads whose time is over.
void loads_expire(LoadSet *set, Body *bodies, int body_count, int64_t step);
// True if the state read from a checkpoint is consistent: loads act on slots that have or had a
// node.
bool loads_check(const LoadSet *set, const Body *bodies, int body_count);

#endif
