// SPDX-License-Identifier: MIT
// A page's end of pliant-web's WebSocket, also one that misbehaves, and plain HTTP requests.
#ifndef PLIANT_TESTS_PAGE_CLIENT_H
#define PLIANT_TESTS_PAGE_CLIENT_H

#include "harness.h"

#include <pthread.h>

enum { PAGE_TEXT_MAX = 16384, PAGE_KINDS = 16 };

typedef struct PageText {
    char type[16];
    int count;
    char text[PAGE_TEXT_MAX]; // the newest
} PageText;

// What has come of one body.
typedef struct PageBody {
    int meshes, frames, rests;
    int topology, nodes, triangles; // of the newest mesh
    int frame_topology, frame_nodes;
    double step;
    bool matched; // every frame was of the newest mesh
} PageBody;

typedef struct PageClient {
    int fd;
    bool pongs; // answers pings
    pthread_t reader;
    pthread_mutex_t sending;
    pthread_mutex_t lock; // all below; written by the reader
    bool answers;         // rounds with `drawn`
    bool closed;
    int reason; // of the server's close frame; 0: none
    int rounds;
    long long round; // the newest
    int kinds;
    PageText kind[PAGE_KINDS];
    PageBody body[4];
    char first[16], second[16]; // types of the first two texts
} PageClient;

// NULL: refused, `why` says how. `path`: "/live", perhaps with a query; `origin` may be NULL.
PageClient *page_connect(int port, const char *path, const char *origin, char why[256]);
// On /live; fails the test when it is refused.
PageClient *page_open(int port);
void page_disconnect(PageClient *page);
void page_disconnect_all(void); // that are connected still
void page_send(PageClient *page, const char *format, ...) __attribute__((format(printf, 2, 3)));

// A frame whose first byte is that, masked; bytes as they are.
void page_send_frame(PageClient *page, int first, const void *data, size_t size);
void page_send_raw(PageClient *page, const void *data, size_t size);

int page_count(PageClient *page, const char *type);
int page_rounds(PageClient *page);
bool page_closed(PageClient *page); // by the server
int page_reason(PageClient *page);  // that it gave
PageBody page_body(PageClient *page, int body);
// Whether the newest text of that type contains `part`.
bool page_says(PageClient *page, const char *type, const char *part);
// Answers rounds from now on, and the one that waits.
void page_answer(PageClient *page);

// Starts pliant-web on a free port and returns that.
int web_start(Process *server, const char *format, ...) __attribute__((format(printf, 2, 3)));
extern char web_line[512]; // what it said first

// A connection from an address of this machine, 127.0.0.1 or 127.0.0.2; waits 30 s at most.
int http_connect(int port, const char *from);
// Sends a request as it is and returns the status code of the answer, which goes to `answer` as far
// as there is room; -1: none.
int http_request(int port, const char *request, char *answer, size_t size);

// Waits for a condition without LCM; fails the test after half a minute.
#define page_wait(condition)                                                                       \
    do {                                                                                           \
        bool met_ = (condition);                                                                   \
        for (int turn_ = 0; turn_ < 3000 && !met_; turn_++) {                                      \
            page_pause();                                                                          \
            met_ = (condition);                                                                    \
        }                                                                                          \
        if (!met_)                                                                                 \
            fail_msg("waited in vain for: %s", #condition);                                        \
    } while (0)
// Sends a text and waits until the newest one of this type contains `part`.
#define page_exchange(page, text, type, part)                                                      \
    do {                                                                                           \
        page_send(page, "%s", text);                                                               \
        page_wait(page_says(page, type, part));                                                    \
    } while (0)
void page_pause(void); // 10 ms

#endif
