// SPDX-License-Identifier: MIT
#include "test.h"
#include "random.h"

#include "geometry/edges.h"
#include "geometry/generator.h"
#include "geometry/mesh.h"

// A mesh from literal arrays.
static void make_mesh(TriMesh *mesh, int nodes, const Vec3 *position, int triangles,
                      const int (*triangle)[3])
{
    mesh_create(mesh, nodes, triangles);
    if (nodes > 0)
        memcpy(mesh->position, position, (size_t)nodes * sizeof *position);
    if (triangles > 0)
        memcpy(mesh->triangle, triangle, (size_t)triangles * sizeof *triangle);
}

static const Vec3 TETRAHEDRON[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static const int TETRAHEDRON_FACES[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};

// With the first faces alone.
static TriMesh tetrahedron(int faces)
{
    TriMesh mesh;
    make_mesh(&mesh, 4, TETRAHEDRON, faces, TETRAHEDRON_FACES);
    return mesh;
}

TEST(equal_nodes_are_those_with_equal_bits_but_for_the_sign_of_zero)
{
    const Vec3 x[7] = {{0, 0, 0},      {1, 0, 0}, {nextafter(1, 2), 0, 0}, {1, 0, 0}, {0, -0., 0},
                       {1, 0, 5e-324}, {1, 0, 0}};
    const int expected[7] = {0, 1, 2, 1, 0, 5, 1};
    int first[7];
    mesh_find_equal(x, 7, first);
    assert_memory_equal(first, expected, sizeof first);
}

TEST(equal_nodes_are_those_that_comparing_all_pairs_finds)
{
    uint64_t random = 1;
    Vec3 x[600];
    int found[600];
    for (int i = 0; i < 600; i++) // few different values, so that many nodes coincide
        x[i] = vec3(random_below(&random, 6), random_below(&random, 6) * 1e-3,
                    random_below(&random, 6) * -1e5);
    mesh_find_equal(x, 600, found);
    for (int i = 0; i < 600; i++) {
        int first = 0;
        while (x[first].x != x[i].x || x[first].y != x[i].y || x[first].z != x[i].z)
            first++;
        assert_int_equal(found[i], first);
    }
}

TEST(place_scales_then_turns_then_moves)
{
    const Vec3 x[1] = {{1, 2, 3}};
    SCOPED(mesh_destroy) TriMesh mesh;
    make_mesh(&mesh, 1, x, 0, NULL);
    mesh_place(&mesh, 2.0, vec3(0, 0, 2 * atan(1.0)), vec3(10, 20, 30));
    // a quarter turn about z takes (2, 4, 6) to (-4, 2, 6); two roundings of numbers below 64
    expect_near(mesh.position[0].x, 6.0, 2e-14);
    expect_near(mesh.position[0].y, 22.0, 2e-14);
    expect_near(mesh.position[0].z, 36.0, 2e-14);
}

TEST(place_by_nothing_keeps_every_bit)
{
    const Vec3 x[1] = {{0.1, 1.0 / 3.0, 1e-300}};
    SCOPED(mesh_destroy) TriMesh mesh;
    make_mesh(&mesh, 1, x, 0, NULL);
    mesh_place(&mesh, 1.0, vec3(0, 0, 0), vec3(0, 0, 0));
    assert_memory_equal(mesh.position, x, sizeof x);
}

TEST(volume_and_area_of_a_tetrahedron_wherever_it_is)
{
    SCOPED(mesh_destroy) TriMesh mesh = tetrahedron(4);
    expect_near(mesh_volume(&mesh), 1.0 / 6.0, 1e-16);
    expect_near(mesh_area(&mesh), 1.5 + 0.5 * sqrt(3.0), 1e-15);
    // At 1e6 the nodes are whole numbers still, so only the sums round.
    mesh_place(&mesh, 1.0, vec3(0, 0, 0), vec3(1e6, -1e6, 1e6));
    expect_near(mesh_volume(&mesh), 1.0 / 6.0, 1e-16);
}

static void expect_fault(TriMesh *mesh, const char *text, int node, int triangle)
{
    MeshFault fault;
    assert_false(mesh_check(mesh, &fault));
    assert_string_equal(fault.text, text);
    assert_int_equal(fault.node, node);
    assert_int_equal(fault.triangle, triangle);
    mesh_destroy(mesh);
}

TEST(closed_and_open_meshes_are_valid)
{
    SCOPED(mesh_destroy) TriMesh mesh = tetrahedron(4);
    MeshFault fault;
    assert_true(mesh_check(&mesh, &fault));
    mesh.triangle_count = 1;
    mesh.node_count = 3; // one triangle alone
    assert_true(mesh_check(&mesh, &fault));
}

TEST(tiny_and_huge_triangles_have_area)
{
    const double scales[] = {1e-300, 1e-160, 1.0, 1e160, 1e300};
    for (int i = 0; i < 5; i++) {
        SCOPED(mesh_destroy) TriMesh mesh = tetrahedron(4);
        MeshFault fault;
        mesh_place(&mesh, scales[i], vec3(0, 0, 0), vec3(0, 0, 0));
        assert_true(mesh_check(&mesh, &fault));
    }
}

TEST(mesh_without_triangles_is_refused)
{
    TriMesh mesh = tetrahedron(0);
    expect_fault(&mesh, "the mesh has no triangles", -1, -1);
}

TEST(nonfinite_position_is_refused_by_its_file_index)
{
    TriMesh mesh = tetrahedron(4);
    mesh.position[2].y = (double)NAN;
    mesh.file_index[2] = 77;
    expect_fault(&mesh, "node 77 has a position (0, nan, 0) that is not finite", 2, -1);
}

TEST(index_out_of_range_is_refused)
{
    const int wrong[2] = {-1, 4};
    const char *text[2] = {"triangle 3 names node -1 outside [0, 3]",
                           "triangle 3 names node 4 outside [0, 3]"};
    for (int i = 0; i < 2; i++) {
        TriMesh mesh = tetrahedron(4);
        mesh.triangle[3][1] = wrong[i];
        expect_fault(&mesh, text[i], -1, 3);
    }
}

TEST(repeated_node_is_refused)
{
    TriMesh mesh = tetrahedron(4);
    mesh.triangle[1][2] = mesh.triangle[1][0];
    expect_fault(&mesh, "triangle 1 has node 0 twice", 0, 1);
}

TEST(triangle_without_area_is_refused)
{
    // In line but for rounding: 0.1, 0.2 and 0.3 are not exact.
    const Vec3 x[3] = {{0.1, 0.1, 0.1}, {0.2, 0.2, 0.2}, {0.3, 0.3, 0.3}};
    const int t[1][3] = {{0, 1, 2}};
    TriMesh mesh;
    make_mesh(&mesh, 3, x, 1, t);
    expect_fault(&mesh, "triangle 0 (nodes 0, 1, 2) has no area", -1, 0);
    const Vec3 huge[3] = {{1.7e308, 0, 0}, {-1.7e308, 0, 0}, {0, 1, 0}};
    make_mesh(&mesh, 3, huge, 1, t);
    expect_fault(&mesh, "triangle 0 is too large to measure", -1, 0);
}

TEST(unused_node_is_refused)
{
    TriMesh mesh = tetrahedron(1);
    expect_fault(&mesh, "node 3 belongs to no triangle", 3, -1);
}

TEST(edge_of_three_triangles_is_refused)
{
    const Vec3 x[5] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
    const int t[3][3] = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
    TriMesh mesh;
    make_mesh(&mesh, 5, x, 3, t);
    expect_fault(&mesh, "edge between nodes 0 and 1 belongs to 3 triangles, more than two", 0, 2);
}

TEST(opposite_orientations_are_refused)
{
    const Vec3 x[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
    const int t[2][3] = {{0, 1, 2}, {0, 1, 3}};
    TriMesh mesh;
    make_mesh(&mesh, 4, x, 2, t);
    expect_fault(&mesh, "triangles 0 and 1 both run from node 0 to node 1: opposite orientations",
                 0, 1);
}

TEST(bow_tie_is_refused)
{
    // Two triangles that share one corner; then two closed tetrahedra that do.
    const Vec3 x[5] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
    const int t[2][3] = {{0, 1, 2}, {0, 3, 4}};
    TriMesh mesh;
    make_mesh(&mesh, 5, x, 2, t);
    expect_fault(
        &mesh, "the 2 triangles round node 0 touch only in that node: they form more than one fan",
        0, 0);
    mesh_create(&mesh, 7, 8);
    for (int i = 0; i < 4; i++) {
        mesh.position[i] = TETRAHEDRON[i];
        if (i > 0)
            mesh.position[3 + i] = vec3_scale(-1.0, TETRAHEDRON[i]);
        for (int k = 0; k < 3; k++) {
            int corner = TETRAHEDRON_FACES[i][2 - k]; // a mirrored one turns the other way
            mesh.triangle[i][k] = TETRAHEDRON_FACES[i][k];
            mesh.triangle[4 + i][k] = corner == 0 ? 0 : 3 + corner;
        }
    }
    expect_fault(
        &mesh, "the 6 triangles round node 0 touch only in that node: they form more than one fan",
        0, 0);
}

TEST(fault_in_a_large_mesh_is_found)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    MeshFault fault;
    assert_true(generate_ico_sphere(&mesh, 6, 1.0, &(Status){0})); // 81920 triangles
    assert_true(mesh_check(&mesh, &fault));
    int swap = mesh.triangle[70000][0];
    mesh.triangle[70000][0] = mesh.triangle[70000][1];
    mesh.triangle[70000][1] = swap;
    assert_false(mesh_check(&mesh, &fault));
    assert_non_null(strstr(fault.text, "70000"));
}

TEST(random_triangles_never_crash)
{
    // Every soup is judged; what passes must link into a winged-edge table without holes.
    uint64_t random = 7;
    int valid = 0;
    for (int i = 0; i < 50000; i++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        int nodes = 3 + random_below(&random, 4);
        mesh_create(&mesh, nodes, 1 + random_below(&random, 5));
        for (int k = 0; k < nodes; k++)
            mesh.position[k] = random_vec3(&random);
        for (int h = 0; h < 3 * mesh.triangle_count; h++)
            mesh.triangle[h / 3][h % 3] = random_below(&random, nodes + 1) - (i % 50 == 0);
        MeshFault fault;
        if (mesh_check(&mesh, &fault)) {
            SCOPED(winged_destroy) WingedMesh winged;
            winged_create(&winged, &mesh);
            int corners = 0;
            for (int k = 0; k < nodes; k++)
                corners += winged_valence(&winged, k);
            assert_int_equal(corners, 2 * winged.edge_count);
            valid++;
        } else {
            assert_true(fault.text[0] != 0);
        }
    }
    assert_true(valid > 100); // both ways were taken
}

// --- crossings ---

// Adds a needle of three faces and a base around a line along z, from `low` to `high`, to a sheet.
static TriMesh sheet_and_needle(double x, double y, double low, double high, double scale)
{
    TriMesh sheet, mesh;
    assert_true(generate_sheet(&sheet, 12, 12, 1.0, 1.0, &(Status){0}));
    mesh_create(&mesh, sheet.node_count + 4, sheet.triangle_count + 4);
    memcpy(mesh.position, sheet.position, (size_t)sheet.node_count * sizeof *sheet.position);
    memcpy(mesh.triangle, sheet.triangle, (size_t)sheet.triangle_count * sizeof *sheet.triangle);
    const int n = sheet.node_count, face[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    const Vec3 corner[4] = {
        {x - 1e-3, y, low}, {x + 1e-3, y, low}, {x, y + 1e-3, low}, {x, y, high}};
    memcpy(mesh.position + n, corner, sizeof corner);
    for (int t = 0; t < 4; t++)
        for (int k = 0; k < 3; k++)
            mesh.triangle[sheet.triangle_count + t][k] = n + face[t][k];
    mesh_destroy(&sheet);
    mesh_place(&mesh, scale, vec3(0.3, -1.1, 0.7), vec3(0.2, -0.1, 0.4));
    return mesh;
}

TEST(triangles_that_pass_through_each_other_are_counted)
{
    // Within one triangle of the sheet, whose sides are 1/11, all three sides of the needle pass.
    static const struct {
        double low, high;
        long pairs;
    } cases[] = {{-0.2, 0.3, 3}, {0.01, 0.3, 0}, {-0.3, -0.01, 0}, {0.4, -0.1, 3}};
    for (size_t i = 0; i < 4; i++)
        for (double scale = 1e-3; scale < 1e4; scale *= 1e3) {
            SCOPED(mesh_destroy)
            TriMesh mesh = sheet_and_needle(0.018, 0.027, cases[i].low, cases[i].high, scale);
            const MeshCrossings found = mesh_find_crossings(&mesh);
            assert_int_equal(found.pairs, cases[i].pairs);
            assert_true(found.all);
            assert_int_equal(found.first >= 0, cases[i].pairs > 0);
        }
}

TEST(a_sound_surface_does_not_cross_itself)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    assert_true(generate_stomach(&mesh, 2000, 0.25, &(Status){0}));
    assert_int_equal(mesh_find_crossings(&mesh).pairs, 0);
}
