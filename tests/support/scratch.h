// A folder of its own for the files of a test, removed at the end.
#ifndef PLIANT_TESTS_SCRATCH_H
#define PLIANT_TESTS_SCRATCH_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SCRATCH_PATH = 256 };

typedef struct Scratch {
    char folder[64];
} Scratch;

static inline int scratch_create(Scratch *scratch)
{
    const char *parent = getenv("TMPDIR");
    if (parent == NULL || strlen(parent) > 30)
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

// Writes `size` bytes to a file of the folder.
static inline void scratch_write(const Scratch *scratch, const char *name, const void *data,
                                 size_t size)
{
    char path[SCRATCH_PATH];
    FILE *file = fopen(scratch_path(scratch, name, path), "wb");
    if (file == NULL || fwrite(data, 1, size, file) != size || fclose(file) != 0)
        abort();
}

// The bytes of a file of the folder, malloc'ed.
static inline unsigned char *scratch_read(const Scratch *scratch, const char *name, size_t *size)
{
    char path[SCRATCH_PATH];
    FILE *file = fopen(scratch_path(scratch, name, path), "rb");
    if (file == NULL || fseek(file, 0, SEEK_END) != 0)
        abort();
    *size = (size_t)ftell(file);
    rewind(file);
    unsigned char *data = malloc(*size + 1);
    if (data == NULL || fread(data, 1, *size, file) != *size || fclose(file) != 0)
        abort();
    return data;
}

// Makes the seal of a changed HDF5 file of ours valid again: FNV-1a over all behind its first 512
// bytes.
static inline void scratch_seal(const Scratch *scratch, const char *name)
{
    size_t size = 0;
    unsigned char *data = scratch_read(scratch, name, &size);
    unsigned long long hash = 14695981039346656037u;
    for (size_t i = 512; i < size; i++)
        hash = (hash ^ data[i]) * 1099511628211u;
    memset(data, 0, 512);
    snprintf((char *)data, 512, "pliant: %zu bytes follow, fnv1a %016llx\n", size - 512, hash);
    scratch_write(scratch, name, data, size);
    free(data);
}

// Removes the folder; it holds files only.
static inline void scratch_destroy(Scratch *scratch)
{
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", scratch->folder);
    if (system(command) != 0)
        abort();
}

#endif
