// Data sets and attributes of HDF5 files. Called by the same threads as hdf.c.
#include "files/hdf.h"

#ifdef PLIANT_WITH_HDF5
#include <string.h>

enum { ROW_LIMIT = 1 << 28, FIXED_TEXT = 256 };

// --- reading -----------------------------------------------------------------------------------

bool hdf_exists(const HdfFile *file, const char *name)
{
    return H5Lexists(file->id, name, H5P_DEFAULT) > 0;
}

// A data set whose type and shape have been looked at, not read yet.
typedef struct DataSet {
    hid_t id;
    H5T_class_t class;
    size_t type_size; // bytes of a number in the file
    int rank;
    hsize_t size[2];
} DataSet;

static bool open_data(const HdfFile *file, const char *name, DataSet *data)
{
    data->id = H5Dopen2(file->id, name, H5P_DEFAULT);
    if (data->id < 0)
        return hdf_fail(file, name, "is missing or no data set");
    hid_t space = H5Dget_space(data->id), type = H5Dget_type(data->id);
    data->class = H5Tget_class(type);
    data->type_size = H5Tget_size(type);
    data->rank = H5Sget_simple_extent_ndims(space);
    data->size[0] = data->size[1] = 0;
    if (data->rank >= 0 && data->rank <= 2)
        H5Sget_simple_extent_dims(space, data->size, NULL);
    H5Tclose(type);
    H5Sclose(space);
    return true;
}

static bool read_data(const HdfFile *file, const char *name, const DataSet *data, hid_t type,
                      void *to)
{
    return H5Dread(data->id, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, to) >= 0 ||
           hdf_fail(file, name, "cannot be read: the file is damaged");
}

// Whether the data set is [n][3] of reals.
static bool check_vectors(const HdfFile *file, const char *name, const DataSet *data)
{
    if (data->class != H5T_FLOAT)
        return hdf_fail(file, name, "must hold floating-point numbers");
    if (data->rank != 2 || data->size[1] != 3)
        return hdf_fail(file, name, "must have the shape [n][3]");
    if (data->size[0] > ROW_LIMIT)
        return hdf_fail(file, name, "has %llu rows, at most %d", (unsigned long long)data->size[0],
                        ROW_LIMIT);
    return true;
}

int64_t hdf_count_vectors(const HdfFile *file, const char *name)
{
    DataSet data;
    if (!open_data(file, name, &data))
        return -1;
    int64_t count = check_vectors(file, name, &data) ? (int64_t)data.size[0] : -1;
    H5Dclose(data.id);
    return count;
}

bool hdf_read_vectors(const HdfFile *file, const char *name, int64_t count, Vec3 *to)
{
    DataSet data;
    if (!open_data(file, name, &data))
        return false;
    bool ok = check_vectors(file, name, &data);
    if (ok && (int64_t)data.size[0] != count)
        ok = hdf_fail(file, name, "has %llu rows and must have %lld",
                      (unsigned long long)data.size[0], (long long)count);
    ok = ok && read_data(file, name, &data, H5T_NATIVE_DOUBLE, to);
    H5Dclose(data.id);
    for (int64_t i = 0; ok && i < count; i++)
        if (!vec3_finite(to[i]))
            ok = hdf_fail(file, name, "row %lld is not finite", (long long)i);
    return ok;
}

// In one piece, as we write; of chunks HDF5 would look for every one that a file says it has.
static bool is_contiguous(const DataSet *data)
{
    hid_t properties = H5Dget_create_plist(data->id);
    bool contiguous = H5Pget_layout(properties) != H5D_CHUNKED;
    H5Pclose(properties);
    return contiguous;
}

// Whether the data set is [n][columns] of integers that are in the file.
static bool check_ints(const HdfFile *file, const char *name, const DataSet *data, int columns)
{
    if (data->class != H5T_INTEGER)
        return hdf_fail(file, name, "must hold integer numbers");
    bool flat = columns == 1 && data->rank == 1;
    if (!flat && (data->rank != 2 || data->size[1] != (hsize_t)columns))
        return hdf_fail(file, name,
                        columns == 1 ? "must have the shape [n]" : "must have the shape [n][%d]",
                        columns);
    if (data->size[0] > ROW_LIMIT)
        return hdf_fail(file, name, "has %llu rows, at most %d", (unsigned long long)data->size[0],
                        ROW_LIMIT);
    return (is_contiguous(data) &&
            H5Dget_storage_size(data->id) == data->size[0] * (hsize_t)columns * data->type_size) ||
           hdf_fail(file, name, "is compressed or incomplete");
}

int64_t hdf_count_ints(const HdfFile *file, const char *name, int columns)
{
    DataSet data;
    if (!open_data(file, name, &data))
        return -1;
    int64_t count = check_ints(file, name, &data, columns) ? (int64_t)data.size[0] : -1;
    H5Dclose(data.id);
    return count;
}

bool hdf_read_ints(const HdfFile *file, const char *name, int columns, int64_t rows, int *to)
{
    DataSet data;
    if (!open_data(file, name, &data))
        return false;
    bool ok = check_ints(file, name, &data, columns);
    if (ok && (int64_t)data.size[0] != rows)
        ok = hdf_fail(file, name, "has %llu rows and must have %lld",
                      (unsigned long long)data.size[0], (long long)rows);
    ok = ok && (rows == 0 || read_data(file, name, &data, H5T_NATIVE_INT, to));
    H5Dclose(data.id);
    return ok;
}

bool hdf_read_numbers(const HdfFile *file, const char *name, hid_t type, size_t count, void *to)
{
    DataSet data;
    if (!open_data(file, name, &data))
        return false;
    bool real = H5Tget_class(type) == H5T_FLOAT;
    bool ok = true;
    if (data.class != (real ? H5T_FLOAT : H5T_INTEGER))
        ok = hdf_fail(file, name, "must hold %s numbers", real ? "floating-point" : "integer");
    else if (count == 0 && data.rank != 0)
        ok = hdf_fail(file, name, "must be a single number");
    else if (count > 0 && (data.rank != 1 || data.size[0] != count))
        ok = hdf_fail(file, name, "must have the shape [%zu]", count);
    ok = ok && read_data(file, name, &data, type, to);
    H5Dclose(data.id);
    return ok;
}

bool hdf_read_bytes(const HdfFile *file, const char *name, size_t bytes, void *to)
{
    DataSet data;
    if (!open_data(file, name, &data))
        return false;
    bool ok = true;
    if (data.class != H5T_INTEGER || data.type_size != 1 || data.rank != 1)
        ok = hdf_fail(file, name, "must be bytes in one dimension");
    else if (data.size[0] != bytes)
        ok = hdf_fail(file, name, "has %llu bytes and must have %zu",
                      (unsigned long long)data.size[0], bytes);
    ok = ok && (bytes == 0 || read_data(file, name, &data, H5T_NATIVE_UINT8, to));
    H5Dclose(data.id);
    return ok;
}

// A scalar attribute of the given class, or -1 with a status.
static hid_t open_attribute(const HdfFile *file, const char *object, const char *name,
                            H5T_class_t class)
{
    hid_t attribute = H5Aopen_by_name(file->id, object, name, H5P_DEFAULT, H5P_DEFAULT);
    if (attribute < 0) {
        hdf_fail(file, object, "has no attribute %s", name);
        return -1;
    }
    hid_t space = H5Aget_space(attribute), type = H5Aget_type(attribute);
    bool ok = H5Sget_simple_extent_npoints(space) == 1 && H5Tget_class(type) == class;
    H5Tclose(type);
    H5Sclose(space);
    if (ok)
        return attribute;
    H5Aclose(attribute);
    hdf_fail(file, object, "attribute %s must be one %s", name,
             class == H5T_STRING ? "string" : "integer");
    return -1;
}

static bool read_integer(const HdfFile *file, const char *object, const char *name, hid_t type,
                         void *value)
{
    hid_t attribute = open_attribute(file, object, name, H5T_INTEGER);
    if (attribute < 0)
        return false;
    bool ok = H5Aread(attribute, type, value) >= 0;
    H5Aclose(attribute);
    return ok || hdf_fail(file, object, "attribute %s cannot be read", name);
}

bool hdf_read_int(const HdfFile *file, const char *object, const char *name, int *value)
{
    return read_integer(file, object, name, H5T_NATIVE_INT, value);
}

bool hdf_read_long(const HdfFile *file, const char *object, const char *name, int64_t *value)
{
    return read_integer(file, object, name, H5T_NATIVE_INT64, value);
}

bool hdf_read_text(const HdfFile *file, const char *object, const char *name, char *text,
                   size_t size)
{
    hid_t attribute = open_attribute(file, object, name, H5T_STRING);
    if (attribute < 0)
        return false;
    hid_t type = H5Aget_type(attribute);
    memset(text, 0, size);
    // Strings of variable length are left alone: HDF5 reads damaged ones without looking.
    bool ok = H5Tis_variable_str(type) == 0 && H5Tget_size(type) < size &&
              H5Aread(attribute, type, text) >= 0;
    H5Tclose(type);
    H5Aclose(attribute);
    return ok || hdf_fail(file, object, "attribute %s cannot be read or is too long", name);
}

// --- writing -----------------------------------------------------------------------------------

// A new string attribute of an open object.
static bool attach_text(hid_t object, const char *name, const char *text)
{
    // More than 64 kB do not fit a string of fixed length in an attribute; a scene's text may be
    // more.
    size_t size = strlen(text) + 1;
    bool fixed = size <= FIXED_TEXT;
    const void *data = fixed ? (const void *)text : &text;
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, fixed ? size : H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
    hid_t attribute = H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    bool ok = attribute >= 0 && H5Awrite(attribute, type, data) >= 0;
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
    return ok;
}

bool hdf_write(const HdfFile *file, const char *name, hid_t type, int rank, const hsize_t *size,
               const void *data, const char *unit)
{
    hid_t groups = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(groups, 1);
    hid_t space = rank == 0 ? H5Screate(H5S_SCALAR) : H5Screate_simple(rank, size, NULL);
    hid_t set = H5Dcreate2(file->id, name, type, space, groups, H5P_DEFAULT, H5P_DEFAULT);
    bool empty = H5Sget_simple_extent_npoints(space) == 0;
    bool ok = set >= 0 &&
              (empty || H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0) &&
              attach_text(set, "unit", unit);
    H5Dclose(set);
    H5Sclose(space);
    H5Pclose(groups);
    return ok ||
           status_fail(file->status, STATUS_FAILED, "%s: %s cannot be written", file->path, name);
}

bool hdf_write_text(const HdfFile *file, const char *object, const char *name, const char *text)
{
    hid_t id = H5Oopen(file->id, object, H5P_DEFAULT);
    bool ok = id >= 0 && attach_text(id, name, text);
    H5Oclose(id);
    return ok || status_fail(file->status, STATUS_FAILED, "%s: %s attribute %s cannot be written",
                             file->path, object, name);
}

static bool write_integer(const HdfFile *file, const char *object, const char *name, hid_t stored,
                          hid_t type, const void *value)
{
    hid_t id = H5Oopen(file->id, object, H5P_DEFAULT), space = H5Screate(H5S_SCALAR);
    hid_t attribute = H5Acreate2(id, name, stored, space, H5P_DEFAULT, H5P_DEFAULT);
    bool ok = attribute >= 0 && H5Awrite(attribute, type, value) >= 0;
    H5Aclose(attribute);
    H5Sclose(space);
    H5Oclose(id);
    return ok || status_fail(file->status, STATUS_FAILED, "%s: %s attribute %s cannot be written",
                             file->path, object, name);
}

bool hdf_write_int(const HdfFile *file, const char *object, const char *name, int value)
{
    return write_integer(file, object, name, H5T_STD_I32LE, H5T_NATIVE_INT, &value);
}

bool hdf_write_long(const HdfFile *file, const char *object, const char *name, int64_t value)
{
    return write_integer(file, object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, &value);
}

bool hdf_set_long(const HdfFile *file, const char *object, const char *name, int64_t value)
{
    // HDF5 1.10 does not write what H5Aopen_by_name has opened.
    hid_t id = H5Oopen(file->id, object, H5P_DEFAULT);
    hid_t attribute = H5Aopen(id, name, H5P_DEFAULT);
    bool ok = attribute >= 0 && H5Awrite(attribute, H5T_NATIVE_INT64, &value) >= 0;
    H5Aclose(attribute);
    H5Oclose(id);
    return ok || status_fail(file->status, STATUS_FAILED, "%s: %s attribute %s cannot be written",
                             file->path, object, name);
}
#endif
