#include "run/realtime.h"

#include "base/log.h"

#include <errno.h>
#include <sched.h>
#include <stdbool.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

enum { PRIORITY = 60 }; // above the threaded interrupts' 50

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

// What comes later is locked only where no limit can refuse it: an allocation that a limit made
// fail would end the daemon.
static int lock_memory(void)
{
    struct rlimit limit = {0};
    getrlimit(RLIMIT_MEMLOCK, &limit);
    bool unlimited = geteuid() == 0 || limit.rlim_cur == RLIM_INFINITY;
    return mlockall(unlimited ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT) == 0 ? 0 : errno;
}

void realtime_request(pthread_t thread)
{
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
