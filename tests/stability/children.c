// SPDX-License-Identifier: MIT
#include "children.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

enum { AT_A_TIME_MOST = 64 };

void *children_memory(size_t size)
{
    void *memory = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) {
        perror("mmap");
        exit(EXIT_FAILURE);
    }
    return memory;
}

static pid_t start(int index, int cpu_s, ChildJob *job, void *context)
{
    fflush(NULL);
    pid_t pid = fork();
    if (pid < 0) {
        perror("fork");
        exit(EXIT_FAILURE);
    }
    if (pid > 0)
        return pid;
    const struct rlimit cpu = {(rlim_t)cpu_s, (rlim_t)cpu_s + 5}, core = {0, 0};
    setrlimit(RLIMIT_CPU, &cpu);
    setrlimit(RLIMIT_CORE, &core);
    job(index, context);
    fflush(NULL);
    _exit(0);
}

void children_run(int count, int at_a_time, int cpu_s, ChildJob *job, ChildEnded *ended,
                  void *context)
{
    struct {
        pid_t pid;
        int index;
    } child[AT_A_TIME_MOST];
    int running = 0, next = 0;
    at_a_time = at_a_time < AT_A_TIME_MOST ? at_a_time : AT_A_TIME_MOST;
    while (next < count || running > 0) {
        if (next < count && running < at_a_time) {
            child[running].index = next;
            child[running++].pid = start(next++, cpu_s, job, context);
            continue;
        }
        int how = 0;
        pid_t pid = wait(&how);
        for (int i = 0; i < running; i++) {
            if (child[i].pid != pid)
                continue;
            int signal = WIFSIGNALED(how) ? WTERMSIG(how) : 0;
            // A sanitizer ends the process with a code of its own.
            if (WIFEXITED(how) && WEXITSTATUS(how) != 0)
                signal = -WEXITSTATUS(how);
            ended(child[i].index, signal, context);
            child[i] = child[--running];
            break;
        }
    }
}
