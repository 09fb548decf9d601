// SPDX-License-Identifier: MIT
// Loaded into a program before libc: its CLOCK_REALTIME is set by as many microseconds as the file
// named by PLIANT_SET_CLOCK holds, at any moment. The machine's own clock is left alone.
#include <dlfcn.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

static const volatile int64_t *offset_us;
static int (*next_gettime)(clockid_t, struct timespec *);

__attribute__((constructor)) static void open_offset(void)
{
    void *symbol = dlsym(RTLD_NEXT, "clock_gettime");
    memcpy(&next_gettime, &symbol, sizeof next_gettime);
    const char *path = getenv("PLIANT_SET_CLOCK");
    int fd = path != NULL ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    if (fd < 0)
        return;
    void *memory = mmap(NULL, sizeof *offset_us, PROT_READ, MAP_SHARED, fd, 0);
    offset_us = memory != MAP_FAILED ? memory : NULL;
    close(fd);
}

int clock_gettime(clockid_t clock, struct timespec *time)
{
    if (next_gettime == NULL)
        open_offset();
    int result = next_gettime(clock, time);
    if (result == 0 && offset_us != NULL &&
        (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) {
        const int64_t offset = *offset_us;
        time->tv_sec += offset / 1000000;
        time->tv_nsec += offset % 1000000 * 1000;
        if (time->tv_nsec >= 1000000000 || time->tv_nsec < 0) {
            int64_t carry = time->tv_nsec < 0 ? -1 : 1;
            time->tv_sec += carry;
            time->tv_nsec -= carry * 1000000000;
        }
    }
    return result;
}

int gettimeofday(struct timeval *restrict time, void *restrict zone)
{
    (void)zone;
    struct timespec t;
    int result = clock_gettime(CLOCK_REALTIME, &t);
    *time = (struct timeval){.tv_sec = t.tv_sec, .tv_usec = t.tv_nsec / 1000};
    return result;
}
