// SPDX-License-Identifier: MIT
// Voxelised meshes against another inside test: the solid angle under which a point sees the mesh.
#include "effort.h"
#include "test.h"
#include "random.h"

#include "geometry/generator.h"
#include "geometry/lattice.h"

static const double PI = 3.14159265358979323846;

// --- meshes ---

// Takes over `b`.
static void append(TriMesh *a, TriMesh *b)
{
    TriMesh sum;
    mesh_create(&sum, a->node_count + b->node_count, a->triangle_count + b->triangle_count);
    memcpy(sum.position, a->position, (size_t)a->node_count * sizeof *a->position);
    memcpy(sum.position + a->node_count, b->position, (size_t)b->node_count * sizeof *b->position);
    memcpy(sum.triangle, a->triangle, (size_t)a->triangle_count * sizeof *a->triangle);
    for (int t = 0; t < b->triangle_count; t++)
        for (int c = 0; c < 3; c++)
            sum.triangle[a->triangle_count + t][c] = b->triangle[t][c] + a->node_count;
    mesh_destroy(a);
    mesh_destroy(b);
    *a = sum;
}

static TriMesh make_cuboid(Vec3 low, Vec3 high)
{
    // Each side as two triangles, counter-clockwise from outside; corner x + 2 y + 4 z.
    static const int side[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                    {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                    {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    TriMesh mesh;
    mesh_create(&mesh, 8, 12);
    for (int n = 0; n < 8; n++)
        mesh.position[n] =
            vec3(n & 1 ? high.x : low.x, n & 2 ? high.y : low.y, n & 4 ? high.z : low.z);
    memcpy(mesh.triangle, side, sizeof side);
    return mesh;
}

// Around the z axis: `big` to the middle of the tube, `small` its radius.
static TriMesh make_torus(int along, int around, double big, double small)
{
    TriMesh mesh;
    mesh_create(&mesh, along * around, 2 * along * around);
    for (int i = 0; i < along; i++)
        for (int j = 0; j < around; j++) {
            double u = 2.0 * PI * i / along, v = 2.0 * PI * j / around;
            double r = big + small * cos(v);
            mesh.position[i * around + j] = vec3(r * cos(u), r * sin(u), small * sin(v));
            int a = i * around + j, b = (i + 1) % along * around + j;
            int c = (i + 1) % along * around + (j + 1) % around;
            int d = i * around + (j + 1) % around;
            const int two[2][3] = {{a, b, c}, {a, c, d}};
            memcpy(mesh.triangle[2 * a], two, sizeof two);
        }
    return mesh;
}

static TriMesh make_ball(int subdivisions, double radius, Vec3 center)
{
    TriMesh mesh;
    assert_true(generate_ico_sphere(&mesh, subdivisions, radius, &(Status){0}));
    mesh_place(&mesh, 1.0, vec3(0.3, -0.7, 0.2), center);
    return mesh;
}

static void turn_inside_out(TriMesh *mesh)
{
    for (int t = 0; t < mesh->triangle_count; t++) {
        int corner = mesh->triangle[t][0];
        mesh->triangle[t][0] = mesh->triangle[t][1];
        mesh->triangle[t][1] = corner;
    }
}

// --- the other inside test ---

// How often the mesh winds around a point: its solid angle over 4 pi (van Oosterom and Strackee
// 1983, eq. 8).
static double winding(const TriMesh *mesh, Vec3 point)
{
    double angle = 0.0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        Vec3 a = vec3_sub(mesh->position[mesh->triangle[t][0]], point);
        Vec3 b = vec3_sub(mesh->position[mesh->triangle[t][1]], point);
        Vec3 c = vec3_sub(mesh->position[mesh->triangle[t][2]], point);
        double la = vec3_length(a), lb = vec3_length(b), lc = vec3_length(c);
        double under =
            la * lb * lc + vec3_dot(a, b) * lc + vec3_dot(b, c) * la + vec3_dot(c, a) * lb;
        angle += 2.0 * atan2(vec3_dot(a, vec3_cross(b, c)), under);
    }
    return angle / (4.0 * PI);
}

// Asks for points of the lattice and a margin around it, which are inside by parity, or where
// parts overlap (`united`) wherever the mesh winds around them. Returns how many it asked.
static int compare_inside(const TriMesh *mesh, const Lattice *lattice, int points, bool united,
                          uint64_t *seed)
{
    int asked = 0;
    for (int p = 0; p < points; p++) {
        int at[3];
        for (int a = 0; a < 3; a++)
            at[a] = random_below(seed, lattice->count[a] + 4) - 2;
        double turns = winding(mesh, lattice_point(lattice, at[0] + 0.5, at[1] + 0.5, at[2] + 0.5));
        // On the surface it is undecided: the angle jumps there, so nothing but rounding is
        // between whole numbers elsewhere.
        if (fabs(turns - rint(turns)) > 1e-6)
            continue;
        asked++;
        int inside = (int)fabs(united ? rint(turns) != 0.0 : fmod(rint(turns), 2.0));
        if (lattice_label(lattice, at[0], at[1], at[2]) != inside)
            fail_msg("cell %d %d %d is %d, winding %g", at[0], at[1], at[2],
                     lattice_label(lattice, at[0], at[1], at[2]), turns);
    }
    return asked;
}

// Consumes the mesh.
static void check_mesh(TriMesh *mesh, int cells, bool united, uint64_t *seed)
{
    SCOPED(lattice_destroy) Lattice lattice, other;
    Status status = {0};
    double size = mesh_extent(mesh) / cells;
    if (!voxelise(&lattice, mesh, size, false, &status))
        fail_msg("%s", status.text);
    assert_true(compare_inside(mesh, &lattice, EFFORT(4000), united, seed) > EFFORT(4000) * 9 / 10);
    // Which way the mesh faces, and the first corner of a triangle, are nothing to what is inside.
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int old[3] = {mesh->triangle[t][0], mesh->triangle[t][1], mesh->triangle[t][2]};
        const int k = random_below(seed, 3);
        for (int c = 0; c < 3; c++)
            mesh->triangle[t][c] = old[(k + 2 * c) % 3];
    }
    assert_true(voxelise(&other, mesh, size, false, &status));
    assert_memory_equal(other.count, lattice.count, sizeof lattice.count);
    assert_memory_equal(&other.origin, &lattice.origin, sizeof lattice.origin);
    assert_memory_equal(other.label, lattice.label,
                        (size_t)(lattice.count[0] * lattice.count[1] * lattice.count[2]));
    mesh_destroy(mesh);
}

TEST(cells_are_inside_as_the_solid_angle_says)
{
    uint64_t seed = 3;
    TriMesh mesh = make_ball(2, 1.0, vec3(0.1, 0.2, -5.0)), other;
    check_mesh(&mesh, 23, false, &seed);
    assert_true(generate_stomach(&mesh, 188, 0.25, &(Status){0}));
    check_mesh(&mesh, 31, false, &seed);
    mesh = make_torus(24, 12, 1.0, 0.4);
    check_mesh(&mesh, 28, false, &seed);
    mesh = make_torus(24, 12, 1.0, 0.4);
    mesh_place(&mesh, 1e-3, vec3(1.0, 0.5, -0.4), vec3(0.0, 3e-3, 0.0));
    check_mesh(&mesh, 17, false, &seed);
    mesh = make_ball(2, 1.0, vec3(0.0, 0.0, 0.0));
    other = make_ball(1, 0.7, vec3(1.9, 0.3, 0.4));
    append(&mesh, &other);
    other = make_cuboid(vec3(-2.0, -2.0, -2.0), vec3(-1.0, -1.5, -1.0));
    append(&mesh, &other);
    check_mesh(&mesh, 30, false, &seed);
}

TEST(a_shell_within_a_shell_is_a_cavity)
{
    uint64_t seed = 4;
    for (int outward = 0; outward < 2; outward++) {
        TriMesh mesh = make_ball(2, 1.0, vec3(0.0, 0.0, 0.0));
        TriMesh hole = make_ball(2, 0.6, vec3(0.05, 0.0, 0.0)), core;
        if (!outward)
            turn_inside_out(&hole);
        append(&mesh, &hole);
        core = make_ball(1, 0.3, vec3(0.0, 0.1, 0.0));
        append(&mesh, &core);
        SCOPED(lattice_destroy) Lattice lattice;
        assert_true(voxelise(&lattice, &mesh, 1.0 / 15.0, false, &(Status){0}));
        assert_int_equal(lattice_pieces(&lattice), 2);
        check_mesh(&mesh, 26, false, &seed);
    }
}

TEST(parts_that_overlap_are_united)
{
    uint64_t seed = 6;
    // Two boxes, either way around, and a third across both; a vessel that ends inside an organ.
    for (int turned = 0; turned < 2; turned++) {
        TriMesh mesh = make_cuboid(vec3(0.0, 0.0, 0.0), vec3(40.0, 40.0, 40.0)), other;
        other = make_cuboid(vec3(20.0, 0.0, 0.0), vec3(60.0, 40.0, 40.0));
        if (turned)
            turn_inside_out(&other);
        append(&mesh, &other);
        SCOPED(lattice_destroy) Lattice lattice;
        assert_true(voxelise(&lattice, &mesh, 4.0, false, &(Status){0}));
        assert_int_equal(lattice_solid(&lattice), 96000 / 64);
        assert_int_equal(lattice.shells.overlap, 32000 / 64);
        assert_int_equal(lattice.shells.inner, 0);
        assert_int_equal(lattice_pieces(&lattice), 1);
        mesh_destroy(&mesh);
    }
    TriMesh mesh = make_ball(3, 1.0, vec3(0.0, 0.0, 0.0)), other;
    other = make_cuboid(vec3(0.3, -0.2, -0.2), vec3(1.7, 0.2, 0.2));
    append(&mesh, &other);
    check_mesh(&mesh, 30, true, &seed);
    // A tube that crosses itself: its ring is smaller than it is thick.
    mesh = make_torus(32, 16, 0.5, 0.7);
    check_mesh(&mesh, 30, true, &seed);
    // Many at one place, turned at random.
    mesh = make_cuboid(vec3(-1.0, -1.0, -1.0), vec3(1.0, 1.0, 1.0));
    for (int i = 0; i < 300; i++) {
        other = make_cuboid(vec3(-1.0, -1.0, -1.0), vec3(1.0, 1.0, 1.0));
        if (random_below(&seed, 2) == 0)
            turn_inside_out(&other);
        append(&mesh, &other);
    }
    SCOPED(lattice_destroy) Lattice lattice;
    assert_true(voxelise(&lattice, &mesh, 0.25, false, &(Status){0}));
    assert_int_equal(lattice_solid(&lattice), 512);
    assert_int_equal(lattice.shells.overlap, 300 * 512);
    mesh_destroy(&mesh);
}

TEST(a_part_within_another_is_a_hole_or_filled_and_counted)
{
    // 60 and 30 mm, and one of 12 mm in the hole: 216000, 27000 and 1728 mm3, in cells of 27.
    for (int filled = 0; filled < 2; filled++)
        for (int turned = 0; turned < 2; turned++) {
            TriMesh mesh = make_cuboid(vec3(-30.0, -30.0, -30.0), vec3(30.0, 30.0, 30.0)), other;
            other = make_cuboid(vec3(-15.0, -15.0, -15.0), vec3(15.0, 15.0, 15.0));
            if (turned)
                turn_inside_out(&other);
            append(&mesh, &other);
            other = make_cuboid(vec3(-6.0, -6.0, -6.0), vec3(6.0, 6.0, 6.0));
            append(&mesh, &other);
            SCOPED(lattice_destroy) Lattice lattice;
            assert_true(voxelise(&lattice, &mesh, 3.0, filled, &(Status){0}));
            assert_int_equal(lattice_solid(&lattice), filled ? 8000 : 8000 - 1000 + 64);
            assert_int_equal(lattice.shells.count, 3);
            assert_int_equal(lattice.shells.inner, 1);
            expect_near(lattice.shells.volume, 27000.0, 1e-10); // rounding of sums of 1e6
            assert_int_equal(lattice.shells.hollow, 1000 - 64);
            assert_int_equal(lattice.shells.overlap, 0);
            assert_int_equal(lattice.shells.claimed, 8000 + 1000 + 64);
            mesh_destroy(&mesh);
        }
    // A vessel that ends in the hole is not within: what it fills of the hole is tissue.
    TriMesh mesh = make_cuboid(vec3(-30.0, -30.0, -30.0), vec3(30.0, 30.0, 30.0)), other;
    other = make_cuboid(vec3(-15.0, -15.0, -15.0), vec3(15.0, 15.0, 15.0));
    append(&mesh, &other);
    other = make_cuboid(vec3(0.0, -6.0, -6.0), vec3(45.0, 6.0, 6.0));
    append(&mesh, &other);
    SCOPED(lattice_destroy) Lattice lattice;
    assert_true(voxelise(&lattice, &mesh, 3.0, false, &(Status){0}));
    assert_int_equal(lattice.shells.inner, 1);
    assert_int_equal(lattice_solid(&lattice), 8000 - 1000 + 16 * (5 + 5));
    mesh_destroy(&mesh);
}

TEST(volume_comes_closer_with_smaller_cells)
{
    SCOPED(mesh_destroy) TriMesh mesh = make_ball(4, 0.05, vec3(0.3, -0.2, 0.1));
    double volume = mesh_volume(&mesh);
    for (int cells = 8; cells <= 128; cells *= 2) {
        SCOPED(lattice_destroy) Lattice lattice;
        double size = 0.1 / cells;
        assert_true(voxelise(&lattice, &mesh, size, false, &(Status){0}));
        double error = (double)lattice_solid(&lattice) * size * size * size / volume - 1.0;
        printf("%3d cells across: volume off by %+.2e\n", cells, error);
        // The pi n^2 cells at the surface of n across are each wrong by up to half a cell, evenly
        // (sd 0.29), but 48 at a time in the same way, by the symmetry of ball and lattice. Three
        // standard deviations, over pi/6 n^3 cells.
        double deviation = 0.29 * 48.0 * sqrt(PI * cells * cells / 48.0);
        expect_near(error, 0.0, 3.0 * deviation / (PI / 6.0 * pow(cells, 3.0)));
    }
}

// --- cells exactly on faces, edges and corners ---

TEST(box_of_whole_cells_is_filled_exactly)
{
    static const double sizes[] = {1.0, 0.1, 0.003125, 1.0 / 3.0};
    for (int s = 0; s < 4; s++) {
        double h = sizes[s];
        SCOPED(mesh_destroy)
        TriMesh mesh =
            make_cuboid(vec3(0.7, -0.3, 5.0), vec3(0.7 + 5 * h, -0.3 + 3 * h, 5 + 7 * h));
        SCOPED(lattice_destroy) Lattice lattice;
        assert_true(voxelise(&lattice, &mesh, h, false, &(Status){0}));
        assert_int_equal(lattice.count[0], 5);
        assert_int_equal(lattice.count[1], 3);
        assert_int_equal(lattice.count[2], 7);
        assert_int_equal(lattice_solid(&lattice), 105);
        expect_near(lattice.origin.x, 0.7, 1e-14); // roundings of numbers below 8
        expect_near(lattice.origin.y, -0.3, 1e-14);
        expect_near(lattice.origin.z, 5.0, 1e-14);
    }
}

// Two small cubes at opposite corners, so that the lattice of whatever is between is always
// [-8, 8]^3.
static void append_markers(TriMesh *mesh)
{
    TriMesh low = make_cuboid(vec3(-8.0, -8.0, -8.0), vec3(-7.0, -7.0, -7.0));
    TriMesh high = make_cuboid(vec3(7.0, 7.0, 7.0), vec3(8.0, 8.0, 8.0));
    append(mesh, &low);
    append(mesh, &high);
}

static Lattice voxelise_marked(TriMesh *mesh)
{
    Lattice lattice;
    Status status = {0};
    append_markers(mesh);
    if (!voxelise(&lattice, mesh, 1.0, false, &status))
        fail_msg("%s", status.text);
    for (int a = 0; a < 3; a++)
        assert_int_equal(lattice.count[a], 16);
    mesh_destroy(mesh);
    return lattice;
}

TEST(centres_on_the_low_sides_are_inside_and_on_the_high_sides_outside)
{
    TriMesh mesh = make_cuboid(vec3(-3.5, -2.5, -0.5), vec3(1.5, 0.5, 3.5));
    SCOPED(lattice_destroy) Lattice lattice = voxelise_marked(&mesh);
    assert_int_equal(lattice_solid(&lattice), 2 + 5 * 3 * 4);
    for (int k = 0; k < 16; k++)
        for (int j = 0; j < 16; j++)
            for (int i = 0; i < 16; i++) {
                Vec3 c = lattice_point(&lattice, i + 0.5, j + 0.5, k + 0.5);
                bool in = c.x >= -3.5 && c.x < 1.5 && c.y >= -2.5 && c.y < 0.5 && c.z >= -0.5 &&
                          c.z < 3.5;
                in |= i + j + k == 0 || i + j + k == 45;
                assert_int_equal(lattice_label(&lattice, i, j, k), in);
            }
}

// A point in a cube, or on its sides, and each triangle of the cube's sides make a tetrahedron:
// together they are the cube, so every centre, also those on faces, edges and corners of several,
// belongs to exactly one.
TEST(parts_of_a_whole_share_out_its_cells)
{
    uint64_t seed = 9;
    for (int repeat = 0; repeat < EFFORT(60); repeat++) {
        double h = repeat % 2 == 0 ? 4.0 : 3.5; // sides between centres, or on them
        int steps = (int)(4.0 * h);
        double at[3];
        for (int a = 0; a < 3; a++)
            at[a] = 0.5 * random_below(&seed, steps + 1) - h;
        SCOPED(mesh_destroy) TriMesh cube = make_cuboid(vec3(-h, -h, -h), vec3(h, h, h));
        int count[16][16][16] = {0};
        for (int t = 0; t < 12; t++) {
            static const int side[4][3] = {{0, 1, 2}, {3, 1, 0}, {3, 2, 1}, {3, 0, 2}};
            TriMesh part;
            mesh_create(&part, 4, 4);
            for (int c = 0; c < 3; c++)
                part.position[c] = cube.position[cube.triangle[t][c]];
            part.position[3] = vec3(at[0], at[1], at[2]);
            memcpy(part.triangle, side, sizeof side);
            SCOPED(lattice_destroy) Lattice lattice = voxelise_marked(&part);
            for (int k = 0; k < 16; k++)
                for (int j = 0; j < 16; j++)
                    for (int i = 0; i < 16; i++)
                        count[k][j][i] += lattice_label(&lattice, i, j, k);
        }
        SCOPED(lattice_destroy) Lattice whole;
        TriMesh again = make_cuboid(vec3(-h, -h, -h), vec3(h, h, h));
        whole = voxelise_marked(&again);
        for (int k = 0; k < 16; k++)
            for (int j = 0; j < 16; j++)
                for (int i = 0; i < 16; i++) {
                    int marker = i + j + k == 0 || i + j + k == 45 ? 12 : 0;
                    int expected = marker != 0 ? marker : lattice_label(&whole, i, j, k);
                    assert_int_equal(count[k][j][i], expected);
                }
    }
}

// Triangles without thickness and others on top of each other are met too.
TEST(flat_parts_of_a_mesh_hold_no_cell)
{
    TriMesh mesh = make_cuboid(vec3(-3.0, -3.0, -3.0), vec3(3.0, 3.0, 3.0));
    TriMesh flat = make_cuboid(vec3(-6.5, -6.5, 5.5), vec3(6.5, 6.5, 5.5));
    append(&mesh, &flat);
    flat = make_cuboid(vec3(5.5, -6.5, -6.5), vec3(5.5, 6.5, 4.5));
    append(&mesh, &flat);
    flat = make_cuboid(vec3(-6.5, 5.5, -6.5), vec3(4.5, 5.5, 4.5));
    append(&mesh, &flat);
    SCOPED(lattice_destroy) Lattice lattice = voxelise_marked(&mesh);
    assert_int_equal(lattice_solid(&lattice), 2 + 216);
}

// --- refusals ---

static void refuse(TriMesh *mesh, double size, const char *text)
{
    Lattice lattice;
    Status status = {0};
    assert_false(voxelise(&lattice, mesh, size, false, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    assert_string_equal(status.text, text);
    assert_null(lattice.label);
}

TEST(meshes_with_borders_are_refused)
{
    TriMesh mesh;
    assert_true(generate_sheet(&mesh, 3, 3, 1.0, 1.0, &(Status){0}));
    refuse(&mesh, 0.1,
           "the mesh is not closed: no other triangle borders the one at the edge between nodes 0 "
           "and 1, so it has no inside; MeshLab's Close Holes gives it one");
    mesh_destroy(&mesh);
    mesh = make_cuboid(vec3(0.0, 0.0, 0.0), vec3(1.0, 1.0, 1.0));
    mesh.triangle_count = 11; // {3, 7, 5} is missing
    refuse(&mesh, 0.1,
           "the mesh is not closed: no other triangle borders the one at the edge between nodes 3 "
           "and 5, so it has no inside; MeshLab's Close Holes gives it one");
    mesh_destroy(&mesh);
}

TEST(unfit_sizes_are_refused_with_one_that_would_do)
{
    TriMesh mesh = make_cuboid(vec3(0.0, 0.0, 0.0), vec3(1.0, 1.0, 1.0));
    refuse(&mesh, 0.0, "cells of 0 m are not possible");
    refuse(&mesh, -1.0, "cells of -1 m are not possible");
    refuse(&mesh, (double)INFINITY, "cells of inf m are not possible");
    refuse(&mesh, 1e-3,
           "cells of 0.001 m fill the box of the mesh with 1e+09, more than 268435456, or 65536 "
           "along an axis; 0.0016 m would do");
    refuse(&mesh, 0.0035, "cells of 0.0035 m make 23393656, more than 16777216; 0.004 m would do");
    SCOPED(lattice_destroy) Lattice lattice;
    Status status = {0};
    assert_false(voxelise(&lattice, &mesh, 1e-300, false, &status));
    assert_non_null(strstr(status.text, "; 0.0016 m would do"));
    assert_true(voxelise(&lattice, &mesh, 0.004, false, &(Status){0}));
    assert_int_equal(lattice_solid(&lattice), 250 * 250 * 250);
    mesh_destroy(&mesh);
    mesh = make_torus(12, 6, 1.0, 0.1);
    refuse(&mesh, 3.0, "no centre of a cell of 3 m is inside the mesh; smaller cells would be");
    mesh_destroy(&mesh);
    mesh = make_cuboid(vec3(0.0, 0.0, 0.0), vec3(1e5, 1.0, 1.0));
    refuse(&mesh, 1.0,
           "cells of 1 m fill the box of the mesh with 1e+05, more than 268435456, or 65536 along "
           "an axis; 1.6 m would do");
    mesh_destroy(&mesh);
}
