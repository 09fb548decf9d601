// Private to the module sim: the data of a Sim. sim.c makes it, inputs.c changes it, step.c
// runs it with cutting.c, follow.c and guard.c, time_step.c chooses the substeps.
#ifndef PLIANT_DYNAMICS_SIM_DATA_H
#define PLIANT_DYNAMICS_SIM_DATA_H

#include "base/vec.h"
#include "sim/hold/attachment.h"
#include "sim/load.h"
#include "sim/sim.h"
#include "sim/contact/stiffness.h"

enum {
    SIM_BODIES = 64,
    SIM_TOOLS = 32,
    SIM_SCENE_LOADS = 64,
    SIM_ATTACHMENTS = 64,
    SIM_TOUCHES = 64
};

// The time of a scene; plain data, part of the state.
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
    int64_t lifted; // the next motion starts another stroke, though the blade is active:
                    // STROKE_BROKEN off by the body, or STROKE_LIFTED
} Stroke;

// A body that can be cut or torn; plain data, part of the state.
typedef struct BodyCuts {
    int64_t pieces;
    int64_t torn, torn_nodes;            // not reported yet
    int64_t reported_step, refused_step; // last reports of a tear and of a refusal
} BodyCuts;

// One attachment of the scene: to a frame or to another body.
typedef struct SimAttachment {
    Attachment *attachment; // NULL: the joint
    Joint *joint;
} SimAttachment;

// Bodies connected by joints, or that touch, over any number of others, advance together stage by
// stage. Other bodies are groups of one.
typedef struct GroupMember {
    int first; // of the group, by index: itself if it is alone
    int next;  // in the group; -1: none
} GroupMember;

// The blades, strokes and cuttable bodies of a scene.
typedef struct Cutting {
    int blade_count, blade_tool[SIM_TOOLS]; // blades in the order of the tools
    BodyCuts *cuts[SIM_BODIES];             // NULL: neither cuttable nor tears
    Stroke *stroke[SIM_BODIES];             // [blade_count]; NULL likewise, or without blades
} Cutting;

// Events that have not been taken yet.
typedef struct EventRing {
    SimEvent event[SIM_EVENTS]; // a ring
    int first, count;
} EventRing;

// --- ties by message (tie.c) ---

// One tie; plain data, part of the state. All zero: the slot is free.
typedef struct TieRecord {
    int64_t number;              // from 1
    int64_t kind;                // TieKind
    int64_t body, to_body, tool; // indices, or -1
    double stiffness, damping_ratio;
    double break_force; // [N]; 0: never
    double closing;     // of a clip: how fast its gap closes [m/s]
} TieRecord;

// All memory of a scene's ties. A slot is an attachment or a joint while it is used.
typedef struct TiePool {
    int capacity; // slots
    int room;     // nodes that each may hold
    TieRecord *record;
    Attachment **attachment; // [capacity] reserved
    Joint **joint;           // [capacity] reserved

    // --- what the scene has without ties, constant ---
    GroupMember *group; // [body_count]
    Attachment **own;   // of the scene, and graspers, for each body
    int *own_start;     // [body_count + 1]
    int joint_count;

    // --- follows from the state ---
    bool *live;               // [capacity] used, and its state is consistent
    double *lambda, *damping; // [body_count] what ties add to the bounds: [1/s2], [1/s]

    // --- scratch, for the largest body ---
    TieScratch shared;
    int *found;           // [node slots]
    int *face;            // [TIE_FACES] on which ends may be
    Vec3 *corner;         // [3 TIE_FACES] of them
    uint64_t *mark_face;  // one bit per face: all 0 between calls
    int *id;              // [state rows]
    Vec3 *x, *v;          // [state rows]
    double *share, *root; // [node slots] sums of g, and of 2 zeta sqrt(g)
} TiePool;

// --- the memory of the guard ---
// Ticks count from 1 here, so that 0 means never. All plain data, part of the state, and 0 until a
// tick is bad or a SET comes.
typedef struct GuardBody {
    Blame bad;          // bad ticks of the current window
    int64_t told;       // tick of the newest report about it
    int64_t unreported; // restores since that report
    int64_t set;        // tick of the newest SET
    int64_t set_key;    // number of its key (setting_name)
    Blame energy;       // restores because of energy without a source
    int64_t cause;      // GuardCause of the newest restore, during consecutive bad ticks
    int64_t loaded; // tick in which a load ended that left it excess energy, until that is gone; of
                    // several loads the strongest
    Vec3 load_force; // of that load [N]
} GuardBody;

// Limits of a body's energy: plain data, part of the state, though no motion depends on it unless
// it is exceeded.
typedef struct EnergyAccount {
    double had;    // at the last check, or less if that was explained [J]
    double outer;  // BodyMeasure.outer at that time [J]
    double given;  // by tools since then, at most [J]
    double touch;  // by contacts since then: work of tools and energy of their springs [J]
    double held;   // by contacts at that time, at most [J]
    int64_t known; // 0: unknown yet, or changed by something that is no work; else 1
} EnergyAccount;

typedef enum EnergyVerdict {
    ENERGY_RIGHT,
    ENERGY_WRONG_TOUCH,  // contacts gave more than they had
    ENERGY_WRONG_MOTION, // too much kinetic energy: velocities are set to zero
    ENERGY_WRONG_SHAPE,  // springs alone store too much
} EnergyVerdict;

typedef struct GuardTool {
    int64_t withdrawn; // 0 or 1
    int64_t pose;      // tick of the newest refused pose at that time
    Blame blame;
} GuardTool;

typedef struct Guard {
    GuardBody *body;       // [body_count]
    GuardTool *tool;       // [tool_count]
    EnergyAccount *energy; // [body_count]
    int64_t window;        // ticks

    GuardCounts counts;
} Guard;

// A possible cause of a body's bad numbers.
typedef struct Suspect {
    GuardCause cause;
    int index;    // of the tool or load
    bool stays;   // cannot be withdrawn
    double force; // largest force of it [N]
    Vec3 point;   // its location; of tools
    bool holds;   // a tool that grasps the body
} Suspect;

// --- all of it ---

typedef struct Estimator Estimator;

struct Sim {
    // --- constant after sim_seal ---
    SimOptions options;
    Arena *arena;
    StateList *state;
    double tick; // [s]
    int body_count, tool_count, scene_load_count, contact_count;
    SimCounts capacity;      // capacities of the scene's own arrays
    GroupMember *group;      // [room.bodies]
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
    int scene_attachment_count;
    Joint **joint; // [joint_count] of the scene, then of ties
    int joint_count;
    Attachment **attachment; // [attachment_count], of the scene, then graspers, for each body;
    int attachment_count;    // NULL: none
    int *attachment_start;   // [body_count + 1]
    GraspEvent *told;        // [attachment_count] grasps that sim_next_grasp has reported
    Touch **touch;           // [room.touches] as given
    int touch_count;
    Estimator *estimator;          // of the steps' error; NULL: disabled
    StiffnessEstimator *stiffness; // NULL: disabled, or no contact has any
    TiePool *ties;                 // NULL: none by message

    // --- results of the last tick ---
    EventRing *events; // including earlier ones that were not taken
    Guard *guard;
    ToolWrench *wrench; // [tool_count]
    bool settling;      // loads wait, and tools do not become stale

    // --- accounting, since the start ---
    int64_t stage_ns[STAGE_COUNT];
    int64_t resets, lost_loads;
};

static inline bool in_one_group(const Sim *sim, int a, int b)
{
    return sim->group[a].first == sim->group[b].first;
}

// Returns the simulated time between the application of a tool's newest pose and the start of this
// tick [s].
static inline double sim_pose_age(const Sim *sim, const ToolMotion *motion)
{
    return (double)(sim->clock->step - motion->pose_step) * sim->tick;
}

// The attachments of a body: attachment[*first .. end), including graspers; returns the end.
static inline int holding_of(const Sim *sim, int body, int *first)
{
    *first = sim->attachment_count > 0 ? sim->attachment_start[body] : 0;
    return sim->attachment_count > 0 ? sim->attachment_start[body + 1] : 0;
}

// step.c
// Advances a body by the time of one substep in `substeps` steps, without external forces and
// without the bodies that joints connect it to; for the error estimate, which takes it back.
void advance_alone(Sim *sim, int body, int substeps);
// Lists the stages that the scene needs. Load time, when all else is complete.
void pipeline_create(Sim *sim);

// follow.c
// Changes a body's topology and describes the change; returns false if nothing has changed.
typedef bool BodyChange(Sim *sim, int body, void *context, TopologyChange *change);
// Makes one change, and more while the body requires them (TopologyChange.again). The topology
// number increases, and contacts, attachments, joints, loads and the time step are updated.
void change_body(Sim *sim, int body, BodyChange *make, void *context);

// guard.c
// Load time, when all bodies and tools exist.
void guard_create(Sim *sim);
// True if the body as loaded can be simulated.
bool guard_can_be(const Body *body, Status *status);
// Keeps each body's result of the tick, or restores its last good state. Returns true if any was
// restored; its effect on tools is then discarded.
bool guard_bodies(Sim *sim);
// Counts one more bad tick; returns true if there are too many within the window.
bool guard_count(Blame *blame, int64_t tick, int64_t window, int most);

// settings.c
// Returns the name of a key of SET by its number, as GuardBody.set_key has it.
const char *setting_name(int64_t number);
// True for a number that a state may have.
bool setting_is_numbered(int64_t number);

// guard_energy.c
// Remembers loads that leave energy behind; call before they end.
void guard_note_loads(Sim *sim);
// True if contacts have given the body excess energy since the last check.
bool guard_was_pushed(const Sim *sim, int body);
// Returns the number of ticks between two checks of a body's energy.
int64_t guard_energy_ticks(const Body *body);
// Checks a body's energy after a good tick; sets what it has and the most that was there or given
// [J].
EnergyVerdict guard_energy(Sim *sim, int body, double *has, double *most);
// Restarts the account of a body, or (-1) of all, after a change that is no work.
void guard_renew(Sim *sim, int body);

// Sets a wrench that is not fit to be published to zero.
void guard_wrenches(Sim *sim);
// True if a pose may move its tool: not after a withdrawal, until its sender has released the tool.
bool guard_admits(Sim *sim, int tool, const ToolPose *pose);
// Records a SET by the number of its key. `body` -1: all.
void guard_note_set(Sim *sim, int body, int key);
// True if the state read from a checkpoint is consistent.
bool guard_check(const Sim *sim);

// guard_blame.c
// Finds the cause of a body's bad numbers and describes it in `text`.
GuardCause guard_find_cause(const Sim *sim, int body, Suspect *suspect, char *text, size_t size);
// Counts a bad tick for its cause and withdraws it if there are too many. Returns true if it was
// withdrawn.
bool guard_blame(Sim *sim, int body, const Suspect *suspect);

// sim.c
// Appends an event. `kind` is a literal.
void sim_report(Sim *sim, int body, const char *kind, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

// cutting.c
// Load time, when all bodies and tools exist.
void cutting_create(Sim *sim);
void cutting_settled(Sim *sim);
void cutting_stage(Sim *sim);
void reconstruct_stage(Sim *sim);
// Ends the strokes of a withdrawn tool; its next motion is another stroke.
void cutting_lift(Sim *sim, int tool);
// Ends the strokes in a restored body: the jump of its links is no motion that a blade cuts.
void cutting_break_off(Sim *sim, int body);
// True if the state read from a checkpoint is consistent.
bool cutting_check(const Sim *sim);

// time_step.c
// Lowers contact_lambda of an implicit body to what its step allows. Load time, before the
// contacts' stiffness is set.
void time_step_cap_contacts(const Sim *sim, Body *body);
// Chooses the time step at load time. Returns false if the scene's exceeds the bound of the body's
// finest level, or needs too many substeps.
bool time_step_choose(Sim *sim, Body *body, Status *status);
// Sets time_step_limit, substeps and h after the body's bounds or scales have changed. A time step
// of the scene that exceeds the bound is shortened, unless it is unsafe_time_step.
void time_step_follow(Sim *sim, Body *body);
// Gives joined bodies the same steps, the shortest of any. Load time, once every body has chosen.
void time_step_join(Sim *sim);
// Returns the largest stable step of a body at its finest level, with all tools [s].
double time_step_bound(const Sim *sim, const Body *body);
// True if the body's step at its finest level allows these scales; sets the allowed step and its
// step [s].
bool time_step_allows(const Sim *sim, const Body *body, double stiffness_scale,
                      double damping_scale, double *limit, double *step);
// Writes ", or <key> of at most <value>": the smallest change of a single key that lets the body
// take steps of h [s], or "" if there is none. Load time.
void time_step_advise(Sim *sim, Body *body, double h, char *text, size_t size);

// sim.c
// Merges the groups of two bodies.
void sim_join(Sim *sim, int a, int b);

// tie.c
// Reserves the pool. Load time, when all that the scene itself attaches exists.
void ties_create(Sim *sim);
// Returns the most entries that the ties can push on a body in one evaluation.
int ties_node_capacity(const Sim *sim);
// Recomputes what follows from the state: which ties act, groups and time steps.
// Returns the largest sum of their stiffness at one node.
double ties_follow(Sim *sim);
// Recomputes what ties add to the bounds of the bodies, after a change of topology; returns
// likewise.
double ties_bound(Sim *sim);
void ties_begin_tick(Sim *sim);
// Ends the ties that have pulled harder than they may.
void ties_stage(Sim *sim);
// True if the state is consistent, after ties_follow.
bool ties_check(const Sim *sim);
int64_t ties_refused(const Sim *sim);

// estimate.c
// Allocates memory for the state that a try changes; load time, after the state of all bodies is
// listed.
Estimator *estimate_create(const Body *body, int count, const StateList *state, Arena *arena);
// Tries a body, between two ticks. Costs three substeps, with RK4 of 4 evaluations each.
void estimate_try(Sim *sim, int index);
// Returns the largest error of a tick [m] (of all its substeps) in the tries since the last call;
// 0: none, or the body cannot be tried.
double estimate_take(Estimator *estimator, int index);

#endif
