// SPDX-License-Identifier: MIT
// What a volume file says besides its voxels: which labels it has, in which layers, by which names,
// and what is assumed where it is not plain.
#include "test.h"
#include "random.h"
#include "volume_bench.h"

#include <math.h>

AROUND_ALL(make_folder, scratch_end)

static LabelVolume make_volume(int nx, int ny, int nz)
{
    LabelVolume volume = {.count = {nx, ny, nz}, .high = {nx, ny, nz}, .layers = 1, .layer = 1};
    volume.label = calloc((size_t)nx * (size_t)ny * (size_t)nz, sizeof *volume.label);
    assert_non_null(volume.label);
    return volume;
}

// --- lists ---

// Empties what is connected to a voxel through faces, and has its label.
static void flood(int *label, const int count[3], int i, int j, int k, int of)
{
    if (i < 0 || j < 0 || k < 0 || i >= count[0] || j >= count[1] || k >= count[2])
        return;
    int *here = &label[(k * count[1] + j) * count[0] + i];
    if (*here != of)
        return;
    *here = 0;
    for (int side = -1; side <= 1; side += 2) {
        flood(label, count, i + side, j, k, of);
        flood(label, count, i, j + side, k, of);
        flood(label, count, i, j, k + side, of);
    }
}

static int count_pieces(const LabelVolume *volume, int label)
{
    const int *n = volume->count, voxels = n[0] * n[1] * n[2];
    FREED int *copy = malloc((size_t)voxels * sizeof *copy);
    int pieces = 0;
    memcpy(copy, volume->label, (size_t)voxels * sizeof *copy);
    for (int v = 0; v < voxels; v++)
        if (copy[v] == label) {
            flood(copy, n, v % n[0], v / n[0] % n[1], v / n[0] / n[1], label);
            pieces++;
        }
    return pieces;
}

static void expect_listed(const LabelVolume *volume, const VolumeLabel *label)
{
    const int *n = volume->count;
    long voxels = 0;
    int low[3] = {n[0], n[1], n[2]}, high[3] = {0};
    for (int v = 0; v < n[0] * n[1] * n[2]; v++) {
        const int at[3] = {v % n[0], v / n[0] % n[1], v / n[0] / n[1]};
        if (volume->label[v] != label->label)
            continue;
        voxels++;
        for (int a = 0; a < 3; a++) {
            low[a] = at[a] < low[a] ? at[a] : low[a];
            high[a] = at[a] >= high[a] ? at[a] + 1 : high[a];
        }
    }
    assert_int_equal(label->voxels, voxels);
    assert_memory_equal(label->low, low, sizeof low);
    assert_memory_equal(label->high, high, sizeof high);
    assert_int_equal(label->pieces, count_pieces(volume, label->label));
}

TEST(labels_are_listed_with_voxels_boxes_and_pieces)
{
    uint64_t seed = 5;
    for (int trial = 0; trial < 60; trial++) {
        SCOPED(volume_destroy)
        LabelVolume volume = make_volume(1 + random_below(&seed, 12), 1 + random_below(&seed, 9),
                                         1 + random_below(&seed, 7));
        const int labels = 1 + trial % 4,
                  voxels = volume.count[0] * volume.count[1] * volume.count[2];
        for (int v = 0; v < voxels; v++)
            volume.label[v] = 1000000 * random_below(&seed, labels + 1);
        VolumeLabels list;
        Status status = {0};
        expect_ok(volume_labels(&volume, &list, &status), status);
        long sum = 0, solid = 0;
        for (int i = 0; i < list.count; i++) {
            expect_listed(&volume, &list.label[i]);
            assert_true(i == 0 || list.label[i].voxels <= list.label[i - 1].voxels);
            sum += list.label[i].voxels;
        }
        for (int v = 0; v < voxels; v++)
            solid += volume.label[v] != 0;
        assert_int_equal(sum, solid); // none is missing
        volume_labels_destroy(&list);
    }
}

static bool is_taken(const LabelVolume *volume, Status *status)
{
    VolumeLabels list;
    bool ok = volume_labels(volume, &list, status);
    volume_labels_destroy(&list);
    return ok;
}

TEST(grey_values_are_told_from_labels)
{
    uint64_t seed = 9;
    SCOPED(volume_destroy) LabelVolume volume = make_volume(32, 32, 16);
    Status status = {0};
    // An atlas of 256 regions, each of 4 x 4 x 4 voxels.
    for (int v = 0; v < 32 * 32 * 16; v++)
        volume.label[v] = 1 + v % 32 / 4 + v / 32 % 32 / 4 * 8 + v / 1024 / 4 * 64;
    expect_ok(is_taken(&volume, &status), status);
    // Noise of a few values around a mean, on air.
    for (int v = 0; v < 32 * 32 * 16; v++)
        volume.label[v] = v % 32 < 4 ? 0 : 90 + random_below(&seed, 40);
    assert_false(is_taken(&volume, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    expect_in(status.text, "is an image of grey values, not of labels: 40 different ones");
    // Without noise it has too many values.
    for (int v = 0; v < 32 * 32 * 16; v++)
        volume.label[v] = 1 + v / 2;
    status = (Status){0};
    assert_false(is_taken(&volume, &status));
    expect_in(status.text, "grey values, not of labels: more than 4096 different ones");
    // Two labels without any order are labels still.
    for (int v = 0; v < 32 * 32 * 16; v++)
        volume.label[v] = random_below(&seed, 3);
    expect_ok(is_taken(&volume, &status), status);
}

// --- values ---

TEST(values_within_a_thousandth_of_a_whole_number_are_that_number)
{
    // What rounding and single precision leave of 7, and a slope that is no number, which is 1.
    static const double near[] = {6.9999995, 7.0009, 6.9991, 1.0 - 1.0 / (1 << 23),
                                  -2.0001,   0.0005};
    static const int whole[] = {7, 7, 7, 1, 0, 0};
    for (int i = 0; i < 6; i++)
        for (int scaled = 0; scaled < 2; scaled++) {
            SCOPED(volume_destroy) LabelVolume volume;
            NiftiFields fields = plain_nifti();
            FREED Bytes *bytes = calloc(1, sizeof *bytes);
            fields.datatype = 64;
            fields.slope = scaled ? (float)NAN : 1.0F;
            put_nifti(bytes, &fields, false);
            put_number(bytes, 0, 4, false);
            for (int v = 0; v < 24; v++)
                put_value(bytes, &TYPES[9], v == 5 ? near[i] : 0.0, false);
            write_file(bytes);
            import(&volume);
            assert_int_equal(volume.label[5], whole[i]);
            assert_int_equal(volume.negative, near[i] < -1.0);
            assert_string_equal(volume.notes,
                                near[i] < -1.0 ? "1 voxels with negative values are empty" : "");
        }
}

// --- layers and names ---

#define LAYERED(kinds, sizes, directions)                                                          \
    "type: uchar\ndimension: 4\nsizes: " sizes "\nkinds: " kinds "\nspace: LPS\n"                  \
    "space directions: " directions "\nencoding: raw\n"                                            \
    "Segment0_ID:=x\nSegment0_Name:=liver: left\nSegment0_LabelValue:=4\nSegment0_Layer:=1\n"      \
    "Segment0_Color:=0.5 0.25 1\nSegment1_Name:=none\nSegment1_LabelValue:=99\n"                   \
    "Segment1_Layer:=0\n"

#define PLAIN_LAYER "type: uchar\ndimension: 3\nsizes: 4 3 2\nspacings: 1 1 1\nencoding: raw\n"

static void expect_layer(int layer, const int *label, int count)
{
    SCOPED(volume_destroy) LabelVolume volume;
    Status status = {0};
    expect_ok(volume_import(path, layer, &volume, &status), status);
    assert_int_equal(volume.layers, 24 / count);
    for (int v = 0; v < count; v++)
        assert_int_equal(volume.label[v], label[v]);
}

// The bytes of the file are 1 to 24: beside one another in a segmentation, behind in a series.
TEST(layers_are_read_one_by_one)
{
    static const int first[] = {1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23},
                     second[] = {2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24},
                     low[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12},
                     high[] = {13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24};
    write_nrrd(LAYERED("list domain domain domain", "2 2 3 2", "none (1,0,0) (0,1,0) (0,0,1)"));
    expect_layer(1, first, 12);
    expect_layer(2, second, 12);
    LabelVolume none;
    Status status = {0};
    assert_false(volume_import(path, 3, &none, &status));
    expect_in(status.text, ": layer 3 outside [1, 2]");
    write_nrrd(LAYERED("domain domain domain time", "2 3 2 2", "(1,0,0) (0,1,0) (0,0,1) none"));
    expect_layer(1, low, 12);
    expect_layer(2, high, 12);
    NiftiFields fields = plain_nifti();
    for (int axis = 4; axis <= 5; axis++) {
        fields = plain_nifti();
        fields.dim[0] = 5;
        fields.dim[1] = 2;
        fields.dim[axis] = 2;
        fields.slope = 1.0F;
        for (int packed = 0; packed < 2; packed++) {
            write_nifti(&fields, &TYPES[3], true, packed);
            expect_layer(1, low, 12);
            expect_layer(2, high, 12);
        }
    }
    // The file must hold all of them.
    fields.dim[5] = 3;
    write_nifti(&fields, &TYPES[1], false, false);
    expect_error(": 36 voxels take 36 bytes, the file has 24 for them");
}

TEST(labels_have_the_names_that_the_file_gives_them)
{
    SCOPED(volume_destroy) LabelVolume volume;
    VolumeLabels list;
    Status status = {0};
    write_nrrd(LAYERED("list domain domain domain", "2 2 3 2", "none (1,0,0) (0,1,0) (0,0,1)"));
    expect_ok(volume_survey(path, 0, &volume, &list, &status), status);
    assert_int_equal(list.count, 25); // 24 values, and one that no voxel has
    for (int i = 0; i < 25; i++) {
        const VolumeLabel *label = &list.label[i];
        const bool named = label->label == 4, empty = label->label == 99;
        assert_int_equal(label->layer, empty || label->label % 2 == 1 ? 1 : 2);
        assert_int_equal(label->voxels, !empty);
        assert_string_equal(label->name, named ? "liver: left" : empty ? "none" : "");
        expect_near((double)label->colour[0], named ? 0.5 : -1.0, 0.0);
    }
    volume_labels_destroy(&list);
}

// What 3D Slicer wrote before it shared layers: one a segment, with the value 1.
TEST(segments_without_values_and_layers_have_one_each)
{
    SCOPED(volume_destroy) LabelVolume volume;
    Status status = {0};
    write_nrrd("type: uchar\ndimension: 4\nsizes: 2 2 3 2\nkinds: list domain domain domain\n"
               "space: LPS\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\n"
               "Segment0_Name:=liver\nSegment1_Name:=vein\nSegment1_Extent:=0 1 0 1 0 1\n"
               "Segment5000_Name:=too many\nSegment-1_Name:=none\nSegment2_Name:=vein\n");
    expect_ok(volume_import_header(path, &volume, &status), status);
    assert_int_equal(volume.segment_count, 3);
    int layer = 0;
    assert_int_equal(volume_find_name(&volume, "liver", &layer, &status), 1);
    assert_int_equal(layer, 1);
    // Two of one name are one only in a layer that is given.
    layer = 2;
    assert_int_equal(volume_find_name(&volume, "vein", &layer, &status), 1);
    layer = 0;
    assert_int_equal(volume_find_name(&volume, "vein", &layer, &status), 0);
    assert_string_equal(status.text,
                        "'vein' is the name of label 1 of layer 2 and of label 1 of layer 3");
}

// Segments that state values, but no layer, are of the only image there is.
TEST(segments_of_one_image_need_no_layer)
{
    SCOPED(volume_destroy) LabelVolume volume;
    Status status = {0};
    write_nrrd("type: uchar\ndimension: 3\nsizes: 2 2 3\nspace: LPS\n"
               "space directions: (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\n"
               "Segment0_Name:=liver\nSegment0_LabelValue:=1\n"
               "Segment1_Name:=vein\nSegment1_LabelValue:=2\n");
    expect_ok(volume_import_header(path, &volume, &status), status);
    int layer = 0;
    assert_int_equal(volume_find_name(&volume, "vein", &layer, &status), 2);
    assert_int_equal(layer, 1);
}

TEST(long_names_end_with_a_whole_character)
{
    SCOPED(volume_destroy) LabelVolume volume;
    Status status = {0};
    char header[512];
    // 62 letters, then one of two bytes of which one would fit.
    snprintf(header, sizeof header,
             PLAIN_LAYER "Segment0_Name:=%062d\xc3\xa4rm\nSegment1_Name:=a\tb\xc2\x9b"
                         "c\n",
             0);
    write_nrrd(header);
    expect_ok(volume_import_header(path, &volume, &status), status);
    assert_int_equal(strlen(volume.segment[0].name), 62);
    assert_string_equal(volume.segment[1].name, "a?b\xc2?c");
}

// --- parts ---

// Labels 1 to 3 in an ellipsoid each, far from the borders, on a volume that is turned and
// mirrored.
static void write_ellipsoids(void)
{
    FREED Bytes *bytes = calloc(1, sizeof *bytes);
    put_text(bytes, "NRRD0005\ntype: uchar\ndimension: 3\nsizes: 40 30 24\nspace: RAS\n"
                    "space directions: (0.6,0.8,0) (1.6,-1.2,0) (0,0,3)\nencoding: raw\n\n");
    for (int v = 0; v < 40 * 30 * 24; v++) {
        const double x = v % 40, y = v / 40 % 30, z = v / 1200;
        int label = 0;
        for (int l = 1; l <= 3; l++)
            if (pow((x - 10 * l) / 6, 2) + pow((y - 15) / 5, 2) + pow((z - 12) / 4, 2) < 1.0)
                label = l;
        put_number(bytes, (uint64_t)label, 1, false);
    }
    write_file(bytes);
}

TEST(only_the_box_of_the_labels_is_kept_and_makes_the_same_body)
{
    static const int label[] = {3, 2};
    write_ellipsoids();
    for (int size = 0; size < 3; size++) {
        Status status = {0};
        SCOPED(volume_destroy) LabelVolume whole, part;
        SCOPED(lattice_destroy) Lattice one, other;
        SurfaceField first, second;
        import(&whole);
        expect_ok(volume_import_labels(path, 1, label, 2, &part, &status), status);
        const int low[] = {15, 11, 9}, high[] = {36, 20, 16};
        assert_memory_equal(part.low, low, sizeof low);
        assert_memory_equal(part.high, high, sizeof high);
        expect_ok(volume_lattice(&whole, label, 2, size * 1.3e-3, &one, &status), status);
        expect_ok(volume_lattice(&part, label, 2, size * 1.3e-3, &other, &status), status);
        // Bit by bit.
        const size_t cells = (size_t)one.count[0] * (size_t)one.count[1] * (size_t)one.count[2];
        assert_memory_equal(one.count, other.count, sizeof one.count);
        assert_memory_equal(&one.origin, &other.origin, sizeof one.origin);
        assert_memory_equal(one.label, other.label, cells);
        volume_field(&whole, label, 2, &one, &first);
        volume_field(&part, label, 2, &other, &second);
        const size_t samples =
            (size_t)first.count[0] * (size_t)first.count[1] * (size_t)first.count[2];
        assert_memory_equal(first.count, second.count, sizeof first.count);
        assert_memory_equal(first.value, second.value, samples * sizeof *first.value);
        surface_field_destroy(&first);
        surface_field_destroy(&second);
    }
    LabelVolume none;
    Status status = {0};
    assert_false(volume_import_labels(path, 1, (const int[]){4}, 1, &none, &status));
    expect_in(status.text, "/organ: no voxel has the label 4; the labels there are 1, 2, 3");
}

// --- transforms ---

static double component(Vec3 v, int a)
{
    return a == 0 ? v.x : a == 1 ? v.y : v.z;
}

// How far the corners of the box of voxels differ [mm] by the sheared axes and by those that were
// read.
static double farthest(const LabelVolume *volume, const NiftiFields *fields)
{
    double far = 0.0;
    for (int k = 0; k < 8; k++) {
        double square = 0.0;
        for (int r = 0; r < 3; r++) {
            const double sign = r < 2 ? -1.0 : 1.0; // RAS to LPS
            double x = sign * (double)fields->srow[r][3];
            double is = 1e3 * component(volume->origin, r);
            for (int a = 0; a < 3; a++) {
                const double at = (k >> a & 1 ? volume->count[a] : 0) - 0.5;
                x += at * sign * (double)fields->srow[r][a];
                is += at * 1e3 * component(volume->axis[a], r);
            }
            square += (is - x) * (is - x);
        }
        far = fmax(far, sqrt(square));
    }
    return far;
}

TEST(axes_up_to_two_degrees_off_are_read_as_the_nearest_right_angles)
{
    static const struct {
        double degrees;
        int axis, to;
    } cases[] = {{0.1, 1, 2}, {1.0, 1, 2}, {1.9, 0, 1}, {1.0, 2, 0}, {-1.5, 0, 2}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        SCOPED(volume_destroy) LabelVolume volume;
        NiftiFields fields = plain_nifti();
        const float spacing[3] = {2.0F, 3.0F, 4.0F};
        const double shear = sin(cases[i].degrees * M_PI / 180.0);
        memset(fields.srow, 0, sizeof fields.srow);
        for (int a = 0; a < 3; a++)
            fields.srow[a][a] = spacing[a];
        fields.srow[cases[i].to][cases[i].axis] = (float)shear * spacing[cases[i].axis];
        write_nifti(&fields, &TYPES[1], false, false);
        import(&volume);
        // Right angles, as exactly as rotations of unit length are.
        for (int a = 0; a < 3; a++)
            expect_near(vec3_dot(vec3_unit(volume.axis[a]), vec3_unit(volume.axis[(a + 1) % 3])),
                        0.0, 1e-15);
        // What is said is what it is, to the three digits that are printed.
        char said[64];
        snprintf(said, sizeof said, "up to %.3g mm off", farthest(&volume, &fields));
        expect_in(volume.notes, said);
        snprintf(said, sizeof said, "up to %.2g degrees off right", fabs(cases[i].degrees));
        expect_in(volume.notes, said);
        // The nearest ones turn both axes by half of the angle (of the tangent, within its square).
        const Vec3 turned = vec3_unit(volume.axis[cases[i].axis]);
        const double half = component(turned, cases[i].to);
        expect_near(fabs(half), fabs(0.5 * shear), 0.01 * fabs(shear));
    }
    NiftiFields fields = plain_nifti();
    fields.srow[0][0] = 0.08F; // of 2: 2.3 degrees
    write_nifti(&fields, &TYPES[1], false, false);
    LabelVolume volume;
    Status status = {0};
    assert_false(volume_import(path, 1, &volume, &status));
    expect_in(status.text, "axes 0 and 1 are not at right angles");
}

static void import_plain(const NiftiFields *fields, LabelVolume *volume)
{
    write_nifti(fields, &TYPES[1], false, false);
    import(volume);
}

TEST(transforms_that_contradict_each_other_are_told)
{
    NiftiFields fields = plain_nifti();
    SCOPED(volume_destroy) LabelVolume volume;
    import_plain(&fields, &volume);
    assert_string_equal(volume.notes, ""); // nothing contradicts
    volume_destroy(&volume);
    fields.pixdim[2] = 3.6F;
    import_plain(&fields, &volume);
    assert_string_equal(volume.notes,
                        "its sform was taken, with voxels of 2 x 3 x 4 mm; pixdim says "
                        "2 x 3.6 x 4");
    volume_destroy(&volume);
    // A qform that is the sform, and one that is moved by (3, 0, 4) mm.
    fields = plain_nifti();
    fields.qform = 1;
    fields.quatern[2] = (float)sqrt(0.5); // a quarter turn about z, as the sform's
    memcpy(fields.qoffset, (float[]){10, 20, 30}, sizeof fields.qoffset);
    import_plain(&fields, &volume);
    assert_string_equal(volume.notes, "");
    volume_destroy(&volume);
    memcpy(fields.qoffset, (float[]){13, 20, 34}, sizeof fields.qoffset);
    import_plain(&fields, &volume);
    assert_string_equal(volume.notes,
                        "its sform was taken; by its qform voxels would be up to 5 mm elsewhere");
}

TEST(nothing_was_printed)
{
    expect_nothing_printed();
}
