// Wavefront OBJ. Load time only; private to io.
#ifndef PLIANT_IO_OBJ_H
#define PLIANT_IO_OBJ_H

#include "io/text.h"
#include "geometry/mesh_draft.h"

// Adds the v, vt and f lines to a draft, or fails with file and line. Refuses faces with missing
// vertices; ignores references to missing texture coordinates.
bool obj_read(const FileBytes *file, MeshDraft *draft, Status *status);

#endif
