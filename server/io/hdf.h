// SPDX-License-Identifier: MIT
// The HDF5 functions that our files need, with errors as one sentence that names file and object.
// Private to io/. Without PLIANT_WITH_HDF5 none of them exist.
#ifndef PLIANT_IO_HDF_H
#define PLIANT_IO_HDF_H

#include "base/check.h"
#include "base/vec.h"

// First bytes of a sealed file.
#define HDF_MARK "pliant: "

#define HDF_NOT_BUILT "built without HDF5 (PLIANT_HDF5)"

#ifdef PLIANT_WITH_HDF5
#include "on_demand/hdf5.h"

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

typedef struct HdfFile {
    hid_t id;               // in this process; -1: not open here
    struct HdfChild *child; // in a child process; NULL: not open there
    const char *path;
    struct OutputClaim *claim; // for hdf_save: of the path; or NULL
    Status *status;
} HdfFile;

// Loads HDF5 for the file at `path`; false with a status if the library is missing. The functions
// that open or create a file call it.
bool hdf_load(const char *path, Status *status);
// Call before using HDF5, once per thread. HDF5 then prints nothing and writes nothing at exit,
// when it would write the rest of files that could not be written.
void hdf_begin(void);
// Returns false, and lets HDF5 do without, where the file system of `fd` (-1: unknown) has no
// locks.
bool hdf_locks(hid_t access_list, int fd);

// Open a file for reading in a child process, which HDF5 may crash; report what the path is
// instead. Sealed: one of our files, whose seal is checked first.
bool hdf_open(HdfFile *file, const char *path, Status *status);
bool hdf_open_sealed(HdfFile *file, const char *path, Status *status);
// Opens it in this process, for one that may crash, such as the child.
bool hdf_open_here(HdfFile *file, const char *path, Status *status);
// Answers questions about the file; runs in the child.
void hdf_serve(const HdfFile *file, int fd);
// Returns false with a status if the child has crashed; hdf_exists returns false then too. Call at
// the end of reading.
bool hdf_alive(const HdfFile *file);
// Begins a file in memory; hdf_save writes it to its path.
bool hdf_create(HdfFile *file, const char *path, Status *status);
// Writes the file as base/output.h does, synced to the disk: the path always holds a complete file,
// and only a sealed file is replaced. A seal precedes the data, in a block that HDF5 leaves to its
// user: the number of bytes and their hash.
bool hdf_save(HdfFile *file);
// Checks a file against its seal, to detect accidental damage.
bool hdf_check_seal(const char *path, Status *status);
void hdf_close(HdfFile *file);
// True if hdf_save may write to `path`: it holds nothing, an empty file, a device, or an intact
// file of ours of this format. Such a file is then open (file->id >= 0) for the caller to read and
// to close.
bool hdf_open_target(HdfFile *file, const char *path, const char *format, Status *status);

// Sets STATUS_INVALID "path: object text"; returns false.
bool hdf_fail(const HdfFile *file, const char *object, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

bool hdf_exists(const HdfFile *file, const char *name);
// Returns the rows of a float data set of shape [n][3], or -1 with a status.
int64_t hdf_count_vectors(const HdfFile *file, const char *name);
// Reads all rows, which must be `count`; refuses numbers that are not finite.
bool hdf_read_vectors(const HdfFile *file, const char *name, int64_t count, Vec3 *to);
// Reads exactly `bytes` bytes (unsigned, one dimension).
bool hdf_read_bytes(const HdfFile *file, const char *name, size_t bytes, void *to);
// Reads `count` numbers of one dimension (count 0: one number, no dimension), converted to `type`.
bool hdf_read_numbers(const HdfFile *file, const char *name, hid_t type, size_t count, void *to);
// Returns the rows of a data set of integers of shape [n][columns] ([n] for columns 1), or -1 with
// a status. Accepts only data stored uncompressed, so the file is at least that large and the size
// is safe to allocate.
int64_t hdf_count_ints(const HdfFile *file, const char *name, int columns);
// Reads all rows, which must be `rows`.
bool hdf_read_ints(const HdfFile *file, const char *name, int columns, int64_t rows, int *to);
// Read a string or an integer attribute of an object; refuse text that exceeds `size`.
bool hdf_read_text(const HdfFile *file, const char *object, const char *name, char *text,
                   size_t size);
bool hdf_read_int(const HdfFile *file, const char *object, const char *name, int *value);

// Writes a data set with its attribute unit and makes its groups. rank 0: one number.
bool hdf_write(const HdfFile *file, const char *name, hid_t type, int rank, const hsize_t *size,
               const void *data, const char *unit);
bool hdf_write_text(const HdfFile *file, const char *object, const char *name, const char *text);
bool hdf_write_int(const HdfFile *file, const char *object, const char *name, int value);
// The same with 64 bits; hdf_set_long changes an existing value.
bool hdf_read_long(const HdfFile *file, const char *object, const char *name, int64_t *value);
bool hdf_write_long(const HdfFile *file, const char *object, const char *name, int64_t value);
bool hdf_set_long(const HdfFile *file, const char *object, const char *name, int64_t value);
// --- tables: data sets that grow row by row ------------------------------------------------------

// In a file that others may read while it is written (SWMR). Any thread but the step thread.

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
// --- a child process that reads a file for us ----------------------------------------------------

// HDF5 crashes on some damaged or malicious files; in the child it takes no other process with it,
// and its time and memory are limited. For load time and programs that only read, never while the
// simulation runs.

typedef struct HdfChild {
    pid_t pid;
    int fd; // socket to the child
} HdfChild;

// Runs in the child: answers on `fd` until the other end closes. Its memory is a copy of ours at
// the start.
typedef void HdfServe(int fd, void *user);

// Starts a child for the file at `path`, in which our pipes and sockets are closed. Returns NULL
// with `status` (STATUS_FAILED) on failure.
HdfChild *hdf_child_start(const char *path, HdfServe *serve, void *user, Status *status);
// Called in the child: from now on it may compute for as long as at its start, for a child that
// answers many requests.
void hdf_child_renew(void);
// Ends the child and frees it.
void hdf_child_end(HdfChild *child);

// Transfer exactly `size` bytes, in either direction and from either side; return false if the
// other end is gone.
bool hdf_child_send(int fd, const void *data, size_t size);
bool hdf_child_receive(int fd, void *data, size_t size);

// After one of these returned false: sets the reason why the child is gone; returns false.
bool hdf_child_failed(HdfChild *child, const char *path, Status *status);

#endif

#endif
