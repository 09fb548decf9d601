// SPDX-License-Identifier: MIT
#include "test.h"
#include "winged.h"

#include "geometry/edges.h"
#include "geometry/generator.h"

// Everything that the table promises, checked against the triangles by plain search.
static void expect_sound(const WingedMesh *winged, const TriMesh *mesh)
{
    assert_int_equal(winged->node_count, mesh->node_count);
    assert_int_equal(winged->face_count, mesh->triangle_count);
    for (int e = 0; e < winged->edge_count; e++) {
        const WingedEdge *edge = &winged->edge[e];
        assert_true(edge->node[0] < edge->node[1]);
        if (e > 0) {
            const WingedEdge *before = edge - 1;
            assert_true(before->node[0] < edge->node[0] ||
                        (before->node[0] == edge->node[0] && before->node[1] < edge->node[1]));
        }
        assert_int_equal(winged_find_edge(winged, edge->node[1], edge->node[0]), e);
        for (int side = 0; side < 2; side++) {
            int face = edge->face[side];
            if (face < 0) {
                assert_int_equal(edge->next[side], -1);
                assert_int_equal(edge->previous[side], -1);
                continue;
            }
            // It runs through the left face from start to end, through the right one backwards.
            int k = 0;
            while (winged->face_edge[face][k] != e)
                assert_true(++k < 3);
            assert_int_equal(mesh->triangle[face][k], edge->node[side]);
            assert_int_equal(mesh->triangle[face][(k + 1) % 3], edge->node[1 - side]);
            assert_int_equal(edge->next[side], winged->face_edge[face][(k + 1) % 3]);
            assert_int_equal(edge->previous[side], winged->face_edge[face][(k + 2) % 3]);
            assert_int_equal(winged->face_neighbor[face][k], edge->face[1 - side]);
        }
        assert_true(edge->face[0] >= 0 || edge->face[1] >= 0);
        assert_int_equal(winged_is_boundary_edge(winged, e),
                         edge->face[0] < 0 || edge->face[1] < 0);
    }
}

// Successive edges round a node enclose one face, counter-clockwise.
static void expect_turning_order(const WingedMesh *winged, const TriMesh *mesh, int node)
{
    int start = winged->node_edge_start[node], valence = winged_valence(winged, node);
    bool border = winged_is_boundary_node(winged, node);
    int faces = winged->node_face_start[node + 1] - winged->node_face_start[node];
    assert_int_equal(faces, border ? valence - 1 : valence);
    for (int i = 0; i < faces; i++) {
        int a = winged_other(winged, winged->node_edge[start + i], node);
        int b = winged_other(winged, winged->node_edge[start + (i + 1) % valence], node);
        int found = 0;
        for (int f = winged->node_face_start[node]; f < winged->node_face_start[node + 1]; f++) {
            const int *corner = mesh->triangle[winged->node_face[f]];
            for (int k = 0; k < 3; k++)
                found += corner[k] == node && corner[(k + 1) % 3] == a && corner[(k + 2) % 3] == b;
        }
        assert_int_equal(found, 1);
    }
    for (int f = winged->node_face_start[node] + 1; f < winged->node_face_start[node + 1]; f++)
        assert_true(winged->node_face[f - 1] < winged->node_face[f]);
    if (border) {
        assert_true(winged_is_boundary_edge(winged, winged->node_edge[start]));
        assert_true(winged_is_boundary_edge(winged, winged->node_edge[start + valence - 1]));
    }
}

// Validates, links, checks everything, and leaves table and mesh to the caller.
static void link_mesh(WingedMesh *winged, const TriMesh *mesh)
{
    MeshFault fault;
    assert_true(mesh_check(mesh, &fault));
    winged_create(winged, mesh);
    expect_sound(winged, mesh);
    for (int i = 0; i < mesh->node_count; i++)
        expect_turning_order(winged, mesh, i);
}

static void expect_shape(const WingedMesh *winged, int edges, int loops, int components)
{
    assert_int_equal(winged->edge_count, edges);
    assert_int_equal(winged_boundary_loops(winged), loops);
    assert_int_equal(winged_components(winged), components);
}

TEST(closed_sphere_links_everything)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    SCOPED(winged_destroy) WingedMesh winged;
    assert_true(generate_uv_sphere(&mesh, 8, 14, 1.0, &(Status){0}));
    link_mesh(&winged, &mesh);
    expect_shape(&winged, 336, 0, 1);
    assert_int_equal(winged_euler(&winged), 2);
    assert_int_equal(winged_valence(&winged, 0), 14);
    assert_int_equal(winged_find_edge(&winged, 0, 113), -1);
    assert_int_equal(winged_find_edge(&winged, 5, 5), -1);
}

TEST(sheet_has_one_border)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    SCOPED(winged_destroy) WingedMesh winged;
    assert_true(generate_sheet(&mesh, 5, 4, 1.0, 1.0, &(Status){0}));
    link_mesh(&winged, &mesh);
    expect_shape(&winged, 4 * 4 + 5 * 3 + 4 * 3, 1, 1); // rows, columns, diagonals
    assert_int_equal(winged_euler(&winged), 1);
    int border = 0;
    for (int i = 0; i < mesh.node_count; i++)
        border += winged_is_boundary_node(&winged, i);
    assert_int_equal(border, 2 * 5 + 2 * 4 - 4);
}

TEST(single_triangle_is_all_border)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    SCOPED(winged_destroy) WingedMesh winged;
    mesh_create(&mesh, 3, 1);
    mesh.position[1].x = mesh.position[2].y = 1.0;
    memcpy(mesh.triangle[0], (int[3]){2, 0, 1}, sizeof mesh.triangle[0]);
    link_mesh(&winged, &mesh);
    expect_shape(&winged, 3, 1, 1);
}

// `count` closed bands of `segments` quads, one above the other; each has two borders.
static void make_bands(TriMesh *mesh, int segments, int count)
{
    mesh_create(mesh, 2 * segments * count, 2 * segments * count);
    for (int i = 0; i < segments * count; i++) {
        double angle = 6.283185307179586 * (i % segments) / segments;
        int base = i / segments * 2 * segments, s = i % segments, next = (s + 1) % segments;
        for (int side = 0; side < 2; side++)
            mesh->position[base + side * segments + s] =
                vec3(cos(angle), sin(angle), side + 3 * (i / segments));
        int a = base + s, b = base + next, c = b + segments, d = a + segments;
        memcpy(mesh->triangle[2 * i], (int[3]){a, b, c}, sizeof mesh->triangle[0]);
        memcpy(mesh->triangle[2 * i + 1], (int[3]){a, c, d}, sizeof mesh->triangle[0]);
    }
}

TEST(bands_have_two_borders_each)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    SCOPED(winged_destroy) WingedMesh winged;
    make_bands(&mesh, 7, 3);
    link_mesh(&winged, &mesh);
    expect_shape(&winged, 3 * (2 * 7 + 2 * 7), 6, 3);
    assert_int_equal(winged_euler(&winged), 0);
}

TEST(node_with_thousands_of_edges_is_linked)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    SCOPED(winged_destroy) WingedMesh winged;
    assert_true(generate_uv_sphere(&mesh, 1, 4000, 1.0, &(Status){0}));
    winged_create(&winged, &mesh);
    expect_sound(&winged, &mesh);
    expect_shape(&winged, 3 * 4000, 0, 1);
    assert_int_equal(winged_valence(&winged, 0), 4000);
    for (int i = 0; i < 4000; i++) { // longitudes ascend seen from above
        int other = winged_other(&winged, winged.node_edge[i], 0);
        assert_int_equal(other, 1 + i);
    }
}

TEST(same_mesh_gives_the_same_table)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    SCOPED(winged_destroy) WingedMesh one, two;
    assert_true(generate_sphere(&mesh, 114, 1.0, &(Status){0}));
    link_mesh(&one, &mesh);
    link_mesh(&two, &mesh);
    size_t edges = (size_t)one.edge_count;
    assert_memory_equal(one.edge, two.edge, edges * sizeof *one.edge);
    assert_memory_equal(one.node_edge, two.node_edge, 2 * edges * sizeof *one.node_edge);
}
