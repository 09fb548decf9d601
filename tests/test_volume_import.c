#include "effort.h"
#include "expect.h"
#include "random.h"
#include "volume_writer.h"

#include "files/volume_import.h"

#include <fcntl.h>
#include <limits.h>
#include <sys/mman.h>
#include <sys/stat.h>

static Scratch scratch;
static char path[SCRATCH_PATH]; // the file that most tests write and read
static int old_stderr;

// What anyone prints to stderr ends up in a file, to be looked at in the end.
static int make_folder(void **state)
{
    (void)state;
    char said[SCRATCH_PATH];
    if (scratch_create(&scratch) != 0)
        return -1;
    scratch_path(&scratch, "organ", path);
    int file = open(scratch_path(&scratch, "stderr", said), O_CREAT | O_WRONLY | O_APPEND, 0600);
    old_stderr = dup(2);
    return file >= 0 && dup2(file, 2) == 2 && close(file) == 0 ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    scratch_destroy(&scratch);
    return 0;
}

static void nothing_was_printed(void **state)
{
    (void)state;
    size_t size;
    fflush(stderr);
    dup2(old_stderr, 2);
    unsigned char *said = scratch_read(&scratch, "stderr", &size);
    said[size] = 0;
    assert_string_equal((char *)said, "");
    free(said);
}

// --- a volume of 4 x 3 x 2 voxels, all different ---

static const int COUNT[3] = {4, 3, 2};

static int label_at(int v)
{
    return v + 1;
}

static void put_labels(Bytes *bytes, const Type *type, bool big)
{
    for (int v = 0; v < 24; v++)
        put_value(bytes, type, label_at(v), big);
}

static void import(LabelVolume *volume)
{
    Status status = {0};
    if (!volume_import(path, volume, &status))
        fail_msg("%s", status.text);
}

static void expect_labels(const LabelVolume *volume)
{
    assert_memory_equal(volume->count, COUNT, sizeof COUNT);
    for (int v = 0; v < 24; v++)
        assert_int_equal(volume->label[v], label_at(v));
}

static void expect_vec3(Vec3 actual, double x, double y, double z, double tolerance)
{
    expect_near(actual.x, x, tolerance);
    expect_near(actual.y, y, tolerance);
    expect_near(actual.z, z, tolerance);
}

// The text of the error must be the path followed by `rest`.
static void expect_error_of(const char *name, const char *rest)
{
    LabelVolume volume;
    Status status = {0};
    assert_false(volume_import(name, &volume, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    assert_null(volume.label);
    if (strncmp(status.text, name, strlen(name)) != 0)
        fail_msg("%s", status.text);
    assert_string_equal(status.text + strlen(name), rest);
}

static void expect_error(const char *rest)
{
    expect_error_of(path, rest);
}

static void write_file(const Bytes *bytes)
{
    scratch_write(&scratch, "organ", bytes->at, bytes->size);
}

// A text header and the 24 voxels behind it, as unsigned char.
static void write_nrrd(const char *header)
{
    Bytes *bytes = calloc(1, sizeof *bytes);
    put_text(bytes, "NRRD0004\n%s\n", header);
    put_labels(bytes, &TYPES[1], false);
    write_file(bytes);
    free(bytes);
}

#define PLAIN "type: uchar\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n"

// --- NRRD ---

static void put_nrrd(Bytes *bytes, const Type *type, const char *encoding, bool big)
{
    Bytes *raw = calloc(1, sizeof *raw);
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
    free(raw);
}

static void nrrd_of_every_type_order_and_encoding_reads_the_same(void **state)
{
    (void)state;
    static const char *const encodings[] = {"raw", "gzip", "ascii", "hex", "gz"};
    Bytes *bytes = malloc(sizeof *bytes);
    for (int t = 0; t < TYPE_COUNT; t++)
        for (int e = 0; e < 5; e++)
            for (int big = 0; big < 2; big++) {
                LabelVolume volume;
                bytes->size = 0;
                put_nrrd(bytes, &TYPES[t], encodings[e], big);
                write_file(bytes);
                import(&volume);
                assert_string_equal(volume.format, "NRRD");
                expect_labels(&volume);
                volume_destroy(&volume);
            }
    free(bytes);
}

static void negative_and_large_labels_keep_their_value(void **state)
{
    (void)state;
    static const double labels[] = {-128, 127, -32768, 65535, 2147483647, -2147483647};
    static const int types[] = {0, 0, 2, 3, 5, 9};
    Bytes *bytes = malloc(sizeof *bytes);
    for (int i = 0; i < 6; i++) {
        LabelVolume volume;
        bytes->size = 0;
        put_text(bytes,
                 "NRRD0001\ntype: %s\ndimension: 3\nsizes: 1 1 1\nspacings: 1 1 1\n"
                 "endian: little\nencoding: raw\n\n",
                 TYPES[types[i]].nrrd);
        put_value(bytes, &TYPES[types[i]], labels[i], false);
        write_file(bytes);
        import(&volume);
        assert_int_equal(volume.label[0], (int)labels[i]);
        volume_destroy(&volume);
    }
    free(bytes);
}

static void nrrd_spaces_become_lps_in_metres(void **state)
{
    (void)state;
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
        LabelVolume volume;
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
        volume_destroy(&volume);
    }
}

static void nrrd_units_are_honoured(void **state)
{
    (void)state;
    static const struct {
        const char *unit;
        double metres;
    } units[] = {{"mm", 1e-3}, {"m", 1.0}, {"cm", 1e-2},
                 {"um", 1e-6}, {"", 1e-3}, {"millimetres", 1e-3}};
    for (int u = 0; u < 6; u++) {
        char header[512];
        LabelVolume volume;
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
        volume_destroy(&volume);
    }
}

static void nrrd_without_directions_has_the_axes_of_the_world(void **state)
{
    (void)state;
    LabelVolume volume;
    write_nrrd(PLAIN "spacings: 0.5 2 -3\nkinds: space space space\ncenters: cell cell cell\n");
    import(&volume);
    expect_labels(&volume);
    expect_vec3(volume.axis[0], 0.5e-3, 0.0, 0.0, 0.0);
    expect_vec3(volume.axis[1], 0.0, 2e-3, 0.0, 0.0);
    expect_vec3(volume.axis[2], 0.0, 0.0, -3e-3, 1e-18);
    expect_vec3(volume.origin, 0.0, 0.0, 0.0, 0.0);
    volume_destroy(&volume);
}

static void nrrd_axes_of_one_value_are_left_out(void **state)
{
    (void)state;
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
        LabelVolume volume;
        write_nrrd(headers[i]);
        import(&volume);
        expect_labels(&volume);
        expect_vec3(volume.axis[2], 0.0, 0.0, 1e-3, 0.0);
        volume_destroy(&volume);
    }
}

static void nrrd_headers_may_be_written_in_many_ways(void **state)
{
    (void)state;
    static const char *const headers[] = {
        "# comment\r\nencoding: RAW\r\nsizes: 4 3 2\r\nDimension: 3\r\nspacings: 1 1 1\r\n"
        "type: unsigned char\r\n\r",
        "content: a: b := c\nkey:=value: with colon\nkey: with space:=value\n"
        "Segment0_Name:=liver\ntype: uint8_t\nspacings: 1 1 1\nnumber: 24\nblock size: 7\n"
        "dimension: 3\nlabels: \"x\" \"y\" \"unclosed\nthicknesses: 1 1 1\nsizes:   4\t3  2 \n"
        "measurement frame: what\nold min: 3\nsample units: label\nencoding: raw\n",
    };
    for (int i = 0; i < 2; i++) {
        LabelVolume volume;
        write_nrrd(headers[i]);
        import(&volume);
        expect_labels(&volume);
        volume_destroy(&volume);
    }
}

// --- NRRD headers with the voxels in a file beside ---

static void write_voxels(const char *name, const char *before, bool packed, const char *behind)
{
    Bytes *bytes = calloc(1, sizeof *bytes), *raw = calloc(1, sizeof *raw);
    put_labels(raw, &TYPES[1], false);
    put_text(bytes, "%s", before);
    if (packed)
        put_gzip(bytes, raw->at, raw->size);
    else
        put_bytes(bytes, raw->at, raw->size);
    put_text(bytes, "%s", behind);
    scratch_write(&scratch, name, bytes->at, bytes->size);
    free(bytes);
    free(raw);
}

static void write_header(const char *text)
{
    Bytes *bytes = calloc(1, sizeof *bytes);
    put_text(bytes, "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 3 2\nspacings: 1 1 1\n%s", text);
    write_file(bytes);
    free(bytes);
}

static void nrrd_voxels_may_lie_in_a_file_beside(void **state)
{
    (void)state;
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
    scratch_write(&scratch, "skip.gz", bytes->at, bytes->size);
    bytes->size = 0;
    put_text(bytes, "numbers 1 2 3\n");
    for (int v = 0; v < 24; v++)
        put_text(bytes, "%s%d.0e0", v > 0 ? "," : "", label_at(v));
    scratch_write(&scratch, "numbers.txt", bytes->at, bytes->size);
    free(bytes);
    free(raw);
    for (int i = 0; i < 9; i++) {
        LabelVolume volume;
        write_header(headers[i]);
        import(&volume);
        expect_labels(&volume);
        volume_destroy(&volume);
    }
}

static void files_beside_that_are_none_are_refused(void **state)
{
    (void)state;
    LabelVolume volume;
    Status status = {0};
    char expected[2 * SCRATCH_PATH];
    write_header("encoding: raw\ndata file: missing.raw\n");
    assert_false(volume_import(path, &volume, &status));
    snprintf(expected, sizeof expected, "%s/missing.raw: No such file or directory",
             scratch.folder);
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

static void nrrd_defects_are_told_in_a_sentence(void **state)
{
    (void)state;
    static const struct {
        const char *header, *error;
    } bad[] = {
        {"", ": its NRRD header has no field 'type'"},
        {"type: uchar\ndimension: 3\nencoding: raw\n", ": its NRRD header has no field 'sizes'"},
        {PLAIN "what is this\n", ":6: 'what is this' is no field of an NRRD header"},
        {PLAIN "colour: red\n", ":6: 'colour' is no field of an NRRD header"},
        {PLAIN "type: uchar\n", ":6: a second field 'type'"},
        {PLAIN, ": says nothing of the spacing along axis 0"},
        {PLAIN "spacings: 1 nan 1\n", ": says nothing of the spacing along axis 1"},
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
         ": axes 0 and 1 are not at right angles (cosine 1, at most 0.001), so its voxels are no "
         "boxes"},
        {PLAIN "space: LPS\nspace directions: (1,0,0) (0,1,0) (0.1,0,1)\n",
         ": axes 0 and 2 are not at right angles (cosine 0.0995, at most 0.001), so its voxels are "
         "no boxes"},
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
         ": encoding bzip2 is not read; raw, gzip, ascii and hex are"},
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
        assert_false(volume_import(path, &volume, &status));
        printf("%s\n", status.text + strlen(path));
        assert_non_null(strstr(status.text, ": bad NRRD header: "));
        assert_null(strchr(status.text, '\n'));
    }
}

static void voxels_that_are_no_labels_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *type, *encoding, *data, *error;
    } bad[] = {
        {"float", "ascii", "1 2 0.5 4",
         ": voxel (0, 1, 0) is 0.5, not a label, which is a whole "
         "number up to 2147483647"},
        {"double", "ascii", "1 2 3 nan",
         ": voxel (1, 1, 0) is nan, not a label, which is a whole "
         "number up to 2147483647"},
        {"double", "ascii", "1 2 3 1e10",
         ": voxel (1, 1, 0) is 1e+10, not a label, which is a "
         "whole number up to 2147483647"},
        {"uint", "ascii", "1 4294967295 3 4",
         ": voxel (1, 0, 0) is 4.29496730e+09, not a label, "
         "which is a whole number up to 2147483647"},
        {"int", "ascii", "1 2 x 4", ": voxel 2 is 'x', not a number"},
        {"int", "ascii", "1 2 3      ", ": the data ends, or is damaged, at voxel 3"},
        {"uchar", "hex", "0102030z ", ": the data ends, or is damaged, at voxel 3"},
        {"uchar", "gzip", "1234", NULL}, // not packed at all: read as it is, by gzip's custom
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        Bytes *bytes = calloc(1, sizeof *bytes);
        put_text(bytes,
                 "NRRD0004\ntype: %s\ndimension: 3\nsizes: 2 2 1\nspacings: 1 1 1\n"
                 "endian: little\nencoding: %s\n\n%s",
                 bad[i].type, bad[i].encoding, bad[i].data);
        write_file(bytes);
        free(bytes);
        if (i == 3) {
            LabelVolume volume;
            Status status = {0};
            assert_false(volume_import(path, &volume, &status));
            assert_non_null(strstr(status.text, ": voxel (1, 0, 0) is 4.2949673e+09"));
        } else if (bad[i].error != NULL) {
            expect_error(bad[i].error);
        }
    }
    // A word that would run over a buffer of fixed size.
    Bytes *bytes = calloc(1, sizeof *bytes);
    put_text(bytes, "NRRD0004\ntype: int\ndimension: 3\nsizes: 2 2 1\nspacings: 1 1 1\n"
                    "encoding: ascii\n\n");
    for (int i = 0; i < 30000; i++)
        put_text(bytes, "1");
    write_file(bytes);
    free(bytes);
    expect_error(": voxel 0 is '111111111111111111111111111111111111111111111111111111111111111', "
                 "not a number");
}

// --- NIfTI-1 ---

// A turn by 90 degrees about z, and spacings 2, 3, 4.
static NiftiFields plain_nifti(void)
{
    return (NiftiFields){.dim = {3, 4, 3, 2, 1, 1, 1, 1},
                         .datatype = 2,
                         .pixdim = {1, 2, 3, 4, 0, 0, 0, 0},
                         .vox_offset = 352,
                         .sform = 1,
                         .srow = {{0, -3, 0, 10}, {2, 0, 0, 20}, {0, 0, 4, 30}},
                         .magic = "n+1"};
}

static void put_nifti_file(Bytes *bytes, const NiftiFields *fields, const Type *type, bool big)
{
    NiftiFields typed = *fields;
    typed.datatype = type->nifti;
    put_nifti(bytes, &typed, big);
    put_number(bytes, 0, 4, false);
    put_labels(bytes, type, big);
}

static void write_nifti(const NiftiFields *fields, const Type *type, bool big, bool packed)
{
    Bytes *bytes = calloc(1, sizeof *bytes), *file = calloc(1, sizeof *file);
    put_nifti_file(bytes, fields, type, big);
    if (packed)
        put_gzip(file, bytes->at, bytes->size);
    write_file(packed ? file : bytes);
    free(bytes);
    free(file);
}

// The fields with the type of unsigned char.
static void import_nifti(const NiftiFields *fields, LabelVolume *volume)
{
    write_nifti(fields, &TYPES[1], false, false);
    import(volume);
    assert_string_equal(volume->format, "NIfTI-1");
    expect_labels(volume);
}

static void expect_plain(const LabelVolume *volume)
{
    // RAS to LPS, in metres; single precision holds these numbers.
    expect_labels(volume);
    expect_vec3(volume->axis[0], 0.0, -2e-3, 0.0, 1e-17);
    expect_vec3(volume->axis[1], 3e-3, 0.0, 0.0, 1e-17);
    expect_vec3(volume->axis[2], 0.0, 0.0, 4e-3, 1e-17);
    expect_vec3(volume->origin, -10e-3, -20e-3, 30e-3, 1e-17);
}

static void nifti_of_every_type_and_order_packed_or_not_reads_the_same(void **state)
{
    (void)state;
    NiftiFields fields = plain_nifti();
    for (int t = 0; t < TYPE_COUNT; t++)
        for (int big = 0; big < 2; big++)
            for (int packed = 0; packed < 2; packed++) {
                LabelVolume volume;
                write_nifti(&fields, &TYPES[t], big, packed);
                import(&volume);
                expect_plain(&volume);
                volume_destroy(&volume);
            }
}

static void nifti_pairs_are_read_by_their_header(void **state)
{
    (void)state;
    NiftiFields fields = plain_nifti();
    fields.magic = "ni1";
    char name[SCRATCH_PATH];
    for (int packed = 0; packed < 4; packed++) {
        Bytes *bytes = calloc(1, sizeof *bytes), *file = calloc(1, sizeof *file);
        fields.vox_offset = packed == 1 ? 5.0f : 0.0f;
        put_nifti(bytes, &fields, false);
        const char *header = packed & 1 ? "pair.hdr.gz" : "pair.hdr";
        if (packed & 1)
            put_gzip(file, bytes->at, bytes->size);
        scratch_write(&scratch, header, packed & 1 ? file->at : bytes->at,
                      packed & 1 ? file->size : bytes->size);
        bool other = packed >= 2;
        unlink(scratch_path(&scratch, "pair.img", name));
        unlink(scratch_path(&scratch, "pair.img.gz", name));
        write_voxels(other ? "pair.img.gz" : "pair.img", packed == 1 ? "12345" : "", other, "");
        LabelVolume volume;
        Status status = {0};
        if (!volume_import(scratch_path(&scratch, header, name), &volume, &status))
            fail_msg("%s", status.text);
        expect_plain(&volume);
        volume_destroy(&volume);
        free(bytes);
        free(file);
    }
    // The other one of the pair.
    unlink(scratch_path(&scratch, "pair.img.gz", name));
    LabelVolume volume;
    Status status = {0};
    assert_false(volume_import(scratch_path(&scratch, "pair.hdr", name), &volume, &status));
    assert_non_null(strstr(status.text, "/pair.img: No such file or directory"));
    write_voxels("pair.img", "", false, "");
    expect_error_of(scratch_path(&scratch, "pair.img", name),
                    ": is neither an NRRD nor a NIfTI-1 file (of a pair .hdr and .img, name the "
                    ".hdr)");
    write_nifti(&fields, &TYPES[1], false, false);
    expect_error(": is the header of a NIfTI-1 pair, but its name does not end in .hdr, so that of "
                 "its voxels is not known");
}

static void nifti_sform_goes_before_qform(void **state)
{
    (void)state;
    LabelVolume volume;
    NiftiFields fields = plain_nifti();
    fields.qform = 1;
    fields.quatern[0] = 1.0f; // half a turn about x
    fields.qoffset[0] = 99.0f;
    import_nifti(&fields, &volume);
    expect_plain(&volume);
    volume_destroy(&volume);
}

static void nifti_qform_turns_and_mirrors(void **state)
{
    (void)state;
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        LabelVolume volume;
        NiftiFields fields = plain_nifti();
        fields.sform = 0;
        fields.qform = 2;
        fields.pixdim[0] = mirrored ? -1.0f : 1.0f;
        // A quarter turn about z, then x: (1, 1, 1, 1) / 2 takes x to y, y to z, z to x.
        for (int d = 0; d < 3; d++)
            fields.quatern[d] = 0.5f;
        fields.qoffset[0] = 10.0f;
        fields.qoffset[1] = 20.0f;
        fields.qoffset[2] = 30.0f;
        import_nifti(&fields, &volume);
        // Niftilib turns in double precision and stores single: 2^-24 of 4 mm.
        expect_vec3(volume.axis[0], 0.0, -2e-3, 0.0, 1e-9);
        expect_vec3(volume.axis[1], 0.0, 0.0, 3e-3, 1e-9);
        expect_vec3(volume.axis[2], mirrored ? 4e-3 : -4e-3, 0.0, 0.0, 1e-9);
        expect_vec3(volume.origin, -10e-3, -20e-3, 30e-3, 1e-9);
        volume_destroy(&volume);
    }
}

static void nifti_without_transform_has_the_axes_of_the_world(void **state)
{
    (void)state;
    LabelVolume volume;
    NiftiFields fields = plain_nifti();
    fields.sform = 0;
    import_nifti(&fields, &volume);
    expect_vec3(volume.axis[0], 2e-3, 0.0, 0.0, 1e-17);
    expect_vec3(volume.axis[1], 0.0, 3e-3, 0.0, 1e-17);
    expect_vec3(volume.axis[2], 0.0, 0.0, 4e-3, 1e-17);
    expect_vec3(volume.origin, 0.0, 0.0, 0.0, 0.0);
    volume_destroy(&volume);
}

static void nifti_units_are_honoured(void **state)
{
    (void)state;
    static const struct {
        int code;
        double metres;
    } units[] = {{0, 1e-3}, {1, 1.0}, {2, 1e-3}, {3, 1e-6}, {2 + 8, 1e-3}, {3 + 16, 1e-6}};
    for (int u = 0; u < 6; u++) {
        LabelVolume volume;
        NiftiFields fields = plain_nifti();
        fields.units = units[u].code;
        import_nifti(&fields, &volume);
        double m = units[u].metres;
        expect_vec3(volume.axis[2], 0.0, 0.0, 4.0 * m, 1e-15 * m);
        expect_vec3(volume.origin, -10.0 * m, -20.0 * m, 30.0 * m, 1e-14 * m);
        volume_destroy(&volume);
    }
}

static void nifti_may_have_more_dimensions_of_one(void **state)
{
    (void)state;
    for (int dims = 4; dims <= 7; dims++) {
        LabelVolume volume;
        NiftiFields fields = plain_nifti();
        fields.dim[0] = dims;
        import_nifti(&fields, &volume);
        expect_plain(&volume);
        volume_destroy(&volume);
    }
    NiftiFields fields = plain_nifti();
    LabelVolume volume;
    fields.dim[4] = 0; // beyond dim[0] nothing counts
    import_nifti(&fields, &volume);
    volume_destroy(&volume);
}

static void nifti_scales_that_give_whole_numbers_are_applied(void **state)
{
    (void)state;
    static const struct {
        float slope, inter;
    } scales[] = {{0.0f, 5.0f}, {1.0f, 0.0f}, {2.0f, 0.0f}, {1.0f, -3.0f}, {-3.0f, 7.0f}};
    for (int s = 0; s < 5; s++) {
        LabelVolume volume;
        NiftiFields fields = plain_nifti();
        fields.slope = scales[s].slope;
        fields.inter = scales[s].inter;
        write_nifti(&fields, &TYPES[2], true, false);
        import(&volume);
        for (int v = 0; v < 24; v++) {
            int expected = label_at(v) * (int)scales[s].slope + (int)scales[s].inter;
            assert_int_equal(volume.label[v], s == 0 ? label_at(v) : expected);
        }
        volume_destroy(&volume);
    }
    NiftiFields fields = plain_nifti();
    fields.slope = 0.5f;
    write_nifti(&fields, &TYPES[2], true, false);
    expect_error(": voxel (0, 0, 0) is 0.5 when scaled, not a label, which is a whole number up to "
                 "2147483647");
}

static void nifti_defects_are_told_in_a_sentence(void **state)
{
    (void)state;
    NiftiFields f;
#define REFUSED(change, error)                                                                     \
    f = plain_nifti();                                                                             \
    change;                                                                                        \
    write_nifti(&f, &TYPES[1], false, false);                                                      \
    expect_error(error);                                                                           \
    write_nifti(&f, &TYPES[1], true, true);                                                        \
    expect_error(error)
    const float nan = (float)NAN, inf = (float)INFINITY;
    REFUSED(f.dim[0] = 2, ": has 2 dimensions, not 3 as a volume");
    REFUSED(f.dim[0] = 0, ": has 0 dimensions, not 3 as a volume");
    REFUSED(f.dim[0] = 8, ": has 8 dimensions, not 3 as a volume");
    REFUSED(f.dim[0] = -3, ": has -3 dimensions, not 3 as a volume");
    REFUSED((f.dim[0] = 4, f.dim[4] = 2), ": holds 2 volumes or values a voxel (dim[4]), not one");
    REFUSED((f.dim[0] = 5, f.dim[5] = 3), ": holds 3 volumes or values a voxel (dim[5]), not one");
    REFUSED((f.dim[0] = 4, f.dim[4] = 0), ": has 0 voxels along dim[4]");
    REFUSED(f.dim[2] = 0, ": has 0 voxels along dim[2]");
    REFUSED(f.dim[1] = -4, ": has -4 voxels along dim[1]");
    REFUSED((f.dim[1] = f.dim[2] = f.dim[3] = 32767),
            ": 32767 x 32767 x 32767 voxels are more than 268435456");
    REFUSED(f.vox_offset = nan, ": its voxels begin at byte nan (vox_offset)");
    REFUSED(f.vox_offset = inf, ": its voxels begin at byte inf (vox_offset)");
    REFUSED(f.vox_offset = -1.0f, ": its voxels begin at byte -1 (vox_offset)");
    REFUSED(f.vox_offset = 100.0f, ": its voxels begin at byte 100 (vox_offset)");
    REFUSED(f.vox_offset = 1e30f, ": its voxels begin at byte 1e+30 (vox_offset)");
    REFUSED(f.srow[1][0] = nan, ": the spacing along axis 0 is nan m, outside [1e-12, 1e+12]");
    REFUSED(f.srow[1][0] = 0.0f, ": the spacing along axis 0 is 0 m, outside [1e-12, 1e+12]");
    REFUSED(f.srow[0][0] = 2.0f,
            ": axes 0 and 1 are not at right angles (cosine -0.707, at most 0.001), so its voxels "
            "are no boxes");
    REFUSED(f.srow[2][3] = inf, ": the first voxel is at (-0.01, -0.02, inf) m");
    REFUSED((f.sform = 0, f.pixdim[2] = nan), ": the spacing along axis 1 is nan (pixdim[2])");
    REFUSED((f.sform = 0, f.pixdim[2] = 0.0f), ": the spacing along axis 1 is 0 (pixdim[2])");
    REFUSED((f.sform = 0, f.qform = 1, f.pixdim[3] = -4.0f),
            ": the spacing along axis 2 is -4 (pixdim[3])");
    REFUSED((f.sform = 0, f.qform = 1, f.quatern[1] = 2.0f),
            ": (0, 2, 0) is no part of a unit quaternion (quatern_b, c, d)");
    REFUSED((f.sform = 0, f.qform = 1, f.quatern[1] = nan),
            ": (0, nan, 0) is no part of a unit quaternion (quatern_b, c, d)");
    REFUSED(f.units = 5, ": its unit of length has the code 5, which NIfTI-1 does not know");
#undef REFUSED
    f = plain_nifti();
    f.dim[1] = 400;
    write_nifti(&f, &TYPES[3], false, false);
    expect_error(": 2400 voxels take 4800 bytes, the file has 48 for them");
    write_nifti(&f, &TYPES[3], false, true);
    expect_error(": the data ends, or is damaged, at voxel 24");
    f.dim[1] = f.dim[2] = 10000;
    write_nifti(&f, &TYPES[9], false, true);
    expect_error(": 200000000 voxels of 8 bytes cannot be in the 567 bytes that the file has for "
                 "them");
    f = plain_nifti();
    static const int types[] = {0, 1, 32, 128, 1536, 1792, 2048, 2304, -7};
    for (int t = 0; t < 9; t++) {
        char expected[160];
        Type type = {"", types[t], 1, 'u'};
        write_nifti(&f, &type, t % 2 == 0, false);
        snprintf(expected, sizeof expected,
                 ": its voxels are of datatype %d, not integers or floats of up to 64 bits",
                 types[t]);
        expect_error(expected);
    }
    unsigned char other[600] = {540 & 255, 540 >> 8};
    scratch_write(&scratch, "organ", other, sizeof other);
    expect_error(": is a NIfTI-2 file; NIfTI-1 is read");
}

// --- anything ---

static void what_is_no_volume_is_refused(void **state)
{
    (void)state;
    char name[SCRATCH_PATH];
    static const char *const neither = ": is neither an NRRD nor a NIfTI-1 file (of a pair .hdr "
                                       "and .img, name the .hdr)";
    expect_error_of("/nowhere/organ.nrrd", ": No such file or directory");
    expect_error_of(scratch.folder, ": is a folder, not a volume file");
    scratch_write(&scratch, "organ", "", 0);
    expect_error(": the file is empty");
    scratch_write(&scratch, "organ", "\x1f\x8b", 2);
    expect_error(neither);
    scratch_write(&scratch, "organ", "solid cube\n", 11);
    expect_error(neither);
    scratch_write(&scratch, "organ", "NRRD", 4);
    expect_error(": its NRRD header has no field 'type'");
    assert_int_equal(mkfifo(scratch_path(&scratch, "pipe", name), 0600), 0);
    expect_error_of(name, ": is not a file");
    if (geteuid() != 0) { // who may read everything
        scratch_write(&scratch, "secret", "NRRD0004\n", 9);
        chmod(scratch_path(&scratch, "secret", name), 0);
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
    unsigned char *text = malloc(2 << 20);
    memset(text, ' ', 2 << 20);
    memcpy(text, "NRRD0004\ntype: uchar\n", 21);
    scratch_write(&scratch, "organ", text, 2 << 20);
    free(text);
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
        scratch_write(&scratch, "organ", garbage, sizeof garbage);
        assert_false(volume_import(path, &volume, &status));
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
    if (volume_import(name, &volume, &status)) {
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

static void damaged_files_are_read_or_refused_but_never_harm(void **state)
{
    (void)state;
    static const char *const encodings[] = {"raw", "gzip", "ascii", "hex"};
    Bytes *base = malloc(sizeof *base), *inner = malloc(sizeof *inner);
    uint64_t seed = 17;
    for (int file = 0; file < 7; file++) {
        NiftiFields fields = plain_nifti();
        int read = 0, refused = 0;
        base->size = inner->size = 0;
        if (file < 4)
            put_nrrd(base, &TYPES[2 + file], encodings[file], file == 2);
        else
            put_nifti_file(file == 6 ? inner : base, &fields, &TYPES[2 * (file - 4)], file == 5);
        if (file == 6)
            put_gzip(base, inner->at, inner->size);
        for (size_t size = 1; size < base->size; size++)
            try_file(base->at, size, &read, &refused);
        // No part of it is a volume, but a text whose last number, or a blank behind it, is cut.
        assert_true(read <= (file == 2 ? 2 : 0));
        for (int repeat = 0; repeat < EFFORT(1500); repeat++) {
            unsigned char *data = malloc(base->size);
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
            free(data);
        }
        printf("file %d of %zu bytes: %d read, %d refused\n", file, base->size, read, refused);
        assert_true(refused > 0);
    }
    free(base);
    free(inner);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nrrd_of_every_type_order_and_encoding_reads_the_same),
        cmocka_unit_test(negative_and_large_labels_keep_their_value),
        cmocka_unit_test(nrrd_spaces_become_lps_in_metres),
        cmocka_unit_test(nrrd_units_are_honoured),
        cmocka_unit_test(nrrd_without_directions_has_the_axes_of_the_world),
        cmocka_unit_test(nrrd_axes_of_one_value_are_left_out),
        cmocka_unit_test(nrrd_headers_may_be_written_in_many_ways),
        cmocka_unit_test(nrrd_voxels_may_lie_in_a_file_beside),
        cmocka_unit_test(files_beside_that_are_none_are_refused),
        cmocka_unit_test(nrrd_defects_are_told_in_a_sentence),
        cmocka_unit_test(voxels_that_are_no_labels_are_refused),
        cmocka_unit_test(nifti_of_every_type_and_order_packed_or_not_reads_the_same),
        cmocka_unit_test(nifti_pairs_are_read_by_their_header),
        cmocka_unit_test(nifti_sform_goes_before_qform),
        cmocka_unit_test(nifti_qform_turns_and_mirrors),
        cmocka_unit_test(nifti_without_transform_has_the_axes_of_the_world),
        cmocka_unit_test(nifti_units_are_honoured),
        cmocka_unit_test(nifti_may_have_more_dimensions_of_one),
        cmocka_unit_test(nifti_scales_that_give_whole_numbers_are_applied),
        cmocka_unit_test(nifti_defects_are_told_in_a_sentence),
        cmocka_unit_test(what_is_no_volume_is_refused),
        cmocka_unit_test(damaged_files_are_read_or_refused_but_never_harm),
        cmocka_unit_test(nothing_was_printed),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
