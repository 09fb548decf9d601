#include "io/recording_parts.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

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
    int64_t limit = size_limit();
    if (end > limit) {
        errno = EFBIG;
        return false;
    }
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
