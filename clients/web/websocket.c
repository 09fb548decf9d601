// SPDX-License-Identifier: MIT
// Frames of a WebSocket.
#include "websocket.h"
#include "client.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>

enum {
    FIN = 0x80,
    RESERVED = 0x70,
    OPCODE = 0x0f,
    MASKED = 0x80,
    LENGTH = 0x7f,
    LENGTH_16 = 126, // the length is in the next 2 bytes
    LENGTH_64 = 127, // in the next 8
    CONTROL_MAX = 125,
    HEAD_MAX = 10,
    SEND_PATIENCE_MS = 10000,
};

// --- the handshake ---

bool websocket_answer(const char *key, char answer[WEBSOCKET_ANSWER])
{
    static const char salt[] = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"; // RFC 6455, 1.3
    if (!key || strlen(key) != WEBSOCKET_KEY)
        return false;
    char text[WEBSOCKET_KEY + sizeof salt];
    unsigned char hash[20];
    // The answer proves that we know the protocol: a hash of the key and a fixed text.
    snprintf(text, sizeof text, "%s%s", key, salt);
    if (gnutls_hash_fast(GNUTLS_DIG_SHA1, text, strlen(text), hash) < 0)
        return false;
    const gnutls_datum_t raw = {hash, sizeof hash};
    gnutls_datum_t coded = {0};
    if (gnutls_base64_encode2(&raw, &coded) < 0)
        return false;
    bool fits = coded.size < WEBSOCKET_ANSWER;
    if (fits)
        snprintf(answer, WEBSOCKET_ANSWER, "%.*s", (int)coded.size, (const char *)coded.data);
    gnutls_free(coded.data);
    return fits;
}

void websocket_init(WebSocket *socket, int fd, const void *read, size_t size)
{
    socket->fd = fd;
    socket->closed = false;
    socket->begin = 0;
    socket->end = size < sizeof socket->buffer ? size : sizeof socket->buffer;
    if (socket->end > 0)
        memcpy(socket->buffer, read, socket->end);
    atomic_store(&socket->alive_ns, client_now_ns());
    pthread_mutex_init(&socket->writing, NULL);
}

void websocket_destroy(WebSocket *socket)
{
    pthread_mutex_destroy(&socket->writing);
}

// --- in ---

// Returns the reason why a frame with these first two bytes is refused; 0: none.
static int refuse_head(const unsigned char *head)
{
    int opcode = head[0] & OPCODE, length = head[1] & LENGTH;
    bool known =
        opcode <= WEBSOCKET_BINARY || (opcode >= WEBSOCKET_CLOSE && opcode <= WEBSOCKET_PONG);
    if (!known || head[0] & RESERVED || !(head[1] & MASKED))
        return WEBSOCKET_WRONG;
    if (opcode >= WEBSOCKET_CLOSE)
        return head[0] & FIN && length <= CONTROL_MAX ? 0 : WEBSOCKET_WRONG;
    if (length == LENGTH_64)
        return WEBSOCKET_TOO_BIG; // 65536 bytes at least
    // Browsers send short messages in one frame.
    return opcode == WEBSOCKET_TEXT && head[0] & FIN ? 0 : WEBSOCKET_UNSUPPORTED;
}

int websocket_take(WebSocket *socket, WebSocketFrame *frame)
{
    unsigned char *at = socket->buffer + socket->begin;
    size_t there = socket->end - socket->begin, head = 2;
    // The head says how long the frame is.
    if (there < head)
        return 0;
    int refusal = refuse_head(at);
    if (refusal)
        return -refusal;
    size_t size = at[1] & LENGTH;
    if (size == LENGTH_16) {
        head = 4;
        if (there < head)
            return 0;
        size = (size_t)at[2] << 8 | at[3];
    }
    // Refuse before its data arrive.
    if (size > WEBSOCKET_FRAME_MAX)
        return -WEBSOCKET_TOO_BIG;
    // All of it must be there; then the mask is removed in place.
    const unsigned char *mask = at + head;
    head += 4;
    if (there < head + size)
        return 0;
    for (size_t k = 0; k < size; k++)
        at[head + k] ^= mask[k % 4];
    *frame = (WebSocketFrame){at[0] & OPCODE, (char *)at + head, size};
    socket->begin += head + size;
    return 1;
}

int websocket_read(WebSocket *socket, int patience_ms)
{
    // The rest is less than a frame: move it to the front to make space.
    memmove(socket->buffer, socket->buffer + socket->begin, socket->end - socket->begin);
    socket->end -= socket->begin;
    socket->begin = 0;
    // Wait, then read what is there.
    struct pollfd ready = {.fd = socket->fd, .events = POLLIN};
    int count = poll(&ready, 1, patience_ms);
    if (count <= 0)
        return count == 0 || errno == EINTR ? 0 : -1;
    ssize_t got =
        recv(socket->fd, socket->buffer + socket->end, sizeof socket->buffer - socket->end, 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR))
        return 0;
    if (got <= 0)
        return -1;
    // The page lives.
    socket->end += (size_t)got;
    atomic_store(&socket->alive_ns, client_now_ns());
    return 1;
}

// --- out ---

// Removes the sent bytes from the parts.
static void drop_sent(struct iovec part[2], size_t sent)
{
    for (int k = 0; k < 2 && sent > 0; k++) {
        size_t of_this = sent < part[k].iov_len ? sent : part[k].iov_len;
        part[k].iov_base = (char *)part[k].iov_base + of_this;
        part[k].iov_len -= of_this;
        sent -= of_this;
    }
}

static bool send_parts(WebSocket *socket, struct iovec part[2], bool alive)
{
    while (part[0].iov_len + part[1].iov_len > 0) {
        const struct msghdr message = {.msg_iov = part, .msg_iovlen = 2};
        ssize_t sent = sendmsg(socket->fd, &message, MSG_NOSIGNAL);
        // What was sent is dropped from both parts.
        if (sent >= 0) {
            drop_sent(part, (size_t)sent);
            if (alive)
                atomic_store(&socket->alive_ns, client_now_ns());
            continue;
        }
        // Wait for a slow page, not for ever.
        struct pollfd ready = {.fd = socket->fd, .events = POLLOUT};
        if (errno != EINTR && (errno != EAGAIN || poll(&ready, 1, SEND_PATIENCE_MS) == 0)) {
            shutdown(socket->fd, SHUT_RDWR); // half a frame was sent
            return false;
        }
    }
    return true;
}

// Call under the lock.
static bool send_frame(WebSocket *socket, int opcode, const void *data, size_t size)
{
    if (socket->closed)
        return false;
    socket->closed = opcode == WEBSOCKET_CLOSE;
    // The head states the length in as few bytes as possible.
    unsigned char head[HEAD_MAX] = {(unsigned char)(FIN | opcode)};
    size_t bytes = 2;
    if (size <= CONTROL_MAX) {
        head[1] = (unsigned char)size;
    } else {
        int length = size <= UINT16_MAX ? 2 : 8;
        head[1] = length == 2 ? LENGTH_16 : LENGTH_64;
        for (int k = 0; k < length; k++)
            head[bytes++] = (unsigned char)((uint64_t)size >> 8 * (length - 1 - k));
    }
    // Head and data leave without being joined first.
    struct iovec part[2] = {{head, bytes}, {(void *)(uintptr_t)data, size}};
    return send_parts(socket, part, opcode < WEBSOCKET_CLOSE); // our own ping is no sign of life
}

bool websocket_send(WebSocket *socket, int opcode, const void *data, size_t size)
{
    pthread_mutex_lock(&socket->writing);
    bool sent = send_frame(socket, opcode, data, size);
    pthread_mutex_unlock(&socket->writing);
    return sent;
}

void websocket_send_idle(WebSocket *socket, int opcode, const void *data, size_t size)
{
    if (pthread_mutex_trylock(&socket->writing) != 0)
        return;
    struct pollfd ready = {.fd = socket->fd, .events = POLLOUT};
    if (poll(&ready, 1, 0) == 1)
        send_frame(socket, opcode, data, size);
    pthread_mutex_unlock(&socket->writing);
}

bool websocket_send_close(WebSocket *socket, int reason)
{
    const unsigned char code[2] = {(unsigned char)(reason >> 8), (unsigned char)reason};
    return websocket_send(socket, WEBSOCKET_CLOSE, code, sizeof code);
}
