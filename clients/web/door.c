// SPDX-License-Identifier: MIT
// Who is let in.
#include "door.h"

#include "base/arguments.h"

#include <arpa/inet.h>
#include <ctype.h>
#include <errno.h>
#include <netinet/in.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>

// --- access: pure functions, any thread ----------------------------------------------------------

// --- the token ---

bool door_draw_token(Door *door, PliantError *error)
{
    unsigned char random[16];
    if (getrandom(random, sizeof random, 0) != sizeof random)
        return client_fail(error, "the kernel gives no random numbers for a token");
    for (size_t k = 0; k < sizeof random; k++)
        snprintf(door->token + 2 * k, 3, "%02x", random[k]);
    return true;
}

bool door_read_token(Door *door, const char *path, PliantError *error)
{
    FILE *file = fopen(path, "re");
    if (!file)
        return client_fail(error, "--token %s: %s", path, strerror(errno));
    char line[TOKEN_MAX + 3] = "";
    bool read = fgets(line, sizeof line, file) != NULL;
    fclose(file);
    line[strcspn(line, "\r\n")] = '\0';
    if (!read || strlen(line) < TOKEN_MIN || !argument_is_name(line, TOKEN_MAX))
        return client_fail(
            error, "--token %s: expected %d to %d letters, digits, '-' or '_' in its first line",
            path, TOKEN_MIN, TOKEN_MAX);
    strcpy(door->token, line);
    return true;
}

bool door_admits(const Door *door, const char *given)
{
    size_t length = strlen(door->token);
    if (!given || length == 0 || strlen(given) != length)
        return false;
    // Compare in constant time, which does not show how much of it is right.
    unsigned different = 0;
    for (size_t k = 0; k < length; k++)
        different |= (unsigned)(unsigned char)door->token[k] ^ (unsigned)(unsigned char)given[k];
    return different == 0;
}

// --- names ---

static bool port_valid(const char *text)
{
    long long port;
    return isdigit((unsigned char)text[0]) && argument_read_integer(text, 1, 65535, &port);
}

bool door_admits_host(const Door *door, const char *host)
{
    char name[256];
    if (!host || strlen(host) >= sizeof name)
        return false;
    // Split the name from the port; an IPv6 address has brackets.
    strcpy(name, host);
    char *end; // end of the name
    bool bracketed = name[0] == '[';
    if (bracketed) {
        end = strchr(name, ']');
        if (!end)
            return false;
        *end++ = '\0';
    } else {
        end = name + strcspn(name, ":");
    }
    if (*end != '\0') {
        if (*end != ':' || !port_valid(end + 1))
            return false;
        *end = '\0';
    }
    // The owner of a name can point it anywhere; a numeric address is safe.
    unsigned char address[16];
    if (bracketed)
        return inet_pton(AF_INET6, name + 1, address) == 1;
    return inet_pton(AF_INET, name, address) == 1 || strcasecmp(name, "localhost") == 0 ||
           (door->host[0] && strcasecmp(name, door->host) == 0);
}

bool door_admits_origin(const Door *door, const char *origin, const char *host)
{
    if (!origin)
        return true;
    const size_t scheme = strncasecmp(origin, "http://", 7) == 0    ? 7
                          : strncasecmp(origin, "https://", 8) == 0 ? 8
                                                                    : 0;
    if (!host || scheme == 0)
        return false;
    const char *site = origin + scheme, *colon = strchr(site, ':');
    if (strcasecmp(site, host) == 0)
        return true;
    // A proxy may ask under another name, or an address, than the page has.
    const size_t name = strlen(door->host);
    return name > 0 && strncasecmp(site, door->host, name) == 0 &&
           (site[name] == '\0' || (colon == site + name && port_valid(colon + 1)));
}

// --- the table of connections --------------------------------------------------------------------

const int64_t VISITORS_HEADER_NS = 5000000000;

void visitors_init(Visitors *visitors)
{
    for (int k = 0; k < VISITORS_MAX; k++)
        visitors->visitor[k] = (Visitor){.fd = -1};
}

static bool counts(const Visitor *visitor)
{
    return visitor->fd >= 0 && !visitor->page && !visitor->shut;
}

static void shut_down(Visitor *visitor)
{
    visitor->shut = true;
    shutdown(visitor->fd, SHUT_RDWR); // the web server closes it
}

static int count_from(const Visitors *visitors, const unsigned char address[16])
{
    int count = 0;
    for (int k = 0; k < VISITORS_MAX; k++) {
        const Visitor *visitor = &visitors->visitor[k];
        count += counts(visitor) && memcmp(visitor->address, address, 16) == 0;
    }
    return count;
}

// Returns the oldest connection of the address that has the most.
static Visitor *find_surplus(Visitors *visitors)
{
    Visitor *found = NULL;
    int most = 0;
    for (int k = 0; k < VISITORS_MAX; k++) {
        Visitor *visitor = &visitors->visitor[k];
        if (!counts(visitor))
            continue;
        int count = count_from(visitors, visitor->address);
        if (count > most || (count == most && visitor->since_ns < found->since_ns)) {
            most = count;
            found = visitor;
        }
    }
    return found;
}

static void read_address(const struct sockaddr *from, unsigned char address[16])
{
    memset(address, 0, 16);
    if (from && from->sa_family == AF_INET)
        memcpy(address + 12, &((const struct sockaddr_in *)(const void *)from)->sin_addr, 4);
    else if (from && from->sa_family == AF_INET6)
        memcpy(address, &((const struct sockaddr_in6 *)(const void *)from)->sin6_addr, 16);
}

Visitor *visitors_add(Visitors *visitors, int fd, const struct sockaddr *address, int64_t now_ns)
{
    Visitor *added = NULL;
    int count = 0;
    for (int k = 0; k < VISITORS_MAX; k++) {
        Visitor *visitor = &visitors->visitor[k];
        count += counts(visitor);
        if (visitor->fd < 0)
            added = visitor;
    }
    if (!added)
        return NULL;
    *added = (Visitor){.fd = fd, .since_ns = now_ns};
    read_address(address, added->address);
    if (count >= VISITORS_KEPT)
        shut_down(find_surplus(visitors));
    return added;
}

void visitors_remove(Visitor *visitor)
{
    *visitor = (Visitor){.fd = -1};
}

void visitors_sweep(Visitors *visitors, int64_t now_ns)
{
    for (int k = 0; k < VISITORS_MAX; k++) {
        Visitor *visitor = &visitors->visitor[k];
        if (counts(visitor) && !visitor->asked && now_ns - visitor->since_ns > VISITORS_HEADER_NS)
            shut_down(visitor);
    }
}
