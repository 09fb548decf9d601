// SPDX-License-Identifier: MIT
#include "test.h"
#include "remainder.h"

#include "voxel/layout.h"

static long total_of(const Lattice *lattice, int dimensions, int levels)
{
    long count[VOXEL_LEVELS_MAX + 1], total = 0;
    layout_count_remainder(lattice, dimensions, levels, count);
    for (int level = 0; level <= levels; level++)
        total += count[level];
    return total;
}

static Lattice box_of(int nx, int ny, int nz)
{
    Lattice lattice;
    assert_true(lattice_box(&lattice, (int[3]){nx, ny, nz}, 1.0, &(Status){0}));
    return lattice;
}

// Around a cube one layer of blocks of every size, so long as blocks lie inside: b^3 - (b - 2)^3 of
// b^3 blocks, and of the largest size all. This is the 8 n^2 of Miyazaki et al. 2004, section 2.3:
// 6 n^2 (1 + 1/4 + 1/16 + ...).
TEST(cube_has_one_layer_of_every_size)
{
    for (int n = 16; n <= 64; n *= 2) {
        SCOPED(lattice_destroy) Lattice lattice = box_of(n, n, n);
        for (int levels = 1; levels <= 3; levels++) {
            long expected = 0;
            for (int level = 0; level <= levels; level++) {
                long b = n >> level, inner = b > 2 ? b - 2 : 0;
                expected += b * b * b - (level < levels ? inner * inner * inner : 0);
            }
            assert_int_equal(total_of(&lattice, 3, levels), expected);
        }
        expect_at_most((double)total_of(&lattice, 3, 3), 8.0 * n * n);
    }
}

// The same in the plane, 4 n (1 + 1/2 + 1/4 + ...) = 8 n.
TEST(square_has_one_ring_of_every_size)
{
    static const long known[3] = {228, 480, 988}; // of an independent program
    for (int s = 0; s < 3; s++) {
        int n = 32 << s;
        SCOPED(lattice_destroy) Lattice lattice = box_of(n, n, 1);
        long expected = 0;
        for (int level = 0; level <= VOXEL_LEVELS_MAX; level++) {
            long b = n >> level, inner = b > 2 ? b - 2 : 0;
            if (b >= 2) // a block as large as the square would have nothing left
                expected += b * b - (level < VOXEL_LEVELS_MAX ? inner * inner : 0);
        }
        assert_int_equal(expected, known[s]);
        assert_int_equal(total_of(&lattice, 2, VOXEL_LEVELS_MAX), expected);
    }
}

// The disc of Fig. 4 that fits into 32 x 32 squares: 172 elements after reduction, as printed
// there. (Its 852 squares before reduction are no disc of whole cells by the centre rule, which
// gives 812.)
TEST(disc_of_the_paper_has_172_elements)
{
    SCOPED(lattice_destroy) Lattice lattice;
    assert_true(lattice_disc(&lattice, 16.0, 1.0, &(Status){0}));
    long count[4];
    layout_count_remainder(&lattice, 2, 3, count);
    assert_int_equal(count[0], 88);
    assert_int_equal(count[1], 52);
    assert_int_equal(count[2], 20);
    assert_int_equal(count[3], 12);
}

// Counts of an independent program.
TEST(balls_have_the_known_counts)
{
    static const long expected[2][3] = {{6400, 5496, 5448}, {34568, 23736, 22832}};
    for (int b = 0; b < 2; b++) {
        SCOPED(lattice_destroy) Lattice lattice;
        assert_true(lattice_ball(&lattice, b == 0 ? 16.0 : 32.0, 1.0, &(Status){0}));
        for (int levels = 1; levels <= 3; levels++)
            assert_int_equal(total_of(&lattice, 3, levels), expected[b][levels - 1]);
    }
}

TEST(without_levels_every_cell_counts)
{
    Lattice lattice = box_of(5, 3, 2);
    lattice.label[lattice_index(&lattice, 2, 1, 1)] = 0;
    assert_int_equal(total_of(&lattice, 3, 0), 29);
    lattice_destroy(&lattice);
    lattice = box_of(1, 1, 1);
    assert_int_equal(total_of(&lattice, 3, VOXEL_LEVELS_MAX), 1);
    lattice_destroy(&lattice);
}

// A remainder is of one material: no cell beside another material joins it.
TEST(materials_do_not_mix)
{
    SCOPED(lattice_destroy) Lattice lattice = box_of(16, 8, 1);
    for (int j = 0; j < 8; j++)
        for (int i = 8; i < 16; i++)
            lattice.label[lattice_index(&lattice, i, j, 0)] = 2;
    SCOPED(lattice_destroy) Lattice half = box_of(8, 8, 1);
    assert_int_equal(total_of(&lattice, 2, 2), 2 * total_of(&half, 2, 2));
}

// A square of 6 x 6 with two void cells beside the middle block's opposite corners: two of its
// cells are carved, and the two others, which meet in a point only, go with them. By hand: of the
// nine blocks two keep two cells and two keep one.
TEST(what_meets_in_a_corner_is_no_element)
{
    SCOPED(lattice_destroy) Lattice lattice = box_of(6, 6, 1);
    lattice.label[lattice_index(&lattice, 4, 2, 0)] = 0;
    lattice.label[lattice_index(&lattice, 1, 3, 0)] = 0;
    long count[2];
    layout_count_remainder(&lattice, 2, 1, count);
    assert_int_equal(count[1], 4);
    assert_int_equal(count[0], 34 - 2 * 2 - 2 * 1);
}
