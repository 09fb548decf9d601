// The LCM side of pliant-web: receives all channels of the prefix, learns the scene, requests again
// what was missed, and fills the board. One thread, the one that connected.
#ifndef PLIANT_WEB_FEED_H
#define PLIANT_WEB_FEED_H

#include "bodies.h"
#include "client.h"
#include "requests.h"

typedef struct Feed {
    Client *client;
    Board *board;
    Requests *requests;
    Bodies bodies;
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

bool feed_start(Feed *feed, Client *client, Board *board, Requests *requests, ClientError *error);
// Handles messages until a signal arrives or the connection breaks.
void feed_run(Feed *feed);
void feed_stop(Feed *feed);

#endif
