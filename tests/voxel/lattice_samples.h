// SPDX-License-Identifier: MIT
// Lattices of all sorts to try layouts on: what organs look like, and what they do not.
#ifndef PLIANT_TESTS_LATTICE_SAMPLES_H
#define PLIANT_TESTS_LATTICE_SAMPLES_H

#include "expect.h"
#include "random.h"

#include "geometry/lattice.h"

#include <string.h>

typedef enum SampleKind {
    SAMPLE_BOX,          // solid
    SAMPLE_BLOB,         // balls here and there, of several materials
    SAMPLE_HOLED,        // a box with some single cells missing
    SAMPLE_LAYERS,       // a box of several materials
    SAMPLE_SPRAY,        // every cell by chance
    SAMPLE_CHECKERBOARD, // cells that touch along edges
    SAMPLE_CORNERS,      // cells that touch at corners
    SAMPLE_SLAB,         // one cell thick, with holes
    SAMPLE_CELL,
    SAMPLE_KINDS,
} SampleKind;

static inline Lattice sample_void(int nx, int ny, int nz)
{
    Lattice lattice;
    Status status = {0};
    assert_true(lattice_create(&lattice, (int[3]){nx, ny, nz}, 1.0, &status));
    return lattice;
}

static inline Lattice sample_box(int nx, int ny, int nz)
{
    Lattice lattice = sample_void(nx, ny, nz);
    memset(lattice.label, 1, (size_t)nx * (size_t)ny * (size_t)nz);
    return lattice;
}

static inline Lattice sample_ball(int n)
{
    Lattice lattice;
    Status status = {0};
    assert_true(lattice_ball(&lattice, 0.5 * n, 1.0, &status));
    return lattice;
}

static inline void sample_add_ball(Lattice *lattice, uint64_t *seed)
{
    double c[3], r = random_between(seed, 2.0, 9.0);
    int label = random_below(seed, 5) > 3 ? 0 : 1 + random_below(seed, 2);
    for (int d = 0; d < 3; d++)
        c[d] = random_between(seed, 0.0, lattice->count[d]);
    for (int k = 0; k < lattice->count[2]; k++)
        for (int j = 0; j < lattice->count[1]; j++)
            for (int i = 0; i < lattice->count[0]; i++) {
                double x = i + 0.5 - c[0], y = j + 0.5 - c[1], z = k + 0.5 - c[2];
                if (x * x + y * y + z * z <= r * r)
                    lattice->label[lattice_index(lattice, i, j, k)] = (unsigned char)label;
            }
}

// What a cell of the simple kinds holds.
static inline int sample_label(SampleKind kind, int i, int j, int k, uint64_t *seed)
{
    switch (kind) {
    case SAMPLE_HOLED:
        return random_below(seed, 400) != 0;
    case SAMPLE_LAYERS:
        return 1 + (k > 11) + 2 * (i + j > 30);
    case SAMPLE_SPRAY:
        return random_below(seed, 3);
    case SAMPLE_CHECKERBOARD:
        return (i + j + k) % 2;
    case SAMPLE_CORNERS:
        return i % 2 == j % 2 && j % 2 == k % 2;
    case SAMPLE_SLAB:
        return random_below(seed, 6) != 0;
    default:
        return 1;
    }
}

// At least one cell is solid.
static inline Lattice sample_lattice(SampleKind kind, uint64_t *seed)
{
    int most =
        kind == SAMPLE_SPRAY || kind == SAMPLE_CHECKERBOARD || kind == SAMPLE_CORNERS ? 8 : 28;
    int n[3];
    for (int d = 0; d < 3; d++)
        n[d] = kind == SAMPLE_CELL ? 1 : most / 2 + random_below(seed, most / 2);
    if (kind == SAMPLE_SLAB)
        n[random_below(seed, 3)] = 1;
    Lattice lattice = sample_void(n[0], n[1], n[2]);
    if (kind == SAMPLE_BLOB) {
        for (int b = 0; b < 12; b++)
            sample_add_ball(&lattice, seed);
    } else {
        for (int k = 0; k < n[2]; k++)
            for (int j = 0; j < n[1]; j++)
                for (int i = 0; i < n[0]; i++)
                    lattice.label[lattice_index(&lattice, i, j, k)] =
                        (unsigned char)sample_label(kind, i, j, k, seed);
    }
    if (lattice_solid(&lattice) == 0)
        lattice.label[0] = 1;
    return lattice;
}

#endif
