// SPDX-License-Identifier: MIT
// Before a recording begins: whether its file may be written, and room for it on the disk.
#include "io/recording_parts.h"

#include "base/check.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

// --- room on the disk ----------------------------------------------------------------------------

enum { AT_A_TIME = 1 << 20 }; // [bytes], so that few appends need a system call

// Returns the file size limit of the process: fallocate ignores it, but a write beyond it ends the
// process.
static int64_t size_limit(void)
{
    struct rlimit limit;
    if (getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur > INT64_MAX)
        return INT64_MAX;
    return (int64_t)limit.rlim_cur;
}

static bool take(DiskSpace *space, int64_t end)
{
    if (fallocate(space->fd, FALLOC_FL_KEEP_SIZE, space->reserved, end - space->reserved) != 0)
        return false;
    space->reserved = end;
    return true;
}

bool disk_space_reserve(DiskSpace *space, int64_t end)
{
    if (end <= space->reserved)
        return true;
    // Beyond the limit a write would end the process.
    int64_t limit = size_limit();
    if (end > limit) {
        errno = EFBIG;
        return false;
    }
    // A little more than is needed, else just that; some file systems cannot reserve at all.
    int64_t generous = end <= limit - AT_A_TIME ? end + AT_A_TIME : limit;
    return take(space, generous) || take(space, end) || (errno != ENOSPC && errno != EDQUOT);
}

void disk_space_release(DiskSpace *space)
{
    struct stat facts;
    // Setting a file's size to its current value releases the space reserved after it.
    if (space->reserved > 0 && fstat(space->fd, &facts) == 0 &&
        ftruncate(space->fd, facts.st_size) == 0)
        space->reserved = 0;
}

#ifdef PLIANT_WITH_HDF5
// --- the file ------------------------------------------------------------------------------------

static bool refuse(const char *path, const char *why, Status *status)
{
    return status_fail(status, STATUS_INVALID, "%s: cannot record: %s", path, why);
}

static bool is_hdf5(int fd)
{
    static const char signature[8] = "\211HDF\r\n\032\n";
    char head[sizeof signature];
    return pread(fd, head, sizeof head, 0) == sizeof head &&
           memcmp(head, signature, sizeof head) == 0;
}

static bool is_recording(const char *path)
{
    RecordingInfo *info = malloc(sizeof *info);
    ASSERT(info != NULL);
    bool ok = recording_info_read(path, info, &(Status){0});
    free(info);
    return ok;
}

int recording_open_target(const char *path, bool overwrite, Status *status)
{
    struct stat facts;
    int mode = overwrite ? O_RDWR : O_WRONLY; // a file to be overwritten is read first
    // Open without replacing anything, then look at what was there.
    int fd = open(path, mode | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
    if (fd < 0 || fstat(fd, &facts) != 0)
        refuse(path, strerror(errno), status);
    else if (!S_ISREG(facts.st_mode))
        refuse(path, "is not a regular file", status);
    else if (facts.st_size > 0 && !overwrite)
        refuse(path, "exists already, and a recording replaces no file: remove it or name another",
               status);
    else if (facts.st_size > 0 && !is_hdf5(fd))
        refuse(path, "is no HDF5 file, let alone a recording, which is all that is overwritten",
               status);
    else if (facts.st_size > 0 && !is_recording(path))
        refuse(path, "is no recording, which is all that is overwritten", status);
    else
        return fd;
    if (fd >= 0)
        close(fd);
    return -1;
}

bool recording_claim(const char *path, bool overwrite, Status *status)
{
    int fd = recording_open_target(path, overwrite, status);
    if (fd >= 0)
        close(fd);
    return fd >= 0;
}
#endif
