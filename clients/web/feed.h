// SPDX-License-Identifier: MIT
// The LCM side of pliant-web: receives all channels of the prefix, learns the scene, requests again
// what was missed, assembles the bodies, and fills the board. One thread, the one that connected.
#ifndef PLIANT_WEB_FEED_H
#define PLIANT_WEB_FEED_H

#include "board.h"
#include "client.h"
#include "pliant_status_t.h"
#include "requests.h"
#include "workbench.h"

// --- bodies --------------------------------------------------------------------------------------

// The bodies of the scene as they arrive over LCM: assembles their meshes, nodes and rest
// positions, and puts consistent sets on the board. The LCM thread only.

enum { BODY_NAME_MAX = 64 };

typedef struct Body {
    char name[BODY_NAME_MAX];
    MeshFrame mesh;
    NodesFrame nodes;
    RestFrame rest;
    LookFrame look;
    bool new_look;
    ErrorMapFrame error_map;
    ElementsFrame elements;
    int32_t first_wall; // triangles from this slot on are walls of cuts; 0: none, or unknown
    bool new_mesh, new_nodes, new_rest; // since the last update of the board
    int32_t shown;                      // topology on the board; -1: none
    int64_t chunk_ns;                   // arrival of the last chunk of a mesh (CLOCK_MONOTONIC)
    int64_t unmatched_ns; // since when nodes lack a mesh (CLOCK_MONOTONIC); 0: they have it
} Body;

typedef struct Bodies {
    Board *board;
    Body *body; // [BOARD_BODIES]
    int count;
    bool open; // pages have this scene: bodies may go on the board
} Bodies;

void bodies_init(Bodies *bodies, Board *board);
void bodies_destroy(Bodies *bodies);

// True if these are the bodies of a status, in its order.
bool bodies_are(const Bodies *bodies, const pliant_status_t *status);
// Forgets all and takes the names of a status; nothing is shown until bodies_open.
void bodies_name(Bodies *bodies, const pliant_status_t *status);
void bodies_open(Bodies *bodies);

// Take raw messages of the body of that name; drop others.
void bodies_take_mesh(Bodies *bodies, const char *name, const void *data, size_t size);
void bodies_take_delta(Bodies *bodies, const char *name, const void *data, size_t size);
void bodies_take_nodes(Bodies *bodies, const char *name, const void *data, size_t size);
void bodies_take_walls(Bodies *bodies, const char *name, const void *data, size_t size);
void bodies_take_look(Bodies *bodies, const char *name, const void *data, size_t size);
void bodies_take_error_map(Bodies *bodies, const char *name, const void *data, size_t size);
void bodies_take_elements(Bodies *bodies, const char *name, const void *data, size_t size);
void bodies_take_rest(Bodies *bodies, const char *name, const void *data, size_t size);

// Returns for how long nodes of a body have arrived without their mesh, while none is being
// received [s]; 0: none.
double bodies_unmatched(const Bodies *bodies, int64_t now_ns);

// --- the feed ------------------------------------------------------------------------------------

enum { FEED_STREAMS = 9 };

typedef struct FeedStream {
    struct Feed *feed;
    int kind; // of what comes of bodies
} FeedStream;

typedef struct Feed {
    Client *client;
    Board *board;
    Requests *requests;
    Workbench *workbench; // NULL: none
    Bodies bodies;
    FeedStream stream[FEED_STREAMS];
    // the newest status
    pliant_status_t *status; // NULL: none yet
    int64_t status_ns;       // when it came (CLOCK_MONOTONIC)
    int64_t daemon;          // the daemon's number at the last iteration; 0: unknown
    bool linked;             // pages know that a daemon is there
    int64_t link_ns;         // when they were last informed of it
    // the scene
    bool known;          // the scene's text is on the board and is that of the newest status
    bool another;        // a new daemon: pages get its scene even if the text is the same
    int32_t describe_id; // of the open request; 0: none
    int64_t describe_ns; // when it was last sent
    double patience_s;   // before it is sent again
    int64_t wrong_types; // messages of another type than their channel's
} Feed;

bool feed_start(Feed *feed, Client *client, Board *board, Requests *requests, PliantError *error);
// Handles messages until a signal arrives or the connection breaks.
void feed_run(Feed *feed);
void feed_stop(Feed *feed);

#endif
