// SPDX-License-Identifier: MIT
// The look of a body: colours by where its nodes lie at rest. Made at load time, constant from then
// on; for the threads that publish and record. The motion does not depend on it.
#ifndef PLIANT_BODY_LOOK_H
#define PLIANT_BODY_LOOK_H

#include "base/vec.h"

#include <stdbool.h>
#include <stddef.h>

enum { LOOK_LABELS = 256 };

// Red, green and blue, 0 to 255 of sRGB.
typedef struct LookColours {
    unsigned char outside[3];
    unsigned char inside[3]; // of walls of cuts
} LookColours;

// Values on a grid that is placed in the world as the body is at rest: point x has the coordinates
// axis[a] . (x - origin), whole numbers in the middle of voxels.
typedef struct LookGrid {
    int count[3];               // of voxels along its axes; 0: there is no grid
    Vec3 origin;                // [m]
    Vec3 axis[3];               // [1/m]
    const unsigned char *value; // x fastest: labels, or three numbers of a colour
} LookGrid;

struct BodyLook {
    LookColours usual;
    LookColours of_label[LOOK_LABELS]; // by label of `labels`; 0: void
    LookGrid labels, image;            // of one byte and of three
    const char *texture;               // file as the scene names it, "": none
};
typedef struct BodyLook BodyLook;

// True if nodes differ in colour.
static inline bool look_varies(const BodyLook *look)
{
    return look->labels.count[0] > 0 || look->image.count[0] > 0;
}

// Makes a grid of these voxels: `origin` is the middle of the first one, `step` leads to its
// neighbours along the axes, which are perpendicular.
LookGrid look_grid(const int count[3], Vec3 origin, const Vec3 step[3], const unsigned char *value);

// Turns colours to the pale one of coagulated tissue, by its share, 0 to 255.
void look_coagulate(LookColours *colours, int share);

// Finds the colours of a node that lies there at rest [m]: those of the labels around it, linear
// between the middles of voxels so that borders have no steps, without void ones; or, since a
// smooth surface leaves the cells, of the nearest label at most two voxels away. Inside, if there
// is an image, its colour there, linear likewise.
LookColours look_colours(const BodyLook *look, const float rest[3]);

#endif
