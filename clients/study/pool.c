// SPDX-License-Identifier: MIT
#include "study/pool.h"

#include "base/clock.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { MOST_JOBS = 256, WHY = 160 };

// A child as the parent sees it.
typedef struct Worker {
    pid_t pid;
    int to, from;     // pipes; -1: closed
    int task;         // the current one; -1: none
    int64_t begun_ns; // when the task was given
    size_t received;  // bytes of the result
    bool late;        // killed for taking too long
    unsigned char *result;
} Worker;

typedef struct Crowd {
    const Pool *pool;
    Worker *worker; // [jobs]
    int jobs, next, ended;
} Crowd;

static bool write_all(int file, const void *data, size_t size)
{
    const unsigned char *at = data;
    while (size > 0) {
        ssize_t written = write(file, at, size);
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            return false;
        at += written;
        size -= (size_t)written;
    }
    return true;
}

static bool read_all(int file, void *data, size_t size)
{
    unsigned char *at = data;
    while (size > 0) {
        ssize_t got = read(file, at, size);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return false;
        at += got;
        size -= (size_t)got;
    }
    return true;
}

// The loop of a child: reads tasks and writes results until the parent closes the pipe.
static _Noreturn void serve(const Pool *pool, int in, int out)
{
    void *result = malloc(pool->result_bytes);
    int task;
    while (result != NULL && read_all(in, &task, sizeof task)) {
        memset(result, 0, pool->result_bytes);
        pool->run(pool->user, task, result);
        if (!write_all(out, result, pool->result_bytes))
            break;
    }
    // Run no exit handlers of the parent, and do not write its buffers twice.
    _exit(0);
}

static void close_both(Worker *worker)
{
    if (worker->to >= 0)
        close(worker->to);
    if (worker->from >= 0)
        close(worker->from);
    worker->to = worker->from = -1;
}

// Starts a new child for a worker. It closes the pipes of the other children, which would otherwise
// never see the end of theirs.
static bool start(Crowd *crowd, Worker *worker)
{
    // One pipe for tasks, one for results.
    int task_pipe[2], result_pipe[2];
    if (pipe(task_pipe) != 0)
        return false;
    if (pipe(result_pipe) != 0) {
        close(task_pipe[0]);
        close(task_pipe[1]);
        return false;
    }
    // Flush first: the child would write the parent's buffers again.
    fflush(NULL);
    pid_t pid = fork();
    // The child keeps its own two ends alone: the others' would hide that a process died.
    if (pid == 0) {
        for (int w = 0; w < crowd->jobs; w++)
            if (&crowd->worker[w] != worker)
                close_both(&crowd->worker[w]);
        close(task_pipe[1]);
        close(result_pipe[0]);
        serve(crowd->pool, task_pipe[0], result_pipe[1]);
    }
    // The parent keeps the other two.
    close(task_pipe[0]);
    close(result_pipe[1]);
    worker->pid = pid;
    worker->to = task_pipe[1];
    worker->from = result_pipe[0];
    worker->task = -1;
    worker->late = false;
    if (pid < 0)
        close_both(worker);
    return pid > 0;
}

// Waits for a child that has ended or was told to end; writes how it ended.
static void bury(Worker *worker, char why[WHY])
{
    int ended = 0;
    pid_t got;
    close_both(worker);
    // It is gone, or was ended: get its code.
    do
        got = waitpid(worker->pid, &ended, 0);
    while (got < 0 && errno == EINTR);
    worker->pid = 0;
    // In words, for the table.
    if (worker->late)
        snprintf(why, WHY, "%s", POOL_TOO_LONG);
    else if (got > 0 && WIFSIGNALED(ended))
        snprintf(why, WHY, "its process ended by signal %d (%s)", WTERMSIG(ended),
                 strsignal(WTERMSIG(ended)));
    else
        snprintf(why, WHY, "its process ended with code %d", WEXITSTATUS(ended));
}

// Gives the child the next task, or lets it end if there is none.
static void hand_out(Crowd *crowd, Worker *worker)
{
    if (crowd->next >= crowd->pool->task_count) {
        close(worker->to);
        worker->to = -1;
        return;
    }
    worker->task = crowd->next++;
    worker->received = 0;
    worker->begun_ns = clock_now_ns();
    // If the child is gone already, its missing result shows it.
    (void)write_all(worker->to, &worker->task, sizeof worker->task);
}

// Reads the available part of a result. Returns false if the child has ended.
static bool receive(Crowd *crowd, Worker *worker)
{
    const Pool *pool = crowd->pool;
    // What has come of its result.
    ssize_t got = read(worker->from, worker->result + worker->received,
                       pool->result_bytes - worker->received);
    if (got < 0)
        return errno == EINTR || errno == EAGAIN;
    if (got == 0)
        return false;
    worker->received += (size_t)got;
    if (worker->received < pool->result_bytes)
        return true;
    // The result is whole: hand it over and give the process more to do.
    pool->done(pool->user, worker->task, worker->result, NULL);
    crowd->ended++;
    worker->task = -1;
    hand_out(crowd, worker);
    return true;
}

// Handles a child that has ended: its task is lost, and a new child takes its place.
static bool replace(Crowd *crowd, Worker *worker)
{
    char why[WHY];
    int task = worker->task;
    bury(worker, why);
    // Its task is lost with it.
    if (task >= 0) {
        worker->task = -1;
        crowd->ended++;
        crowd->pool->done(crowd->pool->user, task, NULL, why);
    }
    // Another process for what is left.
    if (crowd->next >= crowd->pool->task_count)
        return true;
    if (!start(crowd, worker))
        return false;
    hand_out(crowd, worker);
    return true;
}

static void end_late_ones(Crowd *crowd)
{
    double limit = crowd->pool->timeout_s;
    for (int w = 0; w < crowd->jobs && limit > 0.0; w++) {
        Worker *worker = &crowd->worker[w];
        if (worker->pid <= 0 || worker->task < 0 || worker->late ||
            1e-9 * (double)(clock_now_ns() - worker->begun_ns) < limit)
            continue;
        worker->late = true;
        kill(worker->pid, SIGKILL);
    }
}

static bool wait_for_results(Crowd *crowd)
{
    enum { LOOK_EVERY_MS = 100 };
    struct pollfd poll_fd[MOST_JOBS];
    int of[MOST_JOBS], count = 0;
    // Wait for any of them.
    for (int w = 0; w < crowd->jobs; w++) {
        if (crowd->worker[w].pid <= 0)
            continue;
        poll_fd[count] = (struct pollfd){.fd = crowd->worker[w].from, .events = POLLIN};
        of[count++] = w;
    }
    int ready = poll(poll_fd, (nfds_t)count, LOOK_EVERY_MS);
    end_late_ones(crowd);
    // Results, or the end of a process.
    for (int i = 0; i < count && ready > 0; i++) {
        Worker *worker = &crowd->worker[of[i]];
        if (poll_fd[i].revents != 0 && !receive(crowd, worker) && !replace(crowd, worker))
            return false;
    }
    return count > 0;
}

static void dismiss(Crowd *crowd)
{
    char why[WHY];
    for (int w = 0; w < crowd->jobs; w++) {
        Worker *worker = &crowd->worker[w];
        if (worker->pid > 0) {
            if (worker->task >= 0)
                kill(worker->pid, SIGKILL);
            bury(worker, why);
        }
        free(worker->result);
    }
    free(crowd->worker);
}

static bool run_crowd(const Pool *pool, Status *status)
{
    Crowd crowd = {.pool = pool, .jobs = pool->jobs < MOST_JOBS ? pool->jobs : MOST_JOBS};
    if (crowd.jobs > pool->task_count)
        crowd.jobs = pool->task_count;
    crowd.worker = calloc((size_t)crowd.jobs + 1, sizeof *crowd.worker);
    if (crowd.worker == NULL)
        return status_fail(status, STATUS_FAILED, "out of memory");
    // Writing to a child that died must not end the parent.
    struct sigaction ignore = {.sa_handler = SIG_IGN}, before;
    sigaction(SIGPIPE, &ignore, &before);
    bool ok = true;
    // A result's memory for each process.
    for (int w = 0; w < crowd.jobs; w++) {
        crowd.worker[w].to = crowd.worker[w].from = crowd.worker[w].task = -1;
        crowd.worker[w].result = malloc(pool->result_bytes);
        ok = ok && crowd.worker[w].result != NULL;
    }
    // Start them with a task each, then give every one that is done another.
    for (int w = 0; w < crowd.jobs && ok; w++) {
        ok = start(&crowd, &crowd.worker[w]);
        if (ok)
            hand_out(&crowd, &crowd.worker[w]);
    }
    while (ok && crowd.ended < pool->task_count)
        ok = wait_for_results(&crowd);
    dismiss(&crowd);
    sigaction(SIGPIPE, &before, NULL);
    return ok || status_fail(status, STATUS_FAILED, "a process for a case could not be started: %s",
                             strerror(errno));
}

bool pool_run(const Pool *pool, Status *status)
{
    if (pool->jobs > 1)
        return run_crowd(pool, status);
    void *result = malloc(pool->result_bytes);
    if (result == NULL)
        return status_fail(status, STATUS_FAILED, "out of memory");
    // Without processes: one after the other.
    for (int task = 0; task < pool->task_count; task++) {
        memset(result, 0, pool->result_bytes);
        pool->run(pool->user, task, result);
        pool->done(pool->user, task, result, NULL);
    }
    free(result);
    return true;
}
