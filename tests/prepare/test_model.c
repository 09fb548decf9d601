// SPDX-License-Identifier: MIT
// pliant-prepare SCENE.cfg -o FILE and pliantd --prepared FILE as a user runs them, one process
// after the other.
#include "test.h"
#include "harness.h"

#include <hdf5.h>
#include <string.h>

static const char SCENE[] =
    "gravity = [0, 0, -9.81]; bodies = ( { name = \"organ\"; mesh = { generator = \"stomach\"; };\n"
    "shape = {}; levels = 2; start_level = 1; } );\n";

// Positions in a checkpoint, malloc'ed.
static double *read_positions(const char *name, size_t *bytes)
{
    hid_t file = H5Fopen(scratch(name), H5F_ACC_RDONLY, H5P_DEFAULT);
    hid_t set = H5Dopen2(file, "/bodies/organ/position", H5P_DEFAULT);
    assert_true(set >= 0);
    *bytes = (size_t)H5Dget_storage_size(set);
    double *data = malloc(*bytes + 1);
    assert_non_null(data);
    assert_true(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
    H5Dclose(set);
    H5Fclose(file);
    return data;
}

TEST(daemon_runs_alike_from_the_prepared_model)
{
    Process result;
    write_text(scratch("x.cfg"), SCENE);
    process_run(&result, program_path("pliant-prepare"), "x.cfg -o x.h5");
    assert_string_equal(result.err, "");
    assert_int_equal(result.code, 0);
    assert_string_equal(
        result.out, "body organ: 188 nodes, 372 faces; finest level 2: 2978 nodes, 5952 faces\n");
    run_daemon(&result, "--offline 0.05 --checkpoint made.h5 x.cfg");
    assert_int_equal(result.code, 0);
    run_daemon(&result, "--offline 0.05 --checkpoint read.h5 --prepared x.h5 x.cfg");
    assert_int_equal(result.code, 0);
    size_t one_size = 0, two_size = 0;
    double *one = read_positions("made.h5", &one_size), *two = read_positions("read.h5", &two_size);
    assert_int_equal(one_size, 746 * 3 * sizeof *one); // level 1
    assert_int_equal(two_size, one_size);
    assert_memory_equal(one, two, one_size);
    free(one);
    free(two);
    // A checkpoint of either goes on from the other.
    run_daemon(&result, "--offline 0.05 --resume made.h5 --prepared x.h5 x.cfg");
    assert_int_equal(result.code, 0);
}

TEST(daemon_refuses_what_does_not_fit_in_one_line)
{
    Process result;
    size_t size = 0;
    write_text(scratch("x.cfg"), SCENE);
    process_run(&result, program_path("pliant-prepare"), "x.cfg -o x.h5");
    assert_int_equal(result.code, 0);
    unsigned char *data = file_read(scratch("x.h5"), &size);
    data[size / 2] ^= 1;
    file_write(scratch("bad.h5"), data, size);
    free(data);
    run_daemon(&result, "--check --prepared bad.h5 x.cfg");
    assert_int_equal(result.code, 2);
    assert_string_equal(
        result.err,
        "bad.h5: is truncated or was altered: it differs from its seal; write it again\n");
    run_daemon(&result, "--check --prepared none.h5 x.cfg");
    assert_int_equal(result.code, 2);
    assert_string_equal(result.err, "none.h5: No such file or directory\n");
    run_daemon(&result, "--offline 0.01 --checkpoint c.h5 x.cfg");
    run_daemon(&result, "--check --prepared c.h5 x.cfg");
    assert_int_equal(result.code, 2);
    assert_string_equal(result.err,
                        "c.h5: / format \"pliant-checkpoint\" must be \"pliant-prepared\"\n");
}

TEST(a_file_that_cannot_be_written_exits_1)
{
    Process result;
    write_text(scratch("x.cfg"), SCENE);
    process_run(&result, program_path("pliant-prepare"), "x.cfg -o none/x.h5");
    assert_int_equal(result.code, 1);
    assert_string_equal(result.err, "none/x.h5: No such file or directory\n");
}

#if WITH_VOXEL
// What is proposed is a scene that pliantd takes without a warning, with figures as they were said.
TEST(a_proposed_scene_is_one_that_the_daemon_takes)
{
    static const char BOX[] = "v 0 0 0\nv 250 0 0\nv 250 150 0\nv 0 150 0\nv 0 0 100\nv 250 0 100\n"
                              "v 250 150 100\nv 0 150 100\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\n"
                              "f 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    static const struct {
        const char *options, *says, *figures;
    } cases[] = {
        {"", "p.cfg: a scene with it as a wall\n", "model surface, leapfrog\n  nodes 8 (4 fixed)"},
        {"--model voxel", "p.cfg: a scene with it as a solid\n", "model voxel, symplectic_euler\n"},
        {"--scale 0.0005 --model voxel", "p.cfg: a scene with it as a solid\n", "to [0.12"},
    };
    const char *name = "bo\"x \\1.obj"; // quotes and backslashes come through
    write_text(scratch(name), BOX);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Process result;
        char arguments[256];
        snprintf(arguments, sizeof arguments, "--propose %s 'bo\"x \\1.obj' -o p.cfg",
                 cases[i].options);
        process_run(&result, program_path("pliant-prepare"), "%s", arguments);
        assert_string_equal(result.err, "");
        assert_int_equal(result.code, 0);
        assert_non_null(strstr(result.out, cases[i].says));
        assert_non_null(strstr(result.out, "  as a wall: yes, "));
        run_daemon(&result, "--check p.cfg");
        assert_int_equal(result.code, 0);
        if (strstr(result.out, cases[i].figures) == NULL)
            fail_msg("'%s' is not in: %s%s", cases[i].figures, result.out, result.err);
        assert_null(strstr(result.err, "p.cfg:")); // no warning
        // A scene that is there stays as it is.
        process_run(&result, program_path("pliant-prepare"), "%s", arguments);
        assert_int_equal(result.code, 2);
        assert_non_null(strstr(result.err, "p.cfg: File exists"));
        remove(scratch("p.cfg"));
    }
}

// A file of two labels: which is taken without a key is said, and nothing where the scene names
// one.
TEST(a_label_that_no_key_names_is_said)
{
    static const char LABELS[] =
        "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 2 2\nencoding: ascii\n"
        "spacings: 10 10 10\n\n1 1 2 2  1 1 2 2  1 1 2 2  1 1 2 2\n";
    static const char *const said = "two.nrrd: label 1 of 2 was taken, as none is given";
    write_text(scratch("two.nrrd"), LABELS);
    for (int named = 0; named < 2; named++) {
        Process result;
        char scene[256];
        snprintf(
            scene, sizeof scene,
            "bodies = ( { name = \"a\"; model = \"voxel\"; voxels = { file = \"two.nrrd\"; %s }; "
            "fixed = ( { box = ([-1, -1, -1], [1, 1, 0]); } ); } );\n",
            named ? "label = 1;" : "");
        write_text(scratch("two.cfg"), scene);
        run_daemon(&result, "--check two.cfg");
        assert_int_equal(result.code, 0);
        assert_int_equal(strstr(result.err, said) != NULL, !named);
    }
}

TEST(every_piece_of_a_proposed_solid_is_held)
{
    // Two tetrahedra of 10 cm, one high above the other.
    static const char PAIR[] = "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\nv 0 0 200\nv 100 0 200\n"
                               "v 0 100 200\nv 0 0 300\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
                               "f 5 7 6\nf 5 6 8\nf 6 7 8\nf 7 5 8\n";
    Process result;
    write_text(scratch("pair.obj"), PAIR);
    process_run(&result, program_path("pliant-prepare"),
                "--propose --units mm --model voxel pair.obj -o pair.cfg");
    assert_int_equal(result.code, 0);
    assert_non_null(strstr(result.out, "in 2 pieces, each of which something has to hold"));
    size_t size = 0;
    char *scene = (char *)file_read(scratch("pair.cfg"), &size);
    int regions = 0;
    for (const char *at = scene; (at = strstr(at, "{ box = (")) != NULL; at++)
        regions++;
    free(scene);
    assert_int_equal(regions, 2);
    run_daemon(&result, "--check pair.cfg");
    assert_int_equal(result.code, 0);
}
#endif
