// SPDX-License-Identifier: MIT
// Positions as points_t has them. Pure functions without thread, clock or socket.
#ifndef PLIANT_RUN_BUS_POINTS_H
#define PLIANT_RUN_BUS_POINTS_H

#include <stdint.h>

#define POINTS_GRID 0x1p-17f // [m], 7.6 um; a power of two, so that a float holds its multiples

enum {
    PACKET_BYTES = 1400, // of UDP, with LCM's header and the channel: no link of today cuts it up
    POINTS_IN_PACKET = 1024,
    POINTS_LEAST_BYTES = 96, // a group of 8 nodes at their widest
};

// Returns the finest grid that holds `count` positions [m]; `id` < 0: a free slot, whose position
// means nothing.
float points_grid(const float *position, const int *id, int count);
// Packs the first of `count` nodes into `data` (`bytes` of it, at least POINTS_LEAST_BYTES; it is
// overwritten) and returns how many: multiples of 8, but all if they fit.
int points_pack(const float *position, const int *id, int count, float grid, int bytes,
                int32_t origin[3], uint8_t *data, int *data_bytes);

#endif
