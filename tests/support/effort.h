// How often a test repeats what chance decides.
#ifndef PLIANT_TESTS_EFFORT_H
#define PLIANT_TESTS_EFFORT_H

// A sanitizer makes code several times slower; what it looks for shows in fewer repeats.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define EFFORT(count) ((count) / 6 + 1)
#else
#define EFFORT(count) (count)
#endif

#endif
