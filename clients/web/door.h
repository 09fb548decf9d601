// Access control: the permitted Host and Origin of a request, and the token. Pure functions, any
// thread. A page of another site must not reach a server on this machine, neither by a WebSocket
// (it carries that site's Origin) nor under a name that its owner points here (a foreign Host).
#ifndef PLIANT_WEB_DOOR_H
#define PLIANT_WEB_DOOR_H

#include "client.h"

enum { TOKEN_MIN = 16, TOKEN_MAX = 128 };

typedef struct Door {
    char host[256];            // another name of this server; "" for none
    char token[TOKEN_MAX + 1]; // "" for none
    char cookie[32];           // name of the cookie with the token
} Door;

// Draws a token of 128 random bits.
bool door_draw_token(Door *door, ClientError *error);
// Reads the token from the first line of a file: TOKEN_MIN to TOKEN_MAX letters, digits, '-' and
// '_'.
bool door_read_token(Door *door, const char *path, ClientError *error);

// True for "NAME" or "NAME:PORT" with localhost, a numeric address or door->host as the name.
bool door_admits_host(const Door *door, const char *host);
// True for no origin (NULL), which no browser sends, and for http(s)://HOST.
bool door_admits_origin(const char *origin, const char *host);
// Checks the token of the query or the cookie; NULL: none given.
bool door_admits(const Door *door, const char *given);

#endif
