#include "run/lcm_url.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

// "239.255.76.67:7667?ttl=0", each part optional; the defaults are LCM's.
static bool parse_group(const char *text, struct sockaddr_in *group)
{
    *group = (struct sockaddr_in){.sin_family = AF_INET, .sin_port = htons(7667)};
    group->sin_addr.s_addr = inet_addr("239.255.76.67");
    size_t length = strcspn(text, "?");
    if (length == 0)
        return true;
    char address[64];
    if (length >= sizeof address)
        return false;
    memcpy(address, text, length);
    address[length] = '\0';
    char *colon = strchr(address, ':');
    if (colon != NULL) {
        char *end;
        long port = strtol(colon + 1, &end, 10);
        if (end == colon + 1 || *end != '\0' || port < 1 || port > 65535)
            return false;
        group->sin_port = htons((uint16_t)port);
        *colon = '\0';
    }
    return inet_aton(address, &group->sin_addr) != 0 && IN_MULTICAST(ntohl(group->sin_addr.s_addr));
}

// Connecting a datagram socket sends nothing, but needs a route.
static bool has_route(const struct sockaddr_in *group)
{
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0)
        return true; // not ours to judge; LCM will fail
    bool routed = connect(fd, (const struct sockaddr *)group, sizeof *group) == 0;
    close(fd);
    return routed;
}

bool lcm_url_check(const char *url, Status *status)
{
    if (url == NULL)
        url = getenv("LCM_DEFAULT_URL");
    if (url == NULL || url[0] == '\0')
        url = "udpm://";
    if (strncmp(url, "memq://", 7) == 0 || strncmp(url, "tcpq://", 7) == 0)
        return true;
    struct sockaddr_in group;
    if (strncmp(url, "udpm://", 7) != 0 || !parse_group(url + 7, &group))
        return status_fail(status, STATUS_INVALID,
                           "LCM URL '%.200s' is not udpm://GROUP:PORT?ttl=N with a multicast "
                           "group, tcpq://HOST:PORT or memq://",
                           url);
    if (!has_route(&group))
        return status_fail(status, STATUS_FAILED,
                           "no route for multicast to %s; for messages on this machine only: "
                           "ip link set lo up; ip route add 224.0.0.0/4 dev lo "
                           "(or another --lcm-url: tcpq://HOST:PORT)",
                           inet_ntoa(group.sin_addr));
    return true;
}
