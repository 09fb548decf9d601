// SPDX-License-Identifier: MIT
// A UDP packet as it comes from the network, before liblcm or anybody has looked at it: dropped
// with a reason, or a message that lies inside it goes to the handlers of its channel. The first
// byte says where the packet comes from.
#include "fuzz.h"

#include "receiver.h"

#include <stdlib.h>

static const uint8_t *packet;
static size_t packet_size;
static int handled, dropped;

static void on_message(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    const uint8_t *data = message->data;
    size_t length = strlen(channel), head = strlen(user);
    MUST(length >= 1 && length <= RECEIVER_CHANNEL_MAX && strncmp(channel, user, head) == 0);
    MUST((const uint8_t *)channel == packet + 8 && data == packet + 8 + length + 1);
    MUST(data + message->data_size == packet + packet_size);
    handled++;
}

static void on_dropped(Drop drop, const char *why, void *user)
{
    (void)user;
    MUST(drop < DROP_COUNT && strlen(why) < RECEIVER_WHY_MAX);
    fuzz_print(why);
    dropped++;
}

static Receiver *create(bool remote)
{
    static char exact[] = "PLIANT_COMMAND", body[] = "PLIANT_NODES_";
    const Network network = {.url = "memq://"};
    const ReceiverOptions options = {.remote = remote, .dropped = on_dropped};
    char why[RECEIVER_WHY_MAX];
    Receiver *receiver = receiver_create(lcm_create(network.url), &network, &options, why);
    MUST(receiver != NULL);
    MUST(receiver_subscribe(receiver, exact, 1, on_message, exact) != NULL);
    MUST(receiver_subscribe(receiver, "PLIANT_NODES_.+", 1, on_message, body) != NULL);
    return receiver;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Receiver *near, *all;
    if (size == 0)
        return 0;
    if (near == NULL) {
        near = create(false);
        all = create(true);
    }
    // A piece of memory of its own: what lies beyond is not there.
    uint8_t *copy = malloc(size);
    MUST(copy != NULL);
    memcpy(copy, data + 1, size - 1);
    packet = copy;
    packet_size = size - 1;
    handled = dropped = 0;
    // From another host, unless it is the address of none, which only this one can send from.
    uint32_t from = data[0] & 1 ? 0x0a000001 : 0;
    receiver_deliver(data[0] & 2 ? all : near, packet, packet_size, from);
    MUST(handled + dropped <= 1);
    MUST(handled == 0 || from == 0 || (data[0] & 2) != 0);
    fuzz_print(handled > 0 ? "handled" : "not handled");
    free(copy);
    return 0;
}
