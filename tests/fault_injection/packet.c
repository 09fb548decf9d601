// SPDX-License-Identifier: MIT
#include "packet.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>

#include "pliant_command_t.h"

static void put(unsigned char *at, uint32_t value, int bytes)
{
    for (int i = 0; i < bytes; i++)
        at[i] = (unsigned char)(value >> 8 * (bytes - 1 - i));
}

size_t packet_whole(unsigned char *packet, const char *channel, const void *data, size_t size)
{
    static uint32_t sequence;
    size_t length = strlen(channel) + 1;
    put(packet, 0x4c433032, 4);
    put(packet + 4, sequence++, 4);
    memcpy(packet + 8, channel, length);
    memcpy(packet + 8 + length, data, size);
    return 8 + length + size;
}

size_t packet_fragment(unsigned char *packet, uint32_t message_size, uint32_t offset,
                       uint16_t number, uint16_t count, const char *channel)
{
    size_t length = channel != NULL ? strlen(channel) + 1 : 0;
    put(packet, 0x4c433033, 4);
    put(packet + 4, 77, 4);
    put(packet + 8, message_size, 4);
    put(packet + 12, offset, 4);
    put(packet + 16, number, 2);
    put(packet + 18, count, 2);
    if (length > 0)
        memcpy(packet + 20, channel, length);
    return 20 + length;
}

size_t packet_stop(unsigned char *packet, int32_t sender)
{
    static int32_t id;
    char nothing[] = "", data[256];
    const pliant_command_t stop = {
        .sender = sender, .id = ++id, .kind = PLIANT_COMMAND_T_STOP, .argument = nothing};
    int size = pliant_command_t_encode(data, 0, sizeof data, &stop);
    return packet_whole(packet, "PLIANT_COMMAND", data, (size_t)size);
}

int packet_send(int socket, const char *address, const void *packet, size_t size)
{
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(PACKET_PORT)};
    inet_pton(AF_INET, address, &to.sin_addr);
    return sendto(socket, packet, size, 0, (const struct sockaddr *)&to, sizeof to) < 0 ? -1 : 0;
}
