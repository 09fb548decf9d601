#include "page_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <civetweb.h>

enum { OPCODE = 0x0f };

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
    mg_websocket_client_write(page->connection, MG_WEBSOCKET_OPCODE_TEXT, text, (size_t)length);
}

static int on_data(struct mg_connection *connection, int bits, char *data, size_t size, void *user)
{
    (void)connection;
    PageClient *page = user;
    pthread_mutex_lock(&page->lock);
    int rounds = page->rounds;
    if ((bits & OPCODE) == MG_WEBSOCKET_OPCODE_TEXT)
        take_text(page, data, size);
    else if ((bits & OPCODE) == MG_WEBSOCKET_OPCODE_BINARY)
        take_binary(page, data, size);
    bool drawn = page->rounds > rounds && page->answers && page->connection != NULL;
    long long round = page->round;
    pthread_mutex_unlock(&page->lock);
    if (drawn)
        answer(page, round);
    return 1;
}

static void on_close(const struct mg_connection *connection, void *user)
{
    (void)connection;
    PageClient *page = user;
    pthread_mutex_lock(&page->lock);
    page->closed = true;
    pthread_mutex_unlock(&page->lock);
}

// --- the connection ---

PageClient *page_connect(int port, const char *path, const char *origin, char why[256])
{
    PageClient *page = calloc(1, sizeof *page);
    assert_non_null(page);
    pthread_mutex_init(&page->lock, NULL);
    struct mg_connection *connection = mg_connect_websocket_client(
        "127.0.0.1", port, 0, why, 256, path, origin, on_data, on_close, page);
    if (connection == NULL) {
        pthread_mutex_destroy(&page->lock);
        free(page);
        return NULL;
    }
    pthread_mutex_lock(&page->lock);
    page->connection = connection;
    pthread_mutex_unlock(&page->lock);
    page_answer(page);
    return page;
}

void page_disconnect(PageClient *page)
{
    // The server closes at once, which civetweb's thread here sees earlier than our wish.
    mg_websocket_client_write(page->connection, MG_WEBSOCKET_OPCODE_CONNECTION_CLOSE, "\x03\xe8",
                              2);
    mg_close_connection(page->connection);
    pthread_mutex_destroy(&page->lock);
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
    mg_websocket_client_write(page->connection, MG_WEBSOCKET_OPCODE_TEXT, text, (size_t)length);
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

// --- HTTP ---

int http_request(int port, const char *request, char *answer_text, size_t size)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), code = -1;
    struct timeval limit = {.tv_sec = 30};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    assert_int_equal(connect(fd, (struct sockaddr *)&address, sizeof address), 0);
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
