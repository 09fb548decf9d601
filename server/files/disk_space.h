// Disk space taken in advance, for a file that must not meet a full disk half way through a write:
// HDF5 does not survive that. Private to files/. Any thread but the step thread.
#ifndef PLIANT_FILES_DISK_SPACE_H
#define PLIANT_FILES_DISK_SPACE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct DiskSpace {
    int fd;           // of the file, open for writing
    int64_t reserved; // [bytes] from the start of the file
} DiskSpace;

// Makes sure that the file can grow to `end` bytes, without changing its size. False with errno
// when it cannot (full disk, quota, limit of the process). A file system that reserves nothing
// says yes.
bool disk_space_reserve(DiskSpace *space, int64_t end);
// Gives back what lies behind the file's end.
void disk_space_release(DiskSpace *space);

#endif
