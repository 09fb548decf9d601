// Prepared models: what the off-line phase (Choi et al. 2005, section 3) makes of the meshes and
// volumes of a scene, in HDF5, so that a daemon starts without generating, repairing and dividing
// them. Only what follows from `mesh` and `levels` of surface bodies and `voxels` of voxel bodies
// is stored: all other keys of the scene may change.
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
#ifndef PLIANT_FILES_PREPARED_H
#define PLIANT_FILES_PREPARED_H

#include "base/arena.h"
#include "files/scene.h"
#include "geometry/lattice.h"

// Makes the meshes, levels and lattices of all bodies of a scene and writes them; prints one line a
// body. False with `status` naming scene file and line, or the file that cannot be written.
bool prepared_write(const char *path, const Scene *scene, FILE *report, Status *status);

typedef struct Prepared Prepared; // a file open for reading

// False with `status`: no such file, not whole, altered, of another format or version.
bool prepared_open(Prepared **prepared, const char *path, Status *status);
// Reads the mesh of a body (owned by the caller, also after a failure) and, if it has levels, the
// hierarchy, which belongs to the arena. Every size and index is checked: what comes out is fit for
// simulation, and numbered as body_mesh_make and levels_create do. False with `status`: prepared
// for another mesh, other levels, or not consistent.
bool prepared_read(const Prepared *prepared, const SceneBody *body, TriMesh *mesh, Levels *levels,
                   Arena *arena, Status *status);
// Reads the lattice of a voxel body in the same way; it is as body_voxels_make makes it.
bool prepared_read_voxels(const Prepared *prepared, const SceneBody *body, Lattice *lattice,
                          Status *status);
void prepared_close(Prepared *prepared);

#endif
