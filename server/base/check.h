// Two tiers of assertions for programmer's errors: ASSERT is cheap and always on, VALIDATE is an
// O(n) sweep that only debug builds make.
#ifndef PLIANT_BASE_CHECK_H
#define PLIANT_BASE_CHECK_H

// Prints the broken condition and aborts.
_Noreturn void check_failed(const char *condition, const char *file, int line);

#define ASSERT(condition) ((condition) ? (void)0 : check_failed(#condition, __FILE__, __LINE__))

#ifdef PLIANT_VALIDATE
#define VALIDATE(condition) ASSERT(condition)
#else
#define VALIDATE(condition) ((void)sizeof(condition))
#endif

#endif
