// Stanford PLY: ASCII, binary little and big endian. Load time only; private to io.
#ifndef PLIANT_IO_PLY_H
#define PLIANT_IO_PLY_H

#include "io/text.h"
#include "geometry/mesh_draft.h"

// True if the file begins as a PLY file does.
bool ply_is(const FileBytes *file);
// Adds the elements vertex and face to a draft, or fails with file and line or element. Sets
// `format` to "ASCII PLY" and the like.
bool ply_read(const FileBytes *file, MeshDraft *draft, const char **format, Status *status);

#endif
