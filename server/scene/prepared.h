// SPDX-License-Identifier: MIT
// Prepared models: the result of the offline phase (Choi et al. 2005, section 3) for the meshes and
// volumes of a scene, in HDF5. A daemon that uses them starts without generating, repairing and
// subdividing meshes. They depend only on `mesh` and `levels` of surface bodies and `voxels` of
// voxel bodies: all other keys of the scene may change.
//
// Root attributes format, version, scene, created_by. For each surface body /bodies/<name> with
// attributes `source` (hash of the group `mesh` and of the mesh file's bytes), `levels`,
// `file_nodes` and `copies`; triangle [faces][3] and file_index [nodes] of level 0, file_node
// [file_nodes] if nodes of the file were joined or dropped, copy_of [copies] if any were split;
// texture [2 nodes of level 0] u v where the mesh has texture coordinates; position [nodes of the
// finest level][3] at rest; and with levels > 0, for each level l, level<l>/edge [edges][2],
// edge_face [edges][2] and face_edge [faces][3] (geometry/levels.h). For each voxel body
// /bodies/<name> with attribute `source` (hash of the group `voxels` and of its file's bytes);
// count [3], size, origin [1][3], turn [4] and label [cells] of its lattice as it stands in the
// world (geometry/lattice.h). Sealed like checkpoints.
#ifndef PLIANT_SCENE_PREPARED_H
#define PLIANT_SCENE_PREPARED_H

#include "base/memory.h"
#include "scene/scene.h"
#include "geometry/lattice.h"

// Makes the meshes, levels and lattices of all bodies of a scene and writes them; prints one line
// per body. Returns false with a `status` that names scene file and line, or the file that cannot
// be written.
bool prepared_write(const char *path, const Scene *scene, FILE *report, Status *status);

typedef struct Prepared Prepared; // a file open for reading

// Opens a file. Returns false with `status` if it is missing, incomplete, altered, or of another
// format or version.
bool prepared_open(Prepared **prepared, const char *path, Status *status);
// Reads the mesh of a body (owned by the caller, also after a failure) and, if it has levels, the
// hierarchy, which belongs to the arena. Checks every size and index: the result is fit for
// simulation and numbered as by body_mesh_make and levels_create. Returns false with `status` if
// the file was prepared for another mesh or other levels, or is inconsistent.
bool prepared_read(const Prepared *prepared, const SceneBody *body, TriMesh *mesh, Levels *levels,
                   Arena *arena, Status *status);
// Reads the lattice of a voxel body in the same way; it equals that of body_voxels_make.
bool prepared_read_voxels(const Prepared *prepared, const SceneBody *body, Lattice *lattice,
                          Status *status);
void prepared_close(Prepared *prepared);

#endif
