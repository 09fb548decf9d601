// SPDX-License-Identifier: MIT
// pliant-web: shows a daemon's simulation on a page in a browser, and lets the mouse act on it. The
// main thread handles LCM; one thread answers browsers, two threads serve each page.
#include "client.h"
#include "program.h"
#include "feed.h"
#include "site.h"

#include <arpa/inet.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct Options {
    PliantOptions client;
    const char *listen, *token_file, *page, *input_prefix;
    int port; // negative: not given
    bool read_only;
    double rate_hz;
    WorkbenchOptions workbench;
    Site *site;
} Options;

// --- options ---

// Parses "ADDRESS:PORT" or "[ADDRESS]:PORT".
static bool parse_listen(const char *text, Site *site)
{
    const char *colon = strrchr(text, ':');
    long long port;
    if (!colon || !argument_read_integer(colon + 1, 0, 65535, &port))
        return false;
    size_t length = (size_t)(colon - text);
    // An IPv6 address has brackets.
    if (length >= 2 && text[0] == '[' && text[length - 1] == ']') {
        text++;
        length -= 2;
    }
    if (length == 0 || length >= sizeof site->address)
        return false;
    snprintf(site->address, sizeof site->address, "%.*s", (int)length, text);
    site->port = (int)port;
    // Numbers only: names may lead elsewhere.
    unsigned char address[16];
    return inet_pton(AF_INET, site->address, address) == 1 ||
           inet_pton(AF_INET6, site->address, address) == 1;
}

static bool take_listen(void *target, const char *text, Status *why)
{
    return parse_listen(text, ((Options *)target)->site) ||
           status_fail(why, STATUS_INVALID, "is not ADDRESS:PORT, the address in numbers");
}

static bool take_host(void *target, const char *name, Status *why)
{
    Door *door = &((Options *)target)->site->door;
    for (const char *c = name; *c; c++) {
        if (!is_name_character(*c) && *c != '.')
            return status_fail(why, STATUS_INVALID, "is not a name, without a port");
    }
    if (strlen(name) >= sizeof door->host)
        return status_fail(why, STATUS_INVALID, "is longer than %zu", sizeof door->host - 1);
    strcpy(door->host, name);
    return true;
}

static bool take_texture(void *target, const char *text, Status *why)
{
    return site_add_texture(((Options *)target)->site, text, why);
}

#define AT(member) offsetof(Options, member)

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_HEADING, .help = "Where to serve the page:"},
    {"port", 0, ARGUMENT_INTEGER, "PORT", AT(port), 0, 65535, .preset = -1,
     .help = "for this machine only: http://127.0.0.1:PORT (default: 8080; 0: any free port)"},
    {"listen", 0, ARGUMENT_TEXT, "ADDRESS:PORT", AT(listen), .handler = take_listen,
     .help = "instead: also for other machines, with a token (an address of this machine; 0.0.0.0: "
             "all)"},
    {"token", 0, ARGUMENT_TEXT, "FILE", AT(token_file),
     .help = "first line of FILE is the token (without it --listen makes a new one and prints it)"},
    {"host", 0, ARGUMENT_OTHER, "NAME", .handler = take_host,
     .help = "a name under which others reach this machine (default: only its addresses)"},
    {.type = ARGUMENT_HEADING, .help = "What to show:"},
    {"read-only", 0, ARGUMENT_FLAG, NULL, AT(read_only),
     .help = "pages only show: no tools, cuts, commands or workbench"},
    {"rate", 'r', ARGUMENT_NUMBER, "HZ", AT(rate_hz), 0.1, 1000.0, .preset = 60.0,
     .help = "frames per second, at most"},
    {"texture", 0, ARGUMENT_OTHER, "BODY=IMAGE", .handler = take_texture,
     .help = "a PNG or JPEG on the surface of a body"},
    {"page", 0, ARGUMENT_TEXT, "DIR", AT(page),
     .help = "folder of the built page (./dev build builds it)"},
    {.type = ARGUMENT_HEADING, .help = "A workbench, that starts programs for pages:"},
    {"scenes", 0, ARGUMENT_TEXT, "DIR", AT(workbench.scenes),
     .help =
         "pages start and end pliantd with the scenes (*.cfg) of DIR, propose scenes for meshes "
         "that are dropped on them, and record; nothing else is started"},
    {"uploads", 0, ARGUMENT_TEXT, "DIR", AT(workbench.uploads),
     .help = "where those meshes and their scenes go (default: uploads in the folder of scenes)"},
    {"recordings", 0, ARGUMENT_TEXT, "DIR", AT(workbench.recordings),
     .help = "where recordings go (default: recordings in the folder of scenes)"},
    {"pliantd", 0, ARGUMENT_TEXT, "PATH", AT(workbench.pliantd),
     .help = "the pliantd to start (default: the one beside this program)"},
    {.type = ARGUMENT_HEADING, .help = "Which daemon:"},
    {.type = ARGUMENT_ROWS, .rows = PROGRAM_WHERE, .offset = AT(client)},
    {.type = ARGUMENT_ROWS, .rows = PROGRAM_INPUT_PREFIX, .offset = AT(input_prefix)},
    {0}};

static bool check(void *target, Status *why)
{
    Options *options = target;
    if (options->listen && options->port >= 0)
        return status_fail(why, STATUS_INVALID, "give either --port or --listen ADDRESS:PORT");
    const WorkbenchOptions *workbench = &options->workbench;
    if (!workbench->scenes && (workbench->uploads || workbench->recordings || workbench->pliantd))
        return status_fail(why, STATUS_INVALID,
                           "--uploads, --recordings and --pliantd go with --scenes DIR");
    if (options->port < 0)
        options->port = 8080;
    options->site->shared.hello.read_only = options->read_only;
    return true;
}

static const ArgumentTable TABLE = {
    .program = "pliant-web",
    .about = "Serves a page that shows the bodies of a running pliantd, live, and lets the mouse "
             "press, pull and cut them.",
    .end = "The daemon may start earlier or later, and restart. Exit status: 0 ended by a signal, "
           "1 the network failed or the port is in use, 2 bad usage.",
    .rows = ROWS,
    .check = check};

// --- the page's folder ---

static bool has_page(const char *folder)
{
    char path[PATH_MAX];
    return snprintf(path, sizeof path, "%s/index.html", folder) < (int)sizeof path &&
           access(path, R_OK) == 0;
}

// Finds the page: the given one, else that of this program's build (its folder is
// FOLDER/release/bin), else the installed one; "" for none.
static bool find_page(const Options *options, Site *site, PliantError *error)
{
    static const char *const folders[] = {"../../web", "../web", "../share/pliant/web"};
    // The folder that was given must be right.
    if (options->page) {
        if (!has_page(options->page))
            return client_fail(error, "--page %s: no index.html there", options->page);
        snprintf(site->folder, sizeof site->folder, "%s", options->page);
        return true;
    }
    // Else where builds and packages have it, seen from the program.
    char program[FOLDER_PATH_MAX];
    bool known = folder_of_program(program);
    for (size_t k = 0; known && k < sizeof folders / sizeof *folders; k++) {
        char path[sizeof site->folder];
        if (snprintf(path, sizeof path, "%s/%s", program, folders[k]) < (int)sizeof path &&
            has_page(path)) {
            strcpy(site->folder, path);
            return true;
        }
    }
    site->folder[0] = '\0';
    return true;
}

// --- running ---

static bool is_loopback(const char *address)
{
    struct in_addr v4;
    if (inet_pton(AF_INET, address, &v4) == 1)
        return ntohl(v4.s_addr) >> 24 == 127;
    return strcmp(address, "::1") == 0;
}

static bool prepare(const Options *options, Site *site, PliantError *error)
{
    if (!options->listen) {
        strcpy(site->address, "127.0.0.1");
        site->port = options->port;
    }
    if (options->token_file && !door_read_token(&site->door, options->token_file, error))
        return false;
    if (!options->token_file && !is_loopback(site->address) && !door_draw_token(&site->door, error))
        return false;
    return find_page(options, site, error);
}

static void tell(const Site *site)
{
    const char *address = site->address;
    if (strcmp(address, "0.0.0.0") == 0 || strcmp(address, "::") == 0)
        address = site->door.host[0] ? site->door.host : "ADDRESS-OF-THIS-MACHINE";
    bool six = strchr(address, ':') != NULL;
    printf("page: http://%s%s%s:%d/%s%s\n", six ? "[" : "", address, six ? "]" : "", site->port,
           site->door.token[0] ? "?token=" : "", site->door.token);
    if (!site->folder[0])
        printf("the page is not built: run ./dev build, or give --page DIR\n");
    if (site->shared.hello.read_only)
        printf("read-only: pages only show\n");
    fflush(stdout);
}

// Opens the workbench, if there is one: not for pages that only show.
static bool open_workbench(const Options *options, const Client *client, Site *site, Board *board,
                           PliantError *error)
{
    static Workbench workbench;
    WorkbenchOptions wanted = options->workbench;
    if (!wanted.scenes || options->read_only)
        return true;
    wanted.url = options->client.url;
    wanted.prefix = client->prefix;
    wanted.input_prefix = options->input_prefix;
    site->shared.workbench = &workbench;
    return workbench_open(&workbench, &wanted, board, error);
}

static bool run(const Options *options, Client *client, Site *site, PliantError *error)
{
    static Board board;
    static Feed feed;
    static Requests requests;
    const char *names[SITE_TEXTURES];
    // What pages share.
    for (int k = 0; k < site->textures; k++)
        names[k] = site->texture[k].body;
    site->shared.client = client;
    site->shared.board = &board;
    site->shared.requests = &requests;
    site->shared.hello.prefix = client->prefix;
    site->shared.hello.rate_hz = options->rate_hz;
    site->shared.hello.texture = names;
    site->shared.hello.textures = site->textures;
    // The network first, then the server: pages may then ask at once.
    board_init(&board);
    requests_init(&requests, client, options->input_prefix);
    bool ok = open_workbench(options, client, site, &board, error) &&
              feed_start(&feed, client, &board, &requests, error) && site_start(site, error);
    feed.workbench = site->shared.workbench;
    if (ok) {
        tell(site);
        feed_run(&feed);
    }
    site_stop(site); // pages withdraw their tools while LCM is still connected
    if (site->shared.workbench)
        workbench_close(site->shared.workbench);
    feed_stop(&feed);
    requests_destroy(&requests);
    board_destroy(&board);
    if (ok && client->broken)
        return client_fail(error, "the LCM connection failed");
    return ok;
}

int main(int argc, char **argv)
{
    static Site site;
    static Client client;
    Options options = {.site = &site};
    Status status = {0};
    if (!arguments_parse(&TABLE, argc, argv, &options, &status))
        return arguments_exit(&status);
    program_catch_signals();

    PliantError error = {0};
    bool ok = prepare(&options, &site, &error) &&
              program_await_network(options.client.url, &error) &&
              client_connect(&client, &options.client, &error) &&
              program_stops(client_stop, &client) && run(&options, &client, &site, &error);
    if (!ok)
        program_print_error("pliant-web", &error);
    client_disconnect(&client);
    return ok ? 0 : 1;
}
