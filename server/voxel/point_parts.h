// SPDX-License-Identifier: MIT
// The cells around a lattice point that are connected there, and so share a vertex. A pure function
// of the leaves and of the faces that do not connect.
#ifndef PLIANT_VOXEL_POINT_PARTS_H
#define PLIANT_VOXEL_POINT_PARTS_H

// The 12 faces in which the 8 cells around a lattice point (slots, x + 2 y + 4 z) meet: bit 4 d + i
// of a set of faces is the i-th one normal to axis d, between slots POINT_FACE and that + 2^d.
static const unsigned char POINT_FACE[12] = {0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3};

// The connected parts of the leaves around a point.
typedef struct PointParts {
    signed char part[8]; // [slot] lowest slot of its part; -1: void
    unsigned owns;       // bit s: part s has a vertex
    unsigned outer;      // bit s: part s has a face there beyond which there is no other solid
} PointParts;

// Joins the parts of two slots.
static inline void point_parts_join(signed char part[8], int a, int b)
{
    signed char low = part[a] < part[b] ? part[a] : part[b];
    signed char high = part[a] < part[b] ? part[b] : part[a];
    for (int s = 0; s < 8; s++)
        if (part[s] == high)
            part[s] = low;
}

// Computes the parts around a point. Slots hold leaves (-1: void), `corners` the slots whose leaf
// has the point as a corner, `broken` the faces that do not connect. Slots of one leaf are
// connected regardless of the faces between them; a part owns a vertex when the point is a corner
// of one of its leaves.
static inline PointParts point_parts(const int slot[8], unsigned corners, unsigned broken)
{
    PointParts parts = {.owns = 0};
    for (int s = 0; s < 8; s++)
        parts.part[s] = (signed char)(slot[s] < 0 ? -1 : s);
    unsigned open = 0; // slots with a face that does not connect
    for (int f = 0; f < 12; f++) {
        int low = POINT_FACE[f], high = low + (1 << f / 4);
        if (slot[low] >= 0 && slot[high] >= 0 && (slot[low] == slot[high] || !(broken >> f & 1)))
            point_parts_join(parts.part, low, high);
        else
            open |= 1u << low | 1u << high;
    }
    for (int s = 0; s < 8; s++)
        if (parts.part[s] >= 0) {
            parts.owns |= (corners >> s & 1) << parts.part[s];
            parts.outer |= (open >> s & 1) << parts.part[s];
        }
    return parts;
}

// Returns what a vertex's id adds to the index of its point, in multiples of the number of points:
// nothing for the part with the lowest solid slot; for others their lowest slot. Cuts and divisions
// only make parts smaller, so that an id stays with the part that holds that slot.
static inline int point_parts_rank(const PointParts *parts, int part)
{
    for (int s = 0; s < part; s++)
        if (parts->part[s] >= 0)
            return part;
    return 0;
}

#endif
