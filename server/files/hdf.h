// The little of HDF5 that our files need, with errors as one sentence naming file and object.
// Private to files/. Without PLIANT_WITH_HDF5 nothing of it exists.
#ifndef PLIANT_FILES_HDF_H
#define PLIANT_FILES_HDF_H

#include "base/status.h"
#include "base/vec.h"

#define HDF_NOT_BUILT "built without HDF5 (PLIANT_HDF5)"

#ifdef PLIANT_WITH_HDF5
#include <hdf5.h>
#include <stddef.h>
#include <stdint.h>

typedef struct HdfFile {
    hid_t id;
    const char *path;
    Status *status;
} HdfFile;

// To be called before HDF5 is used, on each thread anew: it prints nothing, and does nothing by
// itself at the program's end, when it would write the rest of files that could not be written.
void hdf_begin(void);

// Opens a file for reading, or says what it is instead.
bool hdf_open(HdfFile *file, const char *path, Status *status);
// Begins a file in memory; hdf_save writes it to its path.
bool hdf_create(HdfFile *file, const char *path, Status *status);
// Writes PATH.tmp, flushes it to the disk, renames it to PATH and flushes the folder: there is
// always a whole file. PATH.tmp is locked meanwhile; one left behind by a killed program is used
// again. In front of the data stands a seal, in a block that HDF5 leaves to its user:
// their number of bytes and a hash of them.
bool hdf_save(HdfFile *file);
// Whether a file is as hdf_save wrote it. Asked before HDF5 reads a file of ours: its library does
// not survive every damage.
bool hdf_check_seal(const char *path, Status *status);
void hdf_close(HdfFile *file);

// STATUS_INVALID "path: object text".
bool hdf_fail(const HdfFile *file, const char *object, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

bool hdf_exists(const HdfFile *file, const char *name);
// Rows of a float data set of shape [n][3], or -1 with a status.
int64_t hdf_count_vectors(const HdfFile *file, const char *name);
// Reads `count` rows, which must be all; refuses numbers that are not finite.
bool hdf_read_vectors(const HdfFile *file, const char *name, int64_t count, Vec3 *to);
// Reads exactly `bytes` bytes (unsigned, one dimension).
bool hdf_read_bytes(const HdfFile *file, const char *name, size_t bytes, void *to);
// Reads `count` numbers of one dimension (count 0: one number, no dimension), converted to `type`.
bool hdf_read_numbers(const HdfFile *file, const char *name, hid_t type, size_t count, void *to);
// Rows of a data set of integers of shape [n][columns], columns 1 for [n], whose numbers all stand
// in the file as they are; or -1 with a status. The file is at least that large: a size to be
// trusted before memory is taken.
int64_t hdf_count_ints(const HdfFile *file, const char *name, int columns);
// Reads `rows` such rows, which must be all.
bool hdf_read_ints(const HdfFile *file, const char *name, int columns, int64_t rows, int *to);
// A string or an integer at an object; text that does not fit `size` is refused.
bool hdf_read_text(const HdfFile *file, const char *object, const char *name, char *text,
                   size_t size);
bool hdf_read_int(const HdfFile *file, const char *object, const char *name, int *value);

// Writes a data set with its attribute unit, making the groups on the way. rank 0: one number.
bool hdf_write(const HdfFile *file, const char *name, hid_t type, int rank, const hsize_t *size,
               const void *data, const char *unit);
bool hdf_write_text(const HdfFile *file, const char *object, const char *name, const char *text);
bool hdf_write_int(const HdfFile *file, const char *object, const char *name, int value);
// The same with 64 bits; hdf_set_long changes the value of one that is there.
bool hdf_read_long(const HdfFile *file, const char *object, const char *name, int64_t *value);
bool hdf_write_long(const HdfFile *file, const char *object, const char *name, int64_t value);
bool hdf_set_long(const HdfFile *file, const char *object, const char *name, int64_t value);
#endif

#endif
