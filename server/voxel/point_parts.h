// Which of the cells around a lattice point hold together there, and so share a vertex. A pure
// function of the leaves and of the faces that do not join.
#ifndef PLIANT_VOXEL_POINT_PARTS_H
#define PLIANT_VOXEL_POINT_PARTS_H

// The 12 faces in which the 8 cells around a lattice point (slots, x + 2 y + 4 z) meet: bit 4 d + i
// of a set of faces is the i-th one normal to axis d, between slots POINT_FACE and that + 2^d.
static const unsigned char POINT_FACE[12] = {0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3};

// Which of the leaves around a point hold together there.
typedef struct PointParts {
    signed char part[8]; // [slot] lowest slot of its part; -1: void
    unsigned owns;       // bit s: part s has a vertex
    unsigned outer;      // bit s: part s has a face there that leads to no other solid
} PointParts;

// Makes one part of those of two slots.
static inline void point_parts_join(signed char part[8], int a, int b)
{
    signed char low = part[a] < part[b] ? part[a] : part[b];
    signed char high = part[a] < part[b] ? part[b] : part[a];
    for (int s = 0; s < 8; s++)
        if (part[s] == high)
            part[s] = low;
}

// Slots hold leaves (-1: void), `corners` the slots whose leaf has the point as a corner, `broken`
// the faces that do not join. Slots of one leaf hold together whatever is said of the faces between
// them; a part owns a vertex when the point is a corner of one of its leaves.
static inline PointParts point_parts(const int slot[8], unsigned corners, unsigned broken)
{
    PointParts parts = {.owns = 0};
    for (int s = 0; s < 8; s++)
        parts.part[s] = (signed char)(slot[s] < 0 ? -1 : s);
    unsigned open = 0; // slots with a face that leads nowhere
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

// What a vertex's id adds to the index of its point, in numbers of points: nothing for the part
// with the lowest solid slot, which is its own name; for others their lowest slot. Parts only ever
// become smaller by cuts and divisions, so an id stays with the one that holds that slot.
static inline int point_parts_rank(const PointParts *parts, int part)
{
    for (int s = 0; s < part; s++)
        if (parts->part[s] >= 0)
            return part;
    return 0;
}

#endif
