// SPDX-License-Identifier: MIT
// The data that the step thread shares with the bus and files threads: latest-value slots, bounded
// rings, two wake-up descriptors and a few flags. All memory is allocated at load time; no thread
// waits for another. The comments of the members name the writer and the reader.
#ifndef PLIANT_RUN_EXCHANGE_H
#define PLIANT_RUN_EXCHANGE_H

#include "base/handover.h"
#include "body/body.h"
#include "body/look.h"
#include "io/checkpoint.h"
#include "io/recording.h"
#include "run/input.h"
#include "scene/build.h"

#include <stdatomic.h>
#include <stddef.h>

// --- copies of meshes ----------------------------------------------------------------------------

// Copies of a mesh that changes during the run. One thread hands them to another, because only the
// step thread may read such a body's own mesh. Plain memory, used for messages and files.

// The slots in use of one BodyMesh, array behind array.
typedef struct MeshCopy {
    int topology, node_count, triangle_count; // node_count 0: nothing copied yet
    int node_capacity, triangle_capacity, first_wall;
    BodyFit fit; // its arrays are behind those of the mesh
    int data[];
} MeshCopy;

// True if other threads need a copy of this body's mesh.
static inline bool mesh_changes(const Body *body)
{
    return body_changes(body);
}

// Returns the largest number of node slots in a frame of this body.
static inline int mesh_most_nodes(const Body *body)
{
    return mesh_changes(body) ? body->mesh.node_capacity : body->mesh.node_count;
}

// Returns the rows that the nodes of a mesh follow from, and the most that there can be.
static inline int mesh_rows(const BodyMesh *mesh)
{
    return mesh->fit.row_count > 0 ? mesh->fit.row_count : mesh->node_count;
}

static inline int mesh_most_rows(const Body *body)
{
    return body->mesh.fit.row_count > 0 ? body->mesh.fit.row_capacity : mesh_most_nodes(body);
}

// Copies the rows (BodyOps.snapshot_rows) of a body of any kind; velocity may be NULL.
static inline void mesh_snapshot(const Body *body, float *position, float *velocity)
{
    if (body->mesh.fit.row_count > 0)
        body->ops->snapshot_rows(body->model, position, velocity);
    else
        body->ops->snapshot(body->model, position, velocity);
}

// Returns the number of live nodes: slots that are not free.
int mesh_live_nodes(const BodyMesh *mesh);

// Returns the bytes of a copy of the largest mesh, a multiple of 8.
size_t mesh_copy_bytes(const BodyMesh *mesh);
// Copies the mesh unless the copy has the same topology already. Allocates nothing. A topology
// number must name one mesh only during a run.
void mesh_copy_follow(MeshCopy *copy, const BodyMesh *mesh);
// Returns a view of the copy, read like the body's own mesh; valid until the copy changes.
BodyMesh mesh_copy_view(const MeshCopy *copy);

// Rest positions of the nodes of a published mesh, and their texture coordinates. The step thread
// hands them to the bus with the mesh, once per topology, in scenes that publish them. Plain
// memory.

typedef struct RestCopy {
    int topology, node_count; // of the mesh; node_count 0: nothing copied yet
    int coagulates;           // 0 or 1: behind the positions is a byte for each node, of
                              // snapshot_coagulated
    float position[];         // [3 node_count], world frame [m]; zero in free slots
} RestCopy;

// True if the body has rest positions.
static inline bool rest_is_known(const Body *body)
{
    return body->ops->snapshot_rest != NULL;
}

// True if nodes of a body may have different colours.
static inline bool look_is_by_node(const Body *body)
{
    return body->look != NULL &&
           (look_varies(body->look) || body->ops->snapshot_coagulated != NULL);
}

// True if they are published, or if the colours of nodes follow from them.
static inline bool rest_is_wanted(const Body *body, bool published)
{
    return rest_is_known(body) && (published || look_is_by_node(body));
}

// Returns the bytes of a copy for the largest mesh, a multiple of 8.
size_t rest_copy_bytes(const Body *body);
// Returns the colours of a node slot.
LookColours rest_colours(const RestCopy *copy, const BodyLook *look, int node);
// Copy the positions of the body, or of another copy, unless they have them already. No allocation.
void rest_copy_follow(RestCopy *copy, const Body *body);
void rest_copy_take(RestCopy *copy, const RestCopy *from);
// Writes the texture coordinates of the node slots [first, end) of a mesh of the body; zero in free
// slots and if the body has none.
void rest_texture(const Body *body, const BodyMesh *mesh, int first, int end, float *uv);

// --- the exchange --------------------------------------------------------------------------------

enum {
    EXCHANGE_REQUESTS = 128, // requests waiting
    EXCHANGE_URGENT = 16,    // urgent ones
    EXCHANGE_ANSWERS = 256,  // at least to all that wait, so that none is ever lost
    EXCHANGE_CONTACTS = 1024,
    EXCHANGE_EVENTS = 256,
    EXCHANGE_APPLIED_LEAST = 4096, // to be logged
    EXCHANGE_APPLIED_MOST = 65536,
    EXCHANGE_CHECKPOINTS = 16, // requests that one checkpoint file answers
    EXCHANGE_FRAMES_LEAST = 8, // to be recorded
    EXCHANGE_FRAMES_MOST = 64,
    EXCHANGE_MESHES = 16,  // of one changing body, to be recorded
    EXCHANGE_LEDGERS = 16, // to be recorded
    EXCHANGE_MAPS = 4,     // of one body and kind, likewise
    ELEMENT_LEVELS = RECORDING_MAP_LEVELS,
    SQUARES_IN_TICK = 2048, // whose elements are written in one tick: about 20 us
    NODES_IN_TICK = 1024,   // whose errors are: about 30 us if elements carry them all
};

typedef enum RunState { RUN_RUNNING, RUN_PAUSED, RUN_LOCKSTEP } RunState;

// Positions (and velocities) of one body after a tick. If the body's mesh changes, a copy of the
// mesh that the positions belong to follows, and the rest positions of its nodes if they are
// published. A frame and its mesh therefore always arrive together, however many frames are
// dropped.
typedef struct Frame {
    int64_t utime; // [us]
    int64_t step;
    double time;     // [s]
    int64_t at_once; // 1: lockstep, all chunks leave before the reply
    int topology;    // of the mesh
    int node_count;  // slots
    int row_count;   // n: of the rows that nodes follow from (BodyMesh.fit), as a rule the nodes
    float value[];   // positions [3 n], then velocities [3 n] if they are published
} Frame;

typedef struct RecordFrame RecordFrame; // run/files_thread.h

typedef struct ContactOut {
    int tool; // index
    int64_t utime, step, pose_utime;
    double time;
    ToolWrench wrench;
} ContactOut;

typedef struct EventOut {
    int64_t step;
    int body; // index or -1
    char kind[16];
    char text[INPUT_WHY_MAX];
} EventOut;

// error_t as the step thread knows it.
typedef struct ErrorOut {
    int64_t step;
    double time; // [s]
    SimToolError tool[ERROR_TOOLS];
    SimError body[]; // [body_count]
} ErrorOut;

// How far a body's map of errors, or its elements, have been written: some in a tick. Step thread
// only.
typedef struct PartPush {
    int64_t changes;       // rounds, or Body.element_changes, when it was begun
    int topology, written; // nodes, or squares
    bool under_way;
} PartPush;

// The error around each node slot of a body's mesh, 0 to 255 of the largest (error_map_t).
typedef struct ErrorMap {
    int64_t step;
    int topology, node_count;
    unsigned char share[];
} ErrorMap;

// The element at each square of a body's surface (elements_t); behind the tags is the level of
// each.
typedef struct ElementsOut {
    int64_t step;
    int topology, square_count, levels;
    int at_level[ELEMENT_LEVELS];
    uint16_t tag[]; // [square_count]
} ElementsOut;

static inline unsigned char *elements_levels(const ElementsOut *out)
{
    return (unsigned char *)(uintptr_t)(out->tag + out->square_count);
}

// The members of body_status_t that change, as the step thread knows them.
typedef struct BodyOut {
    BodyMeasure measure;
    int topology, nodes, springs, elements, pieces, finest_level;
    double time_step, mass; // [s], [kg]
    double estimated_error; // of a tick, divided by the largest displacement; 0: unknown
} BodyOut;

// status_t as the step thread knows it.
typedef struct StatusOut {
    RunState state;
    int64_t step, late_ticks, resets;
    int64_t governor_stage, governor_actions;
    GuardCounts guard;
    double time, real_time_factor;
    double step_us[4], wake_us[4];
    double stage_us[STAGE_COUNT];
    BodyOut body[]; // [body_count]
} StatusOut;

// An input with the tick at whose start it was applied.
typedef struct AppliedInput {
    int64_t step;
    Input input;
    double stopped_s; // not 0: instead of an input, how long the daemon had stood still [s]
} AppliedInput;

typedef struct Exchange {
    // bus -> step
    Slot *pose;          // [tool_count] of Input
    uint32_t *lifts;     // [tool_count] inactive poses so far; used by the bus only
    int32_t (*taken)[2]; // [tool_count] lifts and sender of the newest pose taken; step thread only
    Ring request;        // of Input
    Ring urgent;         // likewise: those that overtake (input_is_urgent)
    atomic_int interrupts; // PAUSEs and STOPs that wait: they end a STEP early
    // step -> bus
    Slot *frame;     // [body_count] of Frame
    size_t *mesh_at; // [body_count] offset of the mesh in such a Frame [bytes]; 0: the mesh never
                     // changes
    size_t *rest_at; // [body_count] offset of its rest positions [bytes]; 0: never change, or
                     // not wanted. NULL: of no body
    Slot status;     // of StatusOut
    Slot ledger;     // of Ledger; no memory without bodies that can be cut
    Slot error;      // of ErrorOut; no memory unless errors are published
    Slot *error_map; // [body_count] of ErrorMap; NULL: maps are not published. No memory: the body
                     // has none
    PartPush *map_push; // [body_count]
    Slot *elements;     // [body_count] of ElementsOut; NULL: not published. No memory: the body
                        // reports none
    PartPush *elements_push; // [body_count]
    Ring contact;            // of ContactOut; no memory without tools
    Ring answer;             // of Answer
    Ring event;              // of EventOut
    atomic_llong lost;       // contacts and events that found their ring full
    atomic_llong beat, step,
        late; // iterations of the step thread, ticks since the start, late ticks
    // step -> files, only with a files thread
    bool logs_inputs, checkpoints;
    Ring applied; // of AppliedInput
    atomic_llong applied_lost;
    WorldImage image;
    atomic_bool image_full;             // set by the step thread, cleared by the files thread
    Answer asked[EXCHANGE_CHECKPOINTS]; // requests that the image answers; owned like the image
    int asked_count;
    // step -> files, only when recording
    bool records;
    Ring recorded;          // of RecordFrame
    Ring recorded_tools;    // of RecordFrame without bodies; only if tools have a rate of their own
    Ring *recorded_mesh;    // [body_count] of MeshCopy; pushed before the first frame of a topology
    int *recorded_topology; // [body_count] handed over last; step thread only
    atomic_llong recorded_lost; // frames dropped because their ring or the disk was full
    // bus -> files, only when recording
    Ring told;        // of EventOut: every event that was published
    Ring told_ledger; // of Ledger, likewise
    Ring told_errors; // of Ledger with lines of errors; no memory unless they are published
    Ring *told_map[RECORDING_MAPS]; // [body_count] of ErrorMap and ElementsOut; NULL, or no memory:
                                    // they are not published
    // files -> bus, only with a files thread that has answers or events to publish
    Ring written;     // of Answer
    Ring files_event; // of EventOut
    // main -> step
    atomic_bool stop;
    atomic_bool checkpoint_wanted;
    atomic_bool step_ended;   // main -> bus: no more beats follow
    char pace[INPUT_WHY_MAX]; // main -> bus: why ticks are late; the bus's while pace_told
    atomic_bool pace_told;
    // wake-ups (eventfd)
    int step_fd, bus_fd, files_fd;
    // constant
    int tool_count, body_count;
    bool velocity;
} Exchange;

typedef struct ExchangeOptions {
    bool velocity;    // frames carry velocities
    bool rest;        // they are published: frames of a mesh that changes also carry them
    bool checkpoints; // space for a checkpoint image
    bool logs_inputs;
    bool records;
    double nodes_hz;         // frames per second to be recorded
    double tools_hz;         // tool samples per second to be recorded; 0: with the nodes
    size_t ledger;           // bytes; 0: the run has none
    bool errors, error_maps; // they are published,
    bool elements;           // and so are these
} ExchangeOptions;

// Allocates everything from the world's arena, which frees it. Load time.
void exchange_create(Exchange *exchange, World *world, const ExchangeOptions *options);
// Hands the state of a body to the bus; step thread, between two ticks. With `at_once` all chunks
// leave before the reply. Returns the positions handed over, of rows, valid until the next call for
// this body.
const float *exchange_push_frame(Exchange *exchange, Sim *sim, int body, bool at_once);
// Hand the errors, and the maps of bodies that have new ones, to the bus, if they are published: of
// maps some nodes in each tick, or all `now`. True if a map is complete.
void exchange_push_error(Exchange *exchange, Sim *sim);
bool exchange_push_error_maps(Exchange *exchange, Sim *sim, bool now);
// Hands the elements of bodies whose elements have changed to the bus, some squares in each tick,
// if they are published: begins if they are `due`. `now`: all squares at once. True if any were
// handed over.
bool exchange_push_elements(Exchange *exchange, Sim *sim, bool due, bool now);
// Returns the mesh copied behind a frame; NULL for a body whose mesh never changes. The step thread
// writes it, the thread that took the frame reads it.
MeshCopy *exchange_frame_mesh(const Exchange *exchange, int body, const Frame *frame);
// Returns the rest positions of that mesh; NULL unless they are wanted.
RestCopy *exchange_frame_rest(const Exchange *exchange, int body, const Frame *frame);
// Opens the wake-up descriptors. Returns false if the system has none left.
bool exchange_open(Exchange *exchange, Status *status);
void exchange_close(Exchange *exchange);
// Write to an eventfd once; read it until it is empty.
void exchange_wake(int fd);
void exchange_clear(int fd);

#endif
