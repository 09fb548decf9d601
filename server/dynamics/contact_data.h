// Private to the dynamics room: what a contact of one tool with one body holds. contact.c moves
// the proxy, contact_find.c finds candidates, contact_side.c remembers sides, contact_follow.c
// keeps them when faces change, contact_force.c is the law.
#ifndef PLIANT_DYNAMICS_CONTACT_DATA_H
#define PLIANT_DYNAMICS_CONTACT_DATA_H

#include "dynamics/contact.h"
#include "geometry/distance.h"

// A face that the tool can reach in this tick.
typedef struct Candidate {
    int face;
    int node[3];    // local
    bool border[3]; // edge (k, k + 1) belongs to this face alone
} Candidate;

// Where the tool is for this body; plain data, part of the state.
typedef struct Proxy {
    int64_t valid; // 0 or 1
    Vec3 position;
    Quat orientation;
    Vec3 bristle[TOOL_SHAPES]; // tangential memory of each capsule's friction [m]
    int64_t crossed_only;      // 1: in the last substep only faces that the axis has crossed acted
    double away; // time that only crossed faces acted while the pose was clear of the body [s]
} Proxy;

// One push between a capsule and a face, kept until friction has had its share.
typedef struct Push {
    int candidate;
    double weight[3]; // barycentric, on the candidate's nodes
    double force;     // normal force >= 0 [N]
} Push;

// The pushes of one capsule together, each weighted with its normal force.
typedef struct PushSums {
    double force;     // [N]
    double stiffness; // [N/m] times [N]
    Vec3 normal;      // on the tool, times [N]
    Vec3 slip;        // tangential velocity of the tool relative to the faces [m/s] times [N]
} PushSums;

// Of the radius: the proxy's largest step in a substep.
#define CONTACT_STEP_CAP 0.25

// Of the radius: how near the axis may come to a solid's faces; and how far from it a face of a
// solid may be felt then.
#define CONTACT_SOLID_FLOOR (1.0 / 3.0)
#define CONTACT_SOLID_REACH 1.14
// What the push of a solid's faces may add to the bounds, times that of a pair along its distance.
#define CONTACT_SOLID_BOUND 1.3

// How far behind a tool with a proxy a wall may be that it has crossed, as a share of the radius:
// the proxy steps back before its axis comes to a wall, so what shows its back farther off was not
// crossed but seen through another wall.
#define CONTACT_CROSSED_REACH 0.5

// A face is found by its nodes: none of its points is farther than 0.58 of its longest edge from
// one (the circumradius of an equilateral face); faces may be stretched to twice their rest length.
// Faces that already are candidates stay so until they are too far, however stretched.
#define CONTACT_FACE_REACH (2.0 * 0.58)

enum { CONTACT_PUSHES = 2048 }; // at most, with friction; more pushes act without it

// The result of one evaluation at one placement.
typedef struct ContactForces {
    Vec3 force;          // on the tool [N]
    Vec3 moment;         // on the tool, about ContactSums.about [N m]
    Vec3 point, normal;  // force-weighted sums
    double weight;       // sum of normal forces [N]
    double stiffness[6]; // sum k n n^T: xx yy zz xy xz yz [N/m]
    double floor;        // smallest (signed distance - least allowed) of an acting face [m]
    double depth;        // largest overlap [m]
    int acting, crossed; // faces that act, and those among them that the axis has crossed
} ContactForces;

struct Contact {
    const ToolOptions *tool;
    Body *body;
    bool is_plane;                          // the tool's plane, else its capsules
    double smallest_radius, largest_radius; // of the capsules [m]
    double lever;                           // farthest point of an axis from the tool's origin [m]

    // --- part of the state ---
    Proxy *proxy;
    signed char *side[TOOL_SHAPES]; // [face_count] per capsule: +1, -1, or 0: not a candidate
    Vec3 *plane_bristle;            // [node_count], planes only

    // Only on bodies that adapt, else NULL. By face [face_count]: its distance [m] when it was a
    // candidate last, part of the state; and scratch.
    float *gap[TOOL_SHAPES], *old_gap;
    signed char *old_side;

    // --- of the tick: filled by contact_begin_tick ---
    // By candidate [face_capacity] or local node [node_capacity] unless said.
    int candidate_count, local_count;
    int face_capacity, node_capacity, push_capacity;
    int ring_capacity;    // of x: local nodes and the nodes around them
    int64_t refused;      // faces within reach, and rings, that did not fit, since the start
    Candidate *candidate; // by face number
    int *node;            // [node_count] of a local node; candidates' nodes first, then their ring
    int *local;           // [node_count] of a node; -1
    uint64_t *mark;       // bit a face: marked, then those that are candidates
    int *rank;            // candidates before each word of `mark`
    Vec3 *x;              // [ring_capacity] position [m]
    Vec3 *v, *f;          // velocity [m/s], force [N]
    Vec3 *node_normal;    // area-weighted, not unit; zero on a border
    double *ridge;        // solids only: how far a node stands out of those around it, in edges
    ToolPlacement begin;  // of the proxy
    Vec3 *x_begin;        // [m]
    double *gap_begin[TOOL_SHAPES]; // distance per capsule [m]
    unsigned char *corners;         // bit a corner that carries the nearest point, at the begin
    signed char *seen_side;         // when the tick began
    bool *has_side;                 // false where the nearest point lies on a free border
    int *teller;                    // the candidate that tells a candidate's side
    double *distance;               // in the present evaluation, unsigned
    Vec3 *plane_trial;              // planes only: bristles of the present evaluation

    // --- of the substep ---
    double yielded; // farthest that a local node has moved since the tick began [m]
    Proxy next;     // where the proxy goes
    bool fresh;     // `forces` and `f` hold the evaluation at `next`
    ContactForces forces;
    Vec3 trial[TOOL_SHAPES]; // bristles of the present evaluation
    int push_count;
    Push *push;         // [push_capacity]
    PushSums push_sums; // of the capsule under evaluation
    // While somebody asks for them, else NULL: the springs of the evaluation.
    ContactSpring *spring;
    int spring_count, spring_capacity;
    double spring_turn; // of the pair: how the normal turns as the tool moves sideways [1/m]

    ContactSums sums;
};

// A capsule without length.
bool contact_is_sphere(const Capsule *capsule);
// The capsule's axis at a placement.
void contact_axis(const Capsule *capsule, const ToolPlacement *at, Vec3 *p, Vec3 *q);
// Unit normal of a candidate's face at the present positions; zero for a face without area.
Vec3 contact_face_normal(const Contact *contact, const Candidate *candidate);

// contact_find.c: the faces within `margin` of touch at a placement (or the nodes below a plane),
// in ascending order, their local nodes and normals; then their sides.
void contact_find_candidates(Contact *contact, const ToolPlacement *at, double margin);
void contact_forget_candidates(Contact *contact);
// The number of a face among the candidates, or -1; once they are known.
int contact_find_candidate(const Contact *contact, int face);

// contact_side.c: nearest pair of a face and an axis; at no distance when the axis passes through.
void contact_nearest_pair(const Vec3 x[3], Vec3 p, Vec3 q, bool sphere, ClosestPair *nearest);
// After the candidates are known, decides the side of new ones and releases old
// ones.
void contact_update_sides(Contact *contact, const ToolPlacement *at);

// contact_force.c: forces on the tool and, in `f`, on the local nodes, at a placement and the
// present x and v. `dt` is how far friction's memory moves [s].
void contact_evaluate(Contact *contact, const ToolPlacement *at, double dt);

// Sign of (c - z) . N for a pair: +1 in front of the face, -1 behind; 0 on a free border, where
// there is no side. `weight` and `on_face` as in ClosestPair.
int contact_sign(const Contact *contact, const Candidate *candidate, const double weight[3],
                 Vec3 on_face, Vec3 on_axis);

#endif
