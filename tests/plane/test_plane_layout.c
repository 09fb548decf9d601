// SPDX-License-Identifier: MIT
// Elements of plane bodies (Miyazaki et al. 2004, sections 2.3 and 3.1), and the vertices that they
// share.
#include "test.h"
#include "mesh_check.h"
#include "random.h"
#include "remainder.h"
#include "plane/mesh.h"

// The paper's round object: the centre rule gives 812 cells.
static void make_disc(Lattice *lattice)
{
    assert_true(lattice_disc(lattice, 16.0, 1.0, &(Status){0}));
}

static void make_square(Lattice *lattice, int cells)
{
    const int count[3] = {cells, cells, 1};
    assert_true(lattice_box(lattice, count, 1.0, &(Status){0}));
}

// Blobs with holes, notches, and with two materials if wanted.
static void make_random(Lattice *lattice, uint64_t *seed, int materials)
{
    const int count[3] = {20 + random_below(seed, 30), 20 + random_below(seed, 30), 1};
    assert_true(lattice_create(lattice, count, 1.0, &(Status){0}));
    int blobs = 2 + random_below(seed, 6);
    for (int b = 0; b < blobs; b++) {
        double x = random_between(seed, 0, count[0]), y = random_between(seed, 0, count[1]);
        double r = random_between(seed, 2, 16);
        int label = b % 3 == 2 ? 0 : 1 + random_below(seed, materials);
        for (int j = 0; j < count[1]; j++)
            for (int i = 0; i < count[0]; i++)
                if (hypot(i + 0.5 - x, j + 0.5 - y) < r)
                    lattice->label[lattice_index(lattice, i, j, 0)] = (unsigned char)label;
    }
    for (int k = 0; k < 4; k++) // notches of one cell
        lattice->label[lattice_index(lattice, random_below(seed, count[0]),
                                     random_below(seed, count[1]), 0)] = 0;
}

static void expect_counts(const PlaneLayout *layout, const int *expected, int total)
{
    int count[PLANE_LEVELS_MAX + 1] = {0};
    for (int e = 0; e < layout->element_count; e++)
        count[layout->element[e].level]++;
    for (int level = 0; level <= layout->levels; level++)
        assert_int_equal(count[level], expected[level]);
    assert_int_equal(layout->element_count, total);
}

// Section 2.3: "it is constructed by 172 elements"; Fig. 4.
TEST(disc_has_the_papers_172_elements)
{
    SCOPED(lattice_destroy) Lattice lattice;
    PlaneLayout layout;
    make_disc(&lattice);
    assert_int_equal(lattice_solid(&lattice), 812);
    plane_layout_create(&layout, &lattice, 3);
    expect_counts(&layout, (const int[]){88, 52, 20, 12}, 172);
    plane_layout_destroy(&layout);
    plane_layout_create(&layout, &lattice, 0);
    expect_counts(&layout, (const int[]){812}, 812);
    plane_layout_destroy(&layout);
}

// 4 n along the outline, half of it at each further level, less the corners: below 8 n.
TEST(squares_come_near_eight_n_elements)
{
    static const int cells[] = {32, 64, 128}, elements[] = {228, 480, 988};
    for (int k = 0; k < 3; k++) {
        SCOPED(lattice_destroy) Lattice lattice;
        SCOPED(plane_layout_destroy) PlaneLayout layout;
        make_square(&lattice, cells[k]);
        plane_layout_create(&layout, &lattice, 5);
        assert_int_equal(layout.element_count, elements[k]);
        assert_true(layout.element_count < 8 * cells[k]);
    }
}

// The counting of remainder.h, which makes no elements, is another way to the same numbers.
TEST(elements_are_as_many_as_counted)
{
    uint64_t seed = 21;
    for (int run = 0; run < 60; run++) {
        SCOPED(lattice_destroy) Lattice lattice;
        SCOPED(plane_layout_destroy) PlaneLayout layout;
        make_random(&lattice, &seed, 1 + run % 3);
        plane_layout_create(&layout, &lattice, run % 6);
        long counted[PLANE_LEVELS_MAX + 1];
        int expected[PLANE_LEVELS_MAX + 1], total = 0;
        layout_count_remainder(&lattice, 2, run % 6, counted);
        for (int level = 0; level <= run % 6; level++)
            total += expected[level] = (int)counted[level];
        expect_counts(&layout, expected, total);
    }
}

static int level_of(const PlaneLayout *layout, int i, int j)
{
    int e = plane_layout_at(layout, i, j);
    return e < 0 ? -1 : layout->element[e].level;
}

TEST(every_cell_has_one_element_and_neighbours_differ_by_a_level)
{
    uint64_t seed = 5;
    for (int run = 0; run < 60; run++) {
        SCOPED(lattice_destroy) Lattice lattice;
        SCOPED(plane_layout_destroy) PlaneLayout layout;
        make_random(&lattice, &seed, 1 + run % 3);
        plane_layout_create(&layout, &lattice, run % 6);
        long cells = 0;
        for (int e = 0; e < layout.element_count; e++) {
            const PlaneElement *element = &layout.element[e];
            assert_true(element->quarters != 0 && element->quarters != 6 && element->quarters != 9);
            int quarters = __builtin_popcount(element->quarters);
            cells += (long)quarters << 2 * element->level >> 2;
        }
        assert_int_equal(cells, lattice_solid(&lattice));
        for (int j = -1; j <= layout.count[1]; j++)
            for (int i = -1; i <= layout.count[0]; i++) {
                int own = plane_layout_at(&layout, i, j), label = lattice_label(&lattice, i, j, 0);
                assert_int_equal(own < 0 ? 0 : layout.element[own].material, label);
                if (own < 0)
                    continue;
                for (int s = 0; s < 2; s++) {
                    int x = i + (s == 0), y = j + (s == 1), other = level_of(&layout, x, y);
                    if (other >= 0)
                        assert_true(abs(other - level_of(&layout, i, j)) <= 1);
                    else // the outline keeps its resolution
                        assert_true(level_of(&layout, i, j) == 0);
                }
            }
    }
}

static double area_of(const PlaneMesh *mesh)
{
    double area = 0.0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *a = mesh->point[mesh->triangle[t][0]], *b = mesh->point[mesh->triangle[t][1]],
                  *c = mesh->point[mesh->triangle[t][2]];
        double twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        assert_true(twice > 0.0);
        area += 0.5 * twice;
    }
    return area;
}

// As a client gets them.
static void expect_conforming(const PlaneMesh *mesh)
{
    size_t n = (size_t)mesh->vertex_count;
    FREED int(*parent)[2] = calloc(n, sizeof *parent);
    FREED signed char *level = calloc(n, sizeof *level);
    FREED Vec3 *position = calloc(n, sizeof *position);
    for (size_t v = 0; v < n; v++) {
        parent[v][0] = parent[v][1] = mesh->id[v];
        position[v] = vec3(mesh->point[v][0], mesh->point[v][1], 0.0);
    }
    BodyMesh body = {
        .topology = 1,
        .node_count = mesh->vertex_count,
        .triangle_count = mesh->triangle_count,
        .node_capacity = mesh->vertex_count,
        .triangle_capacity = mesh->triangle_count,
        .triangle = (const int(*)[3])mesh->triangle,
        .id = mesh->id,
        .origin = mesh->id,
        .parent = (const int(*)[2])parent,
        .piece = mesh->piece,
        .level = level,
    };
    expect_crack_free(&body, NULL, position);
}

TEST(triangles_fill_the_body_without_cracks)
{
    uint64_t seed = 11;
    for (int run = 0; run < 60; run++) {
        SCOPED(lattice_destroy) Lattice lattice;
        SCOPED(plane_layout_destroy) PlaneLayout layout;
        SCOPED(plane_mesh_destroy) PlaneMesh mesh;
        make_random(&lattice, &seed, 1 + run % 2);
        plane_layout_create(&layout, &lattice, run % 6);
        assert_true(plane_mesh_create(&mesh, &layout, NULL, &(Status){0}));
        expect_near(area_of(&mesh), (double)lattice_solid(&lattice), 1e-9); // small whole numbers
        expect_conforming(&mesh);
        // The outline runs between solid and void cells only, one cell at a time.
        long outer = 0;
        for (int j = 0; j <= lattice.count[1]; j++)
            for (int i = 0; i <= lattice.count[0]; i++) {
                bool own = lattice_label(&lattice, i, j, 0) != 0;
                outer += own != (lattice_label(&lattice, i - 1, j, 0) != 0);
                outer += own != (lattice_label(&lattice, i, j - 1, 0) != 0);
            }
        assert_int_equal(mesh.edge_count, outer);
    }
}

TEST(cells_that_touch_in_a_corner_do_not_share_a_vertex)
{
    SCOPED(lattice_destroy) Lattice lattice;
    SCOPED(plane_layout_destroy) PlaneLayout layout;
    SCOPED(plane_mesh_destroy) PlaneMesh mesh;
    make_square(&lattice, 2);
    lattice.label[1] = lattice.label[2] = 0;
    plane_layout_create(&layout, &lattice, 1);
    assert_true(plane_mesh_create(&mesh, &layout, NULL, &(Status){0}));
    assert_int_equal(mesh.vertex_count, 8);
    assert_int_equal(mesh.id[3], 4);         // the point in the middle
    assert_int_equal(mesh.id[4], 4 + 3 * 9); // its slot 3, 9 points in all
    assert_int_equal(mesh.piece[3], 0);
    assert_int_equal(mesh.piece[4], 1);
}

// Fig. 6 and 7: edges broken along a line from the outline inwards release vertices there.
TEST(broken_edges_part_vertices_and_ask_for_quarters)
{
    SCOPED(lattice_destroy) Lattice lattice;
    SCOPED(plane_layout_destroy) PlaneLayout layout;
    PlaneMesh whole, cut;
    Status status = {0};
    make_square(&lattice, 16);
    plane_layout_create(&layout, &lattice, 2);
    unsigned char broken[16 * 16] = {0};
    for (int e = 0; e < layout.element_count; e++)
        for (int q = 0; q < 4; q++)
            if (layout.element[e].quarters >> q & 1)
                assert_false(plane_must_carve(&layout, broken, e, q));
    assert_true(plane_mesh_create(&whole, &layout, broken, &status));
    broken[8] =
        PLANE_BROKEN_RIGHT; // of the cell (8, 0): between it and (9, 0), at the lower outline
    assert_true(plane_mesh_create(&cut, &layout, broken, &status));
    assert_int_equal(cut.vertex_count, whole.vertex_count + 1); // the outline's opens, (9, 1) holds
    // The remainder above the two cells keeps its quarters: none of its vertices was released.
    int above = plane_layout_at(&layout, 8, 1);
    assert_int_equal(layout.element[above].level, 1);
    assert_false(plane_must_carve(&layout, broken, above, 2));
    plane_mesh_destroy(&cut);
    broken[16 + 8] = PLANE_BROKEN_RIGHT; // inside the remainder: dormant
    assert_true(plane_mesh_create(&cut, &layout, broken, &status));
    assert_int_equal(cut.vertex_count, whole.vertex_count + 1);
    plane_mesh_destroy(&cut);
    // Cells torn off along their upper edges release the remainder's lower vertices.
    broken[9] = broken[10] = PLANE_BROKEN_UP;
    assert_true(plane_must_carve(&layout, broken, above, 3));
    plane_mesh_destroy(&whole);
}
