// How world_build makes a body, by its model. Private to files/.
#ifndef PLIANT_FILES_BUILD_PARTS_H
#define PLIANT_FILES_BUILD_PARTS_H

#include "files/build.h"
#include "files/prepared.h"

// Makes body `index` of the scene and adds it to the sim; `prepared` may be NULL. False with
// `status`, which does not name the scene yet.
bool build_surface(World *world, const Scene *scene, int index, const Prepared *prepared,
                   const BuildOptions *options, Status *status);
bool build_voxel(World *world, const Scene *scene, int index, const Prepared *prepared,
                 const BuildOptions *options, Status *status);

// Texture coordinates by node id (Body.texture); uv NULL: none, or nobody is told.
typedef struct Texture {
    const float (*uv)[2];
    int count;
} Texture;

// Takes them from a mesh, which keeps none: midpoints of its levels (NULL: there are none) have the
// mean of their parents'.
Texture build_texture(World *world, const Scene *scene, const BuildOptions *options,
                      const char *name, TriMesh *mesh, const Levels *levels);

#endif
