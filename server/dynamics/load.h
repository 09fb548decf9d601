// Constant forces on sets of nodes for a while: a scene's loads and load_t messages. Called by
// sim.c.
#ifndef PLIANT_DYNAMICS_LOAD_H
#define PLIANT_DYNAMICS_LOAD_H

#include "base/arena.h"
#include "base/state.h"
#include "dynamics/body.h"

enum { LOAD_CAPACITY = 64 }; // in force at a time

// A load in force: plain data, part of the state. Its nodes lie in the pool.
typedef struct Load {
    int64_t end_step;     // first tick without it
    Vec3 force;           // total [N]
    Vec3 center;          // of the sphere in which it found its nodes [m]
    double radius;        // [m]
    double area;          // of the nodes taken [m2]
    int64_t first, count; // in the pool
} Load;

// Bad ticks that somebody is to blame for (guard.h); plain data, part of the state, 0: none yet.
typedef struct Blame {
    int64_t since, last; // ticks of the first and the newest of them, counted from 1
    int64_t count;
} Blame;

// Who a load is; plain data, part of the state, all 0: one of the scene's, with nothing to blame.
typedef struct LoadRecord {
    int64_t sender, id; // of the message
    Blame blame;
} LoadRecord;

// What a load knows of a node that may have a part in it.
typedef struct LoadNode {
    Vec3 start;   // where it was when the load began [m]
    double share; // 1: inside, or 0
} LoadNode;

// A load is a traction: its force is shared in proportion to nodal area. On bodies that change it
// acts on a patch of the surface, whatever the level: a node that comes is taken when it would have
// lain inside the sphere at the start, between its parents, so the pool also holds the nodes
// around. Those that go leave their share to the others; the sum of the forces stays.
typedef struct LoadSet {
    int64_t *count;     // loads in force
    int64_t *used;      // pool entries in use
    Load *load;         // [LOAD_CAPACITY]
    LoadRecord *record; // [LOAD_CAPACITY] of the loads in force, 0 beyond
    int *pool; // [pool_capacity] nodes, counted on from body to body; 0 beyond `used`. On bodies
               // that change they ascend
    int pool_capacity;

    // Only where a body changes (body_changes), else NULL.
    LoadNode *node;  // [pool_capacity] of the pool's nodes: part of the state, 0 beyond `used`
    LoadNode *given; // [node places of the largest body] scratch
    uint64_t *mark;  // a bit a node that has been `given`: all 0 between calls
} LoadSet;

void loads_create(LoadSet *set, const Body *bodies, int body_count, Arena *arena, StateList *state);
// Takes the nodes inside the sphere now, of one body or (body < 0) of all. False with a sentence.
bool loads_start(LoadSet *set, Body *bodies, int body_count, int body, Vec3 center, double radius,
                 Vec3 force, int64_t end_step, char *why, size_t why_size);
// After the topology of a body has changed: nodes that came and went, areas. A load that finds the
// pool full does without the nodes of the highest numbers.
void loads_follow(LoadSet *set, Body *bodies, int body_count, int changed,
                  const TopologyChange *change);
// Whether a load pushes one of `node_count` nodes from `first_node` on, counted over all bodies.
bool loads_act_on(const LoadSet *set, int64_t load, int first_node, int node_count);
// Ends the loads whose time has come.
void loads_expire(LoadSet *set, Body *bodies, int body_count, int64_t step);
// Whether what a checkpoint has brought can be: loads act on places that have or had a node.
bool loads_check(const LoadSet *set, const Body *bodies, int body_count);
void loads_clear(LoadSet *set, Body *bodies, int body_count);

#endif
