// The mesh of a body as the scene describes it, its placement in the world, and its levels.
#ifndef PLIANT_SCENE_BODY_MESH_H
#define PLIANT_SCENE_BODY_MESH_H

#include "base/arena.h"
#include "scene/scene.h"

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

#endif
