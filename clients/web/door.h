// SPDX-License-Identifier: MIT
// Who is let in: access control, and connections that are not pages (yet).
#ifndef PLIANT_WEB_DOOR_H
#define PLIANT_WEB_DOOR_H

#include "client.h"

#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>

// --- access --------------------------------------------------------------------------------------

// Access control: the permitted Host and Origin of a request, and the token. Pure functions, any
// thread. A page of another site must not reach a server on this machine, neither by a WebSocket
// (it carries that site's Origin) nor under a name that its owner points here (a foreign Host).

enum { TOKEN_MIN = 16, TOKEN_MAX = 128 };

typedef struct Door {
    char host[256];            // another name of this server; "" for none
    char token[TOKEN_MAX + 1]; // "" for none
    char cookie[32];           // name of the cookie with the token
} Door;

// Draws a token of 128 random bits.
bool door_draw_token(Door *door, PliantError *error);
// Reads the token from the first line of a file: TOKEN_MIN to TOKEN_MAX letters, digits, '-' and
// '_'.
bool door_read_token(Door *door, const char *path, PliantError *error);

// True for "NAME" or "NAME:PORT" with localhost, a numeric address or door->host as the name.
bool door_admits_host(const Door *door, const char *host);
// True for no origin (NULL), which no browser sends, and for http(s):// HOST or door->host.
bool door_admits_origin(const Door *door, const char *origin, const char *host);
// Checks the token of the query or the cookie; NULL: none given.
bool door_admits(const Door *door, const char *given);

// --- visitors ------------------------------------------------------------------------------------

// Connections that are not (yet) pages: their number, age and address. One thread.

enum {
    VISITORS_MAX = 128, // size of the table; the web server accepts no more connections
    VISITORS_KEPT = 64, // more are closed, beginning with the address that has the most
};

typedef struct Visitor {
    int fd;                    // -1: a free slot
    unsigned char address[16]; // IPv6, or IPv4 in its last four bytes
    int64_t since_ns;
    bool asked;          // its request has arrived
    bool page;           // it has become one
    bool shut;           // shut down; the web server closes it
    int refusal;         // of what it sends, as a status code; 0: none
    const char *because; // its sentence, constant
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
