// SPDX-License-Identifier: MIT
// Refining and coarsening faces at random, with everything re-derived after each change.
#include "test.h"
#include "detail_bench.h"

#include "effort.h"
#include "fixture.h"
#include "geometry/generator.h"
#include "random.h"

#include <setjmp.h>
#include <stdarg.h>

static void fuzz(TriMesh *mesh, const SurfaceOptions *options, uint64_t random, int changes)
{
    SCOPED(bench_destroy) DetailBench bench;
    bench_create(&bench, BENCH_ADAPTIVE, mesh, options, NULL, NULL);
    bench_expect_sound(&bench);
    int most_hanging = 0;
    for (int i = 0; i < changes; i++) {
        // Grows for a while, then shrinks.
        bench_change_at_random(&bench, &random, i < changes / 2 ? 9 : 2);
        bench_expect_sound(&bench);
        if (bench.detail->lists.hanging_count > most_hanging)
            most_hanging = bench.detail->lists.hanging_count;
    }
    assert_true(bench.detail->adapt.sweep->refined > changes / 4);
    assert_true(bench.detail->adapt.sweep->coarsened > changes / 10);
    assert_true(!bench.detail->set.constrained || most_hanging > 10);
}

TEST(random_changes_keep_every_invariant)
{
    TriMesh mesh;
    for (int adjust = 0; adjust < 2; adjust++) {
        for (int levels = 1; levels <= 4; levels++) {
            SurfaceOptions options = bench_options(levels, 0);
            options.adjust = (SurfaceAdjust)adjust;
            if (adjust == ADJUST_CONTINUUM)
                options.material.thickness = 0.002;
            fixture_sphere(&mesh);
            fuzz(&mesh, &options, 17 + (uint64_t)levels, EFFORT(120));
            fixture_sheet(&mesh);
            fuzz(&mesh, &options, 170 + (uint64_t)levels, EFFORT(120));
        }
        SurfaceOptions options = bench_options(2, 1);
        options.adjust = (SurfaceAdjust)adjust;
        options.body.precision = PRECISION_SINGLE;
        if (adjust == ADJUST_CONTINUUM)
            options.material.thickness = 0.002;
        fixture_organ(&mesh);
        fuzz(&mesh, &options, 5, EFFORT(120));
    }
}
