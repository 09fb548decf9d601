// SPDX-License-Identifier: MIT
// The parts of world_build: bodies of each model, their meshes and lattices, and whether there is
// memory for them. Private to scene/ and its tests.
#ifndef PLIANT_SCENE_BUILD_PARTS_H
#define PLIANT_SCENE_BUILD_PARTS_H

#include "base/memory.h"
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

// True if a body has a smooth surface: it is shown, or tools feel it.
bool build_is_fitted(const Scene *scene, const SceneBody *body);

// Texture coordinates by node id (Body.texture); uv NULL: none, or not published.
typedef struct Texture {
    const float (*uv)[2];
    int count;
} Texture;

// Takes the coordinates from a mesh, which loses them. Midpoints of its levels (NULL: no levels)
// get the mean of their parents.
Texture build_texture(World *world, const Scene *scene, const BuildOptions *options,
                      const char *name, TriMesh *mesh, const Levels *levels);

// Makes the look of a body (Body.look) in the arena; NULL: the scene names none. `lattice`: of a
// body of cells, placed in the world; else NULL. Returns false with a `status` that names the image
// and its fault.
bool build_look(World *world, const SceneBody *body, const Lattice *lattice, bool heats,
                const BodyLook **look, Status *status);

// --- meshes, as the scene describes and places them, and their levels ----------------------------

// Checks that a mesh has the size of an organ within orders of magnitude; otherwise its unit is
// wrong. Returns false with a `status` that names the file and the scale that was used.
bool body_mesh_check_extent(const char *file, double scale, const TriMesh *mesh, Status *status);

// Imports a mesh, repairs it (the repairs are logged) and places it as mesh_place does. Returns
// false with `status` also if the placed mesh is larger or smaller than any organ. The mesh belongs
// to the caller in any case.
bool body_mesh_import(const char *file, double scale, Vec3 rotation, Vec3 translation,
                      TriMesh *mesh, Status *status);

// Generates the mesh, or imports and repairs it, places it, checks that it is fit for simulation
// (mesh_check) and, with levels > 0, subdivides it. The hierarchy belongs to the arena. Returns
// false with a `status` that names the mesh file and the fault; the mesh belongs to the caller in
// any case.
bool body_mesh_make(const SceneBody *body, TriMesh *mesh, Levels *levels, Arena *arena,
                    Status *status);
// Makes the skin of a voxel body in the same way, without levels.
bool body_skin_make(const SceneBody *body, TriMesh *mesh, Status *status);

// --- memory --------------------------------------------------------------------------------------

// Checks that the machine has the memory of a body before it is allocated, so that a scene that is
// too large is refused with a sentence instead of being killed. Load time only.

// Returns the memory that can still be allocated [bytes]: the least of what the machine, the limits
// of this process and its control group leave. HUGE_VAL if unknown.
double memory_free(void);

// Check a body as soon as its size is known: `nodes` of level 0 of a surface body, `cells` of a
// voxel body. They use lower bounds, from figures that --explain prints for small scenes, so that
// no scene is refused that would fit. Return false with `status`.
bool memory_check_surface(const SceneBody *body, double nodes, Status *status);
bool memory_check_voxel(const SceneBody *body, double cells, Status *status);

// Returns the nodes that a generator will make; 0: a file, whose own size decides.
double memory_source_nodes(const MeshSource *source);

// --- lattices ------------------------------------------------------------------------------------

// Imports a volume or a mesh, or generates the lattice, and places it. Keeps cells that share no
// face with the others, with a warning. Returns false with a `status` that names the file and the
// fault; if true, the lattice belongs to the caller.
bool body_voxels_make(const VoxelSource *source, Lattice *lattice, Status *status);
// Also makes the field of its smooth surface, which then belongs to the caller; NULL: not wanted.
bool body_voxels_fit(const VoxelSource *source, Lattice *lattice, SurfaceField *field,
                     Status *status);

#endif
