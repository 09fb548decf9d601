// SPDX-License-Identifier: MIT
// Pictures: grey values and colours around a body, from files of all sorts, and files that lie.
#include "test.h"
#include "volume_writer.h"

#include "io/volume_picture.h"

enum { NX = 12, NY = 10, NZ = 8 };
static const Type BYTE_TYPE = {"uchar", 2, 1, 'u'}, SHORT_TYPE = {"short", 4, 2, 'i'},
                  FLOAT_TYPE = {"float", 16, 4, 'f'};
// Cells of 3 mm, their low corner at (6, 6, 6) mm; voxels of 2 mm, the first in the origin.
static const PicturePlace AS_IT_IS = {.scale = 1.0};

AROUND_ALL(scratch_begin, scratch_end)

static Lattice block(void)
{
    Lattice lattice;
    Status status = {0};
    if (!lattice_create(&lattice, (const int[3]){3, 2, 1}, 0.003, &status))
        fail_msg("%s", status.text);
    memset(lattice.label, 1, 6);
    lattice.origin = vec3(0.006, 0.006, 0.006);
    return lattice;
}

// What a voxel has: a ramp.
static double ramp(int i, int j, int k, int channel)
{
    return 2.0 * i + 3.0 * j + 5.0 * k + 40.0 * channel;
}

static const char *write_picture(const Type *type, int channels, bool last, double factor)
{
    FREED Bytes *bytes = calloc(1, sizeof *bytes);
    put_text(bytes, "NRRD0004\ntype: %s\n", type->nrrd);
    if (channels == 1)
        put_text(bytes, "dimension: 3\nsizes: %d %d %d\nspacings: 2 2 2\n", NX, NY, NZ);
    else if (last)
        put_text(bytes,
                 "dimension: 4\nsizes: %d %d %d %d\nspacings: 2 2 2 nan\nkinds: domain domain "
                 "domain RGB-color\n",
                 NX, NY, NZ, channels);
    else
        put_text(bytes,
                 "dimension: 4\nsizes: %d %d %d %d\nspacings: nan 2 2 2\nkinds: %s domain domain "
                 "domain\n",
                 channels, NX, NY, NZ, channels == 4 ? "RGBA-color" : "RGB-color");
    put_text(bytes, "endian: little\nencoding: raw\n\n");
    for (int outer = 0; outer < (last ? channels : 1); outer++)
        for (int at = 0; at < NX * NY * NZ; at++)
            for (int inner = 0; inner < (last ? 1 : channels); inner++)
                put_value(bytes, type,
                          factor * ramp(at % NX, at / NX % NY, at / NX / NY, outer + inner), false);
    const char *path = scratch_at("picture.nrrd");
    scratch_write(&scratch_space, "picture.nrrd", bytes->at, bytes->size);
    return path;
}

// Expects the ramp, as `grey` of a value, in a channel of what was read.
static void expect_ramp(const VolumePicture *picture, bool coloured, double zero, double scale)
{
    for (int k = 0, at = 0; k < picture->count[2]; k++)
        for (int j = 0; j < picture->count[1]; j++)
            for (int i = 0; i < picture->count[0]; i++, at++) {
                // The voxel of the file, by its place.
                const Vec3 x = vec3_madd(
                    vec3_madd(vec3_madd(picture->origin, i, picture->axis[0]), j, picture->axis[1]),
                    k, picture->axis[2]);
                for (int c = 0; c < 3; c++) {
                    const double value = ramp((int)lrint(500.0 * x.x), (int)lrint(500.0 * x.y),
                                              (int)lrint(500.0 * x.z), coloured ? c : 0);
                    const double grey = fmin(fmax(scale * (value - zero), 0.0), 255.0);
                    expect_near(picture->colour[3 * at + c], grey, 0.5001); // rounded
                }
            }
}

static void import(const char *path, double black, double white, VolumePicture *picture)
{
    SCOPED(lattice_destroy) Lattice lattice = block();
    Status status = {0};
    if (!volume_import_picture(path, &lattice, &AS_IT_IS, black, white, picture, &status))
        fail_msg("%s", status.text);
    // Cells from 6 to 15, 12 and 9 mm: voxels 3 to 7, and what a linear mean at any node needs.
    assert_in_range(picture->count[0], 5, NX);
    assert_true(picture->origin.x <= 0.006 - 0.002 && picture->origin.y <= 0.006 - 0.002);
}

TEST(bytes_are_taken_as_they_are_and_other_values_between_their_limits)
{
    SCOPED(volume_picture_destroy) VolumePicture bytes, limited, scaled;
    import(write_picture(&BYTE_TYPE, 1, false, 1.0), 0.0, 0.0, &bytes);
    expect_ramp(&bytes, false, 0.0, 1.0);
    import(write_picture(&BYTE_TYPE, 1, false, 1.0), 20.0, 71.0, &limited);
    expect_ramp(&limited, false, 20.0, 5.0);
    import(write_picture(&SHORT_TYPE, 1, false, -10.0), -200.0, -710.0, &scaled);
    expect_ramp(&scaled, false, 20.0, 5.0); // white may be below black
}

TEST(colours_are_read_whether_they_are_the_first_axis_or_the_last)
{
    for (int form = 0; form < 3; form++) {
        SCOPED(volume_picture_destroy) VolumePicture picture;
        import(write_picture(&BYTE_TYPE, form == 2 ? 4 : 3, form == 1, 1.0), 0.0, 0.0, &picture);
        expect_ramp(&picture, true, 0.0, 1.0);
    }
}

TEST(limits_that_are_not_given_leave_out_a_hundredth_at_each_end)
{
    SCOPED(volume_picture_destroy) VolumePicture picture;
    import(write_picture(&FLOAT_TYPE, 1, false, 1e4), 0.0, 0.0, &picture);
    int count[256] = {0}, voxels = picture.count[0] * picture.count[1] * picture.count[2];
    for (int v = 0; v < voxels; v++)
        count[picture.colour[3 * v]]++;
    // At least a hundredth less one on each side, and few more: values of a ramp repeat.
    assert_in_range(count[0], voxels / 100, voxels / 10);
    assert_in_range(count[255], voxels / 100, voxels / 10);
}

TEST(a_place_moves_the_picture_with_the_body)
{
    const PicturePlace place = {2.0, {0.0, 0.0, 1.5707963267948966}, {1.0, 2.0, 3.0}};
    SCOPED(lattice_destroy) Lattice lattice = block();
    SCOPED(volume_picture_destroy) VolumePicture there, moved;
    Status status = {0};
    const char *path = write_picture(&BYTE_TYPE, 1, false, 1.0);
    import(path, 0.0, 0.0, &there);
    lattice_place(&lattice, 2.0, place.rotation, place.translation);
    expect_ok(volume_import_picture(path, &lattice, &place, 0.0, 0.0, &moved, &status), status);
    // Twice as large, a quarter turn about z, then moved: x goes to y, y to -x.
    const Vec3 o = there.origin, at = vec3(1.0 - 2.0 * o.y, 2.0 + 2.0 * o.x, 3.0 + 2.0 * o.z);
    for (int a = 0; a < 3; a++)
        assert_int_equal(moved.count[a], there.count[a]);
    expect_near(vec3_length(vec3_sub(moved.origin, at)), 0.0, 1e-12);
    expect_near(moved.axis[0].y, 0.004, 1e-12);
    assert_memory_equal(moved.colour, there.colour,
                        3 * (size_t)(there.count[0] * there.count[1] * there.count[2]));
}

static void expect_refusal(const char *path, const char *said)
{
    SCOPED(lattice_destroy) Lattice lattice = block();
    VolumePicture picture;
    Status status = {0};
    assert_false(volume_import_picture(path, &lattice, &AS_IT_IS, 0.0, 0.0, &picture, &status));
    assert_null(picture.colour);
    if (strstr(status.text, said) == NULL || strncmp(status.text, path, strlen(path)) != 0)
        fail_msg("'%s' does not say '%s' of %s", status.text, said, path);
}

TEST(files_that_are_no_picture_of_the_body_are_refused_by_name)
{
    const char *path = scratch_at("picture.nrrd");
    FREED Bytes *bytes = calloc(1, sizeof *bytes);
    expect_refusal(scratch_at("none.nrrd"), "No such file");
    expect_refusal(write_picture(&BYTE_TYPE, 2, true, 1.0), "has 2 values a voxel");
    expect_refusal(write_picture(&FLOAT_TYPE, 1, false, (double)NAN), "not a grey value");
    expect_refusal(write_picture(&FLOAT_TYPE, 1, false, (double)INFINITY), "not a grey value");
    // One that ends early, and one that is none.
    write_picture(&BYTE_TYPE, 1, false, 1.0);
    FILE *file = fopen(path, "r+b");
    assert_non_null(file);
    assert_int_equal(ftruncate(fileno(file), 700), 0);
    fclose(file);
    expect_refusal(path, "960 voxels take 960 bytes");
    scratch_write(&scratch_space, "picture.nrrd", "hello", 5);
    expect_refusal(path, "neither an NRRD nor a NIfTI");
    // It lies elsewhere, or claims more than can be.
    put_text(bytes, "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 4 4\nspacings: 2 2 2\n"
                    "encoding: raw\n\n");
    bytes->size += 64;
    scratch_write(&scratch_space, "picture.nrrd", bytes->at, bytes->size);
    expect_refusal(path, "does not cover the labels: along axis 0");
    bytes->size = 0;
    put_text(bytes, "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 200000 200000 200000\nspacings: 2 "
                    "2 2\nencoding: raw\n\n");
    scratch_write(&scratch_space, "picture.nrrd", bytes->at, bytes->size);
    expect_refusal(path, "are more than");
}
