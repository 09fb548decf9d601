// SPDX-License-Identifier: MIT
// Tension at rest: it moves no body that is whole, opens cuts as far as closed forms say, and keeps
// momentum and energy.
#include "test.h"
#include "sim_steps.h"
#include "cut_world.h"
#include "effort.h"

static const double E = 1e4;

// A block of cells of 5 mm under tension; both of its ends across an axis are fixed if axis >= 0.
static void block(VoxelWorldOptions *options, const int count[3], double stress, int axis,
                  FixedRegion end[2])
{
    *options = voxel_world_block(count[0], count[1], count[2], 5e-3);
    options->material = (SolidMaterial){.youngs_modulus = E, .density = 1e3, .prestress = stress};
    for (int side = 0; side < 2 && axis >= 0; side++) {
        double *bound[2] = {&end[side].low.x, &end[side].high.x};
        end[side] = (FixedRegion){
            .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, 1.0}};
        bound[1 - side][axis] = (side == 0 ? -0.49 : 0.49) * count[axis] * 5e-3;
        options->body.body.fixed = end;
        options->body.body.fixed_count = 2;
    }
}

static int cut(CutWorld *world, Vec3 middle, Vec3 edge, Vec3 along, double half, double from,
               double to)
{
    const CutOptions sweep = cut_world_sweep(middle, edge, along, half, from, to);
    CutOutcome outcome;
    assert_true(cut_world_cut(world, &sweep, &outcome));
    while (world->cuts->lattice.wanted_count > 0)
        sim_step(world->sim);
    return outcome.separated;
}

static double kinetic(CutWorld *world)
{
    return measure_of(world->body).kinetic;
}

// The opening of a crack of length 2 a in a plate under plane stress, at its middle: 4 stress a / E
// (Westergaard 1939).
TEST(a_slit_opens_as_a_crack_does)
{
    for (int n = 24; n <= 96; n *= 2) {
        VoxelWorldOptions options;
        FixedRegion end[2];
        const double stress = 0.01 * E;
        block(&options, (const int[3]){n, n, 1}, stress, 1, end);
        options.body.damping = 0.5;
        options.body.drag = 40.0 * 24 / n;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        const double a = (getenv("AW") ? atof(getenv("AW")) : 5.0) * n / 48 * 5e-3;
        const int broken = cut(&world, vec3(0.0, 1e-6, 0.0), vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 0.0), 1.0, -2*a, 2*a);
        sim_ticks(world.sim, 1500 * n / 24);
        // Vertices of the slit.
        const Vertices *vertices = &world.model->vertices;
        double most = 0.0, rest = 0.0;
        for (int i = 0; i < vertices->count; i++)
            for (int k = 0; k < i; k++) {
                Vec3 x = rows_rest(&vertices->rows, i), y = rows_rest(&vertices->rows, k), p, q;
                if (vec3_length(vec3_sub(x, y)) > 1e-9)
                    continue;
                rows_read(&vertices->rows, vertices_row(vertices), i, &p, NULL);
                rows_read(&vertices->rows, vertices_row(vertices), k, &q, NULL);
                if (fabs(p.y - q.y) > most)
                    most = fabs(p.y - q.y), rest = x.x;
            }
        const double half = 0.5 * broken * 5e-3;
        fprintf(stderr, "n %d broken %d a %g: opening %g at %g, closed form %g, ratio %g, kinetic %g\n", n, broken, half, most, rest,
                4 * stress * half / E, most / (4 * stress * half / E), kinetic(&world));
    }
}
