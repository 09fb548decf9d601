// SPDX-License-Identifier: MIT
// Packets as LCM sends them on the network, made by hand, so that they may lie.
#ifndef PLIANT_TESTS_FAULT_INJECTION_PACKET_H
#define PLIANT_TESTS_FAULT_INJECTION_PACKET_H

#include <stddef.h>
#include <stdint.h>

enum { PACKET_MOST = 65507, PACKET_PORT = 7667 };

// A whole message; returns the packet's size.
size_t packet_whole(unsigned char *packet, const char *channel, const void *data, size_t size);
// The head of a fragment, with its channel unless it is NULL; returns its size.
size_t packet_fragment(unsigned char *packet, uint32_t message_size, uint32_t offset,
                       uint16_t number, uint16_t count, const char *channel);
// A STOP of `sender`, as a whole message.
size_t packet_stop(unsigned char *packet, int32_t sender);
// Sends from a socket of its own to port 7667 of `address`; returns 0 when the system took it.
int packet_send(int socket, const char *address, const void *packet, size_t size);

#endif
