// SPDX-License-Identifier: MIT
// Loaded into a program before libc: no file system that it uses has locks, as some mounts of NFS,
// 9p and FUSE.
#include <errno.h>
#include <sys/file.h>

int flock(int fd, int operation)
{
    (void)fd;
    (void)operation;
    errno = ENOLCK;
    return -1;
}
