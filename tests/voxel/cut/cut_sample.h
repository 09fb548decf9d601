// SPDX-License-Identifier: MIT
// A cut lattice of a body, and random cuts through it.
#ifndef PLIANT_TESTS_CUT_SAMPLE_H
#define PLIANT_TESTS_CUT_SAMPLE_H

#include "effort.h"
#include "lattice_samples.h"

#include "voxel/cut/cut_lattice.h"

#include <stdlib.h>

typedef struct CutSample {
    Lattice lattice;
    Layout layout;
    Arena arena;
    StateList state;
    CutLattice cut;
    bool removable;
    int levels, surface_level; // of elements inside and at the surface, or 0: it does not adapt
    const FixedRegion *fixed;  // or NULL
    double adapt_error;        // BodyOptions.adapt_error
    const FineRegion *fine;    // or NULL
} CutSample;

// What bodies that adapt are tried with.
typedef enum MergeKind {
    MERGE_CUBE,
    MERGE_BALL,
    MERGE_SHEET, // one cell thick, at an odd height
    MERGE_TUBE,
    MERGE_LOBES, // two, with a gap of one cell between them
    MERGE_SHELF, // above a block, with void between them that belongs to its elements alone
    MERGE_KINDS,
} MergeKind;

static inline int cut_sample_label(MergeKind kind, int i, int j, int k)
{
    const double y = j + 0.5 - 8.0, z = k + 0.5 - 8.0, r = sqrt(y * y + z * z);
    switch (kind) {
    case MERGE_SHEET:
        return k == 1;
    case MERGE_TUBE:
        return r < 8.0 && r > 6.2;
    case MERGE_LOBES:
        return i != 6 || k < 3;
    case MERGE_SHELF:
        return k < 4 || k == 7;
    default:
        return 1;
    }
}

static inline Lattice cut_sample_body(MergeKind kind)
{
    if (kind == MERGE_BALL)
        return sample_ball(17);
    Lattice lattice = kind == MERGE_CUBE    ? sample_void(16, 16, 16)
                      : kind == MERGE_SHEET ? sample_void(19, 14, 3)
                                            : sample_void(14, 16, 16);
    for (int k = 0; k < lattice.count[2]; k++)
        for (int j = 0; j < lattice.count[1]; j++)
            for (int i = 0; i < lattice.count[0]; i++)
                lattice.label[lattice_index(&lattice, i, j, k)] =
                    (unsigned char)cut_sample_label(kind, i, j, k);
    return lattice;
}

// True if the lattice could be created for the layout.
static inline bool cut_sample_try(CutSample *sample, int capacity, int budget, Status *status)
{
    const VoxelOptions options = {.body = {.name = "body",
                                           .levels = sample->levels,
                                           .removable = sample->removable,
                                           .fixed_count = sample->fixed != NULL,
                                           .fixed = sample->fixed,
                                           .adapt_error = sample->adapt_error},
                                  .lattice = &sample->lattice,
                                  .surface_level = sample->surface_level,
                                  .fine_count = sample->fine != NULL,
                                  .fine = sample->fine,
                                  .split_budget = budget};
    VoxelMaking making = {.options = &options, .layout = sample->layout, .capacity = capacity};
    const bool good =
        lattice_mesh_create(&making.mesh, &making.layout, status) &&
        cut_lattice_create(&sample->cut, &making, &sample->arena, &sample->state, status);
    lattice_mesh_destroy(&making.mesh);
    return good;
}

static inline void cut_sample_options(CutSample *sample, Lattice lattice, int levels,
                                      int surface_level)
{
    *sample = (CutSample){.lattice = lattice, .levels = levels, .surface_level = surface_level};
    layout_create(&sample->layout, &sample->lattice, levels);
}

static inline void cut_sample_build(CutSample *sample, int capacity, int budget)
{
    Status status = {0};
    // Every cell a vertex of its own at each corner: more cannot be.
    if (capacity == 0)
        capacity = 8 * (int)lattice_solid(&sample->lattice);
    assert_true(cut_sample_try(sample, capacity, budget, &status));
}

static inline void cut_sample_make(CutSample *sample, Lattice lattice, int levels, int capacity,
                                   int budget, bool removable)
{
    cut_sample_options(sample, lattice, levels, 0);
    sample->removable = removable;
    cut_sample_build(sample, capacity, budget);
}

static inline void cut_sample_create(CutSample *sample, Lattice lattice, int levels, int capacity,
                                     int budget)
{
    cut_sample_make(sample, lattice, levels, capacity, budget, false);
}

static inline void cut_sample_drop(CutSample *sample)
{
    arena_destroy(&sample->arena);
    state_destroy(&sample->state);
    layout_destroy(&sample->layout);
    lattice_destroy(&sample->lattice);
}

// Faces {cell, axis}, not broken yet, with their middles within `thick` of a disc; returns how
// many. face: [3 * cells].
static inline int cut_sample_disc(const CutLattice *cut, Vec3 center, Vec3 normal, double radius,
                                  int (*face)[2])
{
    int count = 0;
    for (int cell = 0; cell < cut->level_first[1]; cell++)
        for (int axis = 0; axis < 3; axis++) {
            if (cut_lattice_beyond(cut, cell, axis) < 0 || (cut->broken[cell] >> axis & 1))
                continue;
            const short *at = cut->element[cell].cell;
            Vec3 from = vec3(at[0] + 0.5, at[1] + 0.5, at[2] + 0.5), to = from;
            from = vec3_sub(from, center);
            to = vec3_sub(vec3_add(to, vec3(axis == 0, axis == 1, axis == 2)), center);
            const bool across = (vec3_dot(from, normal) < 0.0) != (vec3_dot(to, normal) < 0.0);
            if (!across || vec3_length(from) > radius)
                continue;
            face[count][0] = cell;
            face[count++][1] = axis;
        }
    return count;
}

// A random disc or plane; or some random faces.
static inline int cut_sample_random(const CutLattice *cut, uint64_t *seed, int (*face)[2])
{
    const double most = cut->count[0] + cut->count[1] + cut->count[2];
    Vec3 center = vec3(random_between(seed, 0.0, cut->lattice_count[0]),
                       random_between(seed, 0.0, cut->lattice_count[1]),
                       random_between(seed, 0.0, cut->lattice_count[2]));
    Vec3 normal = random_vec3(seed);
    switch (random_below(seed, 4)) {
    case 0:
        return cut_sample_disc(cut, center, normal, most, face);
    case 1:
        return cut_sample_disc(cut, center, normal, random_between(seed, 1.0, 0.2 * most), face);
    case 2: // along the lattice
        normal = vec3(0.0, 0.0, 0.0);
        *(&normal.x + random_below(seed, 3)) = 1.0;
        return cut_sample_disc(cut, center, normal, random_between(seed, 1.0, 0.3 * most), face);
    default:;
    }
    int count = 0;
    for (int n = random_below(seed, 40); n >= 0; n--) {
        const int cell = random_below(seed, cut->level_first[1]), axis = random_below(seed, 3);
        bool known = (cut->broken[cell] >> axis & 1) || cut_lattice_beyond(cut, cell, axis) < 0;
        for (int f = 0; f < count; f++)
            known |= face[f][0] == cell && face[f][1] == axis;
        if (known)
            continue;
        face[count][0] = cell;
        face[count++][1] = axis;
    }
    return count;
}

// Cells near a random point, or a few anywhere, that are there; returns how many.
static inline int cut_sample_random_cells(const CutLattice *cut, uint64_t *seed,
                                          int cell[CUT_REMOVE_MOST])
{
    int count = 0;
    const Vec3 center = vec3(random_between(seed, 0.0, cut->lattice_count[0]),
                             random_between(seed, 0.0, cut->lattice_count[1]),
                             random_between(seed, 0.0, cut->lattice_count[2]));
    const double radius = random_between(seed, 0.5, 3.0);
    const bool few = random_below(seed, 3) == 0;
    for (int c = 0; c < cut->level_first[1] && count < CUT_REMOVE_MOST; c++) {
        const short *at = cut->element[c].cell;
        const Vec3 x = vec3(at[0] + 0.5, at[1] + 0.5, at[2] + 0.5);
        const bool in = few ? random_below(seed, cut->level_first[1]) < 4
                            : vec3_length(vec3_sub(x, center)) < radius;
        if (in && !cut_lattice_is_gone(cut, c))
            cell[count++] = c;
    }
    return count;
}

#endif
