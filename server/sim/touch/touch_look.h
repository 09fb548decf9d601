// SPDX-License-Identifier: MIT
// Private to the search of a touch: what is near one point. touch_find.c finds the faces,
// touch_patch.c which surfaces they are and on which side of them the point is.
#ifndef PLIANT_SIM_TOUCH_LOOK_H
#define PLIANT_SIM_TOUCH_LOOK_H

#include "sim/touch/touch_data.h"

enum {
    TOUCH_NEAR = 16,    // faces near a point, at most
    TOUCH_NORMALS = 24, // of a point that count, at most
};

// A face near a point.
typedef struct TouchNear {
    int face;
    ClosestPair at;
    int patch; // -1: none yet
} TouchNear;

// What a point looks for.
typedef struct TouchLook {
    int node;
    Vec3 at;
    int normal_count; // 0: however faces face they count
    Vec3 normal[TOUCH_NORMALS];
    double least; // nearest so far [m]
    int count;
    TouchNear near[TOUCH_NEAR];
} TouchLook;

static inline Vec3 touch_face_normal(const TouchEnd *end, int face)
{
    const int *corner = end->body->surface.face[face];
    const Vec3 a = end->place[corner[0]];
    return vec3_unit(
        vec3_cross(vec3_sub(end->place[corner[1]], a), vec3_sub(end->place[corner[2]], a)));
}

// True if two faces have a corner in common.
static inline bool touch_is_beside(const BodySurface *surface, int a, int b)
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            if (surface->face[a][i] == surface->face[b][k])
                return true;
    return false;
}

static inline bool touch_has_corner(const BodySurface *surface, int face, int node)
{
    const int *corner = surface->face[face];
    return corner[0] == node || corner[1] == node || corner[2] == node;
}

static inline void touch_read_corners(const TouchEnd *end, int face, Vec3 x[3])
{
    for (int k = 0; k < 3; k++)
        x[k] = end->place[end->body->surface.face[face][k]];
}

// touch_find.c
// True if a point ignores a face.
bool touch_ignores(const TouchHalf *half, const TouchLook *look, int face);

// touch_patch.c
// Finds the patches near a point: those that it remembers, then others, the nearest first. Sets the
// side of each, 0 for none, and forgets what has become another surface. Returns the number of
// pairs, at most TOUCH_NEAR.
int touch_find_patches(Touch *touch, const TouchHalf *half, TouchLook *look, TouchMemory *memory,
                       int side[TOUCH_PATCHES], TouchPair *pair);
// Sets what a point remembers of each patch: the nearest face, on which side and how far it is. A
// surface that is new may be nearer than its thickness.
void touch_remember(const Touch *touch, TouchMemory *memory, const int side[TOUCH_PATCHES],
                    const double gap[TOUCH_PATCHES], double thickness, const TouchPair *pair,
                    int count);

#endif
