// SPDX-License-Identifier: MIT
// Private to the module sim: the data of an attachment. grip.c is the law, attachment_nodes.c knows
// which nodes are held.
#ifndef PLIANT_SIM_ATTACHMENT_DATA_H
#define PLIANT_SIM_ATTACHMENT_DATA_H

#include "sim/hold/attachment.h"

// A known node: held, or so near that nodes created between it and others may have to be held.
typedef struct HeldNode {
    Vec3 local;   // in the frame [m]
    double share; // 1: held, or 0
} HeldNode;

// A held point of a face; whole words: no padding in the state.
typedef struct HeldPoint {
    int64_t face;
    double weight[3]; // barycentric
    Vec3 local;       // in the frame [m]
} HeldPoint;

// Plain data, part of the state.
typedef struct HoldState {
    int64_t holding; // 0 or 1; a grasper that holds nothing knows no nodes
    int64_t closed;  // of graspers: its jaws
    int64_t muted;   // of graspers: no contact with the body
    int64_t count;   // known nodes, ascending
    int64_t points;
    int64_t slips;   // of graspers: places have moved in this tick
    double ease;     // of graspers: time until what they hold is released [s]; 0: not soon
    double strength; // what they pulled when that began [N]
} HoldState;

struct Attachment {
    AttachmentOptions options;
    const ToolOptions *tool; // NULL: the world
    Body *body;
    int capacity; // of nodes
    bool grasper; // else the nodes of a region, which stay the same whether held or not
    bool changes; // the body's topology can change
    bool of_tie;  // made by message: belongs to a body from time to time

    // --- part of the state; 0 beyond what is in use ---
    HoldState *hold;
    int *node;        // [capacity]
    HeldNode *held;   // [capacity]
    HeldPoint *point; // [HELD_POINTS], graspers only

    // --- of an evaluation ---
    ToolPlacement at;            // of the frame
    int *carrier, carrier_count; // nodes on which springs act
    double *demand;              // mass that the springs of a carrier hold [kg]
    Vec3 *x, *v, *f;             // of the carriers
    Vec3 force;                  // on the frame, applied last

    // --- scratch ---
    Vec3 *unused;             // [ends], of implicit springs: positions that are not needed
    int *found;               // [surface.node_count]
    uint64_t *mark;           // one bit per node: all 0 between calls
    HeldNode *given;          // [surface.node_count] where the topology changes
    Vec3 before[HELD_POINTS]; // positions of the points before the change [m]

    // --- of the tick, and accounting ---
    ContactSums sums;
    int64_t taken, refused, slipped;
};

// Finds the free outer nodes in the region, ascending, in memory that the caller frees (also after
// a failure). Load time. Returns false with a status if there are none, or for invalid node
// numbers.
bool attachment_find_region(const Body *body, const FixedRegion *region, int **node, int *count,
                            Status *status);
// Returns the capacity for the nodes that `count` nodes may become.
int attachment_region_capacity(const Body *body, int count);

// True if a position in the frame is within the grasper's capsules.
bool attachment_is_within(const Attachment *attachment, Vec3 local);
// Returns the current position of a point [m].
Vec3 attachment_point(const Attachment *attachment, const HeldPoint *point);
// Grasps the nodes within the capsules, or those of the region, and counts the grasp.
void attachment_take(Attachment *attachment, Vec3 position, Quat orientation);
void attachment_release(Attachment *attachment);

// --- grip.c ---
// Time in which the force of jaws that open falls to zero [s].
#define GRIP_EASE_TIME 0.02
// Begins to release, at the tool's pose at the start of the tick.
void grip_open(Attachment *attachment, Vec3 position, Quat orientation);
void grip_begin_tick(Attachment *attachment, Vec3 position, Quat orientation, double tick);

// True if no part of the body is within the capsules.
bool attachment_is_clear(Attachment *attachment, Vec3 position, Quat orientation);

#endif
