// SPDX-License-Identifier: MIT
// Scenes that can be simulated and that hardly anybody means: pliantd says the number, its line and
// the likely cause, once, and says nothing of scenes that are as they should be.
#include "test.h"
#include "harness.h"

#include <dirent.h>

// A cube of 4 mm cells, a wall and a probe, as they should be; line 1 is the scene's, line 2 the
// solid's, line 3 the wall's, line 4 the tool's. Each case replaces one text by another.
static const char GOOD[] =
    "rate_hz = 1000.0; gravity = [0.0, 0.0, -9.81]; bodies = (\n"
    "{ name = \"solid\"; model = \"voxel\"; voxels = { generator = \"box\"; count = [8, 8, 8]; "
    "size = 0.01; }; material = { density = 1050.0; youngs_modulus = 5000.0; }; fixed = ( { box = "
    "([-9e5, -9e5, -9e5], [9e5, 9e5, -0.0399]); } ); },\n"
    "{ name = \"wall\"; mesh = { generator = \"ico_sphere\"; nodes = 42; radius = 0.04; }; "
    "material "
    "= { youngs_modulus_2d = 80.0; areal_density = 4.2; }; shape = { frame = \"world\"; }; } ); "
    "tools = (\n"
    "{ id = 1; kind = \"probe\"; capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.0, 0.0, 0.1]; "
    "radius = 0.005; } ); } );\n";

static Process run;

// Runs --check on GOOD with `from` replaced, and expects so many warnings.
static void check(const char *from, const char *to, int warnings)
{
    char text[4096];
    const char *path = scratch("scene.cfg"), *at = strstr(GOOD, from);
    assert_non_null(at);
    snprintf(text, sizeof text, "%.*s%s%s", (int)(at - GOOD), GOOD, to, at + strlen(from));
    write_text(path, text);
    run_daemon_well(&run, "--check %s", path);
    int found = 0;
    for (const char *line = run.err; (line = strstr(line, "warning: ")) != NULL; line++)
        found++;
    if (found != warnings)
        fail_msg("'%s': %d warnings, expected %d:\n%s", to, found, warnings, run.err);
}

TEST(an_ordinary_scene_is_not_warned_of)
{
    check("name", "name", 0);
    check("rate_hz = 1000.0;",
          "rate_hz = 1000.0; loads = ( { center = [0.0, 0.0, 0.04]; radius = 0.01; force = [0.0, "
          "0.0, 1.0]; duration = 1.0; } );",
          0);
}

TEST(implausible_numbers_are_warned_of_once_with_line_and_cause)
{
    static const struct {
        const char *from, *to, *says;
    } cases[] = {
        {"-9.81", "-9810.0", "scene.cfg:1: gravity is 9810 m/s2: is it in mm/s2?"},
        {"rate_hz = 1000.0", "rate_hz = 10.0", "scene.cfg:1: a tick is 0.1 s long"},
        {"size = 0.01", "size = 10.0",
         "scene.cfg:2: body \"solid\" measures 80 m and weighs 5.38e+05 t: are its lengths in "
         "millimetres?"},
        {"count = [8, 8, 8]; size = 0.01", "count = [8, 8, 8]; size = 1e-5",
         "scene.cfg:2: body \"solid\" measures 0.08 mm"},
        {"size = 0.01", "size = 0.1", "scene.cfg:2: body \"solid\" weighs 538 kg"},
        {"count = [8, 8, 8]; size = 0.01; };",
         "count = [8, 1, 8]; size = 0.01; }; levels = { surface = 2; };",
         "scene.cfg:2: body \"solid\" hardly gains by levels.surface: it has 64 elements "
         "untouched, "
         "64 with all of its surface fine"},
        {"density = 1050.0", "density = 1.05",
         "scene.cfg:2: body \"solid\" has a density of 1.05 kg/m3: is it in g/cm3?"},
        {"youngs_modulus = 5000.0", "youngs_modulus = 5.0",
         "scene.cfg:2: body \"solid\" has a youngs_modulus of 5 Pa: is it in kPa?"},
        {"areal_density = 4.2", "areal_density = 1050.0",
         "scene.cfg:3: body \"wall\" has an areal_density of 1050 kg/m2: is it a density?"},
        {"youngs_modulus_2d = 80.0", "youngs_modulus_2d = 0.08",
         "scene.cfg:3: body \"wall\" has a youngs_modulus_2d of 0.08 N/m: is it in kPa?"},
        {"youngs_modulus_2d = 80.0", "youngs_modulus_2d = 5e3; damping_time = 1e-4",
         "scene.cfg:3: body \"wall\" has a youngs_modulus_2d of 5000 N/m: is it in Pa? "
         "youngs_modulus_2d is that times the wall's thickness in m"},
        {"areal_density = 4.2; }; shape = { frame = \"world\"; };",
         "areal_density = 4.2; damping_time = 0.0; }; shape = { frame = \"world\"; damping_ratio = "
         "0.0; };",
         "scene.cfg:3: body \"wall\" has no damping: once crumpled it gains energy without end by "
         "leapfrog, which material = { damping_time = 2e-05; } prevents: integrator = \"rk4\" "},
        {"density = 1050.0;", "density = 1050.0; damping = 0.0;",
         "scene.cfg:2: body \"solid\" has no damping: once crumpled it gains energy without end by "
         "symplectic_euler, which material = { damping = 0.2; } prevents: that is its default"},
        {"frame = \"world\"", "frame = \"body\"",
         "scene.cfg:3: body \"wall\" has no support and falls 4.91 m in its first second"},
        {"-0.0399]); } )", "-0.0399]); } ); time_step = 1e-6",
         "scene.cfg:2: body \"solid\" takes 1000 substeps a tick, by estimate"},
        {"frame = \"world\"; };", "frame = \"world\"; }; theta = 0.6;",
         "scene.cfg:3: theta has no effect: the integrator is not \"implicit\""},
        // a ball of 2 m, and one of 2 mm
        {"radius = 0.04;", "radius = 1.0;",
         "scene.cfg:3: body \"wall\" measures 2 m and weighs 49 kg: is a length in other units "
         "than m, or a diameter given as radius?"},
        {"size = 0.01", "size = 0.00025",
         "scene.cfg:2: body \"solid\" measures 2 mm and weighs 8.4 mg: were its lengths"},
        {"radius = 0.005", "radius = 5e-6",
         "scene.cfg:4: tool 1 has a radius of 5e-06 m: were its"},
        {"rate_hz = 1000.0;",
         "rate_hz = 1000.0; loads = ( { center = [0.0, 0.0, 40.0]; radius = 0.01; force = [0.0, "
         "0.0, 1.0]; duration = 1.0; } );",
         "scene.cfg:1: the load has no node within 0.01 m of (0, 0, 40)"},
        {"size = 0.01; };",
         "size = 0.01; }; levels = { surface = 2; fine = ( { sphere = [0.0, 0.0, 40.0]; radius = "
         "0.01; }, { sphere = [0.0, 0.0, 0.045]; radius = 0.01; } ); };",
         "scene.cfg:2: levels.fine: the ball of 0.01 m around (0, 0, 40) misses body \"solid\""},
        {"radius = 0.005", "radius = 5.0",
         "scene.cfg:4: tool 1 has a radius of 5 m: is it in millimetres?"},
        {"to = [0.0, 0.0, 0.1]", "to = [0.0, 0.0, 100.0]", "scene.cfg:4: tool 1 is 100 m long"},
        {"radius = 0.005", "radius = 0.02",
         "scene.cfg:4: tool 1 is 40 mm wide, 0.5 times the size of body \"solid\" (80 mm)"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        check(cases[i].from, cases[i].to, 1);
        expect_in(run.err, cases[i].says);
    }
}

TEST(a_mesh_in_millimetres_is_told_the_scale_that_mends_it)
{
    const char *scene = scratch("millimetres.cfg");
    write_text(scratch("organ.obj"), "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\n"
                                     "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    write_text(scene, "bodies = ( {\n name = \"organ\"; mesh = { file = \"organ.obj\"; }; } );\n");
    run_daemon_well(&run, "--check %s", scene);
    assert_non_null(
        strstr(run.err, "millimetres.cfg:1: body \"organ\" measures 100 m and weighs "));
    expect_in(run.err, "is its file in millimetres? mesh = { scale = 0.001; }");
}

TEST(what_is_no_scene_is_told_the_command_that_makes_one)
{
    static const struct {
        const char *name, *says;
    } files[] = {{"organ.stl", "is a mesh, not a scene; pliant-prepare --propose "},
                 {"organ.OBJ", "is a mesh, not a scene; pliant-prepare --propose "},
                 {"labels.seg.nrrd", "labels.seg.nrrd -o labels.cfg writes a scene for it"},
                 {"labels.nii.gz", "is a volume, not a scene; pliant-prepare --propose "},
                 {"run.h5", "--prepared or --resume "}};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        run_daemon(&run, "--check %s", scratch(files[i].name));
        expect_in(run.err, "No such file");
        write_text(scratch(files[i].name), "solid organ\n facet normal 0 0 1\n");
        run_daemon(&run, "--check %s", scratch(files[i].name));
        expect_code(&run, 2);
        expect_in(run.err, files[i].says);
    }
    // A scene may have any name.
    write_text(scratch("scene.stl"), GOOD);
    run_daemon_well(&run, "--check %s", scratch("scene.stl"));
}

#if defined(PLIANT_WITH_SURFACE) && defined(PLIANT_WITH_VOXEL)
// A block of labels from 20 to 40 mm in x and y, and a tetrahedron that is in it, or in what is
// there turned by 180 degrees about z, with the header that says so or without.
TEST(a_mesh_in_another_frame_than_the_labels_is_turned_or_warned_of)
{
    static const struct {
        const char *head;
        int sign, move, warnings;
        const char *says;
    } cases[] = {
        {"# 3D Slicer output. SPACE=LPS\n", 1, 0, 0, NULL},
        {"# 3D Slicer output. SPACE=RAS\n", -1, 0, 0, NULL},
        {"", 1, 0, 0, NULL},
        {"", 1, 200, 0, NULL}, // elsewhere, but not because of a frame
        {"", -1, 0, 1,
         "body \"wall\" misses body \"block\", but would not if it were turned by "
         "180 degrees about z: its mesh states no frame, labels are read in LPS"},
        {"# SPACE=RAS\n", 1, 0, 1, "its mesh states RAS and was turned to LPS, labels are read in"},
    };
    const char *scene = scratch("frames.cfg");
    char text[1024];
    size_t used = (size_t)snprintf(text, sizeof text,
                                   "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\n"
                                   "space: LPS\nspace directions: (5,0,0) (0,5,0) (0,0,5)\n"
                                   "space origin: (22.5,22.5,2.5)\nencoding: ascii\n\n");
    for (int v = 0; v < 64; v++)
        used += (size_t)snprintf(text + used, sizeof text - used, "1 ");
    write_text(scratch("labels.nrrd"), text);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const int low = cases[i].sign * 22 + cases[i].move, high = low + cases[i].sign * 15;
        snprintf(text, sizeof text,
                 "%sv %d %d 2\nv %d %d 2\nv %d %d 2\nv %d %d 17\nf 1 3 2\nf 1 2 4\nf 2 3 4\n"
                 "f 3 1 4\n",
                 cases[i].head, low, low, high, low, low, high, low, low);
        write_text(scratch("wall.obj"), text);
        write_text(scene,
                   "gravity = [0.0, 0.0, 0.0]; bodies = ( { name = \"block\"; model = \"voxel\"; "
                   "voxels = { file = \"labels.nrrd\"; }; },\n{ name = \"wall\"; "
                   "mesh = { file = \"wall.obj\"; scale = 0.001; }; } );\n");
        run_daemon_well(&run, "--check %s", scene);
        int found = 0;
        for (const char *at = run.err; (at = strstr(at, " misses body ")) != NULL; at++)
            found++;
        if (found != cases[i].warnings)
            fail_msg("case %zu: %d warnings:\n%s", i, found, run.err);
        if (cases[i].says != NULL)
            expect_in(run.err, cases[i].says);
    }
    // A skin has to be where the labels are: refused, after the likely cause.
    write_text(scene, "bodies = ( { name = \"block\"; model = \"voxel\"; voxels = { file = "
                      "\"labels.nrrd\"; }; skin = { mesh = \"wall.obj\"; scale = 0.001; }; } );\n");
    run_daemon(&run, "--check %s", scene);
    assert_int_equal(run.code, 2);
    expect_in(run.err, "the skin of body \"block\" does not overlap its labels: ");
    expect_in(run.err, "wall.obj states RAS and was turned to LPS, labels are read in LPS\n");
}
#endif

TEST(a_body_without_gravity_is_warned_of_where_a_probe_can_push_it)
{
    const char *scene = scratch("floating.cfg");
    static const char *const tools[] = {
        "", "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 0.005; } ); } );\n"};
    for (int i = 0; i < 2; i++) {
        char text[512];
        snprintf(text, sizeof text,
                 "gravity = [0.0, 0.0, 0.0]; bodies = ( { name = \"ball\";\n"
                 "mesh = { generator = \"ico_sphere\"; nodes = 42; }; } );\n%s",
                 tools[i]);
        write_text(scene, text);
        run_daemon_well(&run, "--check %s", scene);
        bool said = strstr(run.err, "body \"ball\" has no support: 1 probe will push it away");
        assert_int_equal(said, i == 1);
    }
}

// Live and offline too, and a run goes on all the same.
TEST(a_run_warns_as_the_check_does)
{
    check("-9.81", "-9810.0", 1);
    run_daemon_well(&run, "--offline 0.01 %s", scratch("scene.cfg"));
    expect_in(run.err, "gravity is 9810 m/s2");
}

TEST(no_scene_of_ours_is_warned_of)
{
    DIR *folder = opendir(test_argument(2));
    assert_non_null(folder);
    int looked_at = 0;
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        const char *end = strrchr(entry->d_name, '.');
        if (end == NULL || strcmp(end, ".cfg") != 0)
            continue;
        run_daemon_well(&run, "--check %s/%s", test_argument(2), entry->d_name);
        if (strstr(run.err, ".cfg:") != NULL)
            fail_msg("%s: %s", entry->d_name, run.err);
        looked_at++;
    }
    closedir(folder);
    assert_true(looked_at >= 15);
}

// What a tick takes is measured: a scene with a hundredth of its time to spare fits, one with a
// tenth of the time that it needs does not, whatever the machine does besides.
TEST(the_time_of_a_tick_has_a_verdict)
{
    static const struct {
        const char *rate, *nodes, *more, *says;
    } cases[] = {
        {"10.0", "42", "", ": fits\n"},
        {"10000.0", "10242", "material = { youngs_modulus_2d = 1e5; };", ": misses: try "},
        {"10.0", "42", "levels = 1; adapt = {};", "with all faces at the finest level, of 100 ms"},
        {"100.0", "42", // a hundredth of its time, ten times that once it is cut
         "levels = 4; cuttable = true; material = { youngs_modulus_2d = 2e4; };",
         "after three deep cuts, of 10 ms: misses: try "},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[1024];
        snprintf(text, sizeof text,
                 "rate_hz = %s; bodies = ( { name = \"ball\"; mesh = { generator = "
                 "\"ico_sphere\"; nodes = %s; radius = 0.05; }; shape = { }; %s } );\n",
                 cases[i].rate, cases[i].nodes, cases[i].more);
        write_text(scratch("scene.cfg"), text);
        run_daemon_well(&run, "--check %s", scratch("scene.cfg"));
        const char *line = strstr(run.out, "time of a tick on this machine: ");
        assert_non_null(line);
        expect_in(line, cases[i].says);
    }
}

// Advice is to change what the scene has.
TEST(only_a_body_in_double_precision_is_advised_to_use_single)
{
    for (int twice = 0; twice < 2; twice++) {
        char text[512];
        snprintf(text, sizeof text,
                 "rate_hz = 10000.0; precision = \"%s\"; bodies = ( { name = \"ball\"; mesh = { "
                 "generator = \"ico_sphere\"; nodes = 10242; }; material = { youngs_modulus_2d = "
                 "1e5; }; } );\n",
                 twice ? "double" : "single");
        write_text(scratch("scene.cfg"), text);
        run_daemon(&run, "--check %s", scratch("scene.cfg"));
        const char *line = strstr(run.out, ": misses: try ");
        assert_non_null(line);
        assert_int_equal(strstr(line, "precision = \"single\"") != NULL, twice);
    }
}

TEST(only_a_solid_that_does_not_adapt_is_advised_to)
{
    for (int adapts = 0; adapts < 2; adapts++) {
        char text[512];
        // Stiff, so that neither has the time.
        snprintf(text, sizeof text,
                 "rate_hz = 10000.0; bodies = ( { name = \"box\"; model = \"voxel\"; voxels = { "
                 "generator = \"box\"; count = 24; }; material = { youngs_modulus = 1e8; }; levels "
                 "= %s; } );\n",
                 adapts ? "{ surface = 1; }" : "2");
        write_text(scratch("scene.cfg"), text);
        run_daemon(&run, "--check %s", scratch("scene.cfg"));
        const char *line = strstr(run.out, ": misses: try ");
        assert_non_null(line);
        assert_int_equal(strstr(line, "surface = 2; }") != NULL, !adapts);
    }
}
