// SPDX-License-Identifier: MIT
// What all programs that publish under a prefix do alike, the server and the player: how they
// divide frames and meshes into chunks, and which of two holds the prefix.
#ifndef PLIANT_LCMTYPES_SENDING_H
#define PLIANT_LCMTYPES_SENDING_H

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

// --- chunks --------------------------------------------------------------------------------------

enum {
    NODES_IN_CHUNK = 4096,      // 49 kB: below one datagram
    NODES_IN_LOOK_CHUNK = 2048, // 12 kB, which the server finds within half a millisecond
    ROWS_IN_MAP_CHUNK = 16384,  // of elements 48 kB
    TRIANGLES_IN_CHUNK = 2048,  // with NODES_IN_MESH_CHUNK 46 kB
    NODES_IN_MESH_CHUNK = 1024,
};

// Chunks of at most `size` things each; one when there is nothing.
static inline int chunks_of(int count, int size)
{
    return count > 0 ? (count + size - 1) / size : 1;
}

// As many as the larger of the two arrays takes.
static inline int chunks_of_mesh(int nodes, int triangles)
{
    const int by_triangles = chunks_of(triangles, TRIANGLES_IN_CHUNK);
    const int by_nodes = chunks_of(nodes, NODES_IN_MESH_CHUNK);
    return by_triangles > by_nodes ? by_triangles : by_nodes;
}

// Where chunk `chunk` of `count` begins among `total` things.
static inline int chunk_begin(int total, int chunk, int count)
{
    return (int)((int64_t)total * chunk / count);
}

// --- the prefix (claim_t) ------------------------------------------------------------------------

enum {
    CLAIM_WAIT_MS = 250,     // for an answer, before one may hold the prefix
    CLAIM_ASK_AGAIN_MS = 50, // meanwhile: messages get lost
    CLAIM_CLOSE_US = 100000, // holds that began within this time count as equally old
};

// Of two that hold the prefix, the one that has held it for less time [us] yields; of two equally
// old ones, the one with the smaller number.
static inline bool claim_yields(int64_t held_us, int64_t number, int64_t rival_held_us,
                                int64_t rival_number)
{
    const int64_t ahead_us = rival_held_us - held_us;
    return llabs(ahead_us) < CLAIM_CLOSE_US ? rival_number > number : ahead_us > 0;
}

#endif
