// SPDX-License-Identifier: MIT
// Label volumes in NIfTI-1 and 2: types, pairs, transforms, units, defects.
#include "test.h"
#include "volume_bench.h"

// --- NIfTI-1 ---

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

AROUND_ALL(make_folder, scratch_end)

TEST(nifti_of_every_type_and_order_packed_or_not_reads_the_same)
{
    NiftiFields fields = plain_nifti();
    for (int t = 0; t < TYPE_COUNT; t++)
        for (int big = 0; big < 2; big++)
            for (int packed = 0; packed < 2; packed++) {
                SCOPED(volume_destroy) LabelVolume volume;
                write_nifti(&fields, &TYPES[t], big, packed);
                import(&volume);
                expect_plain(&volume);
            }
}

// The same fields at the places and widths of NIfTI-2 (nifti2.h).
static void write_nifti2(const NiftiFields *fields, const Type *type, bool big)
{
    FREED Bytes *head = calloc(1, sizeof *head);
    const Type integer = {"", 0, 8, 'i'}, real = {"", 0, 8, 'f'};
    put_number(head, 540, 4, big);
    put_bytes(head, "n+2\0\r\n\032\n", 8);
    put_number(head, (uint64_t)type->nifti, 2, big);
    head->size = 16;
    for (int d = 0; d < 8; d++)
        put_value(head, &integer, fields->dim[d], big);
    head->size = 104;
    for (int d = 0; d < 8; d++)
        put_value(head, &real, (double)fields->pixdim[d], big);
    put_value(head, &integer, 544, big);
    put_value(head, &real, (double)fields->slope, big);
    put_value(head, &real, (double)fields->inter, big);
    head->size = 344;
    put_number(head, (uint64_t)fields->qform, 4, big);
    put_number(head, (uint64_t)fields->sform, 4, big);
    for (int d = 0; d < 3; d++)
        put_value(head, &real, (double)fields->quatern[d], big);
    for (int d = 0; d < 3; d++)
        put_value(head, &real, (double)fields->qoffset[d], big);
    for (int d = 0; d < 12; d++)
        put_value(head, &real, (double)fields->srow[d / 4][d % 4], big);
    head->size = 500;
    put_number(head, (uint64_t)fields->units, 4, big);
    head->size = 544;
    put_labels(head, type, big);
    write_file(head);
}

TEST(nifti_2_reads_the_same_as_nifti_1)
{
    for (int big = 0; big < 2; big++)
        for (int turned = 0; turned < 2; turned++) {
            SCOPED(volume_destroy) LabelVolume first;
            SCOPED(volume_destroy) LabelVolume second;
            NiftiFields fields = plain_nifti();
            fields.sform = !turned;
            fields.qform = 2;
            fields.pixdim[0] = -1.0f;
            for (int d = 0; d < 3; d++) {
                fields.quatern[d] = 0.5f;
                fields.qoffset[d] = 10.0f * (float)d;
            }
            fields.units = 1;
            import_nifti(&fields, &first);
            write_nifti2(&fields, &TYPES[3], big);
            import(&second);
            assert_string_equal(second.format, "NIfTI-2");
            expect_labels(&second);
            // Bit for bit: all numbers of the fields are single.
            assert_memory_equal(first.axis, second.axis, sizeof first.axis);
            assert_memory_equal(&first.origin, &second.origin, sizeof first.origin);
        }
}

TEST(nifti_pairs_are_read_by_their_header)
{
    NiftiFields fields = plain_nifti();
    fields.magic = "ni1";
    char name[SCRATCH_PATH];
    for (int packed = 0; packed < 4; packed++) {
        FREED Bytes *bytes = calloc(1, sizeof *bytes), *file = calloc(1, sizeof *file);
        fields.vox_offset = packed == 1 ? 5.0f : 0.0f;
        put_nifti(bytes, &fields, false);
        const char *header = packed & 1 ? "pair.hdr.gz" : "pair.hdr";
        if (packed & 1)
            put_gzip(file, bytes->at, bytes->size);
        scratch_write(&scratch_space, header, packed & 1 ? file->at : bytes->at,
                      packed & 1 ? file->size : bytes->size);
        bool other = packed >= 2;
        unlink(scratch_path(&scratch_space, "pair.img", name));
        unlink(scratch_path(&scratch_space, "pair.img.gz", name));
        write_voxels(other ? "pair.img.gz" : "pair.img", packed == 1 ? "12345" : "", other, "");
        SCOPED(volume_destroy) LabelVolume volume;
        Status status = {0};
        expect_ok(volume_import(scratch_path(&scratch_space, header, name), 1, &volume, &status),
                  status);
        expect_plain(&volume);
    }
    // The other one of the pair.
    unlink(scratch_path(&scratch_space, "pair.img.gz", name));
    LabelVolume volume;
    Status status = {0};
    assert_false(
        volume_import(scratch_path(&scratch_space, "pair.hdr", name), 1, &volume, &status));
    expect_in(status.text, "/pair.img: No such file or directory");
    write_voxels("pair.img", "", false, "");
    expect_error_of(scratch_path(&scratch_space, "pair.img", name),
                    ": is neither an NRRD nor a NIfTI-1 file (of a pair .hdr and .img, name the "
                    ".hdr); 3D Slicer saves others as NRRD");
    write_nifti(&fields, &TYPES[1], false, false);
    expect_error(": is the header of a NIfTI-1 pair, but its name does not end in .hdr, so that of "
                 "its voxels is not known");
}

TEST(nifti_sform_goes_before_qform)
{
    SCOPED(volume_destroy) LabelVolume volume;
    NiftiFields fields = plain_nifti();
    fields.qform = 1;
    fields.quatern[0] = 1.0f; // half a turn about x
    fields.qoffset[0] = 99.0f;
    import_nifti(&fields, &volume);
    expect_plain(&volume);
}

TEST(nifti_qform_turns_and_mirrors)
{
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        SCOPED(volume_destroy) LabelVolume volume;
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
    }
}

TEST(nifti_without_transform_has_the_axes_of_the_world)
{
    SCOPED(volume_destroy) LabelVolume volume;
    NiftiFields fields = plain_nifti();
    fields.sform = 0;
    import_nifti(&fields, &volume);
    expect_vec3(volume.axis[0], 2e-3, 0.0, 0.0, 1e-17);
    expect_vec3(volume.axis[1], 0.0, 3e-3, 0.0, 1e-17);
    expect_vec3(volume.axis[2], 0.0, 0.0, 4e-3, 1e-17);
    expect_vec3(volume.origin, 0.0, 0.0, 0.0, 0.0);
}

TEST(nifti_units_are_honoured)
{
    static const struct {
        int code;
        double metres;
    } units[] = {{0, 1e-3}, {1, 1.0}, {2, 1e-3}, {3, 1e-6}, {2 + 8, 1e-3}, {3 + 16, 1e-6}};
    for (int u = 0; u < 6; u++) {
        SCOPED(volume_destroy) LabelVolume volume;
        NiftiFields fields = plain_nifti();
        fields.units = units[u].code;
        import_nifti(&fields, &volume);
        double m = units[u].metres;
        expect_vec3(volume.axis[2], 0.0, 0.0, 4.0 * m, 1e-15 * m);
        expect_vec3(volume.origin, -10.0 * m, -20.0 * m, 30.0 * m, 1e-14 * m);
    }
}

TEST(nifti_may_have_more_dimensions_of_one)
{
    for (int dims = 4; dims <= 7; dims++) {
        SCOPED(volume_destroy) LabelVolume volume;
        NiftiFields fields = plain_nifti();
        fields.dim[0] = dims;
        import_nifti(&fields, &volume);
        expect_plain(&volume);
    }
    NiftiFields fields = plain_nifti();
    SCOPED(volume_destroy) LabelVolume volume;
    fields.dim[4] = 0; // beyond dim[0] nothing counts
    import_nifti(&fields, &volume);
}

TEST(nifti_scales_that_give_whole_numbers_are_applied)
{
    static const struct {
        float slope, inter;
    } scales[] = {{0.0f, 5.0f}, {1.0f, 0.0f}, {2.0f, 0.0f}, {1.0f, -3.0f}, {-3.0f, 7.0f}};
    for (int s = 0; s < 5; s++) {
        SCOPED(volume_destroy) LabelVolume volume;
        NiftiFields fields = plain_nifti();
        fields.slope = scales[s].slope;
        fields.inter = scales[s].inter;
        write_nifti(&fields, &TYPES[2], true, false);
        import(&volume);
        for (int v = 0; v < 24; v++) {
            int expected = label_at(v) * (int)scales[s].slope + (int)scales[s].inter;
            // Negative ones are empty.
            assert_int_equal(volume.label[v], s == 0 ? label_at(v) : expected < 0 ? 0 : expected);
        }
    }
    NiftiFields fields = plain_nifti();
    fields.slope = 0.5f;
    write_nifti(&fields, &TYPES[2], true, false);
    expect_error(": voxel (0, 0, 0) is 0.5 when scaled, not a label, which is a whole number up to "
                 "2147483647; grey values or shares are segmented first");
}

TEST(nifti_defects_are_told_in_a_sentence)
{
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
    f = plain_nifti();
    f.dim[0] = 7;
    f.dim[4] = f.dim[5] = f.dim[6] = 32767;
    write_nifti(&f, &TYPES[1], false, false);
    expect_error(": holds 3.518e+13 volumes, more than 268435456");
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
    REFUSED(
        f.srow[0][0] = 2.0f,
        ": axes 0 and 1 are not at right angles (cosine -0.707, at most 0.035), so its voxels "
        "are no boxes; resample it, with nearest neighbours (3D Slicer: Resample Scalar Volume)");
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
                 ": its voxels are of datatype %d, not integers or floats of up to 64 bits; export "
                 "labels as integers",
                 types[t]);
        expect_error(expected);
    }
    unsigned char other[600] = {540 & 255, 540 >> 8};
    scratch_write(&scratch_space, "organ", other, sizeof other);
    expect_error(": begins as a NIfTI-2 file, but its mark is neither n+2 nor ni2");
    scratch_write(&scratch_space, "organ", other, 539);
    expect_error(": ends within its NIfTI-2 header: copy or export it again");
    memcpy(other + 4, "n+2", 4);
    other[16 + 8 + 2] = 1; // dim[1] is 65536
    scratch_write(&scratch_space, "organ", other, sizeof other);
    expect_error(": has more than 32767 voxels along an axis");
}

TEST(nothing_was_printed)
{
    expect_nothing_printed();
}
