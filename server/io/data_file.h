// SPDX-License-Identifier: MIT
// An HDF5 file of named data sets with units, for modules without access to HDF5. Not for the step
// thread. Without PLIANT_WITH_HDF5 every function but data_file_built fails.
#ifndef PLIANT_IO_DATA_FILE_H
#define PLIANT_IO_DATA_FILE_H

#include "base/check.h"

typedef struct DataFile DataFile;

// True if files can be written: HDF5 is built in.
bool data_file_built(void);
// Begins a file in memory, with the root attributes of all our files: format, version, scene (its
// text), created_by (`program` and the version). `path` and `status` outlive it. Returns NULL with
// `status` on failure.
DataFile *data_file_create(const char *path, const char *format, int version, const char *scene,
                           const char *program, Status *status);
// Writes a text attribute of the root.
bool data_file_write_text(DataFile *file, const char *name, const char *text);
// Write data sets with their attribute `unit` and make their groups: shape [rows] for columns 0,
// else [rows][columns]; rows 0 with columns 0: one number.
bool data_file_write_reals(DataFile *file, const char *name, int rows, int columns,
                           const double *values, const char *unit);
bool data_file_write_ints(DataFile *file, const char *name, int rows, const int *values);
// Writes [rows] texts of fixed length from texts [rows][length], each with a terminator unless it
// is full.
bool data_file_write_texts(DataFile *file, const char *name, int rows, int length,
                           const char *texts);
// Writes the file under its name, completely or not at all.
bool data_file_save(DataFile *file);
void data_file_destroy(DataFile *file);

#endif
