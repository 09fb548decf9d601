// Mesh files to TriMesh: OBJ and STL (ASCII and binary), told apart by content, not by name.
#ifndef PLIANT_FILES_MESH_IMPORT_H
#define PLIANT_FILES_MESH_IMPORT_H

#include "base/status.h"
#include "geometry/mesh.h"

// Reads a mesh: nodes with bit-equal positions welded, order kept; not scaled, not validated beyond
// what the format says. Errors name the file and its line (ASCII) or triangle (binary).
bool mesh_import(const char *path, TriMesh *mesh, Status *status);

#endif
