// SPDX-License-Identifier: MIT
// Data sets by the functions of hdf.h.
#include "io/data_file.h"

#include "base/check.h"
#include "io/hdf.h"

#include <stdio.h>
#include <stdlib.h>

#ifdef PLIANT_WITH_HDF5

struct DataFile {
    HdfFile hdf;
};

bool data_file_built(void)
{
    return true;
}

DataFile *data_file_create(const char *path, const char *format, int version, const char *scene,
                           const char *program, Status *status)
{
    char created_by[128];
    DataFile *file = calloc(1, sizeof *file);
    ASSERT(file != NULL);
    snprintf(created_by, sizeof created_by, "%s " PLIANT_VERSION, program);
    // What all our files begin with.
    if (hdf_create(&file->hdf, path, status) && hdf_write_text(&file->hdf, "/", "format", format) &&
        hdf_write_int(&file->hdf, "/", "version", version) &&
        hdf_write_text(&file->hdf, "/", "scene", scene) &&
        hdf_write_text(&file->hdf, "/", "created_by", created_by))
        return file;
    data_file_destroy(file);
    return NULL;
}

bool data_file_write_text(DataFile *file, const char *name, const char *text)
{
    return hdf_write_text(&file->hdf, "/", name, text);
}

static bool write_rows(DataFile *file, const char *name, hid_t type, int rows, int columns,
                       const void *values, const char *unit)
{
    const hsize_t size[2] = {(hsize_t)rows, (hsize_t)columns};
    int rank = columns > 0 ? 2 : rows > 0 ? 1 : 0;
    return hdf_write(&file->hdf, name, type, rank, size, values, unit);
}

bool data_file_write_reals(DataFile *file, const char *name, int rows, int columns,
                           const double *values, const char *unit)
{
    return write_rows(file, name, H5T_NATIVE_DOUBLE, rows, columns, values, unit);
}

bool data_file_write_ints(DataFile *file, const char *name, int rows, const int *values)
{
    return write_rows(file, name, H5T_NATIVE_INT, rows, 0, values, "");
}

bool data_file_write_texts(DataFile *file, const char *name, int rows, int length,
                           const char *texts)
{
    hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, (size_t)length);
    bool ok = write_rows(file, name, type, rows, 0, texts, "");
    H5Tclose(type);
    return ok;
}

bool data_file_save(DataFile *file)
{
    return hdf_save(&file->hdf);
}

void data_file_destroy(DataFile *file)
{
    if (file != NULL)
        hdf_close(&file->hdf);
    free(file);
}

#else

bool data_file_built(void)
{
    return false;
}

DataFile *data_file_create(const char *path, const char *format, int version, const char *scene,
                           const char *program, Status *status)
{
    (void)format, (void)version, (void)scene, (void)program;
    status_fail(status, STATUS_FAILED, "%s: " HDF_NOT_BUILT, path);
    return NULL;
}

bool data_file_write_text(DataFile *file, const char *name, const char *text)
{
    (void)file, (void)name, (void)text;
    return false;
}

bool data_file_write_reals(DataFile *file, const char *name, int rows, int columns,
                           const double *values, const char *unit)
{
    (void)file, (void)name, (void)rows, (void)columns, (void)values, (void)unit;
    return false;
}

bool data_file_write_ints(DataFile *file, const char *name, int rows, const int *values)
{
    (void)file, (void)name, (void)rows, (void)values;
    return false;
}

bool data_file_write_texts(DataFile *file, const char *name, int rows, int length,
                           const char *texts)
{
    (void)file, (void)name, (void)rows, (void)length, (void)texts;
    return false;
}

bool data_file_save(DataFile *file)
{
    (void)file;
    return false;
}

void data_file_destroy(DataFile *file)
{
    (void)file;
}
#endif
