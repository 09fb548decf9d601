// The LCM side of pliant-web: takes in all channels of the prefix, learns the scene, asks again for
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
    bool linked;             // pages were told that a daemon is there
    int64_t link_ns;         // when they were last told anything of it
    // the scene
    bool known;   // its text is on the board and describes the daemon that sent the newest status
    bool another; // a new daemon: pages hear of its scene even if it reads the same
    int32_t describe_id; // of the request under way; 0: none
    int64_t describe_ns; // when it was last sent
    double patience_s;   // before it is sent again
    int64_t wrong_types; // messages that are not what their channel says
} Feed;

bool feed_start(Feed *feed, Client *client, Board *board, Requests *requests, ClientError *error);
// Handles messages until a signal comes or the connection breaks.
void feed_run(Feed *feed);
void feed_stop(Feed *feed);

#endif
