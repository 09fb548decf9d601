// A hash that differs between scenes whose motions differ. Private to scene/.
#ifndef PLIANT_SCENE_PHYSICS_HASH_H
#define PLIANT_SCENE_PHYSICS_HASH_H

#include "scene/build.h"

// Hashes everything that determines the motion: rate, gravity, meshes, materials, tools and loads.
// Excludes publishing, network settings and how the start was settled.
uint64_t physics_hash(const Scene *scene, const World *world);

#endif
