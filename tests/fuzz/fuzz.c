// SPDX-License-Identifier: MIT
#include "fuzz.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static char folder[64];

void fuzz_failed(const char *what, const char *file, int line)
{
    fprintf(stderr, "fuzz: does not hold at %s:%d: %s\n", file, line, what);
    abort();
}

// Files only.
static void remove_folder(void)
{
    char command[96];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command) != 0)
        fprintf(stderr, "fuzz: %s is left\n", folder);
}

static void make_folder(void)
{
    const char *parent = getenv("TMPDIR");
    if (parent == NULL || strlen(parent) > 40)
        parent = access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp";
    snprintf(folder, sizeof folder, "%s/pliant-fuzz-XXXXXX", parent);
    MUST(mkdtemp(folder) != NULL);
    atexit(remove_folder);
}

const char *fuzz_path(const char *name)
{
    static char path[4][128];
    static int next;
    if (folder[0] == '\0')
        make_folder();
    next = (next + 1) % 4;
    snprintf(path[next], sizeof path[next], "%s/%s", folder, name);
    return path[next];
}

const char *fuzz_write(const char *name, const void *data, size_t size)
{
    const char *path = fuzz_path(name);
    FILE *file = fopen(path, "wb");
    MUST(file != NULL && fwrite(data, 1, size, file) == size && fclose(file) == 0);
    return path;
}

void fuzz_print(const char *text)
{
    static int telling = -1;
    if (telling < 0)
        telling = getenv("PLIANT_FUZZ_PRINT") != NULL;
    if (telling)
        fprintf(stderr, "%s\n", text);
}

double feed_number(Feed *feed, double scale)
{
    static const double strange[] = {
        0.0,    -0.0,   1.0, -1.0, HUGE_VAL, (double)NAN,  1e300,         -1e300,
        1e-300, 5e-324, 1e3, 1e9,  -1000.0,  2147483648.0, -2147483649.0, 9.3e18};
    int16_t share = (int16_t)feed_word(feed, 2);
    if (share == INT16_MIN)
        return strange[feed_byte(feed) % (sizeof strange / sizeof *strange)];
    if (share == INT16_MAX) {
        uint64_t bits = feed_word(feed, 8);
        double any;
        memcpy(&any, &bits, sizeof any);
        return any;
    }
    return scale * share / 16384.0;
}
