// SPDX-License-Identifier: MIT
// pliant-prepare --check as a user runs it: exit codes, the report's figures against closed forms,
// and one line on stderr for what is not usable.
#include "test.h"
#include "harness.h"

#include "geometry/generator.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

static void run(Process *result, const char *arguments)
{
    process_run(result, program_path("pliant-prepare"), "%s", arguments);
}

static void write_file(const char *name, const char *text)
{
    write_text(scratch(name), text);
}

static const char CUBE[] =
    "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n"
    "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

TEST(a_cube_is_reported_with_its_figures)
{
    Process result;
    write_file("cube.obj", CUBE);
    run(&result, "--check --scale 0.01 cube.obj");
    assert_int_equal(result.code, 0);
    assert_string_equal(result.err, "");
    expect_printed(&result, "cube.obj: usable\n");
    expect_printed(&result, "file: OBJ, 8 nodes, 6 faces\n");
    expect_printed(&result, "repairs: cut 6 polygons into triangles\n");
    expect_printed(&result, "scale: 0.01 m a unit of the file, extent 0.02 m\n");
    expect_printed(&result, "nodes: 8, edges: 18, triangles: 12\n");
    expect_printed(&result,
                   "components: 1, of them closed: 1, boundary loops: 0, boundary edges: 0\n");
    expect_printed(&result, "1: nodes 8, triangles 12, closed, genus 0, volume 8e-06 m3\n");
    expect_printed(&result, "box: [0, 0, 0] to [0.02, 0.02, 0.02] m\n");
    expect_printed(&result, "area: 0.0024 m2, enclosed volume: 8e-06 m3\n");
    // 12 edges of 0.02 and 6 diagonals: mean 0.02 (12 + 6 sqrt 2) / 18
    expect_printed(&result, "edge lengths: min 0.02, mean 0.0227614, max 0.0282843 m\n");
    expect_printed(&result,
                   "angles: min 45, mean of the smallest 45, max 90 degrees; triangles with "
                   "one below 20 degrees: 0\n");
    expect_printed(&result, "stable time step");
}

// A torus of 12 x 8 quads; not closed, one ring of quads is left out.
static void write_torus(const char *name, int around, int across, bool closed)
{
    FILE *file = fopen(scratch(name), "w");
    assert_non_null(file);
    fprintf(file, "OFF\n%d %d 0\n", around * across, (closed ? around : around - 1) * across);
    for (int i = 0; i < around * across; i++) {
        double u = 6.283185307 * (i / across) / around, v = 6.283185307 * (i % across) / across;
        fprintf(file, "%.17g %.17g %.17g\n", (1.0 + 0.4 * cos(v)) * cos(u),
                (1.0 + 0.4 * cos(v)) * sin(u), 0.4 * sin(v));
    }
    for (int i = 0; i < (closed ? around : around - 1) * across; i++) {
        int a = i / across, b = (a + 1) % around, c = i % across, d = (c + 1) % across;
        fprintf(file, "4 %d %d %d %d\n", a * across + c, b * across + c, b * across + d,
                a * across + d);
    }
    fclose(file);
}

TEST(handles_and_boundaries_are_counted)
{
    Process result;
    write_torus("torus.off", 12, 8, true);
    write_torus("tube.off", 12, 8, false);
    run(&result, "--check torus.off tube.off");
#ifdef PLIANT_WITH_SURFACE // an open tube can be a wall only
    assert_int_equal(result.code, 0);
    expect_printed(&result, "tube.off: usable\n");
#endif
    expect_printed(&result, "torus.off: usable\n");
    expect_printed(&result, "1: nodes 96, triangles 192, closed, genus 1, volume ");
    expect_printed(&result, "1: nodes 96, triangles 176, open, boundary loops 2, genus 0\n");
    expect_printed(&result, "boundary loops: 2, boundary edges: 16\n");
}

#ifdef PLIANT_WITH_SURFACE
// What a regular tetrahedron of side s allows, by hand: see surface/network.c for the rule.
TEST(the_time_step_is_that_of_the_stiffest_node)
{
    Process result;
    write_file("tetrahedron.obj", "v 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 1\n"
                                  "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
    run(&result, "--check --scale 0.01 tetrahedron.obj");
    assert_int_equal(result.code, 0);
    double side = 0.01 * sqrt(8.0), area = sqrt(3.0) / 4.0 * side * side;
    double stiffness = 80.0 * 2.0 * area / (side * side); // of each edge, two faces beside it
    double mass = 4.2 * area;                             // three thirds of a face
    double w = 50.0, springs = 2.0 * 3.0 * stiffness / mass;
    double lambda = springs + w * w;
    // neither is clamped: 2e-4 s is shorter than 0.8 / sqrt(springs)
    assert_true(2e-4 < 0.8 / sqrt(springs));
    double c = 2e-4 * springs + 2.0 * 0.1 * w;
    double leapfrog = 0.9 * (sqrt(c * c + 4.0 * lambda) - c) / lambda;
    double rk4 = 0.9 * 2.6 * fmin(1.0 / sqrt(lambda), 1.0 / c);
    double found[2];
    const char *at = strstr(result.out, "no contact): rk4 ");
    assert_non_null(at);
    assert_int_equal(sscanf(at, "no contact): rk4 %lf s (%*d substeps at 1000 Hz), leapfrog %lf s",
                            &found[0], &found[1]),
                     2);
    // printed with four digits
    expect_near(found[0], rk4, 1e-3 * rk4);
    expect_near(found[1], leapfrog, 1e-3 * leapfrog);
}
#endif

TEST(what_is_not_usable_exits_2_with_one_line)
{
    Process result;
    write_file("cube.obj", CUBE);
    write_file("empty.stl", "");
    write_file("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write_file("fan.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"
                          "f 1 2 5\n");
    run(&result, "--check empty.stl");
    expect_refusal(&result, 2, "empty.stl: the file is empty");
    run(&result, "--check missing.stl");
    expect_refusal(&result, 2, "missing.stl: No such file or directory");
    run(&result, "--check nan.obj");
    expect_refusal(&result, 2, "nan.obj:4: face 0 uses node 0, whose position (0, 0, nan)");
    run(&result, "--check fan.obj");
    expect_refusal(&result, 2, "fan.obj:8: edge between nodes 0 and 1 belongs to 3 faces");
    run(&result, "--check --scale 1e6 cube.obj");
    expect_refusal(&result, 2, "cube.obj: measures 2e+06 m after scale 1e+06, outside");
    // The others are still looked at.
    run(&result, "--check nan.obj cube.obj");
    expect_refusal(&result, 2, "nan.obj:4:");
    expect_printed(&result, "cube.obj: usable\n");
}

// A box of 1 : 0.6 : 0.4 with this longest side, behind a line of text.
static void write_box(const char *name, const char *head, double side)
{
    char text[1024];
    double x = side, y = 0.6 * side, z = 0.4 * side;
    snprintf(text, sizeof text,
             "%sv 0 0 0\nv %g 0 0\nv %g %g 0\nv 0 %g 0\nv 0 0 %g\nv %g 0 %g\nv %g %g %g\n"
             "v 0 %g %g\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n",
             head, x, x, y, y, z, x, z, x, y, z, y, z);
    write_file(name, text);
}

TEST(a_unit_that_is_not_given_is_guessed_with_its_reason)
{
    static const struct {
        const char *head;
        double side;
        const char *says;
    } cases[] = {
        {"", 0.25, "scale: not given, taken as m: 0.25 of them are 250 mm, that is the size of"},
        {"", 2.5, "scale: not given, in doubt taken as dm: 2.5 of them are 250 mm"},
        {"", 25.0, "scale: not given, in doubt taken as cm: 25 of them are 250 mm"},
        {"", 250.0, "scale: not given, taken as mm: 250 of them are 250 mm, that is the size of"},
        {"", 900.0, "scale: not given, in doubt taken as mm: 900 of them are 900 mm"},
        {"", 2.5e5, "scale: not given, taken as um: 2.5e+05 of them are 250 mm"},
        {"# Units: centimeters\n", 9.0, "taken as cm: 9 of them are 90 mm, its first lines say so"},
        {"# UNITS=mm\n", 25.0, "scale: not given, taken as mm: 25 of them are 25 mm, its first"},
        {"# 3D Slicer output. SPACE=LPS\n", 25.0, "taken as mm: 25 of them are 25 mm, its first"},
        {"# 12 units, mmx\n", 25.0, "in doubt taken as cm"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Process result;
        write_box("box.obj", cases[i].head, cases[i].side);
        run(&result, "--check box.obj");
        assert_int_equal(result.code, 0);
        expect_printed(&result, cases[i].says);
    }
}

TEST(units_and_scale_are_the_same_and_end_the_guessing)
{
    Process named, scaled;
    write_box("box.obj", "", 2.5);
    run(&named, "--check --units cm box.obj");
    run(&scaled, "--check --scale 0.01 box.obj");
    assert_int_equal(named.code, 0);
    assert_string_equal(named.out, scaled.out);
    expect_printed(&named, "scale: 0.01 m a unit of the file, extent 0.025 m\n");
}

#if defined(PLIANT_WITH_SURFACE) && defined(PLIANT_WITH_VOXEL)
// An octahedron with two slivers of that width; not closed, a face is missing.
static void write_slivers(const char *name, double width, bool closed)
{
    FILE *file = fopen(scratch(name), "w");
    assert_non_null(file);
    // An octahedron of 0.1 m whose edge from 0 to 2 has a node close to 0.
    fprintf(file,
            "OFF\n7 10 0\n0.05 0 0\n-0.05 0 0\n0 0.05 0\n0 -0.05 0\n0 0 0.05\n0 0 -0.05\n"
            "%.17g %.17g 0\n",
            0.05 - width, width);
    const char *faces[] = {"0 6 4", "6 2 4", "2 1 4", "1 3 4", "3 0 4",
                           "6 0 5", "2 6 5", "1 2 5", "3 1 5", "0 3 5"};
    for (int i = 0; i < 10; i++)
        fprintf(file, "3 %s\n", i < 9 || closed ? faces[i] : "0 0 0"); // which is dropped
    fclose(file);
}

TEST(each_model_has_its_verdict_with_reason_and_cost)
{
    Process result;
    write_box("box.obj", "", 0.1);
    run(&result, "--check --scale 1 box.obj");
    assert_int_equal(result.code, 0);
    expect_printed(&result, "box.obj: usable\n");
    expect_printed(&result, "  as a wall: yes, 1 substep a tick, about ");
    assert_null(strstr(result.out, "a better wall")); // it is good as it is
    expect_printed(&result, "  as a solid: yes, ");
    expect_printed(&result, "times are estimates for a core of 2 GHz, not measured here");
    // What a wall cannot be, a solid can.
    write_slivers("sliver.off", 1e-8, true);
    run(&result, "--check --scale 1 sliver.off");
    assert_int_equal(result.code, 0);
    expect_printed(&result, "sliver.off: usable\n");
    expect_printed(&result, "  as a wall: no, edges of 0.0141 um need ");
    expect_printed(&result, "      pliant-prepare --even 'sliver.off' -o NEW.off\n");
    expect_printed(&result, "  as a solid: yes, ");
    // And the other way round.
    write_torus("tube.off", 12, 8, false);
    run(&result, "--check --scale 0.1 tube.off");
    assert_int_equal(result.code, 0);
    expect_printed(&result, "  as a wall: yes, ");
    expect_printed(&result, "  as a solid: no, its surface is not closed (MeshLab: Close Holes)\n");
}

// Boxes of 40 mm, one after the other, from `low` along x, and one of `inner` around the middle.
static void write_boxes(const char *name, const double *low, int count, double inner)
{
    static const char *const faces[] = {"0 2 3 1", "4 5 7 6", "0 1 5 4",
                                        "2 6 7 3", "0 4 6 2", "1 3 7 5"};
    FILE *file = fopen(scratch(name), "w");
    assert_non_null(file);
    const int boxes = count + (inner > 0.0);
    fprintf(file, "OFF\n%d %d 0\n", 8 * boxes, 6 * boxes);
    for (int b = 0; b < boxes; b++)
        for (int k = 0; k < 8; k++) {
            const double side = b < count ? 40.0 : inner, at = b < count ? low[b] : 20 - inner / 2;
            const double around = b < count ? 0.0 : 20 - inner / 2;
            fprintf(file, "%g %g %g\n", at + (k & 1 ? side : 0.0), around + (k & 2 ? side : 0.0),
                    around + (k & 4 ? side : 0.0));
        }
    for (int b = 0; b < boxes; b++)
        for (int f = 0; f < 6; f++) {
            int n[4];
            sscanf(faces[f], "%d %d %d %d", &n[0], &n[1], &n[2], &n[3]);
            fprintf(file, "4 %d %d %d %d\n", 8 * b + n[0], 8 * b + n[1], 8 * b + n[2],
                    8 * b + n[3]);
        }
    fclose(file);
}

TEST(what_becomes_of_several_closed_parts_is_said)
{
    static const double low[2] = {0.0, 20.0};
    Process result;
    write_boxes("two.off", low, 2, 0.0);
    run(&result, "--check --units mm two.off");
    // 20 mm of 60 x 40 x 40 are 7.1 cells: 8 or 7 of the 15 that a box has, which is 7 % off.
    double overlap = 0.0;
    const char *const says = "; its parts overlap by about ";
    expect_printed(&result, says);
    assert_int_equal(sscanf(strstr(result.out, says) + strlen(says), "%lf", &overlap), 1);
    expect_near(overlap, 32.0, 0.07 * 32.0);
    assert_null(strstr(result.out, "thin parts"));
    assert_null(strstr(result.out, "pieces"));
    write_boxes("nested.off", low, 1, 20.0);
    run(&result, "--check --units mm nested.off");
    expect_printed(&result, "; closed parts within others, 1 of 2: cavities of 8 cm3 (the other by "
                            "voxels.inner = \"filled\")");
    assert_null(strstr(result.out, "thin parts"));
}

#if defined(PLIANT_WITH_SURFACE) && defined(PLIANT_WITH_VOXEL)
TEST(a_hollow_organ_is_proposed_as_a_wall_by_its_name_and_as_what_is_chosen)
{
    // The same closed tube of 84 mm under two names: its edges of 1 mm need implicit steps.
    static const struct {
        const char *options, *says, *scene;
    } cases[] = {{"colon.off", "as a wall\n  since by its name it is hollow; ",
                  "model = \"surface\";\n    mesh"},
                 {"ring.off",
                  "as a solid\n  since its triangles are too small or too many for a fast wall; ",
                  "model = \"voxel\""},
                 {"ring.off", "\n  or --model surface: a wall, for an empty hollow organ",
                  "cuttable = true;"},
                 {"--model filled loop.off",
                  "as a wall full of a fluid\n  as chosen; that is for a full hollow",
                  "cavity = { fluid = true; };"},
                 {"--model filled --cuttable no loop.off", "as chosen", "    cuttable = false;\n"},
                 {"--cuttable yes ring.off", "as a solid", "    cuttable = true;\n"}};
    write_torus("colon.off", 200, 8, true);
    write_torus("ring.off", 200, 8, true);
    write_torus("loop.off", 24, 12, true);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Process result;
        char arguments[128];
        snprintf(arguments, sizeof arguments, "--propose --scale 0.03 %s -o h%zu.cfg",
                 cases[i].options, i);
        run(&result, arguments);
        assert_string_equal(result.err, "");
        expect_printed(&result, cases[i].says);
        snprintf(arguments, sizeof arguments, "h%zu.cfg", i);
        FREED char *scene = file_text(scratch(arguments));
        expect_in(scene, cases[i].scene);
    }
}

TEST(two_closed_sheets_one_within_the_other_are_the_sides_of_a_wall)
{
    // Within a box of 40 mm one of 32, which is 0.51 of it, or one of 20, which is 0.13.
    Process result;
    static const double low[] = {0.0};
    write_boxes("sack.off", low, 1, 32.0);
    run(&result, "--check --json --units mm sack.off");
    expect_printed(&result, "\"model\": \"voxel\", \"why\": \"since its two sheets, ");
    expect_printed(&result, "\"hollow\": \"one closed sheet lies within another\"");
    write_boxes("cyst.off", low, 1, 20.0);
    run(&result, "--check --json --units mm cyst.off");
    expect_printed(&result, "\"hollow\": \"\"");
}
#endif

TEST(what_has_no_time_for_cuts_is_proposed_whole)
{
    // By the table of costs 8064 springs take 0.56 ms of the 0.6 that bodies have, without cuts.
    static const char WHY[] = "cuttable it would need too much time or memory\n";
    Process result;
    write_torus("fine.off", 64, 42, true);
    run(&result, "--propose --model surface --scale 0.02 fine.off -o fine.cfg");
    assert_int_equal(result.code, 0);
    expect_printed(&result, WHY);
    FREED char *scene = file_text(scratch("fine.cfg"));
    expect_in(scene, "\n    # cuttable = true;");
    // With larger cells the solid has time.
    assert_null(strstr(strstr(result.out, "as a solid: yes"), WHY));
}

TEST(what_can_be_neither_is_reported_and_exits_2)
{
    Process result;
    write_slivers("open.off", 1e-8, false);
    run(&result, "--check --scale 1 open.off");
    expect_refusal(&result, 2, "open.off: usable neither as a wall nor as a solid");
    expect_printed(&result, "open.off: not usable\n");
    expect_printed(&result, "  as a wall: no, ");
    expect_printed(&result, "  as a solid: no, ");
}
#endif

#ifdef PLIANT_WITH_SURFACE
// `count` triangles of which `joined` share an edge with the next.
static void write_loose(const char *name, int count, int joined)
{
    FILE *file = fopen(scratch(name), "w");
    assert_non_null(file);
    fprintf(file, "OFF\n%d %d 0\n", 4 * count, count + joined);
    for (int i = 0; i < count; i++)
        fprintf(file, "%d 0 %d\n%d 0 %d\n%d 7 %d\n%d 9 %d\n", 9 * i, i % 7, 9 * i + 8, i % 7, 9 * i,
                i % 5, 9 * i + 8, i % 3);
    for (int i = 0; i < count; i++)
        fprintf(file, "3 %d %d %d\n", 4 * i, 4 * i + 1, 4 * i + 2);
    for (int i = 0; i < joined; i++)
        fprintf(file, "3 %d %d %d\n", 4 * i + 1, 4 * i + 3, 4 * i + 2);
    fclose(file);
}

TEST(triangles_that_share_nothing_are_no_wall)
{
    // All of them; most of them; and a sheet of two for each that is alone.
    static const struct {
        int count, joined, code;
        const char *says;
    } cases[] = {{60, 0, 2, "nothing holds it together: 60 of its 60 triangles share no edge with"},
                 {60, 10, 2, "nothing holds it together: 50 of its 70 triangles share no edge"},
                 {60, 30, 0, "as a wall: yes, "},
                 {1, 0, 0, "as a wall: yes, "}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Process result;
        write_loose("loose.off", cases[i].count, cases[i].joined);
        run(&result, "--check --units mm loose.off");
        assert_int_equal(result.code, cases[i].code);
        expect_printed(&result, cases[i].says);
        expect_printed(&result,
                       cases[i].code == 0 ? "loose.off: usable\n" : "loose.off: not usable\n");
    }
}
#endif

#ifdef PLIANT_WITH_VOXEL
// Writes voxels of these spacings [mm], which `label_at` gives, behind more lines of the header.
static void write_labels(const char *name, const int count[3], const double spacing[3],
                         const char *lines, int layers, int (*label_at)(const int at[3], int layer))
{
    FILE *file = fopen(scratch(name), "w");
    assert_non_null(file);
    fprintf(file,
            "NRRD0005\ntype: uchar\ndimension: 4\nsizes: %d %d %d %d\n"
            "kinds: list domain domain domain\nspace: LPS\n"
            "space directions: none (%g,0,0) (0,%g,0) (0,0,%g)\nencoding: raw\n%s\n",
            layers, count[0], count[1], count[2], spacing[0], spacing[1], spacing[2], lines);
    for (int v = 0; v < count[0] * count[1] * count[2]; v++)
        for (int l = 0; l < layers; l++)
            fputc(label_at((const int[3]){v % count[0], v / count[0] % count[1],
                                          v / count[0] / count[1]},
                           l),
                  file);
    fclose(file);
}

static int all_of_it(const int at[3], int layer)
{
    (void)at;
    (void)layer;
    return 1;
}

// A slab within a margin of two voxels.
static int slab(const int at[3], int layer)
{
    (void)layer;
    return at[0] >= 2 && at[0] < 48 && at[1] >= 2 && at[1] < 48;
}

// Two separate blocks of label 1; in the second layer a block of label 1 and one of label 2.
static int organs(const int at[3], int layer)
{
    if (layer == 0)
        return at[0] < 5 || at[0] >= 15;
    return at[0] < 14 ? 1 : at[0] >= 15 ? 2 : 0;
}

static int noise(const int at[3], int layer)
{
    return (at[0] * 7919 + at[1] * 104729 + at[2] * 1299709 + layer) % 251;
}

TEST(a_label_of_more_voxels_than_cells_are_possible_is_proposed_with_larger_ones)
{
    // As cells of the smallest spacing they would be 18.4 million, of which 16.8 are possible: they
    // are never made.
    Process result;
    write_labels("large.nrrd", (const int[]){100, 120, 96}, (const double[]){1.0, 0.25, 1.0}, "", 1,
                 all_of_it);
    run(&result, "--check large.nrrd");
    assert_string_equal(result.err, "");
    assert_int_equal(result.code, 0);
    expect_printed(&result,
                   "label 1: \"\", layer 1, voxels 1152000, volume 0.000288 m3, pieces 1, ");
    expect_printed(&result, "as a solid: yes, ");
}

TEST(a_body_of_a_few_slices_gets_cells_that_divide_them)
{
    // 3 mm thick, 73.6 mm wide: cells of 3, 1.5 or 1 mm. Only the sides may be off, by half a cell
    // of 3 mm each: (76.6 / 73.6)^2 = 1.083.
    Process result;
    double times = 0.0;
    write_labels("slab.nrrd", (const int[]){50, 50, 3}, (const double[]){1.6, 1.6, 1.0}, "", 1,
                 slab);
    run(&result, "--check slab.nrrd");
    assert_int_equal(result.code, 0);
    expect_printed(&result, "voxels 6348, volume 1.62509e-05 m3");
    const char *said = strstr(result.out, "times the volume of its label");
    assert_non_null(said);
    while (said[-1] != ',')
        said--;
    times = strtod(said, NULL);
    if (times < 1.0 / 1.083 || times > 1.083)
        fail_msg("%g times the volume", times);
}

static const char SEGMENTS[] = "Segment0_Name:=lungs\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n"
                               "Segment1_Name:=liver\nSegment1_LabelValue:=1\nSegment1_Layer:=1\n"
                               "Segment2_Name:=spleen\nSegment2_LabelValue:=2\nSegment2_Layer:=1\n"
                               "Segment2_Color:=0.5 0.25 1\n";

static int kidney(const int at[3], int layer)
{
    (void)layer;
    return at[0] < 8 ? 1 : at[1] < 5 ? 2 : 3;
}

TEST(all_labels_become_one_body_with_their_colours_and_what_the_ledger_judges_by)
{
    Process result;
    write_labels(
        "kidney.seg.nrrd", (const int[]){20, 10, 10}, (const double[]){2.0, 2.0, 2.0},
        "Segment0_Name:=kidney\nSegment0_LabelValue:=1\n"
        "Segment1_Name:=tumour\"; }; \\\nSegment1_LabelValue:=2\nSegment1_Color:=0.5 0.25 1\n"
        "Segment2_Name:=renal vein\nSegment2_LabelValue:=3\n",
        1, kidney);
    run(&result, "--propose --label all kidney.seg.nrrd -o all.cfg");
    assert_string_equal(result.err, "");
    FREED char *scene = file_text(scratch("all.cfg"));
    expect_in(scene, "label = [1, 2, 3];");
    expect_in(scene, "{ label = 2;  color = [0.500, 0.250, 1.000];");
    // A name is no text of the scene: what ends a string or a list is not in it.
    expect_in(scene, "{ name = \"tumour");
    assert_null(strstr(scene, "\\"));
    expect_in(scene, "margin = 0.005; }");
    expect_in(scene, "{ name = \"renal_vein\";  label = 3;  keep = true; }");
    expect_in(scene, "removes_by = \"suction\"");
    expect_in(scene, "removes_by = \"drill\"");
    run(&result, "--check --json --label all kidney.seg.nrrd");
    expect_printed(&result, "\"label\": 0, ");
    run(&result, "--propose --label 1 kidney.seg.nrrd -o one.cfg");
    FREED char *one = file_text(scratch("one.cfg"));
    assert_null(strstr(one, "score"));
    run(&result, "--check --label all cube.obj");
    expect_refusal(&result, 2, "cube.obj: is no label volume, so it has no label or layer");
}

TEST(labels_are_listed_and_the_one_taken_is_said)
{
    Process result;
    // 10 x 10 x 10 mm of cubes of 2 mm; lungs 2 x 5 of 20 columns, liver 14, spleen 5.
    write_labels("organs.seg.nrrd", (const int[]){20, 10, 10}, (const double[]){2.0, 2.0, 2.0},
                 SEGMENTS, 2, organs);
    run(&result, "--check organs.seg.nrrd");
    assert_int_equal(result.code, 0);
    expect_printed(&result, "  label: 1, the largest of 3 (else --label NUMBER or NAME)\n"
                            "  layers: 2, the label is of layer 2\n");
    expect_printed(&result,
                   "label 1: \"liver\", layer 2, voxels 1400, volume 1.12e-05 m3, pieces 1, "
                   "box: [-0.001, -0.001, -0.001] to [0.027, 0.019, 0.019] m\n");
    expect_printed(&result,
                   "label 1: \"lungs\", layer 1, voxels 1000, volume 8e-06 m3, pieces 2, ");
    expect_printed(&result, "label 2: \"spleen\", layer 2, voxels 500, volume 4e-06 m3, pieces 1, "
                            "colour 0.5 0.25 1, ");
    static const struct {
        const char *choice, *scene;
    } cases[] = {{"", "label = 1;  layer = 2;"},
                 {"--label lungs", "label = 1;  layer = 1;"},
                 {"--label 1 --layer 1", "label = 1;  layer = 1;"},
                 {"--label 2", "label = 2;  layer = 2;"},
                 {"--label all", "label = [1, 2];  layer = 2;"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char arguments[128];
        snprintf(arguments, sizeof arguments, "--propose %s organs.seg.nrrd -o o%zu.cfg",
                 cases[i].choice, i);
        run(&result, arguments);
        assert_string_equal(result.err, "");
        expect_printed(&result, "  label: ");
        snprintf(arguments, sizeof arguments, "o%zu.cfg", i);
        FREED char *scene = file_text(scratch(arguments));
        expect_in(scene, cases[i].scene);
    }
    // For programs: the same, without the list in the report.
    run(&result, "--check --json --label 2 organs.seg.nrrd");
    assert_string_equal(result.err, "");
    expect_printed(&result, "{\"file\": \"organs.seg.nrrd\", \"model\": \"voxel\", ");
    expect_printed(&result, "\"label\": 2, \"layer\": 2, \"layers\": 2, \"unlisted\": 0, ");
    expect_printed(&result, "{\"label\": 1, \"layer\": 1, \"volume_cm3\": 8, \"pieces\": 2, "
                            "\"size_mm\": [40, 20, 20], \"name\": \"lungs\"}");
    expect_printed(&result, "\"size_mm\": [10, 20, 20], \"colour\": [0.5, 0.25, 1], "
                            "\"name\": \"spleen\"}");
    expect_printed(&result,
                   "\"report\": \"organs.seg.nrrd: usable\\u000a  file: label volume, label 2, ");
    assert_null(strstr(result.out, "voxels 1400"));
    run(&result, "--check --label kidney organs.seg.nrrd");
    expect_refusal(&result, 2, "organs.seg.nrrd: no voxel has the label kidney");
    run(&result, "--check --units mm organs.seg.nrrd");
    expect_refusal(&result, 2, "organs.seg.nrrd: --units is for meshes");
    write_file("cube.obj", CUBE);
    run(&result, "--check --label 1 cube.obj");
    expect_refusal(&result, 2, "cube.obj: is no label volume, so it has no label or layer");
    run(&result, "--check --layer 3 organs.seg.nrrd");
    expect_refusal(&result, 2, "organs.seg.nrrd: layer 3 outside [1, 2]");
}

TEST(a_hostile_name_is_a_string_of_the_json)
{
    Process result;
    write_labels("evil.seg.nrrd", (const int[]){20, 10, 10}, (const double[]){2.0, 2.0, 2.0},
                 "Segment0_Name:=a\\b\"}]\x1b\x7f<i>\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n",
                 1, organs);
    run(&result, "--check --json evil.seg.nrrd");
    assert_int_equal(result.code, 0);
    expect_printed(&result, "\"name\": \"a\\\\b?}]?\?<i>\"}");
}

TEST(a_volume_that_takes_long_is_announced)
{
    // 500 x 500 x 400 voxels are 100 million, a hole in the file: no disk is used.
    static const char HEAD[] = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 500 500 400\n"
                               "spacings: 1 1 1\nencoding: raw\n\n";
    Process result;
    write_file("hole.nrrd", HEAD);
    assert_int_equal(truncate(scratch("hole.nrrd"), (off_t)sizeof HEAD - 1 + 100000000), 0);
    run(&result, "--check hole.nrrd");
    assert_int_equal(result.code, 2);
    assert_string_equal(
        result.err,
        "hole.nrrd: 100 million voxels, which take about 2 s\n"
        "hole.nrrd: every voxel has the label 0, so it holds no organ: choose another file\n");
}

TEST(an_image_of_grey_values_is_refused_as_one)
{
    Process result;
    write_labels("scan.nrrd", (const int[]){50, 50, 50}, (const double[]){1.0, 1.0, 1.0}, "", 1,
                 noise);
    run(&result, "--check scan.nrrd");
    expect_refusal(&result, 2,
                   "scan.nrrd: is an image of grey values, not of labels: 250 different");
    assert_string_equal(result.out, "");
}
#endif

TEST(a_repaired_mesh_is_written_for_other_programs_and_read_back)
{
    Process result, before, after;
    write_file("cube.obj", CUBE);
    run(&result, "--repair cube.obj -o repaired.off");
    assert_string_equal(result.err, "");
    assert_int_equal(result.code, 0);
    expect_printed(&result, "repaired.off: 8 nodes, 12 triangles; repairs: cut 6 polygons into");
    run(&before, "--check --units cm cube.obj");
    run(&after, "--check --units cm repaired.off");
    assert_int_equal(after.code, 0);
    expect_printed(&after, "repairs: none\n");
    const char *shape = strstr(before.out, "  box: ");
    assert_non_null(shape);
    assert_string_equal(strstr(after.out, "  box: "), shape); // and all that follows
    expect_printed(&after,
                   "remeshed evenly: edges of 0.166 units of the file would make 1000 nodes");
    run(&result, "--repair cube.obj -o repaired.off");
    expect_refusal(&result, 2, "repaired.off: File exists");
}

#if defined(PLIANT_WITH_SURFACE) && defined(PLIANT_WITH_VOXEL)
TEST(an_even_skin_of_what_is_closed_makes_a_wall_of_it)
{
    Process result;
    double volume = 0.0, edges[3];
    int nodes = 0;
    // A ring of 84 mm, of 7200 nodes: too many for a wall.
    write_torus("fine.off", 120, 60, true);
    run(&result, "--check --scale 0.03 fine.off");
    expect_printed(&result, "as a wall: no, ");
    run(&result, "--even --scale 0.03 fine.off -o even.off");
    assert_string_equal(result.err, "");
    assert_int_equal(sscanf(result.out,
                            "even.off: %d nodes, %*d triangles, in metres; encloses %lf", &nodes,
                            &volume),
                     2);
    // About 1000 nodes; 2 pi^2 a^2 R in cm3, of which a triangle that cuts off the bulge below it
    // loses about (edge / radius)^2 / 8: 1 % of 4 mm on 12.
    assert_true(nodes > 700 && nodes < 1400);
    const double ring = 2.0 * 9.8696 * 1.2 * 1.2 * 3.0;
    expect_near(volume, ring, 0.03 * ring);
    run(&result, "--check even.off");
    expect_printed(&result, "taken as m: ");
    expect_printed(&result, "1, of them closed: 1, ");
    expect_printed(&result, "genus 1");
    expect_printed(&result, "as a wall: yes, ");
    const char *said = strstr(result.out, "edge lengths: min ");
    assert_non_null(said);
    assert_int_equal(
        sscanf(said, "edge lengths: min %lf, mean %lf, max %lf", &edges[0], &edges[1], &edges[2]),
        3);
    // Cells of one size: none of their edges is a third of the mean, nor three times as long.
    assert_true(edges[0] > edges[1] / 3.0 && edges[2] < 3.0 * edges[1]);
    write_torus("open.off", 12, 8, false);
    run(&result, "--even --scale 0.03 open.off -o no.off");
    expect_refusal(&result, 2, "open.off: its surface is not closed; ./dev remesh makes");
    // Also of a label.
    write_labels("organs.seg.nrrd", (const int[]){20, 10, 10}, (const double[]){2.0, 2.0, 2.0}, "",
                 2, organs);
    run(&result, "--even --label 2 organs.seg.nrrd -o label.off");
    expect_printed(&result, "encloses 4");
    assert_int_equal(result.code, 0);
}
#endif

TEST(a_slit_is_reported_with_the_command_that_joins_it)
{
    // A tube whose seam is open by 0.1 of 50: three quads, six border edges of which two are near.
    Process result;
    write_file("slit.obj", "v 0 0 0\nv 50 0 0\nv 0 50 0\nv 0 0 30\nv 50 0 30\nv 0 50 30\n"
                           "v 0.1 0 0\nv 0.1 0 30\n"
                           "f 1 2 5 4\nf 2 3 6 5\nf 3 7 8 6\n");
    run(&result, "--check --units mm slit.obj");
    assert_int_equal(result.code, 0);
    expect_printed(&result,
                   "  note: 2 border edges lie side by side, at most 0.1 units of the file apart; "
                   "pliant-prepare --repair FILE --weld 0.11 -o NEW.off joins them\n");
    run(&result, "--repair slit.obj --weld 0.11 -o joined.off");
    assert_int_equal(result.code, 0);
    expect_printed(&result, "joined 2 border edges at most 0.1 units of the file apart");
}

TEST(bad_usage_exits_2_with_one_line)
{
    static const char *const cases[][2] = {
        {"", "no mesh given"},
        {"--check", "no mesh given"},
        {"-o model.h5", "no scene given"},
        {"scene.cfg", "needs either --check MESH... or SCENE.cfg -o FILE"},
        {"--check scene.cfg -o model.h5", "needs either --check MESH... or SCENE.cfg -o FILE"},
        {"--scale 0.1 scene.cfg -o model.h5", "--scale goes with --check"},
        {"a.cfg b.cfg -o model.h5", "one scene at a time, got 'a.cfg' and 'b.cfg'"},
        {"scene.cfg -o model.h5", "scene.cfg: No such file"},
        {"--check --frobnicate cube.obj", "--frobnicate"},
        {"--check --scale cube.obj", "--scale 'cube.obj' is not a number in (0, 1e+06]"},
        {"--check --units inch cube.obj", "--units 'inch' is none of m, dm, cm, mm and um"},
        {"--label 1 scene.cfg -o model.h5", "--label and --layer go with --check or --propose"},
        {"--check --model voxel cube.obj", "--model goes with --propose"},
        {"--check --cuttable no cube.obj", "--cuttable goes with --propose"},
        {"--propose --cuttable 1 cube.obj -o a.cfg", "--cuttable '1' is neither yes nor no"},
        {"--propose --json cube.obj -o a.cfg", "--json goes with --check"},
        {"--propose cube.obj", "needs either --check"},
        {"--repair --propose cube.obj -o a.cfg", "needs either --check"},
        {"--repair --units mm cube.obj -o a.off", "--scale goes with --check or --propose"},
        {"--propose --model tube cube.obj -o a.cfg", "--model 'tube' is neither"},
        {"--check --weld 1 cube.obj", "--weld goes with --repair"},
        {"--check --scale nan cube.obj", "--scale 'nan'"},
        {"--check --scale -1 cube.obj", "--scale '-1'"},
        {"--check cube.obj --scale", "--scale"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Process result;
        run(&result, cases[i][0]);
        expect_refusal(&result, 2, cases[i][1]);
        assert_string_equal(result.out, "");
    }
}

TEST(help_and_version_exit_0)
{
    Process result;
    run(&result, "--help");
    assert_int_equal(result.code, 0);
    expect_printed(&result, "--check");
    expect_printed(&result, "--scale");
    run(&result, "--version");
    assert_int_equal(result.code, 0);
    expect_printed(&result, "pliant-prepare 0.");
}
