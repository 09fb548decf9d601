// SPDX-License-Identifier: MIT
// Shared by the bus's files: bus.c (thread and start), bus_in.c (messages in), bus_out.c (frames,
// contacts, replies, events, status), bus_points.c (positions in packets), bus_ledger.c (the
// ledger), bus_error.c (errors), bus_look.c (colours), bus_elements.c (elements), bus_mesh.c
// (meshes and rest positions), bus_claim.c (ownership of the prefix). Bus thread only.
#ifndef PLIANT_RUN_BUS_PARTS_H
#define PLIANT_RUN_BUS_PARTS_H

#include "run/bus.h"
#include "run/ledger.h"

#include "pliant_error_body_t.h"
#include "pliant_mesh_delta_t.h"

#include "receiver.h"
#include "sending.h"

#include <pthread.h>

// All that the server publishes: X(channel, type, of), one channel for the whole server, for each
// BODY or for each TOOL. Its name is the prefix, "_" and `channel`; of a body, "_" and the body's
// name. bus_publish(OUT_<channel>) sends one.
#define OUT_LIST(X)                                                                                \
    X(REPLY, reply_t, SERVER)                                                                      \
    X(EVENT, event_t, SERVER)                                                                      \
    X(HELLO, hello_t, SERVER)                                                                      \
    X(STATUS, status_t, SERVER)                                                                    \
    X(CLAIM, claim_t, SERVER)                                                                      \
    X(LEDGER, ledger_t, SERVER)                                                                    \
    X(ERROR, error_t, SERVER)                                                                      \
    X(CONTACT, contact_t, TOOL)                                                                    \
    X(NODES, nodes_t, BODY)                                                                        \
    X(VELOCITY, nodes_t, BODY)                                                                     \
    X(POINTS, points_t, BODY)                                                                      \
    X(MESH, mesh_t, BODY)                                                                          \
    X(MESH_DELTA, mesh_delta_t, BODY)                                                              \
    X(REST, rest_t, BODY)                                                                          \
    X(WALLS, walls_t, BODY)                                                                        \
    X(LOOK, look_t, BODY)                                                                          \
    X(ERROR_MAP, error_map_t, BODY)                                                                \
    X(ELEMENTS, elements_t, BODY)

#define OUT_KIND(channel, type, of) OUT_##channel,
typedef enum Out { OUT_LIST(OUT_KIND) OUT_KINDS } Out;

// With its NUL; buffers are longer so that the compiler sees that all fits.
enum { CHANNEL_MAX = 64 };

typedef struct OutChannel {
    char name[2 * CHANNEL_MAX];
    uint32_t sequence; // of the last message; on the wire as int32, so it wraps
} OutChannel;

// Pacing of data that is too large for one datagram: the chunks and when each is due. They are
// spread over a period, because a receiver's kernel buffer holds a few chunks, not a burst
// (README.md, "Loss and pacing").

typedef struct Pace {
    int next, count; // next == count: nothing is under way
    int64_t start_ns, interval_ns;
} Pace;

// Evenly over a period of 1/hz, or 10 ms a chunk, whichever is faster.
static inline void pace_start(Pace *pace, int count, double hz, int64_t now_ns)
{
    int64_t interval = 10000000;
    if (hz > 0.0 && 1e9 / hz / count < (double)interval)
        interval = (int64_t)(1e9 / hz / count);
    *pace = (Pace){.count = count, .start_ns = now_ns, .interval_ns = interval};
}

static inline bool pace_is_under_way(const Pace *pace)
{
    return pace->next < pace->count;
}

// INT64_MAX: nothing is under way.
static inline int64_t pace_next_ns(const Pace *pace)
{
    return pace_is_under_way(pace) ? pace->start_ns + pace->next * pace->interval_ns : INT64_MAX;
}

// When the last chunk is due; `now_ns` when nothing is under way.
static inline int64_t pace_end_ns(const Pace *pace, int64_t now_ns)
{
    return pace_is_under_way(pace) ? pace->start_ns + (pace->count - 1) * pace->interval_ns
                                   : now_ns;
}

static inline bool pace_is_due(const Pace *pace, int64_t now_ns)
{
    return pace_is_under_way(pace) && now_ns >= pace_next_ns(pace);
}

// The differences between two published meshes of one body, slot by slot, and their messages
// (mesh_delta_t). Pure functions without thread, clock or socket.

enum {
    DELTA_NODES_IN_CHUNK = 1024, // with DELTA_TRIANGLES_IN_CHUNK 50 kB: below one datagram
    DELTA_TRIANGLES_IN_CHUNK = 1536,
};

typedef struct MeshDelta {
    int from_topology;
    int node_count, triangle_count; // slots that changed
    int *node, *triangle;           // [capacity] those slots, ascending; owned by the caller
} MeshDelta;

// The memory of one chunk's message.
typedef struct MeshDeltaChunk {
    int32_t triangle_slot[DELTA_TRIANGLES_IN_CHUNK], node_slot[DELTA_NODES_IN_CHUNK];
#define DELTA_COLUMN(name, type, width, of, empty, sent, ...)                                      \
    MESH_IF_SENT(sent, type name[(width)*DELTA_##of##S_IN_CHUNK];)
    MESH_COLUMNS(DELTA_COLUMN)
} MeshDeltaChunk;

// Lists the slots of `after` that differ from `before`, and those beyond its counts. Two free slots
// are equal whatever else they contain.
void mesh_delta_find(MeshDelta *delta, const BodyMesh *before, const BodyMesh *after);
// Returns the number of chunks: at least one, even if only the topology number changed.
int mesh_delta_chunks(const MeshDelta *delta);
// Returns chunk `chunk` as a message without utime and sequence. `after` as in mesh_delta_find; the
// arrays of the message are those of `memory`.
pliant_mesh_delta_t mesh_delta_chunk(const MeshDelta *delta, const BodyMesh *after, int chunk,
                                     MeshDeltaChunk *memory);

// --- the bus -------------------------------------------------------------------------------------

enum {
    NODES_IN_REST_CHUNK = 2048, // 41 kB with texture coordinates
    OWN_STATUSES = 64,          // most that may be in transit at a time; a power of two
    BUS_AGAIN_NS = 100000000,   // pause before something that any client may request is sent again
};

// Streams of one body. If its mesh changes, the nodes, the delta and the whole mesh being sent
// always have one topology: that of `mesh`, the one last published.
typedef struct BodyStream {
    const Frame *frame;            // the newest taken, or NULL
    bool frame_waits;              // until its mesh is published
    bool whole_wanted;             // when the data being sent has left, and
    int64_t whole_next_ns;         // not before this
    bool frame_wanted;             // again, unless a newer one comes, and
    int64_t frame_next_ns;         // not before this
    Pace nodes, whole, delta_pace; // of the look, the whole mesh, then its rest positions
    Pace look;                     // of a look without a whole mesh
    bool look_wanted;              // since the mesh has changed, but
    int64_t look_next_ns;          // not before this
    int look_chunks, mesh_chunks;  // of a whole mesh: chunks of the look and of the mesh itself
    BodyMesh mesh;                 // of the body itself when it never changes, else of `copy`
    MeshCopy *copy;
    MeshDelta delta;
    float *node; // of a fitted mesh: what is sent in place of the frame's rows; else NULL
    double *scratch;
    RestCopy *rest;      // of `mesh`; NULL: neither published nor needed for its colours
    const ErrorMap *map; // the newest taken, or NULL
    Pace map_pace;
    bool map_wanted;             // again, for a client that asks
    const ElementsOut *elements; // as the map
    Pace elements_pace;
    bool elements_wanted;
} BodyStream;

typedef struct LookChunk LookChunk;

typedef struct Subscription {
    Bus *bus;
    InputKind kind;
} Subscription;

// State of the protocol by which the daemons of one prefix find each other.
typedef struct BusClaim {
    int64_t daemon, question; // random; question 0: none is open
    int64_t since_ns;         // we have held the prefix, always able to answer, since
    int64_t asked_ns, reported_ns;
    bool asked;   // a client has requested a status
    bool yielded; // to another daemon: we publish nothing more
} BusClaim;

struct Bus {
    lcm_t *lcm;         // publishes
    Receiver *receiver; // receives all messages
    Sim *sim;           // only its constant members are read
    const Scene *scene;
    Exchange *exchange;
    const char *describe;
    Service *service;
    pthread_t thread;
    atomic_bool finish;
    BusClaim claim;

    // in
    Gate gate;
    Subscription subscription[INPUT_KINDS];
    int outstanding[2];     // requests, and urgent ones, handed to the step thread and not answered
    int64_t arrived;        // requests handed over
    int64_t looked_ns;      // last iteration of the thread
    int64_t stale_until_ns; // poses that arrive before this time may be older than they seem
    int64_t born_ns;        // start of the thread: earlier requests were not for us
    int64_t refusal_reported_ns[REFUSAL_COUNT];
    int64_t foreign_reported_ns;

    // out
    BodyStream *body;
    pliant_body_status_t *body_status; // scratch
    int64_t next_mesh_ns, next_status_ns, status_reported_ns;
    int64_t fresh_ns, fresh_ticks;   // of the last status that was not a repeat
    OutChannel *channel[OUT_KINDS];  // [1, bodies or tools]
    MeshDeltaChunk *delta_chunk;     // scratch; NULL when no mesh changes
    LookChunk *look_chunk;           // scratch; NULL: no body has nodes of different colours
    float *texture;                  // scratch of a chunk; NULL if no body has texture to publish
    const StatusOut *status;         // the newest taken, or NULL
    const Ledger *ledger;            // likewise
    bool ledger_wanted;              // again, for a client that asks
    int64_t ledger_ns;               // when it was sent last
    const ErrorOut *error;           // likewise
    pliant_error_body_t *body_error; // scratch; NULL: errors are not published
    bool error_wanted;               // as of the ledger
    int64_t error_ns;
    int64_t own_status[OWN_STATUSES]; // utimes of our newest statuses

    BusCounts counts;
};

// bus_in.c
// Notes each iteration of the bus thread and detects that the thread did not run for long.
void bus_look(Bus *bus, int64_t now_ns);
// Counts a refusal, and publishes an event at most once per second for each reason.
void bus_refuse(Bus *bus, Refusal refusal, const char *why);
// Joins the network.
bool bus_listen(Bus *bus, const Network *network, Status *status);
bool bus_subscribe(Bus *bus, Status *status);
// Handles the messages that have arrived; returns true if more may be waiting.
bool bus_receive(Bus *bus);

bool bus_subscribe_to(Bus *bus, const char *channel, lcm_msg_handler_t handler, void *user,
                      int queue, Status *status);

// bus_claim.c
// Claims the prefix before the start; returns false if another daemon holds it.
bool bus_claim(Bus *bus, const char *url, Status *status);
bool bus_subscribe_claims(Bus *bus, Status *status);
// Restarts the hold on the prefix after a time in which this daemon could not answer.
void bus_hold_again(Bus *bus, int64_t away_ns, int64_t now_ns);

// bus_out.c: frames and contacts
void bus_create_streams(Bus *bus, Arena *arena);
void bus_send_contacts(Bus *bus);
// Takes new frames and sends the chunks that are due; at_once: all of the newest frame now.
void bus_send_frames(Bus *bus, int64_t now_ns, bool at_once);
// Sends whole meshes and the last frames again, after those being sent have left.
void bus_restart_streams(Bus *bus);
// Returns when the next chunk is due [ns]; INT64_MAX: nothing is being sent.
int64_t bus_next_chunk_ns(const Bus *bus);

// bus_mesh.c
void bus_create_mesh_stream(Bus *bus, int body, Arena *arena);
void bus_send_meshes(Bus *bus, int64_t now_ns);
void bus_restart_meshes(Bus *bus);
// Makes the mesh of the newest frame the published one and starts its delta. Returns false if the
// previous whole mesh has not left yet. With at_once the rest of that leaves now.
bool bus_follow_mesh(Bus *bus, int body, int64_t now_ns, bool at_once);
// Sends the chunks of the delta that are due, or all if `now`; returns true when none is left.
bool bus_send_delta(Bus *bus, int body, int64_t now_ns, bool now);
void bus_create_rest_stream(Bus *bus, int body, Arena *arena);
// Returns the number of chunks that follow a whole mesh; 0: rest positions are not published.
int bus_rest_chunks(const Bus *bus, int index);
void bus_send_rest_chunk(Bus *bus, int index, int chunk);

// bus_look.c
void bus_create_look_stream(Bus *bus, int index, Arena *arena);
// Returns the number of chunks of a look; 0: the scene names none.
int bus_look_chunks(const Bus *bus, int index);
// Begins another look; the chunks are sent one by one.
void bus_start_look(Bus *bus, int index);
void bus_send_look_chunk(Bus *bus, int index, int chunk);
// Notes that the mesh has changed: its look follows soon.
void bus_renew_look(Bus *bus, int index);
void bus_send_looks(Bus *bus, int64_t now_ns);
// Returns when the next chunk of a look is due that no whole mesh brings.
int64_t bus_next_look_ns(const BodyStream *stream);

// bus_out.c: replies, events and status
void bus_send_answer(Bus *bus, const Answer *answer);
void bus_send_event(Bus *bus, const EventOut *event);
void bus_send_status(Bus *bus, bool fresh);
// Publishes the answers and events that the other threads have left.
void bus_report(Bus *bus, int64_t now_ns);
// Publishes the status if it is new, if the last one is old, or if a claim requests it.
void bus_report_status(Bus *bus, int64_t now_ns);

// bus_ledger.c. Publishes the ledger if it is new, if a client asked, or once a second.
void bus_report_ledger(Bus *bus, int64_t now_ns);

// bus_error.c. Publishes errors that are new, or that a client asked for.
void bus_create_errors(Bus *bus, Arena *arena);
void bus_send_errors(Bus *bus, int64_t now_ns);
void bus_restart_errors(Bus *bus);

// bus_elements.c. Hands a map that is new to a recording, if there is one.
void bus_record_map(Bus *bus, RecordingMapKind kind, int body, const void *map, size_t bytes);
// Publishes elements that have changed, or that a client asked for.
void bus_send_elements(Bus *bus, int64_t now_ns);
void bus_restart_elements(Bus *bus);

// bus.c
// Publishes a message of the kind's type on the channel of a body or tool, else 0, and counts it.
void bus_publish(Bus *bus, Out kind, int index, const void *message);

#endif
