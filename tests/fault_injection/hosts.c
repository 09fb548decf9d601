// SPDX-License-Identifier: MIT
#include "hosts.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#include <linux/if.h>
#include <linux/if_tun.h>

enum { PACKET_MAX = 2048, WAITING = 16384 };

typedef struct Packet {
    int64_t due_ns;
    int to; // file of the host's device
    int size;
    unsigned char data[PACKET_MAX];
} Packet;

static int device[2] = {-1, -1}, network[2] = {-1, -1};
static pthread_t thread;
static atomic_bool finish;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER; // of the next three
static LinkFaults faults;
static LinkCounts counts;
static uint64_t random_state;
static Packet *waiting; // the link thread's own; in no order
static int waiting_count;

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

// xorshift64*: [0, 1)
static double draw(void)
{
    random_state ^= random_state >> 12;
    random_state ^= random_state << 25;
    random_state ^= random_state >> 27;
    return (double)(random_state * UINT64_C(2685821657736338717) >> 11) * 0x1p-53;
}

// --- the link ---

static void send_on(const Packet *packet)
{
    // A device without room loses the packet, as a switch would.
    if (write(packet->to, packet->data, (size_t)packet->size) < 0) {
        pthread_mutex_lock(&lock);
        counts.lost[packet->to == device[HOST_SERVER] ? HOST_CLIENT : HOST_SERVER]++;
        pthread_mutex_unlock(&lock);
    }
}

static void send_or_keep(Packet *packet, double later_ms)
{
    if (later_ms <= 0.0 || waiting_count == WAITING) {
        send_on(packet);
        return;
    }
    packet->due_ns = now_ns() + (int64_t)(later_ms * 1e6);
    waiting[waiting_count++] = *packet;
}

static void take(Host from, Packet *packet)
{
    packet->to = device[!from];
    pthread_mutex_lock(&lock);
    const LinkFaults f = faults;
    counts.packets[from]++;
    bool lost = f.cut || draw() < f.loss;
    int copies = 1 + (!lost && f.duplicate > 0.0 && draw() < f.duplicate);
    double later[2] = {f.delay_ms + f.jitter_ms * draw(), f.delay_ms + f.jitter_ms * draw()};
    counts.lost[from] += lost;
    counts.repeated += copies - 1;
    counts.delayed += !lost && later[0] > 0.0;
    pthread_mutex_unlock(&lock);
    for (int i = 0; i < copies && !lost; i++)
        send_or_keep(packet, later[i]);
}

// Sends what is due, the earliest first; how long until the next one [ns], at most a tenth of a
// second.
static int64_t send_due(void)
{
    for (;;) {
        int first = 0;
        for (int i = 1; i < waiting_count; i++)
            if (waiting[i].due_ns < waiting[first].due_ns)
                first = i;
        int64_t wait_ns = waiting_count > 0 ? waiting[first].due_ns - now_ns() : 100000000;
        if (waiting_count == 0 || wait_ns > 0)
            return wait_ns < 100000000 ? wait_ns : 100000000;
        send_on(&waiting[first]);
        // Those behind it stay in their order, which is that of equal times.
        memmove(&waiting[first], &waiting[first + 1],
                (size_t)(--waiting_count - first) * sizeof *waiting);
    }
}

static void *link_main(void *unused)
{
    (void)unused;
    static Packet packet;
    while (!atomic_load(&finish)) {
        int64_t wait_ns = send_due();
        struct timespec wait = {.tv_nsec = wait_ns > 0 ? wait_ns : 0};
        struct pollfd fds[2] = {{.fd = device[0], .events = POLLIN},
                                {.fd = device[1], .events = POLLIN}};
        ppoll(fds, 2, &wait, NULL);
        for (int k = 0; k < 2; k++)
            for (int n = 0; n < 64; n++) {
                packet.size = (int)read(device[k], packet.data, sizeof packet.data);
                if (packet.size <= 0)
                    break;
                take((Host)k, &packet);
            }
    }
    return NULL;
}

// --- the hosts ---

static bool run(const char *command)
{
    return system(command) == 0;
}

// A device of the network that the calling thread is in.
static int open_device(void)
{
    int fd = open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC);
    struct ifreq request = {.ifr_flags = IFF_TUN | IFF_NO_PI};
    snprintf(request.ifr_name, sizeof request.ifr_name, "far0");
    if (fd >= 0 && ioctl(fd, TUNSETIFF, &request) != 0) {
        close(fd);
        fd = -1;
    }
    return fd;
}

static bool make_host(Host host)
{
    char command[512];
    device[host] = open_device();
    if (device[host] < 0) {
        printf("no tun device (/dev/net/tun): %s\n", strerror(errno));
        return false;
    }
    // The queue takes a burst of a large mesh.
    snprintf(command, sizeof command,
             "ip link set lo up && ip link set far0 txqueuelen 5000 up && "
             "ip addr add 10.77.0.%d/24 dev far0 && ip route replace 224.0.0.0/4 dev far0",
             1 + (int)host);
    network[host] = open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC);
    if (network[host] < 0 || !run(command)) {
        puts("cannot set up a private network");
        return false;
    }
    return true;
}

int hosts_create(uint64_t seed)
{
    random_state = seed * UINT64_C(0x9e3779b97f4a7c15) + 1;
    waiting = calloc(WAITING, sizeof *waiting);
    // Without the device file a machine has no such devices; what else fails should not.
    if (access("/dev/net/tun", F_OK) != 0) {
        puts("skipped: no tun devices here (/dev/net/tun)");
        return 77;
    }
    if (waiting == NULL || !make_host(HOST_SERVER))
        return 1;
    if (unshare(CLONE_NEWNET) != 0) {
        puts("skipped: a second private network is not permitted here");
        return 77;
    }
    if (!make_host(HOST_CLIENT) || pthread_create(&thread, NULL, link_main, NULL) != 0)
        return 1;
    setenv("LCM_DEFAULT_URL", "udpm://239.255.76.67:7667?ttl=1", 1);
    hosts_enter(HOST_SERVER);
    return 0;
}

void hosts_enter(Host host)
{
    if (setns(network[host], CLONE_NEWNET) != 0) {
        perror("setns");
        abort();
    }
}

void hosts_fault(const LinkFaults *new_faults)
{
    pthread_mutex_lock(&lock);
    faults = new_faults != NULL ? *new_faults : (LinkFaults){0};
    counts = (LinkCounts){0};
    pthread_mutex_unlock(&lock);
}

LinkCounts hosts_counts(void)
{
    pthread_mutex_lock(&lock);
    LinkCounts now = counts;
    pthread_mutex_unlock(&lock);
    return now;
}

void hosts_forge(Host to, const void *packet, size_t size)
{
    if (write(device[to], packet, size) != (ssize_t)size) {
        perror("forged packet");
        abort();
    }
}

void hosts_destroy(void)
{
    atomic_store(&finish, true);
    pthread_join(thread, NULL);
    for (int k = 0; k < 2; k++) {
        close(device[k]);
        close(network[k]);
    }
    free(waiting);
}

int hosts_begin(void **state)
{
    (void)state;
    const int made = hosts_create(8);
    if (made == 77)
        test_skip_program("two networks are not permitted here");
    return made;
}

int hosts_end(void **state)
{
    (void)state;
    hosts_destroy();
    return 0;
}
