// SPDX-License-Identifier: MIT
// Loaded into a program before libc: no file system that it uses has locks, as some mounts of NFS,
// 9p and FUSE. Of fcntl with EAGAIN, as if another program had one, whom nobody finds.
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <string.h>
#include <sys/file.h>

int flock(int fd, int operation)
{
    (void)fd;
    (void)operation;
    errno = ENOLCK;
    return -1;
}

static int lock_or_pass(int fd, int command, void *argument)
{
    static int (*next)(int, int, ...);
    if (command == F_SETLK || command == F_OFD_SETLK) {
        errno = EAGAIN;
        return -1;
    }
    if (next == NULL) {
        void *symbol = dlsym(RTLD_NEXT, "fcntl64");
        memcpy(&next, &symbol, sizeof next);
    }
    return next(fd, command, argument);
}

int fcntl(int fd, int command, ...)
{
    va_list arguments;
    va_start(arguments, command);
    void *argument = va_arg(arguments, void *);
    va_end(arguments);
    return lock_or_pass(fd, command, argument);
}

int fcntl64(int fd, int command, ...)
{
    va_list arguments;
    va_start(arguments, command);
    void *argument = va_arg(arguments, void *);
    va_end(arguments);
    return lock_or_pass(fd, command, argument);
}
