// Wavefront OBJ. Load time only; private to files.
#ifndef PLIANT_FILES_OBJ_H
#define PLIANT_FILES_OBJ_H

#include "files/text.h"
#include "geometry/mesh.h"

// Creates an unwelded mesh from v and f lines, or fails naming file and line and creates nothing.
bool obj_read(const FileBytes *file, TriMesh *mesh, Status *status);

#endif
