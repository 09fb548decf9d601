// pliant-web: shows a daemon's simulation on a page in a browser, and lets the mouse act on it. The
// main thread handles LCM; one thread answers browsers, two threads serve each page.
#include "arguments.h"
#include "client.h"
#include "feed.h"
#include "site.h"

#include <arpa/inet.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
    KEY_LISTEN = 0x600,
    KEY_PORT,
    KEY_TOKEN,
    KEY_HOST,
    KEY_READ_ONLY,
    KEY_PAGE,
    KEY_TEXTURE,
    KEY_INPUT_PREFIX
};

typedef struct Options {
    ClientOptions client;
    const char *listen, *token_file, *page, *input_prefix;
    long port;
    bool has_port;
    double rate_hz;
    Site *site;
} Options;

const char *argp_program_version = "pliant-web " PLIANT_VERSION; // argp prints it for --version

static const struct argp_option OPTIONS[] = {
    {0, 0, 0, 0, "Where to serve the page:", 1},
    {"port", KEY_PORT, "PORT", 0,
     "for this machine only: http://127.0.0.1:PORT (8080; 0: any free port)", 1},
    {"listen", KEY_LISTEN, "ADDRESS:PORT", 0,
     "instead: also for other machines, with a token (an address of this machine; 0.0.0.0: all)",
     1},
    {"token", KEY_TOKEN, "FILE", 0,
     "first line of FILE is the token (without it --listen makes a new one and prints it)", 1},
    {"host", KEY_HOST, "NAME", 0,
     "a name under which others reach this machine (default: only its addresses)", 1},
    {0, 0, 0, 0, "What to show:", 2},
    {"read-only", KEY_READ_ONLY, 0, 0, "pages only show: no tools, cuts or commands", 2},
    {"rate", 'r', "HZ", 0, "frames per second, at most (60)", 2},
    {"texture", KEY_TEXTURE, "BODY=IMAGE", 0, "a PNG or JPEG on the surface of a body", 2},
    {"input-prefix", KEY_INPUT_PREFIX, "NAME", 0,
     "prefix of tools and commands, if the scene has an input_prefix", 3},
    {"page", KEY_PAGE, "DIR", 0, "folder of the built page (./dev build builds it)", 2},
    {0},
};

// --- options ---

// Parses "ADDRESS:PORT" or "[ADDRESS]:PORT".
static bool parse_listen(const char *text, Site *site)
{
    const char *colon = strrchr(text, ':');
    long port;
    if (!colon || !client_parse_integer(colon + 1, 0, 65535, &port))
        return false;
    size_t length = (size_t)(colon - text);
    if (length >= 2 && text[0] == '[' && text[length - 1] == ']') {
        text++;
        length -= 2;
    }
    if (length == 0 || length >= sizeof site->address)
        return false;
    snprintf(site->address, sizeof site->address, "%.*s", (int)length, text);
    site->port = (int)port;
    unsigned char address[16];
    return inet_pton(AF_INET, site->address, address) == 1 ||
           inet_pton(AF_INET6, site->address, address) == 1;
}

static void take_host(struct argp_state *state, const char *name, Door *door)
{
    for (const char *c = name; *c; c++) {
        if (!client_name_valid((char[]){*c, '\0'}, 1) && *c != '.')
            argp_error(state, "--host '%s': expected a name, without a port", name);
    }
    if (strlen(name) >= sizeof door->host)
        argp_error(state, "--host: longer than %zu", sizeof door->host - 1);
    strcpy(door->host, name);
}

static error_t parse_option(int key, char *argument, struct argp_state *state)
{
    Options *options = state->input;
    Site *site = options->site;
    ClientError error;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = &options->client;
        return 0;
    case KEY_PORT:
        argument_integer(state, "port", argument, 0, 65535, &options->port);
        options->has_port = true;
        return 0;
    case KEY_LISTEN:
        options->listen = argument;
        if (!parse_listen(argument, site))
            argp_error(state, "--listen '%s': expected ADDRESS:PORT, the address in numbers",
                       argument);
        return 0;
    case KEY_TOKEN:
        options->token_file = argument;
        return 0;
    case KEY_HOST:
        take_host(state, argument, &site->door);
        return 0;
    case KEY_READ_ONLY:
        site->shared.hello.read_only = true;
        return 0;
    case 'r':
        argument_number(state, "rate", argument, 0.1, 1000.0, &options->rate_hz);
        return 0;
    case KEY_TEXTURE:
        if (!site_add_texture(site, argument, &error))
            argp_error(state, "%s", error.text);
        return 0;
    case KEY_INPUT_PREFIX:
        if (!client_name_valid(argument, CLIENT_PREFIX_MAX - 1))
            argp_error(state, "--input-prefix '%s': 1 to %d letters, digits, '_' or '-'", argument,
                       CLIENT_PREFIX_MAX - 1);
        options->input_prefix = argument;
        return 0;
    case KEY_PAGE:
        options->page = argument;
        return 0;
    case ARGP_KEY_END:
        if (options->listen && options->has_port)
            argp_error(state, "give either --port or --listen ADDRESS:PORT");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

// --- the page's folder ---

static bool has_page(const char *folder)
{
    char path[PATH_MAX];
    return snprintf(path, sizeof path, "%s/index.html", folder) < (int)sizeof path &&
           access(path, R_OK) == 0;
}

// Finds the page: the given one, else that of this program's build (its folder is
// FOLDER/release/bin), else the installed one; "" for none.
static bool find_page(const Options *options, Site *site, ClientError *error)
{
    static const char *const folders[] = {"../../web", "../web", "../share/pliant/web"};
    if (options->page) {
        if (!has_page(options->page))
            return client_fail(error, "--page %s: no index.html there", options->page);
        snprintf(site->folder, sizeof site->folder, "%s", options->page);
        return true;
    }
    char program[PATH_MAX];
    ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
    char *slash = NULL;
    if (length > 0) {
        program[length] = '\0';
        slash = strrchr(program, '/');
    }
    for (size_t k = 0; slash && k < sizeof folders / sizeof *folders; k++) {
        *slash = '\0';
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

static bool prepare(const Options *options, Site *site, ClientError *error)
{
    if (!options->listen) {
        strcpy(site->address, "127.0.0.1");
        site->port = (int)options->port;
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

static bool run(const Options *options, Client *client, Site *site, ClientError *error)
{
    static Board board;
    static Feed feed;
    static Requests requests;
    const char *names[SITE_TEXTURES];
    for (int k = 0; k < site->textures; k++)
        names[k] = site->texture[k].body;
    site->shared.client = client;
    site->shared.board = &board;
    site->shared.requests = &requests;
    site->shared.hello.prefix = client->prefix;
    site->shared.hello.rate_hz = options->rate_hz;
    site->shared.hello.texture = names;
    site->shared.hello.textures = site->textures;
    board_init(&board);
    requests_init(&requests, client, options->input_prefix);
    bool ok = feed_start(&feed, client, &board, &requests, error) && site_start(site, error);
    if (ok) {
        tell(site);
        feed_run(&feed);
    }
    site_stop(site); // pages withdraw their tools while LCM is still connected
    feed_stop(&feed);
    requests_destroy(&requests);
    board_destroy(&board);
    if (ok && client->broken)
        return client_fail(error, "the LCM connection failed");
    return ok;
}

int main(int argc, char **argv)
{
    static const struct argp_child children[] = {{&CLIENT_ARGP, 0, "Which daemon:", 3}, {0}};
    static const struct argp argp = {
        .options = OPTIONS,
        .parser = parse_option,
        .children = children,
        .doc =
            "Serves a page that shows the bodies of a running pliantd, live, and lets the mouse "
            "press, pull and cut them.\v"
            "The daemon may start earlier or later, and restart. Exit status: 0 ended by a signal, "
            "1 the network failed or the port is in use, 2 bad usage."};
    static Site site;
    static Client client;
    Options options = {.port = 8080, .rate_hz = 60.0, .site = &site};
    argp_err_exit_status = 2;
    argp_parse(&argp, argc, argv, 0, NULL, &options);
    client_catch_signals();

    ClientError error = {0};
    bool ok = prepare(&options, &site, &error) &&
              client_connect(&client, &options.client, &error) &&
              run(&options, &client, &site, &error);
    if (!ok)
        client_print_error("pliant-web", &error);
    client_disconnect(&client);
    return ok ? 0 : 1;
}
