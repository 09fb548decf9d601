// Private to the dynamics room: what an attachment holds. attachment.c is the law,
// attachment_take.c takes hold, attachment_follow.c keeps hold when the topology changes.
#ifndef PLIANT_DYNAMICS_ATTACHMENT_DATA_H
#define PLIANT_DYNAMICS_ATTACHMENT_DATA_H

#include "dynamics/attachment.h"

// What is known of a node: held, or near enough that what comes between it and others may
// have to be.
typedef struct HeldNode {
    Vec3 place;   // in the frame [m]
    double share; // 1: held, or 0
} HeldNode;

// A point of a face that is held; whole words: no padding in the state.
typedef struct HeldPoint {
    int64_t face;
    double weight[3]; // of its corners
    Vec3 place;       // in the frame [m]
} HeldPoint;

// Plain data, part of the state.
typedef struct HoldState {
    int64_t holding; // 0 or 1; a grasper that holds nothing knows nothing
    int64_t closed;  // of graspers: its jaws
    int64_t muted;   // of graspers: its contact with the body
    int64_t count;   // nodes known, ascending
    int64_t points;
} HoldState;

struct Attachment {
    AttachmentOptions options;
    const ToolOptions *tool; // NULL: the world
    Body *body;
    int capacity; // of nodes
    bool grasper; // else a region's nodes, which stay the same whether they are held or not
    bool changes; // the body's topology does

    // --- part of the state; 0 beyond what is in use ---
    HoldState *hold;
    int *node;        // [capacity]
    HeldNode *held;   // [capacity]
    HeldPoint *point; // [HELD_POINTS], graspers only

    // --- of an evaluation ---
    Vec3 *x, *v, *f; // [capacity + 3 HELD_POINTS] nodes, then the points' corners
    int corner[3 * HELD_POINTS];
    Vec3 force, moment, middle; // on the frame; about sums.about; sum of |f| x
    double size;                // sum of |f| [N]

    // --- scratch ---
    int *found;               // [surface.node_count], graspers only
    uint64_t *mark;           // a bit a node: all 0 between calls
    HeldNode *given;          // [surface.node_count] where the topology changes
    Vec3 before[HELD_POINTS]; // where the points were before it did [m]

    // --- of the tick, and accounting ---
    ContactSums sums;
    int64_t taken, refused;
};

static inline bool attachment_is_marked(const Attachment *attachment, int node)
{
    return (attachment->mark[node / 64] >> (node % 64) & 1) != 0;
}
static inline void attachment_mark(Attachment *attachment, int node)
{
    attachment->mark[node / 64] |= UINT64_C(1) << (node % 64);
}
static inline void attachment_unmark(Attachment *attachment, int node)
{
    attachment->mark[node / 64] &= ~(UINT64_C(1) << (node % 64));
}

// Load time. The free nodes of the outside in the region, ascending, in memory that the caller
// frees (also after a failure); false with a status: none, or numbers of nodes that are not there.
bool attachment_find_region(const Body *body, const FixedRegion *region, int **node, int *count,
                            Status *status);
// Room for what `count` nodes may become.
int attachment_region_capacity(const Body *body, int count);

// Whether a place in the frame lies within the grasper's capsules.
bool attachment_is_within(const Attachment *attachment, Vec3 place);
// Where a point is now [m].
Vec3 attachment_point(const Attachment *attachment, const HeldPoint *point);
// Takes hold of what lies within the capsules now, or of the region's nodes; counts.
void attachment_take(Attachment *attachment, Vec3 position, Quat orientation);
void attachment_let_go(Attachment *attachment);
// Whether no part of the body lies within the capsules.
bool attachment_is_clear(Attachment *attachment, Vec3 position, Quat orientation);

#endif
