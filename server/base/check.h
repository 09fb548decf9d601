// Assertions for programming errors: cheap and always on. Checks that sweep over all nodes belong
// in tests.
#ifndef PLIANT_BASE_CHECK_H
#define PLIANT_BASE_CHECK_H

// Prints the broken condition and aborts.
_Noreturn void check_failed(const char *condition, const char *file, int line);

#define ASSERT(condition) ((condition) ? (void)0 : check_failed(#condition, __FILE__, __LINE__))

#endif
