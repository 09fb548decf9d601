// Identifies the daemon that serves: a request is for the daemon that runs when it is made, and is
// dropped with it. The daemon's number comes with its answers to questions on _CLAIM. A restarted
// daemon draws another number, and listens only after a quarter of a second without an answer. What
// is sent while an answer is younger than that can therefore reach no other daemon. One thread, the
// one that connected.
#ifndef PLIANT_CLIENTS_SESSION_H
#define PLIANT_CLIENTS_SESSION_H

#include "client.h"

// Error text of a request whose daemon is gone.
#define SESSION_GONE "the daemon that this was sent to is gone"

typedef struct Session {
    Client *client;
    bool *change;               // set by each answer; may be NULL
    int64_t daemon;             // that answered last; 0: none
    int64_t question, asked_ns; // open question; 0: none
    int64_t sure_until_ns;      // no other daemon listens before this time
} Session;

// Subscribes to claims, handled inside client_wait. Returns false if LCM refuses.
bool session_open(Session *session, Client *client, bool *change);
// Publishes a question, unless one is open or the answer stays valid for a while.
void session_ask(Session *session);
bool session_is_sure(const Session *session, int64_t now_ns);

#endif
