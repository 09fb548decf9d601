// Lattices in prepared files.
#include "scene/prepared_parts.h"

#include "base/check.h"
#include "scene/body_voxels.h"
#include "io/volume_import.h"
#include "geometry/mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#if defined(PLIANT_WITH_HDF5) && defined(PLIANT_WITH_LATTICES)

// Hashes the source files: for a detached header both.
static bool hash_files(const VoxelSource *source, uint64_t *hash, Status *status)
{
    char *data = NULL;
    bool ok = (source->kind != VOXELS_FILE || volume_find_data(source->file, &data, status)) &&
              prepared_hash_file(hash, source->file, status) &&
              (data == NULL || prepared_hash_file(hash, data, status));
    free(data);
    return ok;
}

static bool hash_source(const VoxelSource *source, uint64_t *hash, Status *status)
{
    *hash = fnv_bytes(FNV_START, "voxels", sizeof "voxels");
    fnv_int(hash, source->kind);
    fnv_int(hash, source->label_count);
    for (int i = 0; i < source->label_count; i++)
        fnv_int(hash, source->label[i]);
    for (int k = 0; k < 3; k++)
        fnv_int(hash, source->count[k]);
    fnv_real(hash, source->radius);
    fnv_real(hash, source->size);
    fnv_real(hash, source->scale);
    fnv_vector(hash, source->rotation);
    fnv_vector(hash, source->translation);
    return source->file == NULL || hash_files(source, hash, status);
}

// --- writing -------------------------------------------------------------------------------------

static bool write_lattice(const HdfFile *file, const SceneBody *body, const Lattice *lattice)
{
    char name[PREPARED_NAME];
    uint64_t source;
    const double turn[] = {lattice->turn.w, lattice->turn.x, lattice->turn.y, lattice->turn.z};
    const hsize_t cells =
        (hsize_t)lattice->count[0] * (hsize_t)lattice->count[1] * (hsize_t)lattice->count[2];
    const hsize_t three = 3, four = 4, row[2] = {1, 3};
    return hash_source(&body->voxels, &source, file->status) &&
           hdf_write(file, prepared_path(name, body->name, "/count"), H5T_NATIVE_INT, 1, &three,
                     lattice->count, "1") &&
           hdf_write(file, prepared_path(name, body->name, "/label"), H5T_NATIVE_UINT8, 1, &cells,
                     lattice->label, "1") &&
           hdf_write(file, prepared_path(name, body->name, "/size"), H5T_NATIVE_DOUBLE, 0, NULL,
                     &lattice->size, "m") &&
           hdf_write(file, prepared_path(name, body->name, "/origin"), H5T_NATIVE_DOUBLE, 2, row,
                     &lattice->origin, "m") &&
           hdf_write(file, prepared_path(name, body->name, "/turn"), H5T_NATIVE_DOUBLE, 1, &four,
                     turn, "1") &&
           prepared_write_source(file, body, source);
}

bool prepared_write_voxels(const HdfFile *file, const SceneBody *body, FILE *report)
{
    Lattice lattice = {0};
    bool ok = body_voxels_make(&body->voxels, &lattice, file->status) &&
              write_lattice(file, body, &lattice);
    if (ok)
        fprintf(report, "body %s: %d x %d x %d cells of %.6g m, %ld solid\n", body->name,
                lattice.count[0], lattice.count[1], lattice.count[2], lattice.size,
                lattice_solid(&lattice));
    lattice_destroy(&lattice);
    return ok;
}

// --- reading -------------------------------------------------------------------------------------

// Allocates the labels after checking that the file holds so many.
static bool reserve_lattice(const HdfFile *file, const char *body, Lattice *lattice)
{
    char name[PREPARED_NAME];
    int count[3];
    double size;
    if (!hdf_read_numbers(file, prepared_path(name, body, "/count"), H5T_NATIVE_INT, 3, count) ||
        !hdf_read_numbers(file, prepared_path(name, body, "/size"), H5T_NATIVE_DOUBLE, 0, &size))
        return false;
    int64_t cells = hdf_count_ints(file, prepared_path(name, body, "/label"), 1), wanted = 1;
    if (cells < 0)
        return false;
    for (int k = 0; k < 3; k++)
        wanted = count[k] < 1 || wanted > cells ? 0 : wanted * count[k];
    if (wanted != cells)
        return hdf_fail(file, name, "has %lld cells, the lattice %d x %d x %d", (long long)cells,
                        count[0], count[1], count[2]);
    Status said = {0};
    if (!lattice_create(lattice, count, size, &said))
        return hdf_fail(file, prepared_path(name, body, ""), "%s", said.text);
    double extent = size * fmax(count[0], fmax(count[1], count[2]));
    return mesh_extent_fits(extent) || hdf_fail(file, prepared_path(name, body, "/size"),
                                                "makes a body of %g m, outside [%g, %g]", extent,
                                                MESH_SMALLEST_EXTENT, MESH_LARGEST_EXTENT);
}

// True if every label has a material and some cell is solid.
static bool check_labels(const Lattice *lattice, int materials)
{
    size_t cells =
        (size_t)lattice->count[0] * (size_t)lattice->count[1] * (size_t)lattice->count[2];
    int most = 0;
    for (size_t i = 0; i < cells; i++)
        most = lattice->label[i] > most ? lattice->label[i] : most;
    return most > 0 && most <= materials && lattice_solid(lattice) <= LATTICE_MOST_SOLID;
}

static bool read_lattice(const HdfFile *file, const SceneBody *body, Lattice *lattice)
{
    char name[PREPARED_NAME];
    uint64_t source;
    double turn[4];
    if (!hash_source(&body->voxels, &source, file->status) ||
        !prepared_check_source(file, body, source, "source of voxels") ||
        !reserve_lattice(file, body->name, lattice))
        return false;
    size_t cells =
        (size_t)lattice->count[0] * (size_t)lattice->count[1] * (size_t)lattice->count[2];
    if (!hdf_read_bytes(file, prepared_path(name, body->name, "/label"), cells, lattice->label))
        return false;
    if (!check_labels(lattice, body->voxels.label_count))
        return hdf_fail(file, name, "has no solid cell, too many, or one without a material");
    const Vec3 *origin = &lattice->origin;
    if (!hdf_read_vectors(file, prepared_path(name, body->name, "/origin"), 1, &lattice->origin))
        return false;
    if (!(fmax(fabs(origin->x), fmax(fabs(origin->y), fabs(origin->z))) <= LATTICE_FARTHEST))
        return hdf_fail(file, name, "lies farther than %g m away", LATTICE_FARTHEST);
    if (!hdf_read_numbers(file, prepared_path(name, body->name, "/turn"), H5T_NATIVE_DOUBLE, 4,
                          turn))
        return false;
    lattice->turn = (Quat){turn[0], turn[1], turn[2], turn[3]};
    double norm = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2] + turn[3] * turn[3];
    return fabs(norm - 1.0) <= 1e-9 || hdf_fail(file, name, "is no unit quaternion");
}

bool prepared_read_voxels(const Prepared *prepared, const SceneBody *body, Lattice *lattice,
                          Status *status)
{
    HdfFile file = prepared->file;
    file.status = status;
    return read_lattice(&file, body, lattice) && hdf_alive(&file);
}

#else

// Without HDF5 there are no prepared files.
#ifdef PLIANT_WITH_HDF5
bool prepared_write_voxels(const HdfFile *file, const SceneBody *body, FILE *report)
{
    (void)file, (void)body, (void)report;
    return false;
}
#endif

bool prepared_read_voxels(const Prepared *prepared, const SceneBody *body, Lattice *lattice,
                          Status *status)
{
    (void)prepared, (void)body, (void)lattice, (void)status;
    return false;
}

#endif
