// What pages ask of the daemon on LCM. Requests that are not answered are sent again with their
// number, so that the daemon executes them once; those that never are, are told of. One small lock
// of its own, never held together with the board's, nor over LCM.
#ifndef PLIANT_WEB_REQUESTS_H
#define PLIANT_WEB_REQUESTS_H

#include "ask.h"
#include "board.h"

enum { REQUESTS_MAX = 64, REQUEST_TRIES = 8 };

typedef struct Request {
    bool used;
    int32_t sender;
    Ask ask;
    int tries;        // made
    int64_t again_ns; // when it is sent again
} Request;

typedef struct Requests {
    Client *client;                 // publishing only
    char prefix[CLIENT_PREFIX_MAX]; // of the channels that the daemon listens to
    pthread_mutex_t lock;
    Request request[REQUESTS_MAX];
} Requests;

// `prefix`: NULL for the client's own.
void requests_init(Requests *requests, Client *client, const char *prefix);
void requests_destroy(Requests *requests);

// "<PREFIX>_<name>" of a channel that the daemon listens to.
void requests_channel(const Requests *requests, const char *name, char channel[CLIENT_CHANNEL_MAX]);
// Publishes a cut, load or command at once. Any thread. False: too many wait for an answer.
bool requests_send(Requests *requests, int32_t sender, const Ask *ask);
// An answer has come. The LCM thread.
void requests_answered(Requests *requests, int32_t sender, int32_t id);
// Nobody waits for these answers any more. Any thread.
void requests_forget(Requests *requests, int32_t sender);
// Sends again what is due; pages hear of what is given up. The LCM thread, every few ms.
void requests_repeat(Requests *requests, Board *board, int64_t now_ns);

#endif
