// Reads the initial state of a body. Called once a body, at load.
#include "files/checkpoint.h"
#include "files/hdf.h"

#include "base/check.h"

#include <stdlib.h>

#ifdef PLIANT_WITH_HDF5

// Rows of the source mesh to rows of the welded one.
static void keep_welded(const TriMesh *mesh, int64_t rows, Vec3 *row)
{
    if (rows == mesh->node_count)
        return;
    // file_index ascends and is never below its own index: rows move down over rows already read.
    for (int i = 0; i < mesh->node_count; i++)
        row[i] = row[mesh->file_index[i]];
}

static Vec3 *read_rows(const HdfFile *file, const char *name, const TriMesh *mesh)
{
    int64_t rows = hdf_count_vectors(file, name);
    if (rows < 0)
        return NULL;
    if (rows != mesh->node_count && rows != mesh->file_node_count) {
        if (mesh->node_count == mesh->file_node_count)
            hdf_fail(file, name, "has %lld rows, the mesh %d nodes", (long long)rows,
                     mesh->node_count);
        else
            hdf_fail(file, name, "has %lld rows, the mesh file %d nodes (%d after welding)",
                     (long long)rows, mesh->file_node_count, mesh->node_count);
        return NULL;
    }
    Vec3 *row = malloc((size_t)rows * sizeof *row + 1);
    ASSERT(row != NULL);
    if (!hdf_read_vectors(file, name, rows, row)) {
        free(row);
        return NULL;
    }
    keep_welded(mesh, rows, row);
    return row;
}

bool initial_read(const char *path, const TriMesh *mesh, Vec3 **position, Vec3 **velocity,
                  Status *status)
{
    HdfFile file;
    *position = *velocity = NULL;
    if (!hdf_open(&file, path, status))
        return false;
    *position = read_rows(&file, "/position", mesh);
    if (*position != NULL) {
        if (hdf_exists(&file, "/velocity"))
            *velocity = read_rows(&file, "/velocity", mesh);
        else
            *velocity = calloc((size_t)mesh->node_count + 1, sizeof **velocity);
    }
    hdf_close(&file);
    if (*velocity != NULL)
        return true;
    free(*position);
    *position = NULL;
    return false;
}

#else

bool initial_read(const char *path, const TriMesh *mesh, Vec3 **position, Vec3 **velocity,
                  Status *status)
{
    (void)mesh;
    *position = *velocity = NULL;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

#endif
