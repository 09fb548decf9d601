// SPDX-License-Identifier: MIT
// The main of every test program: runs the claims of one group, or of all, in the order of their
// files.
//
// test_FOLDER [--group NAME] [--long] [ARGUMENTS], test_FOLDER --list, or test_FOLDER --WRITER
// [ARGUMENTS]
#include "test.h"

static void (*begin_program)(void), (*end_program)(void);
static CMFixtureFunction begin_claim, end_claim;
static const TestEntry *newest;
static int entry_count;
static bool is_long;
static int argument_count;
static char **arguments;

// libconfig 1.5 forgets the text of a string when the syntax is wrong right behind it.
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void)
{
    return "leak:strbuf_append";
}

void test_register(TestEntry *entry)
{
    entry->former = newest;
    newest = entry;
    entry_count++;
}

void test_around_program(void (*begin)(void), void (*end)(void))
{
    begin_program = begin;
    end_program = end;
}

void test_around_claims(CMFixtureFunction begin, CMFixtureFunction end)
{
    begin_claim = begin;
    end_claim = end;
}

static void start_program(void)
{
    if (begin_program != NULL)
        begin_program();
}

static int leave_program(int result)
{
    if (end_program != NULL)
        end_program();
    return result;
}

void test_skip_program(const char *why)
{
    printf("skipped: %s\n", why);
    exit(leave_program(77));
}

const char *test_argument(int number)
{
    return number <= argument_count ? arguments[number - 1] : "";
}

bool test_is_long(void)
{
    return is_long;
}

static int compare_places(const void *a, const void *b)
{
    const TestEntry *one = *(const TestEntry *const *)a, *other = *(const TestEntry *const *)b;
    const int files = strcmp(one->file, other->file);
    return files != 0 ? files : one->place - other->place;
}

// True if the file's name is test_<group>.c.
static bool is_of_group(const TestEntry *entry, const char *group)
{
    const char *slash = strrchr(entry->file, '/');
    const char *name = (slash != NULL ? slash + 1 : entry->file) + strlen("test_");
    const size_t length = strlen(group);
    return strncmp(name, group, length) == 0 && strcmp(name + length, ".c") == 0;
}

static bool is_claim(const TestEntry *entry)
{
    return entry->kind == TEST_CLAIM || (is_long && entry->kind == TEST_LONG_CLAIM);
}

// Runs the claims at the start of `entries` that share a file and what is around them all; returns
// how many entries these are, and adds what failed.
static int run_together(const TestEntry **entries, int count, int *claims, int *failed)
{
    struct CMUnitTest *tests = calloc((size_t)count, sizeof *tests);
    const TestEntry *all = NULL, *each = NULL;
    int used = 0, k = 0;
    if (tests == NULL)
        exit(2);
    for (; k < count && strcmp(entries[k]->file, entries[0]->file) == 0; k++) {
        const TestEntry *entry = entries[k];
        if (entry->kind == TEST_AROUND_ALL && k > 0)
            break;
        if (entry->kind == TEST_AROUND_ALL)
            all = entry;
        else if (entry->kind == TEST_AROUND_EACH)
            each = entry;
        else if (is_claim(entry))
            tests[used++] =
                (struct CMUnitTest){.name = entry->name,
                                    .test_func = entry->run,
                                    .setup_func = each != NULL ? each->begin : begin_claim,
                                    .teardown_func = each != NULL ? each->end : end_claim};
    }
    if (used > 0)
        *failed +=
            _cmocka_run_group_tests("claims", tests, (size_t)used, all != NULL ? all->begin : NULL,
                                    all != NULL ? all->end : NULL);
    free(tests);
    *claims += used;
    return k;
}

// Runs the writer that an option `--name` stands for, if it does.
static bool write_instead(const char *option)
{
    for (const TestEntry *entry = newest; entry != NULL; entry = entry->former) {
        if (entry->kind == TEST_COMMAND && strncmp(option, "--", 2) == 0 &&
            strcmp(option + 2, entry->name) == 0) {
            start_program();
            entry->run(NULL);
            leave_program(0);
            return true;
        }
    }
    return false;
}

static int list(const TestEntry **entries, int count)
{
    for (int k = 0; k < count; k++) {
        if (entries[k]->name != NULL && entries[k]->kind != TEST_COMMAND)
            printf("%s %s\n", entries[k]->file, entries[k]->name);
    }
    return 0;
}

int main(int argc, char **argv)
{
    const char *group = NULL;
    bool is_list = false;
    int first = 1;
    argument_count = argc - 2;
    arguments = argv + 2;
    if (argc > 1 && write_instead(argv[1]))
        return 0;
    for (; first < argc && strncmp(argv[first], "--", 2) == 0; first++) {
        if (strcmp(argv[first], "--long") == 0)
            is_long = true;
        else if (strcmp(argv[first], "--list") == 0)
            is_list = true;
        else if (strcmp(argv[first], "--group") == 0 && first + 1 < argc)
            group = argv[++first];
        else
            break;
    }
    argument_count = argc - first;
    arguments = argv + first;

    const TestEntry **entries = calloc((size_t)entry_count + 1, sizeof *entries);
    int count = 0, claims = 0, failed = 0;
    if (entries == NULL)
        return 2;
    for (const TestEntry *entry = newest; entry != NULL; entry = entry->former) {
        if (group == NULL || is_of_group(entry, group))
            entries[count++] = entry;
    }
    qsort(entries, (size_t)count, sizeof *entries, compare_places);
    if (is_list)
        return list(entries, count);
    start_program();
    for (int k = 0; k < count;)
        k += run_together(entries + k, count - k, &claims, &failed);
    free(entries);
    leave_program(0);
    if (claims == 0) {
        printf("skipped: no claims of '%s' in this build\n", group != NULL ? group : "any group");
        return 77;
    }
    return failed;
}
