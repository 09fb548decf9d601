// SPDX-License-Identifier: MIT
// What the tests of volume files share: a folder of their own, a volume of 4 x 3 x 2 voxels, and
// what is expected of reading it.
#ifndef PLIANT_TESTS_VOLUME_BENCH_H
#define PLIANT_TESTS_VOLUME_BENCH_H

#include "expect.h"
#include "volume_writer.h"

#include "io/volume_import.h"

#include <fcntl.h>

static char path[SCRATCH_PATH]; // the file that most tests write and read
static int old_stderr;

// What anyone prints to stderr ends up in a file, to be looked at in the end.
static inline int make_folder(void **state)
{
    if (scratch_begin(state) != 0)
        return -1;
    scratch_path(&scratch_space, "organ", path);
    int file = open(scratch_at("stderr"), O_CREAT | O_WRONLY | O_APPEND, 0600);
    old_stderr = dup(2);
    return file >= 0 && dup2(file, 2) == 2 && close(file) == 0 ? 0 : -1;
}

// For the last claim of a file: readers say what is wrong to their caller alone.
static inline void expect_nothing_printed(void)
{
    size_t size;
    fflush(stderr);
    dup2(old_stderr, 2);
    FREED unsigned char *said = scratch_read(&scratch_space, "stderr", &size);
    assert_string_equal((char *)said, "");
}

// --- a volume of 4 x 3 x 2 voxels, all different ---

static const int COUNT[3] = {4, 3, 2};

static inline int label_at(int v)
{
    return v + 1;
}

static inline void put_labels(Bytes *bytes, const Type *type, bool big)
{
    for (int v = 0; v < 24; v++)
        put_value(bytes, type, label_at(v), big);
}

static inline void import(LabelVolume *volume)
{
    Status status = {0};
    expect_ok(volume_import(path, 1, volume, &status), status);
}

static inline void expect_labels(const LabelVolume *volume)
{
    assert_memory_equal(volume->count, COUNT, sizeof COUNT);
    for (int v = 0; v < 24; v++)
        assert_int_equal(volume->label[v], label_at(v));
}

static inline void expect_vec3(Vec3 actual, double x, double y, double z, double tolerance)
{
    expect_near(actual.x, x, tolerance);
    expect_near(actual.y, y, tolerance);
    expect_near(actual.z, z, tolerance);
}

// The text of the error must be the path followed by `rest`.
static inline void expect_error_of(const char *name, const char *rest)
{
    LabelVolume volume;
    Status status = {0};
    assert_false(volume_import(name, 1, &volume, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    assert_null(volume.label);
    if (strncmp(status.text, name, strlen(name)) != 0)
        fail_msg("%s", status.text);
    assert_string_equal(status.text + strlen(name), rest);
}

static inline void expect_error(const char *rest)
{
    expect_error_of(path, rest);
}

static inline void write_file(const Bytes *bytes)
{
    scratch_write(&scratch_space, "organ", bytes->at, bytes->size);
}

// A text header and the 24 voxels behind it, as unsigned char.
static inline void write_nrrd(const char *header)
{
    FREED Bytes *bytes = calloc(1, sizeof *bytes);
    put_text(bytes, "NRRD0004\n%s\n", header);
    put_labels(bytes, &TYPES[1], false);
    write_file(bytes);
}

static inline void put_nrrd(Bytes *bytes, const Type *type, const char *encoding, bool big)
{
    FREED Bytes *raw = calloc(1, sizeof *raw);
    put_text(bytes,
             "NRRD0005\n# by hand\ntype: %s\ndimension: 3\nspace: LPS\nsizes: 4 3 2\n"
             "kinds: domain space domain\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
             "space units: \"mm\" \"mm\" \"mm\"\nspace origin: (1,2,3)\nendian: %s\n"
             "key:=value\nline skip: 0\nencoding: %s\n\n",
             type->nrrd, big ? "big" : "little", encoding);
    put_labels(raw, type, big);
    if (encoding[0] == 'g')
        put_gzip(bytes, raw->at, raw->size);
    else if (encoding[0] == 'r')
        put_bytes(bytes, raw->at, raw->size);
    for (int v = 0; v < 24 && encoding[0] == 'a'; v++)
        put_text(bytes, v % 5 == 4 ? "%d\n" : v % 7 == 3 ? "%d, " : "%d ", label_at(v));
    for (size_t b = 0; b < raw->size && encoding[0] == 'h'; b++)
        put_text(bytes, b % 9 == 8 ? "%02X\n" : "%02x", raw->at[b]);
}

// A turn by 90 degrees about z, and spacings 2, 3, 4.
static inline NiftiFields plain_nifti(void)
{
    return (NiftiFields){.dim = {3, 4, 3, 2, 1, 1, 1, 1},
                         .datatype = 2,
                         .pixdim = {1, 2, 3, 4, 0, 0, 0, 0},
                         .vox_offset = 352,
                         .sform = 1,
                         .srow = {{0, -3, 0, 10}, {2, 0, 0, 20}, {0, 0, 4, 30}},
                         .magic = "n+1"};
}

static inline void put_nifti_file(Bytes *bytes, const NiftiFields *fields, const Type *type,
                                  bool big)
{
    NiftiFields typed = *fields;
    typed.datatype = type->nifti;
    put_nifti(bytes, &typed, big);
    put_number(bytes, 0, 4, false);
    put_labels(bytes, type, big);
}

static inline void write_nifti(const NiftiFields *fields, const Type *type, bool big, bool packed)
{
    FREED Bytes *bytes = calloc(1, sizeof *bytes), *file = calloc(1, sizeof *file);
    put_nifti_file(bytes, fields, type, big);
    if (packed)
        put_gzip(file, bytes->at, bytes->size);
    write_file(packed ? file : bytes);
}

// A file of the voxels alone, as unsigned char, between two texts.
static inline void write_voxels(const char *name, const char *before, bool packed,
                                const char *behind)
{
    FREED Bytes *bytes = calloc(1, sizeof *bytes), *raw = calloc(1, sizeof *raw);
    put_labels(raw, &TYPES[1], false);
    put_text(bytes, "%s", before);
    if (packed)
        put_gzip(bytes, raw->at, raw->size);
    else
        put_bytes(bytes, raw->at, raw->size);
    put_text(bytes, "%s", behind);
    scratch_write(&scratch_space, name, bytes->at, bytes->size);
}

#endif
