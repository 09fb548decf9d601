// Readers of mesh formats. Load time only; private to io, but for off_write.
#ifndef PLIANT_IO_MESH_FORMATS_H
#define PLIANT_IO_MESH_FORMATS_H

#include "geometry/mesh_draft.h"
#include "io/text.h"

#include <stdio.h>

// Wavefront OBJ: adds the v, vt and f lines to a draft, or fails with file and line. Refuses faces
// with missing vertices; ignores references to missing texture coordinates.
bool obj_read(const FileBytes *file, MeshDraft *draft, Status *status);

// Object File Format (Geomview's OFF), ASCII.
// True if the text begins with OFF, COFF, NOFF, CNOFF or STOFF, or with a variant that off_read
// refuses by name.
bool off_is(const FileBytes *file);
// Adds vertices and faces to a draft, or fails naming file and line.
bool off_read(const FileBytes *file, MeshDraft *draft, Status *status);

// Writes a mesh as OFF text; every number reads back as the same value.
void off_write(const TriMesh *mesh, FILE *out);

// Stanford PLY: ASCII, binary little and big endian.
// True if the file begins as a PLY file does.
bool ply_is(const FileBytes *file);
// Adds the elements vertex and face to a draft, or fails with file and line or element. Sets
// `format` to "ASCII PLY" and the like.
bool ply_read(const FileBytes *file, MeshDraft *draft, const char **format, Status *status);

// STL, ASCII and binary.
// Each adds triangles to a draft, three nodes per triangle, or fails with file and line.
bool stl_read_ascii(const FileBytes *file, MeshDraft *draft, Status *status);
// The file's size must be stl_binary_size(stl_binary_count(file)).
bool stl_read_binary(const FileBytes *file, MeshDraft *draft, Status *status);

// Return the number of triangles that a binary STL announces (0 if the file is shorter than a
// header), and the file size [bytes] of that many.
size_t stl_binary_count(const FileBytes *file);
size_t stl_binary_size(size_t triangles);

#endif
