// The web server. civetweb's threads.
#include "site.h"

#include <arpa/inet.h>
#include <errno.h>
#include <limits.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <civetweb.h>

enum { TEXTURE_BYTES_MAX = 64 << 20, SPARE_THREADS = 6 };

// Nothing but our own files, run and shown by nobody else.
static const char HEADERS[] =
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self' "
    "'unsafe-inline'; img-src 'self' data: blob:; font-src 'self'; connect-src 'self'; "
    "worker-src 'self' blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "X-Frame-Options: DENY\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n";

static const char NO_PAGE[] =
    "pliant-web is running, but the page is not built.\n"
    "\n"
    "Run ./dev build in the source folder (it needs node and npm), or give --page DIR.\n"
    "The WebSocket at /live works without it.\n";

// --- answers ---

static void answer(struct mg_connection *connection, int code, const char *reason, const char *type,
                   const char *more, const void *data, size_t size)
{
    mg_printf(connection,
              "HTTP/1.1 %d %s\r\nContent-Type: %s\r\nContent-Length: %zu\r\n%s%s"
              "Cache-Control: no-cache\r\nConnection: close\r\n\r\n",
              code, reason, type, size, HEADERS, more);
    mg_write(connection, data, size);
}

static int answer_text(struct mg_connection *connection, int code, const char *reason,
                       const char *more, const char *text)
{
    answer(connection, code, reason, "text/plain; charset=utf-8", more, text, strlen(text));
    return code;
}

static int not_found(struct mg_connection *connection)
{
    return answer_text(connection, 404, "Not Found", "", "there is no such file\n");
}

// --- files ---

// Letters, digits and "._-" in names that do not begin with a dot.
static bool path_valid(const char *path)
{
    bool begins = true;
    for (const char *c = path; *c; c++) {
        bool plain = (*c >= 'a' && *c <= 'z') || (*c >= 'A' && *c <= 'Z') ||
                     (*c >= '0' && *c <= '9') || *c == '_' || *c == '-';
        if (!plain && *c != '/' && (*c != '.' || begins))
            return false;
        begins = *c == '/';
    }
    return true;
}

static int serve_file(const Site *site, struct mg_connection *connection, const char *uri)
{
    if (!site->root[0]) {
        if (strcmp(uri, "/") == 0)
            return answer_text(connection, 200, "OK", "", NO_PAGE);
        return not_found(connection);
    }
    char path[sizeof site->root + 512], real[PATH_MAX];
    const char *name = strcmp(uri, "/") == 0 ? "/index.html" : uri;
    size_t root = strlen(site->root);
    struct stat file;
    // A link may not lead out of the folder.
    if (strlen(name) > 500 || !path_valid(name) ||
        snprintf(path, sizeof path, "%s%s", site->root, name) < 0 || !realpath(path, real) ||
        strncmp(real, site->root, root) != 0 || real[root] != '/' || stat(real, &file) != 0 ||
        !S_ISREG(file.st_mode))
        return not_found(connection);
    mg_send_mime_file2(connection, real, NULL, HEADERS);
    return 200;
}

static int serve_texture(const Site *site, struct mg_connection *connection, const char *body)
{
    for (int k = 0; k < site->textures; k++) {
        const Texture *texture = &site->texture[k];
        if (strcmp(texture->body, body) == 0) {
            answer(connection, 200, "OK", texture->type, "", texture->data, texture->size);
            return 200;
        }
    }
    return not_found(connection);
}

bool site_add_texture(Site *site, const char *argument, ClientError *error)
{
    const char *path = strchr(argument, '=');
    Texture *texture = &site->texture[site->textures];
    if (site->textures == SITE_TEXTURES)
        return client_fail(error, "--texture: more than %d", SITE_TEXTURES);
    if (!path || (size_t)(path - argument) >= sizeof texture->body)
        return client_fail(error, "--texture '%s': want BODY=IMAGE", argument);
    snprintf(texture->body, sizeof texture->body, "%.*s", (int)(path - argument), argument);
    if (!client_name_valid(texture->body, 31))
        return client_fail(error, "--texture '%s': want the name of a body before '='", argument);
    FILE *file = fopen(++path, "rbe");
    struct stat info;
    if (!file || fstat(fileno(file), &info) != 0) {
        int why = errno;
        if (file)
            fclose(file);
        return client_fail(error, "--texture %s: %s", path, strerror(why));
    }
    bool fits = S_ISREG(info.st_mode) && info.st_size > 8 && info.st_size <= TEXTURE_BYTES_MAX;
    unsigned char *data = fits ? malloc((size_t)info.st_size) : NULL;
    bool read = data && fread(data, (size_t)info.st_size, 1, file) == 1;
    fclose(file);
    texture->type = NULL;
    if (read && memcmp(data, "\x89PNG\r\n\x1a\n", 8) == 0)
        texture->type = "image/png";
    else if (read && memcmp(data, "\xff\xd8\xff", 3) == 0)
        texture->type = "image/jpeg";
    if (!texture->type) {
        free(data);
        return client_fail(error, "--texture %s: want a PNG or JPEG of at most %d MB", path,
                           TEXTURE_BYTES_MAX >> 20);
    }
    texture->data = data;
    texture->size = (size_t)info.st_size;
    site->textures++;
    return true;
}

// --- the door ---

// 0: admitted; else the code of the answer that was given.
static int check_token(const Site *site, struct mg_connection *connection,
                       const struct mg_request_info *request)
{
    const Door *door = &site->door;
    if (!door->token[0] || door_admits_cookie(door, mg_get_header(connection, "Cookie")))
        return 0;
    if (!door_admits_query(door, request->query_string))
        return answer_text(connection, 403, "Forbidden", "",
                           "open the page by the address with its token that pliant-web printed\n");
    if (strcmp(request->local_uri, "/") != 0)
        return 0;
    // From here on the browser sends it as a cookie: it stays in no history and on no screen.
    char cookie[TOKEN_MAX + 128];
    snprintf(cookie, sizeof cookie,
             "Set-Cookie: %s=%s; Path=/; HttpOnly; SameSite=Strict\r\nLocation: /\r\n",
             door->cookie, door->token);
    return answer_text(connection, 303, "See Other", cookie, "");
}

// civetweb's callback for every request, before it handles any itself: 0 lets it.
static int begin_request(struct mg_connection *connection)
{
    const struct mg_request_info *request = mg_get_request_info(connection);
    const Site *site = request->user_data;
    const char *host = mg_get_header(connection, "Host"), *uri = request->local_uri;
    if (!door_admits_host(&site->door, host))
        return answer_text(connection, 403, "Forbidden", "",
                           "this server is not known by that name (see --host)\n");
    if (strcmp(request->request_method, "GET") != 0)
        return answer_text(connection, 405, "Method Not Allowed", "Allow: GET\r\n", "want GET\n");
    if (!door_admits_origin(mg_get_header(connection, "Origin"), host))
        return answer_text(connection, 403, "Forbidden", "", "pages of other sites stay outside\n");
    int refused = check_token(site, connection, request);
    if (refused)
        return refused;
    if (strcmp(uri, "/live") == 0) {
        if (!mg_get_header(connection, "Sec-WebSocket-Key"))
            return answer_text(connection, 426, "Upgrade Required", "Upgrade: websocket\r\n",
                               "/live is a WebSocket\n");
        if (board_pages(site->room.board) >= BOARD_PAGES)
            return answer_text(connection, 503, "Service Unavailable", "",
                               "as many pages as there may be are open\n");
        return 0;
    }
    if (strncmp(uri, "/texture/", 9) == 0)
        return serve_texture(site, connection, uri + 9);
    return serve_file(site, connection, uri);
}

// --- /live ---

static void on_ready(struct mg_connection *connection, void *user)
{
    const Site *site = user;
    Page *page = page_open(&site->room, connection);
    mg_set_user_connection_data(connection, page);
    if (!page) // 1013: try again later
        mg_websocket_write(connection, MG_WEBSOCKET_OPCODE_CONNECTION_CLOSE, "\x03\xf5", 2);
}

static int on_data(struct mg_connection *connection, int bits, char *data, size_t size, void *user)
{
    (void)user;
    Page *page = mg_get_user_connection_data(connection);
    return page && page_take(page, bits, data, size);
}

static void on_close(const struct mg_connection *connection, void *user)
{
    (void)user;
    Page *page = mg_get_user_connection_data(connection);
    if (page)
        page_close(page);
}

// --- begin and end ---

// civetweb's own complaint names neither the port nor a way out.
static bool check_port(const Site *site, ClientError *error)
{
    struct sockaddr_in v4 = {.sin_family = AF_INET, .sin_port = htons((uint16_t)site->port)};
    struct sockaddr_in6 v6 = {.sin6_family = AF_INET6, .sin6_port = htons((uint16_t)site->port)};
    bool six = inet_pton(AF_INET6, site->address, &v6.sin6_addr) == 1;
    if (!six && inet_pton(AF_INET, site->address, &v4.sin_addr) != 1)
        return client_fail(error, "--listen: '%s' is not a numeric address", site->address);
    int fd = socket(six ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), on = 1;
    if (fd < 0)
        return client_fail(error, "no socket: %s", strerror(errno));
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    bool bound = six ? bind(fd, (struct sockaddr *)&v6, sizeof v6) == 0
                     : bind(fd, (struct sockaddr *)&v4, sizeof v4) == 0;
    bound = bound && listen(fd, 1) == 0;
    int why = errno;
    close(fd);
    if (bound)
        return true;
    if (why == EADDRINUSE)
        return client_fail(error,
                           "port %d of %s is in use: choose another with --port, or end the "
                           "program that has it (ss -ltnp 'sport = :%d' tells which)",
                           site->port, site->address, site->port);
    return client_fail(error, "cannot listen on port %d of %s: %s%s", site->port, site->address,
                       strerror(why), why == EACCES ? " (ports below 1024 are root's)" : "");
}

static int log_nothing(const struct mg_connection *connection, const char *message)
{
    (void)connection;
    (void)message;
    return 1;
}

bool site_start(Site *site, ClientError *error)
{
    if (site->folder[0] && !realpath(site->folder, site->root))
        return client_fail(error, "--page %s: %s", site->folder, strerror(errno));
    if (!check_port(site, error))
        return false;
    char ports[96], threads[16];
    bool six = strchr(site->address, ':') != NULL;
    snprintf(ports, sizeof ports, six ? "[%s]:%d" : "%s:%d", site->address, site->port);
    snprintf(threads, sizeof threads, "%d", BOARD_PAGES + SPARE_THREADS);
    // clang-format off
    const char *options[] = {
        "listening_ports", ports,           "num_threads", threads,
        "tcp_nodelay", "1",                 "max_request_size", "16384",
        "request_timeout_ms", "10000",      "keep_alive_timeout_ms", "0",
        "websocket_timeout_ms", "10000",    "enable_websocket_ping_pong", "yes",
        "static_file_max_age", "0",         "enable_directory_listing", "no",
        NULL};
    // clang-format on
    const struct mg_callbacks callbacks = {
        .begin_request = begin_request, .log_message = log_nothing, .log_access = log_nothing};
    mg_init_library(0);
    site->context = mg_start(&callbacks, site, options);
    if (!site->context) {
        mg_exit_library();
        return client_fail(error, "the web server does not start on port %d of %s", site->port,
                           site->address);
    }
    struct mg_server_port port[4];
    if (mg_get_server_ports(site->context, 4, port) > 0)
        site->port = port[0].port;
    snprintf(site->door.cookie, sizeof site->door.cookie, "pliant_token_%d", site->port);
    mg_set_websocket_handler(site->context, "/live", NULL, on_ready, on_data, on_close, site);
    return true;
}

static void *stop_server(void *user)
{
    Site *site = user;
    mg_stop(site->context);
    atomic_store(&site->stopped, true);
    return NULL;
}

// civetweb looks only every 2 s whether it should end, unless someone knocks.
static void knock(const Site *site)
{
    struct sockaddr_in v4 = {.sin_family = AF_INET, .sin_port = htons((uint16_t)site->port)};
    inet_pton(AF_INET, site->address, &v4.sin_addr); // IPv6: it ends all the same, later
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd >= 0) {
        connect(fd, (struct sockaddr *)&v4, sizeof v4);
        close(fd);
    }
}

void site_stop(Site *site)
{
    pthread_t thread;
    if (site->context) {
        board_stop(site->room.board); // pages are told, and answer by closing
        if (pthread_create(&thread, NULL, stop_server, site) == 0) {
            while (!atomic_load(&site->stopped)) {
                knock(site);
                nanosleep(&(struct timespec){.tv_nsec = 20000000}, NULL);
            }
            pthread_join(thread, NULL);
        } else {
            mg_stop(site->context);
        }
        mg_exit_library();
    }
    for (int k = 0; k < site->textures; k++)
        free(site->texture[k].data);
    site->context = NULL;
    site->textures = 0;
}
