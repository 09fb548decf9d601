// The table of connections.
#include "visitors.h"

#include <netinet/in.h>
#include <string.h>

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
