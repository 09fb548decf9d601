// SPDX-License-Identifier: MIT
// Two tables side by side: what became slower, larger or later since the older one.
#include "bench.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS_MAX = 1024, KEY_MAX = 112 };

typedef struct Row {
    char key[KEY_MAX]; // case, size and metric, with tabs
    double value;
} Row;

// False, with a sentence on stderr, when the file is no table of this program.
static bool read_table(const char *path, Row *rows, int *count)
{
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        fprintf(stderr, "pliant-bench: cannot read %s: %s\n", path, strerror(errno));
        return false;
    }
    char line[256], name[48], metric[40], size[16];
    bool whole = true;
    int number = 0;
    *count = 0;
    while (whole && fgets(line, sizeof line, file) != NULL) {
        number++;
        if (line[0] == '#' || strncmp(line, "case\t", 5) == 0)
            continue;
        Row *row = &rows[*count];
        whole = *count < ROWS_MAX && sscanf(line, "%47[^\t]\t%15[0-9]\t%39[^\t]\t%lf", name, size,
                                            metric, &row->value) == 4;
        if (!whole) {
            fprintf(stderr, "pliant-bench: %s:%d: no row of a table\n", path, number);
            break;
        }
        // The sizes that the search for the largest body finds are results, not keys.
        bool found = strncmp(name, "live.largest.", 13) == 0;
        snprintf(row->key, sizeof row->key, "%s\t%s\t%s", name, found ? "-" : size, metric);
        (*count)++;
    }
    fclose(file);
    return whole;
}

bool bench_compare(const char *old_path, const char *new_path)
{
    static Row old_rows[ROWS_MAX], new_rows[ROWS_MAX];
    int old_count, new_count;
    if (!read_table(old_path, old_rows, &old_count) || !read_table(new_path, new_rows, &new_count))
        return false;
    printf("case\tsize\tmetric\told\tnew\tnew/old\n");
    for (int i = 0; i < new_count; i++) {
        const Row *now = &new_rows[i], *then = NULL;
        for (int k = 0; k < old_count && then == NULL; k++)
            if (strcmp(old_rows[k].key, now->key) == 0)
                then = &old_rows[k];
        if (then == NULL)
            printf("%s\t-\t%.6g\tnew\n", now->key, now->value);
        else if (then->value != 0.0)
            printf("%s\t%.6g\t%.6g\t%.3f\n", now->key, then->value, now->value,
                   now->value / then->value);
        else
            printf("%s\t0\t%.6g\t%s\n", now->key, now->value, now->value == 0.0 ? "1.000" : "-");
    }
    return true;
}
