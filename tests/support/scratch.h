// SPDX-License-Identifier: MIT
// A folder of its own for the files of a test, removed at the end.
#ifndef PLIANT_TESTS_SCRATCH_H
#define PLIANT_TESTS_SCRATCH_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

enum { SCRATCH_PATH = 512 };

typedef struct Scratch {
    char folder[256];
} Scratch;

static inline int scratch_create(Scratch *scratch)
{
    const char *parent = getenv("TMPDIR");
    if (parent == NULL || strlen(parent) > 200)
        parent = "/tmp";
    snprintf(scratch->folder, sizeof scratch->folder, "%s/pliant-test-XXXXXX", parent);
    return mkdtemp(scratch->folder) != NULL ? 0 : -1;
}

static inline const char *scratch_path(const Scratch *scratch, const char *name,
                                       char path[SCRATCH_PATH])
{
    snprintf(path, SCRATCH_PATH, "%s/%s", scratch->folder, name);
    return path;
}

static inline void file_write(const char *path, const void *data, size_t size)
{
    FILE *file = fopen(path, "wb");
    if (file == NULL || fwrite(data, 1, size, file) != size || fclose(file) != 0)
        abort();
}

// The bytes of a file and a 0 behind them, malloc'ed.
static inline unsigned char *file_read(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL || fseek(file, 0, SEEK_END) != 0)
        abort();
    *size = (size_t)ftell(file);
    rewind(file);
    unsigned char *data = malloc(*size + 1);
    if (data == NULL || fread(data, 1, *size, file) != *size || fclose(file) != 0)
        abort();
    data[*size] = 0;
    return data;
}

// The same as a text.
static inline char *file_text(const char *path)
{
    size_t size;
    return (char *)file_read(path, &size);
}

static inline void file_copy(const char *from, const char *to)
{
    size_t size = 0;
    unsigned char *data = file_read(from, &size);
    file_write(to, data, size);
    free(data);
}

// Makes the seal of a changed HDF5 file of ours valid again: FNV-1a over all behind its first 512
// bytes.
static inline void seal_bytes(unsigned char *data, size_t size)
{
    unsigned long long hash = 14695981039346656037u;
    for (size_t i = 512; i < size; i++)
        hash = (hash ^ data[i]) * 1099511628211u;
    memset(data, 0, 512);
    snprintf((char *)data, 512, "pliant: %zu bytes follow, fnv1a %016llx\n", size - 512, hash);
}

// The same for a file of the folder.
static inline void scratch_write(const Scratch *scratch, const char *name, const void *data,
                                 size_t size)
{
    char path[SCRATCH_PATH];
    file_write(scratch_path(scratch, name, path), data, size);
}

static inline unsigned char *scratch_read(const Scratch *scratch, const char *name, size_t *size)
{
    char path[SCRATCH_PATH];
    return file_read(scratch_path(scratch, name, path), size);
}

static inline void scratch_seal(const Scratch *scratch, const char *name)
{
    size_t size = 0;
    unsigned char *data = scratch_read(scratch, name, &size);
    seal_bytes(data, size);
    scratch_write(scratch, name, data, size);
    free(data);
}

// Limits the size of files, which stands in for a full disk; returns what was allowed before.
static inline rlim_t limit_files(rlim_t bytes)
{
    struct rlimit limit;
    if (getrlimit(RLIMIT_FSIZE, &limit) != 0)
        abort();
    const rlim_t before = limit.rlim_cur;
    limit.rlim_cur = bytes;
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0)
        abort();
    return before;
}

// Removes the folder and all in it.
static inline void scratch_destroy(Scratch *scratch)
{
    char command[SCRATCH_PATH];
    snprintf(command, sizeof command, "rm -rf '%s'", scratch->folder);
    if (system(command) != 0)
        abort();
}

#endif
