// SPDX-License-Identifier: MIT
// Sorts the faces near a point into patches, connected parts of a surface, and finds on which side
// of them the point is (server/sim/README.md, "Contact between bodies").
#include "sim/touch/touch_look.h"

#include <string.h>

// Distance below which a point is on neither side of a face, relative to the longest edge.
static const double SAME_PLACE = 1e-9;

// Sets the bits of TouchPair.border.
static unsigned borders_of(const TouchHalf *half, const TouchLook *look, int face)
{
    const BodySurface *surface = &half->faces->body->surface;
    unsigned border = 0;
    for (int k = 0; k < 3; k++) {
        const int across = surface->face_neighbor[face][k];
        const bool ends = across < 0 || touch_ignores(half, look, across);
        border |= ends ? 1U << k | 1U << (3 + k) | 1U << (3 + (k + 1) % 3) : 0U;
        // A border that only reaches the corner.
        const int node = surface->face[face][k];
        for (int j = surface->node_face_start[node];
             j < surface->node_face_end[node] && !surface->solid; j++) {
            const int other = surface->node_face[j];
            for (int c = 0; c < 3; c++)
                if (surface->face_neighbor[other][c] < 0 &&
                    (surface->face[other][c] == node || surface->face[other][(c + 1) % 3] == node))
                    border |= 1U << (3 + k);
        }
    }
    return border;
}

// Gives all near faces that are connected with those of a patch to it.
static void spread_patch(const BodySurface *surface, TouchLook *look, int patch)
{
    for (bool again = true; again;) {
        again = false;
        for (int i = 0; i < look->count; i++)
            for (int k = 0; k < look->count && look->near[i].patch < 0; k++)
                if (look->near[k].patch == patch &&
                    touch_is_beside(surface, look->near[i].face, look->near[k].face)) {
                    look->near[i].patch = patch;
                    again = true;
                }
    }
}

// Moves the near faces of a patch into pairs whose corners are nodes, nearest first. Returns their
// number.
static int make_pairs(const TouchHalf *half, const TouchLook *look, int patch, TouchPair *pair)
{
    const BodySurface *surface = &half->faces->body->surface;
    int count = 0;
    for (int i = 0; i < look->count; i++) {
        if (look->near[i].patch != patch)
            continue;
        pair[count] = (TouchPair){
            .face = look->near[i].face, .patch = patch, .least = look->near[i].at.distance};
        memcpy(pair[count].corner, surface->face[look->near[i].face], sizeof pair->corner);
        pair[count].border = borders_of(half, look, look->near[i].face);
        count++;
    }
    return count;
}

// True if an edge of the point's own passes through a patch of its body: then no side is right.
static bool is_tangled(const TouchHalf *half, const TouchLook *look, const TouchPair *pair,
                       int count, int patch)
{
    const BodySurface *surface = &half->points->body->surface;
    double along, weight[3];
    for (int k = surface->node_face_start[look->node]; k < surface->node_face_end[look->node]; k++)
        for (int c = 0; c < 3; c++) {
            const int other = surface->face[surface->node_face[k]][c];
            for (int i = 0; i < count && other != look->node; i++) {
                Vec3 x[3];
                if (pair[i].patch != patch || touch_has_corner(surface, pair[i].face, other))
                    continue;
                touch_read_corners(half->faces, pair[i].face, x);
                if (distance_segment_crosses(look->at, half->points->place[other], x, &along,
                                             weight))
                    return true;
            }
        }
    return false;
}

// Returns the side of a patch on which a point is: the remembered one, unless the point has come to
// its border or to another surface; else the one that is seen. 0: none, at a border or in the
// patch.
static int side_of(Touch *touch, const TouchHalf *half, const TouchLook *look, TouchMemory *memory,
                   const TouchPair *pair, int count, int patch)
{
    TouchGap gap;
    if (half->one_sided)
        return 1;
    if (!touch_gap(half->faces->place, look->at, pair, count, patch, 1, 0.0, &gap)) {
        // From the border of a wall it may come in front of it, where its side must be seen. Within
        // a body that is less urgent: what it comes in front of is its own lip.
        touch->expires |= half->points != half->faces && !half->faces->body->surface.solid &&
                          gap.distance < touch->slack + touch->thickness;
        return 0;
    }
    // The distance to one surface changes by no more than both have moved.
    const int side = memory->side[patch];
    const double moved = touch->kept->moved + SAME_PLACE * half->faces->body->surface.longest_edge;
    const bool folds = half->points->piece != NULL,
               known = side != 0 && fabs(side * gap.distance - memory->gap[patch]) <= moved;
    if (known && !(folds && side * gap.distance < 0.0))
        return side;
    memory->side[patch] = 0; // what is seen now is new
    if (folds && is_tangled(half, look, pair, count, patch))
        return 0;
    // What a solid sees from within is its own back: not of a cut, whose sides are at one place.
    const bool behind = gap.distance < -SAME_PLACE * half->faces->body->surface.longest_edge;
    return !behind ? 1 : half->faces->body->surface.solid ? 0 : -1;
}

// Gives near faces to the patches around what the point remembers.
static void recall_patches(const BodySurface *surface, TouchLook *look, const TouchMemory *memory)
{
    for (int patch = 0; patch < TOUCH_PATCHES; patch++) {
        const int from = memory->face[patch] - 1;
        for (int i = 0; i < look->count && from >= 0; i++)
            if (look->near[i].patch < 0 && touch_is_beside(surface, look->near[i].face, from))
                look->near[i].patch = patch;
        spread_patch(surface, look, patch);
    }
}

int touch_find_patches(Touch *touch, const TouchHalf *half, TouchLook *look, TouchMemory *memory,
                       int side[TOUCH_PATCHES], TouchPair *pair)
{
    const BodySurface *surface = &half->faces->body->surface;
    int count = 0;
    if (!half->one_sided)
        recall_patches(surface, look, memory);
    for (int patch = 0; patch < TOUCH_PATCHES; patch++) {
        bool has = false;
        int next = -1;
        for (int i = look->count - 1; i >= 0; i--) {
            has |= look->near[i].patch == patch;
            next = look->near[i].patch < 0 ? i : next;
        }
        if (half->one_sided) // all of it is one surface
            for (int i = 0; i < look->count && patch == 0; i++)
                look->near[i].patch = 0;
        else if (!has && next >= 0) {
            look->near[next].patch = patch;
            spread_patch(surface, look, patch);
        }
        const int more = make_pairs(half, look, patch, &pair[count]);
        if (!has && !half->one_sided)
            memory->face[patch] = memory->side[patch] = 0;
        side[patch] = more == 0 ? 0 : side_of(touch, half, look, memory, &pair[count], more, patch);
        count += side[patch] != 0 ? more : 0;
    }
    return count;
}

void touch_remember(const Touch *touch, TouchMemory *memory, const int side[TOUCH_PATCHES],
                    const double gap[TOUCH_PATCHES], double thickness, const TouchPair *pair,
                    int count)
{
    for (int patch = 0; patch < TOUCH_PATCHES; patch++) {
        const bool known = memory->side[patch] == side[patch]; // which is not 0 if there are pairs
        const double least = touch->overlap > 0.0 ? gap[patch] : fmax(gap[patch], 0.0);
        const double rest = touch->repeats || known ? memory->rest[patch] : least;
        memory->face[patch] = memory->side[patch] = 0;
        memory->gap[patch] = memory->rest[patch] = 0.0;
        for (int i = count - 1; i >= 0; i--)
            if (pair[i].patch == patch) {
                memory->face[patch] = pair[i].face + 1;
                memory->side[patch] = side[patch];
                memory->gap[patch] = gap[patch];
                memory->rest[patch] = fmin(rest, thickness);
            }
    }
}
