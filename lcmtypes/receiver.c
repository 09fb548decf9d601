// SPDX-License-Identifier: MIT
#include "receiver.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <net/if.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define DEFAULT_URL  "udpm://239.255.76.67:7667?ttl=0"
#define TEST_CHANNEL "LCM_SELF_TEST" // liblcm's, which log tools recognise

enum {
    PACKET_MAX = 65536, // more than any UDP packet
    MAGIC_SHORT = 0x4c433032,
    MAGIC_LONG = 0x4c433033,
    SHORT_HEADER = 8, // magic, sequence
    LONG_HEADER = 20, // magic, sequence, size, offset, number of the fragment, how many there are
    ADDRESSES = 128,  // of this host
    TEST_MS = 2000,
    TEST_AGAIN_MS = 100,
};

struct ReceiverSubscription {
    ReceiverSubscription *next;
    lcm_subscription_t *liblcm; // of URLs other than udpm
    char channel[RECEIVER_CHANNEL_MAX + 1];
    bool pattern; // `channel` is followed by one or more characters
    lcm_msg_handler_t handler;
    void *user;
};

struct Receiver {
    lcm_t *lcm;
    int socket; // -1: liblcm receives
    ReceiverOptions options;
    ReceiverSubscription *first;
    struct in_addr own[ADDRESSES]; // this host's
    int own_count;
    bool local_group; // 224.0.0.x
    Network network;
    bool unrouted;              // at the last look there was no route to the group
    int64_t looked_ns, lost_ns; // the last look; when the route was lost
    int64_t own_read_ns;
    char packet[PACKET_MAX];
};

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static bool fail(char *why, const char *sentence, const char *argument)
{
    snprintf(why, RECEIVER_WHY_MAX, sentence, argument);
    return false;
}

// --- URLs ---

// Reads "239.255.76.67:7667"; nothing means LCM's.
static bool read_group(const char *text, size_t length, Network *network)
{
    char address[32];
    network->group = 0xefff4c43; // 239.255.76.67
    network->port = 7667;
    if (length == 0)
        return true;
    if (length >= sizeof address)
        return false;
    memcpy(address, text, length);
    address[length] = '\0';
    char *colon = strchr(address, ':');
    if (colon == NULL)
        return false; // liblcm would take port 0
    char *end;
    long port = strtol(colon + 1, &end, 10);
    if (end == colon + 1 || *end != '\0' || port < 1 || port > 65535)
        return false;
    *colon = '\0';
    struct in_addr group;
    if (inet_pton(AF_INET, address, &group) != 1)
        return false;
    network->group = ntohl(group.s_addr);
    network->port = (uint16_t)port;
    return IN_MULTICAST(network->group);
}

static struct sockaddr_in group_address(const Network *network)
{
    return (struct sockaddr_in){.sin_family = AF_INET,
                                .sin_addr.s_addr = htonl(network->group),
                                .sin_port = htons(network->port)};
}

// Finds the value of an option, NULL without; like liblcm, takes the last of several.
static const char *find_option(const char *options, const char *name)
{
    const char *value = NULL;
    size_t length = strlen(name);
    for (const char *at = options; at != NULL; at = strchr(at, '&')) {
        at += *at == '&' || *at == '?';
        if (strncmp(at, name, length) == 0 && at[length] == '=')
            value = at + length + 1;
    }
    return value;
}

static int read_option(const char *options, const char *name, long low, long high)
{
    const char *text = find_option(options, name);
    long value = text != NULL ? strtol(text, NULL, 0) : 0;
    return (int)(value < low ? low : value > high ? high : value);
}

static bool read_interface(const char *options, Network *network)
{
    const char *text = find_option(options, "interface");
    const size_t length = text != NULL ? strcspn(text, "&") : 0;
    if (length >= sizeof network->interface)
        return false;
    memcpy(network->interface, text != NULL ? text : "", length);
    return text == NULL || length > 0;
}

bool network_read(Network *network, const char *url, char *why)
{
    *network = (Network){.sender = -1};
    if (url == NULL || url[0] == '\0')
        url = getenv("LCM_DEFAULT_URL");
    if (url == NULL || url[0] == '\0')
        url = DEFAULT_URL;
    if (strlen(url) >= sizeof network->url)
        return fail(why, "LCM URL '%.60s...' is longer than 255 characters", url);
    strcpy(network->url, url);
    static const char *const OTHERS[] = {"memq://", "tcpq://", "file://"};
    for (size_t i = 0; i < sizeof OTHERS / sizeof *OTHERS; i++)
        if (strncmp(url, OTHERS[i], strlen(OTHERS[i])) == 0)
            return true;
    network->udpm = strncmp(url, "udpm://", 7) == 0;
    const char *text = url + strlen("udpm://");
    if (!network->udpm || !read_group(text, strcspn(text, "?"), network))
        return fail(why,
                    "LCM URL '%.255s' is not udpm://GROUP:PORT?ttl=N with a multicast group "
                    "(224.0.0.0 to 239.255.255.255) and a port in [1, 65535], tcpq://HOST:PORT or "
                    "memq://",
                    url);
    network->ttl = read_option(strchr(text, '?'), "ttl", 0, 255);
    network->receive_bytes = read_option(strchr(text, '?'), "recv_buf_size", 0, INT32_MAX);
    return read_interface(strchr(text, '?'), network) ||
           fail(why, "LCM URL '%.255s': interface is a name or an address of this machine", url);
}

// Connects a datagram socket, which sends nothing but needs a route.
static bool reaches(int fd, const Network *network)
{
    const struct sockaddr_in group = group_address(network);
    return connect(fd, (const struct sockaddr *)&group, sizeof group) == 0;
}

// The group on the interface of the URL, or of the route; on none, which the kernel refuses, while
// there is no such interface.
static struct ip_mreqn membership(const Network *network)
{
    struct ip_mreqn group = {.imr_multiaddr = group_address(network).sin_addr};
    if (network->interface[0] == '\0' ||
        inet_pton(AF_INET, network->interface, &group.imr_address) == 1)
        return group;
    const unsigned index = if_nametoindex(network->interface);
    group.imr_ifindex = index > 0 ? (int)index : -1;
    return group;
}

// Has a socket send over the interface of the URL.
static bool aim(int fd, const Network *network)
{
    const struct ip_mreqn group = membership(network);
    return network->interface[0] == '\0' ||
           setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &group, sizeof group) == 0;
}

bool network_has_route(const Network *network, char *why)
{
    if (!network->udpm)
        return true;
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0)
        return true; // no decision here; the next step will fail
    // liblcm needs a route also where we choose the interface.
    const bool routed = reaches(fd, network),
               whole = routed && aim(fd, network) && reaches(fd, network);
    close(fd);
    if (routed && !whole)
        return fail(why,
                    "no interface '%s' that is up, as the LCM URL names: 'ip address' lists names "
                    "and addresses",
                    network->interface);
    if (!routed)
        return fail(why,
                    "no route for multicast to %s; for messages on this machine only, as root: "
                    "ip link set lo up; ip link set lo multicast on; ip route add 224.0.0.0/4 dev "
                    "lo (or another --lcm-url: one with ttl=1 over an interface that has such a "
                    "route, or tcpq://HOST:PORT with LCM's Java server: slow, not for control)",
                    inet_ntoa(group_address(network).sin_addr));
    return true;
}

enum { FILES = 1024 };

// True for liblcm's socket that sends multicast, and has not yet.
static bool is_sender(int fd)
{
    int type = 0;
    struct sockaddr_in own;
    socklen_t size = sizeof type, own_size = sizeof own;
    return getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_DGRAM &&
           getsockname(fd, (struct sockaddr *)&own, &own_size) == 0 && own.sin_family == AF_INET &&
           own.sin_port == 0;
}

// liblcm neither takes an interface nor shows its socket: it is the one that is there afterwards
// and was not before.
static lcm_t *open_aimed(Network *network)
{
    char url[64];
    bool before[FILES];
    for (int fd = 0; fd < FILES; fd++)
        before[fd] = is_sender(fd);
    snprintf(url, sizeof url, "udpm://%s:%u?ttl=%d", inet_ntoa(group_address(network).sin_addr),
             network->port, network->ttl);
    lcm_t *lcm = lcm_create(url);
    for (int fd = 0; fd < FILES && lcm != NULL; fd++)
        if (!before[fd] && is_sender(fd) && aim(fd, network))
            network->sender = fd;
    if (lcm != NULL && network->sender < 0) {
        lcm_destroy(lcm);
        lcm = NULL;
    }
    return lcm;
}

lcm_t *network_open(Network *network, char *why)
{
    const bool chosen = network->udpm && network->interface[0] != '\0';
    lcm_t *lcm = chosen ? open_aimed(network) : lcm_create(network->url);
    if (lcm == NULL)
        fail(why, "LCM cannot open '%.255s'", network->url);
    return lcm;
}

// --- packets ---

static uint32_t word_at(const unsigned char *packet)
{
    return (uint32_t)packet[0] << 24 | (uint32_t)packet[1] << 16 | (uint32_t)packet[2] << 8 |
           packet[3];
}

Drop datagram_read(const void *packet, size_t size, Datagram *datagram)
{
    const unsigned char *bytes = packet;
    *datagram = (Datagram){0};
    if (size < SHORT_HEADER)
        return DROP_MALFORMED;
    uint32_t magic = word_at(bytes);
    size_t header = magic == MAGIC_SHORT ? SHORT_HEADER : LONG_HEADER;
    if ((magic != MAGIC_SHORT && magic != MAGIC_LONG) || size < header)
        return DROP_MALFORMED;
    // Only the first fragment contains the channel.
    if (magic == MAGIC_LONG && (bytes[16] != 0 || bytes[17] != 0))
        return DROP_FRAGMENT;
    size_t left = size - header, most = RECEIVER_CHANNEL_MAX + 1;
    const char *channel = (const char *)packet + header;
    const char *end = memchr(channel, '\0', left < most ? left : most);
    if (end == NULL || end == channel)
        return DROP_MALFORMED;
    datagram->channel = channel;
    datagram->data = end + 1;
    datagram->size = left - (size_t)(end + 1 - channel);
    return magic == MAGIC_LONG ? DROP_FRAGMENT : DROP_COUNT;
}

// --- this host ---

// Reads the addresses of all interfaces with a socket of the same kind as the receiver's.
static void read_own(Receiver *receiver)
{
    struct ifreq request[ADDRESSES];
    struct ifconf list = {.ifc_len = sizeof request, .ifc_req = request};
    receiver->own_read_ns = now_ns();
    receiver->own_count = 0;
    if (ioctl(receiver->socket, SIOCGIFCONF, &list) != 0)
        return;
    int count = list.ifc_len / (int)sizeof request[0];
    for (int i = 0; i < count; i++) {
        struct sockaddr_in address;
        memcpy(&address, &request[i].ifr_addr, sizeof address);
        receiver->own[receiver->own_count++] = address.sin_addr;
    }
}

static bool find_own(const Receiver *receiver, struct in_addr address)
{
    // A sender on this host whose interface has no suitable address, such as the loopback device;
    // from outside, the kernel accepts it for 224.0.0.x only.
    if (address.s_addr == INADDR_ANY)
        return !receiver->local_group;
    for (int i = 0; i < receiver->own_count; i++)
        if (receiver->own[i].s_addr == address.s_addr)
            return true;
    return false;
}

// True for an address of this host: the kernel rejects packets from outside with such a source
// address. Searches for addresses added later at most ten times per second.
static bool is_own(Receiver *receiver, struct in_addr address)
{
    if (find_own(receiver, address))
        return true;
    if (now_ns() - receiver->own_read_ns < 100000000)
        return false;
    read_own(receiver);
    return find_own(receiver, address);
}

// --- the socket ---

static bool join(Receiver *receiver, const Network *network, char *why)
{
    const int on = 1, off = 0;
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    receiver->socket = fd;
    if (fd < 0)
        return fail(why, "no socket for LCM: %s", strerror(errno));
    int bytes =
        network->receive_bytes > 0 ? network->receive_bytes : receiver->options.receive_bytes;
    if (bytes > 0) // the kernel limits it
        setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    // Others on this host listen to the same group, and to the same port for any group.
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    // Only from the interface of the group's route, not from all on which any program joined it.
    setsockopt(fd, IPPROTO_IP, IP_MULTICAST_ALL, &off, sizeof off);
    const struct sockaddr_in address = group_address(network);
    const struct ip_mreqn group = membership(network);
    if (bind(fd, (const struct sockaddr *)&address, sizeof address) != 0)
        return fail(why, "cannot listen to the group and port of the LCM URL: %s", strerror(errno));
    if (setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) != 0)
        return fail(why, "cannot join the multicast group of the LCM URL: %s", strerror(errno));
    return true;
}

// Puts a new socket in place of ours, which leaves the group on the former interface. The file
// keeps its number for those that poll it.
static bool join_again(Receiver *receiver)
{
    char why[RECEIVER_WHY_MAX];
    const int old = receiver->socket;
    const bool joined =
        join(receiver, &receiver->network, why) && dup3(receiver->socket, old, O_CLOEXEC) >= 0;
    if (receiver->socket >= 0)
        close(receiver->socket);
    receiver->socket = old;
    return joined;
}

static void report_route(Receiver *receiver, bool routed)
{
    char text[RECEIVER_WHY_MAX];
    const struct in_addr group = group_address(&receiver->network).sin_addr;
    if (!routed)
        snprintf(text, sizeof text, "no route for multicast to %s any more: waiting for one",
                 inet_ntoa(group));
    else if (receiver->unrouted)
        snprintf(text, sizeof text, "the route for multicast to %s is back after %.1f s",
                 inet_ntoa(group), 1e-9 * (double)(now_ns() - receiver->lost_ns));
    else
        snprintf(text, sizeof text, "the route for multicast to %s leads to another interface",
                 inet_ntoa(group));
    receiver->lost_ns = now_ns();
    receiver->unrouted = !routed;
    if (receiver->options.moved != NULL)
        receiver->options.moved(routed, text, receiver->options.user);
}

void receiver_follow(Receiver *receiver)
{
    const int64_t now = now_ns();
    if (receiver->socket < 0 || now - receiver->looked_ns < RECEIVER_FOLLOW_MS * INT64_C(1000000))
        return;
    receiver->looked_ns = now;
    // Joins on the interface of the route; on one where we are already the kernel refuses.
    const struct ip_mreqn group = membership(&receiver->network);
    const bool joined =
        setsockopt(receiver->socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) == 0;
    const bool routed = joined || errno != ENODEV, moved = joined && join_again(receiver);
    if (joined && !moved) // no file for it: the next look must find the group to be joined
        setsockopt(receiver->socket, IPPROTO_IP, IP_DROP_MEMBERSHIP, &group, sizeof group);
    if (moved && receiver->network.sender >= 0)
        aim(receiver->network.sender, &receiver->network);
    if (moved)
        read_own(receiver); // this host may have lost the addresses that it had
    if (moved || routed == receiver->unrouted)
        report_route(receiver, routed);
}

static ssize_t take(Receiver *receiver, struct sockaddr_in *from)
{
    socklen_t size = sizeof *from;
    return recvfrom(receiver->socket, receiver->packet, sizeof receiver->packet, 0,
                    (struct sockaddr *)from, &size);
}

// True when one of our own packets has returned.
static bool hears_itself(Receiver *receiver, uint64_t number)
{
    struct sockaddr_in from = {0};
    Datagram datagram;
    for (ssize_t size; (size = take(receiver, &from)) >= 0;) {
        if (datagram_read(receiver->packet, (size_t)size, &datagram) == DROP_COUNT &&
            strcmp(datagram.channel, TEST_CHANNEL) == 0 && datagram.size == sizeof number &&
            memcmp(datagram.data, &number, sizeof number) == 0)
            return true;
    }
    return false;
}

// Tests the loop, since a route shows neither filters nor interfaces that only send.
static bool test_loop(Receiver *receiver, const Network *network, char *why)
{
    uint64_t number = (uint64_t)now_ns();
    if (getrandom(&number, sizeof number, GRND_NONBLOCK) < 0)
        number ^= (uint64_t)getpid() << 32;
    const int64_t end_ns = now_ns() + TEST_MS * INT64_C(1000000);
    while (now_ns() < end_ns) {
        lcm_publish(receiver->lcm, TEST_CHANNEL, &number, sizeof number);
        struct pollfd in = {.fd = receiver->socket, .events = POLLIN};
        const int64_t again_ns = now_ns() + TEST_AGAIN_MS * INT64_C(1000000);
        for (int64_t left_ns; (left_ns = again_ns - now_ns()) > 0;)
            if (poll(&in, 1, 1 + (int)(left_ns / 1000000)) > 0 && hears_itself(receiver, number))
                return true;
    }
    return fail(why,
                "what is sent to %s does not come back: does a firewall filter multicast, or has "
                "the interface that its route leads to no multicast?",
                inet_ntoa(group_address(network).sin_addr));
}

Receiver *receiver_create(lcm_t *lcm, const Network *network, const ReceiverOptions *options,
                          char *why)
{
    Receiver *receiver = calloc(1, sizeof *receiver);
    if (receiver == NULL) {
        fail(why, "%s", "out of memory");
        return NULL;
    }
    receiver->lcm = lcm;
    receiver->options = *options;
    receiver->socket = -1;
    receiver->network = *network;
    receiver->local_group = network->group >> 8 == 0xe00000;
    if (!network->udpm)
        return receiver;
    if (join(receiver, network, why) && test_loop(receiver, network, why)) {
        read_own(receiver);
        return receiver;
    }
    receiver_destroy(receiver);
    return NULL;
}

void receiver_destroy(Receiver *receiver)
{
    if (receiver == NULL)
        return;
    while (receiver->first != NULL)
        receiver_unsubscribe(receiver, receiver->first);
    if (receiver->socket >= 0)
        close(receiver->socket);
    free(receiver);
}

int receiver_file(const Receiver *receiver)
{
    return receiver->socket >= 0 ? receiver->socket : lcm_get_fileno(receiver->lcm);
}

// --- subscriptions ---

ReceiverSubscription *receiver_subscribe(Receiver *receiver, const char *channel, int queue,
                                         lcm_msg_handler_t handler, void *user)
{
    ReceiverSubscription *new = calloc(1, sizeof *new);
    size_t length = strlen(channel);
    if (new == NULL || length >= sizeof new->channel)
        goto refused;
    new->handler = handler;
    new->user = user;
    if (receiver->socket < 0) {
        new->liblcm = lcm_subscribe(receiver->lcm, channel, handler, user);
        if (new->liblcm == NULL)
            goto refused;
        lcm_subscription_set_queue_capacity(new->liblcm, queue);
    }
    new->pattern = length >= 2 && strcmp(channel + length - 2, ".+") == 0;
    memcpy(new->channel, channel, new->pattern ? length - 2 : length);
    // Handlers are called in the order of their subscription.
    ReceiverSubscription **last = &receiver->first;
    while (*last != NULL)
        last = &(*last)->next;
    *last = new;
    return new;
refused:
    free(new);
    return NULL;
}

void receiver_unsubscribe(Receiver *receiver, ReceiverSubscription *subscription)
{
    for (ReceiverSubscription **at = &receiver->first; *at != NULL; at = &(*at)->next) {
        if (*at != subscription)
            continue;
        *at = subscription->next;
        if (subscription->liblcm != NULL)
            lcm_unsubscribe(receiver->lcm, subscription->liblcm);
        free(subscription);
        return;
    }
}

static const ReceiverSubscription *find_next(const ReceiverSubscription *from, const char *channel)
{
    for (; from != NULL; from = from->next) {
        size_t length = strlen(from->channel);
        if (from->pattern ? strncmp(channel, from->channel, length) == 0 && channel[length] != '\0'
                          : strcmp(channel, from->channel) == 0)
            return from;
    }
    return NULL;
}

// --- messages ---

static void drop(const Receiver *receiver, Drop why, const Datagram *datagram, struct in_addr from)
{
    static const char *const REASON[DROP_COUNT] = {
        [DROP_MALFORMED] = "not a packet of LCM's",
        [DROP_FRAGMENT] = "a message that is longer than a packet",
        [DROP_REMOTE] = "other hosts are not heard here (remote = true would)"};
    char text[RECEIVER_WHY_MAX], address[INET_ADDRSTRLEN] = "?";
    if (receiver->options.dropped == NULL)
        return;
    inet_ntop(AF_INET, &from, address, sizeof address);
    snprintf(text, sizeof text, "%s%sfrom %s: %s", datagram->channel ? datagram->channel : "",
             datagram->channel ? " " : "", address, REASON[why]);
    receiver->options.dropped(why, text, receiver->options.user);
}

void receiver_deliver(Receiver *receiver, const void *packet, size_t size, uint32_t address)
{
    Datagram datagram;
    const struct in_addr from = {.s_addr = htonl(address)};
    Drop why = datagram_read(packet, size, &datagram);
    const ReceiverSubscription *wanted =
        datagram.channel != NULL ? find_next(receiver->first, datagram.channel) : NULL;
    if (wanted == NULL) {
        if (why == DROP_MALFORMED)
            drop(receiver, why, &datagram, from);
        return; // a message of another program
    }
    if (!receiver->options.remote && !is_own(receiver, from))
        why = DROP_REMOTE;
    if (why != DROP_COUNT) {
        drop(receiver, why, &datagram, from);
        return;
    }
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    const lcm_recv_buf_t message = {.data = (void *)(uintptr_t)datagram.data,
                                    .data_size = (uint32_t)datagram.size,
                                    .recv_utime =
                                        (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000,
                                    .lcm = receiver->lcm};
    for (; wanted != NULL; wanted = find_next(wanted->next, datagram.channel))
        wanted->handler(&message, datagram.channel, wanted->user);
}

static int handle_liblcm(Receiver *receiver)
{
    struct pollfd in = {.fd = lcm_get_fileno(receiver->lcm), .events = POLLIN};
    int ready = poll(&in, 1, 0);
    if (ready <= 0)
        return ready < 0 && errno != EINTR ? -1 : 0;
    return lcm_handle(receiver->lcm) < 0 ? -1 : 1;
}

int receiver_handle(Receiver *receiver)
{
    if (receiver->socket < 0)
        return handle_liblcm(receiver);
    struct sockaddr_in from = {0};
    ssize_t size = take(receiver, &from);
    if (size < 0)
        return errno == EAGAIN || errno == EINTR ? 0 : -1;
    receiver_deliver(receiver, receiver->packet, (size_t)size, ntohl(from.sin_addr.s_addr));
    return 1;
}
