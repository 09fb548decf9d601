// SPDX-License-Identifier: MIT
#include "effort.h"
#include "test.h"
#include "random.h"

#include "geometry/lattice.h"

static void fill_random(Lattice *lattice, double share, uint64_t *seed)
{
    long cells = (long)lattice->count[0] * lattice->count[1] * lattice->count[2];
    for (long i = 0; i < cells; i++)
        lattice->label[i] =
            (unsigned char)(random_between(seed, 0.0, 1.0) < share ? 1 + random_below(seed, 255)
                                                                   : 0);
}

TEST(box_is_solid_and_centred)
{
    SCOPED(lattice_destroy) Lattice box;
    assert_true(lattice_box(&box, (int[3]){4, 3, 5}, 0.5, &(Status){0}));
    assert_int_equal(lattice_solid(&box), 60);
    assert_int_equal(lattice_pieces(&box), 1);
    for (int i = 0; i < 60; i++)
        assert_int_equal(box.label[i], 1);
    Vec3 low = lattice_point(&box, 0.0, 0.0, 0.0), high = lattice_point(&box, 4.0, 3.0, 5.0);
    expect_near(low.x, -1.0, 0.0); // halves are exact
    expect_near(low.y, -0.75, 0.0);
    expect_near(low.z, -1.25, 0.0);
    expect_near(high.x, 1.0, 0.0);
    expect_near(high.y, 0.75, 0.0);
    expect_near(high.z, 1.25, 0.0);
}

// Counted from the rule of integers, not by the code: cells (i, j, k) with
// (2i + 1)^2 + (2j + 1)^2 + (2k + 1)^2 <= (2r)^2.
static long count_round(int radius, bool flat)
{
    long count = 0, limit = 4L * radius * radius;
    for (long i = -radius; i < radius; i++)
        for (long j = -radius; j < radius; j++)
            for (long k = flat ? 0 : -radius; k < (flat ? 1 : radius); k++) {
                long z = flat ? 0 : 2 * k + 1;
                count += (2 * i + 1) * (2 * i + 1) + (2 * j + 1) * (2 * j + 1) + z * z <= limit;
            }
    return count;
}

TEST(round_lattices_hold_the_cells_whose_centre_is_within)
{
    Lattice lattice;
    Status status = {0};
    // The disc of Miyazaki et al. and balls of the same radius and twice it.
    assert_int_equal(count_round(16, true), 812);
    assert_int_equal(count_round(16, false), 17256);
    assert_int_equal(count_round(32, false), 137376);
    static const double sizes[] = {1.0, 0.003125, 0.1 / 3.0}; // 16 of the last are not exact
    for (int s = 0; s < 3; s++) {
        assert_true(lattice_disc(&lattice, 16 * sizes[s], sizes[s], &status));
        assert_int_equal(lattice_solid(&lattice), 812);
        assert_int_equal(lattice.count[2], 1);
        expect_near(lattice.origin.z, -0.5 * sizes[s], 0.0);
        lattice_destroy(&lattice);
        assert_true(lattice_ball(&lattice, 16 * sizes[s], sizes[s], &status));
        assert_int_equal(lattice_solid(&lattice), 17256);
        assert_int_equal(lattice_pieces(&lattice), 1);
        lattice_destroy(&lattice);
    }
    assert_true(lattice_ball(&lattice, 32.0, 1.0, &status));
    assert_int_equal(lattice_solid(&lattice), 137376);
    lattice_destroy(&lattice);
}

TEST(round_lattices_are_cropped_and_mirror_symmetric)
{
    for (double radius = 1.0; radius < 9.0; radius += 0.37) {
        SCOPED(lattice_destroy) Lattice ball;
        assert_true(lattice_ball(&ball, radius, 1.0, &(Status){0}));
        int n = ball.count[0];
        expect_near(ball.origin.x, -0.5 * n, 0.0);
        bool touches = false;
        for (int k = 0; k < n; k++)
            for (int j = 0; j < n; j++) {
                touches |= lattice_label(&ball, 0, j, k) != 0;
                for (int i = 0; i < n; i++) {
                    int label = lattice_label(&ball, i, j, k);
                    assert_int_equal(label, lattice_label(&ball, n - 1 - i, j, k));
                    assert_int_equal(label, lattice_label(&ball, j, k, i));
                    Vec3 c = lattice_point(&ball, i + 0.5, j + 0.5, k + 0.5);
                    assert_int_equal(label, vec3_dot(c, c) <= radius * radius);
                }
            }
        assert_true(touches);
    }
}

TEST(impossible_lattices_are_refused_in_words)
{
    static const struct {
        int count[3];
        double size;
        const char *text;
    } bad[] = {
        {{0, 1, 1}, 1.0, "a lattice of 0 x 1 x 1 cells has none"},
        {{1, -3, 1}, 1.0, "a lattice of 1 x -3 x 1 cells has none"},
        {{65536, 65536, 65536},
         1.0,
         "a lattice of 65536 x 65536 x 65536 cells, void ones counted, has more than 268435456"},
        {{1, 1, 1}, 0.0, "cells of 0 m are not possible"},
        {{1, 1, 1}, -1.0, "cells of -1 m are not possible"},
        {{1, 1, 1}, (double)NAN, NULL},
        {{1, 1, 1}, (double)INFINITY, "cells of inf m are not possible"},
        {{512, 512, 65}, 1.0, "17039360 solid cells are more than 16777216"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        Lattice lattice;
        Status status = {0};
        assert_false(lattice_box(&lattice, bad[i].count, bad[i].size, &status));
        if (bad[i].text != NULL)
            assert_string_equal(status.text, bad[i].text);
        assert_null(lattice.label);
    }
    static const double radius[] = {0.0, -1.0, (double)NAN, (double)INFINITY, 1e300, 0.8};
    for (int i = 0; i < 6; i++) {
        Lattice lattice;
        Status status = {0};
        assert_false(lattice_ball(&lattice, radius[i], 1.0, &status));
        assert_int_equal(status.code, STATUS_INVALID);
        assert_null(lattice.label);
    }
}

TEST(outside_of_the_block_all_is_void)
{
    SCOPED(lattice_destroy) Lattice box;
    assert_true(lattice_box(&box, (int[3]){2, 3, 4}, 1.0, &(Status){0}));
    for (int k = -1; k <= 4; k++)
        for (int j = -1; j <= 3; j++)
            for (int i = -1; i <= 2; i++)
                assert_int_equal(lattice_label(&box, i, j, k),
                                 i >= 0 && i < 2 && j >= 0 && j < 3 && k >= 0 && k < 4);
}

TEST(crop_keeps_every_solid_cell_where_it_was)
{
    uint64_t seed = 11;
    for (int repeat = 0; repeat < EFFORT(60); repeat++) {
        Lattice lattice, whole;
        int count[3];
        for (int a = 0; a < 3; a++)
            count[a] = 1 + random_below(&seed, 9);
        assert_true(lattice_create(&lattice, count, 0.25, &(Status){0}));
        lattice.origin = random_vec3(&seed);
        lattice.turn = quat_from_rotation(random_vec3(&seed));
        fill_random(&lattice, 0.02, &seed);
        lattice.label[random_below(&seed, count[0] * count[1] * count[2])] = 9;
        whole = lattice;
        whole.label = malloc((size_t)(count[0] * count[1] * count[2]));
        memcpy(whole.label, lattice.label, (size_t)(count[0] * count[1] * count[2]));
        assert_true(lattice_crop(&lattice, &(Status){0}));
        assert_int_equal(lattice_solid(&lattice), lattice_solid(&whole));
        // The offset in cells, found from where the origin went.
        Vec3 moved =
            quat_rotate(quat_conjugate(whole.turn), vec3_sub(lattice.origin, whole.origin));
        int di = (int)lrint(moved.x / 0.25), dj = (int)lrint(moved.y / 0.25),
            dk = (int)lrint(moved.z / 0.25);
        Vec3 there = lattice_point(&whole, di, dj, dk);
        expect_near(vec3_length(vec3_sub(there, lattice.origin)), 0.0, 1e-14); // roundings of 1
        for (int k = -1; k <= count[2]; k++)
            for (int j = -1; j <= count[1]; j++)
                for (int i = -1; i <= count[0]; i++)
                    assert_int_equal(lattice_label(&lattice, i - di, j - dj, k - dk),
                                     lattice_label(&whole, i, j, k));
        long sides[6] = {0};
        for (int k = 0; k < lattice.count[2]; k++)
            for (int j = 0; j < lattice.count[1]; j++)
                for (int i = 0; i < lattice.count[0]; i++) {
                    if (lattice_label(&lattice, i, j, k) == 0)
                        continue;
                    sides[0] += i == 0;
                    sides[1] += j == 0;
                    sides[2] += k == 0;
                    sides[3] += i == lattice.count[0] - 1;
                    sides[4] += j == lattice.count[1] - 1;
                    sides[5] += k == lattice.count[2] - 1;
                }
        for (int s = 0; s < 6; s++)
            assert_true(sides[s] > 0);
        free(whole.label);
        lattice_destroy(&lattice);
    }
    SCOPED(lattice_destroy) Lattice empty;
    Status status = {0};
    assert_true(lattice_create(&empty, (int[3]){3, 3, 3}, 1.0, &status));
    assert_false(lattice_crop(&empty, &status));
    assert_string_equal(status.text, "no cell of the lattice is solid");
}

TEST(place_moves_points_as_a_mesh_is_moved)
{
    uint64_t seed = 5;
    for (int repeat = 0; repeat < 50; repeat++) {
        SCOPED(lattice_destroy) Lattice lattice;
        assert_true(lattice_box(&lattice, (int[3]){3, 4, 5}, 0.01, &(Status){0}));
        lattice.origin = random_vec3(&seed);
        lattice.turn = quat_from_rotation(random_vec3(&seed));
        Vec3 rotation = repeat == 0 ? vec3(0.0, 0.0, 0.0) : vec3_scale(2.0, random_vec3(&seed));
        Vec3 move = random_vec3(&seed), at = vec3_scale(5.0, random_vec3(&seed));
        double scale = random_between(&seed, 0.1, 3.0);
        Vec3 before = lattice_point(&lattice, at.x, at.y, at.z);
        Vec3 expected =
            vec3_add(quat_rotate(quat_from_rotation(rotation), vec3_scale(scale, before)), move);
        lattice_place(&lattice, scale, rotation, move);
        Vec3 after = lattice_point(&lattice, at.x, at.y, at.z);
        // Lengths of about 5, a dozen roundings.
        expect_near(vec3_length(vec3_sub(after, expected)), 0.0, 2e-14);
    }
}

// A slow count by spreading marks until nothing changes.
static int count_pieces_slowly(const Lattice *lattice)
{
    int nx = lattice->count[0], ny = lattice->count[1], nz = lattice->count[2], pieces = 0;
    FREED int *mark = calloc((size_t)(nx * ny * nz), sizeof *mark);
    for (int n = 0; n < nx * ny * nz; n++)
        mark[n] = lattice->label[n] != 0 ? n + 1 : 0;
    const int step[3] = {1, nx, nx * ny};
    for (bool changed = true; changed;) {
        changed = false;
        for (int n = 0; n < nx * ny * nz; n++) {
            const int at[3] = {n % nx, n / nx % ny, n / (nx * ny)};
            for (int a = 0; a < 3; a++) {
                if (at[a] + 1 == lattice->count[a])
                    continue;
                int other = n + step[a];
                if (mark[n] == 0 || mark[other] == 0 || mark[n] == mark[other])
                    continue;
                int least = mark[n] < mark[other] ? mark[n] : mark[other];
                mark[n] = mark[other] = least;
                changed = true;
            }
        }
    }
    for (int n = 0; n < nx * ny * nz; n++)
        pieces += mark[n] == n + 1;
    return pieces;
}

TEST(pieces_are_what_faces_join)
{
    uint64_t seed = 7;
    for (int repeat = 0; repeat < EFFORT(300); repeat++) {
        SCOPED(lattice_destroy) Lattice lattice;
        int count[3];
        for (int a = 0; a < 3; a++)
            count[a] = 1 + random_below(&seed, 8);
        assert_true(lattice_create(&lattice, count, 1.0, &(Status){0}));
        fill_random(&lattice, random_between(&seed, 0.05, 0.9), &seed);
        assert_int_equal(lattice_pieces(&lattice), count_pieces_slowly(&lattice));
    }
}

TEST(edges_and_corners_join_nothing)
{
    SCOPED(lattice_destroy) Lattice lattice;
    assert_true(lattice_create(&lattice, (int[3]){4, 4, 4}, 1.0, &(Status){0}));
    assert_int_equal(lattice_pieces(&lattice), 0);
    for (int k = 0; k < 4; k++)
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < 4; i++)
                lattice.label[lattice_index(&lattice, i, j, k)] = (i + j + k) % 2;
    assert_int_equal(lattice_pieces(&lattice), 32);
}
