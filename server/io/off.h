// Object File Format (Geomview's OFF), ASCII. Load time only; private to io.
#ifndef PLIANT_IO_OFF_H
#define PLIANT_IO_OFF_H

#include "io/text.h"
#include "geometry/mesh_draft.h"

#include <stdio.h>

// True if the text begins with OFF, COFF, NOFF, CNOFF or STOFF, or with a variant that off_read
// refuses by name.
bool off_is(const FileBytes *file);
// Adds vertices and faces to a draft, or fails naming file and line.
bool off_read(const FileBytes *file, MeshDraft *draft, Status *status);

// Writes a mesh as OFF text; every number reads back as the same value.
void off_write(const TriMesh *mesh, FILE *out);

#endif
