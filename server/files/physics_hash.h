// A hash that differs between scenes whose motions differ. Private to files/.
#ifndef PLIANT_FILES_PHYSICS_HASH_H
#define PLIANT_FILES_PHYSICS_HASH_H

#include "files/build.h"

// Hashes everything that determines the motion: rate, gravity, meshes, materials, tools and loads.
// Excludes publishing, network settings and how the start was settled.
uint64_t physics_hash(const Scene *scene, const World *world);

#endif
