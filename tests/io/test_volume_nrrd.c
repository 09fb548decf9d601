// SPDX-License-Identifier: MIT
// Label volumes in NRRD: types, encodings, frames, headers of all sorts, files beside, defects.
#include "test.h"
#include "volume_bench.h"

#include <sys/stat.h>

#define PLAIN "type: uchar\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n"

// --- NRRD ---

AROUND_ALL(make_folder, scratch_end)

TEST(nrrd_of_every_type_order_and_encoding_reads_the_same)
{
    static const char *const encodings[] = {"raw", "gzip", "ascii", "hex", "gz"};
    FREED Bytes *bytes = malloc(sizeof *bytes);
    for (int t = 0; t < TYPE_COUNT; t++)
        for (int e = 0; e < 5; e++)
            for (int big = 0; big < 2; big++) {
                SCOPED(volume_destroy) LabelVolume volume;
                bytes->size = 0;
                put_nrrd(bytes, &TYPES[t], encodings[e], big);
                write_file(bytes);
                import(&volume);
                assert_string_equal(volume.format, "NRRD");
                expect_labels(&volume);
            }
}

TEST(large_labels_keep_their_value_and_negative_ones_are_empty)
{
    static const double labels[] = {-128, 127, -32768, 65535, 2147483647, -2147483647};
    static const int types[] = {0, 0, 2, 3, 5, 9};
    FREED Bytes *bytes = malloc(sizeof *bytes);
    for (int i = 0; i < 6; i++) {
        SCOPED(volume_destroy) LabelVolume volume;
        bytes->size = 0;
        put_text(bytes,
                 "NRRD0001\ntype: %s\ndimension: 3\nsizes: 1 1 1\nspacings: 1 1 1\n"
                 "endian: little\nencoding: raw\n\n",
                 TYPES[types[i]].nrrd);
        put_value(bytes, &TYPES[types[i]], labels[i], false);
        write_file(bytes);
        import(&volume);
        assert_int_equal(volume.label[0], (int)fmax(labels[i], 0.0));
        assert_int_equal(volume.negative, labels[i] < 0.0);
    }
}

TEST(nrrd_spaces_become_lps_in_metres)
{
    static const struct {
        const char *space;
        double x, y;
    } spaces[] = {{"space: LPS", 1, 1},
                  {"space: left-posterior-superior", 1, 1},
                  {"space: RAS", -1, -1},
                  {"space: right-anterior-superior", -1, -1},
                  {"space: LAS", 1, -1},
                  {"space: scanner-xyz", 1, 1},
                  {"space: 3D-right-handed", 1, 1},
                  {"space dimension: 3", 1, 1}};
    for (int s = 0; s < 8; s++) {
        char header[512];
        SCOPED(volume_destroy) LabelVolume volume;
        snprintf(header, sizeof header,
                 PLAIN "%s\nspace directions: (0,2,0) (0.5,0,0) (0,0,-3)\n"
                       "space origin: (10,20,-30)\nkinds: domain domain domain\n",
                 spaces[s].space);
        write_nrrd(header);
        import(&volume);
        expect_labels(&volume);
        double x = 1e-3 * spaces[s].x, y = 1e-3 * spaces[s].y;
        expect_vec3(volume.axis[0], 0.0, 2 * y, 0.0, 1e-17); // one rounding of 1e-3
        expect_vec3(volume.axis[1], 0.5 * x, 0.0, 0.0, 1e-17);
        expect_vec3(volume.axis[2], 0.0, 0.0, -3e-3, 1e-17);
        expect_vec3(volume.origin, 10 * x, 20 * y, -30e-3, 1e-17);
    }
}

TEST(nrrd_units_are_honoured)
{
    static const struct {
        const char *unit;
        double metres;
    } units[] = {{"mm", 1e-3}, {"m", 1.0}, {"cm", 1e-2},
                 {"um", 1e-6}, {"", 1e-3}, {"millimetres", 1e-3}};
    for (int u = 0; u < 6; u++) {
        char header[512];
        SCOPED(volume_destroy) LabelVolume volume;
        const char *unit = units[u].unit;
        snprintf(header, sizeof header,
                 PLAIN "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
                       "space units: \"%s\" \"%s\" \"%s\"\nspace origin: (7,8,9)\n",
                 unit, unit, unit);
        write_nrrd(header);
        import(&volume);
        double m = units[u].metres;
        expect_vec3(volume.axis[1], 0.0, m, 0.0, 1e-16 * m);
        expect_vec3(volume.origin, 7 * m, 8 * m, 9 * m, 1e-15 * m);
        volume_destroy(&volume);
        snprintf(header, sizeof header, PLAIN "spacings: 1 2 3\nunits: \"%s\" \"mm\" \"%s\"\n",
                 unit, unit);
        write_nrrd(header);
        import(&volume);
        expect_vec3(volume.axis[0], m, 0.0, 0.0, 1e-16 * m);
        expect_vec3(volume.axis[1], 0.0, 2e-3, 0.0, 1e-18);
        expect_vec3(volume.axis[2], 0.0, 0.0, 3 * m, 1e-15 * m);
    }
}

TEST(nrrd_without_directions_has_the_axes_of_the_world)
{
    SCOPED(volume_destroy) LabelVolume volume;
    write_nrrd(PLAIN "spacings: 0.5 2 -3\nkinds: space space space\ncenters: cell cell cell\n");
    import(&volume);
    expect_labels(&volume);
    expect_vec3(volume.axis[0], 0.5e-3, 0.0, 0.0, 0.0);
    expect_vec3(volume.axis[1], 0.0, 2e-3, 0.0, 0.0);
    expect_vec3(volume.axis[2], 0.0, 0.0, -3e-3, 1e-18);
    expect_vec3(volume.origin, 0.0, 0.0, 0.0, 0.0);
}

TEST(nrrd_axes_of_one_value_are_left_out)
{
    static const char *const headers[] = {
        "type: uchar\ndimension: 4\nsizes: 1 4 3 2\nencoding: raw\nspace: LPS\n"
        "space directions: none (1,0,0) (0,1,0) (0,0,1)\nkinds: vector domain domain domain\n",
        "type: uchar\ndimension: 4\nsizes: 4 3 2 1\nencoding: raw\nspacings: 1 1 1 nan\n"
        "kinds: domain domain domain time\n",
        "type: uchar\ndimension: 5\nsizes: 4 3 1 2 1\nencoding: raw\nspacings: 1 1 nan 1 1\n"
        "kinds: domain domain list domain domain\n",
        "type: uchar\ndimension: 4\nsizes: 4 3 2 1\nencoding: raw\nspacings: 1 1 1 1\n",
    };
    for (int i = 0; i < 4; i++) {
        SCOPED(volume_destroy) LabelVolume volume;
        write_nrrd(headers[i]);
        import(&volume);
        expect_labels(&volume);
        expect_vec3(volume.axis[2], 0.0, 0.0, 1e-3, 0.0);
    }
}

TEST(nrrd_headers_may_be_written_in_many_ways)
{
    static const char *const headers[] = {
        "# comment\r\nencoding: RAW\r\nsizes: 4 3 2\r\nDimension: 3\r\nspacings: 1 1 1\r\n"
        "type: unsigned char\r\n\r",
        "content: a: b := c\nkey:=value: with colon\nkey: with space:=value\n"
        "Segment0_Name:=liver\ntype: uint8_t\nspacings: 1 1 1\nnumber: 24\nblock size: 7\n"
        "dimension: 3\nlabels: \"x\" \"y\" \"unclosed\nthicknesses: 1 1 1\nsizes:   4\t3  2 \n"
        "measurement frame: what\nold min: 3\nsample units: label\nencoding: raw\n",
    };
    for (int i = 0; i < 2; i++) {
        SCOPED(volume_destroy) LabelVolume volume;
        write_nrrd(headers[i]);
        import(&volume);
        expect_labels(&volume);
    }
}

// --- NRRD headers with the voxels in a file beside ---

static void write_header(const char *text)
{
    FREED Bytes *bytes = calloc(1, sizeof *bytes);
    put_text(bytes, "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 3 2\nspacings: 1 1 1\n%s", text);
    write_file(bytes);
}

TEST(nrrd_voxels_may_lie_in_a_file_beside)
{
    static const char *const headers[] = {
        "encoding: raw\ndata file: plain.raw\n",
        "encoding: raw\ndatafile: ./plain.raw\n\n",
        "encoding: raw\ndata file: behind.raw\nbyte skip: 7\n",
        "encoding: raw\ndata file: behind.raw\nline skip: 2\nbyte skip: 2\n",
        "encoding: raw\ndata file: behind.raw\nbyte skip: -1\n",
        "encoding: gzip\ndata file: packed.gz\n",
        "encoding: gzip\nline skip: 1\ndata file: line.gz\n",
        "encoding: gzip\nbyte skip: 3\ndata file: skip.gz",
        "encoding: ascii\nline skip: 1\ndata file: numbers.txt\n",
    };
    Bytes *bytes = calloc(1, sizeof *bytes), *raw = calloc(1, sizeof *raw);
    write_voxels("plain.raw", "", false, "");
    write_voxels("behind.raw", "ab\nc\nde", false, "");
    write_voxels("packed.gz", "", true, "");
    write_voxels("line.gz", "a line\n", true, "rubbish behind it");
    put_text(raw, "xyz");
    put_labels(raw, &TYPES[1], false);
    put_gzip(bytes, raw->at, raw->size);
    scratch_write(&scratch_space, "skip.gz", bytes->at, bytes->size);
    bytes->size = 0;
    put_text(bytes, "numbers 1 2 3\n");
    for (int v = 0; v < 24; v++)
        put_text(bytes, "%s%d.0e0", v > 0 ? "," : "", label_at(v));
    scratch_write(&scratch_space, "numbers.txt", bytes->at, bytes->size);
    free(bytes);
    free(raw);
    for (int i = 0; i < 9; i++) {
        SCOPED(volume_destroy) LabelVolume volume;
        write_header(headers[i]);
        import(&volume);
        expect_labels(&volume);
    }
}

TEST(files_beside_that_are_none_are_refused)
{
    LabelVolume volume;
    Status status = {0};
    char expected[2 * SCRATCH_PATH];
    write_header("encoding: raw\ndata file: missing.raw\n");
    assert_false(volume_import(path, 1, &volume, &status));
    snprintf(expected, sizeof expected, "%s/missing.raw: No such file or directory",
             scratch_space.folder);
    assert_string_equal(status.text, expected);
    write_voxels("plain.raw", "", false, "");
    static const char *const names[] = {"/etc/passwd", "../organ", "a/plain.raw", "-", "./"};
    for (int i = 0; i < 5; i++) {
        char header[128];
        snprintf(header, sizeof header, "encoding: raw\ndata file: %s\n", names[i]);
        write_header(header);
        snprintf(expected, sizeof expected, ": its data file '%s' is not one in the same folder",
                 i == 4 ? "" : names[i]);
        expect_error(expected);
    }
    write_header("encoding: raw\ndata file: slice%03d.raw 1 2 1\n");
    expect_error(": its voxels are in several files; write them into one");
    write_header("encoding: raw\ndata file: LIST\nplain.raw\n");
    char list[SCRATCH_PATH + 64];
    snprintf(list, sizeof list, ":8: 'plain.raw' is no field of an NRRD header");
    expect_error(list);
    write_header("encoding: raw\ndata file: LIST 2\n");
    expect_error(": its voxels are in several files; write them into one");
    write_header("encoding: gzip\ndata file: plain.raw\nbyte skip: -1\n");
    expect_error(": byte skip is -1, which only raw voxels can have");
    write_header("encoding: raw\ndata file: plain.raw\nline skip: 3\n");
    expect_error(": its data ends within the lines to skip");
    write_header("encoding: raw\n");
    expect_error(": ends within its NRRD header, or has no voxels behind it");
}

TEST(nrrd_defects_are_told_in_a_sentence)
{
    static const struct {
        const char *header, *error;
    } bad[] = {
        {"", ": its NRRD header has no field 'type'"},
        {"type: uchar\ndimension: 3\nencoding: raw\n", ": its NRRD header has no field 'sizes'"},
        {PLAIN "what is this\n", ":6: 'what is this' is no field of an NRRD header"},
        {PLAIN "colour: red\n", ":6: 'colour' is no field of an NRRD header"},
        {PLAIN "type: uchar\n", ":6: a second field 'type'"},
        {PLAIN, ": says nothing of the spacing along axis 0; add spacings or space directions to "
                "its header"},
        {PLAIN "spacings: 1 nan 1\n", ": says nothing of the spacing along axis 1; add spacings or "
                                      "space directions to its header"},
        {PLAIN "spacings: 1 1e-20 1\n",
         ": the spacing along axis 1 is 1e-23 m, outside [1e-12, 1e+12]"},
        {PLAIN "spacings: 1 1 1\nunits: \"mm\" \"mm\" \"mile\"\n",
         ": unit 'mile' is not known; mm, cm, m and um are"},
        {PLAIN "spacings: 1 1 1\nunits: \"mm\" \"mm\" \"mm\n",
         ": a quotation mark in its units does not close"},
        {PLAIN "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
               "space units: \"mm\" \"m\" \"mm\"\n",
         ": has another unit along each direction of space"},
        {PLAIN "space: LPS\nspace directions: (1,0,0) (2,0,0) (0,0,1)\n",
         ": axes 0 and 1 are not at right angles (cosine 1, at most 0.035), so its voxels are no "
         "boxes; resample it, with nearest neighbours (3D Slicer: Resample Scalar Volume)"},
        {PLAIN "space: LPS\nspace directions: (1,0,0) (0,1,0) (0.1,0,1)\n",
         ": axes 0 and 2 are not at right angles (cosine 0.0995, at most 0.035), so its voxels are "
         "no boxes; resample it, with nearest neighbours (3D Slicer: Resample Scalar Volume)"},
        {PLAIN "space: LPS\nspace directions: (1,0,0) (0,0,0) (0,0,1)\n",
         ": the spacing along axis 1 is 0 m, outside [1e-12, 1e+12]"},
        {PLAIN "space: LPS\nspace directions: (1,0,0) none (0,0,1)\n",
         ": has 2 axes of space, not 3 as a volume"},
        {PLAIN "space: LPS\nspace directions: (1,0,0) (nan,nan,nan) (0,0,1)\n",
         ": has 2 axes of space, not 3 as a volume"},
        {PLAIN "space: 3D-left-handed\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n",
         ": its space, 3D-left-handed, is not read; left-posterior-superior and "
         "right-anterior-superior are"},
        {PLAIN "space dimension: 2\nspace directions: (1,0) (0,1) (1,1)\n",
         ": lies in a space of 2 dimensions, not 3"},
        {"type: uchar\ndimension: 2\nsizes: 6 4\nencoding: raw\nspacings: 1 1\n",
         ": has 2 axes of space, not 3 as a volume"},
        {"type: uchar\ndimension: 4\nsizes: 2 2 3 2\nencoding: raw\nspacings: 1 1 1 1\n",
         ": has 4 axes of space, not 3 as a volume"},
        {"type: uchar\ndimension: 4\nsizes: 2 2 3 2\nencoding: raw\nspacings: nan 1 1 1\n"
         "kinds: vector domain domain domain\n",
         ": has 2 values a voxel, along axis 0, not one label"},
        {"type: uchar\ndimension: 3\nsizes: 40 3 2\nencoding: raw\nspacings: 1 1 1\n",
         ": 240 voxels take 240 bytes, the file has 24 for them"},
        {"type: uchar\ndimension: 3\nsizes: 2000000 2000000 2000000\nencoding: raw\n"
         "spacings: 1 1 1\n",
         ": 2000000 x 2000000 x 2000000 voxels are more than 268435456"},
        {"type: double\ndimension: 3\nsizes: 512 512 1024\nencoding: gzip\nendian: big\n"
         "spacings: 1 1 1\n",
         ": 268435456 voxels of 8 bytes cannot be in the 24 bytes that the file has for them"},
        {"type: double\ndimension: 3\nsizes: 4 3 2\nencoding: ascii\nspacings: 1 1 1\n",
         ": 24 voxels of 8 bytes cannot be in the 24 bytes that the file has for them"},
        {"type: int\ndimension: 3\nsizes: 4 3 2\nencoding: hex\nspacings: 1 1 1\nendian: little\n",
         ": 24 voxels of 4 bytes cannot be in the 24 bytes that the file has for them"},
        {"type: uchar\ndimension: 3\nsizes: 4 3 2\nencoding: bzip2\nspacings: 1 1 1\n",
         ": encoding bzip2 is not read; raw, gzip, ascii and hex are: save it again from 3D "
         "Slicer, or unu save -e gzip"},
        {"type: block\nblock size: 1\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n"
         "spacings: 1 1 1\n",
         NULL},
        {"type: short\ndimension: 3\nsizes: 2 3 2\nencoding: raw\nspacings: 1 1 1\n", NULL},
        {"type: quark\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n",
         ": bad NRRD header: couldn't parse type \"quark\""},
        {"type: uchar\ndimension: 3\nsizes: 4 3\nencoding: raw\n", NULL},
        {"type: uchar\ndimension: 3\nsizes: 4 0 2\nencoding: raw\n", NULL},
        {"type: uchar\ndimension: 3\nsizes: 4 -3 2\nencoding: raw\n", NULL},
        {"type: uchar\ndimension: 17\nsizes: 4 3 2\nencoding: raw\n", NULL},
        {PLAIN "spacings: 1 1 1\nbyte skip: 3\n",
         ": 24 voxels take 24 bytes, the file has 21 for them"},
        {PLAIN "spacings: 1 1 1\nbyte skip: -2\n", ": byte skip is '-2', not a number from -1"},
        {PLAIN "spacings: 1 1 1\nline skip: x\n", ": line skip is 'x', not a number from 0"},
        {PLAIN "spacings: 1 1 1\nbyte skip: 99999999999999999999\n",
         ": byte skip is '99999999999999999999', not a number from -1"},
        {PLAIN "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (1e300,0,0)\n",
         ": the first voxel is at (1e+297, 0, 0) m"},
        {PLAIN "a\001b: c\n", ":6: 'a?b' is no field of an NRRD header"},
    };
    // Fields that disagree.
    write_nrrd(PLAIN "spacings: 1 1 1\nkinds: 3-vector domain domain\n");
    expect_error(": has 2 axes of space, not 3 as a volume");
    write_nrrd(PLAIN "spacings: 7 7 7\nspace: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n");
    expect_error(": bad NRRD header: axis[0] has a direction vector, and so can't have min, max, "
                 "spacing, or units set");
    // A line within a line would get past all checks.
    write_nrrd(PLAIN "spacings: 1 1 1\rdata file: /etc/passwd\n");
    expect_error(":6: a byte that is no text in the NRRD header");
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        write_nrrd(bad[i].header);
        if (bad[i].error != NULL) {
            expect_error(bad[i].error);
            continue;
        }
        // In the words of teem.
        LabelVolume volume;
        Status status = {0};
        assert_false(volume_import(path, 1, &volume, &status));
        printf("%s\n", status.text + strlen(path));
        expect_in(status.text, ": bad NRRD header: ");
        assert_null(strchr(status.text, '\n'));
    }
}

TEST(voxels_that_are_no_labels_are_refused)
{
    static const struct {
        const char *type, *encoding, *data, *error;
    } bad[] = {
        {"float", "ascii", "1 2 0.5 4",
         ": voxel (0, 1, 0) is 0.5, not a label, which is a whole "
         "number up to 2147483647; grey values or shares are segmented first"},
        {"double", "ascii", "1 2 3 nan",
         ": voxel (1, 1, 0) is nan, not a label, which is a whole "
         "number up to 2147483647"},
        {"double", "ascii", "1 2 3 1e10",
         ": voxel (1, 1, 0) is 1e+10, not a label, which is a "
         "whole number up to 2147483647"},
        {"uint", "ascii", "1 4294967295 3 4",
         ": voxel (1, 0, 0) is 4.2949673e+09, not a label, "
         "which is a whole number up to 2147483647"},
        {"int", "ascii", "1 2 x 4", ": voxel 2 is 'x', not a number"},
        {"int", "ascii", "1 2 3      ", ": the data ends, or is damaged, at voxel 3"},
        {"uchar", "hex", "0102030z ", ": the data ends, or is damaged, at voxel 3"},
        {"uchar", "gzip", "1234", NULL}, // not packed at all: read as it is, by gzip's custom
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        FREED Bytes *bytes = calloc(1, sizeof *bytes);
        put_text(bytes,
                 "NRRD0004\ntype: %s\ndimension: 3\nsizes: 2 2 1\nspacings: 1 1 1\n"
                 "endian: little\nencoding: %s\n\n%s",
                 bad[i].type, bad[i].encoding, bad[i].data);
        write_file(bytes);
        if (bad[i].error != NULL)
            expect_error(bad[i].error);
    }
    // A word that would run over a buffer of fixed size.
    FREED Bytes *bytes = calloc(1, sizeof *bytes);
    put_text(bytes, "NRRD0004\ntype: int\ndimension: 3\nsizes: 2 2 1\nspacings: 1 1 1\n"
                    "encoding: ascii\n\n");
    for (int i = 0; i < 30000; i++)
        put_text(bytes, "1");
    write_file(bytes);
    expect_error(": voxel 0 is '111111111111111111111111111111111111111111111111111111111111111', "
                 "not a number");
}

TEST(nothing_was_printed)
{
    expect_nothing_printed();
}
