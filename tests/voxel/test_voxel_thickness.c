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

// Every block of a thick body has a cell of its level, those at edges and corners, too: a block
// keeps its level if any of its cells has it.
TEST(edges_and_corners_of_a_thick_body_are_thick)
{
    enum { CELLS = 32, LEVELS = 3 };
    SCOPED(lattice_destroy) Lattice lattice = sample_box(CELLS, CELLS, CELLS);
    FREED unsigned char *level = levels_of(&lattice, LEVELS);
    for (int l = 1; l <= LEVELS; l++) {
        const int edge = 1 << l, blocks = CELLS / edge;
        for (int b = 0; b < blocks * blocks * blocks; b++) {
            const int at[3] = {b % blocks * edge, b / blocks % blocks * edge,
                               b / blocks / blocks * edge};
            int most = 0;
            for (int c = 0; c < edge * edge * edge; c++) {
                const int of = level[lattice_index(
                    &lattice, at[0] + c % edge, at[1] + c / edge % edge, at[2] + c / edge / edge)];
                most = of > most ? of : most;
            }
            assert_true(most >= l);
        }
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
    FREED unsigned char *level = levels_of(&lattice, LEVELS);
    for (int k = 0; k < 18; k++)
        for (int j = 0; j < 20; j++)
            for (int i = 0; i < 22; i++) {
                int expected = 0;
                for (int l = 1; l <= LEVELS && lattice_label(&lattice, i, j, k) != 0; l++) {
                    // A middle within the radius whose ball of centres is solid.
                    const int r = 2 << l;
                    for (int m = 0; m < 22 * 20 * 18 && expected < l; m++) {
                        const int x = m % 22, y = m / 22 % 20, z = m / 22 / 20;
                        if ((x - i) * (x - i) + (y - j) * (y - j) + (z - k) * (z - k) >= r * r)
                            continue;
                        bool solid = true;
                        for (int c = -r; c <= r && solid; c++)
                            for (int b = -r; b <= r && solid; b++)
                                for (int a = -r; a <= r && solid; a++)
                                    solid = a * a + b * b + c * c >= r * r ||
                                            lattice_label(&lattice, x + a, y + b, z + c) != 0;
                        expected = solid ? l : expected;
                    }
                }
                assert_int_equal(level[lattice_index(&lattice, i, j, k)], expected);
            }
}
