// Object File Format (Geomview's OFF), ASCII. Load time only; private to files.
#ifndef PLIANT_FILES_OFF_H
#define PLIANT_FILES_OFF_H

#include "files/text.h"
#include "geometry/mesh_draft.h"

// Whether the text begins with OFF, COFF, NOFF, CNOFF or STOFF, or one of the variants that
// off_read refuses by name.
bool off_is(const FileBytes *file);
// Adds vertices and faces to a draft, or fails naming file and line.
bool off_read(const FileBytes *file, MeshDraft *draft, Status *status);

#endif
