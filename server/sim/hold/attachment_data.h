// SPDX-License-Identifier: MIT
// Private to the module sim: the data of an attachment. grip.c is the law of springs to a frame,
// joint.c that of springs to another body, attachment_nodes.c knows which nodes are held.
#ifndef PLIANT_SIM_ATTACHMENT_DATA_H
#define PLIANT_SIM_ATTACHMENT_DATA_H

#include "sim/facet.h"
#include "sim/hold/attachment.h"

// A known node: held, or so near that nodes created between it and others may have to be held.
typedef struct HeldNode {
    Vec3 local;   // in the frame [m]
    double share; // 1: held; 0: not; between: leaves jaws, pulled with so much of max_force at most
} HeldNode;

// A held point of a face; whole words: no padding in the state.
typedef struct HeldPoint {
    int64_t face;
    double weight[3]; // barycentric; of one that leaves jaws, times its share (HeldNode)
    Vec3 local;       // in the frame [m]
} HeldPoint;

// A spring to a point of another body; likewise whole words.
typedef struct Tie {
    int64_t node;              // of the body
    int64_t face;              // of the other
    FacetPlace end;            // on the face
    double stiffness, damping; // [N/m], [N s/m]
} Tie;

// What holds a node, by what is at the other end of its spring: how it follows a topology.
typedef struct HoldRow {
    size_t size;                      // of the rows, HeldNode or Tie
    bool (*carries)(const void *row); // else the node is known only
    // Make the row of a new node from those of its parents, and of a parent from that of a node
    // that went (`known`: its own, or NULL). Return false if it gets none.
    bool (*between)(const Attachment *attachment, const NodeBirth *born, const void *from,
                    const void *to, void *row);
    bool (*inherit)(Attachment *attachment, int parent, const void *went, const void *known,
                    void *row);
} HoldRow;
extern const HoldRow FRAME_ROW, FACET_ROW;

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
    const ToolOptions *tool; // NULL: the world, or a body
    Body *body, *other;      // other: to whose faces it is held, by ties; NULL: to a frame
    const HoldRow *row;
    int capacity; // of nodes
    bool grasper; // else the nodes of a region, which stay the same whether held or not
    bool changes; // the body's topology can change
    bool of_tie;  // made by message: belongs to a body from time to time

    // --- part of the state; 0 beyond what is in use ---
    HoldState *hold;
    int *node;        // [capacity]
    HeldNode *held;   // [capacity]
    HeldPoint *point; // [HELD_POINTS], graspers only
    int64_t *ties;
    Tie *tie; // [capacity] by node

    // --- of an evaluation ---
    ToolPlacement at;            // of the frame
    int *carrier, carrier_count; // nodes on which springs act
    double *demand;              // mass that the springs of a carrier hold [kg]
    Vec3 *x, *v, *f;             // of the carriers
    Vec3 force;                  // on the frame, applied last
    // The other ends of ties: three corners each, with their positions, velocities and forces.
    int *corner;
    Vec3 *corner_x, *corner_v, *corner_f;

    // --- scratch ---
    Vec3 *unused;   // [ends], of implicit springs: positions that are not needed
    int *found;     // [surface.node_count]
    uint64_t *mark; // one bit per node: all 0 between calls
    char *given;    // [surface.node_count] rows, where the topology changes
    double *pulls;  // [surface.node_count of the other] sums of e_j (joint.c)
    Vec3 *before;   // where points of faces, and other ends of ties, were before the change [m]

    // --- of the tick, and accounting ---
    ContactSums sums;
    int64_t taken, refused, slipped;
};

// Returns the share of a point; rounding apart its weights sum up to 1, or to less than
// LEAVES_BELOW.
#define LEAVES_BELOW (1.0 - 1e-6)
static inline double held_point_share(const HeldPoint *point)
{
    const double sum = point->weight[0] + point->weight[1] + point->weight[2];
    return sum > LEAVES_BELOW ? 1.0 : sum;
}

static inline void attachment_read_face(const Body *body, int64_t face, Vec3 x[3])
{
    body->ops->read_nodes(body->model, body->surface.face[face], 3, x, NULL);
}

// True if a number is that of a face, and no free slot.
bool attachment_is_face(const BodySurface *surface, int64_t face);
// Finds the nearest of the faces that replaced one, and the weights of its point nearest to `at`.
// Returns FACE_STAYS if none did, FACE_ENDS if its matter is gone.
enum { FACE_STAYS = -2, FACE_ENDS = -1 };
int64_t attachment_heir(const Body *body, const TopologyChange *change, int64_t face, Vec3 at,
                        double weight[3]);

// True if a position in the frame is within the grasper's capsules.
bool attachment_is_within(const Attachment *attachment, Vec3 local);
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

// --- joint.c ---
// Ties nodes, ascending, to the nearest faces of the other body; returns false with a status for
// one that is too far away. Load time.
bool joint_tie(Attachment *joint, const int *node, int count, Status *status);
// Returns the current position of the other end [m].
Vec3 joint_end(const Attachment *joint, const Tie *tie);
// Moves ends to the faces that replaced theirs; their positions stay.
void joint_other_changed(Attachment *joint, const TopologyChange *change);
// True if a tie of the state is sensible; its node and face exist.
bool joint_is_sensible(const Tie *tie);

#endif
