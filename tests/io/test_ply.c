// SPDX-License-Identifier: MIT
// PLY files: what headers and data may look like, and how faults are named.
#include "test.h"
#include "import_text.h"

#define VERTEX "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
#define FACE   "element face 2\nproperty list uchar int vertex_indices\n"
#define HEADER "ply\nformat ascii 1.0\n" VERTEX FACE "end_header\n"
#define STRIPS                                                                                     \
    "ply\nformat ascii 1.0\n" VERTEX                                                               \
    "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
#define VERTICES "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"

// A square of two triangles on the nodes 0 1 2 3.
static void expect_square(const char *text, size_t size)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    MeshImport import;
    assert_string_equal(import_bytes(text, size, &mesh, &import), "");
    const int faces[2][3] = {{0, 1, 2}, {0, 2, 3}};
    assert_int_equal(mesh.node_count, 4);
    assert_int_equal(mesh.triangle_count, 2);
    assert_memory_equal(mesh.triangle, faces, sizeof faces);
    expect_near(mesh.position[2].x, 1.0, 0.0);
    expect_near(mesh.position[3].y, 1.0, 0.0);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(headers_may_be_written_in_every_usual_way)
{
    static const char *const texts[] = {
        HEADER VERTICES "3 0 1 2\n3 0 2 3\n",
        HEADER "\n0 0 0\n\n1 0 0\n1 1 0 \n 0\t1 0\n3 0 1 2\n3 0 2 3", // blanks, no last newline
        // capitals, the other type names, the other name of the list, elements swapped and unknown
        "ply\nformat ASCII 1.0\ncomment element vertex 9\nobj_info x\n"
        "element face 2\nproperty list uint8 uint32 vertex_index\nproperty uchar flags\n"
        "element vertex 4\nproperty float64 z\nproperty int16 x\nproperty uint8 y\n"
        "element edge 1\nproperty int a\nproperty list int float b\n"
        "element nothing 4000000000\nend_header\n"
        "3 0 1 2 7\n3 0 2 3 7\n0 0 0\n0 1 0\n0 1 1\n0 0 1\n5 2 1.5 -1\n",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        expect_square(texts[i], strlen(texts[i]));
}

TEST(line_ends_may_be_those_of_any_system)
{
    const char text[] = HEADER VERTICES "3 0 1 2\n3 0 2 3\n";
    char windows[2 * sizeof text], *to = windows;
    for (const char *from = text; *from != '\0'; from++) {
        if (*from == '\n')
            *to++ = '\r';
        *to++ = *from;
    }
    expect_square(windows, (size_t)(to - windows));
}

// Stanford's models are strips: each vertex makes a triangle with the two before it, every second
// one turned around, those with equal vertices only lead elsewhere, and -1 begins a new strip.
TEST(triangle_strips_are_read_with_the_side_of_every_triangle)
{
    static const char *const lists[] = {"7 0 1 2 -1 0 2 3\n", "9 0 1 2 2 0 0 2 3 -1\n",
                                        "6 -1 0 1 2 -1 3\n", "4 1 2 0 3\n"};
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        MeshImport import;
        char text[512];
        const int size = snprintf(text, sizeof text, STRIPS VERTICES "%s", lists[i]);
        assert_string_equal(import_bytes(text, (size_t)size, &mesh, &import), "");
        assert_int_equal(mesh.triangle_count, i == 2 ? 1 : 2);
        // Seen from above, all run against the clock.
        for (int t = 0; t < mesh.triangle_count; t++)
            assert_true(vec3_cross(vec3_sub(mesh.position[mesh.triangle[t][1]],
                                            mesh.position[mesh.triangle[t][0]]),
                                   vec3_sub(mesh.position[mesh.triangle[t][2]],
                                            mesh.position[mesh.triangle[t][0]]))
                            .z > 0.0);
    }
}

// Binary data with types of every size, in both byte orders.
TEST(binary_data_are_read_by_their_types)
{
    static const char header[] = "element vertex 4\nproperty ushort x\nproperty char before\n"
                                 "property char y\nproperty uint z\n"
                                 "element face 2\nproperty list ushort short vertex_indices\n"
                                 "property double after\nend_header\n";
    for (int big = 0; big < 2; big++) {
        char bytes[512];
        int size = snprintf(bytes, sizeof bytes, "ply\nformat binary_%s_endian 1.0\n%s",
                            big ? "big" : "little", header);
        static const int corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        for (int i = 0; i < 4; i++) {
            const char vertex[8] = {(char)(big ? 0 : corners[i][0]),
                                    (char)(big ? corners[i][0] : 0), 10, (char)corners[i][1]};
            memcpy(bytes + size, vertex, 8);
            size += 8;
        }
        for (int f = 0; f < 2; f++) {
            const int numbers[4] = {3, 0, 1 + f, 2 + f};
            for (int k = 0; k < 4; k++) {
                bytes[size++] = (char)(big ? 0 : numbers[k]);
                bytes[size++] = (char)(big ? numbers[k] : 0);
            }
            memset(bytes + size, '\n', 8); // a double that looks like line ends
            size += 8;
        }
        expect_square(bytes, (size_t)size);
        bytes[size] = '\n'; // some writers end with a newline
        expect_square(bytes, (size_t)size + 1);
    }
}

TEST(negative_numbers_keep_their_sign_in_binary_data)
{
    char bytes[512];
    int size =
        snprintf(bytes, sizeof bytes,
                 "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty char x\n"
                 "property short y\nproperty int z\nelement face 1\nproperty list char uchar "
                 "vertex_indices\nend_header\n");
    const unsigned char data[] = {0xff, 0xfe, 0xff, 0xfd, 0xff, 0xff, 0xff, // (-1, -2, -3)
                                  1,    0,    0,    0,    0,    0,    0,    // (1, 0, 0)
                                  0,    0,    0x80, 0,    0,    0,    0x80, // the smallest
                                  3,    0,    1,    2};
    memcpy(bytes + size, data, sizeof data);
    SCOPED(mesh_destroy) TriMesh mesh;
    MeshImport import;
    assert_string_equal(import_bytes(bytes, (size_t)size + sizeof data, &mesh, &import), "");
    expect_near(mesh.position[0].x, -1.0, 0.0);
    expect_near(mesh.position[0].y, -2.0, 0.0);
    expect_near(mesh.position[0].z, -3.0, 0.0);
    expect_near(mesh.position[2].y, -32768.0, 0.0);
    expect_near(mesh.position[2].z, -2147483648.0, 0.0);
}

TEST(faults_name_line_or_element)
{
    static const char *const cases[][2] = {
        // headers
        {"ply\n", ":2: file ends inside its header"},
        {"ply\nx", ":2: unknown word in the header: 'x'"},
        {"ply\nformat ascii 1.0\n", ":3: file ends inside its header"},
        {"ply\nformat binary_middle_endian 1.0\n", ":2: unknown format 'binary_middle_endian'"},
        {"ply\nelement vertex many\n", ":2: element count must be a number from 0, not 'many'"},
        {"ply\nelement vertex -1\n", ":2: element count must be a number from 0, not '-1'"},
        {"ply\nelement vertex\n", ":2: element count must be a number from 0, not ''"},
        {"ply\nelement vertex 1e99\n", ":2: element count must be a number from 0, not '1e99'"},
        {"ply\nproperty float x\n", ":2: property before any element: 'float'"},
        {"ply\nelement vertex 1\nproperty half x\n", ":3: unknown type 'half'"},
        {"ply\nelement face 1\nproperty list float int a\n",
         ":3: the count of a list must be an integer: 'list'"},
        {"ply\n" VERTEX FACE "end_header\n", ": the header names no format"},
        {"ply\nformat ascii 1.0\n" FACE "end_header\n",
         ": a PLY mesh has one element vertex and one element face, not 0 and 1"},
        {"ply\nformat ascii 1.0\n" VERTEX "end_header\n" VERTICES,
         ": has points but no faces, so it is no surface; MeshLab makes one of a cloud of points "
         "(Screened Poisson)"},
        {STRIPS VERTICES "3 0 -2 1\n", ":14: tristrips 0 names vertex -2"},
        {STRIPS VERTICES "3 0 1 9\n", ":14: face 0 names node 9, but there are 4 nodes"},
        {"ply\nformat ascii 1.0\n" VERTEX VERTEX FACE "end_header\n",
         ": a PLY mesh has one element vertex and one element face, not 2 and 1"},
        {"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n" FACE
         "end_header\n",
         ": element vertex must have the numbers x, y and z once each"},
        {"ply\nformat ascii 1.0\n" VERTEX "element face 2\nproperty list uchar int corners\n"
         "end_header\n",
         ": element face must have one list vertex_indices"},
        // data
        {HEADER "0 0 0\n1 0\n1 1 0\n", ":11: vertex 1 has too few numbers on its line"},
        {HEADER "0 0 0\n1 0 north\n1 1 0\n",
         ":11: vertex 1 has 'north' where a number is expected"},
        {HEADER "0 0 0\n1 0 0\n", ":12: vertex 2 of 4: the file ends"},
        {HEADER VERTICES "3 0 1 2\n", ":15: face 1 of 2: the file ends"},
        {HEADER VERTICES "3 0 1 2\n3 0 2\n", ":15: face 1 has too few numbers on its line"},
        {HEADER VERTICES "3 0 1 2\n3 0 2 -3\n", ":15: face 1 names vertex -3"},
        {HEADER VERTICES "3 0 1 2\n3 0 2 2.5\n", ":15: face 1 names vertex 2.5"},
        {HEADER VERTICES "3 0 1 2\n3 0 2 nan\n", ":15: face 1 names vertex nan"},
        {HEADER VERTICES "3 0 1 2\n3 0 2 4\n", ":15: face 1 names node 4, but there are 4 nodes"},
        {HEADER VERTICES "3 0 1 2\n-3 0 2 3\n",
         ":15: face 1 has a list whose count is no number from 0"},
        {HEADER VERTICES "3 0 1 2\n3 0 2 3\n3 0 2 3\n",
         ": 8 bytes follow the elements that the header announces: write it again from the program "
         "that made it"},
        {HEADER "0 0 0\n1 0 nan\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n",
         ":14: face 0 uses node 1, whose position (1, 0, nan) is not finite"},
        {"ply\nformat binary_big_endian 1.0\n" VERTEX FACE "end_header\n0000",
         ": vertex 0 of 4: the file ends"},
        {"ply\nformat binary_big_endian 1.0\nelement vertex 4000000000\nproperty char x\nproperty "
         "char y\nproperty char z\n" FACE "end_header\n0000",
         ": vertex 1 of 4000000000: the file ends"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        TriMesh mesh;
        MeshImport import;
        assert_string_equal(import_text(cases[i][0], &mesh, &import), cases[i][1]);
    }
}

TEST(headers_beyond_reason_are_refused)
{
    static char text[64 * 1024];
    TriMesh mesh;
    MeshImport import;
    int size = snprintf(text, sizeof text, "ply\nformat ascii 1.0\n");
    for (int i = 0; i < 100; i++)
        size += snprintf(text + size, sizeof text - (size_t)size, "element e%d 0\n", i);
    assert_string_equal(import_text(text, &mesh, &import), ":35: too many elements, at 'e32'");
    size = snprintf(text, sizeof text, "ply\nformat ascii 1.0\nelement vertex 1\n");
    for (int i = 0; i < 1000; i++)
        size += snprintf(text + size, sizeof text - (size_t)size, "property float p%d\n", i);
    assert_string_equal(import_text(text, &mesh, &import), ":260: too many properties, at 'float'");
}
