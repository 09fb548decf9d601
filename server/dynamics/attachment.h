// Springs that hold nodes of one body at places in a frame: that of a grasper that has closed on
// them, of another tool, or the world. Step thread.
//
// Each held node i is drawn to its place with k_i = g lambda_b m_i and damped with
// c_i = 2 zeta sqrt(g lambda_b) m_i, where lambda_b bounds M^-1 K of the body at its coarsest
// level: on their own, held nodes swing with sqrt(g lambda_b) and the damping ratio zeta, whatever
// their mass. Both matrices are diagonal, so one attachment adds at most g lambda_b to the bound of
// M^-1 K and 2 zeta sqrt(g lambda_b) to that of M^-1 C. Refinement divides masses among more nodes
// and leaves the sum of the springs as it was.
//
// A grasper that finds fewer than three nodes within its capsules holds points of faces instead:
// the point of face f nearest to its axis, with the mass that f has a share in,
// A_f min_i (m_i / sum of the areas at i), drawn with the weights of the point. The sum over the
// faces at a node is at most its mass, so the bound is the same. A node that hangs on others where
// two levels meet has no mass of its own: there m_i / sum of the areas is that of the body.
#ifndef PLIANT_DYNAMICS_ATTACHMENT_H
#define PLIANT_DYNAMICS_ATTACHMENT_H

#include "base/status.h"
#include "dynamics/contact.h"
#include "dynamics/fixed.h"

// Of a grasper's grip: it closes when the grip comes to GRIP_CLOSES and opens when it falls below
// GRIP_OPENS, so that a trembling finger does not let go.
#define GRIP_CLOSES 0.5
#define GRIP_OPENS  0.4

// Most that one attachment holds; more is left free and counted.
enum { HELD_NODES = 4096, HELD_POINTS = 128 };

typedef enum AttachTo {
    ATTACH_WORLD,   // held from the start, at rest
    ATTACH_TOOL,    // held while the tool is active, where the nodes are when it becomes so
    ATTACH_BODY,    // tied to points of another body (joint.h)
    ATTACH_GRASPER, // held while the grasper is closed
} AttachTo;

// As a scene describes it; constant. Of graspers made from their ToolOptions.
typedef struct AttachmentOptions {
    int body; // index
    AttachTo to;
    int tool;             // index, of ATTACH_TOOL and ATTACH_GRASPER; else -1
    int to_body;          // index, of ATTACH_BODY
    FixedRegion region;   // of the nodes; not of graspers
    double stiffness;     // g > 0
    double damping_ratio; // zeta >= 0
} AttachmentOptions;

typedef struct Attachment Attachment;

// What an attachment with these options adds to the bounds of the body: of M^-1 K [1/s2] and
// M^-1 C [1/s].
void attachment_bounds(const Body *body, double stiffness, double damping_ratio, double *lambda,
                       double *damping);

// Load time. `name` is "body/grasp7" in lists of arrays; the body and the tool (NULL: none) outlive
// the attachment. NULL with a status: a region without a free node.
Attachment *attachment_create(const char *name, const AttachmentOptions *options,
                              const ToolOptions *tool, Body *body, Arena *arena, StateList *state,
                              Status *status);
const AttachmentOptions *attachment_options(const Attachment *attachment);
// The most entries that one evaluation can push, for BodyOps.reserve_forces.
int attachment_node_capacity(const Attachment *attachment);

// Once a tick: takes hold and lets go as the tool asks for, where it stands when the tick begins.
// `active`: it is there at all (the world always is).
void attachment_begin_tick(Attachment *attachment, bool active, double grip, Vec3 position,
                           Quat orientation);
bool attachment_is_holding(const Attachment *attachment);
// A grasper's capsules do not push the body that it holds, nor one that it has let go until they
// have been clear of it: what was held lies inside them.
bool attachment_mutes_contact(const Attachment *attachment);

// At every stage: the springs' forces with the frame at `at`; their sum on the frame [N].
Vec3 attachment_evaluate(Attachment *attachment, const ToolPlacement *at);
// Adds `scale` times these forces to the nodes, for that evaluation; `share` of a force is its
// impulse [s].
void attachment_apply(Attachment *attachment, double scale, double share);
// Sums of the tick, for the wrench; normal and depth stay zero.
const ContactSums *attachment_sums(const Attachment *attachment);

// Before a change of topology may come; and after it came.
void attachment_remember(Attachment *attachment);
void attachment_topology_changed(Attachment *attachment, const TopologyChange *change);
// Lets go of everything: the body was restored. Not of what the scene attaches.
void attachment_clear(Attachment *attachment);

// Whether what a checkpoint has brought can be.
bool attachment_check(const Attachment *attachment);

// Nodes (or points of faces) held now, and since the start: times that it took hold, things that
// had no room.
int attachment_held(const Attachment *attachment, bool *points);
int64_t attachment_taken(const Attachment *attachment);
int64_t attachment_refused(const Attachment *attachment);

#endif
