#include "io/hdf_child.h"

#ifdef PLIANT_WITH_HDF5
#include "base/check.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum {
    CPU_SECONDS = 30,        // reading a gigabyte takes two
    MEMORY_MARGIN = 1 << 30, // [bytes], on top of our own at the start and four times the file
};

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1 // no address space limit is possible with shadow memory
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SANITIZED 1
#endif
#endif
#ifndef SANITIZED
#define SANITIZED 0
#endif

#if SANITIZED
// A fuzzer saves the input of a process that dies; here the child may die.
void __sanitizer_set_death_callback(void (*callback)(void)) __attribute__((weak));
#endif

// Returns the size of the address space as the kernel counts it for RLIMIT_AS.
static rlim_t address_space(void)
{
    unsigned long pages = 0;
    FILE *file = fopen("/proc/self/statm", "re");
    if (file == NULL || fscanf(file, "%lu", &pages) != 1)
        pages = 0;
    if (file != NULL)
        fclose(file);
    return (rlim_t)pages * (rlim_t)sysconf(_SC_PAGESIZE);
}

static void limit(int what, rlim_t most)
{
    struct rlimit bound;
    if (getrlimit(what, &bound) != 0 || (bound.rlim_max != RLIM_INFINITY && bound.rlim_max < most))
        return;
    bound.rlim_cur = bound.rlim_max = most;
    setrlimit(what, &bound);
}

// Limits the child: default signal actions, no core file, bounded time and memory.
static void restrain(const char *path)
{
    struct stat facts;
    for (int number = 1; number < NSIG; number++)
        signal(number, SIG_DFL);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
#if SANITIZED
    if (__sanitizer_set_death_callback != NULL)
        __sanitizer_set_death_callback(NULL);
#endif
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_CPU, CPU_SECONDS);
    rlim_t used = address_space(), size = stat(path, &facts) == 0 ? (rlim_t)facts.st_size : 0;
    // A sparse file counts by the space that it occupies.
    rlim_t stored = stat(path, &facts) == 0 ? (rlim_t)facts.st_blocks * 512 : 0;
    if (!SANITIZED && used > 0)
        limit(RLIMIT_AS, used + 4 * (size < stored ? size : stored) + MEMORY_MARGIN);
}

HdfChild *hdf_child_start(const char *path, HdfServe *serve, void *user, Status *status)
{
    int end[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, end) != 0) {
        status_fail(status, STATUS_FAILED, "%s: cannot be read: %s", path, strerror(errno));
        return NULL;
    }
    HdfChild *child = malloc(sizeof *child);
    ASSERT(child != NULL);
    *child = (HdfChild){.pid = fork(), .fd = end[0]};
    if (child->pid == 0) {
        close(end[0]);
        restrain(path);
        serve(end[1], user);
        _exit(0);
    }
    close(end[1]);
    if (child->pid > 0)
        return child;
    status_fail(status, STATUS_FAILED, "%s: no process to read it: %s", path, strerror(errno));
    close(end[0]);
    free(child);
    return NULL;
}

// Returns the child's wait status; -1: unknown.
static int wait_for(HdfChild *child)
{
    int ended = -1;
    if (child->fd >= 0)
        close(child->fd); // the child sees the end of its input
    child->fd = -1;
    if (child->pid > 0)
        while (waitpid(child->pid, &ended, 0) < 0 && errno == EINTR)
            continue;
    child->pid = 0;
    return ended;
}

void hdf_child_end(HdfChild *child)
{
    if (child == NULL)
        return;
    wait_for(child);
    free(child);
}

bool hdf_child_failed(HdfChild *child, const char *path, Status *status)
{
    const int ended = wait_for(child);
    if (WIFSIGNALED(ended) && (WTERMSIG(ended) == SIGXCPU || WTERMSIG(ended) == SIGKILL))
        return status_fail(status, STATUS_INVALID,
                           "%s: is damaged: HDF5 came to no end with it in %d s", path,
                           CPU_SECONDS);
    if (WIFSIGNALED(ended))
        return status_fail(status, STATUS_INVALID, "%s: is damaged: HDF5 fails on it (%s)", path,
                           strsignal(WTERMSIG(ended)));
    return status_fail(status, STATUS_INVALID, "%s: is damaged: HDF5 fails on it", path);
}

bool hdf_child_send(int fd, const void *data, size_t size)
{
    const char *from = data;
    while (size > 0) {
        ssize_t sent = send(fd, from, size, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR)
            continue;
        if (sent <= 0)
            return false;
        from += sent;
        size -= (size_t)sent;
    }
    return true;
}

bool hdf_child_receive(int fd, void *data, size_t size)
{
    char *to = data;
    while (size > 0) {
        ssize_t got = recv(fd, to, size, 0);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return false;
        to += got;
        size -= (size_t)got;
    }
    return true;
}
#endif
