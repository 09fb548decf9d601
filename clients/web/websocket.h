// SPDX-License-Identifier: MIT
// The server's end of a WebSocket (RFC 6455) on a connected socket, for short frames in and long
// frames out. A frame's size is checked as soon as its header has arrived: none needs more memory
// than the buffer below. One thread reads; any thread sends.
#ifndef PLIANT_WEB_WEBSOCKET_H
#define PLIANT_WEB_WEBSOCKET_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    WEBSOCKET_TEXT = 1,
    WEBSOCKET_BINARY = 2,
    WEBSOCKET_CLOSE = 8,
    WEBSOCKET_PING = 9,
    WEBSOCKET_PONG = 10,
    WEBSOCKET_FRAME_MAX = 16384, // payload of an accepted frame [bytes]
    WEBSOCKET_BUFFER = 65536,    // [bytes]
    WEBSOCKET_KEY = 24,          // letters of a Sec-WebSocket-Key
    WEBSOCKET_ANSWER = 29,       // of Sec-WebSocket-Accept, with its terminator
};

// Reasons to end a connection, as in a close frame.
enum {
    WEBSOCKET_GOING_AWAY = 1001,
    WEBSOCKET_WRONG = 1002,       // not the protocol
    WEBSOCKET_UNSUPPORTED = 1003, // binary or in fragments
    WEBSOCKET_TOO_BIG = 1009,
};

typedef struct WebSocket {
    int fd; // the caller's; non-blocking
    pthread_mutex_t writing;
    bool closed;              // a close frame was sent, which ends sending; under the lock
    _Atomic int64_t alive_ns; // CLOCK_MONOTONIC of the last bytes received, or sent of a message
    size_t begin, end;        // read and not yet taken
    unsigned char buffer[WEBSOCKET_BUFFER];
} WebSocket;

typedef struct WebSocketFrame {
    int opcode;
    char *data; // in the buffer, until the next call
    size_t size;
} WebSocketFrame;

// Computes Sec-WebSocket-Accept for a client's key. Returns false for an invalid key.
bool websocket_answer(const char *key, char answer[WEBSOCKET_ANSWER]);

// `read`: bytes that have arrived already, at most WEBSOCKET_BUFFER.
void websocket_init(WebSocket *socket, int fd, const void *read, size_t size);
void websocket_destroy(WebSocket *socket);

// Takes the next frame from the buffer. Returns 1 for a frame, 0 if more bytes are needed, else
// minus the reason to end the connection.
int websocket_take(WebSocket *socket, WebSocketFrame *frame);
// Waits for bytes and reads them. Returns 1 if some came, 0 if none in that time, -1 at the end.
int websocket_read(WebSocket *socket, int patience_ms);
// Sends a frame; waits while the other end accepts some of it at least every 10 s. Shuts the
// connection down after a failure.
bool websocket_send(WebSocket *socket, int opcode, const void *data, size_t size);
// Does the same if no other frame is being sent; else does nothing.
void websocket_send_idle(WebSocket *socket, int opcode, const void *data, size_t size);
bool websocket_send_close(WebSocket *socket, int reason);

#endif
