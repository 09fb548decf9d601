// One page's WebSocket: a thread of its own writes rounds to it, the thread that reads from it
// publishes what it asks for at once. A page that stalls holds up neither LCM nor other pages.
#ifndef PLIANT_WEB_PAGE_H
#define PLIANT_WEB_PAGE_H

#include "board.h"
#include "client.h"
#include "requests.h"
#include "texts.h"

struct mg_connection;

// What all pages share; constant while pages are open.
typedef struct PageRoom {
    Client *client; // publishing only, which any thread may
    Board *board;
    Requests *requests;
    HelloText hello;
} PageRoom;

typedef struct Page Page;

// NULL: no more pages, or out of memory.
Page *page_open(const PageRoom *room, struct mg_connection *connection);
// A message of the page. False: it breaks the protocol of WebSockets as we speak it; close it.
bool page_take(Page *page, int bits, const char *data, size_t size);
// Withdraws its tools, waits for its thread. Before the connection is closed.
void page_close(Page *page);

#endif
