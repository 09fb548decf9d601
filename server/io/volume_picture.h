// SPDX-License-Identifier: MIT
// Reads pictures: volumes of grey values or colours, as scanners give them, from the same files as
// label volumes.
#ifndef PLIANT_IO_VOLUME_PICTURE_H
#define PLIANT_IO_VOLUME_PICTURE_H

#include "base/check.h"
#include "base/vec.h"
#include "geometry/lattice.h"

enum { PICTURE_MOST_VALUES = 1 << 26 }; // around a body

// Where a body's labels are, from the frame of their file: rotation (scale x) + translation.
typedef struct PicturePlace {
    double scale;
    Vec3 rotation, translation;
} PicturePlace;

// The part of a picture that is around a body, in the world. Voxel (i, j, k) has its centre at
// origin + i axis[0] + j axis[1] + k axis[2].
typedef struct VolumePicture {
    int count[3];
    Vec3 origin, axis[3];  // [m]
    unsigned char *colour; // x fastest, red, green and blue, 0 to 255; owned, malloc'ed
} VolumePicture;

// Reads the part around the solid cells of a lattice, which is placed in the world by `place`.
// Values from `black` to `white` become grey, or each of red, green and blue, from 0 to 255; if
// both are equal, bytes are taken as they are, and of other types the values at 1 % and 99 % of
// those around the body. Returns false with a status that names the file: no such file, not one or
// three (or four: the last one is not used) values a voxel, one that is not finite, cells that the
// picture does not cover by more than a voxel, more values than PICTURE_MOST_VALUES.
bool volume_import_picture(const char *path, const Lattice *lattice, const PicturePlace *place,
                           double black, double white, VolumePicture *picture, Status *status);
void volume_picture_destroy(VolumePicture *picture);

#endif
