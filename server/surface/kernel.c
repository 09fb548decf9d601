// Which instruction-set levels of the kernel this machine can run.
#include "surface/kernel.h"

#include <stddef.h>
#include <string.h>

extern const SpringKernels spring_kernels_double_base, spring_kernels_single_base;
#if defined(__x86_64__)
extern const SpringKernels spring_kernels_double_v3, spring_kernels_single_v3;
extern const SpringKernels spring_kernels_double_v4, spring_kernels_single_v4;
#endif

const SpringKernels *const *kernels_available(Precision precision)
{
    static const SpringKernels *available[PRECISION_COUNT][4];
    const bool single = precision == PRECISION_SINGLE;
    const SpringKernels **list = available[precision];
    int count = 0;
#if defined(__x86_64__)
    __builtin_cpu_init();
    bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi2") &&
              __builtin_cpu_supports("fma");
    bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
              __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
              __builtin_cpu_supports("avx512vl");
    if (v4)
        list[count++] = single ? &spring_kernels_single_v4 : &spring_kernels_double_v4;
    if (v3)
        list[count++] = single ? &spring_kernels_single_v3 : &spring_kernels_double_v3;
#endif
    list[count++] = single ? &spring_kernels_single_base : &spring_kernels_double_base;
    list[count] = NULL;
    return list;
}

const SpringKernels *kernels_find(Precision precision, const char *level)
{
    const SpringKernels *const *available = kernels_available(precision);
    if (strcmp(level, "auto") == 0)
        return available[0];
    for (int i = 0; available[i] != NULL; i++)
        if (strcmp(available[i]->level, level) == 0)
            return available[i];
    return NULL;
}
