// SPDX-License-Identifier: MIT
// Imports a mesh from a text, through a file of its own in a scratch folder.
#ifndef PLIANT_TESTS_IMPORT_TEXT_H
#define PLIANT_TESTS_IMPORT_TEXT_H

#include "expect.h"
#include "scratch.h"

#include "io/mesh_import.h"

// What the import says: "" when it succeeds, else the error behind the file's name.
static inline const char *import_bytes(const Scratch *scratch, const void *bytes, size_t size,
                                       TriMesh *mesh, MeshImport *import)
{
    static char said[512];
    char path[SCRATCH_PATH];
    Status status = {0};
    scratch_write(scratch, "organ", bytes, size);
    if (mesh_import(scratch_path(scratch, "organ", path), mesh, import, &status))
        return "";
    assert_int_equal(status.code, STATUS_INVALID);
    assert_int_equal(strncmp(status.text, path, strlen(path)), 0);
    assert_null(strchr(status.text, '\n'));
    snprintf(said, sizeof said, "%s", status.text + strlen(path));
    return said;
}

static inline const char *import_text(const Scratch *scratch, const char *text, TriMesh *mesh,
                                      MeshImport *import)
{
    return import_bytes(scratch, text, strlen(text), mesh, import);
}

#endif
