// SPDX-License-Identifier: MIT
#include "effort.h"
#include "test.h"
#include "random.h"
#include "volume_writer.h"

#include "base/log.h"
#include "scene/build_parts.h"
#include "io/volume_import.h"

static LabelVolume make_volume(int nx, int ny, int nz, Vec3 a, Vec3 b, Vec3 c)
{
    LabelVolume volume = {
        .count = {nx, ny, nz}, .high = {nx, ny, nz}, .axis = {a, b, c}, .origin = {0.3, -0.2, 0.1}};
    volume.label = calloc((size_t)(nx * ny * nz), sizeof *volume.label);
    return volume;
}

static int *voxel(const LabelVolume *volume, int i, int j, int k)
{
    return &volume->label[((long)k * volume->count[1] + j) * volume->count[0] + i];
}

static void fill_random(LabelVolume *volume, int labels, uint64_t *seed)
{
    for (int v = 0; v < volume->count[0] * volume->count[1] * volume->count[2]; v++)
        volume->label[v] = random_below(seed, labels);
}

static Vec3 voxel_centre(const LabelVolume *volume, double i, double j, double k)
{
    Vec3 x = vec3_madd(volume->origin, i, volume->axis[0]);
    return vec3_madd(vec3_madd(x, j, volume->axis[1]), k, volume->axis[2]);
}

// Where a point of the world is in the lattice, in cells from its low corner.
static Vec3 in_cells(const Lattice *lattice, Vec3 x)
{
    Vec3 offset = quat_rotate(quat_conjugate(lattice->turn), vec3_sub(x, lattice->origin));
    return vec3_scale(1.0 / lattice->size, offset);
}

static int lattice_label_of(const Lattice *lattice, Vec3 x)
{
    Vec3 at = in_cells(lattice, x);
    return lattice_label(lattice, (int)floor(at.x), (int)floor(at.y), (int)floor(at.z));
}

static void make_lattice(const LabelVolume *volume, const int *label, int count, double size,
                         Lattice *lattice)
{
    Status status = {0};
    expect_ok(volume_lattice(volume, label, count, size, lattice, &status), status);
    double unit = lattice->turn.w * lattice->turn.w + lattice->turn.x * lattice->turn.x +
                  lattice->turn.y * lattice->turn.y + lattice->turn.z * lattice->turn.z;
    expect_near(unit, 1.0, 1e-15); // a few roundings
}

static char path[SCRATCH_PATH];

static int make_folder(void **state)
{
    log_set_level(LOG_ERROR);
    if (scratch_begin(state) != 0)
        return -1;
    scratch_path(&scratch_space, "organ", path);
    return 0;
}

AROUND_ALL(make_folder, scratch_end)

// Every voxel is the cell at its place, whatever the axes: all orders and directions, also turned.
TEST(voxels_that_are_cubes_become_cells_where_they_are)
{
    uint64_t seed = 1;
    for (int order = 0; order < 6; order++)
        for (int signs = 0; signs < 8; signs++)
            for (int turned = 0; turned < 2; turned++) {
                static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                                 {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
                Vec3 axis[3];
                Quat turn = quat_from_rotation(random_vec3(&seed));
                for (int a = 0; a < 3; a++) {
                    int to = orders[order][a];
                    double length = signs & 1 << a ? -0.002 : 0.002;
                    axis[a] = vec3_scale(length, vec3(to == 0, to == 1, to == 2));
                    if (turned)
                        axis[a] = quat_rotate(turn, axis[a]);
                }
                SCOPED(volume_destroy)
                LabelVolume volume = make_volume(5, 4, 3, axis[0], axis[1], axis[2]);
                fill_random(&volume, 4, &seed);
                *voxel(&volume, 0, 3, 0) = *voxel(&volume, 4, 0, 2) = 3; // so that none is cropped
                const int chosen[] = {3, 1};
                SCOPED(lattice_destroy) Lattice lattice;
                make_lattice(&volume, chosen, 2, 0.0, &lattice);
                expect_near(lattice.size, 0.002, 1e-17); // a cube root
                int solid = 0;
                for (int v = 0; v < 60; v++) {
                    Vec3 x = voxel_centre(&volume, v % 5, v / 5 % 4, v / 20);
                    int label = volume.label[v], material = label == 3 ? 1 : label == 1 ? 2 : 0;
                    assert_int_equal(lattice_label_of(&lattice, x), material);
                    Vec3 at = in_cells(&lattice, x);
                    // Roundings of 0.3 m in cells of 2 mm.
                    expect_near(at.x - floor(at.x), 0.5, 1e-12);
                    expect_near(at.y - floor(at.y), 0.5, 1e-12);
                    expect_near(at.z - floor(at.z), 0.5, 1e-12);
                    solid += material != 0;
                }
                assert_int_equal(lattice_solid(&lattice), solid);
                if (order == 0 && !turned && (signs == 0 || signs == 1 || signs == 2 || signs == 4))
                    expect_near(lattice.turn.w, 1.0, 0.0); // not turned at all
            }
}

TEST(only_the_part_asked_for_is_kept)
{
    SCOPED(volume_destroy)
    LabelVolume volume =
        make_volume(30, 30, 30, vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0));
    for (int v = 0; v < 27000; v++)
        volume.label[v] = 7;
    *voxel(&volume, 10, 20, 5) = -3;
    *voxel(&volume, 12, 20, 6) = 300;
    SCOPED(lattice_destroy) Lattice lattice;
    make_lattice(&volume, (const int[]){300, -3}, 2, 0.0, &lattice);
    assert_int_equal(lattice_solid(&lattice), 2);
    assert_int_equal(lattice.count[0], 3);
    assert_int_equal(lattice.count[1], 1);
    assert_int_equal(lattice.count[2], 2);
    assert_int_equal(lattice_label(&lattice, 0, 0, 0), 2);
    assert_int_equal(lattice_label(&lattice, 2, 0, 1), 1);
}

// Each cell has the label of the voxel that its centre is in; nothing else is near.
TEST(cells_of_other_sizes_ask_the_voxel_at_their_centre)
{
    static const double sizes[] = {0.0, 0.0007, 0.0013, 0.002, 0.0029, 0.0041};
    uint64_t seed = 8;
    for (int s = 0; s < 6; s++)
        for (int mirrored = 0; mirrored < 2; mirrored++) {
            Quat turn = quat_from_rotation(vec3(0.4, -0.3, 0.8));
            double z = mirrored ? -0.003 : 0.003;
            SCOPED(volume_destroy)
            LabelVolume volume = make_volume(9, 8, 7, quat_rotate(turn, vec3(0.001, 0.0, 0.0)),
                                             quat_rotate(turn, vec3(0.0, 0.0015, 0.0)),
                                             quat_rotate(turn, vec3(0.0, 0.0, z)));
            fill_random(&volume, 3, &seed);
            SCOPED(lattice_destroy) Lattice lattice;
            make_lattice(&volume, (const int[]){1, 2}, 2, sizes[s], &lattice);
            expect_near(lattice.size, sizes[s] > 0.0 ? sizes[s] : 0.001, 1e-18);
            int compared = 0;
            for (int k = -1; k <= lattice.count[2]; k++)
                for (int j = -1; j <= lattice.count[1]; j++)
                    for (int i = -1; i <= lattice.count[0]; i++) {
                        Vec3 x = lattice_point(&lattice, i + 0.5, j + 0.5, k + 0.5);
                        double at[3];
                        bool clear = true, in = true;
                        for (int a = 0; a < 3; a++) {
                            at[a] = vec3_dot(vec3_sub(x, volume.origin), volume.axis[a]) /
                                    vec3_dot(volume.axis[a], volume.axis[a]);
                            double border = at[a] + 0.5 - rint(at[a] + 0.5);
                            clear &= fabs(border) > 1e-6; // else either voxel would do
                            in &= at[a] > -0.5 && at[a] < volume.count[a] - 0.5;
                        }
                        if (!clear)
                            continue;
                        int expected = in ? *voxel(&volume, (int)rint(at[0]), (int)rint(at[1]),
                                                   (int)rint(at[2]))
                                          : 0;
                        assert_int_equal(lattice_label(&lattice, i, j, k), expected);
                        compared++;
                    }
            assert_true(compared > 0);
            if (sizes[s] == 0.0) { // 1 x 1.5 x 3 cells a voxel: the volume stays nearly
                int solid = 0;
                for (int v = 0; v < 504; v++)
                    solid += volume.label[v] != 0;
                expect_near((double)lattice_solid(&lattice) / (solid * 4.5), 1.0, 0.02);
            }
        }
}

TEST(a_thousandth_decides_what_a_cube_is)
{
    for (int i = 0; i < 2; i++) {
        double tall = i == 0 ? 1.0005e-3 : 1.2e-3;
        SCOPED(volume_destroy)
        LabelVolume volume = make_volume(10, 10, 10, vec3(1e-3, 0.0, 0.0), vec3(0.0, 1e-3, 0.0),
                                         vec3(0.0, 0.0, tall));
        for (int v = 0; v < 1000; v++)
            volume.label[v] = 1;
        SCOPED(lattice_destroy) Lattice lattice;
        make_lattice(&volume, (const int[]){1}, 1, 0.0, &lattice);
        assert_int_equal(lattice.count[2], i == 0 ? 10 : 12);
        // The mean keeps the volume of a voxel.
        expect_near(lattice.size, i == 0 ? cbrt(1e-6 * tall) : 1e-3, 1e-18);
        Vec3 middle = lattice_point(&lattice, 0.5 * lattice.count[0], 0.5 * lattice.count[1],
                                    0.5 * lattice.count[2]);
        Vec3 expected = voxel_centre(&volume, 4.5, 4.5, 4.5);
        expect_near(vec3_length(vec3_sub(middle, expected)), 0.0, 1e-15);
    }
}

static void refuse(const LabelVolume *volume, const int *label, int count, double size,
                   const char *text)
{
    Lattice lattice;
    Status status = {0};
    assert_false(volume_lattice(volume, label, count, size, &lattice, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    assert_string_equal(status.text, text);
    assert_null(lattice.label);
}

TEST(what_cannot_be_made_is_told_in_a_sentence)
{
    SCOPED(volume_destroy)
    LabelVolume volume =
        make_volume(20, 2, 1, vec3(1e-3, 0.0, 0.0), vec3(0.0, 1e-3, 0.0), vec3(0.0, 0.0, 1e-3));
    refuse(&volume, (const int[]){4}, 1, 0.0, "no voxel has the label 4; all have the label 0");
    volume.label[3] = 5;
    volume.label[9] = -2;
    volume.label[7] = 11;
    refuse(&volume, (const int[]){5, 4}, 2, 0.0,
           "no voxel has the label 4; the labels there are -2, 5, 11");
    for (int v = 0; v < 20; v++)
        volume.label[v] = 100 - v;
    refuse(&volume, (const int[]){4}, 1, 0.0,
           "no voxel has the label 4; the labels there are 81, 82, 83, 84, 85, 86, 87, 88, 89, 90, "
           "91, 92 and more");
    refuse(&volume, (const int[]){90, 91, 90}, 3, 0.0, "label 90 is named twice");
    refuse(&volume, (const int[]){90}, 0, 0.0, "0 labels, outside [1, 255]");
    refuse(&volume, (const int[]){90}, 1, -1.0, "cells of -1 m are not possible");
    refuse(&volume, (const int[]){90}, 1, (double)INFINITY, "cells of inf m are not possible");
    refuse(&volume, (const int[]){90}, 1, 1e-9,
           "cells of 1e-09 m make 1e+18, void ones counted, more than 268435456; a size of 1.6e-06 "
           "m would do");
    // Two voxels far from one another, and no cell's centre in either.
    memset(volume.label, 0, 40 * sizeof *volume.label);
    volume.label[0] = volume.label[19] = 1;
    refuse(&volume, (const int[]){1}, 1, 8e-3,
           "no centre of a cell of 0.008 m lies in a voxel with its labels; smaller cells would");
    for (int a = 0; a < 3; a++)
        volume.axis[a] = vec3_scale(1e6, volume.axis[a]);
    refuse(&volume, (const int[]){1}, 1, 0.0,
           "measures 20000 m, outside [1e-06, 10000] m: its spacing is in other units than it "
           "says, or scale is wrong");
    for (int a = 0; a < 3; a++)
        volume.axis[a] = vec3_scale(1e-11, volume.axis[a]);
    refuse(&volume, (const int[]){1}, 1, 0.0,
           "measures 2e-07 m, outside [1e-06, 10000] m: its spacing is in other units than it "
           "says, or scale is wrong");
    volume_destroy(&volume);
    volume = make_volume(260, 260, 260, vec3(1e-3, 0.0, 0.0), vec3(0.0, 1e-3, 0.0),
                         vec3(0.0, 0.0, 1e-3));
    for (int v = 0; v < 260 * 260 * 260; v++)
        volume.label[v] = 1;
    refuse(&volume, (const int[]){1}, 1, 0.0,
           "cells of 0.001 m make 1.758e+07, more than 16777216; a size of 0.0011 m would do");
    SCOPED(lattice_destroy) Lattice lattice;
    make_lattice(&volume, (const int[]){1}, 1, 0.0011, &lattice);
}

// --- bodies ---

static void make_body(const VoxelSource *source, Lattice *lattice)
{
    Status status = {0};
    expect_ok(body_voxels_make(source, lattice, &status), status);
}

static void refuse_body(const VoxelSource *source, const char *text)
{
    Lattice lattice;
    Status status = {0};
    assert_false(body_voxels_make(source, &lattice, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    size_t skip = source->file != NULL ? strlen(source->file) : 0;
    assert_string_equal(status.text + skip, text);
    assert_null(lattice.label);
}

TEST(body_of_a_volume_stands_where_it_is_put)
{
    static const char text[] =
        "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 3 2 2\nencoding: ascii\n"
        "space: LPS\nspace directions: (2,0,0) (0,2,0) (0,0,2)\n"
        "space origin: (1,1,1)\n\n0 1 1  0 1 0  0 0 0  0 0 2\n";
    scratch_write(&scratch_space, "organ", text, sizeof text - 1);
    VoxelSource source = {.kind = VOXELS_FILE,
                          .file = path,
                          .label_count = 1,
                          .label = {1},
                          .scale = 2.0,
                          .rotation = {0.0, 0.0, 0.5 * 3.14159265358979323846},
                          .translation = {0.1, 0.2, 0.3}};
    Lattice lattice;
    make_body(&source, &lattice);
    assert_int_equal(lattice_solid(&lattice), 3);
    expect_near(lattice.size, 4e-3, 1e-18);
    // The low corner of voxel (1, 0, 0) at (2, 0, 0) mm, twice, then a quarter turn, then moved.
    expect_near(lattice.origin.x, 0.1, 1e-16);
    expect_near(lattice.origin.y, 0.204, 1e-16);
    expect_near(lattice.origin.z, 0.3, 1e-16);
    lattice_destroy(&lattice);
    source.size = 1e-3; // in the world, whatever the scale
    source.label_count = 2;
    source.label[1] = 2;
    make_body(&source, &lattice);
    expect_near(lattice.size, 1e-3, 0.0);
    assert_int_equal(lattice_solid(&lattice), 4 * 64);
    assert_int_equal(lattice_pieces(&lattice), 2); // warned of, and kept
    lattice_destroy(&lattice);
    source.label[1] = 3;
    refuse_body(&source, ": no voxel has the label 3; the labels there are 1, 2");
    source.scale = 0.0;
    refuse_body(&source, ": scale 0 is not positive");
    source.scale = 1e9;
    source.label_count = 1;
    refuse_body(&source, ": measures 4e+06 m, outside [1e-06, 10000] m: its spacing is in other "
                         "units than it says, or scale is wrong");
    scratch_write(&scratch_space, "organ", "NRRD", 4);
    refuse_body(&source, ": its NRRD header has no field 'type'");
}

TEST(body_is_made_of_the_layer_that_has_most_of_its_labels_or_was_chosen)
{
    // Label 1 has one voxel in the first layer and three in the second, label 2 one in the third.
    static const char text[] =
        "NRRD0005\ntype: uchar\ndimension: 4\nsizes: 3 2 2 1\nkinds: list domain domain domain\n"
        "encoding: ascii\nspace: LPS\nspace directions: none (2,0,0) (0,2,0) (0,0,2)\n\n"
        "1 1 0  0 1 0  0 1 2  0 0 0\n";
    scratch_write(&scratch_space, "organ", text, sizeof text - 1);
    static const struct {
        int label, layer, cells;
    } cases[] = {{1, 0, 3}, {1, 1, 1}, {1, 2, 3}, {2, 0, 1}, {2, 3, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        VoxelSource source = {.kind = VOXELS_FILE,
                              .file = path,
                              .label_count = 1,
                              .label = {cases[i].label},
                              .layer = cases[i].layer,
                              .scale = 1.0};
        Lattice lattice;
        make_body(&source, &lattice);
        assert_int_equal(lattice_solid(&lattice), cases[i].cells);
        lattice_destroy(&lattice);
    }
    VoxelSource source = {
        .kind = VOXELS_FILE, .file = path, .label_count = 1, .label = {2}, .scale = 1.0};
    source.layer = 1;
    refuse_body(&source, ": no voxel has the label 2; the labels there are 1");
    source.layer = 4;
    refuse_body(&source, ": layer 4 outside [1, 3]");
}

#define TETRAHEDRON "v 0 0 0\nv 8 0 0\nv 0 8 0\nv 0 0 8\nf 1 3 2\nf 1 2 4\nf 1 4 3\n"

TEST(body_of_a_mesh_stands_where_it_is_put)
{
    scratch_write(&scratch_space, "organ", TETRAHEDRON "f 2 3 4\n",
                  strlen(TETRAHEDRON "f 2 3 4\n"));
    VoxelSource source = {.kind = VOXELS_MESH,
                          .file = path,
                          .size = 1e-3,
                          .scale = 0.01,
                          .translation = {1.0, 2.0, 3.0}};
    Lattice lattice;
    make_body(&source, &lattice);
    // Exactly 80^3 / 6 cells' volume; the centres of three layers at most on the slanted side are
    // within or not.
    expect_near((double)lattice_solid(&lattice), 512000.0 / 6.0, 80.0 * 80.0 / 2.0);
    expect_near(lattice.origin.x, 1.0, 1e-14);
    expect_near(lattice.origin.y, 2.0, 1e-14);
    expect_near(lattice.origin.z, 3.0, 1e-14);
    lattice_destroy(&lattice);
    source.size = 1.0;
    refuse_body(&source, ": no centre of a cell of 1 m is inside the mesh; smaller cells would be");
    source.scale = 1e-9;
    refuse_body(&source, ": measures 8e-09 m after scale 1e-09, outside [1e-06, 10000] m; scale is "
                         "metres a unit of the file, 0.001 for millimetres");
    source.scale = 0.01;
    source.size = 1e-3;
    scratch_write(&scratch_space, "organ", TETRAHEDRON, strlen(TETRAHEDRON));
    refuse_body(&source,
                ": the mesh is not closed: no other triangle borders the one at the edge "
                "between nodes 2 and 1, so it has no inside; MeshLab's Close Holes gives it one");
}

TEST(generated_bodies_stand_where_they_are_put)
{
    VoxelSource source = {.kind = VOXELS_BOX,
                          .count = {4, 2, 6},
                          .size = 0.5,
                          .radius = 8.0,
                          .scale = 2.0,
                          .translation = {1.0, 2.0, 3.0}};
    Lattice lattice;
    make_body(&source, &lattice);
    assert_int_equal(lattice_solid(&lattice), 48);
    expect_near(lattice.size, 1.0, 0.0);
    expect_near(lattice.origin.x, -1.0, 0.0);
    expect_near(lattice.origin.y, 1.0, 0.0);
    expect_near(lattice.origin.z, 0.0, 0.0);
    lattice_destroy(&lattice);
    source.kind = VOXELS_BALL;
    make_body(&source, &lattice);
    assert_int_equal(lattice_solid(&lattice), 17256);
    lattice_destroy(&lattice);
    source.kind = VOXELS_DISC;
    make_body(&source, &lattice);
    assert_int_equal(lattice_solid(&lattice), 812);
    lattice_destroy(&lattice);
    source.size = -1.0;
    refuse_body(&source, "a radius of 8 m in cells of -1 m is not possible");
}
