// SPDX-License-Identifier: MIT
// Requests of pages: read from their JSON, and sent to the daemon.
#ifndef PLIANT_WEB_REQUESTS_H
#define PLIANT_WEB_REQUESTS_H

#include "board.h"
#include "client.h"

#include "base/arguments.h"

// --- as a page sends them ------------------------------------------------------------------------

// Requests of a page: JSON text to plain numbers, all of them validated. Pure functions, any
// thread.

enum {
    ASK_BYTES_MAX = 16384, // of one message of a page
    ASK_TEXT_MAX = 112,    // of a body's name and of an argument, with the terminating zero
};

typedef enum AskKind {
    ASK_DRAWN,
    ASK_TOOL,
    // for the daemon
    ASK_CUT,
    ASK_LOAD,
    ASK_TIE,
    ASK_COMMAND,
    // for the workbench
    ASK_START,
    ASK_END,
    ASK_RECORD,
    ASK_PROPOSE,
} AskKind;

// Where a file of the workbench is.
typedef enum AskFolder { ASK_SCENES, ASK_UPLOADS, ASK_RECORDINGS } AskFolder;

typedef struct Ask {
    AskKind kind;
    int32_t id;              // the page's own number, but of `drawn` and `tool`
    char text[ASK_TEXT_MAX]; // cut, load, tie: the body, "" = all; command: the argument; start,
                             // propose: the file's name
    union {
        int64_t round; // of `drawn`
        struct {
            int32_t tool;
            double position[3];    // [m]
            double orientation[4]; // w x y z, unit
            double grip;           // [0, 1]
            double time;           // by the page's clock [s]; negative: not given
            bool active;
        } pose;
        struct {
            double before[2][3], after[2][3]; // [m]
        } cut;
        struct {
            double center[3], radius, force[3], duration; // [m], [m], [N], [s]
        } load;
        struct {
            int32_t action, kind, number, tool; // as in tie_t
            double center[3], radius;           // [m]
            double stiffness, damping_ratio, break_force;
            char to_body[ARGUMENT_NAME_MOST + 1];
        } tie;
        struct {
            int32_t kind; // PLIANT_COMMAND_T_...
            int64_t value;
        } command;
        AskFolder folder; // of `start`
        bool record;      // of `record`: begin, else end
        struct {
            const char *units, *model, *cuttable; // constant; NULL: to be guessed
            int32_t label, layer;                 // of a volume; 0: the largest, any
            bool together;                        // all labels of a volume, as one body
            bool even; // of an even mesh of its outer surface, which is made first
        } propose;
    };
} Ask;

// Parses a message. Returns false if it is none, or if a number is outside its range; `error` says
// which.
bool ask_parse(const char *text, size_t size, Ask *ask, PliantError *error);

// --- to the daemon -------------------------------------------------------------------------------

// Requests of pages to the daemon over LCM. A request without answer is repeated with the same
// number, so that the daemon executes it once; if it is never answered, the page is informed. A
// request is for the daemon that the pages see when it is made: it is dropped with that one, and
// sent only while no other can listen. A small lock of its own, never taken together with the
// board's, nor during LCM calls.

enum { REQUESTS_MAX = 64, REQUEST_TRIES = 8 };

typedef struct Request {
    bool used;
    int32_t sender;
    Ask ask;
    int tries;        // attempts so far
    bool waits;       // to be sent as soon as its daemon is known to be there
    int64_t utime;    // creation time, kept by repeats
    int64_t daemon;   // the daemon that it is for; 0: none was known
    int64_t again_ns; // when it is repeated
} Request;

typedef struct Requests {
    Client *client;                 // publishing only
    char prefix[CLIENT_PREFIX_MAX]; // of the daemon's input channels
    Session session;                // used by the LCM thread alone
    pthread_mutex_t lock;
    int64_t daemon, sure_until_ns; // of the session, for all threads
    Request request[REQUESTS_MAX];
} Requests;

// `prefix`: NULL for the client's own.
void requests_init(Requests *requests, Client *client, const char *prefix);
void requests_destroy(Requests *requests);

// Writes "<PREFIX>_<name>", a channel that the daemon listens to.
void requests_channel(const Requests *requests, const char *name, char channel[CLIENT_CHANNEL_MAX]);
// Makes later requests go to the daemon that answered last. The LCM thread.
void requests_follow(Requests *requests);
// Publishes a cut, load, tie or command immediately, or in the LCM thread's next iteration. Any
// thread. Returns false if too many wait for an answer.
bool requests_send(Requests *requests, int32_t sender, const Ask *ask);
// Handles an answer. The LCM thread.
void requests_answered(Requests *requests, int32_t sender, int32_t id);
// Drops the requests of a page that is gone. Any thread.
void requests_forget(Requests *requests, int32_t sender);
// Repeats the requests that are due and informs pages of those given up. The LCM thread, every few
// ms.
void requests_repeat(Requests *requests, Board *board, int64_t now_ns);

#endif
