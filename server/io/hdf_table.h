// A data set that grows row by row, in a file that others read while it is written (SWMR). Private
// to io/. Any thread but the step thread.
#ifndef PLIANT_IO_HDF_TABLE_H
#define PLIANT_IO_HDF_TABLE_H

#include "io/hdf.h"

#ifdef PLIANT_WITH_HDF5

typedef struct HdfTable {
    hid_t set;     // 0 or less: none
    hid_t type;    // of a number, in memory and in the file; not owned
    int columns;   // 0: rows are single numbers, the data set has one dimension
    hsize_t count; // rows
} HdfTable;

// Creates an empty data set with its attribute unit and makes its groups. `chunk` rows are stored
// together.
bool hdf_table_create(const HdfFile *file, const char *name, hid_t type, int columns, hsize_t chunk,
                      const char *unit, HdfTable *table);
// Appends rows; they are permanent after the next flush of the file.
bool hdf_table_append(const HdfFile *file, HdfTable *table, hsize_t rows, const void *data);
// Reads rows [first, first + rows), which must exist.
bool hdf_table_read(const HdfFile *file, const HdfTable *table, hsize_t first, hsize_t rows,
                    void *to);
void hdf_table_close(HdfTable *table);
#endif

#endif
