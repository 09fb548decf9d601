// One page's WebSocket, with two threads: one writes rounds to it; the other reads from it and
// publishes its requests immediately. A page that stalls delays neither LCM nor other pages.
#ifndef PLIANT_WEB_PAGE_H
#define PLIANT_WEB_PAGE_H

#include "board.h"
#include "client.h"
#include "requests.h"
#include "texts.h"

// Shared by all pages; constant while pages are open.
typedef struct PageSite {
    Client *client; // for publishing only, which any thread may do
    Board *board;
    Requests *requests;
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

#endif
