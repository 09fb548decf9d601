// SPDX-License-Identifier: MIT
// What a fault measured: `./dev faults` makes its table of these lines.
#ifndef PLIANT_TESTS_FAULT_INJECTION_FIGURE_H
#define PLIANT_TESTS_FAULT_INJECTION_FIGURE_H

#include <stdio.h>

#define figure(...)                                                                                \
    do {                                                                                           \
        fputs("figure: ", stdout);                                                                 \
        printf(__VA_ARGS__);                                                                       \
        putchar('\n');                                                                             \
    } while (0)

#endif
