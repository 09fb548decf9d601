// SPDX-License-Identifier: MIT
// Checks raw messages before they are decoded: lcm-gen's decoders of arrays and strings trust the
// counts on the wire and crash on corrupt ones. Pure functions, any thread; never allocates.
#ifndef PLIANT_CLIENTS_WIRE_H
#define PLIANT_CLIENTS_WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// A message type as lcm-gen encodes it. The shape lists the fields in their order:
//   b h i l  integers of 1, 2, 4, 8 bytes  f d  finite float, finite double
//   s        string, terminated inside     n    int32 that counts an array further on
//   12d      twelve of them                *0f  as many as the first n said; *0(..) as many groups
typedef struct WireType {
    const char *shape;
    int64_t (*fingerprint)(void);
    const char *name;
} WireType;

extern const WireType WIRE_POINTS;
extern const WireType WIRE_TOOL_POSE, WIRE_COMMAND, WIRE_REPLY, WIRE_NODES, WIRE_MESH,
    WIRE_MESH_DELTA, WIRE_REST, WIRE_WALLS, WIRE_LOOK, WIRE_CONTACT, WIRE_STATUS, WIRE_EVENT,
    WIRE_CLAIM, WIRE_PLAYBACK, WIRE_HELLO, WIRE_LEDGER, WIRE_ERROR, WIRE_ERROR_MAP, WIRE_ELEMENTS;

// True if `data` begins as a message of the type; else a program of another version sent it.
bool wire_is(const WireType *type, const void *data, size_t size);
// True if `data` is one whole message of the type: fingerprint, every count and string inside the
// message, every number finite, no byte left over. lcm-gen's decoder is safe on it.
bool wire_check(const WireType *type, const void *data, size_t size);

#endif
