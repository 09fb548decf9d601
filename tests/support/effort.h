// SPDX-License-Identifier: MIT
// How often a test repeats what chance decides.
#ifndef PLIANT_TESTS_EFFORT_H
#define PLIANT_TESTS_EFFORT_H

// A sanitizer makes code several times slower, and what it looks for shows in fewer repeats: CMake
// sets a share of 6.
#ifndef PLIANT_EFFORT
#define PLIANT_EFFORT 1
#endif
#define EFFORT(count) (PLIANT_EFFORT == 1 ? (count) : (count) / PLIANT_EFFORT + 1)

// The long form of a group repeats more (test.h).
#define TRIALS(few, many) EFFORT(test_is_long() ? (many) : (few))

#endif
