// SPDX-License-Identifier: MIT
// Shared by the files of libpliant-client.
#ifndef PLIANT_CLIENTS_KIT_H
#define PLIANT_CLIENTS_KIT_H

#include "pliant/client.h"

#include "client.h"
#include "frames_parts.h"
#include "round_trip.h"

#include "pliant_cut_t.h"
#include "pliant_event_t.h"
#include "pliant_error_t.h"
#include "pliant_ledger_t.h"
#include "pliant_status_t.h"

#include <stdatomic.h>

enum {
    KIT_BODIES = 64, // more are ignored, as are more tools
    KIT_TOOLS = 64,
    KIT_EVENTS = 256,
    KIT_BODY_CHANNELS = 5,
    KIT_PENDING = 64, // the server queues 128
};

// A mesh that frames share: as in PliantBody.
typedef struct KitMesh {
    atomic_int uses;
    int32_t topology;
    int node_count, triangle_count;
    MESH_COLUMNS(MESH_NUMBERS)
    unsigned char *color, *inside; // NULL: no look has come
} KitMesh;

typedef struct KitBody {
    char name[CLIENT_CHANNEL_MAX];
    NodesFrame nodes;
    MeshFrame mesh;
    LookFrame look;
    KitMesh *shared;          // copy of `mesh`, NULL until a frame needs it
    bool renewed;             // `mesh` may be another one since
    const PliantBody *newest; // one use is ours; NULL: none
    int64_t count;
    bool waiting; // complete positions were not handed out: they wait for their mesh
    int32_t first_wall;
} KitBody;

typedef struct KitTool {
    PliantContact contact; // the newest one
    int64_t count;         // received; 0: only waited for
    double trip;           // of the newest one, as pliant_contact_trip
} KitTool;

// A cut that was begun.
typedef struct KitPending {
    bool used, waits; // `waits`: to be sent as soon as that is possible
    pliant_cut_t cut;
    char body[CLIENT_CHANNEL_MAX];
    int sent, tries;
    int64_t first_ns, again_ns; // when it was first sent; when it is repeated
} KitPending;

typedef struct KitAnswer {
    PliantAnswer answer;
    pliant_reply_t *reply; // that `answer` points into; NULL: none
} KitAnswer;

struct PliantClient {
    Client client;
    char input_prefix[CLIENT_PREFIX_MAX];
    PliantError error;
    int64_t news;    // messages that have changed what a caller sees
    int64_t servers; // contacts and statuses, whatever they say
    // bodies
    ReceiverSubscription *hears[KIT_BODY_CHANNELS]; // all NULL: frames are not assembled
    KitBody *body[KIT_BODIES];
    int bodies;
    bool wants_mesh; // DESCRIBE would bring it
    bool only_listens;
    int64_t asked_ns, mesh_ns; // last DESCRIBE, last chunk of a whole mesh
    // tools
    KitTool tool[KIT_TOOLS];
    int tools;
    int32_t driven[KIT_TOOLS]; // ids of active tools
    int drives;
    uint32_t pose_sequence;
    int64_t pose_utime; // of the last pose: each has its own, by which contacts name it
    RoundTrips trips;
    // status and events
    pliant_status_t *status_message; // NULL: none
    PliantStatus status;
    PliantBodyStatus *body_status; // [status.body_count]
    int64_t statuses;
    pliant_ledger_t *ledger_message; // NULL: none
    PliantLedger ledger;
    int64_t ledgers;
    pliant_error_t *errors_message; // NULL: none
    PliantErrors errors;
    int64_t error_count;
    pliant_event_t *event[KIT_EVENTS]; // a ring
    unsigned event_first, event_end;
    pliant_event_t *taken; // behind the event that was handed out
    PliantEvent event_taken;
    // requests
    PliantReply reply;
    double try_s; // without a reply until a request is repeated
    int tries;
    KitPending pending[KIT_PENDING];
    KitAnswer answer[KIT_PENDING]; // a ring
    unsigned answer_first, answer_end;
    KitAnswer answer_taken;
    int in_progress;
    bool hears_replies;
    // servers
    Session session;
    int64_t bound;                  // the daemon that all is for; 0: any
    int64_t refused_first, refused; // messages of other hosts, by its statuses
    char refusal[512];
    char described[4096]; // names of bodies, each with its end
};

// Returns a copy of `bytes` bytes; aborts if there is no memory.
void *kit_copy(const void *from, size_t bytes);
// Makes a mesh with one use, the caller's; it takes the arrays over, those that are not known NULL.
KitMesh *kit_mesh_create(const KitMesh *mesh);
void kit_mesh_release(KitMesh *mesh); // NULL is allowed
// Makes a frame with one use, the caller's: takes `position` over, uses the mesh, and completes
// what follows from it.
const PliantBody *kit_frame_create(const PliantBody *body, KitMesh *mesh);

// Take a message, if it is one. For tests: a zeroed client without connection will do.
void kit_take_contact(PliantClient *kit, const void *data, size_t size);
void kit_take_status(PliantClient *kit, const void *data, size_t size);
void kit_take_event(PliantClient *kit, const void *data, size_t size);
void kit_take_ledger(PliantClient *kit, const void *data, size_t size);
void kit_take_errors(PliantClient *kit, const void *data, size_t size);
// Frees what they have kept.
void kit_forget(PliantClient *kit);
void kit_forget_ledger(PliantClient *kit);
void kit_forget_errors(PliantClient *kit);

void kit_bodies_destroy(PliantClient *kit);
// Handles messages until `deadline_ns`, a signal, or `*count` (may be NULL) differs from `before`.
// Returns false with a sentence if it was stopped or the connection is broken.
bool kit_wait(PliantClient *kit, int64_t deadline_ns, const int64_t *count, int64_t before);
// Sends what is due of the requests that were begun; returns the time of the next call [ns].
int64_t kit_pending_turn(PliantClient *kit, int64_t now_ns);
void kit_pending_destroy(PliantClient *kit);
// True if a message sent now reaches the server that this is for, if it is bound, and no other.
bool kit_may_send(PliantClient *kit);
// Waits until the count of `what` grows; returns false with a sentence otherwise.
bool kit_wait_for(PliantClient *kit, const char *what, double seconds, const int64_t *count);
// Waits for the next message on the prefix's channel of this name, of which there were `*count`.
// `or_else`: why there may be none on a network with a server.
bool kit_wait_published(PliantClient *kit, const char *type, double seconds, const int64_t *count,
                        const char *or_else);
// Returns the deadline `seconds` from now [ns]; a number that is none, or below 0, is now.
int64_t kit_deadline(double seconds);
void kit_input_channel(const PliantClient *kit, const char *name, char channel[CLIENT_CHANNEL_MAX]);

#endif
