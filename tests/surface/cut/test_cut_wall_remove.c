// SPDX-License-Identifier: MIT
// Faces of surface bodies that are removed, among cuts, tears and levels that come and go.
#include "wall_bench.h"

#include "effort.h"
#include "expect.h"
#include "random.h"
#include "sim_steps.h"
#include "test.h"

TEST(random_removals_and_cuts_keep_every_invariant)
{
    uint64_t random = 371;
    int removed = 0, removals = 0, most_pieces = 0, copies = 0;
    const char *wanted = getenv("PLIANT_TEST_CUTS");
    const int sequences = wanted != NULL ? atoi(wanted) / 10 : EFFORT(20);
    for (int sequence = 0; sequence < sequences; sequence++) {
        SurfaceOptions options = wall_options(random_below(&random, 4), 0);
        options.start_level = random_below(&random, options.body.levels + 1);
        options.adaptive = options.body.levels > 0 && random_below(&random, 2) == 0;
        options.adapt.check_hz = 200.0;
        options.tear_stretch = random_below(&random, 2) == 0 ? 0.3 : 0.0;
        options.body.precision =
            random_below(&random, 2) == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        options.shape.frame = random_below(&random, 2) == 0 ? SHAPE_WORLD : SHAPE_BODY;
        SCOPED(bench_destroy) DetailBench bench;
        const WallMesh mesh = (WallMesh)random_below(&random, WALL_MESHES);
        wall_create(&bench, mesh, &options, random_between(&random, 0.0, 1.0));
        CutOptions last = {.body = 0};
        WallShape shape;
        for (int i = 0; i < 10; i++) {
            if (options.adaptive)
                for (int k = 0; k < 4; k++)
                    bench_change_at_random(&bench, &random, 6);
            sim_ticks(bench.sim, random_below(&random, 6));
            if (random_below(&random, 3) == 0) {
                last = wall_random_sweep(&bench, &random, &last);
                wall_cut(&bench, &last);
            } else {
                const Vec3 from = wall_random_node(&bench, &random);
                const double far = random_between(&random, 0.0, 0.02);
                const Region mouth = {REGION_CAPSULE, from,
                                      vec3_madd(from, far, random_vec3(&random)),
                                      random_between(&random, 1e-3, 0.03)};
                const bool sucks = random_below(&random, 2) == 0;
                const double amount = sucks ? random_between(&random, 0.0, 2e-4) : (double)INFINITY;
                const RemovalOutcome went =
                    wall_remove(&bench, sucks ? REMOVER_SUCTION : REMOVER_DRILL, &mouth, amount);
                assert_true(!cut_refuses(went.verdict));
                expect_at_most(went.area, amount);
                removed += went.removed;
                removals++;
            }
            wall_expect_sound(&bench, &shape, 0);
            most_pieces = shape.pieces > most_pieces ? shape.pieces : most_pieces;
        }
        copies += (int)*bench.detail->set.cut->copies;
        assert_int_equal(sim_resets(bench.sim), 0);
    }
    print_message("%d removals of %d faces, %d copies, at most %d pieces\n", removals, removed,
                  copies, most_pieces);
    assert_true(removed > 2 * removals);
}
