// SPDX-License-Identifier: MIT
// libpliant-client: the client side of Pliant, a real-time server of soft tissue.
//
// A client is used by one thread at a time; different clients are independent. What a function
// returns by pointer belongs to the client, and stays valid until the next call with that client,
// unless it says otherwise. SI units, world frame. Every message is checked before it is decoded:
// numbers in what is returned are finite, indices are inside their arrays, strings end (but may
// hold control characters). The library never exits, prints nothing, and leaves signals alone;
// without memory it aborts.
#ifndef PLIANT_CLIENT_H
#define PLIANT_CLIENT_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PLIANT_API __attribute__((visibility("default")))

// Returns the version of the library, "0.3.0". Members are added at the end of structures that the
// library fills; any other change of this header changes the name that programs link.
PLIANT_API const char *pliant_version(void);

// --- connection ---

typedef struct PliantClient PliantClient;

typedef struct PliantError {
    char text[1024]; // one sentence
} PliantError;

typedef struct PliantOptions {
    const char *url;          // of LCM's network; NULL: LCM_DEFAULT_URL, else LCM's default
    const char *prefix;       // of the channels; NULL: "PLIANT"
    const char *input_prefix; // of tools and requests; NULL: as `prefix`
} PliantOptions;

// Connects to the network and hears everything on the prefix; a server may start later. `options`
// may be NULL, and so may `error`. Returns NULL with a sentence on failure.
PLIANT_API PliantClient *pliant_open(const PliantOptions *options, PliantError *error);
// Also withdraws the tools that this client drives. NULL is allowed; bodies that are kept stay.
PLIANT_API void pliant_close(PliantClient *client);
// Returns why the last call failed, "" if none has. Valid until the next failure.
PLIANT_API const char *pliant_error(const PliantClient *client);

// Handles messages for `seconds`; 0: those that are there. A signal ends it early. Call it often:
// the kernel buffers messages for a fraction of a second. Returns false after pliant_stop, or if
// the connection is broken.
PLIANT_API bool pliant_wait(PliantClient *client, double seconds);
// Ends the wait or the request in progress, and each later one at once: they fail, "interrupted".
// What only sends goes on. For handlers of signals and for other threads; `client` stays open.
PLIANT_API void pliant_stop(PliantClient *client);
// Handles messages until one of them changes what the functions below return (a frame, contact,
// status, event or answer), so that a caller can look at each. Returns 1 then, 0 after `seconds` or
// at a signal, -1 after pliant_stop or if the connection is broken.
PLIANT_API int pliant_wait_next(PliantClient *client, double seconds);
// Waits for a message of a server, a status or a contact, so that a server that is starting misses
// nothing of what is sent then. Returns false after `seconds`, or as pliant_wait.
PLIANT_API bool pliant_wait_server(PliantClient *client, double seconds);
// Returns the network of the client as a text for people.
PLIANT_API const char *pliant_network(const PliantClient *client);
// Returns a sentence if the server sends messages of another version, which this client cannot
// read, or counts messages of other hosts that it has refused since this client first heard it,
// which may be this client's; else NULL. The sentence names what to update, or what permits them.
PLIANT_API const char *pliant_refusal(PliantClient *client);
// Binds the client to the server that answers within `seconds`: from now on poses and requests
// reach this server and no other that takes its place. They fail if it is gone.
PLIANT_API bool pliant_bind(PliantClient *client, double seconds);
// Returns false with a sentence if another server has taken its place.
PLIANT_API bool pliant_bound(PliantClient *client);
// False: frames of bodies are not assembled any more, for a client that needs forces alone; true
// (at first): they are.
PLIANT_API bool pliant_hear_bodies(PliantClient *client, bool hear);
// From now on the client sends nothing of its own accord: whole meshes that it lacks, which it asks
// for otherwise, come when the server repeats them.
PLIANT_API void pliant_only_listen(PliantClient *client);
// Returns a descriptor that is readable when pliant_wait(client, 0) has something to do.
PLIANT_API int pliant_file(const PliantClient *client);
// Returns the time on the clock of `received` below, CLOCK_MONOTONIC [s].
PLIANT_API double pliant_now(void);

// --- bodies ---

// One frame of a body: positions, and the mesh that they belong to. It never changes.
typedef struct PliantBody {
    const char *name;
    int64_t count;           // frames of this body that this client has assembled, with this one
    int64_t step;            // ticks completed
    double time;             // simulated [s]
    int64_t utime;           // of the server's CLOCK_REALTIME [us]
    int32_t topology;        // number of the mesh
    int32_t node_count;      // slots, some of which may be free (id -1)
    int32_t triangle_count;  // slots, some of which may be free (0 0 0)
    const float *position;   // [node_count][3] [m]
    const int32_t *triangle; // [triangle_count][3] node slots, counter-clockwise from outside
    const int32_t *id;       // [node_count] stable for the life of a node
    const int32_t *origin;   // [node_count] id that a duplicate was split from, else its own
    const int32_t *parent;   // [node_count][2] ids between which a midpoint lies, else its own
    const int32_t *piece;    // [node_count] connected piece, from 0
    const int8_t *level;     // [node_count] level of detail at which the node was created
    int32_t first_wall;      // triangles from this slot on are walls of cuts; 0: none, or unknown
    int32_t old_nodes;       // nodes that are where an earlier frame had them, since their packets
                             // of this one did not come; of servers that send packets
    // [node_count][3] red, green and blue of sRGB, without light: of the outside, and of walls of
    // cuts there. NULL: the scene names none, or the frame is of a recording. Nodes that a cut has
    // added have those of their neighbours for up to 0.1 s.
    const uint8_t *color, *inside;
} PliantBody;

// Return the number of bodies of which a frame is there, and their names, k from 0.
PLIANT_API int pliant_body_count(const PliantClient *client);
PLIANT_API const char *pliant_body_name(const PliantClient *client, int k);
// Returns the newest frame of a body, or NULL if none is complete. Deltas are applied, lost ones
// are repaired with the next whole mesh, which the client asks for. Positions that are sent as
// packets are a frame when the last one of a step comes and every node was heard once.
PLIANT_API const PliantBody *pliant_body(const PliantClient *client, const char *name);
// Waits for the next frame of a body. Returns NULL after `seconds`, or if the connection breaks.
PLIANT_API const PliantBody *pliant_wait_body(PliantClient *client, const char *name,
                                              double seconds);
// Keeps a frame until it is released as often, beyond the client too; any thread may read and
// release it. Returns `body`.
PLIANT_API const PliantBody *pliant_body_keep(const PliantBody *body);
PLIANT_API void pliant_body_release(const PliantBody *body); // NULL is allowed

// --- tools ---

typedef struct PliantPose {
    int32_t tool;          // id in the scene
    double position[3];    // origin of the tool frame [m]
    double orientation[4]; // unit quaternion w x y z, tool to world; all zero: not rotated
    double linear[3];      // [m/s]
    double angular[3];     // [rad/s]
    bool moving;           // `linear` and `angular` are valid
    double grip;           // 0 open, 1 closed; of graspers only
    bool active;           // false: the tool is withdrawn
} PliantPose;

// Sends the pose of a tool, best a thousand times per second: one that falls silent is withdrawn
// after the scene's tool_timeout_s. Returns false if it is invalid or cannot be sent.
PLIANT_API bool pliant_pose(PliantClient *client, const PliantPose *pose);
// The same, of what a device took as number `sequence` at `utime` [us] of one clock, above 0. It
// may be sent late, twice or behind newer ones: by both, the server refuses what was overtaken.
PLIANT_API bool pliant_pose_as(PliantClient *client, const PliantPose *pose, int32_t sequence,
                               int64_t utime);

// What a tool felt in one tick.
typedef struct PliantContact {
    int32_t tool, sequence; // `sequence` counts the contacts of this tool
    int64_t step;           // ticks completed
    double time;            // simulated [s]
    int64_t utime;          // of the server's CLOCK_REALTIME [us]
    int64_t pose_utime;     // utime of the pose in use; 0 before the first
    double received;        // when it arrived, on the clock of pliant_now [s]
    double valid;       // for how long after `received` the force may be used [s]; 0 or below: no
    bool contact;       // touches or holds; false: all below is zero but `position`
    double position[3]; // tool position that the force belongs to [m]
    double force[3];    // on the tool [N]
    double torque[3];   // on the tool about `position` [N m]
    double point[3];    // mean contact point [m]
    double normal[3];   // unit, out of the body; zero of a tool that only holds
    double depth;       // largest overlap [m]
    double stiffness[3][3]; // d(force)/d(-position) [N/m]; all zero: not estimated
    double damping;         // along the normal [N s/m]; 0: not estimated
} PliantContact;

// Returns the newest contact of a tool, or NULL.
PLIANT_API const PliantContact *pliant_contact(const PliantClient *client, int32_t tool);
// Waits for the next one. Returns NULL after `seconds`, or if the connection breaks.
PLIANT_API const PliantContact *pliant_wait_contact(PliantClient *client, int32_t tool,
                                                    double seconds);

// Return the number of tools of which a contact has come, and the newest contact of one, k from 0.
PLIANT_API int pliant_tool_count(const PliantClient *client);
PLIANT_API const PliantContact *pliant_tool(const PliantClient *client, int k);

// Returns the time from pliant_pose to the newest contact of a tool [s], if that is the first one
// that was computed with this pose; 0: an earlier one was; below 0: the pose in use is another
// client's, or none.
PLIANT_API double pliant_contact_trip(const PliantClient *client, int32_t tool);
// Return the number of these round trips, and the time that a share of them, from 0 (the shortest)
// to 1, does not exceed [s], below 0 if there is none.
PLIANT_API int64_t pliant_round_trips(const PliantClient *client);
PLIANT_API double pliant_round_trip(const PliantClient *client, double share);

// --- haptic loop ---

// The force that a haptic device shows between two contacts: a plane through the last one with the
// stiffness K that the server published,
//   F = F_c - K (x - x_c) - b n n.(v - v_c),
// x_c and F_c of the contact, b its damping, v_c from its last two positions, v behind a low pass
// of 4 ms if it is not given. Along the normal, K is raised to the slope of force over depth that
// the contacts of the last 50 ms have shown, if it is more: a plane softer than the body is late,
// which shakes the hand. K follows the contacts within 20 ms, F_c within 6 ms where it changes by
// more than 2 %. F is zero without contact and after its `valid`, never points into the body, and
// is at most the limit.
//
// A guard keeps the device passive whatever was delayed or lost. It counts the work W of the hand,
// exactly if the device holds F until the next call, and gives back no more than is left:
// - Where K along F is known, |F| is at most that of a spring of 1.5 K that holds what is left, and
//   not below 3 % of the plane's: it fades as the hand leaves, and what the network generates makes
//   a body softer instead of shaking the hand. A hand that comes in is shown more, at 20 mm/s half
//   of the rest.
// - It drops the part of F along where the hand may go until the next call: as its velocity says,
//   over the last period (at most 50 ms), and where it went last along each axis, until it turns.
//   So the steps of an encoder, which most calls do not see, give nothing back either.
// - What comes otherwise, as the first step of a hand that turns, is paid from a credit of 1 mJ:
//   |F| is at most half of what is there of it, with what is left, over the longest way between two
//   of the last calls (which fades by a thousandth per call, to 0.1 mm).
// So W >= -1 mJ at any time, less 1 nJ per call, and less |F| times what a way between two calls is
// longer than twice that longest one: 0.2 mm for a hand that rested. W is that of the positions as
// given: encoders hide up to half a step. Where K is known, what is left is at most F^2 / K, twice
// the energy of a spring. It is forgotten without contact, so that what tissue has dissipated is
// not given back later. The guard also withholds real work of others: a hand feels little of a body
// that moves against it, until it has pushed.
//
// Allocated here; no client needed. One thread at a time.
typedef struct PliantHaptic PliantHaptic;

// `max_force`: of the device [N]. Returns NULL if it is not positive and finite.
PLIANT_API PliantHaptic *pliant_haptic_create(double max_force, bool guard);
PLIANT_API void pliant_haptic_destroy(PliantHaptic *haptic); // NULL is allowed
// Takes a contact; one that it has, that is older or not finite changes nothing. NULL is allowed.
PLIANT_API void pliant_haptic_take(PliantHaptic *haptic, const PliantContact *contact);
// Computes the force on the hand [N] at `now` (of pliant_now) [s], once per tick of the device.
// `velocity` [m/s] may be NULL: from the last two positions. Zero if an argument is not finite.
PLIANT_API void pliant_haptic_force(PliantHaptic *haptic, const double position[3],
                                    const double velocity[3], double now, double force[3]);
// Returns the work of the hand that the guard counts now [J]; below 0: what it owes of the credit.
PLIANT_API double pliant_haptic_energy(const PliantHaptic *haptic);

// --- requests ---

// A request handles messages while it waits for its reply; it is repeated when none comes, and
// executed once. It fails if there is no reply, or if the server refuses it: pliant_error says
// which, and why.

// Repeats a request when no reply comes within `seconds`, at most `tries` times: 0.5 s and 6
// unless this is called, so that a request fails after 3 s. Values that are not above 0 change
// nothing.
PLIANT_API void pliant_patience(PliantClient *client, double seconds, int tries);

typedef struct PliantReply {
    int64_t step;        // ticks completed when it was executed
    int32_t separated;   // links that a cut has severed
    int32_t nodes_added; // nodes that a cut or a split has added
    int32_t pieces;      // of the body, or of all bodies
    const char *text;    // what was done
} PliantReply;

typedef enum PliantCommand {
    PLIANT_PAUSE = 1,
    PLIANT_RESUME = 2,
    PLIANT_STEP = 3, // `value` ticks
    PLIANT_RESET = 4,
    PLIANT_CHECKPOINT = 5,
    PLIANT_DESCRIBE = 6,
    PLIANT_SET = 7, // `argument`: "gravity=0 0 -9.81", "liver.stiffness_scale=2"
    PLIANT_STOP = 8
} PliantCommand;

// Returns the reply to the last request that was answered and not refused, or NULL.
PLIANT_API const PliantReply *pliant_reply(const PliantClient *client);

// Returns NULL on failure. `argument` may be NULL.
PLIANT_API const PliantReply *pliant_command(PliantClient *client, PliantCommand command,
                                             int64_t value, const char *argument);
// Returns the scene as text (bodies, tools, capacities), and makes the server send whole meshes.
// NULL on failure.
PLIANT_API const char *pliant_describe(PliantClient *client);
// Asks for the bodies of the scene: returns their number, and the names of the first `most`; -1 on
// failure.
PLIANT_API int pliant_scene_bodies(PliantClient *client, const char **name, int most);
// Returns false with a sentence that lists the bodies if the scene has none of this name, by the
// newest status or else by asking; true also if the server names none.
PLIANT_API bool pliant_find_body(PliantClient *client, const char *name);
// Cuts along the quadrilateral between a blade's edge before and after, two ends each [m]. `body`
// NULL: all. Returns NULL on failure.
PLIANT_API const PliantReply *pliant_cut(PliantClient *client, const double before[2][3],
                                         const double after[2][3], const char *body);
// Pulls the nodes inside a sphere with a total force [N] for simulated seconds. `body` NULL: all.
PLIANT_API const PliantReply *pliant_load(PliantClient *client, const double center[3],
                                          double radius, const double force[3], double duration,
                                          const char *body);

// The answer to a request that is not waited for.
typedef struct PliantAnswer {
    int32_t request;   // its number
    bool answered;     // false: no reply came
    bool done;         // false: the server refused it, reply.text says why
    int sent;          // how often
    double seconds;    // from the first time to the reply
    PliantReply reply; // if it was answered
} PliantAnswer;

// Begins a cut and returns its number, 0 on failure: it is sent and repeated while messages are
// handled. At most 64 are in progress, or have an answer that was not taken.
PLIANT_API int32_t pliant_cut_begin(PliantClient *client, const double before[2][3],
                                    const double after[2][3], const char *body);
// Returns the number of requests that were begun and lack their answer.
PLIANT_API int pliant_in_progress(const PliantClient *client);
// Takes the oldest answer; NULL: there is none.
PLIANT_API const PliantAnswer *pliant_next_answer(PliantClient *client);

typedef enum PliantTieKind {
    PLIANT_PIN = 1,  // holds nodes where they are, in the world
    PLIANT_TIE = 2,  // to the nearest points of `to_body`
    PLIANT_CLIP = 3, // draws them to the nearest wall that faces them
    PLIANT_CARRY = 4 // to the tool `tool`
} PliantTieKind;

typedef struct PliantTie {
    PliantTieKind kind;
    const char *body;     // whose nodes are tied; NULL: the only one
    const char *to_body;  // of PLIANT_TIE and PLIANT_CLIP; NULL: none
    int32_t tool;         // of PLIANT_CARRY
    double center[3];     // of the sphere whose nodes are tied [m]
    double radius;        // [m]
    const int32_t *node;  // instead: these ids, at most 16; or NULL
    int32_t node_count;   // 0: the sphere
    double stiffness;     // as a share of the body's own, (0, 4]; 0: 0.3
    double damping_ratio; // of the springs, [0, 2]; 0.5 is usual
    double break_force;   // the tie ends when it pulls harder [N]; 0: never
} PliantTie;

// Ties tissue in a scene with max_ties. Returns the number of the tie, 0 on failure.
PLIANT_API int32_t pliant_tie(PliantClient *client, const PliantTie *tie);
// The same under a number of the caller's; 0: the lowest free one.
PLIANT_API int32_t pliant_tie_as(PliantClient *client, int32_t number, const PliantTie *tie);
// Gives a tie other springs: the last three members of `tie`; releases it.
PLIANT_API bool pliant_tie_change(PliantClient *client, int32_t number, const PliantTie *tie);
PLIANT_API bool pliant_tie_release(PliantClient *client, int32_t number);

// --- status and events ---

// One body in a status.
typedef struct PliantBodyStatus {
    const char *name, *model, *integrator; // "surface" or "voxel"; "leapfrog", ...
    int32_t topology;                      // number of its mesh
    int32_t nodes, springs, elements;      // in use; springs of surfaces, whose elements are faces
    int32_t pieces, finest_level;
    double time_step;        // [s]
    double kinetic, elastic; // energy [J]
    double mass;             // [kg]
    double max_displacement; // from the rest shape [m]
    double estimated_error;  // of a tick's time steps, as a share of that; 0: not estimated
} PliantBodyStatus;

typedef struct PliantStatus {
    const char *scene, *state;            // "running", "paused" or "lockstep"
    int64_t step;                         // ticks completed
    double time;                          // simulated [s]
    double rate_hz;                       // of the scene
    double real_time_factor;              // simulated over real time
    int64_t late_ticks, resets, rejected; // skipped, restored, refused since the start
    double received;                      // on the clock of pliant_now [s]
    double step_us[4], wake_us[4]; // time of a step, lateness of its start: p50 p99 p99.9 max [us]
    int32_t stage_count;
    const char *const *stage; // [stage_count] of a tick
    const double *stage_us;   // [stage_count] mean time of each [us]
    int32_t body_count;
    const PliantBodyStatus *body; // [body_count]
    int32_t reason_count;
    const char *const *reason; // [reason_count] why inputs were refused, and the like (status_t)
    const int64_t *times;      // [reason_count] how often since the start
} PliantStatus;

typedef struct PliantEvent {
    int64_t step;            // ticks completed
    const char *body;        // "": no body is concerned
    const char *kind, *text; // "cut", "tear", "refused", ...
} PliantEvent;

// Returns the server's newest status, or NULL.
PLIANT_API const PliantStatus *pliant_status(const PliantClient *client);
// Waits for the next one. Returns NULL after `seconds`, or if the connection breaks.
PLIANT_API const PliantStatus *pliant_wait_status(PliantClient *client, double seconds);
// Takes the oldest event of the last 256 that were not taken; NULL: there is none.
PLIANT_API const PliantEvent *pliant_next_event(PliantClient *client);

// --- the ledger: what became of the tissue ---

// One tissue: a label of a body, or all of it. Amounts at rest: [m3] of solids, [m2] of walls;
// times `density` masses. at_load = attached + cut_off + removed.
typedef struct PliantTissue {
    const char *body, *name;
    double density; // [kg/m3], of walls [kg/m2]
    double at_load;
    double attached;   // in the main piece: that with the most of what is fixed, else the largest
    double cut_off;    // in all other pieces
    double removed;    // taken away
    double coagulated; // of what is present
} PliantTissue;

typedef struct PliantSections {
    const char *body;
    bool solid;       // amounts of its tissues are [m3], else [m2]
    double cut, torn; // areas at rest [m2]
} PliantSections;

// A region of the scene's score.
typedef struct PliantRegion {
    const char *name;
    bool keep, touched;    // it is not to be touched; something inside was cut or removed
    double margin;         // asked for [m]; 0: none
    double distance;       // shortest one to what was cut or removed [m]; -1: nothing was
    double time;           // that tools have spent inside, of each tool [s]
    const char *body, *by; // where that is, and what did it: "cut", "tear", "removal"; ""
} PliantRegion;

typedef struct PliantLedger {
    int64_t step;    // ticks completed when it was drawn up; nothing has changed since
    double time;     // simulated [s]
    double received; // on the clock of pliant_now [s]
    int32_t body_count, tissue_count, region_count;
    const PliantSections *body; // [body_count]
    const PliantTissue *tissue; // [tissue_count] body by body
    const PliantRegion *region; // [region_count] in the order of the scene
} PliantLedger;

// Returns the server's newest ledger, or NULL: only scenes with a body that can be cut have one.
PLIANT_API const PliantLedger *pliant_ledger(const PliantClient *client);
// Waits for the next one. Returns NULL after `seconds`, or if the connection breaks.
PLIANT_API const PliantLedger *pliant_wait_ledger(PliantClient *client, double seconds);

// --- the error: how far the simulation is from the same tissue in infinitely small elements and
// steps ---

// Of one body, as far as it can tell; -1: unknown.
typedef struct PliantErrorOfBody {
    const char *body;
    double space;    // of the discretisation in space: of the outer nodes' displacements, rms [m]
    double steps;    // of the time steps: a delay, mostly, so 0 at rest [m]
    double total;    // the first, and the second where it is known [m]
    double relative; // total over the rms displacement of the outer nodes, or over 1/1000 of the
                     // longest edge if that is more
    int64_t age;     // ticks since the state that `space` is of
} PliantErrorOfBody;

// Of the force of a tool that touches or holds a body.
typedef struct PliantErrorOfTool {
    int32_t tool;
    double force; // what it exerts on each body, summed as magnitudes [N]
    double error; // of that, by the discretisation of the bodies in space [N]; -1: unknown
    double share; // error over force; -1: unknown
} PliantErrorOfTool;

typedef struct PliantErrors {
    int64_t step;    // ticks completed
    double time;     // simulated [s]
    double received; // on the clock of pliant_now [s]
    int32_t body_count, tool_count;
    const PliantErrorOfBody *body; // [body_count] in the order of the scene
    const PliantErrorOfTool *tool; // [tool_count] those in contact
} PliantErrors;

// Returns the server's newest errors, or NULL: only scenes with publish.error_hz have them.
PLIANT_API const PliantErrors *pliant_errors(const PliantClient *client);
// Waits for the next ones. Returns NULL after `seconds`, or if the connection breaks.
PLIANT_API const PliantErrors *pliant_wait_errors(PliantClient *client, double seconds);

// --- servers on a network ---

typedef struct PliantServer {
    char prefix[32];
    char scene[64], state[16]; // as in PliantStatus; "": it publishes no status
    double rate_hz, time;
} PliantServer;

// Listens for `seconds` to a network (NULL: as in PliantOptions) and returns the number of prefixes
// on which servers publish, and the first `most` of them, sorted; -1 on failure. A signal ends it
// early.
PLIANT_API int pliant_servers(const char *url, double seconds, PliantServer *server, int most,
                              PliantError *error);

// --- recordings ----------------------------------------------------------------------------------

// Reads a recording as it was when it was opened: ended, being written, or left by a writer that
// was killed. A child process reads the file, so that a damaged one crashes nothing. Open it before
// the program starts threads, and in one that lives as long. One thread at a time.
typedef struct PliantRecording PliantRecording;

// Returns NULL with a sentence (`error` may be NULL) on failure; without HDF5 in the build, always.
PLIANT_API PliantRecording *pliant_recording_open(const char *path, PliantError *error);
// Frames that are kept stay. NULL is allowed.
PLIANT_API void pliant_recording_close(PliantRecording *recording);
// Returns why the last call failed, "" if none has.
PLIANT_API const char *pliant_recording_error(const PliantRecording *recording);

// Return the bodies of the recording, k from 0, and the number of complete frames of one; -1: there
// is no such body.
PLIANT_API int pliant_recording_body_count(const PliantRecording *recording);
PLIANT_API const char *pliant_recording_body_name(const PliantRecording *recording, int k);
PLIANT_API int64_t pliant_recording_frames(const PliantRecording *recording, const char *body);
// Returns the last frame at or before a simulated time [s]; -1: there is none.
PLIANT_API int64_t pliant_recording_find(const PliantRecording *recording, const char *body,
                                         double time);
// Reads a frame, k from 0: the recorded bits, as a frame that can be kept, else valid until the
// next call. Not recorded are the free slots, utime (0), origin, parent, piece and level (NULL).
// Returns NULL on failure.
PLIANT_API const PliantBody *pliant_recording_frame(PliantRecording *recording, const char *body,
                                                    int64_t k);

// A tool while it was active.
// As the file has it: numbers that are not finite are not known.
typedef struct PliantToolRow {
    double time;           // simulated [s]
    double position[3];    // that acted on the bodies [m]
    double orientation[4]; // unit quaternion w x y z
    double force[3];       // on the tool [N]
} PliantToolRow;

// Returns the number of rows of a tool; -1: it is not in the recording.
PLIANT_API int64_t pliant_recording_tool_rows(const PliantRecording *recording, int32_t tool);
// Reads `count` rows, at most 4096, from row `first` on. Returns false on failure.
PLIANT_API bool pliant_recording_tool(PliantRecording *recording, int32_t tool, int64_t first,
                                      int count, PliantToolRow *row);

// Returns the number of events, and reads one, k from 0; NULL on failure.
PLIANT_API int64_t pliant_recording_events(const PliantRecording *recording);
PLIANT_API const PliantEvent *pliant_recording_event(PliantRecording *recording, int64_t k);

#ifdef __cplusplus
}
#endif

#endif
