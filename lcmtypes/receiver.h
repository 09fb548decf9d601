// SPDX-License-Identifier: MIT
// Receives messages for the server and its clients. For a udpm URL it reads the packets itself,
// because liblcm trusts the lengths in them (server/run/README.md, "What LCM does, and what we do
// about it"). It is bound to the multicast group (packets sent to this host alone never arrive),
// takes whole messages only (all of ours fit one packet; fragments are refused), and can refuse
// other hosts. For any other URL liblcm receives. An lcm_t of a udpm URL that only publishes never
// reads a packet, so nothing else may subscribe to it, handle it or use its file. One thread;
// allocates while subscribing only, and prints nothing.
#ifndef PLIANT_LCMTYPES_RECEIVER_H
#define PLIANT_LCMTYPES_RECEIVER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <lcm/lcm.h>

enum {
    RECEIVER_CHANNEL_MAX = 63, // characters
    RECEIVER_WHY_MAX = 512,
};

// The content of a URL.
typedef struct Network {
    char url[256];  // the URL itself, LCM_DEFAULT_URL, or LCM's default
    bool udpm;      // false: a URL of liblcm's other providers, and no more is known
    uint32_t group; // address and port, in this machine's byte order
    uint16_t port;
    int ttl;            // 0: messages stay on this host
    char interface[32]; // its name or address; "": that of the route to the group
    int sender; // the socket of what network_open returned, if an interface was chosen; else -1
    int receive_bytes; // recv_buf_size: the socket's buffer [bytes]; 0: not given
} Network;

// Reads `url` (NULL or "": LCM_DEFAULT_URL, else LCM's default). Returns false with a sentence of
// at most RECEIVER_WHY_MAX bytes that says what to do.
bool network_read(Network *network, const char *url, char *why);
// Returns false with a sentence if this machine has no route to the group, or not the interface.
bool network_has_route(const Network *network, char *why);
// Opens liblcm for sending, over the interface of the URL. Needs a route. Returns NULL with a
// sentence on failure.
lcm_t *network_open(Network *network, char *why);

typedef enum Drop {
    DROP_MALFORMED, // not an LCM packet
    DROP_FRAGMENT,  // the first part of a message that is longer than a packet
    DROP_REMOTE,    // from another host
    DROP_COUNT
} Drop;

typedef struct ReceiverOptions {
    int receive_bytes; // default if the URL gives none; 0: the kernel's default
    bool remote;       // accepts packets of other hosts
    // Called for each dropped packet, except on channels without subscription; `why` is a sentence.
    // May be NULL.
    void (*dropped)(Drop drop, const char *why, void *user);
    // Called by receiver_follow when the route to the group is lost, has moved or is back; `what`
    // is a sentence. May be NULL.
    void (*moved)(bool routed, const char *what, void *user);
    void *user;
} ReceiverOptions;

enum { RECEIVER_FOLLOW_MS = 500 }; // between two looks at the route

typedef struct Receiver Receiver;
typedef struct ReceiverSubscription ReceiverSubscription;

// Joins the group and sends itself a packet, which must come back within two seconds. `lcm` is that
// of network_open, publishes, and outlives the receiver. Returns NULL with a sentence on failure.
Receiver *receiver_create(lcm_t *lcm, const Network *network, const ReceiverOptions *options,
                          char *why);
void receiver_destroy(Receiver *receiver);
// Returns a descriptor that is readable when there is something to handle.
int receiver_file(const Receiver *receiver);
// Subscribes a handler; all handlers that match a message get it. `channel`: letters, digits, '_'
// and '-'; ".+" at its end matches one or more characters. `queue`: messages that liblcm queues for
// other URLs. Returns NULL without memory, or if liblcm refuses.
ReceiverSubscription *receiver_subscribe(Receiver *receiver, const char *channel, int queue,
                                         lcm_msg_handler_t handler, void *user);
// Unsubscribes; not inside a handler. NULL is allowed.
void receiver_unsubscribe(Receiver *receiver, ReceiverSubscription *subscription);
// Follows the route to the group: a kernel's membership stays on the interface of the join, and
// ends with it. Call at least every RECEIVER_FOLLOW_MS; it looks that often, with one system call.
void receiver_follow(Receiver *receiver);
// Handles at most one packet; never blocks. Returns 1 if there was one, 0 if none, -1 if the
// receiver is broken.
int receiver_handle(Receiver *receiver);

// --- for tests ---

// A packet with a whole message; the members point into it.
typedef struct Datagram {
    const char *channel;
    const void *data;
    size_t size;
} Datagram;

// Reads a packet. Returns DROP_COUNT for a whole message; sets the channel for a first fragment
// too, else NULL.
Drop datagram_read(const void *packet, size_t size, Datagram *datagram);
// Does what receiver_handle does with a packet from that address (in this machine's byte order).
void receiver_deliver(Receiver *receiver, const void *packet, size_t size, uint32_t from);

#endif
