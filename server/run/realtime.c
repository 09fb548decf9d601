// SPDX-License-Identifier: MIT
#include "run/realtime.h"

#include "base/log.h"

#include <errno.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

enum { PRIORITY = 60 }; // above the 50 of threaded interrupts

// The largest frames are 70 kB: rows of kernels, pieces of files. Sanitizers need more.
#ifndef STACK_BYTES
#define STACK_BYTES (1 << 19)
#endif

void realtime_flush_denormals(void)
{
#if defined(__x86_64__)
    _mm_setcsr(_mm_getcsr() | 0x8040); // FTZ and DAZ
#elif defined(__aarch64__)
    unsigned long fpcr;
    __asm__ volatile("mrs %0, fpcr" : "=r"(fpcr));
    __asm__ volatile("msr fpcr, %0" ::"r"(fpcr | 1ul << 24)); // FZ
#endif
}

void realtime_size_stacks(void)
{
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, STACK_BYTES);
    pthread_setattr_default_np(&attributes);
    pthread_attr_destroy(&attributes);
}

// Locks later allocations too, but only where no limit can refuse them: a failed allocation would
// end the daemon.
static int lock_memory(void)
{
    struct rlimit limit = {0};
    getrlimit(RLIMIT_MEMLOCK, &limit);
    bool unlimited = geteuid() == 0 || limit.rlim_cur == RLIM_INFINITY;
    return mlockall(unlimited ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT) == 0 ? 0 : errno;
}

void realtime_request(pthread_t thread)
{
    // Ask for both, and name in one line what was refused.
    int locked = lock_memory();
    struct sched_param parameter = {.sched_priority = PRIORITY};
    int scheduled = pthread_setschedparam(thread, SCHED_FIFO, &parameter);
    if (locked == 0 && scheduled == 0)
        return;
    log_line(LOG_WARNING,
             "not real-time, ticks will be late under load: %s%s%s%s%s"
             " (grant CAP_SYS_NICE and CAP_IPC_LOCK, or LimitRTPRIO=%d and LimitMEMLOCK=infinity)",
             scheduled != 0 ? "SCHED_FIFO: " : "", scheduled != 0 ? strerror(scheduled) : "",
             scheduled != 0 && locked != 0 ? ", " : "", locked != 0 ? "mlockall: " : "",
             locked != 0 ? strerror(locked) : "", PRIORITY);
}

// Lists the processors available to this process, the last one first: the first often serves
// interrupts.
static int find_processors(int processor[TEAM_THREADS_MOST])
{
    cpu_set_t allowed;
    CPU_ZERO(&allowed);
    int count = 0;
    if (sched_getaffinity(0, sizeof allowed, &allowed) == 0)
        for (int i = CPU_SETSIZE - 1; i >= 0 && count < TEAM_THREADS_MOST; i--)
            if (CPU_ISSET(i, &allowed))
                processor[count++] = i;
    return count;
}

// Pins a thread; member 0 is the step thread. If it fails, the scheduler chooses the processor.
static void pin(pthread_t thread, int member)
{
    int processor[TEAM_THREADS_MOST];
    if (member >= find_processors(processor))
        return;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(processor[member], &one);
    pthread_setaffinity_np(thread, sizeof one, &one);
}

static void place_live(pthread_t thread, int worker)
{
    struct sched_param parameter = {.sched_priority = PRIORITY};
    pin(thread, worker);
    pthread_setschedparam(thread, SCHED_FIFO, &parameter); // refused for the step thread too, which
                                                           // tells it
}

bool realtime_start_team(Team *team, bool live, Status *status)
{
    if (team == NULL)
        return true;
    int processor[TEAM_THREADS_MOST];
    int processors = find_processors(processor), wanted = team_threads(team);
    if (processors < wanted)
        log_line(LOG_WARNING, "threads = %d, but only %d processors may be used: as many threads",
                 wanted, processors);
    return team_start(team, processors, live ? place_live : pin, status);
}

void realtime_pin_step(const Team *team, pthread_t step)
{
    if (team != NULL)
        pin(step, 0);
}

// --- quota ---

static int64_t read_held_us(const char *path)
{
    char line[128];
    long long us = 0;
    FILE *file = fopen(path, "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        if (sscanf(line, "throttled_usec %lld", &us) == 1)
            break;
    if (file != NULL)
        fclose(file);
    return us;
}

// Reads cpu.max of a group; false without a quota.
static bool read_limit(Quota *quota, const char *folder)
{
    char path[512];
    snprintf(path, sizeof path, "/sys/fs/cgroup%.400s/cpu.max", folder);
    FILE *file = fopen(path, "r");
    const bool read = file != NULL && fgets(quota->limit, sizeof quota->limit, file) != NULL;
    if (file != NULL)
        fclose(file);
    quota->limit[strcspn(quota->limit, "\n")] = '\0';
    if (read && strncmp(quota->limit, "max", 3) != 0)
        return true;
    quota->limit[0] = '\0';
    return false;
}

void quota_find(Quota *quota)
{
    char line[512], folder[512] = "";
    *quota = (Quota){0};
    FILE *file = fopen("/proc/self/cgroup", "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        if (strncmp(line, "0::/", 4) == 0)
            snprintf(folder, sizeof folder, "%.*s", (int)strcspn(line + 3, "\n"), line + 3);
    if (file != NULL)
        fclose(file);
    // Its own group, or the nearest one around it that has one.
    while (!read_limit(quota, folder)) {
        char *end = strrchr(folder, '/');
        if (end == NULL)
            return;
        *end = '\0';
    }
    snprintf(quota->stat, sizeof quota->stat, "/sys/fs/cgroup%.400s/cpu.stat", folder);
    quota->first_us = read_held_us(quota->stat);
}

int64_t quota_look(Quota *quota)
{
    const int64_t before = quota->held_us;
    if (quota->limit[0] != '\0')
        quota->held_us = read_held_us(quota->stat) - quota->first_us;
    return quota->held_us - before;
}

// --- while requests take long ---

void realtime_pause(void)
{
    struct sched_param parameter = {0};
    pthread_setschedparam(pthread_self(), SCHED_OTHER, &parameter);
}

void realtime_resume(void)
{
    struct sched_param parameter = {.sched_priority = PRIORITY};
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
}
