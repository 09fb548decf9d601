// SPDX-License-Identifier: MIT
// Loaded into a program before libc. The file named by PLIANT_SET_CLOCK holds, at any moment, by
// how many microseconds its CLOCK_REALTIME is set and how many its machine was suspended, in which
// CLOCK_BOOTTIME went on and CLOCK_MONOTONIC did not. The machine's own clocks are left alone.
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
static int (*next_sleep)(clockid_t, int, const struct timespec *, struct timespec *);

__attribute__((constructor)) static void open_offset(void)
{
    void *symbol = dlsym(RTLD_NEXT, "clock_gettime");
    memcpy(&next_gettime, &symbol, sizeof next_gettime);
    symbol = dlsym(RTLD_NEXT, "clock_nanosleep");
    memcpy(&next_sleep, &symbol, sizeof next_sleep);
    const char *path = getenv("PLIANT_SET_CLOCK");
    int fd = path != NULL ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    if (fd < 0)
        return;
    void *memory = mmap(NULL, 2 * sizeof *offset_us, PROT_READ, MAP_SHARED, fd, 0);
    offset_us = memory != MAP_FAILED ? memory : NULL;
    close(fd);
}

static int64_t find_offset(clockid_t clock)
{
    if (offset_us == NULL)
        return 0;
    return clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE ? offset_us[0]
           : clock == CLOCK_BOOTTIME                                 ? offset_us[1]
                                                                     : 0;
}

static void add(struct timespec *time, int64_t offset)
{
    time->tv_sec += offset / 1000000;
    time->tv_nsec += offset % 1000000 * 1000;
    if (time->tv_nsec >= 1000000000 || time->tv_nsec < 0) {
        int64_t carry = time->tv_nsec < 0 ? -1 : 1;
        time->tv_sec += carry;
        time->tv_nsec -= carry * 1000000000;
    }
}

int clock_gettime(clockid_t clock, struct timespec *time)
{
    if (next_gettime == NULL)
        open_offset();
    int result = next_gettime(clock, time);
    if (result == 0)
        add(time, find_offset(clock));
    return result;
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *until, struct timespec *rest)
{
    if (next_sleep == NULL)
        open_offset();
    struct timespec real = *until;
    if (flags & TIMER_ABSTIME)
        add(&real, -find_offset(clock));
    return next_sleep(clock, flags, &real, rest);
}

int gettimeofday(struct timeval *restrict time, void *restrict zone)
{
    (void)zone;
    struct timespec t;
    int result = clock_gettime(CLOCK_REALTIME, &t);
    *time = (struct timeval){.tv_sec = t.tv_sec, .tv_usec = t.tv_nsec / 1000};
    return result;
}
