// SPDX-License-Identifier: MIT
// Reads the initial state of a body. Called once per body, at load time.
#include "io/checkpoint.h"

#include "io/hdf.h"

#include "base/check.h"

#include <stdlib.h>

#ifdef PLIANT_WITH_HDF5

// Converts rows of the mesh file to rows of its current nodes; frees the former.
static Vec3 *pick_rows(const TriMesh *mesh, Vec3 *row)
{
    Vec3 *picked = malloc((size_t)mesh->node_count * sizeof *picked + 1);
    ASSERT(picked != NULL);
    for (int i = 0; i < mesh->node_count; i++)
        picked[i] = row[mesh_file_row(mesh, i)];
    free(row);
    return picked;
}

static Vec3 *read_vectors(const HdfFile *file, const char *name, int64_t rows)
{
    Vec3 *row = malloc((size_t)rows * sizeof *row + 1);
    ASSERT(row != NULL);
    if (hdf_read_vectors(file, name, rows, row))
        return row;
    free(row);
    return NULL;
}

static Vec3 *read_rows(const HdfFile *file, const char *name, const TriMesh *mesh)
{
    int64_t rows = hdf_count_vectors(file, name);
    if (rows < 0)
        return NULL;
    // By node of the body, or by row of the mesh file before repairs.
    if (rows != mesh->node_count && rows != mesh->file_node_count) {
        if (mesh->node_count == mesh->file_node_count)
            hdf_fail(file, name, "has %lld rows, the mesh %d nodes", (long long)rows,
                     mesh->node_count);
        else
            hdf_fail(file, name, "has %lld rows, the mesh file %d nodes (%d after repairs)",
                     (long long)rows, mesh->file_node_count, mesh->node_count);
        return NULL;
    }
    // Rows of the file are given to the nodes that came from them.
    Vec3 *row = read_vectors(file, name, rows);
    return row != NULL && rows == mesh->file_node_count ? pick_rows(mesh, row) : row;
}

// Returns both arrays or neither.
static bool finish(bool alive, Vec3 **position, Vec3 **velocity)
{
    if (alive && *velocity != NULL)
        return true;
    free(*position);
    free(*velocity);
    *position = *velocity = NULL;
    return false;
}

bool initial_read(const char *path, const TriMesh *mesh, Vec3 **position, Vec3 **velocity,
                  Status *status)
{
    HdfFile file;
    *position = *velocity = NULL;
    if (!hdf_open(&file, path, status))
        return false;
    // Without velocities the body starts at rest.
    *position = read_rows(&file, "/position", mesh);
    if (*position != NULL) {
        if (hdf_exists(&file, "/velocity"))
            *velocity = read_rows(&file, "/velocity", mesh);
        else
            *velocity = calloc((size_t)mesh->node_count + 1, sizeof **velocity);
    }
    // The child may have crashed while it read.
    bool alive = hdf_alive(&file);
    hdf_close(&file);
    return finish(alive, position, velocity);
}

bool initial_read_rows(const char *path, int most, int *count, Vec3 **position, Vec3 **velocity,
                       Status *status)
{
    HdfFile file;
    *position = *velocity = NULL;
    if (!hdf_open(&file, path, status))
        return false;
    // More rows than the body can have are refused before they are read.
    int64_t rows = hdf_count_vectors(&file, "/position");
    if (rows > most)
        hdf_fail(&file, "/position", "has %lld rows, the body at most %d vertices", (long long)rows,
                 most);
    else if (rows >= 0)
        *position = read_vectors(&file, "/position", rows);
    // Without velocities the body starts at rest.
    if (*position != NULL) {
        *count = (int)rows;
        *velocity = hdf_exists(&file, "/velocity") ? read_vectors(&file, "/velocity", rows)
                                                   : calloc((size_t)rows + 1, sizeof **velocity);
    }
    // The child may have crashed meanwhile.
    bool alive = hdf_alive(&file);
    hdf_close(&file);
    return finish(alive, position, velocity);
}

#else

bool initial_read(const char *path, const TriMesh *mesh, Vec3 **position, Vec3 **velocity,
                  Status *status)
{
    (void)mesh;
    *position = *velocity = NULL;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

bool initial_read_rows(const char *path, int most, int *count, Vec3 **position, Vec3 **velocity,
                       Status *status)
{
    (void)most, (void)count;
    *position = *velocity = NULL;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

#endif
