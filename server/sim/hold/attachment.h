// SPDX-License-Identifier: MIT
// Springs that hold nodes of one body at positions in a frame (server/sim/README.md, "Holding"):
// the frame of a closed grasper, of another tool, or the world. Step thread. Each held node i has a
// spring k_i = g lambda_b m_i to its position and a damper c_i = 2 zeta sqrt(g lambda_b) m_i, where
// lambda_b bounds M^-1 K of the body at its coarsest level. On their own, held nodes oscillate with
// sqrt(g lambda_b) and the damping ratio zeta, whatever their mass. Both matrices are diagonal, so
// one attachment adds at most g lambda_b to the bound of M^-1 K and 2 zeta sqrt(g lambda_b) to that
// of M^-1 C. Those of graspers are implicit where the body moves by kicks: stiffer, and in no bound
// (grip.c). Refinement divides masses among more nodes and leaves the sum of the springs
// unchanged. A grasper that finds fewer than three nodes within its capsules holds points of faces
// instead: the point of face f nearest to its axis, with the mass A_f min_i (m_i / sum of the areas
// at i), distributed by the weights of the point. The sum over the faces at a node is at most its
// mass, so the bound is the same. A hanging node has no mass of its own: there m_i / sum of the
// areas is that of the body.
#ifndef PLIANT_SIM_ATTACHMENT_H
#define PLIANT_SIM_ATTACHMENT_H

#include "base/check.h"
#include "sim/contact/contact.h"
#include "body/region.h"
#include "sim/places.h"

// Hysteresis of a grasper's grip: it closes at GRIP_CLOSES and opens below GRIP_OPENS, so that a
// trembling finger does not release.
#define GRIP_CLOSES 0.5
#define GRIP_OPENS  0.4

// Most that one attachment holds; further nodes stay free and are counted.
enum { HELD_NODES = 4096, HELD_POINTS = 128 };

typedef enum AttachTo {
    ATTACH_WORLD,   // held from the start, at rest
    ATTACH_TOOL,    // held while the tool is active, at the positions when it becomes so
    ATTACH_BODY,    // tied to points of another body (joint.c)
    ATTACH_GRASPER, // held while the grasper is closed
} AttachTo;

// An attachment as in a scene; constant. That of a grasper is made from its ToolOptions.
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

// Computes what an attachment with these options adds to the bounds of the body: of M^-1 K [1/s2]
// and M^-1 C [1/s].
void attachment_bounds(const Body *body, double stiffness, double damping_ratio, double *lambda,
                       double *damping);

// Creates an attachment at load time. `name` is "body/grasp7" in lists of arrays; the bodies and
// the tool (NULL: none) outlive it. `other`: of ATTACH_BODY, with the integrator of the body; else
// NULL. Returns NULL with a status for a region without a free node, or one too far from the other
// body.
Attachment *attachment_create(const char *name, const AttachmentOptions *options,
                              const ToolOptions *tool, Body *body, Body *other, Arena *arena,
                              StateList *state, Status *status);
// Memory that ties share, which one at a time uses; sized for the largest body.
typedef struct TieScratch {
    uint64_t *mark; // one bit per node: all 0 between calls
    int *found;     // [nodes]
    char *given;    // [nodes] rows; NULL: no body changes
    double *pulls;  // [nodes]
    // Of an evaluation of one tie: its nodes, and three corners for each.
    Vec3 *v, *corner_x, *corner_v, *corner_f;
    int *corner;
} TieScratch;

// Creates an attachment that has no body yet, for ties by message, with space for `capacity` nodes
// and room for the largest row of any kind. Load time.
Attachment *attachment_reserve(const char *name, int capacity, const TieScratch *scratch,
                               Arena *arena, StateList *state);
// Returns the bytes of a row of TieScratch.
size_t attachment_row_size(void);
// Lets a reserved attachment belong to its bodies, as after creation; the state is not changed. One
// of a body with itself connects two of its walls.
void attachment_assign(Attachment *attachment, const AttachmentOptions *options,
                       const ToolOptions *tool, Body *body, Body *other);
// Holds these nodes, ascending and at most the capacity, in the frame from the next tick on.
void attachment_hold(Attachment *attachment, const int *node, int count);
// Releases all and zeroes the state.
void attachment_drop(Attachment *attachment);
bool attachment_is_empty(const Attachment *attachment); // as after attachment_drop
// Adds `share` to the sums of those nodes of a body that it acts on, at either end.
void attachment_add_shares(Attachment *attachment, const Body *of, double share, double *sum);

// Adds the nodes of a body on which it acts, at either end.
void attachment_add_places(const Attachment *attachment, const Body *of, Places *places);

const AttachmentOptions *attachment_options(const Attachment *attachment);
// Returns the most entries that one evaluation can push on a body, for BodyOps.reserve_forces.
int attachment_node_capacity(const Attachment *attachment, const Body *of);

// Grasps or releases as the tool requires, at its pose at the start of the tick; once per tick.
// `active`: the tool is active (the world always is).
void attachment_begin_tick(Attachment *attachment, bool active, double grip, Vec3 position,
                           Quat orientation, double tick);
bool attachment_is_holding(const Attachment *attachment);
// True if a grasper's capsules must not push the body: while it holds the body, and after the
// release until they are clear of it, since the released nodes are inside them.
bool attachment_mutes_contact(const Attachment *attachment);

// True for graspers of bodies that move by kicks: their springs act after the body's own kick, by
// grip_impulses and grip_kick in place of attachment_apply.
bool attachment_is_implicit(const Attachment *attachment);
// Computes the springs' forces with the frame at `at`; returns their sum [N], 0 if implicit. At
// every stage.
Vec3 attachment_evaluate(Attachment *attachment, const ToolPlacement *at);
// Adds `scale` times these forces to the nodes, for this evaluation; `share` times a force is its
// impulse [s]. `ends`: this evaluation is the substep's last.
void attachment_apply(Attachment *attachment, double scale, double share, bool ends);
// Computes the impulses of a substep h [s], and returns their sum [N s]; gives `scale` times these
// to the nodes, whose positions follow by `drift` [s].
Vec3 grip_impulses(Attachment *attachment, double h);
void grip_kick(Attachment *attachment, double scale, double h, double drift);
Vec3 attachment_force(const Attachment *attachment); // applied last, on the frame
// Returns the sums of the tick, for the wrench; normal and depth stay zero.
const ContactSums *attachment_sums(const Attachment *attachment);

// Call the first before a change of a body's topology may happen, the second after it has.
void attachment_remember(Attachment *attachment, const Body *of);
void attachment_topology_changed(Attachment *attachment, const Body *of,
                                 const TopologyChange *change);
// Releases everything but the scene's own attachments, after the body was restored.
void attachment_clear(Attachment *attachment);

// True if the state read from a checkpoint is consistent.
bool attachment_check(const Attachment *attachment);

// Return the nodes (or points of faces) held now, by as many springs; and, since the start, the
// number of grasps and of nodes that exceeded the capacity.
int attachment_held(const Attachment *attachment, bool *points);
int64_t attachment_taken(const Attachment *attachment);
int64_t attachment_slipped(const Attachment *attachment); // grasps that ended so
int64_t attachment_refused(const Attachment *attachment);

// --- joint.c ---
// Attachments to a body: springs between nodes of one and points carried by another, the nearest
// of its surface when they were tied, at the node's distance from there.

// Largest distance of a node from the other body when they are tied, in that body's longest edges:
// farther away, a face does not define the motion of a point.
#define JOINT_REACH 2.0

// Adds a spring from a node to the point of a face that is at the node now. Nodes ascend, up to the
// capacity; joint_stiffen follows the last.
void joint_add(Attachment *joint, int node, int face);
// Draws the ends of the springs by `way` [m] nearer to their faces, until they lie on them.
void joint_close(Attachment *joint, double way);
double joint_gap(const Attachment *joint); // largest distance of an end from its face [m]
// Recomputes the springs after contact_lambda of a body has changed. Load time.
void joint_stiffen(Attachment *joint);
// Adds the springs' forces to the nodes of both bodies, for one evaluation; `share` times a force
// is its impulse [s].
void joint_apply(Attachment *joint, double share);

#endif
