// SPDX-License-Identifier: MIT
// The bound of the time step that voxel_create takes from an element: the largest eigenvalue of
// M^-1 K of its rest shape, found by power iteration on the readable element.
#include "test.h"
#include "effort.h"
#include "random.h"

#include "voxel/element.h"
#include "voxel/template.h"

enum { EDGES = 12, FACES = 6, ITERATIONS = 300 };

// A middle of a face hangs where a finer element lies beyond the face, and then the middles of its
// edges do too; those of other edges may by themselves.
static unsigned random_mask(uint64_t *random)
{
    unsigned mask = 0, chance = (unsigned)random_below(random, 4);
    for (int node = NODE_CORNERS; node < NODE_COUNT; node++) {
        bool is_face = node >= NODE_CORNERS + EDGES;
        if ((unsigned)random_below(random, 4) < chance)
            mask |= 1u << (node - NODE_CORNERS);
        if (!is_face || (mask >> (node - NODE_CORNERS) & 1) == 0)
            continue;
        const signed char *face = NODE_OFFSET[node];
        for (int edge = NODE_CORNERS; edge < NODE_CORNERS + EDGES; edge++)
            for (int d = 0; d < 3; d++)
                if (face[d] != 1 && NODE_OFFSET[edge][d] == face[d])
                    mask |= 1u << (edge - NODE_CORNERS);
    }
    return mask;
}

// Of an element of edge 1 with mu = rho = 1, times 1 / (4 (2 mu + 3 lambda)): 1 for a plain cube.
static double largest_eigenvalue(unsigned mask, double nu, uint64_t *random)
{
    Template shape;
    template_create(&shape, mask);
    const double lambda = 2.0 * nu / (1.0 - 2.0 * nu), step = 1e-6;
    const Element element = {shape.count, shape.rest, shape.weight, shape.area, 1.0};
    const ElementStiffness stiffness = {
        .law = VOXEL_AFFINE, .mu = 1.0, .lambda = lambda, .residual = (1.0 + nu) / 3.0};
    Vec3 d[NODE_COUNT];
    for (int i = 0; i < shape.count; i++)
        d[i] = random_vec3(random);
    double value = 0.0;
    for (int k = 0; k < ITERATIONS; k++) {
        double norm = 0.0;
        for (int i = 0; i < shape.count; i++)
            norm += shape.weight[i] * vec3_dot(d[i], d[i]);
        Vec3 f[2][NODE_COUNT] = {{{0.0, 0.0, 0.0}}};
        for (int side = 0; side < 2; side++) {
            Vec3 x[NODE_COUNT];
            Quat last = QUAT_NONE;
            double by = (side == 0 ? step : -step) / sqrt(norm);
            for (int i = 0; i < shape.count; i++)
                x[i] = vec3_madd(shape.rest[i], by, d[i]);
            element_forces(&element, &stiffness, x, NULL, &last, f[side]);
        }
        double work = 0.0;
        for (int i = 0; i < shape.count; i++) {
            Vec3 pull = vec3_scale(0.5 / step, vec3_sub(f[1][i], f[0][i])); // K d / |d|
            work += vec3_dot(pull, d[i]) / sqrt(norm);
            d[i] = vec3_scale(8.0 / shape.weight[i], pull); // m = rho V w / 8
        }
        value = 8.0 * work; // Rayleigh's quotient
    }
    return value / (4.0 * (2.0 + 3.0 * lambda));
}

static const double NU[] = {0.0, 0.3, 0.45};

// Differences of forces at 1e-6 are exact to 1e-9; the iteration has converged far below 1e-3, as
// the next eigenvalues of a cube are lower by a third.
TEST(a_cube_s_eigenvalue_is_the_one_of_the_formula)
{
    uint64_t random = 5;
    for (int k = 0; k < 3; k++)
        expect_near(largest_eigenvalue(0, NU[k], &random), 1.0, 1e-3);
}

TEST(hanging_vertices_at_most_double_it)
{
    uint64_t random = 9;
    for (int k = 0; k < 3; k++) {
        double most = 0.0;
        for (int i = 0; i < EFFORT(400); i++)
            most = fmax(most, largest_eigenvalue(random_mask(&random), NU[k], &random));
        most = fmax(most, largest_eigenvalue((1u << (EDGES + FACES)) - 1, NU[k], &random));
        print_message("nu %g: at most %.4f times that of a cube\n", NU[k], most);
        expect_at_most(most, 2.0 + 1e-3);
    }
}
