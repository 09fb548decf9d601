// An HDF5 file of named data sets with units, for rooms that do not know HDF5. Not for the step
// thread. Without PLIANT_WITH_HDF5 every function but data_file_built fails.
#ifndef PLIANT_FILES_DATA_FILE_H
#define PLIANT_FILES_DATA_FILE_H

#include "base/status.h"

typedef struct DataFile DataFile;

// Whether files can be written: HDF5 is built in.
bool data_file_built(void);
// Begins a file in memory, with the root attributes that all our files have: format, version,
// scene (its text), created_by (`program` and the version). `path` and `status` outlive it. NULL
// with the status.
DataFile *data_file_create(const char *path, const char *format, int version, const char *scene,
                           const char *program, Status *status);
// A text attribute of the root.
bool data_file_write_text(DataFile *file, const char *name, const char *text);
// Data sets with their attribute `unit`, groups on the way are made: [rows] for columns 0, else
// [rows][columns]; rows 0 with columns 0: one number.
bool data_file_write_reals(DataFile *file, const char *name, int rows, int columns,
                           const double *values, const char *unit);
bool data_file_write_ints(DataFile *file, const char *name, int rows, const int *values);
// [rows] texts of fixed length; texts: [rows][length], each with an end unless it is full.
bool data_file_write_texts(DataFile *file, const char *name, int rows, int length,
                           const char *texts);
// Writes it under its name, whole or not at all.
bool data_file_save(DataFile *file);
void data_file_destroy(DataFile *file);

#endif
