// SPDX-License-Identifier: MIT
// What cmocka lacks: comparisons of doubles that print both values, with a tolerance in doubles.
#ifndef PLIANT_TESTS_EXPECT_H
#define PLIANT_TESTS_EXPECT_H

#include "scoped.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

// |actual - expected| <= tolerance, absolute; fails for NaN.
#define expect_near(actual, expected, tolerance)                                                   \
    expect_near_at((actual), (expected), (tolerance), #actual, __FILE__, __LINE__)
// actual <= limit and actual >= limit; fail for NaN.
#define expect_at_most(actual, limit)                                                              \
    expect_order((actual), (limit), 1.0, #actual " <= " #limit, __FILE__, __LINE__)
#define expect_at_least(actual, limit)                                                             \
    expect_order((actual), (limit), -1.0, #actual " >= " #limit, __FILE__, __LINE__)

// The text has `part` in it; fails with both.
#define expect_in(text, part) expect_in_at((text), (part), __FILE__, __LINE__)
// What returns false with a status (or error) has succeeded; fails with the status' text.
#define expect_ok(succeeded, status)                                                               \
    do {                                                                                           \
        if (!(succeeded))                                                                          \
            fail_msg("%s", (status).text);                                                         \
    } while (0)

static inline void expect_near_at(double actual, double expected, double tolerance,
                                  const char *what, const char *file, int line)
{
    if (!(fabs(actual - expected) <= tolerance)) {
        print_error("%s = %.17g, expected %.17g within %g (off by %g)\n", what, actual, expected,
                    tolerance, actual - expected);
        _fail(file, line);
    }
}

static inline void expect_in_at(const char *text, const char *part, const char *file, int line)
{
    if (strstr(text, part) == NULL) {
        print_error("'%s' does not say '%s'\n", text, part);
        _fail(file, line);
    }
}

// sign 1: at most, -1: at least.
static inline void expect_order(double actual, double limit, double sign, const char *what,
                                const char *file, int line)
{
    if (!(sign * actual <= sign * limit)) {
        print_error("%s does not hold: %.17g against %.17g\n", what, actual, limit);
        _fail(file, line);
    }
}

#endif
