// SPDX-License-Identifier: MIT
// The bound of the time step that voxel_create takes from an element: the largest eigenvalue of
// M^-1 K of its rest shape, found by power iteration on the readable element.
#include "test.h"
#include "effort.h"
#include "voxel_fill.h"

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

// What acts on the vertices of an element at rest, in proportion to small moves or to speeds.
typedef enum Acting { STIFFNESS, DAMPING, VISCOUS_DAMPING } Acting;

// Of an element of edge 1 with mu = rho = beta = 1.
static double largest_eigenvalue(const Template *shape, double nu, Acting acting, uint64_t *random)
{
    const double lambda = 2.0 * nu / (1.0 - 2.0 * nu), volume = shape->share;
    const double step = acting == STIFFNESS ? 1e-6 : 1.0; // damping is linear
    const Element element = {shape->count, shape->rest, shape->weight, shape->area, volume};
    const ElementStiffness stiffness = {.law = VOXEL_AFFINE,
                                        .mu = 1.0,
                                        .lambda = lambda,
                                        .residual = (1.0 + nu) / 3.0 * volume * shape->softer,
                                        .damping = acting == DAMPING ? volume : 0.0,
                                        .damping_time = acting == VISCOUS_DAMPING ? 1.0 : 0.0};
    Vec3 d[NODE_COUNT];
    for (int i = 0; i < shape->count; i++)
        d[i] = shape->weight[i] > 0.0 ? random_vec3(random) : vec3(0.0, 0.0, 0.0);
    double value = 0.0;
    for (int k = 0; k < ITERATIONS; k++) {
        double norm = 0.0;
        for (int i = 0; i < shape->count; i++)
            norm += shape->weight[i] * vec3_dot(d[i], d[i]);
        Vec3 f[2][NODE_COUNT] = {{{0.0, 0.0, 0.0}}};
        for (int side = 0; side < 2; side++) {
            Vec3 x[NODE_COUNT], v[NODE_COUNT];
            Quat last = QUAT_NONE;
            double by = (side == 0 ? step : -step) / sqrt(norm);
            for (int i = 0; i < shape->count; i++) {
                x[i] = vec3_madd(shape->rest[i], acting == STIFFNESS ? by : 0.0, d[i]);
                v[i] = vec3_scale(acting == STIFFNESS ? 0.0 : by, d[i]);
            }
            element_forces(&element, &stiffness, x, v, &last, f[side]);
        }
        double work = 0.0;
        for (int i = 0; i < shape->count; i++) {
            Vec3 pull = vec3_scale(0.5 / step, vec3_sub(f[1][i], f[0][i])); // K d / |d|
            work += vec3_dot(pull, d[i]) / sqrt(norm);
            if (shape->weight[i] > 0.0) // m = rho V w / 8
                d[i] = vec3_scale(8.0 / (volume * shape->weight[i]), pull);
        }
        value = 8.0 / volume * work; // Rayleigh's quotient
    }
    return value;
}

// That of a plain cube of edge 1 (server/voxel/README.md, "Critical time step").
static double cube_s(double nu)
{
    return 4.0 * (2.0 + 3.0 * 2.0 * nu / (1.0 - 2.0 * nu));
}

static double of_mask(unsigned mask, double nu, uint64_t *random)
{
    Template shape;
    template_create(&shape, mask);
    return largest_eigenvalue(&shape, nu, STIFFNESS, random) / cube_s(nu);
}

static const double NU[] = {0.0, 0.3, 0.45};

// Differences of forces at 1e-6 are exact to 1e-9; the iteration has converged far below 1e-3, as
// the next eigenvalues of a cube are lower by a third.
TEST(a_cube_s_eigenvalue_is_the_one_of_the_formula)
{
    uint64_t random = 5;
    for (int k = 0; k < 3; k++)
        expect_near(of_mask(0, NU[k], &random), 1.0, 1e-3);
}

TEST(hanging_vertices_at_most_double_it)
{
    uint64_t random = 9;
    for (int k = 0; k < 3; k++) {
        double most = 0.0;
        for (int i = 0; i < EFFORT(400); i++)
            most = fmax(most, of_mask(random_mask(&random), NU[k], &random));
        most = fmax(most, of_mask((1u << (EDGES + FACES)) - 1, NU[k], &random));
        print_message("nu %g: at most %.4f times that of a cube\n", NU[k], most);
        expect_at_most(most, 2.0 + 1e-3);
    }
}

// --- partly filled elements, against their finest cells ---

// The largest of an element, in units of a finest cell's.
static double of_part(int level, const uint64_t *solid, unsigned mask, double nu, Acting acting,
                      uint64_t *random)
{
    const double finer = (double)(1 << 2 * level); // 1 / h^2
    const double cell = acting == DAMPING ? 8.0 : cube_s(nu);
    Template shape;
    template_create_partial(&shape, mask, level, solid);
    return largest_eigenvalue(&shape, nu, acting, random) / (cell * finer);
}

static void expect_stable(int level, const uint64_t *solid, unsigned mask, uint64_t *random,
                          double most[3])
{
    for (int k = 0; k < 3; k++)
        most[k] = fmax(most[k], of_part(level, solid, mask, NU[k], STIFFNESS, random));
    // Viscous damping is beta times the stiffness; the other one that of a whole element.
    if (random_below(random, 8) != 0)
        return;
    const double stiffness = of_part(level, solid, mask, 0.3, STIFFNESS, random),
                 viscous = of_part(level, solid, mask, 0.3, VISCOUS_DAMPING, random);
    expect_near(viscous / stiffness, 1.0, 0.02); // slow convergence where two are close
    expect_at_most(of_part(level, solid, mask, 0.3, DAMPING, random),
                   1.0 / (1 << 2 * level) + 1e-6);
}

// Only blocks whose solid cells hang together by faces merge.
static bool hangs_together(unsigned fill)
{
    unsigned reached = fill & (~fill + 1);
    for (int round = 0; round < 8; round++)
        for (int c = 0; c < 8; c++)
            for (int d = 0; d < 3 && (reached >> c & 1); d++)
                reached |= fill & 1u << (c ^ 1 << d);
    return reached == fill;
}

// So the step of the finest cells holds, with 1 % less near nu = 0 (create.c): sums over elements
// are bounded as each of them is. The largest of all masks of level 1 is 1.0192, with nu = 0, in
// the corner of a block all of whose nodes are there; at nu = 0.03 it is 0.999.
TEST(a_partly_filled_element_is_no_stiffer_by_its_mass_than_a_finest_cell)
{
    uint64_t random = 10, solid[FILL_WORDS];
    for (int level = 1; level <= 2; level++) {
        double most[3] = {0.0, 0.0, 0.0}, plain[3] = {0.0, 0.0, 0.0};
        for (int n = 1; n < (level == 1 ? 255 : EFFORT(100)); n++) {
            if (level == 1 && !hangs_together((unsigned)n))
                continue;
            if (level == 1)
                solid[0] = (uint64_t)n;
            else
                fill_random(solid, level, &random);
            expect_stable(level, solid, 0, &random, plain);
            expect_stable(level, solid, (1u << (EDGES + FACES)) - 1, &random, most);
            for (int k = 0; k < EFFORT(1); k++)
                expect_stable(level, solid, fill_random_mask(&random), &random, most);
        }
        for (int k = 0; k < 3; k++) {
            print_message("level %d, nu %g: at most %.3f times that of a finest cell, %.3f where "
                          "nothing hangs\n",
                          level, NU[k], most[k], plain[k]);
            expect_at_most(most[k], NU[k] < 0.03 ? 1.02 : 1.0);
            expect_at_most(plain[k], 0.334); // a layer at the far face, |a|^2 / (V w) = 2 / (h H)
        }
    }
}
