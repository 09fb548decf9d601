// Instruction-set levels that kernels are compiled for, and which of them this machine can run.
#ifndef PLIANT_BASE_ISA_H
#define PLIANT_BASE_ISA_H

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

#endif
