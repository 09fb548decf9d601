// SPDX-License-Identifier: MIT
// Private to the module sim: the data of a contact of one tool with one body. contact.c moves
// the proxy, contact_find.c finds candidates and follows changes of faces, contact_side.c remembers
// sides, contact_force.c is the law.
#ifndef PLIANT_SIM_CONTACT_DATA_H
#define PLIANT_SIM_CONTACT_DATA_H

#include "base/sym3.h"
#include "sim/contact/contact.h"
#include "geometry/distance.h"

// A face that the tool can reach in this tick.
typedef struct Candidate {
    int face;
    int node[3];      // local
    double stiffness; // [N/m]; solids only
    bool border[3];   // edge (k, k + 1) belongs to this face alone
} Candidate;

// The tool's position for this body; plain data, part of the state.
typedef struct Proxy {
    int64_t valid; // 0 or 1
    Vec3 position;
    Quat orientation;
    Vec3 bristle[TOOL_SHAPES]; // tangential memory of each capsule's friction [m]
    int64_t crossed_only;      // 1: in the last substep only faces that the axis has crossed acted
    // Hollow walls: time that only crossed faces acted while the pose was clear of the body [s].
    // Solids: time in which the force of a tool that was inside still grows to max_force [s].
    double away;
} Proxy;

// One push between a capsule and a face, kept until friction is added.
typedef struct Push {
    int candidate;
    double weight[3]; // barycentric, on the candidate's nodes
    double force;     // normal force >= 0 [N]
} Push;

// The sum of one capsule's pushes, each weighted with its normal force.
typedef struct PushSums {
    double force;     // [N]
    double stiffness; // [N/m] times [N]
    Vec3 normal;      // on the tool, times [N]
    Vec3 slip;        // tangential velocity of the tool relative to the faces [m/s] times [N]
} PushSums;

// Largest step of the proxy in a substep, relative to the radius.
#define CONTACT_STEP_CAP 0.25

// Least distance of an axis from a hollow wall, relative to the radius: there the proxy stays.
#define CONTACT_AXIS_FLOOR 0.1

// Largest distance of a crossed wall behind a tool with a proxy, relative to the radius. The proxy
// steps back before its axis reaches a wall, so a wall whose back is visible farther off was not
// crossed but seen through another wall.
#define CONTACT_CROSSED_REACH 0.5

// Faces are found by their nodes: every point of a face is within 0.58 of its longest edge of a
// node (the circumradius of an equilateral face); faces may be stretched to twice their rest
// length. Candidates remain until they are too far, however stretched.
#define CONTACT_FACE_REACH (2.0 * 0.58)

enum { CONTACT_PUSHES = 2048 }; // at most, with friction; more pushes act without it

// With solids, a carrier that a tool moves.
typedef struct Touched {
    int carrier;
    bool acts;   // a node that it carries is pushed
    double mass; // [kg]; 0: it cannot move
    Vec3 swing;  // velocity of the tool's point there by its rotation [m/s]
    Vec3 force;  // of the nodes that do not separate [N]
    // Of contact_fit_solve: residual [N s] and change of velocity [m/s].
    Vec3 left, change;
} Touched;

// With solids, a local node that a tool pushes.
typedef struct Pressed {
    int local;
    bool acts;  // it does not separate
    Vec3 speed; // after the body's own kick [m/s]
    Vec3 swing; // as in Touched
} Pressed;

// What a contact with a solid remembers; plain data, part of the state.
typedef struct Clear {
    Vec3 position;   // of the proxy where it last was clear of the body [m]
    int64_t touched; // 1: the tool touched the body in the last substep
} Clear;

// The vertices that move as a tool pushes: the local nodes themselves, or with a fitted surface the
// corners of the cells around them. [count]
typedef struct Carriers {
    int count;
    int *node;    // of the body
    Vec3 *x, *f;  // position [m], force [N]
    Sym3 *lumped; // stiffness [N/m]
    double *push; // share of the pushes on the surface [N]; NULL: the size of `f`
    int *touched; // number among the touched ones
} Carriers;

typedef struct CarrierWeight {
    int carrier;
    double weight;
} CarrierWeight;

// A local node is where its carriers put it: at the weighted sum of their positions, and `shift`.
typedef struct Follower {
    int first, count; // of ContactFit.weight; the node's own vertex first
    double size;      // sum of all |weight|
    double rest[3];   // [m]
    Vec3 shift;       // [m]
} Follower;

// Contact on a fitted surface (contact_fit.c).
typedef struct ContactFit {
    int capacity, weight_capacity, weight_count; // of carriers, and of `weight`
    int *carrier_of;                             // by vertex of the body; -1
    int *mark;                                   // by vertex, of fit_weights; -1
    CarrierWeight *weight;
    Follower *follower; // [local node]
    // Of the search for candidates, where `read` by vertex and `found` by node of the surface say
    // the number of this search: positions of vertices, places of nodes [m].
    int64_t search, *read, *found;
    Vec3 *vertex, *place;
    double density; // mean mass of the nodes per area of the faces around them [kg/m2]
    int64_t step;   // ticks completed
} ContactFit;

enum { CONTACT_POINTS = 16 }; // of a face of a solid, at most

// The result of one evaluation at one placement.
typedef struct ContactForces {
    Vec3 force;          // on the tool [N]
    Vec3 moment;         // on the tool, about ContactSums.about [N m]
    Vec3 point, normal;  // force-weighted sums
    double weight;       // sum of normal forces [N]
    Sym3 stiffness;      // sum k n n^T [N/m]
    double floor;        // smallest (signed distance - least allowed) of an acting face [m];
                         // solids: least distance of an axis
    Vec3 floor_normal;   // of that face, hollow walls only
    double energy;       // of the potential, solids only [J]
    double depth;        // largest overlap [m]
    int acting, crossed; // faces that act, and those among them that the axis has crossed
} ContactForces;

struct Contact {
    const ToolOptions *tool;
    Body *body;
    // Which of three laws: of the tool's plane, of its capsules against a solid (contact_solid.c),
    // or of its capsules against a hollow wall.
    bool is_plane, is_solid;
    double smallest_radius, largest_radius; // of the capsules [m]
    double reach;                           // farthest node from its vertex, of fitted surfaces [m]
    double lever;                           // farthest point of an axis from the tool's origin [m]

    // --- part of the state ---
    Proxy *proxy;
    signed char *side[TOOL_SHAPES]; // [face_count] per capsule: +1, -1, or 0: not a candidate
    Vec3 *plane_bristle;            // [node_count], planes only

    // For bodies that adapt, else NULL. By face [face_count]: its distance [m] when it was last a
    // candidate, part of the state; and scratch.
    float *gap[TOOL_SHAPES], *old_gap;
    signed char *old_side;

    // --- of the tick: filled by contact_begin_tick ---
    // Indexed by candidate [face_capacity] or local node [node_capacity] unless stated.
    int candidate_count, local_count;
    int face_capacity, node_capacity, push_capacity;
    int ring_capacity;    // of x: local nodes and, of hollow walls, the nodes around them
    int64_t refused;      // faces within reach, and rings, beyond the capacity, since the start
    Candidate *candidate; // by face number
    int *node;            // [node_count] of a local node; of walls, while normals are computed,
                          // then of the nodes around them
    int *local;           // [node_count] of a node; -1
    uint64_t *mark;       // one bit per face: marked, then candidates
    int *rank;            // candidates before each word of `mark`
    Vec3 *x;              // [ring_capacity] position [m]
    Vec3 *v, *f;          // velocity [m/s], force [N]
    Vec3 *node_normal;    // area-weighted, not unit; zero on a border; of solids valid only for
                          // candidates that contact_find_normals was asked for in this tick
    ToolPlacement begin;  // of the proxy
    Vec3 *x_begin;        // [m]
    double *gap_begin[TOOL_SHAPES]; // distance per capsule [m]
    // Hollow walls, per capsule: where a nearer candidate has the tool in front of itself, and so
    // of this one, its distance: until the tool can have crossed it [m]; else 0.
    double *in_front[TOOL_SHAPES];
    unsigned char *corners; // bit mask of the corners that carry the nearest point, at the start
    signed char *seen_side; // when the tick began
    bool *has_side;         // false if the nearest point is on a free border
    int *side_from;         // the candidate whose side a candidate takes
    double *distance;       // in the current evaluation, unsigned
    Vec3 *plane_trial;      // planes only: bristles of the current evaluation

    // --- of the substep ---
    double yielded; // largest displacement of a local node since the tick began [m]
    Proxy next;     // where the proxy goes
    bool fresh;     // `forces` and `f` are those of `next`
    ContactForces forces;
    Vec3 trial[TOOL_SHAPES]; // bristles of the current evaluation
    int push_count;
    Push *push;         // [push_capacity]
    PushSums push_sums; // of the capsule under evaluation
    // The springs of the evaluation while contact_springs needs them, else NULL.
    ContactSpring *spring;
    int spring_count, spring_capacity;
    double spring_turn; // of the pair: rotation of the normal per sideways motion of the tool [1/m]

    // --- solids only ---
    // Points spread over a face, where it feels the tool: barycentric weights.
    int point_count;
    double point_weight[CONTACT_POINTS][3];
    Sym3 *lumped; // of a local node: lumped stiffness [N/m]
    Carriers carriers;
    ContactFit *fit;                  // of a fitted surface, else NULL
    double limit;                     // of the force now [N]
    Clear *clear;                     // state
    int pressed_count, touched_count; // local nodes that the tool pushes; carriers that it moves
    Pressed *pressed;
    Touched *touched;
    int *touched_node; // of the body
    Vec3 *impulse;     // on the touched carriers [N s]

    double kicked; // half the duration of the forces `f` whose work is half counted [s], or 0
    ContactSums sums;
};

// A capsule without length.
bool contact_is_sphere(const Capsule *capsule);
// Returns the capsule's axis at a placement.
void contact_axis(const Capsule *capsule, const ToolPlacement *at, Vec3 *p, Vec3 *q);
// Returns the unit normal of a candidate's face at the current positions; zero for a face without
// area.
Vec3 contact_face_normal(const Contact *contact, const Candidate *candidate);

// contact_find.c: finds the faces within `margin` of contact at a placement (or the nodes below a
// plane), in ascending order, their local nodes and normals; then their sides.
void contact_find_candidates(Contact *contact, const ToolPlacement *at, double margin);
void contact_forget_candidates(Contact *contact);
// Computes the normals at the nodes of a solid's candidate; those of walls are known. At the start
// of a tick.
void contact_find_normals(Contact *contact, const Candidate *candidate);
// Returns the number of a face among the known candidates, or -1.
int contact_find_candidate(const Contact *contact, int face);

// contact_side.c: finds the nearest pair of a face and an axis; zero distance if the axis passes
// through.
void contact_nearest_pair(const Vec3 x[3], Vec3 p, Vec3 q, bool sphere, ClosestPair *nearest);
// Decides the side of new candidates and forgets that of old ones; call when the candidates are
// known.
void contact_update_sides(Contact *contact, const ToolPlacement *at);

// contact_solid.c: computes the potential of a solid and a tool at a placement, its forces on the
// nodes and what bounds their change; then the impulses of a substep, after the body's own kick.
void contact_solid_evaluate(Contact *contact, const ToolPlacement *at);
void contact_solid_kick(Contact *contact, const Evaluation *evaluation, double h);
// Measures the candidates at the start of a tick. Returns true if the tool is inside of the solid,
// or, `fresh` (it has just appeared), overlaps it: `out` leads its origin out again.
bool contact_solid_look(Contact *contact, const ToolPlacement *at, bool fresh, Vec3 *out);
// Spreads the points over the faces. Load time.
void contact_solid_create(Contact *contact);

// contact_fit.c. Load time: creates what a contact on a fitted surface needs.
void contact_fit_create(Contact *contact, const char *name, Arena *arena);
// As the search for candidates began: reads the vertices of a face's corners, and returns the place
// of a node [m].
void contact_fit_read_vertices(const Contact *contact, const int corner[3], Vec3 x[3]);
Vec3 contact_fit_place(const Contact *contact, int node);
// Gathers what the local nodes follow from, and the stiffness of the candidates; then reads their
// places. At the start of a tick.
void contact_fit_gather(Contact *contact);
// Reads the carriers and, in `x`, the places of the local nodes.
void contact_fit_read(Contact *contact);
// Spreads `f` and `lumped` of the local nodes over the carriers.
void contact_fit_spread(Contact *contact);

// Improves the impulses on the touched carriers, which were found as if each were alone, to those
// of
//   (M + g W^T K W) dv = W^T (h f - g K (W v - u)),
// with the weights W of the pressed nodes, and the tool moving at `u` [m/s]. Sets those on carriers
// that cannot move to what these withhold, and adds the derivative of these by `u` to `slope`.
void contact_fit_solve(Contact *contact, Vec3 u, double h, double g, Sym3 *slope);

// The vertices that carry most of a spring's point. [count], of which CONTACT_MAIN for each corner
// of its face.
enum { CONTACT_MAIN = 6 };
typedef struct ContactCarriers {
    int count, vertex[3 * CONTACT_MAIN];
    float share[3 * CONTACT_MAIN];
} ContactCarriers;

// Finds what carries a spring of contact_springs, called before in this tick; the shares
// of a corner are scaled to a sum of its weight. Of a fitted surface.
void contact_find_carriers(const Contact *contact, const ContactSpring *spring,
                           ContactCarriers *carriers);

// contact_force.c: stiffness of the contact of a face [N/m].
double contact_face_stiffness(const Body *body, int face);
double contact_friction(const Contact *contact);
// Returns how much nearer any face may be to any point of the tool's axes than at the tick's start.
double contact_approach(const Contact *contact, const ToolPlacement *at);
// Records a spring for contact_springs, of stiffness [N/m]; `yield` and `stays` as there.
void contact_note_spring(Contact *contact, const Candidate *candidate, const double weight[3],
                         Vec3 normal, double stiffness, double yield, bool stays);

// contact_force.c: computes forces on the tool and, in `f`, on the local nodes, at a placement and
// the current x and v. `dt`: time by which friction's memory advances [s].
void contact_evaluate(Contact *contact, const ToolPlacement *at, double dt);

// Returns the sign of (c - z) . N for a pair: +1 in front of the face, -1 behind; 0 on a free
// border, which has no sides. `weight` and `on_face` as in ClosestPair.
int contact_sign(const Contact *contact, const Candidate *candidate, const double weight[3],
                 Vec3 on_face, Vec3 on_axis);

#endif
