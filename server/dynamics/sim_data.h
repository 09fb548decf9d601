// Private to the dynamics room: what a Sim holds. sim.c makes it, set.c changes it, step.c runs it
// with cutting.c, holding.c, follow.c and guard.c, time_step.c chooses how finely.
#ifndef PLIANT_DYNAMICS_SIM_DATA_H
#define PLIANT_DYNAMICS_SIM_DATA_H

#include "dynamics/estimate.h"
#include "dynamics/guard_data.h"
#include "dynamics/joint.h"
#include "dynamics/load.h"
#include "dynamics/sim.h"
#include "dynamics/stiffness.h"

enum { SIM_BODIES = 64, SIM_TOOLS = 32, SIM_SCENE_LOADS = 64, SIM_ATTACHMENTS = 64 };

// Where a scene stands in time; plain data, part of the state.
typedef struct SimClock {
    int64_t step;      // ticks completed
    int64_t lockstep;  // 0 or 1: tools do not become stale
    int64_t next_load; // first of the scene's loads not yet started
} SimClock;

enum { STROKE_BROKEN = 1, STROKE_LIFTED };

// One blade in one body; plain data, part of the state.
typedef struct Stroke {
    CutStroke cut;
    int64_t separated, nodes_added; // since it began
    int64_t lifted;                 // what comes next is another one, though the blade is active:
                                    // STROKE_BROKEN off by the body, or STROKE_LIFTED
} Stroke;

// A body that can be cut or torn; plain data, part of the state.
typedef struct BodyCuts {
    int64_t pieces;
    int64_t torn, torn_nodes;        // not told yet
    int64_t told_step, refused_step; // when a tear and a refusal were told last
} BodyCuts;

// One of the scene's: to a frame or to another body.
typedef struct SimAttachment {
    Attachment *attachment; // NULL: the joint
    Joint *joint;
} SimAttachment;

// What a scene has in which something can be cut.
typedef struct Cutting {
    int blade_count, blade_tool[SIM_TOOLS]; // blades in the order of the tools
    BodyCuts *cuts[SIM_BODIES];             // NULL: neither cuttable nor tears
    Stroke *stroke[SIM_BODIES];             // [blade_count]; NULL likewise, or without blades
} Cutting;

// Events that nobody has taken out yet.
typedef struct EventRing {
    SimEvent event[SIM_EVENTS]; // a circle
    int first, count;
} EventRing;

struct Sim {
    // --- constant after sim_seal ---
    SimOptions options;
    Arena *arena;
    StateList *state;
    double tick; // [s]
    int body_count, tool_count, scene_load_count, contact_count;
    SimCounts room;          // of the arrays of the scene's own
    ToolOptions *tool;       // [room.tools]
    LoadOptions *scene_load; // [room.loads] by start
    int stage_count;
    StageId stage[STAGE_COUNT];
    int *pieces_at_load; // [body_count]
    void *start_state;   // copy of the state that sim_reset returns to

    // --- changes while running; what `state` lists ---
    SimClock *clock;
    Body *body;         // [room.bodies]
    ToolMotion *motion; // [tool_count]
    Contact **contact;  // [contact_count], tool by tool for each body
    int *contact_tool;  // [contact_count]
    int *contact_start; // [body_count + 1]
    LoadSet loads;
    Cutting *cutting;                // NULL: no body can be cut
    SimAttachment *scene_attachment; // [room.attachments] as given
    int scene_attachment_count, joint_count;
    int *joined;             // [room.bodies] the first of the bodies that are joined with this one,
                             // itself too; NULL without attachments
    Attachment **attachment; // [attachment_count], of the scene, then graspers, for each body;
    int attachment_count;    // NULL: none
    int *attachment_start;   // [body_count + 1]
    GraspEvent *told;        // [attachment_count] what sim_next_grasp has told of graspers
    Estimator *estimator;    // of the error of steps; NULL: not wanted
    StiffnessEstimator *stiffness; // NULL: not wanted, or no contact has any

    // --- results of the last tick ---
    EventRing *events; // and what of earlier ones was not taken out
    Guard *guard;
    ToolWrench *wrench; // [tool_count]
    bool settling;      // loads wait, stale tools cannot be

    // --- accounting, since the start ---
    int64_t stage_ns[STAGE_COUNT];
    int64_t resets, lost_loads;
};

// Simulated time since a tool's newest pose was applied, at the start of this tick [s].
static inline double sim_pose_age(const Sim *sim, const ToolMotion *motion)
{
    return (double)(sim->clock->step - motion->pose_step) * sim->tick;
}

// follow.c
// Changes a body's topology and says how; false: nothing has changed.
typedef bool BodyChange(Sim *sim, int body, void *context, TopologyChange *change);
// One change, and more as long as the body asks for them (TopologyChange.again): the number of the
// topology goes up, and contacts, holds, ties, loads and the time step follow.
void change_body(Sim *sim, int body, BodyChange *make, void *context);

// guard.c
// At load, once all bodies and tools are there.
void guard_create(Sim *sim);
// Whether a body as loaded is one of which numbers can be told.
bool guard_can_be(const Body *body, Status *status);
// Every body keeps the result of the tick, or gets the last good state back. True: some did, and
// what they did to tools is forgotten.
bool guard_bodies(Sim *sim);
// A wrench that nobody should feel becomes none.
void guard_wrenches(Sim *sim);
// Whether a pose may move its tool: not one that was withdrawn, before its sender has let it go.
bool guard_admits(Sim *sim, int tool, const ToolPose *pose);
// `body` -1: all. What is not said of a body is not noted.
void guard_note_set(Sim *sim, int body, const char *key);
// Whether what a checkpoint has brought can be.
bool guard_check(const Sim *sim);

// guard_blame.c
// Finds out why a body's numbers are bad, and says so in `text`.
GuardCause guard_find_cause(const Sim *sim, int body, Suspect *suspect, char *text, size_t size);
// A bad tick that it is to blame for: one that has caused too many of them is withdrawn. True: it
// was.
bool guard_blame(Sim *sim, int body, const Suspect *suspect);

// holding.c
// The attachments of a body: attachment[*first .. end), graspers' too; returns the end.
static inline int holding_of(const Sim *sim, int body, int *first)
{
    *first = sim->attachment_count > 0 ? sim->attachment_start[body] : 0;
    return sim->attachment_count > 0 ? sim->attachment_start[body + 1] : 0;
}
// Graspers take hold and let go.
void holding_stage(Sim *sim);
// Whether a tool does not push a body, since it holds it.
bool holding_mutes(const Sim *sim, int body, int tool);
// The springs of what is held, at one evaluation, so long after the tick began [s].
void holding_add_forces(Sim *sim, int body, const Stage *stage, double substep_time, double h);

// events.c
// Puts an event in line. `kind` is a literal.
void sim_tell(Sim *sim, int body, const char *kind, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

// time_step_advice.c
// Writes ", or <key> of at most <value>": the one whose change is the smallest that lets the body
// take steps of h [s], or "" where none alone does. Load time.
void time_step_advise(Sim *sim, Body *body, double h, char *text, size_t size);

// cutting.c
// At load, once all bodies and tools are there.
void cutting_create(Sim *sim);
void cutting_settled(Sim *sim);
void cutting_stage(Sim *sim);
void reconstruct_stage(Sim *sim);
// A tool was withdrawn: what it does next is another stroke.
void cutting_lift(Sim *sim, int tool);
// A body was restored: what its links did is no motion that a blade cuts.
void cutting_break_off(Sim *sim, int body);
// Whether what a checkpoint has brought can be.
bool cutting_check(const Sim *sim);

// time_step.c
// At load, before the contacts' stiffness is set: lowers contact_lambda of an implicit body to what
// its step allows.
void time_step_cap_contacts(const Sim *sim, Body *body);
// At load. False: a wanted time step that is above the bound of the body's finest level, or too
// many substeps.
bool time_step_choose(Sim *sim, Body *body, Status *status);
// After the body's bounds or scales have changed: sets time_step_limit, substeps and h. A wanted
// time step that is longer than the bound gives way, unless it was called unsafe.
void time_step_follow(Sim *sim, Body *body);
// At load, once every body has chosen: bodies that are joined take the same steps, the shortest of
// any.
void time_step_join(Sim *sim);
// The largest stable step of a body at its finest level, tools and all [s].
double time_step_bound(const Sim *sim, const Body *body);
// Whether the step that the body takes at its finest level allows these scales; what they allow
// and what it takes [s].
bool time_step_allows(const Sim *sim, const Body *body, double stiffness_scale,
                      double damping_scale, double *limit, double *step);

#endif
