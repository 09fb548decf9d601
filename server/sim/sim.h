// SPDX-License-Identifier: MIT
// The bodies and tools of one scene, and one tick of them. Independent of threads, messages, files
// and wall-clock time: the owner of a Sim calls it from one thread.
#ifndef PLIANT_SIM_SIM_H
#define PLIANT_SIM_SIM_H

#include "base/check.h"
#include "base/memory.h"
#include "base/sym3.h"
#include "sim/hold/attachment.h"
#include "body/body.h"
#include "sim/contact/contact.h"
#include "sim/tool.h"
#include "sim/touch/touch.h"

#include <stdint.h>

// The stages of a tick, in order. Timers, status, --explain and the benchmark use this list.
typedef enum StageId {
    STAGE_INPUTS,        // take poses and requests (the runner's)
    STAGE_TOOLS,         // place tools, withdraw stale ones
    STAGE_LOADS,         // start and end loads
    STAGE_CUT,           // strokes of blades, tearing
    STAGE_REMOVE,        // take tissue away
    STAGE_HEAT,          // let heat of diathermy spread
    STAGE_RECONSTRUCT,   // refine the surroundings of cuts
    STAGE_ADAPT,         // refine and coarsen
    STAGE_GRASP,         // grasp and release
    STAGE_FIND_CONTACTS, // candidates, sides
    STAGE_TOUCH,         // contact between bodies: candidates, and its forces in the substeps
    STAGE_FORCES,        // all forces and the integration, substep by substep
    STAGE_CONTACT,       // contact forces inside the substeps
    STAGE_WRENCHES,      // impulses to wrenches
    STAGE_CHECK,         // numbers finite; else restore
    STAGE_WATCH,         // time that tools are in regions
    STAGE_TIES,          // ties by message that break
    STAGE_STIFFNESS,     // contact stiffness, a part of it per tick
    STAGE_ERROR,         // error of the discretisation, likewise
    STAGE_ESTIMATE,      // tried steps for the error estimate (the runner's, in the time left)
    STAGE_SNAPSHOT,      // hand positions to the bus (the runner's)
    STAGE_COUNT,
} StageId;

const char *stage_name(StageId stage);

enum { SIM_LOADS = 64 }; // active at a time, the scene's and messages' together

// A force distributed over the nodes found inside a sphere when it starts (load_t, or a scene's
// load).
typedef struct LoadOptions {
    int body;           // index; -1: all bodies together
    Vec3 center;        // [m]
    double radius;      // [m]
    Vec3 force;         // [N] total
    double start;       // simulated time [s]
    double duration;    // [s]
    int32_t sender, id; // of the message; 0 0: the scene's
} LoadOptions;

// One sweep of a straight blade (cut_t).
typedef struct CutOptions {
    int body; // index; -1: all that are cuttable
    BladeEdge before, after;
} CutOptions;

// --- ties by message ---
// A scene with max_ties > 0 has a pool of that many ties, reserved at load (tie.c).

enum {
    SIM_TIES = 256,  // most that a scene may reserve
    TIE_IDS = 16,    // node ids in one message
    TIE_NODES = 128, // most nodes that a tie takes when it is made
};
#define TIE_STIFFNESS_MOST 4.0 // of one tie, and of all that act on one node together
#define TIE_DAMPING_MOST   2.0

typedef enum TieAction { TIE_MAKE = 1, TIE_CHANGE, TIE_RELEASE } TieAction;
typedef enum TieKind {
    TIE_PIN = 1, // to the world
    TIE_BODIES,  // to another body
    TIE_CLIP,    // two walls of one body, or of two, which it draws together
    TIE_CARRY,   // to a tool
} TieKind;

// What a tie_t asks for; all numbers within the ranges of the message.
typedef struct TieOptions {
    TieAction action;
    int number; // MAKE: 0 takes the lowest free one
    // --- MAKE ---
    TieKind kind;
    int body, to_body; // indices; of a clip the same for two walls of one body
    int tool;          // index, of TIE_CARRY
    int node_count;    // 0: the nodes inside the sphere
    int node[TIE_IDS]; // ids as in BodyMesh
    Vec3 center;       // [m]
    double radius;     // [m]
    // --- MAKE and CHANGE ---
    double stiffness, damping_ratio;
    double break_force; // [N]; 0: never
} TieOptions;

// A tie now.
typedef struct TieFigures {
    TieKind kind;
    int body, to_body, tool; // indices, or -1
    int nodes;               // tied now
    Vec3 pull;               // on the nodes of `body`, mean of the last tick [N]
} TieFigures;

enum { SIM_EVENTS = 64, SIM_EVENT_TEXT = 184 };

// An event in a tick or a cut.
typedef struct SimEvent {
    int64_t step; // ticks completed when it happened
    int body;
    const char *kind; // "cut" (a stroke ended), "tear", "piece", "cut_refused", "remove" (a
                      // pedal was released), "remove_refused", "restored", "withdrawn",
                      // "tie_broken"
    char text[SIM_EVENT_TEXT];
} SimEvent;

// The force on one tool in the last tick: contact_t without its envelope.
typedef struct ToolWrench {
    bool contact;       // touches or grasps something
    Vec3 position;      // of the proxy at the end of the tick
    Vec3 force, torque; // on the tool; torque about `position`
    Vec3 point, normal; // normal zero and depth 0 for a tool that only grasps
    double depth;
    Sym3 stiffness; // (stiffness.h) [N/m]; all zero: unknown
    double damping; // along the normal [N s/m]
} ToolWrench;

// A grasper has grasped or released a body.
typedef struct GraspEvent {
    int tool, body; // indices
    int nodes;      // held now, or points of faces; 0: nothing
    bool points;
    int64_t taken; // number of grasps of that body so far
    int64_t slips; // of these ended because the tissue slipped out
    bool slipped;  // the last of them
    int64_t step;
} GraspEvent;

// --- the guard ---
// The guard: no number leaves the simulation unchecked. At the end of each tick, a body whose
// numbers are not finite or out of bounds gets the last good state back; the cause is found,
// counted and reported; a tool or load that is the cause repeatedly is withdrawn. A body that
// becomes bad again and again all the same is frozen: in its rest shape, and as if it were not
// there, until RESET. The body's
// kernels record the checks in the tick's last pass (BodyOps.commit), so that a good tick costs
// next to nothing here.

enum {
    // Bad ticks caused by one tool or load within GUARD_WINDOW before it is withdrawn.
    GUARD_MOST_BLAME = 3,
    // Bad ticks of a body, consecutive or within GUARD_WINDOW, before it returns to its rest shape.
    GUARD_BAD_TICKS = 10,
    // Returns to the rest shape within GUARD_WINDOW before the body is frozen: at least 50 bad
    // ticks, or 14 consecutive ones.
    GUARD_MOST_SHAPES = 5,
};
#define GUARD_WINDOW 1.0 // [s] simulated; also the least time between two reports about one body

// Cause of a body's bad tick: the strongest of the tools and loads that acted on it or on bodies
// joined with it; else the last SET, if within GUARD_WINDOW; else an unsafe time step that the
// scene requires; else the strongest load that has ended, as long as the body has energy of it;
// else tools that gave it energy since the last check of energies; else the pressure inside.
typedef enum GuardCause {
    GUARD_TOOL, // touches or grasps
    GUARD_LOAD,
    GUARD_SET,
    GUARD_TIME_STEP, // unsafe_time_step
    GUARD_UNKNOWN,   // nothing acted
    GUARD_ENERGY,    // good numbers, but energy without a source
    GUARD_PRESSURE,  // inside, beyond what its wall bears
    GUARD_CAUSE_COUNT,
} GuardCause;

// Counts since the start; a RESET of the scene does not change them.
typedef struct GuardCounts {
    int64_t restored[GUARD_CAUSE_COUNT]; // bodies, each counted; sim_resets() is the sum
    int64_t rest_shapes;                 // of these, those that returned to their rest shape
    int64_t tools, loads;                // withdrawn
    int64_t wrenches;                    // withheld, because not fit to be published
    int64_t figures;                     // of measurements, withheld
    int64_t frozen;                      // bodies
} GuardCounts;

// All counts in order with their names, as in status_t: "restored_tool", "restored_load",
// "restored_set", "restored_time_step", "restored_unknown", "restored_energy",
// "restored_pressure", "rest_shapes", "withdrawn_tools", "withdrawn_loads", "wrenches_withheld",
// "figures_withheld", "frozen_bodies".
enum { GUARD_REASONS = GUARD_CAUSE_COUNT + 6 };
int64_t guard_reason(const GuardCounts *counts, int index, const char **name);

// --- a scene ---

// The counts that a scene will add; no more is allocated. All zero: unknown, allocates the largest
// that a scene may have.
typedef struct SimCounts {
    int bodies, tools, loads, attachments, touches;
} SimCounts;

typedef struct SimOptions {
    double rate_hz;
    Vec3 gravity;
    double tool_timeout_s;
    bool may_load;          // loads can come at run time (by message or log)
    bool contact_stiffness; // compute ToolWrench.stiffness
    bool estimate_error;    // steps may be tried
    double error_hz;        // most estimates of a body's whole error per second; 0: none. With it
                            // steps may be tried, too
    bool error_whole;       // each of them within a tick: for runs without real time
    int max_ties;           // ties by message at a time; 0: none
    SimCounts counts;
} SimOptions;

typedef struct Sim Sim;

// Load time, in this order: sim_create, sim_add_body..., sim_add_tool..., sim_add_load...,
// sim_add_attachment..., sim_add_touch..., sim_seal. Everything is allocated from `arena`; all that
// changes is listed in `state`; both outlive the Sim.
Sim *sim_create(const SimOptions *options, Arena *arena, StateList *state);
// Adds a body made by a model (surface_create). The sim owns the returned body.
Body *sim_add_body(Sim *sim, const Body *body);
void sim_add_tool(Sim *sim, const ToolOptions *options);
void sim_add_load(Sim *sim, const LoadOptions *options);
// Call after bodies and tools. Returns false with a status if the region has no free node.
bool sim_add_attachment(Sim *sim, const AttachmentOptions *options, Status *status);
// Lets two bodies touch; call after all bodies. Returns false with a status for
// bodies that cannot.
bool sim_add_touch(Sim *sim, const TouchOptions *options, Status *status);
// Chooses the stages, contact stiffness and time steps, and lets the bodies settle for `settle_s`
// simulated seconds; RESET returns to the state after that. Returns false for a time step beyond
// its bound, too many substeps, or bad numbers while settling.
bool sim_seal(Sim *sim, double settle_s, Status *status);

// Advances one tick. No allocation, no lock, no system call but the clock.
void sim_step(Sim *sim);

// Apply inputs, between two ticks. `tool` is the index in the order of sim_add_tool.
void sim_apply_pose(Sim *sim, int tool, const ToolPose *pose, bool hold);
// Starts a load now (options->start is ignored). Returns false with a sentence in `why`: no free
// node inside, or no slot.
bool sim_apply_load(Sim *sim, const LoadOptions *options, char *why, size_t why_size);
// Makes, changes or releases a tie; it acts from the next tick on. Returns false if it cannot; then
// nothing was changed. `why`: a sentence in both cases, which names the tie or the member of the
// message that is at fault.
bool sim_apply_tie(Sim *sim, const TieOptions *options, char *why, size_t why_size);
// Returns how many ties the scene has reserved.
int sim_tie_capacity(const Sim *sim);
// Writes the sentence with which a tie was made, by its slot in [0, capacity); returns false if the
// slot is free.
bool sim_describe_tie(const Sim *sim, int slot, char *text, size_t size);
// Finds a tie by its number; returns false if there is none.
bool sim_find_tie(const Sim *sim, int number, TieFigures *figures);
// Cuts now. Returns true if a link was severed; `sum`: the result, with the counts of all bodies
// added. `why`: a sentence in both cases; if false, nothing was changed.
bool sim_apply_cut(Sim *sim, const CutOptions *cut, CutOutcome *sum, char *why, size_t why_size);
// Sets a parameter: "gravity_x|y|z" [m/s2]; "stiffness_scale", "damping_scale", "friction" of all
// bodies, or of one as "<body>.key"; "pressure" [Pa] and "volume" [m3] of one cavity, or of all;
// "adapt_force", "adapt_speed", "adapt_curvature", "adapt_scale"
// and "adapt_level" (the finest allowed) of one body, or of all that adapt; "adapt_error" of those
// that are steered by their error. Returns false with a
// sentence in `why` for an unknown key, a value out of range, or a scale that the body's time step
// does not allow; then nothing was changed.
bool sim_apply_set(Sim *sim, const char *key, double value, char *why, size_t why_size);
// Tells what sim_apply_set would do and changes nothing: the same answer, and in `why` also of a
// value that would be accepted what it is now and what it does to the time steps. `longer`: the
// factor by which ticks are expected to take longer then, by counts of springs and elements;
// 0: it has no effect on them.
bool sim_try_set(Sim *sim, const char *key, double value, double *longer, char *why,
                 size_t why_size);
// Writes a setting as it is now and what it may be, "<body>.friction = 0.3, from 0 to 10" or
// "gravity = (0, 0, -9.81)"; returns false with a sentence for a key that no single body has.
bool sim_tell_setting(Sim *sim, const char *key, char *text, size_t size);
// Lists the keys of SET that a body has: "stiffness_scale, damping_scale, friction".
void sim_list_settings(const Sim *sim, int body, char *text, size_t size);
bool sim_try_gravity(Vec3 gravity, char *why, size_t why_size);
// Sets all three components [m/s2].
bool sim_apply_gravity(Sim *sim, Vec3 gravity, char *why, size_t why_size);
// Returns bodies to the state after settling, withdraws tools, ends loads; step and time go on.
void sim_reset(Sim *sim);
// Recomputes what depends on the state list after it was overwritten from outside (checkpoint).
void sim_restored(Sim *sim);
// True if the state of time, tools, loads, strokes, attachments and settings is consistent; call
// after sim_restored. BodyOps.check checks the bodies' own numbers.
bool sim_check(const Sim *sim);
// In lockstep tools do not become stale.
void sim_set_lockstep(Sim *sim, bool lockstep);

int64_t sim_steps(const Sim *sim); // ticks completed
double sim_time(const Sim *sim);   // simulated [s] = steps / rate
double sim_tick(const Sim *sim);   // [s]
int sim_body_count(const Sim *sim);
Body *sim_body(Sim *sim, int index);
// Returns the substeps a tick that the body would need by itself without damping and drag. Load
// time only.
int sim_undamped_substeps(Sim *sim, int index);
int sim_tool_count(const Sim *sim);
const ToolOptions *sim_tool(const Sim *sim, int index);
const ToolMotion *sim_tool_motion(const Sim *sim, int index);
const ToolWrench *sim_wrench(const Sim *sim, int index); // of the last tick
int64_t sim_resets(const Sim *sim);
const GuardCounts *sim_guard_counts(const Sim *sim);
// True if the guard has withdrawn the tool: its poses have no effect until an inactive one.
bool sim_tool_withdrawn(const Sim *sim, int index);
// Returns a figure fit to be published: one that is not finite becomes 0, and is counted.
double sim_figure(Sim *sim, double figure);
// Measures a body, with figures fit to be published.
void sim_measure(Sim *sim, int body, BodyMeasure *measure);
// Returns the number of connected pieces of a body.
int sim_pieces(const Sim *sim, int body);
// Removes the oldest waiting event; returns false if none waits. At most SIM_EVENTS wait.
bool sim_take_event(Sim *sim, SimEvent *event);
// Returns the faces within a tool's reach but beyond its capacity for candidates, summed over
// ticks.
int64_t sim_refused_faces(const Sim *sim);
// Returns the points and faces of bodies near each other that had no space, summed over ticks.
int64_t sim_refused_touches(const Sim *sim);
// Returns the nodes of the scene's attachment, in the order of sim_add_attachment.
int sim_attachment_nodes(const Sim *sim, int index);
// Returns the nodes and points of faces beyond the capacity of graspers, attachments and ties.
int64_t sim_refused_holds(const Sim *sim);
// Returns the next grasp or release since the last call; for each body and tool at most ten per
// simulated second. Returns false if there is none. Between two ticks.
bool sim_next_grasp(Sim *sim, GraspEvent *event);

// Tries a step of a body to estimate its error (estimate.c), between two ticks, with
// SimOptions.estimate_error; the motion stays bit-identical.
void sim_try_step(Sim *sim, int body);
// Computes a tick's substeps of one body, as bodies without tools, loads and attachments take them,
// and discards them, to time them. Between two ticks, load time only: warm starts stay changed, and
// a body whose steps cannot be tried moves.
void sim_step_alone(Sim *sim, int body);
// Returns the largest estimated error of a tick of that body since the last call [m]; 0: unknown.
double sim_take_error(Sim *sim, int body);

// The error of a body's discretisation (error.c). -1: unknown.
typedef struct SimError {
    double space;    // of the discretisation in space: of the outer nodes' displacements, rms [m]
    double steps;    // of the time steps, likewise [m] (estimate.h)
    double total;    // the first, and the second where it is known [m]
    double relative; // the same over the rms displacement of the outer nodes, the largest of the
                     // last 0.2 s, or over 1/1000 of the longest edge if that is more
    int64_t age;     // ticks since the state that `space` is of
    int rounds;      // of BodyOps.estimate completed since the start
} SimError;

// The force of a tool on all bodies and its error by the discretisation in space.
typedef struct SimToolError {
    double force; // sum of what it exerts on each body in the last tick [N]; 0: it touches none
    double error; // [N]; -1: unknown
} SimToolError;

// With SimOptions.error_hz; the latter sets one for each tool. Between two ticks.
void sim_error(const Sim *sim, int body, SimError *error);
void sim_tool_errors(const Sim *sim, SimToolError *error);
// Returns how often all bodies have completed a round since the start, about error_hz times a
// second: then the errors are as new as they get.
int sim_error_cycles(const Sim *sim);

// Return the stages of this scene in order, and the time spent in each since the start [ns].
int sim_stage_count(const Sim *sim);
StageId sim_stage(const Sim *sim, int index);
int64_t sim_stage_ns(const Sim *sim, StageId stage);
// Adds time to the runner's own stages.
void sim_add_stage_ns(Sim *sim, StageId stage, int64_t ns);

#endif
