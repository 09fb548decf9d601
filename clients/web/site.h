// SPDX-License-Identifier: MIT
// The web server: the page's files, images for bodies, recordings, meshes that are sent to the
// workbench, and the WebSocket /live. It runs in its own thread, and answers only requests that
// door.h admits: GET, and POST for /mesh.
#ifndef PLIANT_WEB_SITE_H
#define PLIANT_WEB_SITE_H

#include "board.h"
#include "client.h"

#include "base/arguments.h"
#include "door.h"
#include "requests.h"
#include "texts.h"
#include "workbench.h"

// --- a page --------------------------------------------------------------------------------------

// One page's WebSocket, with two threads: one writes rounds to it; the other reads from it and
// publishes its requests immediately. A page that stalls delays neither LCM nor other pages.

// Shared by all pages; constant while pages are open.
typedef struct PageSite {
    Client *client; // for publishing only, which any thread may do
    Board *board;
    Requests *requests;
    Workbench *workbench; // NULL: none
    HelloText hello;
} PageSite;

// Called as the last act of a page, by its own thread: the socket may be closed.
typedef struct PageEnd {
    void (*call)(void *site, void *connection);
    void *site, *connection;
} PageEnd;

// Takes over an upgraded connection, of which `size` bytes have been read already, until the page
// or the board ends it; its tools are withdrawn then. Returns false if there are too many pages or
// memory runs out.
bool page_open(const PageSite *shared, int fd, const void *read, size_t size, PageEnd end);

// --- the server ----------------------------------------------------------------------------------

enum { SITE_TEXTURES = BOARD_BODIES };

// An image for a body.
typedef struct Texture {
    char body[64];
    const char *type;    // "image/png" or "image/jpeg"
    unsigned char *data; // owned
    size_t size;
} Texture;

// A mesh that a visitor sends; one at a time.
typedef struct SiteUpload {
    Visitor *visitor; // NULL: none
    Upload file;
    bool refused;               // the rest is read and forgotten; `why` is the answer
    int64_t since_ns, received; // [bytes], also those that are forgotten
    PliantError why;
} SiteUpload;

typedef struct Site {
    // set before site_start
    char address[64];  // numeric; IPv6 without brackets
    int port;          // 0: any; site_start sets it
    char folder[4096]; // of the page; "" for none
    Door door;
    PageSite shared;
    Texture texture[SITE_TEXTURES];
    int textures;
    // own
    char root[4096]; // the folder without links; "" for none
    struct MHD_Daemon *server;
    pthread_t thread;
    bool serving;
    atomic_bool stopping;
    Visitors visitors; // used by the thread alone
    SiteUpload upload; // the same
    pthread_mutex_t lock;
    pthread_cond_t page_ended;
    int pages; // running page threads; under the lock
} Site;

// Reads "BODY=IMAGE", a PNG or JPEG of at most 64 MB; refuses as an ArgumentHandler does.
bool site_add_texture(Site *site, const char *argument, Status *why);
bool site_start(Site *site, PliantError *error);
// Closes all connections; pages withdraw their tools. Call also after site_start has failed.
void site_stop(Site *site);

#endif
