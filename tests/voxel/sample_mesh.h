// SPDX-License-Identifier: MIT
// A lattice with its layout and mesh.
#ifndef PLIANT_TESTS_SAMPLE_MESH_H
#define PLIANT_TESTS_SAMPLE_MESH_H

#include "effort.h"
#include "lattice_samples.h"

#include "voxel/lattice_mesh.h"

typedef struct Sample {
    Lattice lattice;
    Layout layout;
    LatticeMesh mesh;
} Sample;

static inline void sample_mesh(Sample *sample, Lattice lattice, int levels)
{
    Status status = {0};
    sample->lattice = lattice;
    layout_create(&sample->layout, &sample->lattice, levels);
    assert_true(lattice_mesh_create(&sample->mesh, &sample->layout, &status));
    assert_string_equal(status.text, "");
}

static inline void drop(Sample *sample)
{
    lattice_mesh_destroy(&sample->mesh);
    layout_destroy(&sample->layout);
    lattice_destroy(&sample->lattice);
}

// Runs a check on lattices of all sorts.
static inline void on_all_sorts(void (*check)(const Sample *), int rounds, uint64_t seed)
{
    for (int round = 0; round < EFFORT(rounds); round++)
        for (int kind = 0; kind < SAMPLE_KINDS; kind++) {
            SCOPED(drop) Sample sample;
            Lattice lattice = sample_lattice((SampleKind)kind, &seed);
            sample_mesh(&sample, lattice, random_below(&seed, 4));
            check(&sample);
        }
}

#endif
