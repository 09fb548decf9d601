// SPDX-License-Identifier: MIT
// Loaded into the daemon before libc: counts what the thread that sleeps on the clock, the step
// thread, asks of the allocator, of locks and of the kernel between its first sleep and its last.
// Writes the counts to the file named by PLIANT_COUNT_CALLS when the program ends.
#include <dlfcn.h>
#include <poll.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

typedef enum Call {
    CALL_SLEEP,
    CALL_ALLOCATE,
    CALL_FREE,
    CALL_LOCK,
    CALL_WRITE,
    CALL_READ,
    CALL_POLL,
    CALL_SYSCALL,
    CALL_COUNT
} Call;

static const char *const names[CALL_COUNT] = {"sleep", "allocate", "free", "lock",
                                              "write", "read",     "poll", "syscall"};
static __thread int watched;
static long counts[CALL_COUNT];  // since the first sleep; the one watched thread's
static long settled[CALL_COUNT]; // up to the last sleep, so that the thread's end is not counted

static int (*next_sleep)(clockid_t, int, const struct timespec *, struct timespec *);
static int (*next_lock)(pthread_mutex_t *);
static ssize_t (*next_write)(int, const void *, size_t);
static ssize_t (*next_read)(int, void *, size_t);
static int (*next_poll)(struct pollfd *, nfds_t, int);

// glibc's own entries: looking up the next malloc would allocate.
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *memory, size_t size);
void __libc_free(void *memory);

static void *find(const char *name)
{
    void *symbol = dlsym(RTLD_NEXT, name);
    if (symbol == NULL)
        abort();
    return symbol;
}

__attribute__((constructor)) static void look_up(void)
{
    // POSIX allows the conversion through memory, ISO C not by cast.
    void *symbols[] = {find("clock_nanosleep"), find("pthread_mutex_lock"), find("write"),
                       find("read"), find("poll")};
    memcpy(&next_sleep, &symbols[0], sizeof next_sleep);
    memcpy(&next_lock, &symbols[1], sizeof next_lock);
    memcpy(&next_write, &symbols[2], sizeof next_write);
    memcpy(&next_read, &symbols[3], sizeof next_read);
    memcpy(&next_poll, &symbols[4], sizeof next_poll);
}

__attribute__((destructor)) static void report(void)
{
    const char *path = getenv("PLIANT_COUNT_CALLS");
    FILE *file = path != NULL ? fopen(path, "w") : NULL;
    if (file == NULL)
        return;
    for (int i = 0; i < CALL_COUNT; i++)
        fprintf(file, "%s %ld\n", names[i], settled[i]);
    fclose(file);
}

static void count(Call call)
{
    if (watched)
        counts[call]++;
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *until, struct timespec *rest)
{
    watched = 1;
    counts[CALL_SLEEP]++;
    memcpy(settled, counts, sizeof settled);
    return next_sleep(clock, flags, until, rest);
}

void *malloc(size_t size)
{
    count(CALL_ALLOCATE);
    return __libc_malloc(size);
}

void *calloc(size_t number, size_t size)
{
    count(CALL_ALLOCATE);
    return __libc_calloc(number, size);
}

void *realloc(void *memory, size_t size)
{
    count(CALL_ALLOCATE);
    return __libc_realloc(memory, size);
}

void free(void *memory)
{
    count(CALL_FREE);
    __libc_free(memory);
}

int pthread_mutex_lock(pthread_mutex_t *mutex)
{
    count(CALL_LOCK);
    return next_lock(mutex);
}

ssize_t write(int fd, const void *data, size_t size)
{
    count(CALL_WRITE);
    return next_write(fd, data, size);
}

ssize_t read(int fd, void *data, size_t size)
{
    count(CALL_READ);
    return next_read(fd, data, size);
}

int poll(struct pollfd *fds, nfds_t number, int timeout)
{
    count(CALL_POLL);
    return next_poll(fds, number, timeout);
}

long syscall(long number, ...)
{
    // Nobody in the daemon calls it with more than these six.
    static long (*next)(long, ...);
    if (next == NULL) {
        void *symbol = find("syscall");
        memcpy(&next, &symbol, sizeof next);
    }
    count(CALL_SYSCALL);
    va_list list;
    va_start(list, number);
    long argument[6];
    for (int i = 0; i < 6; i++)
        argument[i] = va_arg(list, long);
    va_end(list);
    return next(number, argument[0], argument[1], argument[2], argument[3], argument[4],
                argument[5]);
}
