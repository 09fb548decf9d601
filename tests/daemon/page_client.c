// SPDX-License-Identifier: MIT
#include "page_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { TEXT = 1, BINARY = 2, CLOSE = 8, PING = 9, PONG = 10, FIN = 0x80, FRAME_MAX = 1 << 26 };

// --- what comes ---

static void take_text(PageClient *page, const char *data, size_t size)
{
    char text[PAGE_TEXT_MAX], type[16] = "";
    snprintf(text, sizeof text, "%.*s", (int)size, data);
    const char *at = strstr(text, "\"type\":\"");
    if (at != NULL)
        sscanf(at, "\"type\":\"%15[a-z]", type);
    if (page->first[0] == '\0')
        strcpy(page->first, type);
    else if (page->second[0] == '\0')
        strcpy(page->second, type);
    int k = 0;
    while (k < page->kinds && strcmp(page->kind[k].type, type) != 0)
        k++;
    if (k == PAGE_KINDS)
        return;
    page->kinds += k == page->kinds;
    strcpy(page->kind[k].type, type);
    page->kind[k].count++;
    strcpy(page->kind[k].text, text);
    at = strstr(text, "\"round\":");
    if (strcmp(type, "round") == 0 && at != NULL) {
        page->rounds++;
        page->round = strtoll(at + 8, NULL, 10);
    }
}

static void take_binary(PageClient *page, const char *data, size_t size)
{
    int32_t word[6] = {0};
    memcpy(word, data, size < sizeof word ? size : sizeof word);
    if (size < sizeof word || word[1] < 0 || word[1] >= 4)
        return;
    PageBody *body = &page->body[word[1]];
    if (word[0] == 1) {
        body->meshes++;
        body->topology = word[2];
        body->nodes = word[3];
        body->triangles = word[4];
        if (size != 24 + 12 * (size_t)word[4] + 21 * (size_t)word[3])
            body->nodes = -1;
    } else if (word[0] == 2) {
        double step = 0.0;
        memcpy(&step, data + 24, sizeof step);
        bool first = body->frames++ == 0;
        bool matches = body->meshes > 0 && word[2] == body->topology && word[3] == body->nodes &&
                       size == 40 + 12 * (size_t)word[3];
        body->matched = (first || body->matched) && matches;
        body->frame_topology = word[2];
        body->frame_nodes = word[3];
        body->step = step;
    } else if (word[0] == 3) {
        body->rests++;
    }
}

static void answer(PageClient *page, long long round)
{
    char text[64];
    int length = snprintf(text, sizeof text, "{\"type\":\"drawn\",\"round\":%lld}", round);
    page_send_frame(page, FIN | TEXT, text, (size_t)length);
}

static void take_message(PageClient *page, int opcode, const char *data, size_t size)
{
    pthread_mutex_lock(&page->lock);
    int rounds = page->rounds;
    if (opcode == TEXT)
        take_text(page, data, size);
    else if (opcode == BINARY)
        take_binary(page, data, size);
    bool drawn = page->rounds > rounds && page->answers;
    long long round = page->round;
    pthread_mutex_unlock(&page->lock);
    if (drawn)
        answer(page, round);
}

// --- frames ---

static bool receive(int fd, void *data, size_t size)
{
    return size == 0 || recv(fd, data, size, MSG_WAITALL) == (ssize_t)size;
}

// One frame of the server; false: the connection has ended.
static bool take_frame(PageClient *page)
{
    unsigned char head[2], more[8];
    if (!receive(page->fd, head, 2))
        return false;
    uint64_t size = head[1]; // unmasked: the first bit is 0
    int bytes = size == 126 ? 2 : size == 127 ? 8 : 0;
    if (!receive(page->fd, more, (size_t)bytes))
        return false;
    for (int k = 0; k < bytes; k++)
        size = (k == 0 ? 0 : size << 8) | more[k];
    char *data = size <= FRAME_MAX ? malloc(size + 1) : NULL;
    bool ok = data != NULL && head[0] & FIN && receive(page->fd, data, size);
    int opcode = head[0] & 0x0f;
    if (ok && opcode == PING && page->pongs)
        page_send_frame(page, FIN | PONG, data, size);
    if (ok && opcode == CLOSE && size >= 2) {
        pthread_mutex_lock(&page->lock);
        page->reason = (unsigned char)data[0] << 8 | (unsigned char)data[1];
        pthread_mutex_unlock(&page->lock);
    }
    if (ok)
        take_message(page, opcode, data, size);
    free(data);
    return ok && opcode != CLOSE;
}

static void *take_frames(void *user)
{
    PageClient *page = user;
    while (take_frame(page)) {
    }
    shutdown(page->fd, SHUT_RDWR);
    pthread_mutex_lock(&page->lock);
    page->closed = true;
    pthread_mutex_unlock(&page->lock);
    return NULL;
}

void page_send_raw(PageClient *page, const void *data, size_t size)
{
    const char *at = data;
    while (size > 0) {
        ssize_t sent = send(page->fd, at, size, MSG_NOSIGNAL);
        if (sent <= 0)
            return;
        at += sent;
        size -= (size_t)sent;
    }
}

void page_send_frame(PageClient *page, int first, const void *data, size_t size)
{
    FREED unsigned char *frame = malloc(size + 14);
    assert_non_null(frame);
    size_t at = 0;
    int bytes = size < 126 ? 0 : size < 65536 ? 2 : 8;
    frame[at++] = (unsigned char)first;
    frame[at++] = (unsigned char)(0x80 | (bytes == 0 ? (int)size : bytes == 2 ? 126 : 127));
    for (int k = 0; k < bytes; k++)
        frame[at++] = (unsigned char)((uint64_t)size >> 8 * (bytes - 1 - k));
    for (int k = 0; k < 4; k++) // a mask
        frame[at++] = (unsigned char)(0x5a + k);
    for (size_t k = 0; k < size; k++)
        frame[at + k] = (unsigned char)(((const unsigned char *)data)[k] ^ (0x5a + k % 4));
    pthread_mutex_lock(&page->sending);
    page_send_raw(page, frame, at + size);
    pthread_mutex_unlock(&page->sending);
}

// --- the connection ---

int http_connect(int port, const char *from)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    struct sockaddr_in own = {.sin_family = AF_INET};
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    struct timeval limit = {.tv_sec = 30};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    inet_pton(AF_INET, from, &own.sin_addr);
    assert_int_equal(bind(fd, (struct sockaddr *)&own, sizeof own), 0);
    assert_int_equal(connect(fd, (struct sockaddr *)&address, sizeof address), 0);
    return fd;
}

// Reads to the end of the headers, no further.
static bool take_answer(int fd, char why[256])
{
    char text[2048] = "";
    size_t length = 0;
    while (length + 1 < sizeof text && strstr(text, "\r\n\r\n") == NULL) {
        if (recv(fd, text + length, 1, 0) != 1)
            break;
        text[++length] = '\0';
    }
    snprintf(why, 256, "%.*s", (int)strcspn(text, "\r"), text);
    return strncmp(text, "HTTP/1.1 101", 12) == 0 &&
           strstr(text, "Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n") != NULL;
}

static PageClient *connected[64];

static void replace_connected(const PageClient *from, PageClient *to)
{
    int k = 0;
    while (connected[k] != from)
        assert_true(++k < 64);
    connected[k] = to;
}

PageClient *page_connect(int port, const char *path, const char *origin, char why[256])
{
    PageClient *page = calloc(1, sizeof *page);
    assert_non_null(page);
    char request[1024];
    // Key and answer are the example of RFC 6455.
    int length =
        snprintf(request, sizeof request,
                 "GET %s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nUpgrade: websocket\r\n"
                 "Connection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                 "Sec-WebSocket-Version: 13\r\n%s%s%s\r\n",
                 path, port, origin ? "Origin: " : "", origin ? origin : "", origin ? "\r\n" : "");
    page->fd = http_connect(port, "127.0.0.1");
    page->pongs = true;
    pthread_mutex_init(&page->lock, NULL);
    pthread_mutex_init(&page->sending, NULL);
    page_send_raw(page, request, (size_t)length);
    if (!take_answer(page->fd, why) ||
        pthread_create(&page->reader, NULL, take_frames, page) != 0) {
        close(page->fd);
        free(page);
        return NULL;
    }
    page_answer(page);
    replace_connected(NULL, page);
    return page;
}

PageClient *page_open(int port)
{
    char why[256] = "";
    PageClient *page = page_connect(port, "/live", NULL, why);
    if (page == NULL)
        fail_msg("not connected: %s", why);
    return page;
}

void page_disconnect_all(void)
{
    for (int k = 0; k < 64; k++) {
        if (connected[k] != NULL)
            page_disconnect(connected[k]);
    }
}

void page_disconnect(PageClient *page)
{
    replace_connected(page, NULL);
    page_send_frame(page, FIN | CLOSE, "\x03\xe8", 2);
    shutdown(page->fd, SHUT_RDWR);
    pthread_join(page->reader, NULL);
    close(page->fd);
    pthread_mutex_destroy(&page->lock);
    pthread_mutex_destroy(&page->sending);
    free(page);
}

void page_answer(PageClient *page)
{
    pthread_mutex_lock(&page->lock);
    page->answers = true;
    long long round = page->round;
    pthread_mutex_unlock(&page->lock);
    if (round > 0)
        answer(page, round);
}

void page_send(PageClient *page, const char *format, ...)
{
    char text[PAGE_TEXT_MAX];
    va_list list;
    va_start(list, format);
    int length = vsnprintf(text, sizeof text, format, list);
    va_end(list);
    page_send_frame(page, FIN | TEXT, text, (size_t)length);
}

int page_count(PageClient *page, const char *type)
{
    int count = 0;
    pthread_mutex_lock(&page->lock);
    for (int k = 0; k < page->kinds; k++) {
        if (strcmp(page->kind[k].type, type) == 0)
            count = page->kind[k].count;
    }
    pthread_mutex_unlock(&page->lock);
    return count;
}

int page_rounds(PageClient *page)
{
    pthread_mutex_lock(&page->lock);
    int rounds = page->rounds;
    pthread_mutex_unlock(&page->lock);
    return rounds;
}

bool page_closed(PageClient *page)
{
    pthread_mutex_lock(&page->lock);
    bool closed = page->closed;
    pthread_mutex_unlock(&page->lock);
    return closed;
}

int page_reason(PageClient *page)
{
    pthread_mutex_lock(&page->lock);
    int reason = page->reason;
    pthread_mutex_unlock(&page->lock);
    return reason;
}

PageBody page_body(PageClient *page, int body)
{
    pthread_mutex_lock(&page->lock);
    PageBody copy = page->body[body];
    pthread_mutex_unlock(&page->lock);
    return copy;
}

bool page_says(PageClient *page, const char *type, const char *part)
{
    bool says = false;
    pthread_mutex_lock(&page->lock);
    for (int k = 0; k < page->kinds; k++) {
        if (strcmp(page->kind[k].type, type) == 0)
            says = strstr(page->kind[k].text, part) != NULL;
    }
    pthread_mutex_unlock(&page->lock);
    return says;
}

void page_pause(void)
{
    nanosleep(&(struct timespec){.tv_nsec = 10000000}, NULL);
}

// --- the server ---

char web_line[512];

int web_start(Process *server, const char *format, ...)
{
    char arguments[4 * PATH_TEXT];
    va_list list;
    va_start(list, format);
    vsnprintf(arguments, sizeof arguments, format, list);
    va_end(list);
    int port = 0;
    process_start(server, program_path("pliant-web"), "%s", arguments);
    for (int turn = 0; turn < 3000 && port == 0; turn++) {
        page_pause();
        FILE *out = fopen(process_output(server), "r");
        if (out == NULL)
            continue;
        if (fgets(web_line, sizeof web_line, out) != NULL && strchr(web_line, '\n') != NULL)
            sscanf(web_line, "page: http://127.0.0.1:%d/", &port);
        fclose(out);
    }
    if (port == 0)
        fail_msg("pliant-web %s does not say where its page is", arguments);
    return port;
}

// --- HTTP ---

int http_request(int port, const char *request, char *answer_text, size_t size)
{
    int fd = http_connect(port, "127.0.0.1"), code = -1;
    assert_int_equal(send(fd, request, strlen(request), MSG_NOSIGNAL), strlen(request));
    size_t length = 0;
    answer_text[0] = '\0';
    // An upgraded connection stays open: its headers are enough.
    while (length + 1 < size && (length < 12 || strncmp(answer_text, "HTTP/1.1 101", 12) != 0)) {
        ssize_t got = recv(fd, answer_text + length, size - 1 - length, 0);
        if (got <= 0)
            break;
        length += (size_t)got;
        answer_text[length] = '\0';
    }
    close(fd);
    sscanf(answer_text, "HTTP/1.1 %d", &code);
    return code;
}
