#include "output.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MARK_MOST = 128 };

static bool begins_with(int fd, const char *mark)
{
    char head[MARK_MOST];
    size_t length = strnlen(mark, sizeof head);
    return pread(fd, head, length, 0) == (ssize_t)length && memcmp(head, mark, length) == 0;
}

static bool check(const char *path, int fd, const struct stat *facts, const char *mark,
                  ClientError *error)
{
    return !S_ISREG(facts->st_mode) || facts->st_size == 0 || begins_with(fd, mark) ||
           client_fail(error, "%s: has other contents: it is not replaced", path);
}

bool client_may_write(const char *path, const char *mark, ClientError *error)
{
    struct stat facts;
    if (stat(path, &facts) != 0 || !S_ISREG(facts.st_mode))
        return true; // other faults show when it is written
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    bool ok = fd >= 0 ? check(path, fd, &facts, mark, error)
                      : client_fail(error, "%s: %s", path, strerror(errno));
    if (fd >= 0)
        close(fd);
    return ok;
}

FILE *client_open_output(const char *path, const char *mark, ClientError *error)
{
    struct stat facts;
    // Open a pipe normally: its reader may come later.
    bool regular = stat(path, &facts) != 0 || S_ISREG(facts.st_mode);
    int fd = open(path, (regular ? O_RDWR : O_WRONLY) | O_CREAT | O_CLOEXEC, 0666);
    bool ok = fd >= 0 && fstat(fd, &facts) == 0;
    if (!ok)
        client_fail(error, "%s: %s", path, strerror(errno));
    ok = ok && check(path, fd, &facts, mark, error);
    FILE *file = NULL;
    if (ok && ((S_ISREG(facts.st_mode) && ftruncate(fd, 0) != 0) || !(file = fdopen(fd, "w"))))
        client_fail(error, "%s: %s", path, strerror(errno));
    if (!file && fd >= 0)
        close(fd);
    return file;
}
