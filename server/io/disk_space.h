// Disk space reserved in advance. HDF5 does not survive a disk that fills up in the middle of a
// write. Private to io/. Any thread but the step thread.
#ifndef PLIANT_IO_DISK_SPACE_H
#define PLIANT_IO_DISK_SPACE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct DiskSpace {
    int fd;           // of the file, open for writing
    int64_t reserved; // [bytes] from the start of the file
} DiskSpace;

// Ensures that the file can grow to `end` bytes, without changing its size. Returns false with
// errno if it cannot (full disk, quota, limit of the process). A file system that cannot reserve
// space always succeeds.
bool disk_space_reserve(DiskSpace *space, int64_t end);
// Releases the space after the file's end.
void disk_space_release(DiskSpace *space);

#endif
