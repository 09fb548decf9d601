// STL, ASCII and binary. Load time only; private to io.
#ifndef PLIANT_IO_STL_H
#define PLIANT_IO_STL_H

#include "io/text.h"
#include "geometry/mesh_draft.h"

// Each adds triangles to a draft, three nodes per triangle, or fails with file and line.
bool stl_read_ascii(const FileBytes *file, MeshDraft *draft, Status *status);
// The file's size must be stl_binary_size(stl_binary_count(file)).
bool stl_read_binary(const FileBytes *file, MeshDraft *draft, Status *status);

// Return the number of triangles that a binary STL announces (0 if the file is shorter than a
// header), and the file size [bytes] of that many.
size_t stl_binary_count(const FileBytes *file);
size_t stl_binary_size(size_t triangles);

#endif
