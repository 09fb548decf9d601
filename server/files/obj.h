// Wavefront OBJ. Load time only; private to files.
#ifndef PLIANT_FILES_OBJ_H
#define PLIANT_FILES_OBJ_H

#include "files/text.h"
#include "geometry/mesh_draft.h"

// Adds what v, vt and f lines say to a draft, or fails naming file and line. Faces that name
// vertices that are not there are refused, texture coordinates that are not there are passed over.
bool obj_read(const FileBytes *file, MeshDraft *draft, Status *status);

#endif
