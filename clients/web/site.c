// SPDX-License-Identifier: MIT
// The web server: libmicrohttpd in one thread, which accepts, reads and answers requests. A
// WebSocket gets threads of its own (page.c).
#include "site.h"
#include "websocket.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <microhttpd.h>

enum {
    TEXTURE_BYTES_MAX = 64 << 20,
    REQUEST_BYTES_MAX = 16384, // of a request, and of its answer's headers
    QUIET_S = 10,              // a visitor that neither sends nor receives is closed
    TURN_MS = 100,
    BACKLOG = 128,
};

static const int64_t UPLOAD_NS = 600000000000; // for one mesh

// Only our own files may be loaded, and no other site may embed the page. One request per
// connection.
static const char *const HEADERS[][2] = {
    {"Content-Security-Policy",
     "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' "
     "data: blob:; font-src 'self'; connect-src 'self'; worker-src 'self' blob:; base-uri 'none'; "
     "form-action 'none'; frame-ancestors 'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"X-Frame-Options", "DENY"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cache-Control", "no-cache"},
    {"Connection", "close"},
};

static const char NO_PAGE[] =
    "pliant-web is running, but the page is not built.\n"
    "\n"
    "Run ./dev build in the source folder (it needs node and npm), or give --page DIR.\n"
    "The WebSocket at /live works without it.\n";

typedef struct MHD_Connection Connection;
typedef struct MHD_Response Response;
typedef enum MHD_Result Result;

// --- answers ---

// `more`: NULL-terminated pairs of further headers, or NULL. Takes over the response; NULL: no
// memory.
static Result answer(Connection *connection, unsigned code, Response *response, const char *type,
                     const char *const *more)
{
    if (!response)
        return MHD_NO;
    bool ok = MHD_add_response_header(response, "Content-Type", type) == MHD_YES;
    for (size_t k = 0; k < sizeof HEADERS / sizeof *HEADERS; k++)
        ok = ok && MHD_add_response_header(response, HEADERS[k][0], HEADERS[k][1]) == MHD_YES;
    for (; more && *more; more += 2)
        ok = ok && MHD_add_response_header(response, more[0], more[1]) == MHD_YES;
    Result queued = ok ? MHD_queue_response(connection, code, response) : MHD_NO;
    MHD_destroy_response(response);
    return queued;
}

static Response *constant(const void *data, size_t size)
{
    return MHD_create_response_from_buffer(size, (void *)(uintptr_t)data, MHD_RESPMEM_PERSISTENT);
}

// `text` is constant.
static Result answer_text(Connection *connection, unsigned code, const char *const *more,
                          const char *text)
{
    return answer(connection, code, constant(text, strlen(text)), "text/plain; charset=utf-8",
                  more);
}

static Result not_found(Connection *connection)
{
    return answer_text(connection, 404, NULL, "no such file\n");
}

static const char *header(Connection *connection, const char *name)
{
    return MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name);
}

// --- files ---

// True for letters, digits and "._-" in names that do not begin with a dot.
static bool path_valid(const char *path)
{
    bool begins = true;
    for (const char *c = path; *c; c++) {
        if (!is_name_character(*c) && *c != '/' && (*c != '.' || begins))
            return false;
        begins = *c == '/';
    }
    return true;
}

static const char *type_of(const char *path)
{
    static const char *const types[][2] = {{".html", "text/html; charset=utf-8"},
                                           {".js", "text/javascript; charset=utf-8"},
                                           {".css", "text/css; charset=utf-8"},
                                           {".svg", "image/svg+xml"},
                                           {".png", "image/png"},
                                           {".jpg", "image/jpeg"},
                                           {".jpeg", "image/jpeg"},
                                           {".json", "application/json"},
                                           {".txt", "text/plain; charset=utf-8"}};
    const char *dot = strrchr(path, '.');
    for (size_t k = 0; dot && k < sizeof types / sizeof *types; k++) {
        if (strcmp(dot, types[k][0]) == 0)
            return types[k][1];
    }
    return "application/octet-stream";
}

static Result serve_file(const Site *site, Connection *connection, const char *uri)
{
    if (!site->root[0]) {
        if (strcmp(uri, "/") == 0)
            return answer_text(connection, 200, NULL, NO_PAGE);
        return not_found(connection);
    }
    char path[sizeof site->root + 512], real[PATH_MAX];
    const char *name = strcmp(uri, "/") == 0 ? "/index.html" : uri;
    size_t root = strlen(site->root);
    struct stat file;
    // A link must not lead out of the folder.
    if (strlen(name) > 500 || !path_valid(name) ||
        snprintf(path, sizeof path, "%s%s", site->root, name) < 0 || !realpath(path, real) ||
        strncmp(real, site->root, root) != 0 || real[root] != '/')
        return not_found(connection);
    int fd = open(real, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    bool plain = fd >= 0 && fstat(fd, &file) == 0 && S_ISREG(file.st_mode);
    Response *response =
        plain ? MHD_create_response_from_fd64((uint64_t)file.st_size, fd) : NULL; // closes fd
    if (!response && fd >= 0)
        close(fd);
    if (!plain)
        return not_found(connection);
    return answer(connection, 200, response, type_of(real), NULL);
}

static Result serve_texture(const Site *site, Connection *connection, const char *body)
{
    for (int k = 0; k < site->textures; k++) {
        const Texture *texture = &site->texture[k];
        if (strcmp(texture->body, body) == 0)
            return answer(connection, 200, constant(texture->data, texture->size), texture->type,
                          NULL);
    }
    return not_found(connection);
}

bool site_add_texture(Site *site, const char *argument, Status *why)
{
    const char *path = strchr(argument, '=');
    Texture *texture = &site->texture[site->textures];
    if (site->textures == SITE_TEXTURES)
        return status_fail(why, STATUS_INVALID, "is one more than %d", SITE_TEXTURES);
    if (!path || (size_t)(path - argument) >= sizeof texture->body)
        return status_fail(why, STATUS_INVALID, "is not BODY=IMAGE");
    snprintf(texture->body, sizeof texture->body, "%.*s", (int)(path - argument), argument);
    if (!argument_is_name(texture->body, ARGUMENT_NAME_MOST))
        return status_fail(why, STATUS_INVALID, "has no name of a body before '='");
    FILE *file = fopen(++path, "rbe");
    struct stat info;
    if (!file || fstat(fileno(file), &info) != 0) {
        status_fail(why, STATUS_INVALID, "cannot be read: %s", strerror(errno));
        if (file)
            fclose(file);
        return false;
    }
    // The content decides on the type, not the name.
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
        return status_fail(why, STATUS_INVALID, "is not a PNG or JPEG of at most %d MB",
                           TEXTURE_BYTES_MAX >> 20);
    }
    texture->data = data;
    texture->size = (size_t)info.st_size;
    site->textures++;
    return true;
}

// --- the workbench's files ---

static Result serve_recording(const Site *site, Connection *connection, const char *name)
{
    const Workbench *workbench = site->shared.workbench;
    char attachment[FOLDER_NAME_MAX + 32];
    struct stat file;
    int fd =
        workbench ? folder_read(&workbench->folder[ASK_RECORDINGS], name, FOLDER_RECORDINGS) : -1;
    if (fd < 0)
        return not_found(connection);
    Response *response = fstat(fd, &file) == 0
                             ? MHD_create_response_from_fd64((uint64_t)file.st_size, fd)
                             : NULL; // closes fd
    if (!response)
        close(fd);
    snprintf(attachment, sizeof attachment, "attachment; filename=\"%s\"", name);
    const char *const more[] = {"Content-Disposition", attachment, NULL};
    return answer(connection, 200, response, "application/octet-stream", more);
}

// Images beside scenes, which they name as textures.
static Result serve_image(const Site *site, Connection *connection, const char *name)
{
    const Workbench *workbench = site->shared.workbench;
    struct stat file;
    int fd = workbench ? folder_read(&workbench->folder[ASK_SCENES], name, FOLDER_IMAGES) : -1;
    if (fd < 0)
        return not_found(connection);
    const bool fits = fstat(fd, &file) == 0 && file.st_size <= TEXTURE_BYTES_MAX;
    Response *response =
        fits ? MHD_create_response_from_fd64((uint64_t)file.st_size, fd) : NULL; // closes fd
    if (!response)
        close(fd);
    return response ? answer(connection, 200, response, type_of(name), NULL)
                    : not_found(connection);
}

static void end_upload(Site *site)
{
    upload_drop(&site->upload.file);
    site->upload.visitor = NULL;
}

// Refuses a mesh: reads what is left of it, so that the page reads the answer.
static void refuse_upload(SiteUpload *upload)
{
    upload_drop(&upload->file);
    upload->refused = true;
}

// Refuses a mesh that has not begun. If it is of a size that may be sent, its answer follows when
// all of it has been read: a browser that is still sending would see a broken connection only.
static Result turn_away(Connection *connection, Visitor *visitor, long long bytes, int code,
                        const char *because)
{
    if (bytes < 0 || bytes > WORKBENCH_MESH_BYTES)
        return answer_text(connection, (unsigned)code, NULL, because);
    visitor->refusal = code;
    visitor->because = because;
    return MHD_YES;
}

// True while the mesh being received keeps others waiting: for at most UPLOAD_NS, and from the
// fifth second on only if it has come at 64 kB/s.
static bool upload_keeps_on(const SiteUpload *upload)
{
    enum { BYTES_A_MS = 64, SLOW_START_MS = 5000 };
    const int64_t ms = (client_now_ns() - upload->since_ns) / 1000000;
    return upload->visitor && ms < UPLOAD_NS / 1000000 &&
           upload->received >= (ms - SLOW_START_MS) * BYTES_A_MS;
}

// Makes an upload of it if the folder has place.
static bool take_place(SiteUpload *upload, const Folder *folder, const char *name, int64_t bytes)
{
    int meshes;
    if (folder_bytes(folder, FOLDER_MESHES, &meshes) + bytes > WORKBENCH_UPLOADS_BYTES ||
        meshes >= FOLDER_FILES_MAX)
        return client_fail(&upload->why, "the folder of meshes is full: remove some of them there");
    return upload_begin(&upload->file, folder, name ? name : "", bytes, &upload->why);
}

// A POST as its header has arrived: refuses it, or takes the visitor's mesh from now on.
static Result begin_upload(Site *site, Connection *connection, Visitor *visitor)
{
    const Workbench *workbench = site->shared.workbench;
    SiteUpload *upload = &site->upload;
    const char *type = header(connection, "Content-Type");
    const char *length = header(connection, "Content-Length");
    const char *name = MHD_lookup_connection_value(connection, MHD_GET_ARGUMENT_KIND, "name");
    long long bytes = -1;
    bool sized = length && argument_read_integer(length, 0, 1e15, &bytes);
    if (site->shared.hello.read_only)
        return turn_away(connection, visitor, bytes, 403, "this server only shows (--read-only)\n");
    if (!workbench)
        return turn_away(connection, visitor, bytes, 404,
                         "this server takes no meshes (--scenes)\n");
    // A type that no form can send, so that a page of another site has to ask before.
    if (!type || strcmp(type, "application/octet-stream") != 0)
        return turn_away(connection, visitor, bytes, 415, "send application/octet-stream\n");
    if (!sized)
        return turn_away(connection, visitor, bytes, 411, "say the Content-Length\n");
    if (bytes > WORKBENCH_MESH_BYTES)
        return turn_away(connection, visitor, bytes, 413, "larger than 256 MB\n");
    if (upload_keeps_on(upload))
        return turn_away(connection, visitor, bytes, 503,
                         "another mesh is being received: try again\n");
    end_upload(site);
    *upload = (SiteUpload){.visitor = visitor, .file.fd = -1, .since_ns = client_now_ns()};
    if (!take_place(upload, &workbench->folder[ASK_UPLOADS], name, bytes))
        refuse_upload(upload);
    return MHD_YES;
}

// Reads what was refused to its end, and says why.
static Result take_refused(Connection *connection, const Visitor *visitor, size_t *size)
{
    if (*size == 0)
        return answer_text(connection, (unsigned)visitor->refusal, NULL, visitor->because);
    *size = 0;
    return client_now_ns() < visitor->since_ns + UPLOAD_NS ? MHD_YES : MHD_NO;
}

static Result take_upload(Site *site, Connection *connection, const Visitor *visitor,
                          const char *data, size_t *size)
{
    SiteUpload *upload = &site->upload;
    if (visitor->refusal)
        return take_refused(connection, visitor, size);
    if (upload->visitor != visitor) // it was too slow, and another one came
        return MHD_NO;
    if (*size > 0) {
        upload->received += (int64_t)*size;
        if (!upload->refused && !upload_add(&upload->file, data, *size, &upload->why))
            refuse_upload(upload);
        *size = 0;
        return MHD_YES;
    }
    // All of it is there.
    char text[sizeof upload->why.text + 32];
    bool ok = !upload->refused && upload_finish(&upload->file, &upload->why);
    snprintf(text, sizeof text, "%s\n", ok ? upload->file.name : upload->why.text);
    end_upload(site);
    Response *response = MHD_create_response_from_buffer(strlen(text), text, MHD_RESPMEM_MUST_COPY);
    return answer(connection, ok ? 201 : 422, response, "text/plain; charset=utf-8", NULL);
}

// --- /live ---

// Ends a page, in its own thread.
static void on_page_end(void *user, void *connection)
{
    Site *site = user;
    MHD_upgrade_action(connection, MHD_UPGRADE_ACTION_CLOSE);
    pthread_mutex_lock(&site->lock);
    site->pages--;
    pthread_cond_broadcast(&site->page_ended);
    pthread_mutex_unlock(&site->lock);
}

static void on_upgrade(void *user, Connection *connection, void *visitor, const char *read,
                       size_t size, MHD_socket fd, struct MHD_UpgradeResponseHandle *upgraded)
{
    (void)connection;
    Site *site = user;
    int on = 1;
    ((Visitor *)visitor)->page = true;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
    pthread_mutex_lock(&site->lock);
    site->pages++;
    pthread_mutex_unlock(&site->lock);
    if (page_open(&site->shared, fd, read, size, (PageEnd){on_page_end, site, upgraded}))
        return;
    on_page_end(site, upgraded);
}

static Result serve_live(Site *site, Connection *connection)
{
    static const char *const wanted[] = {"Upgrade", "websocket", "Sec-WebSocket-Version", "13",
                                         NULL};
    char accept[WEBSOCKET_ANSWER];
    const char *upgrade = header(connection, "Upgrade");
    const char *version = header(connection, "Sec-WebSocket-Version");
    if (!upgrade || strcasecmp(upgrade, "websocket") != 0 || !version ||
        strcmp(version, "13") != 0 ||
        !websocket_answer(header(connection, "Sec-WebSocket-Key"), accept))
        return answer_text(connection, 426, wanted, "/live is a WebSocket\n");
    if (board_pages(site->shared.board) >= BOARD_PAGES) {
        board_stop_idle(site->shared.board, client_now_ns()); // for the next try
        return answer_text(connection, 503, NULL, "as many pages as there may be are open\n");
    }
    Response *response = MHD_create_response_for_upgrade(on_upgrade, site);
    if (!response)
        return MHD_NO;
    bool ok = MHD_add_response_header(response, "Upgrade", "websocket") == MHD_YES &&
              MHD_add_response_header(response, "Sec-WebSocket-Accept", accept) == MHD_YES;
    Result queued = ok ? MHD_queue_response(connection, 101, response) : MHD_NO;
    MHD_destroy_response(response);
    return queued;
}

// --- the door ---

static bool knows_token(const Door *door, Connection *connection, enum MHD_ValueKind kind,
                        const char *name)
{
    return door_admits(door, MHD_lookup_connection_value(connection, kind, name));
}

static Result admit(Site *site, Connection *connection, const char *uri)
{
    if (strcmp(uri, "/live") == 0)
        return serve_live(site, connection);
    if (strncmp(uri, "/texture/", 9) == 0)
        return serve_texture(site, connection, uri + 9);
    if (strncmp(uri, "/images/", 8) == 0)
        return serve_image(site, connection, uri + 8);
    if (strncmp(uri, "/recordings/", 12) == 0)
        return serve_recording(site, connection, uri + 12);
    return serve_file(site, connection, uri);
}

static Result ask_for_token(Site *site, Connection *connection, const char *uri)
{
    const Door *door = &site->door;
    if (!knows_token(door, connection, MHD_GET_ARGUMENT_KIND, "token"))
        return answer_text(connection, 403, NULL,
                           "open the page by the address with its token that pliant-web printed\n");
    if (strcmp(uri, "/") != 0)
        return admit(site, connection, uri);
    // The browser sends it as a cookie from now on, so that it is in no history and on no screen.
    char cookie[TOKEN_MAX + 128];
    snprintf(cookie, sizeof cookie, "%s=%s; Path=/; HttpOnly; SameSite=Strict", door->cookie,
             door->token);
    const char *const more[] = {"Set-Cookie", cookie, "Location", "/", NULL};
    return answer_text(connection, 303, more, "");
}

// libmicrohttpd's callback: called when the header has arrived, and again for the whole request.
static Result on_request(void *user, Connection *connection, const char *uri, const char *method,
                         const char *version, const char *data, size_t *size, void **visitor)
{
    (void)version;
    Site *site = user;
    static const char *const allowed[] = {"Allow", "GET", NULL};
    const bool mesh = strcmp(uri, "/mesh") == 0, post = strcmp(method, "POST") == 0;
    const char *host = header(connection, "Host");
    if (!door_admits_host(&site->door, host))
        return answer_text(connection, 403, NULL,
                           "this server is not known by that name (see --host)\n");
    if (mesh != post || (!post && strcmp(method, "GET") != 0))
        return answer_text(connection, 405, allowed, mesh ? "use POST for /mesh\n" : "use GET\n");
    if (!door_admits_origin(&site->door, header(connection, "Origin"), host))
        return answer_text(connection, 403, NULL,
                           "pages of other sites stay outside (behind a proxy: --host NAME)\n");
    if (!*visitor) {
        const union MHD_ConnectionInfo *info =
            MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
        *visitor = info->socket_context;
        if (!*visitor)
            return MHD_NO;
        ((Visitor *)*visitor)->asked = true;
        if (!post)
            return MHD_YES;
        if (site->door.token[0] &&
            !knows_token(&site->door, connection, MHD_COOKIE_KIND, site->door.cookie) &&
            !knows_token(&site->door, connection, MHD_GET_ARGUMENT_KIND, "token"))
            return ask_for_token(site, connection, uri);
        return begin_upload(site, connection, *visitor);
    }
    if (post)
        return take_upload(site, connection, *visitor, data, size);
    if (*size > 0) { // ignore the body of a GET
        *size = 0;
        return MHD_YES;
    }
    if (site->door.token[0] &&
        !knows_token(&site->door, connection, MHD_COOKIE_KIND, site->door.cookie))
        return ask_for_token(site, connection, uri);
    return admit(site, connection, uri);
}

static void on_connection(void *user, Connection *connection, void **visitor,
                          enum MHD_ConnectionNotificationCode what)
{
    Site *site = user;
    if (what == MHD_CONNECTION_NOTIFY_CLOSED) {
        if (*visitor && site->upload.visitor == *visitor)
            end_upload(site);
        if (*visitor)
            visitors_remove(*visitor);
        return;
    }
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    int fd = info->connect_fd;
    info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    *visitor = visitors_add(&site->visitors, fd, info->client_addr, client_now_ns());
}

// --- begin and end ---

// Opens a listening socket and sets the port.
static int open_port(Site *site, PliantError *error)
{
    struct sockaddr_in v4 = {.sin_family = AF_INET, .sin_port = htons((uint16_t)site->port)};
    struct sockaddr_in6 v6 = {.sin6_family = AF_INET6, .sin6_port = htons((uint16_t)site->port)};
    bool six = inet_pton(AF_INET6, site->address, &v6.sin6_addr) == 1;
    struct sockaddr *address = six ? (struct sockaddr *)&v6 : (struct sockaddr *)&v4;
    socklen_t size = six ? sizeof v6 : sizeof v4;
    if (!six && inet_pton(AF_INET, site->address, &v4.sin_addr) != 1) {
        client_fail(error, "--listen: '%s' is not a numeric address", site->address);
        return -1;
    }
    int fd = socket(six ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    int on = 1;
    if (fd < 0) {
        client_fail(error, "no socket: %s", strerror(errno));
        return -1;
    }
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (bind(fd, address, size) == 0 && listen(fd, BACKLOG) == 0 &&
        getsockname(fd, address, &size) == 0) {
        site->port = ntohs(six ? v6.sin6_port : v4.sin_port);
        return fd;
    }
    int why = errno;
    close(fd);
    if (why == EADDRINUSE)
        client_fail(error,
                    "port %d of %s is in use: choose another with --port, or end the program that "
                    "uses it (ss -ltnp 'sport = :%d' shows which)",
                    site->port, site->address, site->port);
    else
        client_fail(error, "cannot listen on port %d of %s: %s%s", site->port, site->address,
                    strerror(why), why == EACCES ? " (ports below 1024 are root's)" : "");
    return -1;
}

static void *serve(void *user)
{
    Site *site = user;
    while (!atomic_load(&site->stopping) && MHD_run_wait(site->server, TURN_MS) == MHD_YES)
        visitors_sweep(&site->visitors, client_now_ns());
    return NULL;
}

bool site_start(Site *site, PliantError *error)
{
    if (site->folder[0] && !realpath(site->folder, site->root))
        return client_fail(error, "--page %s: %s", site->folder, strerror(errno));
    int fd = open_port(site, error);
    if (fd < 0)
        return false;
    site->upload.file.fd = -1;
    snprintf(site->door.cookie, sizeof site->door.cookie, "pliant_token_%d", site->port);
    visitors_init(&site->visitors);
    pthread_mutex_init(&site->lock, NULL);
    pthread_cond_init(&site->page_ended, NULL);
    unsigned six = strchr(site->address, ':') ? MHD_USE_IPv6 : 0;
    site->server = MHD_start_daemon(
        MHD_USE_EPOLL | MHD_ALLOW_UPGRADE | MHD_USE_ITC | six, 0, NULL, NULL, on_request, site,
        MHD_OPTION_LISTEN_SOCKET, fd, MHD_OPTION_NOTIFY_CONNECTION, on_connection, site,
        MHD_OPTION_CONNECTION_LIMIT, (unsigned)VISITORS_MAX, MHD_OPTION_CONNECTION_TIMEOUT,
        (unsigned)QUIET_S, MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)REQUEST_BYTES_MAX,
        MHD_OPTION_END);
    if (!site->server)
        close(fd);
    site->serving = site->server && pthread_create(&site->thread, NULL, serve, site) == 0;
    if (!site->serving)
        return client_fail(error, "the web server does not start on port %d of %s", site->port,
                           site->address);
    return true;
}

void site_stop(Site *site)
{
    if (site->serving) {
        board_stop(site->shared.board); // pages are informed and end within a second
        pthread_mutex_lock(&site->lock);
        while (site->pages > 0)
            pthread_cond_wait(&site->page_ended, &site->lock);
        pthread_mutex_unlock(&site->lock);
        atomic_store(&site->stopping, true);
        pthread_join(site->thread, NULL);
    }
    if (site->server)
        MHD_stop_daemon(site->server); // closes all connections
    for (int k = 0; k < site->textures; k++)
        free(site->texture[k].data);
    site->server = NULL;
    site->serving = false;
    site->textures = 0;
}
