// SPDX-License-Identifier: MIT
// Axis-aligned boxes.
#ifndef PLIANT_GEOMETRY_BOX_H
#define PLIANT_GEOMETRY_BOX_H

#include "base/vec.h"

#include <math.h>
#include <stdbool.h>

typedef struct Box {
    double low[3], high[3]; // low > high: holds no point
} Box;

static inline Box box_empty(void)
{
    const double infinite = (double)INFINITY;
    return (Box){{infinite, infinite, infinite}, {-infinite, -infinite, -infinite}};
}

// Enlarges the box to hold x.
static inline void box_add(Box *box, Vec3 x)
{
    const double at[3] = {x.x, x.y, x.z};
    for (int c = 0; c < 3; c++) {
        box->low[c] = at[c] < box->low[c] ? at[c] : box->low[c];
        box->high[c] = at[c] > box->high[c] ? at[c] : box->high[c];
    }
}

// Moves each side out by `margin`.
static inline void box_grow(Box *box, double margin)
{
    for (int c = 0; c < 3; c++) {
        box->low[c] -= margin;
        box->high[c] += margin;
    }
}

static inline bool box_is_empty(const Box *box)
{
    return box->low[0] > box->high[0] || box->low[1] > box->high[1] || box->low[2] > box->high[2];
}

static inline bool box_has(const Box *box, Vec3 x)
{
    return x.x >= box->low[0] && x.x <= box->high[0] && x.y >= box->low[1] && x.y <= box->high[1] &&
           x.z >= box->low[2] && x.z <= box->high[2];
}

// Returns what two boxes have in common once both have grown by `margin`; perhaps nothing.
static inline Box box_common(const Box *a, const Box *b, double margin)
{
    Box box;
    for (int c = 0; c < 3; c++) {
        box.low[c] = fmax(a->low[c], b->low[c]) - margin;
        box.high[c] = fmin(a->high[c], b->high[c]) + margin;
    }
    return box;
}

// Returns the distance between two boxes; 0 if they overlap.
static inline double box_gap(const Box *a, const Box *b)
{
    double sum = 0.0;
    for (int c = 0; c < 3; c++) {
        const double gap = fmax(0.0, fmax(a->low[c] - b->high[c], b->low[c] - a->high[c]));
        sum += gap * gap;
    }
    return sqrt(sum);
}

static inline Vec3 box_low(const Box *box)
{
    return vec3(box->low[0], box->low[1], box->low[2]);
}

static inline Vec3 box_high(const Box *box)
{
    return vec3(box->high[0], box->high[1], box->high[2]);
}

static inline Vec3 box_size(const Box *box)
{
    return vec3_sub(box_high(box), box_low(box));
}

static inline Vec3 box_middle(const Box *box)
{
    return vec3_scale(0.5, vec3_add(box_low(box), box_high(box)));
}

// Returns the longest side.
static inline double box_extent(const Box *box)
{
    const Vec3 size = box_size(box);
    return fmax(size.x, fmax(size.y, size.z));
}

#endif
