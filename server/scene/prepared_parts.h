// SPDX-License-Identifier: MIT
// Functions shared by the parts of prepared.c: one source file per model. Private to it.
#ifndef PLIANT_SCENE_PREPARED_PARTS_H
#define PLIANT_SCENE_PREPARED_PARTS_H

#include "base/fnv.h"
#include "io/hdf.h"
#include "scene/prepared.h"

#ifdef PLIANT_WITH_HDF5

enum { PREPARED_NAME = 128 };

struct Prepared {
    HdfFile file;
    char *path;
};

// Returns the name of a body's group, or of an object in it.
const char *prepared_path(char text[PREPARED_NAME], const char *body, const char *rest);
// Adds the bytes of a file that a body is made from to a hash.
bool prepared_hash_file(uint64_t *hash, const char *path, Status *status);
// True if the body has a group, of its model, with this attribute `source`. `noun`: what it was
// made from, "mesh".
bool prepared_check_source(const HdfFile *file, const SceneBody *body, uint64_t source,
                           const char *noun);
bool prepared_write_source(const HdfFile *file, const SceneBody *body, uint64_t source);

// Make the data of one model's body, write it and print a line.
bool prepared_write_mesh(const HdfFile *file, const SceneBody *body, FILE *report);
bool prepared_write_voxels(const HdfFile *file, const SceneBody *body, FILE *report);

#endif

#endif
