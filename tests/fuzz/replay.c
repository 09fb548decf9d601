// SPDX-License-Identifier: MIT
// Runs a fuzzer's harness over the files of a folder, in builds without libFuzzer.
#include "fuzz.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SANITIZED 1
#endif
#endif

enum { LARGEST = 1 << 20, SECONDS_EACH = 300 };

// A small input must not take much memory: what wants more than this is refused, or aborts. The
// sanitizers reserve more than that for themselves.
static void limit_memory(void)
{
#ifndef SANITIZED
    const struct rlimit limit = {2048UL << 20, 2048UL << 20};
    MUST(setrlimit(RLIMIT_AS, &limit) == 0);
#endif
}

static void run(const char *path)
{
    static uint8_t buffer[LARGEST];
    FILE *file = fopen(path, "rb");
    MUST(file != NULL);
    size_t size = fread(buffer, 1, sizeof buffer, file);
    MUST(feof(file));
    fclose(file);
    // A copy of its very size: reading beyond it is found.
    uint8_t *data = malloc(size > 0 ? size : 1);
    MUST(data != NULL);
    memcpy(data, buffer, size);
    alarm(SECONDS_EACH);
    LLVMFuzzerTestOneInput(data, size);
    alarm(0);
    free(data);
}

int main(int argc, char **argv)
{
    int count = 0;
    limit_memory();
    for (int i = 1; i < argc; i++) {
        DIR *folder = opendir(argv[i]);
        if (folder == NULL) {
            run(argv[i]);
            count++;
            continue;
        }
        for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
            char path[4096];
            if (entry->d_name[0] == '.')
                continue;
            snprintf(path, sizeof path, "%s/%s", argv[i], entry->d_name);
            // Said first, so that a crash has a name.
            printf("%s\n", path);
            fflush(stdout);
            run(path);
            count++;
        }
        closedir(folder);
    }
    printf("%d inputs\n", count);
    return count > 0 ? 0 : 1;
}
