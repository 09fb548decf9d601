// SPDX-License-Identifier: MIT
// OFF files: what they may look like, and how faults are named. And text files of other systems.
#include "test.h"
#include "import_text.h"

#define VERTICES "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
#define FACES    "3 0 1 2\n3 0 2 3\n"

AROUND_ALL(scratch_begin, scratch_end)

TEST(files_may_be_written_in_every_usual_way)
{
    static const char *const texts[] = {
        "OFF\n4 2 0\n" VERTICES FACES,
        "OFF 4 2 5\n" VERTICES FACES,
        "OFF4 2 5\n" VERTICES FACES, // as some data sets have it
        "# by hand\n\nOFF # text\n4 2\n# corners\n\n" VERTICES "\n# faces\n" FACES "\n\n# end",
        "COFF\n4 2 0\n0 0 0 255 0 0 1\n1 0 0 0 255 0 1\n1 1 0 0 0 255 1\n0 1 0 0 0 0 1\n"
        "3 0 1 2 255 0 0\n3 0 2 3 0.5\n",
        "STCNOFF\n4 2 0\n" VERTICES FACES,
        "OFF\r\n4 2 0\r\n0 0 0\r\n1 0 0\r\n1 1 0\r\n0 1 0\r\n3 0 1 2\r\n3 0 2 3\r\n",
        "OFF\r4 2 0\r0 0 0\r1 0 0\r1 1 0\r0 1 0\r3 0 1 2\r3 0 2 3\r", // old Macintosh
        "\xEF\xBB\xBFOFF\n4 2 0\n" VERTICES FACES,
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        MeshImport import;
        assert_string_equal(import_text(texts[i], &mesh, &import), "");
        const int faces[2][3] = {{0, 1, 2}, {0, 2, 3}};
        assert_string_equal(import.format, "OFF");
        assert_int_equal(mesh.node_count, 4);
        assert_memory_equal(mesh.triangle, faces, sizeof faces);
    }
}

TEST(faults_name_the_line)
{
    static const char *const cases[][2] = {
        {"OFF", ":1: file ends where the number of vertices stands"},
        {"OFF\n4\n", ":3: file ends where the number of faces stands"},
        {"OFF\n4 x 0\n", ":2: number of faces must be an integer from 0, not 'x'"},
        {"OFF\n-4 2 0\n", ":2: number of vertices must be an integer from 0, not '-4'"},
        {"OFF\n4e99 2 0\n", ":2: number of vertices must be an integer from 0, not '4e99'"},
        {"OFF BINARY\n4 2 0\n",
         ":1: binary OFF files are not read; export it as text, or as PLY or STL"},
        {"\n4OFF\n4 2 0\n",
         ":2: OFF files of other than three dimensions are not read; export it as PLY or STL"},
        {"nOFF 3\n4 2 0\n",
         ":1: OFF files of other than three dimensions are not read; export it as PLY or STL"},
        {"OFF\n4 2 0\n0 0 0\n1 0\n", ":4: vertex 1 has 2 coordinates, not 3"},
        {"OFF\n4 2 0\n0 0 0\n1 0 z\n", ":4: coordinate 'z' is not a number"},
        {"OFF\n4 2 0\n0 0 0\n1 0 0\n", ":5: vertex 2 of 4: the file ends"},
        {"OFF\n4 2 0\n" VERTICES "3 0 1 2\n", ":8: face 1 of 2: the file ends"},
        {"OFF\n4 2 0\n" VERTICES "3 0 1 2\n3 0 1\n", ":8: face 1 has 2 corners, not 3"},
        {"OFF\n4 2 0\n" VERTICES "3 0 1 2\nthree 0 1 2\n",
         ":8: face 1 must begin with its number of corners, not 'three'"},
        {"OFF\n4 2 0\n" VERTICES "3 0 1 2\n3 0 2 4\n",
         ":8: face 1 names vertex '4' outside [0, 3]"},
        {"OFF\n4 2 0\n" VERTICES "3 0 1 2\n3 0 2 -1\n",
         ":8: face 1 names vertex '-1' outside [0, 3]"},
        {"OFF\n4 2 0\n" VERTICES "3 0 1 2\n3 0 2 nan\n",
         ":8: face 1 names vertex 'nan' outside [0, 3]"},
        {"OFF\n4 2 0\n" VERTICES FACES "3 0 1 3\n",
         ":9: '3' follows the 2 faces that are announced"},
        {"OFF\n4 1 0\n0 0 0\n1 0 inf\n1 1 0\n0 1 0\n3 0 1 2\n",
         ":7: face 0 uses node 1, whose position (1, 0, inf) is not finite"},
        {"OFF\n4 0 0\n" VERTICES, ": has points but no faces, so it is no surface; MeshLab makes "
                                  "one of a cloud of points (Screened Poisson)"},
        {"OFF\n0 0 0\n", ": the mesh has no faces"},
        {"OFFSET\n", ": no faces; expected a mesh (OBJ, STL, PLY, OFF, VTK, MSH) or labels (NRRD, "
                     "NIfTI); assimp export FILE NEW.stl converts many others"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        TriMesh mesh;
        MeshImport import;
        assert_string_equal(import_text(cases[i][0], &mesh, &import), cases[i][1]);
    }
}
