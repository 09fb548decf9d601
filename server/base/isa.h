// Instruction-set levels that kernels are compiled for, and which of them this machine can run.
#ifndef PLIANT_BASE_ISA_H
#define PLIANT_BASE_ISA_H

typedef enum IsaLevel { ISA_BASE, ISA_V3, ISA_V4, ISA_COUNT } IsaLevel;

// "x86-64-v4", "x86-64-v3" or, of any processor, "baseline".
const char *isa_name(IsaLevel level);
// The best that this machine can run.
IsaLevel isa_best(void);
// By name, or the best for "auto"; ISA_COUNT when unknown or not runnable here.
IsaLevel isa_find(const char *name);
// Names of those that this machine can run, best first; NULL at the end.
const char *const *isa_available(void);

#endif
