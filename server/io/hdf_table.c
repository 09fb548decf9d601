#include "io/hdf_table.h"

#ifdef PLIANT_WITH_HDF5
#include <errno.h>
#include <string.h>

// Fails with the last system error: HDF5 reports what failed but not why.
static bool fail(const HdfFile *file, const char *what)
{
    const char *reason = errno != 0 ? strerror(errno) : "HDF5 refuses";
    return status_fail(file->status, STATUS_FAILED, "%s: cannot be %s: %s", file->path, what,
                       reason);
}

static void begin(void)
{
    hdf_begin();
    errno = 0;
}

static int rank_of(const HdfTable *table)
{
    return table->columns > 0 ? 2 : 1;
}

bool hdf_table_create(const HdfFile *file, const char *name, hid_t type, int columns, hsize_t chunk,
                      const char *unit, HdfTable *table)
{
    begin();
    *table = (HdfTable){.set = -1, .type = type, .columns = columns};
    const hsize_t size[2] = {0, (hsize_t)columns}, most[2] = {H5S_UNLIMITED, (hsize_t)columns};
    const hsize_t chunks[2] = {chunk > 0 ? chunk : 1, (hsize_t)columns};
    hid_t groups = H5Pcreate(H5P_LINK_CREATE), layout = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_create_intermediate_group(groups, 1);
    H5Pset_chunk(layout, rank_of(table), chunks);
    hid_t space = H5Screate_simple(rank_of(table), size, most);
    table->set = H5Dcreate2(file->id, name, type, space, groups, layout, H5P_DEFAULT);
    H5Sclose(space);
    H5Pclose(layout);
    H5Pclose(groups);
    return (table->set >= 0 || fail(file, "created")) && hdf_write_text(file, name, "unit", unit);
}

// Selects rows [first, first + rows) of the data set, in the file and in memory.
static void select_rows(const HdfTable *table, hsize_t first, hsize_t rows, hid_t *in_file,
                        hid_t *in_memory)
{
    const hsize_t start[2] = {first, 0}, count[2] = {rows, (hsize_t)table->columns};
    *in_file = H5Dget_space(table->set);
    H5Sselect_hyperslab(*in_file, H5S_SELECT_SET, start, NULL, count, NULL);
    *in_memory = H5Screate_simple(rank_of(table), count, NULL);
}

bool hdf_table_append(const HdfFile *file, HdfTable *table, hsize_t rows, const void *data)
{
    if (rows == 0)
        return true;
    begin();
    const hsize_t size[2] = {table->count + rows, (hsize_t)table->columns};
    if (H5Dset_extent(table->set, size) < 0)
        return fail(file, "written");
    hid_t in_file, in_memory;
    select_rows(table, table->count, rows, &in_file, &in_memory);
    bool ok = H5Dwrite(table->set, table->type, in_memory, in_file, H5P_DEFAULT, data) >= 0 ||
              fail(file, "written");
    H5Sclose(in_memory);
    H5Sclose(in_file);
    if (ok)
        table->count += rows;
    return ok;
}

bool hdf_table_read(const HdfFile *file, const HdfTable *table, hsize_t first, hsize_t rows,
                    void *to)
{
    begin();
    hid_t in_file, in_memory;
    select_rows(table, first, rows, &in_file, &in_memory);
    bool ok = H5Dread(table->set, table->type, in_memory, in_file, H5P_DEFAULT, to) >= 0 ||
              fail(file, "read back");
    H5Sclose(in_memory);
    H5Sclose(in_file);
    return ok;
}

void hdf_table_close(HdfTable *table)
{
    if (table->set > 0)
        H5Dclose(table->set);
    table->set = 0;
}
#endif
