// SPDX-License-Identifier: MIT
// Jobs that may crash or hang, each in a process of its own.
#ifndef PLIANT_TESTS_STABILITY_CHILDREN_H
#define PLIANT_TESTS_STABILITY_CHILDREN_H

#include <stdbool.h>
#include <stddef.h>

typedef void ChildJob(int index, void *context);
// Told by the parent, in the order in which the jobs end. `signal` 0: the job came to its end.
typedef void ChildEnded(int index, int signal, void *context);

// Runs jobs [0, count), `at_a_time` of them together, each for at most `cpu_s` of processor time
// (then it ends by SIGXCPU).
void children_run(int count, int at_a_time, int cpu_s, ChildJob *job, ChildEnded *ended,
                  void *context);

// Zeroed memory in which jobs leave their results to the parent; never freed.
void *children_memory(size_t size);

#endif
