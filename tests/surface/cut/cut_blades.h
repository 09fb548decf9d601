// SPDX-License-Identifier: MIT
// Ways of a blade across a surface that can be cut.
#ifndef PLIANT_TESTS_CUT_BLADES_H
#define PLIANT_TESTS_CUT_BLADES_H

#include "cut_model.h"

enum { BLADE_EDGES = 40 };

typedef struct Blade {
    int edges;
    BladeEdge edge[BLADE_EDGES];
} Blade;

Vec3 blade_corner(const CutModel *model, int face, int k);
Vec3 blade_centroid(const CutModel *model, int face);
Vec3 blade_normal(const CutModel *model, int face);
Vec3 blade_direction(uint64_t *seed); // evenly spread, unit

void blade_add(Blade *blade, Vec3 middle, Vec3 half);
// Far beyond the body on all sides.
Blade blade_plane(Vec3 through, Vec3 normal, uint64_t *seed);
// Across the surface at a face: a part of a circle of radius r around its centroid, the edge from
// `depth` below to above; all of it: closed.
Blade blade_arc(const CutModel *model, int face, double r, double from, double to, int quads,
                double depth, uint64_t *seed);
Blade blade_straight(Vec3 from, Vec3 to, Vec3 half);

#endif
