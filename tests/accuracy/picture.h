// SPDX-License-Identifier: MIT
// Polygons in space as commands for gnuplot: parallel projection, far ones first, those that face
// away left out, shaded by their slope.
#ifndef PLIANT_TESTS_ACCURACY_PICTURE_H
#define PLIANT_TESTS_ACCURACY_PICTURE_H

#include "base/vec.h"

#include <stdbool.h>
#include <stdio.h>

enum { PICTURE_CORNERS = 4 };

typedef struct PicturePatch {
    double x[PICTURE_CORNERS], y[PICTURE_CORNERS]; // projected [m]
    double depth;                                  // towards the eye [m]
    unsigned colour;                               // RGB
    int count;
} PicturePatch;

typedef struct Picture {
    Vec3 right, up, eye; // unit
    int count, capacity;
    PicturePatch *patch;
} Picture;

// Seen from the direction `eye`, with z upwards.
void picture_create(Picture *picture, Vec3 eye);
void picture_destroy(Picture *picture);
// Corners counter-clockwise as seen from outside, at most PICTURE_CORNERS.
void picture_add(Picture *picture, const Vec3 *corner, int count, unsigned colour);
// Objects and ranges for gnuplot's `load`. `edge`: edges are drawn, a shade darker.
void picture_write(Picture *picture, bool edge, FILE *out);

// Between two colours, at a share in [0, 1].
unsigned colour_mix(unsigned from, unsigned to, double share);

#endif
