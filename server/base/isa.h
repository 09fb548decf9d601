// Instruction-set levels that kernels are compiled for, and which of them this machine can run.
#ifndef PLIANT_BASE_ISA_H
#define PLIANT_BASE_ISA_H

#include <stddef.h>

typedef enum IsaLevel { ISA_BASE, ISA_V3, ISA_V4, ISA_COUNT } IsaLevel;

// Returns "x86-64-v4", "x86-64-v3" or, on any processor, "baseline".
const char *isa_name(IsaLevel level);
// Returns the best level that this machine can run.
IsaLevel isa_best(void);
// Finds a level by name; "auto" is the best one. Returns ISA_COUNT if unknown or not runnable on
// this machine.
IsaLevel isa_find(const char *name);
// Returns the names of the levels that this machine can run, best first, NULL at the end.
const char *const *isa_available(void);

// Defines <name>_kernels [precision][level], the kernels that pliant_kernels of
// server/CMakeLists.txt compiles; NULL: not for this processor.
#if defined(__x86_64__)
#define ISA_KERNELS(Kernels, name)                                                                 \
    extern const Kernels name##_kernels_double_base, name##_kernels_single_base;                   \
    extern const Kernels name##_kernels_double_v3, name##_kernels_single_v3;                       \
    extern const Kernels name##_kernels_double_v4, name##_kernels_single_v4;                       \
    static const Kernels *const name##_kernels[PRECISION_COUNT][ISA_COUNT] = {                     \
        [PRECISION_DOUBLE] = {&name##_kernels_double_base, &name##_kernels_double_v3,              \
                              &name##_kernels_double_v4},                                          \
        [PRECISION_SINGLE] = {&name##_kernels_single_base, &name##_kernels_single_v3,              \
                              &name##_kernels_single_v4},                                          \
    }
#else
#define ISA_KERNELS(Kernels, name)                                                                 \
    extern const Kernels name##_kernels_double_base, name##_kernels_single_base;                   \
    static const Kernels *const name##_kernels[PRECISION_COUNT][ISA_COUNT] = {                     \
        [PRECISION_DOUBLE] = {&name##_kernels_double_base},                                        \
        [PRECISION_SINGLE] = {&name##_kernels_single_base},                                        \
    }
#endif

// The precisions in which the kernels of bodies compute and store their numbers.
typedef enum Precision { PRECISION_DOUBLE, PRECISION_SINGLE, PRECISION_COUNT } Precision;

#endif
