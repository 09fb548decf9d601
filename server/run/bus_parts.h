// What the bus's files share: bus.c (thread and start), bus_in.c (messages in), bus_out.c (frames
// and contacts), bus_mesh.c (meshes), bus_rest.c (rest positions), bus_tell.c (replies, events,
// status), bus_claim.c (whose prefix it is). Bus thread only.
#ifndef PLIANT_RUN_BUS_PARTS_H
#define PLIANT_RUN_BUS_PARTS_H

#include "run/bus.h"
#include "run/mesh_delta.h"
#include "run/pace.h"

#include <lcm/lcm.h>

#include <pthread.h>

enum {
    CHANNEL_MAX = 64, // with its NUL; buffers are longer so that the compiler sees that all fits
    NODES_IN_CHUNK = 4096,     // 49 kB: below one datagram
    TRIANGLES_IN_CHUNK = 2048, // with NODES_IN_MESH_CHUNK 46 kB
    NODES_IN_MESH_CHUNK = 1024,
    NODES_IN_REST_CHUNK = 2048, // 41 kB with texture coordinates
    OWN_STATUSES = 8,
};

// Of a body whose mesh changes, the nodes, the delta and the whole mesh under way are always of one
// topology: that of `mesh`, which is what its listeners were told.
typedef struct BodyStream {
    char nodes_channel[2 * CHANNEL_MAX], velocity_channel[2 * CHANNEL_MAX];
    char mesh_channel[2 * CHANNEL_MAX], delta_channel[2 * CHANNEL_MAX];
    const Frame *frame;            // the newest taken, or NULL
    bool frame_waits;              // for its mesh to be told
    bool whole_wanted;             // as soon as the delta under way has left
    Pace nodes, whole, delta_pace; // of the whole mesh, then of its rest positions
    int mesh_chunks;               // of the first
    int32_t nodes_sequence, mesh_sequence, delta_sequence;
    BodyMesh mesh; // of the body itself when it never changes, else of `copy`
    MeshCopy *copy;
    MeshDelta delta;
    char rest_channel[2 * CHANNEL_MAX];
    RestCopy *rest; // of `mesh`; NULL: not published
} BodyStream;

typedef struct Subscription {
    Bus *bus;
    InputKind kind;
} Subscription;

// What the daemons of one prefix know of each other.
typedef struct BusClaim {
    int64_t daemon, question; // random; question 0: none is open
    int64_t since_ns;         // from when on we have held the prefix and could always answer
    int64_t asked_ns, told_ns;
    bool asked;   // somebody wants a status
    bool yielded; // to another daemon: we publish nothing more
} BusClaim;

struct Bus {
    lcm_t *lcm;
    Sim *sim; // only what is constant in it is read
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
    int outstanding;        // requests handed to the step thread and not answered
    int64_t looked_ns;      // when the thread looked last
    int64_t stale_until_ns; // poses that come before are older than they look
    int64_t refusal_told_ns[REFUSAL_COUNT];
    int64_t foreign_told_ns;

    // out
    BodyStream *body;
    int64_t next_mesh_ns, next_status_ns;
    char reply_channel[2 * CHANNEL_MAX], event_channel[2 * CHANNEL_MAX];
    char contact_channel[2 * CHANNEL_MAX], status_channel[2 * CHANNEL_MAX];
    char claim_channel[2 * CHANNEL_MAX];
    MeshDeltaChunk *delta_chunk; // scratch; NULL when no mesh changes
    float *texture;              // scratch of a chunk; NULL when no body has one to be told
    int32_t *contact_sequence;
    int32_t event_sequence, status_sequence;
    const StatusOut *status;          // the newest taken, or NULL
    int64_t own_status[OWN_STATUSES]; // utimes of the newest statuses that we sent

    BusCounts counts;
};

// bus_in.c
// Each time the bus thread looks: it finds out when it was away.
void bus_look(Bus *bus, int64_t now_ns);
bool bus_subscribe(Bus *bus, Status *status);
// Handles what has arrived; true when there may be more.
bool bus_receive(Bus *bus);

bool bus_subscribe_to(Bus *bus, const char *channel, lcm_msg_handler_t handler, void *user,
                      int queue, Status *status);

// bus_claim.c
// Before the start: false when another daemon holds the prefix.
bool bus_claim(Bus *bus, const char *url, Status *status);
bool bus_subscribe_claims(Bus *bus, Status *status);
// One that was away for too long to answer holds the prefix anew.
void bus_hold_anew(Bus *bus, int64_t away_ns, int64_t now_ns);

// bus_out.c
void bus_create_streams(Bus *bus, Arena *arena);
void bus_send_contacts(Bus *bus);
// Takes new frames, sends the chunks that are due; at_once: all of the newest frame now.
void bus_send_frames(Bus *bus, int64_t now_ns, bool at_once);
// Whole meshes and the last frames again, soon.
void bus_restart_streams(Bus *bus, int64_t now_ns);
// When the next chunk is due [ns], INT64_MAX: nothing is under way.
int64_t bus_next_chunk_ns(const Bus *bus);

// bus_mesh.c
void bus_create_mesh_stream(Bus *bus, int body, Arena *arena);
void bus_send_meshes(Bus *bus, int64_t now_ns);
void bus_restart_meshes(Bus *bus, int64_t now_ns);
// Makes the mesh told that of the newest frame taken, its delta under way; false: not yet, because
// the whole mesh before it has not left. At once: the rest of that leaves now.
bool bus_follow_mesh(Bus *bus, int body, int64_t now_ns, bool at_once);
// Sends the chunks of the delta that are due, or all `now`; true when none is left.
bool bus_send_delta(Bus *bus, int body, int64_t now_ns, bool now);

// bus_rest.c
void bus_create_rest_stream(Bus *bus, int body, Arena *arena);
// Chunks that follow those of a whole mesh; 0: rest positions are not published.
int bus_rest_chunks(const BodyStream *stream);
void bus_send_rest_chunk(Bus *bus, int body, int chunk);

// bus_tell.c
void bus_send_answer(Bus *bus, const Answer *answer);
void bus_send_event(Bus *bus, const EventOut *event);
void bus_send_status(Bus *bus, bool fresh);
// Answers and events that the other threads have left.
void bus_tell(Bus *bus, int64_t now_ns);
// Status when it is new, or long ago, or asked for by a claim.
void bus_tell_status(Bus *bus, int64_t now_ns);

// Counts what publishing returned.
void bus_count_published(Bus *bus, int result);

#endif
