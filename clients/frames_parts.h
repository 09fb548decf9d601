// What frames.c and frames_mesh.c share.
#ifndef PLIANT_CLIENTS_FRAMES_PARTS_H
#define PLIANT_CLIENTS_FRAMES_PARTS_H

#include "frames.h"

// Zeroed; aborts when there is none.
void *frames_allocate(size_t count, size_t size);

void parts_begin(FramesParts *parts, int count);
void parts_mark(FramesParts *parts, int first, int count);

static inline bool parts_whole(const FramesParts *parts)
{
    return parts->arrived == parts->count;
}

static inline bool range_inside(int32_t first, int32_t count, int32_t limit)
{
    return first >= 0 && count >= 0 && first <= limit && count <= limit - first;
}

// How far behind a sequence may be to count as late: frames are many a second. Whole meshes are
// seconds apart, and a daemon that starts anew with its clock set back must not wait for long.
enum { STALE_FRAMES = 64, STALE_MESHES = 2 };

// Older by number, by `most` at most, and by clock: a daemon that starts anew counts from 0 with a
// later clock.
bool frames_stale(int32_t sequence, int64_t utime, int32_t newest, int64_t newest_utime, int most);

#endif
