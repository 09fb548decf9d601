// The mesh that a scene asks for, where the body stands in the world, and its levels.
#ifndef PLIANT_FILES_BODY_MESH_H
#define PLIANT_FILES_BODY_MESH_H

#include "base/arena.h"
#include "files/scene.h"

// What is not of the size of an organ, by orders of magnitude, was given in other units: false with
// a `status` that names the file and the scale it was taken at.
bool body_mesh_check_extent(const char *file, double scale, const TriMesh *mesh, Status *status);

// Imports (and repairs, which is logged) a mesh and places it as mesh_place does. False with
// `status` also when it is then larger or smaller than any organ. The mesh belongs to the caller in
// any case.
bool body_mesh_import(const char *file, double scale, Vec3 rotation, Vec3 translation,
                      TriMesh *mesh, Status *status);

// Generates or imports (and repairs, which is logged) the mesh, places it, checks that it is fit
// for simulation (mesh_validate), and, with levels > 0, divides it; the hierarchy belongs to the
// arena. False with `status` naming the mesh file and what is wrong; the mesh belongs to the caller
// in any case.
bool body_mesh_make(const SceneBody *body, TriMesh *mesh, Levels *levels, Arena *arena,
                    Status *status);
// The skin of a voxel body in the same way, without levels.
bool body_skin_make(const SceneBody *body, TriMesh *mesh, Status *status);

#endif
