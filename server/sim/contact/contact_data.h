// SPDX-License-Identifier: MIT
// Private to the module sim: a contact of one tool with one body, and the laws of contact.
// contact.c walks the table of laws, of which each has its own file.
#ifndef PLIANT_SIM_CONTACT_DATA_H
#define PLIANT_SIM_CONTACT_DATA_H

#include "base/sym3.h"
#include "sim/carriers.h"
#include "sim/contact/contact.h"
#include "geometry/distance.h"

// A face that the tool can reach in this tick.
typedef struct Candidate {
    int face;
    int node[3];      // local
    double stiffness; // [N/m]
    bool border[3];   // edge (k, k + 1) belongs to this face alone
} Candidate;

// The tool's position for this body; plain data, part of the state.
typedef struct Proxy {
    int64_t valid; // 0 or 1
    Vec3 position;
    Quat orientation;
    Vec3 bristle[TOOL_SHAPES]; // tangential memory of each capsule's friction [m]
    // Hollow walls: 0, or, if in the last substep only faces that the axis has crossed acted, 1 and
    // the ticks in which the pose was clear of the body meanwhile.
    int64_t crossed_only;
    // Hollow walls: mean force on the tool in the last tick [N]; time left in which it must not
    // grow fast, since faces have changed [s].
    double felt, unsettled;
    double away; // time in which the force of a tool that was inside still grows to max_force [s]
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

// Time in which the force of a tool that was inside of a body grows [s].
#define CONTACT_EASE_TIME 0.1

// Width of the soft minimum over a capsule's pairs, relative to the radius. At 0.01 the torque of a
// capsule that tilts over an edge changes by under 1 % per 0.005 degrees.
#define CONTACT_SOFT 0.01
// log 5, rounded up: how far the soft minimum of five pairs lies below them all, in widths.
#define CONTACT_SOFT_REACH 1.61
#define CONTACT_TOUCHING   1e-9 // [m] closer, a pair has no direction of its own

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
    bool acts;           // a node that it carries is pushed
    unsigned char shape; // the capsule that does
    double mass;         // [kg]; 0: it cannot move
    Vec3 swing;          // velocity of the tool's point there by its rotation [m/s]
    Vec3 force;          // of the nodes that do not separate [N]
} Touched;

// Of one in contact_fit_solve: residual [N s] and change of velocity [m/s].
typedef struct TouchedLeft {
    Vec3 left, change;
} TouchedLeft;

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
    // Of friction: mean velocity of the tool where it pushes [m/s], direction of its push on the
    // nodes when it first touched the body, and the coefficient that acts under each capsule.
    Vec3 way, press;
    double friction[TOOL_SHAPES];
} Clear;

enum { CONTACT_POINTS = 16 }; // of a face of a solid, at most

// The result of one evaluation at one placement.
typedef struct ContactForces {
    Vec3 force;          // on the tool [N]
    Vec3 moment;         // on the tool, about ContactSums.about [N m]
    Vec3 point, normal;  // force-weighted sums
    double weight;       // sum of normal forces [N]
    Sym3 stiffness;      // sum k n n^T [N/m]
    Sym3 damping;        // hollow walls: of the dampers, along the same normals [N s/m]
    double floor;        // smallest (signed distance - least allowed) of an acting face [m];
                         // solids: least distance of an axis
    Vec3 floor_normal;   // of that face, hollow walls only
    double energy;       // of the potential, solids only [J]
    double depth;        // largest overlap [m]
    int acting, crossed; // faces that act, and those among them that the axis has crossed
} ContactForces;

// What a tick brings.
typedef struct ContactMotion {
    const ToolMotion *tool;
    double tick; // [s]
    int64_t step;
} ContactMotion;

// A law of contact: what a tool does to a body. Each row is in its own file; choose_law in
// contact_create.c says which contact has it. Step thread, but for `create`.
typedef struct ContactLaw {
    double share;     // of a lambda_b that one shape of the tool adds to the body's bound
    bool has_springs; // contact_springs lists its pushes
    double ease_lag; // share of the time left in which a tool that was led out goes most of its way
    // Load time: allocates what the law needs, and adds its state.
    void (*create)(Contact *contact, const char *name, Arena *arena, StateList *state);
    // Start of a tick: finds what the tool can reach, by contact_find_candidates, which calls
    // `find`. Returns the point about which moments are summed [m].
    Vec3 (*begin)(Contact *contact, const ContactMotion *motion);
    void (*find)(Contact *contact, const ToolPlacement *at, double margin);
    // Substep: sends the proxy towards a pose; NULL for what is always static.
    void (*move)(Contact *contact, Vec3 target, Quat orientation, double h);
    // Reads the local nodes; computes the forces on them, in `f`, and on the tool, in `forces`,
    // which are cleared, at a placement. `dt`: by which friction's memory advances [s].
    void (*read)(Contact *contact);
    void (*evaluate)(Contact *contact, const ToolPlacement *at, double dt);
    // As contact_apply; contact_kick, NULL: nothing; contact_end_substep, before `next` is kept.
    void (*apply)(Contact *contact, double fraction, double weight, double h);
    void (*kick)(Contact *contact, const Evaluation *evaluation, double h);
    void (*end)(Contact *contact);
    // Clears the law's memory; follows a change of topology with it, NULL: it has none of faces.
    void (*clear)(Contact *contact);
    void (*follow)(Contact *contact, const TopologyChange *change);
} ContactLaw;

extern const ContactLaw contact_plane, contact_wall, contact_solid;

struct Contact {
    const ToolOptions *tool;
    Body *body;
    const ContactLaw *law;
    double smallest_radius, largest_radius; // of the capsules [m]
    // Of fitted surfaces: the farthest node from its vertex [m]; mean mass of the nodes per area of
    // the faces around them [kg/m2].
    double reach, density;
    double lever; // farthest point of an axis from the tool's origin [m]

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
    ToolPlacement calm;   // only velocities: what dampers feel is the proxy's and these
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
    double limit;   // of the force in this tick, of a tool that is not static [N]
    double told;    // hollow walls: least force reported while faces have just changed, up to 1.5
                    // times what there is [N]
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
    Sym3 *lumped;                     // of a local node: lumped stiffness [N/m]
    Carriers carriers;                // of the local nodes
    Carriers *fit;                    // they, of a fitted surface, else NULL
    Clear *clear;                     // state
    unsigned char shape, *pusher;     // capsule under evaluation; of a local node: that pushes it
    double friction[TOOL_SHAPES];     // of the substep, as in Clear
    int pressed_count, touched_count; // local nodes that the tool pushes; carriers that it moves
    Pressed *pressed;
    Touched *touched;
    TouchedLeft *left; // [touched carrier] of a fitted surface
    int *touched_node; // of the body
    Vec3 *impulse;     // on the touched carriers [N s]

    double kicked; // half the duration of the forces `f` whose work is half counted [s], or 0
    ContactSums sums;
};

// contact_geometry.c: a capsule without length.
bool contact_is_sphere(const Capsule *capsule);
// Returns the capsule's axis at a placement.
void contact_axis(const Capsule *capsule, const ToolPlacement *at, Vec3 *p, Vec3 *q);
// Returns the unit normal of a candidate's face at the current positions; zero for a face without
// area.
Vec3 contact_face_normal(const Contact *contact, const Candidate *candidate);
// Returns the sign of (c - z) . N for a pair: +1 in front of the face, -1 behind; 0 on a free
// border, which has no sides. `weight` and `on_face` as in ClosestPair.
int contact_sign(const Contact *contact, const Candidate *candidate, const double weight[3],
                 Vec3 on_face, Vec3 on_axis);
// Finds the nearest pair of a face and an axis; zero distance if the axis passes through.
void contact_nearest_pair(const Vec3 x[3], Vec3 p, Vec3 q, bool sphere, ClosestPair *nearest);
// Reads the corners of a candidate's face.
void contact_corners(const Contact *contact, const Candidate *candidate, Vec3 x[3]);
// Finds the pairs of an axis and a face, and the nearest of them. Returns their number; 0: the axis
// passes through the face.
int contact_find_pairs(const Vec3 x[3], Vec3 p, Vec3 q, bool sphere,
                       ClosestPair pair[DISTANCE_PAIRS], const ClosestPair **nearest);
// Returns the soft minimum of the distances of pairs, of width `eps`, of which `least` is the
// least:
//   d_min - eps log sum exp(-(d_j - d_min) / eps).
// Its gradient distributes a force over the pairs by share[j] / sum, the exponentials
// (server/sim/README.md, "Capsules").
double contact_soft_minimum(const ClosestPair *pair, int count, double least, double eps,
                            double share[DISTANCE_PAIRS], double *sum);
// Returns how much nearer any face may be to any point of the tool's axes than at the tick's start.
double contact_approach(const Contact *contact, const ToolPlacement *at);

// contact_find.c: finds what is within `margin` of contact at a placement, and prepares it.
void contact_find_candidates(Contact *contact, const ToolPlacement *at, double margin);
void contact_forget_candidates(Contact *contact);
// Finds the faces in reach of the capsules, in ascending order, and their local nodes, with numbers
// until contact_forget_numbers.
void contact_find_faces(Contact *contact, const ToolPlacement *at, double margin);
void contact_forget_numbers(Contact *contact);
// Computes the normals at all local nodes, and forgets their numbers; or, at any time of the tick's
// start, those of one candidate.
void contact_find_all_normals(Contact *contact);
void contact_find_normals(Contact *contact, const Candidate *candidate);
// Returns the number of a face among the known candidates, or -1.
int contact_find_candidate(const Contact *contact, int face);

// Returns how far beyond its tool's motion a contact looks for faces [m]. Those of solids approach
// by their own motion alone: by an edge per tick in a sound body.
static inline double contact_margin(const Contact *contact)
{
    const BodySurface *surface = &contact->body->surface;
    return surface->solid ? fmin(contact->smallest_radius, surface->longest_edge)
                          : contact->smallest_radius;
}

// contact_create.c, load time: allocates what nodes need, with room for so many positions and
// velocities; chooses the capacity of capsules and allocates what these need of candidates.
void contact_create_nodes(Contact *contact, const char *name, Arena *arena, int positions,
                          int velocities);
void contact_create_capsules(Contact *contact, const char *name, Arena *arena);

// contact.c, the proxy: shows it, and finds candidates for the tick. Returns how far it may go if
// there are none [m].
double contact_search(Contact *contact, const ContactMotion *motion, double margin);
// Measures the candidates at the start of a tick. Returns true if the tool is inside of the body,
// or, `fresh` (it has just appeared), overlaps it: `out` leads its origin out again.
bool contact_look(Contact *contact, const ToolPlacement *at, bool fresh, Vec3 *out);
// Sets the limit of the force of this tick, which grows gently once the tool was led out; shortens
// the longest step of a proxy meanwhile: rather than run into the hand with all its force.
void contact_ease(Contact *contact, bool led_out, double tick);
double contact_ease_step(const Contact *contact, Vec3 target, Quat orientation, double cap,
                         double h);
// Moves the proxy so far, if nothing is near. Returns where it is.
Vec3 contact_go_free(Contact *contact, const ContactMotion *motion, double cap);
// Moves a proxy towards a pose, by at most `cap` [m] at any point of the tool.
void contact_move_proxy(Proxy *proxy, Vec3 target, Quat orientation, double lever, double cap);
// Returns the proxy at rest; on its way over the substep to `next`.
ToolPlacement contact_here(const Contact *contact);
ToolPlacement contact_placement(const Contact *contact, double fraction, double h);
// Returns false if there was none.
bool contact_clear_proxy(Contact *contact);

// contact.c, forces: reads positions and velocities, for `read`; reads by the law, with what
// follows.
void contact_read_nodes(Contact *contact);
void contact_read(Contact *contact);
void contact_evaluate(Contact *contact, const ToolPlacement *at, double dt);
// Adds forces of at most max_force on the tool to the nodes, for `apply`.
void contact_apply_forces(Contact *contact, double fraction, double weight, double h);
double contact_friction(const Contact *contact);
// Records a spring for contact_springs, of stiffness [N/m]; `yield` and `stays` as there.
void contact_note_spring(Contact *contact, const Candidate *candidate, const double weight[3],
                         Vec3 normal, double stiffness, double yield, bool stays);

// contact_fit.c. Load time: creates what a contact on a fitted surface needs.
void contact_fit_create(Contact *contact, const char *name, Arena *arena);
// Lists what carries the local nodes, finds the stiffness of the candidates, and reads the nodes'
// places. At the start of a tick.
void contact_fit_gather(Contact *contact);
// Reads the places of the local nodes.
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

#endif
