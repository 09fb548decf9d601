// Functions by which world_build makes a body of each model. Private to scene/.
#ifndef PLIANT_SCENE_BUILD_PARTS_H
#define PLIANT_SCENE_BUILD_PARTS_H

#include "scene/build.h"
#include "scene/prepared.h"

// Each makes body `index` of the scene and adds it to the sim; `prepared` may be NULL. Returns
// false with a `status` that does not name the scene file yet.
bool build_surface(World *world, const Scene *scene, int index, const Prepared *prepared,
                   const BuildOptions *options, Status *status);
bool build_voxel(World *world, const Scene *scene, int index, const Prepared *prepared,
                 const BuildOptions *options, Status *status);

// Sets the options that the scene reader cannot know: gravity, precision, kernels, threads, and
// which features nothing uses.
void build_complete(BodyOptions *body, const World *world, const Scene *scene,
                    const BuildOptions *options);

// Texture coordinates by node id (Body.texture); uv NULL: none, or not published.
typedef struct Texture {
    const float (*uv)[2];
    int count;
} Texture;

// Takes the coordinates from a mesh, which loses them. Midpoints of its levels (NULL: no levels)
// get the mean of their parents.
Texture build_texture(World *world, const Scene *scene, const BuildOptions *options,
                      const char *name, TriMesh *mesh, const Levels *levels);

#endif
