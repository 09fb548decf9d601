// The bodies and tools of one scene, and one tick of them. Knows nothing of threads, messages,
// files or wall-clock time: whoever owns a Sim calls it from one thread.
#ifndef PLIANT_DYNAMICS_SIM_H
#define PLIANT_DYNAMICS_SIM_H

#include "base/arena.h"
#include "base/state.h"
#include "base/status.h"
#include "dynamics/attachment.h"
#include "dynamics/body.h"
#include "dynamics/contact.h"
#include "dynamics/guard.h"
#include "dynamics/tool.h"

// The stages of a tick, in their order. Timers, status, --explain and the benchmark use this list.
typedef enum StageId {
    STAGE_INPUTS,        // take poses, loads and commands (the runner's)
    STAGE_TOOLS,         // place tools, withdraw stale ones
    STAGE_LOADS,         // start and end loads
    STAGE_CUT,           // strokes of blades, tearing
    STAGE_RECONSTRUCT,   // refine what cuts have left to be refined
    STAGE_ADAPT,         // refine and coarsen
    STAGE_GRASP,         // take hold and let go
    STAGE_FIND_CONTACTS, // candidates, sides
    STAGE_FORCES,        // all forces and the integration, substep by substep
    STAGE_CONTACT,       // contact forces inside the substeps
    STAGE_WRENCHES,      // impulses to wrenches
    STAGE_CHECK,         // numbers finite; else restore
    STAGE_STIFFNESS,     // how stiff bodies feel to tools, a part of it
    STAGE_ESTIMATE,      // steps tried to know their error (the runner's, in the time left)
    STAGE_SNAPSHOT,      // hand positions to the bus (the runner's)
    STAGE_COUNT,
} StageId;

const char *stage_name(StageId stage);

enum { SIM_LOADS = 64 }; // loads in force at a time, scene's and messages' together

// A force shared by the nodes found inside a sphere when it starts (load_t, or a scene's load).
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

enum { SIM_EVENTS = 64, SIM_EVENT_TEXT = 184 };

// Something that happened once in a tick or a cut.
typedef struct SimEvent {
    int64_t step; // ticks completed when it happened
    int body;
    const char *kind; // "cut" (a stroke ended), "tear", "piece", "cut_refused", "restored",
                      // "withdrawn"
    char text[SIM_EVENT_TEXT];
} SimEvent;

// What one tool felt in the last tick: contact_t without its envelope.
typedef struct ToolWrench {
    bool contact;       // touches, or holds something
    Vec3 position;      // of the proxy at the end of the tick
    Vec3 force, torque; // on the tool; torque about `position`
    Vec3 point, normal; // normal zero and depth 0 of a tool that only holds
    double depth;
    double stiffness[6]; // (stiffness.h) xx yy zz yz zx xy [N/m]; all zero: not known
    double damping;      // along the normal [N s/m]
} ToolWrench;

// A grasper took hold of a body, or let it go.
typedef struct GraspEvent {
    int tool, body; // indices
    int nodes;      // held now, or points of faces; 0: nothing
    bool points;
    int64_t taken; // times that it took hold of that body so far
    int64_t step;
} GraspEvent;

// How much a scene will add; no more than that is allocated. All zero: not known before, room for
// whatever a scene may have.
typedef struct SimCounts {
    int bodies, tools, loads, attachments;
} SimCounts;

typedef struct SimOptions {
    double rate_hz;
    Vec3 gravity;
    double tool_timeout_s;
    bool may_load;          // loads can come at run time (by message or log)
    bool contact_stiffness; // ToolWrench tells it
    bool estimate_error;    // steps may be tried
    SimCounts counts;
} SimOptions;

typedef struct Sim Sim;

// Load time, in this order: sim_create, sim_add_body..., sim_add_tool..., sim_add_load...,
// sim_add_attachment..., sim_seal. Everything is allocated from `arena`, all that changes is listed
// in `state`; both outlive the Sim.
Sim *sim_create(const SimOptions *options, Arena *arena, StateList *state);
// Takes a body made by a model (surface_create). The returned body is owned by the sim.
Body *sim_add_body(Sim *sim, const Body *body);
void sim_add_tool(Sim *sim, const ToolOptions *options);
void sim_add_load(Sim *sim, const LoadOptions *options);
// After bodies and tools. False with a status: no free node in the region.
bool sim_add_attachment(Sim *sim, const AttachmentOptions *options, Status *status);
// Chooses the stages, contact stiffness, time steps; settles for `settle_s` simulated seconds; the
// state after it is the one that RESET returns to. False: a time step beyond its bound, too many
// substeps, or a settling that ended in bad numbers.
bool sim_seal(Sim *sim, double settle_s, Status *status);

// One tick. No allocation, no lock, no system call but the clock.
void sim_step(Sim *sim);

// Inputs, between two ticks. `tool` is the index in the order of sim_add_tool.
void sim_apply_pose(Sim *sim, int tool, const ToolPose *pose, bool hold);
// Starts a load now (options->start is ignored). False with a sentence in `why`: no free node
// inside, no room.
bool sim_apply_load(Sim *sim, const LoadOptions *options, char *why, size_t why_size);
// Cuts now. True when a link was severed; `sum`: what became of it, counts of all bodies asked
// together. `why`: a sentence either way; false: nothing was changed.
bool sim_apply_cut(Sim *sim, const CutOptions *cut, CutOutcome *sum, char *why, size_t why_size);
// "gravity_x|y|z" [m/s2]; "stiffness_scale", "damping_scale", "friction" of all bodies, or of one
// as "<body>.key"; "adapt_force", "adapt_speed", "adapt_curvature", "adapt_scale" and "adapt_level"
// (the finest that may be used) of one body, or of all that adapt. False with a sentence in `why`:
// an unknown key, a value out of range, or a scale that the body's time step does not allow; then
// nothing was changed.
bool sim_apply_set(Sim *sim, const char *key, double value, char *why, size_t why_size);
// All three components [m/s2].
bool sim_apply_gravity(Sim *sim, Vec3 gravity, char *why, size_t why_size);
// Bodies return to the state after settling, tools are withdrawn, loads end; step and time go on.
void sim_reset(Sim *sim);
// After the state list was overwritten from outside (checkpoint): what follows from it is made
// anew.
void sim_restored(Sim *sim);
// After sim_restored: whether what the state says of time, tools, loads, strokes and
// attachments can be. The bodies' own numbers
// are asked of them (BodyOps.check).
bool sim_check(const Sim *sim);
// In lockstep tools do not become stale.
void sim_set_lockstep(Sim *sim, bool lockstep);

int64_t sim_steps(const Sim *sim); // ticks completed
double sim_time(const Sim *sim);   // simulated [s] = steps / rate
double sim_tick(const Sim *sim);   // [s]
int sim_body_count(const Sim *sim);
Body *sim_body(Sim *sim, int index);
const Body *sim_find_body(const Sim *sim, const char *name); // or NULL
int sim_tool_count(const Sim *sim);
const ToolOptions *sim_tool(const Sim *sim, int index);
const ToolMotion *sim_tool_motion(const Sim *sim, int index);
const ToolWrench *sim_wrench(const Sim *sim, int index); // of the last tick
int64_t sim_resets(const Sim *sim);
const GuardCounts *sim_guard_counts(const Sim *sim);
// Whether a tool was withdrawn by the guard, so that its poses do nothing until an inactive one.
bool sim_tool_withdrawn(const Sim *sim, int index);
// A figure that is fit to be published: one that is not finite becomes 0, and is counted.
double sim_figure(Sim *sim, double figure);
// Figures of a body, likewise.
void sim_measure(Sim *sim, int body, BodyMeasure *measure);
// Connected pieces of a body.
int sim_pieces(const Sim *sim, int body);
// Takes out the oldest event of those that wait; false: none. More than SIM_EVENTS do not wait.
bool sim_take_event(Sim *sim, SimEvent *event);
// Faces within a tool's reach that had no room among its candidates, tick by tick.
int64_t sim_refused_faces(const Sim *sim);
// Nodes of the scene's attachment, in the order of sim_add_attachment.
int sim_attachment_nodes(const Sim *sim, int index);
// Nodes and points of faces that graspers and attachments had no room for.
int64_t sim_refused_holds(const Sim *sim);
// What graspers have done since it was told, one after the other; of each body and tool at most
// ten times a simulated second. False: nothing new. Between two ticks.
bool sim_next_grasp(Sim *sim, GraspEvent *event);

// With SimOptions.estimate_error, between two ticks: tries a step of a body to know its error
// (estimate.h); the motion stays as it is, to the bit.
void sim_try_step(Sim *sim, int body);
// The largest estimated error of a tick of that body since the last call [m]; 0: not known.
double sim_take_error(Sim *sim, int body);

// The stages of this scene in order, and the time spent in each since the start [ns].
int sim_stage_count(const Sim *sim);
StageId sim_stage(const Sim *sim, int index);
int64_t sim_stage_ns(const Sim *sim, StageId stage);
// For the runner's own stages.
void sim_add_stage_ns(Sim *sim, StageId stage, int64_t ns);

#endif
