// SPDX-License-Identifier: MIT
// What is no volume, and what once was one.
#include "test.h"
#include "effort.h"
#include "random.h"
#include "volume_bench.h"

#include <limits.h>
#include <sys/mman.h>
#include <sys/stat.h>

// --- anything ---

AROUND_ALL(make_folder, scratch_end)

TEST(what_is_no_volume_is_refused)
{
    char name[SCRATCH_PATH];
    static const char *const neither = ": is neither an NRRD nor a NIfTI-1 file (of a pair .hdr "
                                       "and .img, name the .hdr); 3D Slicer saves others as NRRD";
    expect_error_of("/nowhere/organ.nrrd", ": No such file or directory");
    expect_error_of(scratch_space.folder, ": is a folder, not a volume file");
    scratch_write(&scratch_space, "organ", "", 0);
    expect_error(": the file is empty; export it again");
    scratch_write(&scratch_space, "organ", "\x1f\x8b", 2);
    expect_error(neither);
    scratch_write(&scratch_space, "organ", "solid cube\n", 11);
    expect_error(neither);
    scratch_write(&scratch_space, "organ", "NRRD", 4);
    expect_error(": its NRRD header has no field 'type'");
    assert_int_equal(mkfifo(scratch_path(&scratch_space, "pipe", name), 0600), 0);
    expect_error_of(name, ": is not a file");
    if (geteuid() != 0) { // who may read everything
        scratch_write(&scratch_space, "secret", "NRRD0004\n", 9);
        chmod(scratch_path(&scratch_space, "secret", name), 0);
        expect_error_of(name, ": Permission denied");
    }
    Bytes *bytes = calloc(1, sizeof *bytes), *file = calloc(1, sizeof *file);
    put_nrrd(bytes, &TYPES[1], "raw", false);
    put_gzip(file, bytes->at, bytes->size);
    write_file(file);
    expect_error(": is a gzip file with an NRRD file in it; unpack it first");
    free(bytes);
    free(file);
    // A header without an end.
    FREED unsigned char *text = malloc(2 << 20);
    memset(text, ' ', 2 << 20);
    memcpy(text, "NRRD0004\ntype: uchar\n", 21);
    scratch_write(&scratch_space, "organ", text, 2 << 20);
    expect_error(": has no end of its NRRD header in the first 1048576 bytes");
    uint64_t seed = 2;
    for (int repeat = 0; repeat < EFFORT(300); repeat++) {
        unsigned char garbage[700];
        LabelVolume volume;
        Status status = {0};
        for (size_t i = 0; i < sizeof garbage; i++)
            garbage[i] = (unsigned char)random_below(&seed, 256);
        if (repeat % 3 == 0)
            memcpy(garbage, "NRRD0004\n", 9);
        if (repeat % 3 == 1) {
            memcpy(garbage, "\x5c\1\0\0", 4);
            memcpy(garbage + 344, "n+1", 4);
        }
        scratch_write(&scratch_space, "organ", garbage, sizeof garbage);
        assert_false(volume_import(path, 1, &volume, &status));
    }
}

// Whatever becomes of a file, it is read or refused in one sentence. A file in memory: there are
// thousands.
static void try_file(const unsigned char *data, size_t size, int *read, int *refused)
{
    LabelVolume volume;
    Status status = {0};
    char name[64];
    int file = memfd_create("organ", 0);
    snprintf(name, sizeof name, "/proc/self/fd/%d", file);
    assert_true(file >= 0 && write(file, data, size) == (ssize_t)size);
    if (volume_import(name, 1, &volume, &status)) {
        VolumeLabels list;
        Status said = {0};
        if (volume_labels(&volume, &list, &said))
            volume_labels_destroy(&list);
        long sum = 0, voxels = (long)volume.count[0] * volume.count[1] * volume.count[2];
        for (long v = 0; v < voxels; v++)
            sum += volume.label[v];
        assert_true(sum != LONG_MIN && vec3_finite(volume.origin));
        volume_destroy(&volume);
        (*read)++;
    } else {
        assert_int_equal(status.code, STATUS_INVALID);
        assert_int_equal(strncmp(status.text, "/proc/self/fd/", 14), 0);
        assert_null(strchr(status.text, '\n'));
        (*refused)++;
    }
    close(file);
}

TEST(damaged_files_are_read_or_refused_but_never_harm)
{
    static const char *const encodings[] = {"raw", "gzip", "ascii", "hex"};
    FREED Bytes *base = malloc(sizeof *base), *inner = malloc(sizeof *inner);
    uint64_t seed = 17;
    for (int file = 0; file < 8; file++) {
        NiftiFields fields = plain_nifti();
        int read = 0, refused = 0;
        base->size = inner->size = 0;
        if (file < 4)
            put_nrrd(base, &TYPES[2 + file], encodings[file], file == 2);
        else if (file == 7) // two layers, of which one is read, and names
            put_text(base, "NRRD0005\ntype: char\ndimension: 4\nsizes: 2 2 2 2\nspace: LPS\n"
                           "space directions: none (1,0,0) (0,1,0) (0,0.02,1)\nencoding: raw\n"
                           "Segment0_Name:=ma\xc3\xa4\nSegment0_LabelValue:=5\nSegment0_Layer:=0\n"
                           "Segment1_Color:=0.5 1 0\n\n0123456789abcdef");
        else
            put_nifti_file(file == 6 ? inner : base, &fields, &TYPES[2 * (file - 4)], file == 5);
        if (file == 6)
            put_gzip(base, inner->at, inner->size);
        for (size_t size = 1; size < base->size; size++)
            try_file(base->at, size, &read, &refused);
        // No part of it is a volume, but a text whose last number, or a blank behind it, is cut.
        assert_true(read <= (file == 2 ? 2 : 0));
        for (int repeat = 0; repeat < EFFORT(1500); repeat++) {
            FREED unsigned char *data = malloc(base->size);
            memcpy(data, base->at, base->size);
            for (int changes = 1 + random_below(&seed, 3); changes > 0; changes--) {
                int at = random_below(&seed, (int)base->size);
                int how = random_below(&seed, 3);
                if (how == 0)
                    data[at] ^= (unsigned char)(1 << random_below(&seed, 8));
                else if (how == 1)
                    data[at] = (unsigned char)random_below(&seed, 256);
                else
                    data[at] = (unsigned char)"0123456789 \n:()-\xff"[random_below(&seed, 17)];
            }
            try_file(data, base->size, &read, &refused);
        }
        printf("file %d of %zu bytes: %d read, %d refused\n", file, base->size, read, refused);
        assert_true(refused > 0);
    }
}

TEST(nothing_was_printed)
{
    expect_nothing_printed();
}
