// Who may come in: what the Host and Origin of a request may be, and the token. Pure functions, any
// thread. A page of another site must not reach a server on this machine, neither by a WebSocket
// (it carries that site's Origin) nor under a name that its owner points here (a foreign Host).
#ifndef PLIANT_WEB_DOOR_H
#define PLIANT_WEB_DOOR_H

#include "client.h"

enum { TOKEN_MIN = 16, TOKEN_MAX = 128 };

typedef struct Door {
    char host[256];            // a further name that this server is reached by; "" for none
    char token[TOKEN_MAX + 1]; // "" for none
    char cookie[32];           // name of the cookie that holds it
} Door;

// Draws a token of 128 random bits.
bool door_draw_token(Door *door, ClientError *error);
// Reads it from the first line of a file: TOKEN_MIN to TOKEN_MAX letters, digits, '-' and '_'.
bool door_read_token(Door *door, const char *path, ClientError *error);

// "NAME" or "NAME:PORT" with localhost, a numeric address or door->host as the name.
bool door_admits_host(const Door *door, const char *host);
// A missing origin (NULL) is no browser's; others must be http(s)://HOST.
bool door_admits_origin(const char *origin, const char *host);
// By "token=..." of the query or by the cookie; either may be NULL.
bool door_admits_query(const Door *door, const char *query);
bool door_admits_cookie(const Door *door, const char *cookies);

#endif
