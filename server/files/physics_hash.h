// A number that tells apart scenes whose motions differ. Private to files/.
#ifndef PLIANT_FILES_PHYSICS_HASH_H
#define PLIANT_FILES_PHYSICS_HASH_H

#include "files/build.h"

// Over everything that moves the bodies: rate, gravity, meshes, materials, tools and loads. What is
// published, how the daemon is reached and how the start was settled do not count.
uint64_t physics_hash(const Scene *scene, const World *world);

#endif
