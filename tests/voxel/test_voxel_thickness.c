// SPDX-License-Identifier: MIT
// How thick solids are, from cells alone.
#include "test.h"
#include "lattice_samples.h"

#include "voxel/thickness.h"

static unsigned char *levels_of(const Lattice *lattice, int levels)
{
    unsigned char *level =
        zeroed((size_t)(lattice->count[0] * lattice->count[1] * lattice->count[2]), 1);
    thickness_levels(lattice, levels, level);
    return level;
}

// Plates of t cells: 4 elements of 2^l cells fit across from 4 2^l cells on; one less is taken for
// it, since a ball has its middle in a cell. Away from the rim, where no ball of that size fits.
TEST(plates_have_the_level_of_their_thickness)
{
    enum { WIDE = 48 };
    for (int t = 1; t <= 20; t++) {
        SCOPED(lattice_destroy) Lattice lattice = sample_box(WIDE, WIDE, t);
        FREED unsigned char *level = levels_of(&lattice, 3);
        const int expected = t >= 15 ? 2 : t >= 7 ? 1 : 0;
        for (int k = 0; k < t; k++)
            assert_int_equal(level[lattice_index(&lattice, WIDE / 2, WIDE / 2, k)], expected);
    }
}

// Balls do not reach into edges and corners, elements do.
TEST(edges_and_corners_of_a_thick_body_are_thick)
{
    enum { CELLS = 32, LEVELS = 3 };
    SCOPED(lattice_destroy) Lattice lattice = sample_box(CELLS, CELLS, CELLS);
    FREED unsigned char *level = levels_of(&lattice, LEVELS);
    for (int c = 0; c < CELLS * CELLS * CELLS; c++)
        assert_int_equal(level[c], LEVELS);
}

// True if a cell is nearer than r and an edge to a cell around which all cells nearer than r are
// solid.
static bool is_in_a_ball(const Lattice *lattice, int r, int edge, int i, int j, int k)
{
    const int *n = lattice->count, reach = r + edge;
    for (int m = 0; m < n[0] * n[1] * n[2] && lattice_label(lattice, i, j, k) != 0; m++) {
        const int x = m % n[0], y = m / n[0] % n[1], z = m / n[0] / n[1];
        if ((x - i) * (x - i) + (y - j) * (y - j) + (z - k) * (z - k) >= reach * reach)
            continue;
        bool solid = true;
        for (int c = -r; c <= r && solid; c++)
            for (int b = -r; b <= r && solid; b++)
                for (int a = -r; a <= r && solid; a++)
                    solid = a * a + b * b + c * c >= r * r ||
                            lattice_label(lattice, x + a, y + b, z + c) != 0;
        if (solid)
            return true;
    }
    return false;
}

// Gives the level to all solid cells of a cell's block.
static void give_block(const Lattice *lattice, int l, int i, int j, int k, unsigned char *level)
{
    const int edge = 1 << l;
    for (int c = 0; c < edge * edge * edge; c++) {
        const int x = (i & -edge) + c % edge, y = (j & -edge) + c / edge % edge,
                  z = (k & -edge) + c / edge / edge;
        if (lattice_label(lattice, x, y, z) != 0)
            level[lattice_index(lattice, x, y, z)] = (unsigned char)l;
    }
}

// By the definition, with all balls tried one by one: a thick body with a thin fin.
TEST(levels_are_those_of_the_largest_ball)
{
    enum { LEVELS = 2 };
    SCOPED(lattice_destroy) Lattice lattice = sample_box(22, 20, 18);
    for (int k = 0; k < 18; k++)
        for (int j = 0; j < 20; j++)
            for (int i = 0; i < 22; i++)
                if (i >= 15 && (k < 5 || k > 9))
                    lattice.label[lattice_index(&lattice, i, j, k)] = 0;
    FREED unsigned char *level = levels_of(&lattice, LEVELS), *expected = zeroed(22 * 20 * 18, 1);
    for (int l = 1; l <= LEVELS; l++)
        for (int k = 0; k < 18; k++)
            for (int j = 0; j < 20; j++)
                for (int i = 0; i < 22; i++)
                    if (is_in_a_ball(&lattice, 2 << l, 1 << l, i, j, k))
                        give_block(&lattice, l, i, j, k, expected);
    assert_memory_equal(level, expected, 22 * 20 * 18);
}
