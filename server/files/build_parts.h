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

#endif
