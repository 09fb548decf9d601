// SPDX-License-Identifier: MIT
#include "test.h"
#include "scratch_folder.h"

#include "io/mesh_import.h"
#include "geometry/generator.h"

#include <sys/stat.h>

static char path[SCRATCH_PATH]; // the one file that tests write and read

static int make_folder(void **state)
{
    if (scratch_begin(state) != 0)
        return -1;
    scratch_path(&scratch_space, "organ", path);
    return 0;
}

static void write_bytes(const void *bytes, size_t size)
{
    file_write(path, bytes, size);
}

static void import_bytes(const void *bytes, size_t size, TriMesh *mesh)
{
    Status status = {0};
    MeshImport import;
    write_bytes(bytes, size);
    expect_ok(mesh_import(path, mesh, &import, &status), status);
}

// Whatever the bytes are: a valid mesh, or an error that begins with the file's name.
static bool is_imported(const void *bytes, size_t size)
{
    TriMesh mesh;
    MeshImport import;
    MeshFault fault;
    Status status = {0};
    write_bytes(bytes, size);
    const bool imported = mesh_import(path, &mesh, &import, &status);
    if (imported) {
        assert_true(mesh.triangle_count > 0 && mesh_check(&mesh, &fault));
        mesh_destroy(&mesh);
    } else
        assert_int_equal(strncmp(status.text, path, strlen(path)), 0);
    return imported;
}

static void import_text(const char *text, TriMesh *mesh)
{
    import_bytes(text, strlen(text), mesh);
}

// The error text must be the path followed by `rest`.
static void expect_error(const char *rest)
{
    TriMesh mesh;
    MeshImport import;
    Status status = {0};
    assert_false(mesh_import(path, &mesh, &import, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    assert_int_equal(strncmp(status.text, path, strlen(path)), 0);
    assert_string_equal(status.text + strlen(path), rest);
    assert_null(strchr(status.text, '\n'));
}

static void expect_text_error(const char *text, const char *rest)
{
    write_bytes(text, strlen(text));
    expect_error(rest);
}

static void expect_corners(const TriMesh *mesh, int triangle, int a, int b, int c)
{
    const int corner[3] = {a, b, c};
    assert_true(triangle < mesh->triangle_count);
    assert_memory_equal(mesh->triangle[triangle], corner, sizeof corner);
}

// --- OBJ ---

AROUND_ALL(make_folder, scratch_end)

TEST(obj_of_a_generated_mesh_comes_back_bit_by_bit)
{
    SCOPED(mesh_destroy) TriMesh made, read;
    MeshImport import;
    Status status = {0};
    assert_true(generate_stomach(&made, 188, 0.25, &status));
    FILE *file = fopen(path, "w");
    for (int i = 0; i < made.node_count; i++) // 17 digits name a double exactly
        fprintf(file, "v %.17g %.17g %.17g\n", made.position[i].x, made.position[i].y,
                made.position[i].z);
    for (int t = 0; t < made.triangle_count; t++)
        fprintf(file, "f %d %d %d\n", made.triangle[t][0] + 1, made.triangle[t][1] + 1,
                made.triangle[t][2] + 1);
    fclose(file);
    assert_true(mesh_import(path, &read, &import, &status));
    assert_int_equal(read.node_count, 188);
    assert_int_equal(read.triangle_count, 372);
    assert_memory_equal(read.position, made.position, 188 * sizeof *read.position);
    assert_memory_equal(read.triangle, made.triangle, 372 * sizeof *read.triangle);
    assert_memory_equal(read.file_index, made.file_index, 188 * sizeof *read.file_index);
}

TEST(obj_corners_may_name_texture_and_normal)
{
    TriMesh mesh;
    // The last four with empty fields, which are absent ones.
    static const char *const faces[] = {"f 1 2 3",          "f 1/1 2/1 3/1", "f 1/1/1 2/1/1 3/1/1",
                                        "f 1//1 2//1 3//1", "f 1// 2// 3//", "f 1/1/ 2/1/ 3/1/",
                                        "f 1/ 2/ 3/",       "f 1 2// 3/1"};
    for (int i = 0; i < 8; i++) {
        char text[128];
        snprintf(text, sizeof text, "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n%s\n", faces[i]);
        import_text(text, &mesh);
        assert_int_equal(mesh.triangle_count, 1);
        expect_corners(&mesh, 0, 0, 1, 2);
        assert_int_equal(mesh.uv != NULL, i == 1 || i == 2 || i == 5);
        mesh_destroy(&mesh);
    }
}

TEST(obj_negative_indices_count_back)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    import_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 1 -5 5\nf -1/-1 +2 -4//-2\n", &mesh);
    expect_corners(&mesh, 0, 0, 1, 2);
    expect_corners(&mesh, 1, 3, 1, 0);
}

TEST(obj_faces_may_come_before_vertices)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    import_text("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0", &mesh);
    expect_corners(&mesh, 0, 0, 1, 2);
}

TEST(obj_tolerates_comments_crlf_continuation_and_other_keywords)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    import_text("\xEF\xBB\xBFv 0 0 0 # the first, after a byte order mark\r\n"
                "# v 9 9 9\r\n\r\n"
                "mtllib organ.mtl\r\no liver\r\ng \\\r\nv 7 7 7\r\ns off\r\nvp 1 2\r\n"
                "\tv  1\t0 \\\r\n 0 0.5 0.5 0.5\r\n"
                "v 0 1e0 .0 1.0\r\n"
                "f 1 2 \\\n3\nl 1 2\nusemtl red\n",
                &mesh);
    assert_int_equal(mesh.node_count, 3);
    expect_near(mesh.position[1].x, 1.0, 0.0);
    expect_corners(&mesh, 0, 0, 1, 2);
}

TEST(obj_equal_nodes_are_welded_and_remember_their_index)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    import_text("v 0 0 0\nv 1 0 0\nv -0 0 0\nv 0 1 0\nv 1 0 0\nv 0 0 1\nf 1 2 4\nf 3 6 5\n", &mesh);
    const int index[4] = {0, 1, 3, 5};
    assert_int_equal(mesh.node_count, 4);
    assert_int_equal(mesh.file_node_count, 6);
    assert_memory_equal(mesh.file_index, index, sizeof index);
    expect_corners(&mesh, 1, 0, 3, 1);
    const int became[6] = {0, 1, 0, 2, 1, 3};
    for (int i = 0; i < 6; i++)
        assert_int_equal(mesh_node_of_file(&mesh, i), became[i]);
    assert_int_equal(mesh_node_of_file(&mesh, 6), -1);
}

TEST(obj_texture_coordinates_stay_with_their_nodes)
{
    // The seam runs through node 1, which is there twice and has two coordinates: the first stays.
    SCOPED(mesh_destroy) TriMesh mesh;
    import_text("vt 0.5 1e-3 9\nvt 0.25\nvt -1 7\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\n"
                "vt 1 1\nvt 8 8\nf 1/1 2/2 3/3\nf 3/3/1 4/-1 5/4\n",
                &mesh);
    const double uv[4][2] = {{0.5, 1e-3}, {0.25, 0.0}, {-1.0, 7.0}, {1.0, 1.0}};
    assert_int_equal(mesh.node_count, 4);
    assert_non_null(mesh.uv);
    assert_memory_equal(mesh.uv, uv, sizeof uv);
    mesh_destroy(&mesh);
    // One node without: a texture with a hole is none.
    import_text("vt 0 0\nvt 1 0\nvt 0 1\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/2 3/9\n", &mesh);
    assert_null(mesh.uv);
}

TEST(obj_faults_name_file_and_line)
{
    const char *const v = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    const char *const cases[][2] = {
        {"f 1 2", ": the mesh has no faces"},
        {"f", ": the mesh has no faces"},
        {"f 1 2 2", ": the mesh has no face with an area"},
        {"f 1 2 5", ":5: vertex index 5 outside [1, 4]"},
        {"\n\nf 1 2 0", ":7: vertex index 0; the first is 1"},
        {"f 1 2 -5", ":5: vertex index -5 with only 4 vertices before it"},
        {"f 1 2 \\\n -5", ":6: vertex index -5 with only 4 vertices before it"},
        {"f 1 2 3.5", ":5: '3.5' is not a corner v, v/vt or v/vt/vn"},
        {"f 1 2 /3", ":5: '/3' is not a corner v, v/vt or v/vt/vn"},
        {"f 1 2 3///", ":5: '3///' is not a corner v, v/vt or v/vt/vn"},
        {"f 1 2 3/x", ":5: '3/x' is not a corner v, v/vt or v/vt/vn"},
        {"f 1 2 3/1/1/1", ":5: '3/1/1/1' is not a corner v, v/vt or v/vt/vn"},
        {"f 1 2 99999999999999999999",
         ":5: '99999999999999999999' is not a corner v, v/vt or v/vt/vn"},
        {"v 1 2", ":5: vertex has 2 coordinates, not 3"},
        {"v", ":5: vertex has 0 coordinates, not 3"},
        {"v 1 nan 2\nf 1 2 5", ":6: face 0 uses node 4, whose position (1, nan, 2) is not finite"},
        {"v 1 -inf 2\nf 1 2 5",
         ":6: face 0 uses node 4, whose position (1, -inf, 2) is not finite"},
        {"v 1 1e999 2\nf 1 2 5",
         ":6: face 0 uses node 4, whose position (1, inf, 2) is not finite"},
        {"vt 0 nan\n", ":5: texture coordinate 'nan' is not a finite number"},
        {"vt\n", ":5: texture coordinate '' is not a finite number"},
        {"v 1 2,5 2", ":5: coordinate '2,5' is not a number"},
        {"v 1 \x1b[31m 2", ":5: coordinate '?[31m' is not a number"},
        {"v 1 123456789012345678901234567890x 2",
         ":5: coordinate '123456789012345678901234567890...' is not a number"},
        {"", ": has points but no faces, so it is no surface; MeshLab makes one of a cloud of "
             "points (Screened Poisson)"},
        {"ply", ": has points but no faces, so it is no surface; MeshLab makes one of a cloud of "
                "points (Screened Poisson)"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[256];
        snprintf(text, sizeof text, "%s%s\n", v, cases[i][0]);
        expect_text_error(text, cases[i][1]);
    }
}

// --- STL ---

static const char TWO_FACETS[] = "solid two facets\n"
                                 "  facet normal 0 0 1\n"
                                 "    outer loop\n"
                                 "      vertex 0 0 0\n"
                                 "      vertex 1 0 0\n"
                                 "      vertex 1 1 0\n"
                                 "    endloop\n"
                                 "  endfacet\n"
                                 "  facet normal 0 0 1\n"
                                 "    outer loop\n"
                                 "      vertex 0 0 0\n"
                                 "      vertex 1 1 0\n"
                                 "      vertex 0 1 -0\n"
                                 "    endloop\n"
                                 "  endfacet\n"
                                 "endsolid two facets\n";

static void expect_two_facets(const TriMesh *mesh)
{
    const int index[4] = {0, 1, 2, 5}; // 3 triangle + corner of the first occurrence
    assert_int_equal(mesh->node_count, 4);
    assert_int_equal(mesh->file_node_count, 6);
    assert_memory_equal(mesh->file_index, index, sizeof index);
    expect_corners(mesh, 0, 0, 1, 2);
    expect_corners(mesh, 1, 0, 2, 3);
}

TEST(ascii_stl_is_welded_and_remembers_its_corners)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    import_text(TWO_FACETS, &mesh);
    expect_two_facets(&mesh);
}

TEST(ascii_stl_tolerates_capitals_crlf_solids_and_bad_normals)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    import_text("\r\n SOLID facet\r\nFACET NORMAL nan nan nan\r\nOUTER LOOP\r\nVERTEX 0 0 0\r\n"
                "VERTEX 1 0 0 VERTEX 1 1 0\r\nENDLOOP ENDFACET\r\nendsolid facet\r\n"
                "solid\nfacet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 1 0 vertex 0 1 0 "
                "endloop endfacet endsolid",
                &mesh);
    expect_two_facets(&mesh);
}

// As some writers end their files.
TEST(ascii_stl_may_end_with_two_words_or_zero_bytes)
{
    static const char *const ends[] = {"end solid\n", "END SOLID two facets\n",
                                       "end solid\nsolid more\nendsolid\n", "endsolid\n\0\0"};
    const size_t body = (size_t)(strstr(TWO_FACETS, "endsolid") - TWO_FACETS);
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
        char text[2048];
        SCOPED(mesh_destroy) TriMesh mesh;
        const size_t size = body + strlen(ends[i]);
        memset(text, 0, sizeof text);
        memcpy(text, TWO_FACETS, body);
        memcpy(text + body, ends[i], strlen(ends[i]));
        import_bytes(text, size + (i == 3 ? 2 : 0), &mesh);
        expect_two_facets(&mesh);
    }
    expect_text_error("solid\nend facet\n", ":2: 'end' where 'facet' or 'endsolid' is expected");
}

TEST(obj_may_end_with_a_zero_byte_but_not_hold_one)
{
    static const char text[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n"
                               "f 1 4 3\n";
    SCOPED(mesh_destroy) TriMesh mesh;
    char inside[sizeof text];
    import_bytes(text, sizeof text, &mesh); // its final zero too
    assert_int_equal(mesh.triangle_count, 4);
    memcpy(inside, text, sizeof text);
    inside[30] = 0;
    write_bytes(inside, sizeof inside);
    expect_error(
        ": neither text nor a binary STL, which has at least 84 bytes; expected a mesh (OBJ, STL, "
        "PLY, OFF, VTK, MSH) or labels (NRRD, NIfTI); assimp export FILE NEW.stl converts many "
        "others");
}

TEST(ascii_stl_faults_name_file_and_line)
{
    const char *const start =
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n";
    const char *const cases[][2] = {
        {"vertex 0 inf 0\nendloop endfacet endsolid",
         ":2: face 0 uses node 2, whose position (0, inf, 0) is not finite"},
        {"vertex 0 x 0\n", ":6: coordinate 'x' is not a number"},
        {"vertex 0 0\nendloop", ":7: coordinate 'endloop' is not a number"},
        {"vertex 0 0", ":6: file ends inside a vertex"},
        {"endloop", ":6: 'endloop' where 'vertex' is expected"},
        {"vertex 0 1 0\nvertex 0 1 0", ":7: 'vertex' where 'endloop' is expected"},
        {"vertex 0 1 0\nendloop\n", ":8: file ends where 'endfacet' is expected"},
        {"vertex 0 1 0\nendloop\nendfacet\n", ":9: file ends where 'endsolid' is expected"},
        {"vertex 0 1 0\nendloop\nendfacet\nface",
         ":9: 'face' where 'facet' or 'endsolid' is expected"},
        {"vertex 0 1 0\nendloop\nendfacet\nendsolid\nfacet",
         ":10: 'facet' where 'solid' is expected"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[256];
        snprintf(text, sizeof text, "%s%s", start, cases[i][0]);
        expect_text_error(text, cases[i][1]);
    }
    expect_text_error("solid nothing\nendsolid nothing\n",
                      ": no triangles, so it is no surface; export it again");
    expect_text_error("solid", ":1: file ends where 'endsolid' is expected");
    expect_text_error("solid x\nfacet\nouter", ":3: 'outer' where 'normal' is expected");
}

// A binary STL of `count` copies of a triangle; the caller frees it.
static unsigned char *make_binary(uint32_t count, size_t *size)
{
    *size = 84 + 50 * (size_t)count;
    unsigned char *bytes = zeroed(1, *size);
    memcpy(bytes, "solid made by a program that should not say so", 46);
    for (int i = 0; i < 4; i++)
        bytes[80 + i] = (unsigned char)(count >> 8 * i);
    const float corner[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    for (uint32_t t = 0; t < count; t++)
        memcpy(bytes + 84 + 50 * t + 12, corner, sizeof corner);
    return bytes;
}

static void put_float(unsigned char *bytes, int triangle, int corner, int axis, float value)
{
    memcpy(bytes + 84 + 50 * triangle + 12 + 12 * corner + 4 * axis, &value, sizeof value);
}

TEST(binary_stl_that_says_solid_is_read)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    size_t size;
    FREED unsigned char *bytes = make_binary(2, &size);
    put_float(bytes, 0, 2, 0, 1.0f); // the same two facets as in the ASCII test
    put_float(bytes, 1, 1, 1, 1.0f);
    put_float(bytes, 1, 2, 2, -0.0f);
    import_bytes(bytes, size, &mesh);
    expect_two_facets(&mesh);
}

TEST(binary_stl_keeps_every_float)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    size_t size;
    FREED unsigned char *bytes = make_binary(1, &size);
    put_float(bytes, 0, 0, 1, 0.1f);
    put_float(bytes, 0, 1, 2, -3.4e5f);
    put_float(bytes, 0, 2, 0, 1e-45f);
    import_bytes(bytes, size, &mesh);
    expect_near(mesh.position[0].y, (double)0.1f, 0.0);
    expect_near(mesh.position[1].z, (double)-3.4e5f, 0.0);
    expect_near(mesh.position[2].x, (double)1e-45f, 0.0);
}

TEST(binary_stl_faults_name_file_and_triangle)
{
    size_t size;
    unsigned char *bytes = make_binary(3, &size);
    put_float(bytes, 2, 1, 0, INFINITY);
    write_bytes(bytes, size);
    expect_error(": face 2 uses node 7, whose position (inf, 0, 0) is not finite");
    put_float(bytes, 1, 0, 2, NAN);
    write_bytes(bytes, size);
    expect_error(": face 1 uses node 3, whose position (0, 0, nan) is not finite");
    free(bytes);

    bytes = make_binary(0, &size);
    write_bytes(bytes, size);
    expect_error(": no triangles, so it is no surface; export it again");
    memset(bytes + 80, 0xff, 4);
    memset(bytes, 'x', 5); // does not say solid
    write_bytes(bytes, size);
    expect_error(
        ": is of no format that is known; expected a mesh (OBJ, STL, PLY, OFF, VTK, MSH) or "
        "labels (NRRD, NIfTI); assimp export FILE NEW.stl converts many others");
    write_bytes(bytes, 60);
    expect_error(
        ": neither text nor a binary STL, which has at least 84 bytes; expected a mesh (OBJ, STL, "
        "PLY, OFF, VTK, MSH) or labels (NRRD, NIfTI); assimp export FILE NEW.stl converts many "
        "others");
    free(bytes);
}

// A tetrahedron with the normals of most writers (0, or of length 1), and `more` bytes behind it.
static unsigned char *make_solid(bool normals, size_t more, size_t *size)
{
    static const float x[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    static const int face[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    const float s = 0.57735027f, normal[4][3] = {{0, 0, -1}, {0, -1, 0}, {s, s, s}, {-1, 0, 0}};
    *size = 84 + 4 * 50 + more;
    unsigned char *bytes = zeroed(1, *size);
    bytes[80] = 4;
    for (int t = 0; t < 4; t++) {
        if (normals)
            memcpy(bytes + 84 + 50 * t, normal[t], sizeof *normal);
        for (int c = 0; c < 3; c++)
            memcpy(bytes + 96 + 50 * t + 12 * c, x[face[t][c]], sizeof *x);
    }
    return bytes;
}

TEST(bytes_behind_the_triangles_of_a_binary_stl_are_counted_and_not_read)
{
    // Fewer than a triangle, as many as one, many; zeros, text, a table of numbers.
    static const size_t more[] = {1, 2, 49, 50, 51, 600, 70000};
    for (size_t i = 0; i < sizeof more / sizeof *more; i++)
        for (int kind = 0; kind < 3; kind++) {
            SCOPED(mesh_destroy) TriMesh mesh;
            MeshImport import;
            Status status = {0};
            size_t size;
            FREED unsigned char *bytes = make_solid(kind != 1, more[i], &size);
            for (size_t k = 0; k < more[i]; k++) {
                const size_t kinds[3] = {0, (size_t) "made by us "[k % 11], 7 * k};
                bytes[284 + k] = (unsigned char)kinds[kind];
            }
            write_bytes(bytes, size);
            expect_ok(mesh_import(path, &mesh, &import, &status), status);
            assert_int_equal(mesh.triangle_count, 4);
            char said[96];
            snprintf(said, sizeof said, "%zu bytes behind the 4 triangles of the STL are not read",
                     more[i]);
            assert_string_equal(import.remarks, said);
        }
}

TEST(a_count_that_the_size_contradicts_is_refused_unless_the_size_is_to_decide)
{
    // Too many, too few, never filled in; sizes with half a record more.
    static const uint32_t counts[] = {0, 1, 3, 5, 300, 1 << 20, UINT32_MAX};
    for (size_t i = 0; i < 2 * sizeof counts / sizeof *counts; i++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        MeshImport import;
        Status status = {0};
        size_t size;
        char said[256];
        const uint32_t count = counts[i / 2];
        FREED unsigned char *bytes = make_solid(i % 2 == 0, i % 2 * 25, &size);
        memcpy(bytes + 80, &count, sizeof count);
        write_bytes(bytes, size);
        snprintf(said, sizeof said,
                 ": binary STL whose header announces %u triangles, while its %zu bytes hold 4; "
                 "pliant-prepare --repair FILE -o NEW.off takes those that it holds",
                 count, size);
        expect_error(said);
        const MeshMending mending = {.miscounted = true};
        expect_ok(mesh_import_mending(path, &mending, &mesh, &import, &status), status);
        assert_int_equal(mesh.triangle_count, 4);
        snprintf(said, sizeof said,
                 "4 triangles are taken, as the file holds, not %u, as its header says", count);
        assert_string_equal(import.remarks, said);
    }
}

// --- frames ---

TEST(a_mesh_in_ras_is_turned_to_lps_in_every_format_that_says_so)
{
    size_t size;
    FREED unsigned char *binary = make_solid(true, 0, &size);
    memcpy(binary, "3D Slicer output. SPACE=RAS", 28);
    static const char *const texts[] = {
        "# 3D Slicer output. SPACE=RAS\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\n"
        "f 2 3 4\nf 1 4 3\n",
        "ply\nformat ascii 1.0\ncomment 3D Slicer output. SPACE=RAS\nelement vertex 4\nproperty "
        "float x\nproperty float y\nproperty float z\nelement face 4\nproperty list uchar int "
        "vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n"
        "3 0 3 2\n",
        "solid 3D Slicer output. SPACE=RAS\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 "
        "0 0"
        "\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"};
    for (int i = 0; i < 7; i++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        MeshImport import;
        Status status = {0};
        char text[512];
        snprintf(text, sizeof text, "%s", texts[i % 3]);
        // The last three say LPS, and are left as they are.
        if (i > 3)
            memcpy(strstr(text, "RAS"), "LPS", 3);
        if (i == 3)
            write_bytes(binary, size);
        else
            write_bytes(text, strlen(text));
        expect_ok(mesh_import(path, &mesh, &import, &status), status);
        Vec3 sum = {0, 0, 0};
        for (int k = 0; k < mesh.node_count; k++)
            sum = vec3_add(sum, mesh.position[k]);
        expect_near(sum.x, i > 3 ? 1.0 : -1.0, 0.0);
        expect_near(sum.y, i > 3 ? 1.0 : -1.0, 0.0);
        assert_int_equal(strncmp(import.remarks, "its first lines state SPACE=RAS", 31) == 0,
                         i <= 3);
        // Turned, not mirrored: what was outside stays so.
        if (i % 3 != 2)
            expect_near(mesh_volume(&mesh), 1.0 / 6.0, 1e-15);
    }
}

// --- any file ---

TEST(what_is_no_file_is_refused)
{
    unlink(path);
    expect_error(": No such file or directory");
    assert_int_equal(mkdir(path, 0700), 0);
    expect_error(": is a folder, not a mesh file");
    assert_int_equal(rmdir(path), 0);
    assert_int_equal(mkfifo(path, 0600), 0);
    expect_error(": is not a file");
    unlink(path);
    write_bytes("", 0);
    expect_error(": the file is empty; export it again");
}

TEST(vtk_of_every_kind_is_read)
{
    // A tetrahedron as one strip, as polygons in single precision behind points, lines and a field,
    // and with data behind; the last in binary, of which a number is a word here.
    static const char head[] = "# vtk DataFile Version 4.2\n3D Slicer output. SPACE=RAS\n";
    static const char points[] = "DATASET POLYDATA\nPOINTS 4 float\n";
    char text[1024];
    for (int kind = 0; kind < 3; kind++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        MeshImport import;
        Status status = {0};
        size_t size =
            (size_t)snprintf(text, sizeof text, "%s%s\n%s%s", head, kind == 2 ? "BINARY" : "ASCII",
                             kind == 1 ? "" : points,
                             kind == 0   ? "0 0 0 1 0 0\n0 1 0 0 0 1\n"
                                           "TRIANGLE_STRIPS 1 7\n6 0 2 1 3 0 2\n"
                             : kind == 1 ? "DATASET POLYDATA\nFIELD FieldData 1\nspace 1 2 int\n"
                                           "7 8\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n"
                                           "VERTICES 1 2\n1 0\nLINES 1 3\n2 0 1\nPOLYGONS 4 16\n"
                                           "3 0 2 1 3 0 1 3 3 1 2 3 3 2 0 3\nPOINT_DATA 4\nx"
                                         : "");
        if (kind == 2) {
            static const float x[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
            static const int cells[16] = {3, 0, 2, 1, 3, 0, 1, 3, 3, 1, 2, 3, 3, 2, 0, 3};
            for (int i = 0; i < 12 + 16; i++) {
                uint32_t bits = i < 12 ? 0 : (uint32_t)cells[i - 12];
                if (i < 12)
                    memcpy(&bits, &x[i], sizeof bits);
                if (i == 12)
                    size += (size_t)snprintf(text + size, sizeof text - size, "\nPOLYGONS 4 16\n");
                for (int k = 3; k >= 0; k--)
                    text[size++] = (char)(bits >> 8 * k);
            }
        }
        write_bytes(text, size);
        expect_ok(mesh_import(path, &mesh, &import, &status), status);
        assert_int_equal(mesh.triangle_count, 4);
        expect_near(mesh_volume(&mesh), 1.0 / 6.0, 1e-15); // exact but for rounding
        assert_int_equal(strncmp(import.remarks, "its first lines state SPACE=RAS", 31), 0);
        assert_int_equal(import.repairs.turned_faces, 0);
    }
    expect_text_error(
        "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_GRID\n",
        ":4: of VTK's data sets POLYDATA and UNSTRUCTURED_GRID are read: in ParaView Extract "
        "Surface makes the first of 'STRUCTURED_GRID'");
}

TEST(other_formats_are_refused_by_name_with_a_cure)
{
    static const struct {
        size_t at, size;
        const char *bytes, *name, *cure;
    } cases[] = {
        {0, 0, "ISO-10303-21;\nHEADER;\n", "STEP", "gmsh FILE -2"},
        {0, 24, "Kaydara FBX Binary  \0\x1a\0", "FBX", "assimp"},
        {0, 12, "glTF\2\0\0\0\4\1\0\0", "binary glTF", "assimp"},
        {0, 0, "\xEF\xBB\xBF{ \"asset\": { \"version\": \"2.0\" } }", "glTF", "assimp"},
        {0, 10, "PK\3\4\24\0\0\0\0\0", "3MF", "unpack it"},
        {0, 10, "\x1f\x8b\10\0\0\0\0\0\0\3", "gzip", "gunzip FILE"},
        {0, 0, "<!DOCTYPE html>\n<html>", "a page of the web", "download"},
        {0, 0, "version https://git-lfs.github.com/spec/v1\n", "Git LFS", "git lfs pull"},
        {0, 8, "\xfe\xff\0v\0 \0\060", "UTF-16", "iconv"},
        {0, 0, "NRRD0004\ntype: uint8\n", "label volume (NRRD)", "voxels = { file"},
        {128, 8, "DICM\2\0\0\0", "DICOM", "segment it"},
        {344, 4, "n+1", "NIfTI", "voxels = { file"},
        {0, 0, "ObjectType = Image\nNDims = 3\n", "MetaImage", "3D Slicer"},
        {0, 0, "NDims = 3\nDimSize = 2 2 2\n", "MetaImage", "3D Slicer"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        // Text behind, as if the file went on; what is told must not need it.
        char bytes[600];
        TriMesh mesh;
        MeshImport import;
        Status status = {0};
        memset(bytes, ' ', sizeof bytes);
        memset(bytes, 0, cases[i].at);
        memcpy(bytes + cases[i].at, cases[i].bytes,
               cases[i].size > 0 ? cases[i].size : strlen(cases[i].bytes));
        write_bytes(bytes, sizeof bytes);
        assert_false(mesh_import(path, &mesh, &import, &status));
        expect_in(status.text, cases[i].name);
        expect_in(status.text, ", which is not read as a mesh; ");
        expect_in(status.text, cases[i].cure);
        assert_null(strchr(status.text, '\n'));
    }
}

// Cut anywhere, a file is either refused with its name or still a whole mesh.
static void expect_no_crash_when_cut(const void *bytes, size_t size)
{
    for (size_t length = 0; length < size; length++)
        is_imported(bytes, length);
}

TEST(file_cut_at_any_byte_does_not_crash)
{
    size_t size;
    FREED unsigned char *binary = make_binary(4, &size);
    const char obj[] = "v 0 0 0\r\nv 1 0 0\nv 0 1 \\\n0\nf 1/1 2//2 3/3/3\nf -1 -2 -3 # end\n";
    expect_no_crash_when_cut(obj, sizeof obj - 1);
    expect_no_crash_when_cut(binary, size);
    expect_no_crash_when_cut(TWO_FACETS, sizeof TWO_FACETS - 1);
}

TEST(binary_stl_cut_at_any_byte_is_refused)
{
    size_t size;
    FREED unsigned char *binary = make_binary(4, &size);
    for (size_t length = 0; length < size; length++) {
        assert_false(is_imported(binary, length));
    }
}

TEST(ascii_stl_without_its_end_is_refused)
{
    size_t end = (size_t)(strstr(TWO_FACETS, "endsolid") - TWO_FACETS) + strlen("endsolid");
    for (size_t length = 0; length < end; length++) {
        assert_false(is_imported(TWO_FACETS, length));
    }
}

TEST(changed_bytes_do_not_crash)
{
    // Every byte of a small file of each kind becomes every other of a nasty set.
    size_t size;
    FREED unsigned char *binary = make_binary(2, &size);
    const char obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const void *const files[3] = {binary, obj, TWO_FACETS};
    const size_t sizes[3] = {size, sizeof obj - 1, sizeof TWO_FACETS - 1};
    const char nasty[] = {0, '\n', '\\', '#', '-', '/', '9', 'e', (char)0x7f, (char)0xff};
    for (int f = 0; f < 3; f++) {
        char copy[1024];
        memcpy(copy, files[f], sizes[f]);
        for (size_t i = 0; i < sizes[f]; i++) {
            for (size_t k = 0; k < sizeof nasty; k++) {
                copy[i] = nasty[k];
                is_imported(copy, sizes[f]);
            }
            copy[i] = ((const char *)files[f])[i];
        }
    }
}
