// SPDX-License-Identifier: MIT
#include "test.h"
#include "sample_mesh.h"

static void corners_of_face(const LatticeMesh *mesh, int face, int corner[3][3])
{
    for (int k = 0; k < 3; k++)
        memcpy(corner[k], mesh->point[mesh->face[face][k]], sizeof corner[k]);
}

// Twice the area vector of a triangle between lattice points.
static void area_of_face(const LatticeMesh *mesh, int face, int area[3])
{
    int p[3][3], u[3], v[3];
    corners_of_face(mesh, face, p);
    for (int d = 0; d < 3; d++) {
        u[d] = p[1][d] - p[0][d];
        v[d] = p[2][d] - p[0][d];
    }
    for (int d = 0; d < 3; d++)
        area[d] = u[(d + 1) % 3] * v[(d + 2) % 3] - u[(d + 2) % 3] * v[(d + 1) % 3];
}

// Each square lies between its element and void, looks there, and is divided from its lowest to its
// highest corner; there are as many as cells have faces to void.
static void expect_squares(const Sample *sample)
{
    const LatticeMesh *mesh = &sample->mesh;
    for (int f = 0; f < mesh->face_count; f++) {
        int p[3][3], area[3], cell[3], low[3], high[3];
        corners_of_face(mesh, f, p);
        area_of_face(mesh, f, area);
        assert_int_equal(abs(area[0]) + abs(area[1]) + abs(area[2]), 1);
        for (int d = 0; d < 3; d++) {
            low[d] = high[d] = p[0][d];
            for (int k = 1; k < 3; k++) {
                low[d] = p[k][d] < low[d] ? p[k][d] : low[d];
                high[d] = p[k][d] > high[d] ? p[k][d] : high[d];
            }
            cell[d] = low[d] - (area[d] > 0);
        }
        int leaf = layout_leaf_at(&sample->layout, cell[0], cell[1], cell[2]);
        assert_int_equal(mesh->face_element[f], leaf);
        assert_int_equal(sample->layout.leaf[leaf].level, 0);
        assert_int_equal(layout_leaf_at(&sample->layout, cell[0] + area[0], cell[1] + area[1],
                                        cell[2] + area[2]),
                         -1);
        int diagonal = 0;
        for (int k = 0; k < 3; k++)
            diagonal += memcmp(p[k], low, sizeof low) == 0 || memcmp(p[k], high, sizeof high) == 0;
        assert_int_equal(diagonal, 2);
        int partner_area[3];
        area_of_face(mesh, f ^ 1, partner_area);
        assert_memory_equal(area, partner_area, sizeof area);
        assert_int_equal(mesh->face_element[f ^ 1], leaf);
    }
    long open = 0;
    const int *n = sample->lattice.count;
    for (int k = 0; k < n[2]; k++)
        for (int j = 0; j < n[1]; j++)
            for (int i = 0; i < n[0]; i++)
                for (int side = 0; side < 6; side++) {
                    int o[3] = {0, 0, 0};
                    o[side / 2] = side & 1 ? 1 : -1;
                    open += lattice_label(&sample->lattice, i, j, k) != 0 &&
                            lattice_label(&sample->lattice, i + o[0], j + o[1], k + o[2]) == 0;
                }
    assert_int_equal(mesh->face_count, 2 * open);
}

TEST(squares_lie_between_solid_and_void)
{
    on_all_sorts(expect_squares, 20, 37);
}

// By Gauss: the volume inside the triangles is a sixth of the sum of p . (twice the area vector)
// over any corner p of each.
static void expect_volume(const Sample *sample)
{
    long volume = 0;
    for (int f = 0; f < sample->mesh.face_count; f++) {
        int p[3][3], area[3];
        corners_of_face(&sample->mesh, f, p);
        area_of_face(&sample->mesh, f, area);
        for (int d = 0; d < 3; d++)
            volume += p[0][d] * area[d];
    }
    assert_int_equal(volume, 6 * lattice_solid(&sample->lattice));
}

TEST(outer_faces_enclose_the_cells_exactly)
{
    on_all_sorts(expect_volume, 20, 41);
}

// Whether two squares across an edge belong to one solid corner: of the four cells around the edge
// their two are the same, or faces among the four join them.
static bool share_a_corner(const Sample *sample, int a, int b, const int edge[2][3])
{
    if (a == b)
        return true;
    const int *p = sample->layout.leaf[a].cell, *q = sample->layout.leaf[b].cell;
    int steps = abs(p[0] - q[0]) + abs(p[1] - q[1]) + abs(p[2] - q[2]);
    if (steps == 1)
        return true;
    if (steps != 2)
        return false;
    // Opposite of one another: one of the other two joins them.
    for (int side = 0; side < 2; side++) {
        int at[3], turn = 0;
        for (int d = 0; d < 3; d++) {
            at[d] = p[d];
            if (p[d] != q[d] && turn++ == side)
                at[d] = q[d];
            if (edge[0][d] == edge[1][d] && abs(2 * at[d] + 1 - 2 * edge[0][d]) != 1)
                return false;
        }
        if (layout_leaf_at(&sample->layout, at[0], at[1], at[2]) >= 0)
            return true;
    }
    return false;
}

static void expect_neighbors(const Sample *sample)
{
    const LatticeMesh *mesh = &sample->mesh;
    for (int f = 0; f < mesh->face_count; f++)
        for (int k = 0; k < 3; k++) {
            int a = mesh->face[f][k], b = mesh->face[f][(k + 1) % 3], back = 0;
            int other = mesh->face_neighbor[f][k], edge[2][3];
            assert_true(other >= 0 && other < mesh->face_count && other != f);
            for (int m = 0; m < 3; m++)
                if (mesh->face[other][m] == b && mesh->face[other][(m + 1) % 3] == a) {
                    assert_int_equal(mesh->face_neighbor[other][m], f);
                    back++;
                }
            assert_int_equal(back, 1);
            memcpy(edge[0], mesh->point[a], sizeof edge[0]);
            memcpy(edge[1], mesh->point[b], sizeof edge[1]);
            assert_true(share_a_corner(sample, mesh->face_element[f], mesh->face_element[other],
                                       (const int(*)[3])edge));
            assert_int_equal(mesh->piece[a], mesh->piece[mesh->face[other][0]]);
        }
}

TEST(neighbors_lie_around_the_same_solid_corner)
{
    on_all_sorts(expect_neighbors, 20, 43);
}

// Vertices minus edges plus faces of the outer surface.
static int euler(const LatticeMesh *mesh)
{
    return mesh->surface_count - mesh->face_count / 2;
}

TEST(surfaces_have_the_euler_number_of_their_shape)
{
    Sample sample;
    sample_mesh(&sample, sample_ball(32), 2);
    assert_int_equal(euler(&sample.mesh), 2);
    drop(&sample);
    Lattice ring = sample_box(12, 12, 3); // with a hole through it
    for (int k = 0; k < 3; k++)
        for (int j = 4; j < 8; j++)
            for (int i = 4; i < 8; i++)
                ring.label[lattice_index(&ring, i, j, k)] = 0;
    sample_mesh(&sample, ring, 2);
    assert_int_equal(euler(&sample.mesh), 0);
    drop(&sample);
    Lattice shell = sample_box(9, 9, 9); // around one void cell
    shell.label[lattice_index(&shell, 4, 4, 4)] = 0;
    sample_mesh(&sample, shell, 2);
    assert_int_equal(euler(&sample.mesh), 4);
    drop(&sample);
}
