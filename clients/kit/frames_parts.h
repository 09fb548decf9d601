// SPDX-License-Identifier: MIT
// Shared by frames.c, frames_elements.c, frames_error.c, frames_mesh.c and frames_look.c.
#ifndef PLIANT_CLIENTS_FRAMES_PARTS_H
#define PLIANT_CLIENTS_FRAMES_PARTS_H

#include "frames.h"

// Allocates zeroed memory; NULL if there is none.
void *frames_allocate(size_t count, size_t size);
// Makes `*held` bytes of the budget of all frames `bytes`; false if that passes FRAMES_BYTES_MAX.
// Less is always granted.
bool frames_claim(size_t *held, size_t bytes);

bool parts_begin(FramesParts *parts, int count);
void parts_mark(FramesParts *parts, int first, int count);

static inline bool parts_whole(const FramesParts *parts)
{
    return parts->arrived == parts->count;
}

static inline bool range_inside(int32_t first, int32_t count, int32_t limit)
{
    return first >= 0 && count >= 0 && first <= limit && count <= limit - first;
}

// True if the memory of so many nodes is paid for by the rows of a mesh that came: a packet of 100
// bytes must not make its receiver take that of the largest.
static inline bool nodes_paid(int count, int mesh_nodes)
{
    return count <= FRAMES_NODES_FREE || count <= mesh_nodes;
}

// How far a sequence may be behind and still count as late. Many frames come per second. Whole
// meshes come seconds apart, and a daemon that restarts with its clock set back must not wait long.
enum { STALE_FRAMES = 64, STALE_MESHES = 2 };

// True if older by number, by `most` at most, and by clock: a daemon that restarts counts from 0
// with a later clock.
bool frames_stale(int32_t sequence, int64_t utime, int32_t newest, int64_t newest_utime, int most);

#endif
