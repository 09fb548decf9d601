// SPDX-License-Identifier: MIT
#include "test.h"

#include "geometry/distance.h"
#include "geometry/generator.h"
#include "geometry/surface_field.h"

// A cone of many slivers that meet in one node, closed by a disc of others.
static void make_fan(TriMesh *mesh, int count)
{
    mesh_create(mesh, count + 2, 2 * count);
    mesh->position[0] = vec3(0.01, 0.02, 0.9);
    mesh->position[1] = vec3(0.02, -0.01, -0.3);
    for (int i = 0; i < count; i++) {
        const double angle = 2.0 * M_PI * i / count;
        mesh->position[2 + i] = vec3(cos(angle), sin(angle), 0.1 * cos(3.0 * angle));
        const int a = 2 + i, b = 2 + (i + 1) % count;
        memcpy(mesh->triangle[2 * i], (const int[3]){0, a, b}, sizeof *mesh->triangle);
        memcpy(mesh->triangle[2 * i + 1], (const int[3]){1, b, a}, sizeof *mesh->triangle);
    }
}

// The nearest of all triangles, none left out.
static double distance_to(const TriMesh *mesh, Vec3 at)
{
    double nearest = HUGE_VAL;
    for (int t = 0; t < mesh->triangle_count; t++) {
        Vec3 x[3];
        ClosestPair pair;
        for (int c = 0; c < 3; c++)
            x[c] = mesh->position[mesh->triangle[t][c]];
        distance_point_triangle(at, x, &pair);
        nearest = fmin(nearest, pair.distance);
    }
    return nearest;
}

static void expect_distances(const TriMesh *mesh, double size)
{
    Lattice lattice;
    SurfaceField field;
    Status status = {0};
    expect_ok(voxelise(&lattice, mesh, size, false, &status), status);
    surface_field_of_mesh(&field, &lattice, mesh);
    const float *value = field.value;
    int near = 0;
    for (int k = 0; k < field.count[2]; k++)
        for (int j = 0; j < field.count[1]; j++)
            for (int i = 0; i < field.count[0]; i++, value++) {
                const Vec3 cells = vec3(field.low[0] + (double)i / FIELD_PARTS,
                                        field.low[1] + (double)j / FIELD_PARTS,
                                        field.low[2] + (double)k / FIELD_PARTS);
                const Vec3 at = vec3_add(lattice.origin, vec3_scale(size, cells));
                // Farther than 1.25 cells it is that; rounded to single precision.
                const double expected = fmin(distance_to(mesh, at) / size, 1.25);
                expect_near((double)fabsf(*value), expected, 1.25 * 1.2e-7);
                near += expected < 1.25;
            }
    assert_true(near > 300);
    surface_field_destroy(&field);
    lattice_destroy(&lattice);
}

TEST(field_of_a_mesh_is_the_distance_to_the_nearest_triangle)
{
    // Slivers much longer than a cell, triangles much smaller than one, and some of its size.
    SCOPED(mesh_destroy) TriMesh fan = {0}, fine = {0}, coarse = {0};
    make_fan(&fan, 100);
    expect_distances(&fan, 0.2);
    Status status = {0};
    expect_ok(generate_ico_sphere(&fine, 3, 1.0, &status), status);
    expect_distances(&fine, 0.4);
    expect_ok(generate_ico_sphere(&coarse, 1, 1.0, &status), status);
    expect_distances(&coarse, 0.25);
}
