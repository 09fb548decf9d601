// SPDX-License-Identifier: MIT
// Imports a mesh from a text, through a file of its own in the scratch folder.
#ifndef PLIANT_TESTS_IMPORT_TEXT_H
#define PLIANT_TESTS_IMPORT_TEXT_H

#include "expect.h"
#include "scratch_folder.h"

#include "io/mesh_import.h"

// What the import says: "" when it succeeds, else the error behind the file's name.
static inline const char *import_bytes(const void *bytes, size_t size, TriMesh *mesh,
                                       MeshImport *import)
{
    static char said[512];
    const char *path = scratch_at("organ");
    Status status = {0};
    scratch_write(&scratch_space, "organ", bytes, size);
    if (mesh_import(path, mesh, import, &status))
        return "";
    assert_int_equal(status.code, STATUS_INVALID);
    assert_int_equal(strncmp(status.text, path, strlen(path)), 0);
    assert_null(strchr(status.text, '\n'));
    snprintf(said, sizeof said, "%s", status.text + strlen(path));
    return said;
}

static inline const char *import_text(const char *text, TriMesh *mesh, MeshImport *import)
{
    return import_bytes(text, strlen(text), mesh, import);
}

#endif
