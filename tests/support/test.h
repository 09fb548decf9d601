// SPDX-License-Identifier: MIT
// Claims that register themselves. A file of tests is a list of TESTs and a group; the files of a
// folder are one program, which has its main from test_main.c. Fixtures of cmocka, if any, stand
// above what they are around: AROUND_ALL(begin, end) runs them once for the TESTs below it in the
// file, AROUND_EACH(begin, end) for each of these, until the next one.
//
// What a fixture puts into its `*state` is `*test_state` in a TEST. Includes math.h,
// stdio.h, stdlib.h and string.h.
#ifndef PLIANT_TESTS_TEST_H
#define PLIANT_TESTS_TEST_H

#include "expect.h"

typedef enum TestKind {
    TEST_CLAIM,
    TEST_LONG_CLAIM,
    TEST_AROUND_ALL,
    TEST_AROUND_EACH,
    TEST_COMMAND,
} TestKind;

typedef struct TestEntry {
    TestKind kind;
    const char *file;
    int place;                      // in the file: they count up
    const char *name;               // of a claim or command
    CMUnitTestFunction run;         // of a claim or command
    CMFixtureFunction begin, end;   // of what is around claims; NULL: nothing
    const struct TestEntry *former; // registered before it
} TestEntry;

// Before main.
void test_register(TestEntry *entry);
// What the command line has behind the options, from number 1; "" behind the last one.
const char *test_argument(int number);
// What a program needs around all of its groups; before main.
void test_around_program(void (*begin)(void), void (*end)(void));
// What it needs around each claim that has no AROUND_EACH; before main.
void test_around_claims(CMFixtureFunction begin, CMFixtureFunction end);
// Ends the program as skipped, for a fixture: why says what this machine lacks.
_Noreturn void test_skip_program(const char *why);
// True in the long form of a group (--long), which repeats more and has the LONG_TESTs.
bool test_is_long(void);

#define TEST(claim) TEST_CLAIM_OF(TEST_CLAIM, claim)
// In the long form only.
#define LONG_TEST(claim) TEST_CLAIM_OF(TEST_LONG_CLAIM, claim)
// Runs in place of all claims by `test_FOLDER --command`: writes what claims compare with.
#define WRITER(command) TEST_CLAIM_OF(TEST_COMMAND, command)

#define AROUND_ALL(first, last)                                                                    \
    TEST_ENTRY(TEST_AROUND_ALL, __LINE__, .begin = (first), .end = (last))
#define AROUND_EACH(first, last)                                                                   \
    TEST_ENTRY(TEST_AROUND_EACH, __LINE__, .begin = (first), .end = (last))

#define TEST_CLAIM_OF(of_kind, claim)                                                              \
    static void claim(void **);                                                                    \
    TEST_ENTRY(of_kind, claim, .name = #claim, .run = claim)                                       \
    static void claim(__attribute__((unused)) void **test_state)

#define TEST_ENTRY(of_kind, id, ...) TEST_ENTRY_AT(of_kind, id, __VA_ARGS__)
#define TEST_ENTRY_AT(of_kind, id, ...)                                                            \
    static TestEntry entry_of_##id = {                                                             \
        .kind = (of_kind), .file = __BASE_FILE__, .place = __COUNTER__, __VA_ARGS__};              \
    __attribute__((constructor)) static void register_##id(void)                                   \
    {                                                                                              \
        test_register(&entry_of_##id);                                                             \
    }

#endif
