// SPDX-License-Identifier: MIT
#include "base/isa.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

// Best first.
static const char *const names[ISA_COUNT + 1] = {"x86-64-v4", "x86-64-v3", "baseline", NULL};

const char *isa_name(IsaLevel level)
{
    return names[ISA_COUNT - 1 - level];
}

// Returns the best level whose features, of those that kernels use, this processor has.
static IsaLevel of_processor(void)
{
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (!(__builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi2") &&
          __builtin_cpu_supports("fma")))
        return ISA_BASE;
    bool v4 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
              __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
              __builtin_cpu_supports("avx512vl");
    return v4 ? ISA_V4 : ISA_V3;
#else
    return ISA_BASE;
#endif
}

IsaLevel isa_best(void)
{
    const IsaLevel compiled = (IsaLevel)(PLIANT_ISA_LEVELS - 1), level = of_processor();
    return level < compiled ? level : compiled;
}

IsaLevel isa_find(const char *name)
{
    if (strcmp(name, "auto") == 0)
        return isa_best();
    for (int level = 0; level <= (int)isa_best(); level++)
        if (strcmp(name, isa_name((IsaLevel)level)) == 0)
            return (IsaLevel)level;
    return ISA_COUNT;
}

const char *const *isa_available(void)
{
    return &names[ISA_COUNT - 1 - isa_best()];
}
