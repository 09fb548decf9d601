// Springs between nodes of one body and points carried by another: the nearest point of its surface
// when they were tied, and the node's distance from there. Step thread.
// The other end of node i's spring is z = sum_j w_j x_j + d n, with x_j the corners of a face of
// the other body, n its unit normal, and z = x_i at the start. A force F at z is distributed to the
// corners by the transpose of dz/dx_j: forces and moments of both ends cancel exactly, and the
// springs' energy depends on distances alone.
// With e_j >= |dz/dx_j| and S = sum_j e_j, the row of node i in M^-1 K is at most k (1 + S) / m_i,
// that of corner j the sum over its springs of k e_j (1 + S) / m_j. So
//     k = g min(lambda_a m_i, lambda_b min_j m_j / sum_springs e_j) / (1 + S),
// with lambda_a and lambda_b bounding the bodies at their coarsest levels, adds at most g times its
// own lambda to the bound of either; damping c = 2 zeta k / sqrt(g max(lambda_a, lambda_b)) adds at
// most 2 zeta sqrt(g lambda) likewise.
// Joined bodies advance together, stage by stage: both ends act at the same time.
#ifndef PLIANT_DYNAMICS_JOINT_H
#define PLIANT_DYNAMICS_JOINT_H

#include "dynamics/attachment.h"

typedef struct Joint Joint;

// Creates a joint at load time. The bodies outlive it and have the same integrator. Returns NULL
// with a status for a region without a free node, or one too far from the other body.
Joint *joint_create(const char *name, const AttachmentOptions *options, Body *body, Body *other,
                    Arena *arena, StateList *state, Status *status);
const AttachmentOptions *joint_options(const Joint *joint);
// Returns the most entries that one evaluation pushes, of the one body and the other.
int joint_node_capacity(const Joint *joint);
int joint_other_capacity(const Joint *joint);
// Recomputes the springs after contact_lambda of a body has changed. Load time.
void joint_stiffen(Joint *joint);

// Adds the springs' forces to the nodes of both bodies, for one evaluation.
void joint_apply(Joint *joint);

// Call the first before the other body's topology may change; the others after that of either did.
void joint_remember(Joint *joint);
void joint_other_changed(Joint *joint, const TopologyChange *change);
void joint_topology_changed(Joint *joint, const TopologyChange *change);

bool joint_check(const Joint *joint);
int joint_count(const Joint *joint); // springs
int64_t joint_refused(const Joint *joint);

#endif
