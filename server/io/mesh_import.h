// Reads mesh files to TriMesh: OBJ, STL and PLY (ASCII and binary), OFF, recognised by content, not
// by name.
#ifndef PLIANT_IO_MESH_IMPORT_H
#define PLIANT_IO_MESH_IMPORT_H

#include "base/status.h"
#include "geometry/mesh_repair.h"

// Contents of a file and the repairs that were needed.
typedef struct MeshImport {
    const char *format; // "binary STL"
    int node_count, face_count;
    MeshRepairs repairs;
} MeshImport;

// Reads a mesh and makes it fit for simulation (geometry/mesh_repair.h): nodes in the order of the
// file, not scaled. Errors are one sentence that names the file and its line or element; faces and
// nodes count from 0 in the order of the file.
bool mesh_import(const char *path, TriMesh *mesh, MeshImport *import, Status *status);

#endif
