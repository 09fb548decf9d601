// SPDX-License-Identifier: MIT
// Lattices in prepared files: read back as they were made, and refused when they were made from
// something else, are damaged or do not fit.
#include "test.h"
#include "world_run.h"

#include "scene/build_parts.h"
#include "scene/prepared.h"

#ifdef PLIANT_WITH_HDF5
#include "recording_view.h"

// Prepares a.h5; returns what was printed, for the caller to free.
static char *prepare(const char *text)
{
    char path[SCRATCH_PATH], *printed = NULL;
    size_t size;
    SCOPED(scene_destroy) Scene scene;
    Status status = {0};
    FILE *report = open_memstream(&printed, &size);
    read_scene(text, &scene);
    unlink(scratch_path(&scratch_space, "a.h5", path)); // what was altered is not replaced
    expect_ok(prepared_write(path, &scene, report, &status), status);
    fclose(report);
    return printed;
}

// Reads the lattice of the scene's first body from a.h5; returns what was wrong, "" if nothing.
static const char *read_back(const char *text, Lattice *lattice)
{
    Scene scene;
    Status status = {0};
    Prepared *prepared;
    *lattice = (Lattice){0};
    read_scene(text, &scene);
    bool ok = prepared_open(&prepared, scratch_at("a.h5"), &status) &&
              prepared_read_voxels(prepared, &scene.body[0], lattice, &status);
    assert_int_equal(ok, status.code == STATUS_OK);
    prepared_close(prepared);
    if (!ok)
        lattice_destroy(lattice);
    scene_destroy(&scene);
    return without_folder(&status);
}

static void expect_refusal(const char *text, const char *said)
{
    Lattice lattice;
    assert_string_equal(read_back(text, &lattice), said);
}

#define SCENE(voxels)                                                                              \
    "bodies = (\n{ name = \"a\"; model = \"voxel\"; voxels = { " voxels " }; } );\n"
#define OTHER_SOURCE                                                                               \
    "a.h5: /bodies/a was prepared from another source of voxels than this scene's: prepare it "    \
    "again"
#define BALL   "generator = \"ball\"; radius = 0.01; size = 0.0025; "
#define VOLUME "file = \"v.nrrd\"; label = [4, 2]; "

// Four cells in a row: void, 2, 4, 4.
static void write_volume(const char *comment)
{
    char text[512];
    int length = snprintf(text, sizeof text,
                          "NRRD0004\n%stype: uint8\ndimension: 3\n"
                          "space: left-posterior-superior\nsizes: 4 1 1\n"
                          "space directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (0,0,0)\n"
                          "encoding: ascii\n\n0 2 4 4\n",
                          comment);
    scratch_write(&scratch_space, "v.nrrd", text, (size_t)length);
}

static void expect_as_made(const char *text)
{
    SCOPED(scene_destroy) Scene scene;
    Status status = {0};
    SCOPED(lattice_destroy) Lattice made = {0}, read;
    free(prepare(text));
    read_scene(text, &scene);
    assert_true(body_voxels_make(&scene.body[0].voxels, &made, &status));
    assert_string_equal(read_back(text, &read), "");
    assert_memory_equal(made.count, read.count, sizeof made.count);
    assert_memory_equal(&made.size, &read.size, sizeof made.size);
    assert_memory_equal(&made.origin, &read.origin, sizeof made.origin);
    assert_memory_equal(&made.turn, &read.turn, sizeof made.turn);
    assert_memory_equal(made.label, read.label, (size_t)lattice_index(&made, 0, 0, made.count[2]));
}

static int begin(void **unused)
{
    (void)unused;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return scratch_begin(unused);
}

AROUND_ALL(begin, scratch_end)

TEST(lattices_are_read_back_bit_for_bit)
{
    expect_as_made(SCENE(BALL));
    expect_as_made(SCENE(BALL "scale = 1.1; place = { translation = [1, 2, 3]; "
                              "rotation = [0.1, -0.2, 3]; };"));
    expect_as_made(SCENE("generator = \"box\"; count = [1, 2, 3];"));
    expect_as_made(SCENE("generator = \"disc\"; radius = 0.01;"));
    write_volume("");
    expect_as_made(SCENE(VOLUME));
}

TEST(report_says_what_was_prepared)
{
    FREED char *printed = prepare("bodies = ( { name = \"a\"; model = \"voxel\"; "
                                  "voxels = { generator = \"box\"; count = [4, 5, 6]; }; },\n"
                                  "{ name = \"b\"; model = \"voxel\"; "
                                  "voxels = { generator = \"box\"; count = 2; size = 0.5; }; } );");
    assert_string_equal(printed, "body a: 4 x 5 x 6 cells of 0.003125 m, 120 solid\n"
                                 "body b: 2 x 2 x 2 cells of 0.5 m, 8 solid\n");
}

TEST(keys_beside_voxels_may_change)
{
    SCOPED(lattice_destroy) Lattice lattice;
    free(prepare(SCENE(BALL)));
    assert_string_equal(read_back("bodies = ( { name = \"a\"; model = \"voxel\"; levels = 0;\n"
                                  "voxels = { " BALL " }; material = { density = 900; }; } );",
                                  &lattice),
                        "");
}

TEST(lattices_of_other_scenes_are_refused)
{
    static const char *const OTHERS[] = {
        SCENE("generator = \"ball\"; radius = 0.0101; size = 0.0025;"),
        SCENE("generator = \"ball\"; radius = 0.01; size = 0.00251;"),
        SCENE("generator = \"disc\"; radius = 0.01; size = 0.0025;"),
        SCENE(BALL "scale = 2;"),
        SCENE(BALL "place = { translation = [0, 0, 0.1]; };"),
        SCENE(BALL "place = { rotation = [0, 0, 0.1]; };"),
    };
    free(prepare(SCENE(BALL)));
    for (size_t i = 0; i < sizeof OTHERS / sizeof *OTHERS; i++)
        expect_refusal(OTHERS[i], OTHER_SOURCE);
    expect_refusal("bodies = ( { name = \"b\"; model = \"voxel\"; voxels = { " BALL " }; } );",
                   "a.h5: /bodies/b is missing: the file was prepared for another scene "
                   "(pliant-prepare SCENE.cfg -o FILE)");
    free(prepare(SCENE("generator = \"box\"; count = [1, 2, 3];")));
    expect_refusal(SCENE("generator = \"box\"; count = [3, 2, 1];"), OTHER_SOURCE);
}

TEST(volumes_and_labels_that_changed_are_noticed)
{
    write_volume("");
    free(prepare(SCENE(VOLUME)));
    expect_refusal(SCENE("file = \"v.nrrd\"; label = [2, 4];"), OTHER_SOURCE);
    expect_refusal(SCENE("file = \"v.nrrd\"; label = 4;"), OTHER_SOURCE);
    write_volume("# one more line is another file\n");
    expect_refusal(SCENE(VOLUME), OTHER_SOURCE);
}

// The header alone stays as it was: its voxels are in a file of their own.
TEST(voxels_beside_their_header_are_noticed_too)
{
    static const char HEADER[] = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 1 1\n"
                                 "space: left-posterior-superior\n"
                                 "space directions: (2,0,0) (0,2,0) (0,0,2)\n"
                                 "encoding: raw\ndata file: v.raw\n";
    scratch_write(&scratch_space, "v.nhdr", HEADER, sizeof HEADER - 1);
    scratch_write(&scratch_space, "v.raw", "\0\2\4\4", 4);
    expect_as_made(SCENE("file = \"v.nhdr\"; label = [4, 2];"));
    scratch_write(&scratch_space, "v.raw", "\2\2\4\4", 4);
    expect_refusal(SCENE("file = \"v.nhdr\"; label = [4, 2];"), OTHER_SOURCE);
}

#ifdef PLIANT_WITH_SURFACE
TEST(models_do_not_read_each_other)
{
    static const char SURFACE[] =
        "bodies = ( { name = \"a\"; mesh = { generator = \"sheet\"; }; } );";
    free(prepare(SURFACE));
    expect_refusal(SCENE(BALL), OTHER_SOURCE);
}
#endif

// --- damage --------------------------------------------------------------------------------------

TEST(damaged_files_are_refused_wherever_the_damage_is)
{
    Lattice lattice;
    size_t size = 0;
    free(prepare(SCENE(BALL)));
    FREED unsigned char *data = scratch_read(&scratch_space, "a.h5", &size);
    for (size_t i = 0; i < 50; i++) {
        scratch_write(&scratch_space, "a.h5", data, size * i / 50);
        assert_string_not_equal(read_back(SCENE(BALL), &lattice), "");
    }
    // An odd stride meets all parts of blocks of even size.
    for (size_t at = 0; at < size; at += size / 200 | 1) {
        data[at] ^= 0x55;
        scratch_write(&scratch_space, "a.h5", data, size);
        data[at] ^= 0x55;
        assert_string_not_equal(read_back(SCENE(BALL), &lattice), "");
    }
}

// Replaces a data set of a.h5 by another behind a right seal; data NULL: never written.
static void replace(const char *name, hid_t type, int rank, const hsize_t *shape, const void *data)
{
    hid_t file = view_change(scratch_at("a.h5"));
    assert_true(H5Ldelete(file, name, H5P_DEFAULT) >= 0);
    if (rank >= 0) {
        hid_t space = rank == 0 ? H5Screate(H5S_SCALAR) : H5Screate_simple(rank, shape, NULL);
        hid_t set = H5Dcreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        assert_true(set >= 0);
        if (data != NULL)
            assert_true(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
        H5Dclose(set);
        H5Sclose(space);
    }
    H5Fclose(file);
    scratch_seal(&scratch_space, "a.h5");
}

#define BOX SCENE("generator = \"box\"; count = [2, 2, 1];")

static void expect_part(const char *part)
{
    Lattice lattice;
    const char *said = read_back(BOX, &lattice);
    if (strncmp(said, "a.h5: /bodies/a", 15) != 0 || strstr(said, part) == NULL)
        fail_msg("\"%s\" must hold \"%s\"", said, part);
}

// The box with a data set replaced by another.
static void expect_lie(const char *name, hid_t type, int rank, const hsize_t *shape,
                       const void *data, const char *part)
{
    free(prepare(BOX));
    replace(name, type, rank, shape, data);
    expect_part(part);
}

TEST(numbers_that_do_not_fit_are_refused_behind_a_right_seal)
{
    const hsize_t one = 1, three = 3, four = 4, five = 5, rows[2] = {1, 3};
    const hsize_t huge = 1 << 28;
    static const char *const SETS[] = {"count", "label", "size", "origin", "turn"};
    char name[64];
    for (size_t i = 0; i < sizeof SETS / sizeof *SETS; i++) {
        snprintf(name, sizeof name, "/bodies/a/%s", SETS[i]);
        expect_lie(name, 0, -1, NULL, NULL, SETS[i]);
        expect_lie(name, H5T_NATIVE_UINT8, 1, &five, "\1\1\1\1\1", SETS[i]);
    }
    static const int COUNTS[][3] = {{2, 2, 0},       {4, 1, 2},         {-2, -2, 1}, {2, 1, 1},
                                    {1 << 30, 4, 1}, {65536, 65536, 1}, {4, -1, -1}};
    for (size_t i = 0; i < sizeof COUNTS / sizeof *COUNTS; i++)
        expect_lie("/bodies/a/count", H5T_NATIVE_INT, 1, &three, COUNTS[i],
                   "label has 4 cells, the lattice ");
    // Labels that the file only says it has take no memory.
    static const int MANY[3] = {1 << 14, 1 << 14, 1};
    free(prepare(BOX));
    replace("/bodies/a/count", H5T_NATIVE_INT, 1, &three, MANY);
    replace("/bodies/a/label", H5T_NATIVE_UINT8, 1, &huge, NULL);
    expect_part("label is compressed or incomplete");
    static const char *const LABELS[] = {"\0\0\0\0", "\1\1\2\1", "\1\1\377\1"};
    for (size_t i = 0; i < sizeof LABELS / sizeof *LABELS; i++)
        expect_lie("/bodies/a/label", H5T_NATIVE_UINT8, 1, &four, LABELS[i],
                   "label has no solid cell, too many, or one without a material");
    static const double SIZES[] = {0.0, -1.0, (double)NAN, HUGE_VAL};
    for (size_t i = 0; i < sizeof SIZES / sizeof *SIZES; i++)
        expect_lie("/bodies/a/size", H5T_NATIVE_DOUBLE, 0, &one, &SIZES[i], "are not possible");
    static const double ODD[] = {1e4, 1e-7}; // no organ
    for (size_t i = 0; i < sizeof ODD / sizeof *ODD; i++)
        expect_lie("/bodies/a/size", H5T_NATIVE_DOUBLE, 0, &one, &ODD[i], "size makes a body of ");
    static const double TURNS[][4] = {{0, 0, 0, 0}, {1, 1, 0, 0}, {(double)NAN, 0, 0, 0}};
    for (size_t i = 0; i < sizeof TURNS / sizeof *TURNS; i++)
        expect_lie("/bodies/a/turn", H5T_NATIVE_DOUBLE, 1, &four, TURNS[i],
                   "turn is no unit quaternion");
    static const double NOWHERE[3] = {0.0, HUGE_VAL, 0.0}, FAR[3] = {0.0, -1e300, 0.0};
    expect_lie("/bodies/a/origin", H5T_NATIVE_DOUBLE, 2, rows, NOWHERE,
               "origin row 0 is not finite");
    expect_lie("/bodies/a/origin", H5T_NATIVE_DOUBLE, 2, rows, FAR,
               "origin lies farther than 1e+12 m away");
}

TEST(sources_that_cannot_be_read_are_named)
{
    SCOPED(scene_destroy) Scene scene;
    Status status = {0};
    read_scene(SCENE("file = \"none.nrrd\";"), &scene);
    assert_false(prepared_write(scratch_at("b.h5"), &scene, stdout, &status));
    assert_string_equal(without_folder(&status), "x.cfg:2: none.nrrd: No such file or directory");
}

#endif
