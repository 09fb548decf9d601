// Connections that are not (yet) pages: their number, age and address. One thread.
#ifndef PLIANT_WEB_VISITORS_H
#define PLIANT_WEB_VISITORS_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>

enum {
    VISITORS_MAX = 128, // size of the table; the web server accepts no more connections
    VISITORS_KEPT = 64, // more are closed, beginning with the address that has the most
};

typedef struct Visitor {
    int fd;                    // -1: a free slot
    unsigned char address[16]; // IPv6, or IPv4 in its last four bytes
    int64_t since_ns;
    bool asked; // its request has arrived
    bool page;  // it has become one
    bool shut;  // shut down; the web server closes it
} Visitor;

typedef struct Visitors {
    Visitor visitor[VISITORS_MAX];
} Visitors;

void visitors_init(Visitors *visitors);
// Returns NULL if the table is full. May shut down another visitor, or this one.
Visitor *visitors_add(Visitors *visitors, int fd, const struct sockaddr *address, int64_t now_ns);
void visitors_remove(Visitor *visitor);
// Shuts down those whose request is incomplete after VISITORS_HEADER_NS.
extern const int64_t VISITORS_HEADER_NS;
void visitors_sweep(Visitors *visitors, int64_t now_ns);

#endif
