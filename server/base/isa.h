// SPDX-License-Identifier: MIT
// Instruction-set levels that kernels are compiled for, and which of them this machine can run.
#ifndef PLIANT_BASE_ISA_H
#define PLIANT_BASE_ISA_H

#include <stddef.h>

typedef enum IsaLevel { ISA_BASE, ISA_V3, ISA_V4, ISA_COUNT } IsaLevel;

// Returns "x86-64-v4", "x86-64-v3" or, on any processor, "baseline".
const char *isa_name(IsaLevel level);
// Returns the best level that is compiled and that this machine can run.
IsaLevel isa_best(void);
// Finds a level by name; "auto" is the best one. Returns ISA_COUNT if unknown, not compiled or not
// runnable on this machine.
IsaLevel isa_find(const char *name);
// Returns the names of the levels up to the best one, best first, NULL at the end.
const char *const *isa_available(void);

// The precisions in which the kernels of bodies compute and store their numbers.
typedef enum Precision { PRECISION_DOUBLE, PRECISION_SINGLE, PRECISION_COUNT } Precision;

// PLIANT_ISA_LEVELS of them are compiled, the lowest first (PLIANT_ISA of CMakeLists.txt).
#if PLIANT_ISA_LEVELS > 1
#define ISA_IF_V3(...) __VA_ARGS__
#else
#define ISA_IF_V3(...)
#endif
#if PLIANT_ISA_LEVELS > 2
#define ISA_IF_V4(...) __VA_ARGS__
#else
#define ISA_IF_V4(...)
#endif

// Defines kernels[level] from the objects <kernels>_base and so on; NULL: not compiled.
#define ISA_KERNELS_OF(Kernels, kernels)                                                           \
    extern const Kernels kernels##_base;                                                           \
    ISA_IF_V3(extern const Kernels kernels##_v3;)                                                  \
    ISA_IF_V4(extern const Kernels kernels##_v4;)                                                  \
    static const Kernels *const kernels[ISA_COUNT] = {[ISA_BASE] = &kernels##_base,                \
                                                      ISA_IF_V3([ISA_V3] = &kernels##_v3, )        \
                                                          ISA_IF_V4([ISA_V4] = &kernels##_v4)}

// Defines <name>_kernels[precision][level], which pliant_kernels of server/CMakeLists.txt compiles.
#define ISA_KERNELS(Kernels, name)                                                                 \
    ISA_KERNELS_OF(Kernels, name##_kernels_double);                                                \
    ISA_KERNELS_OF(Kernels, name##_kernels_single);                                                \
    static const Kernels *const *const name##_kernels[PRECISION_COUNT] = {                         \
        [PRECISION_DOUBLE] = name##_kernels_double, [PRECISION_SINGLE] = name##_kernels_single}

#endif
