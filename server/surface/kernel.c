// Which instruction-set levels of the kernel this machine can run.
#include "surface/kernel.h"

#include <stddef.h>
#include <string.h>

extern const SpringKernels spring_kernels_base;
#if defined(__x86_64__)
extern const SpringKernels spring_kernels_v3, spring_kernels_v4;
#endif

const SpringKernels *const *kernels_available(void)
{
    static const SpringKernels *available[4];
    int count = 0;
#if defined(__x86_64__)
    __builtin_cpu_init();
    bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi2") &&
              __builtin_cpu_supports("fma");
    bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
              __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
              __builtin_cpu_supports("avx512vl");
    if (v4)
        available[count++] = &spring_kernels_v4;
    if (v3)
        available[count++] = &spring_kernels_v3;
#endif
    available[count++] = &spring_kernels_base;
    available[count] = NULL;
    return available;
}

const SpringKernels *kernels_find(const char *level)
{
    const SpringKernels *const *available = kernels_available();
    if (strcmp(level, "auto") == 0)
        return available[0];
    for (int i = 0; available[i] != NULL; i++)
        if (strcmp(available[i]->level, level) == 0)
            return available[i];
    return NULL;
}
