// SPDX-License-Identifier: MIT
// Bodies with levels whose numbers go bad in a tick in which they also refine, or are cut: what
// came stays, and lies between its parents.
#include "detail_bench.h"
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"

static const LoadOptions huge = {
    .center = {0.0, 0.0, 0.05}, .radius = 0.02, .force = {1e30, 0.0, 0.0}, .duration = 1.0};

typedef struct Before {
    bool *on; // [places] nodes in use
    Vec3 *x, *v;
    int places, nodes;
} Before;

// Displacement from its rest place, and velocity, of every node in use.
static void look(const DetailBench *bench, Before *out)
{
    const BodySurface *surface = &bench->body->surface;
    const size_t places = (size_t)surface->node_count;
    *out = (Before){.on = calloc(places, sizeof *out->on),
                    .x = calloc(places, sizeof *out->x),
                    .v = calloc(places, sizeof *out->v),
                    .places = surface->node_count};
    for (int i = 0; i < out->places; i++) {
        if (bench->detail->set.status[i] == NODE_OFF)
            continue;
        out->on[i] = true;
        out->nodes++;
        bench->body->ops->read_nodes(bench->model, &i, 1, &out->x[i], &out->v[i]);
        out->x[i] = vec3_sub(out->x[i], rows_rest(&bench->model->basis, bench->model->slot[i]));
    }
}

static void forget(Before *before)
{
    free(before->on);
    free(before->x);
    free(before->v);
}

static void create(DetailBench *bench, Precision precision)
{
    TriMesh mesh;
    fixture_sphere(&mesh);
    SurfaceOptions options = bench_options(2, 0);
    options.body.precision = precision;
    options.adapt.check_hz = 100.0;
    // At rest nothing is bent or fast enough to be divided: what presses alone is.
    options.adapt.speed = options.adapt.curvature = 1e6;
    options.adapt.force = 1.0;
    Vec3 initial[114], velocity[114];
    for (int i = 0; i < mesh.node_count; i++) { // stretched and turning
        const Vec3 p = mesh.position[i];
        initial[i] = (Vec3){1.02 * p.x, 0.99 * p.y + 0.01 * p.x, 1.01 * p.z};
        velocity[i] = (Vec3){-0.3 * p.y, 0.3 * p.x, 0.01};
    }
    options.body.initial_position = initial;
    options.body.initial_velocity = velocity;
    bench_create(bench, BENCH_ADAPTIVE, &mesh, &options, NULL, NULL);
    sim_ticks(bench->sim, 5);
}

// The mean of the parents, which may have come in the same tick themselves.
static Vec3 expected(const DetailBench *bench, const Before *before, const Vec3 *was, int node)
{
    if (before->on[node])
        return was[node];
    int parent[2];
    levels_parents(&bench->detail->set.levels, node, parent);
    return vec3_scale(0.5, vec3_add(expected(bench, before, was, parent[0]),
                                    expected(bench, before, was, parent[1])));
}

TEST(nodes_born_in_a_bad_tick_lie_between_their_parents)
{
    for (int precision = 0; precision < 2; precision++) {
        SCOPED(bench_destroy) DetailBench bench;
        create(&bench, (Precision)precision);
        apply_well(sim_apply_load, bench.sim, &huge);
        int64_t resets = 0;
        bool both = false;
        for (int tick = 0; tick < 20 && !both; tick++) {
            Before before, after;
            look(&bench, &before);
            const int topology = bench.body->mesh.topology;
            sim_step(bench.sim);
            look(&bench, &after);
            both = sim_resets(bench.sim) > resets && bench.body->mesh.topology != topology;
            resets = sim_resets(bench.sim);
            if (both) {
                assert_true(after.nodes > before.nodes);
                assert_int_equal(sim_guard_counts(bench.sim)->rest_shapes, 0);
                // Rounding of places of 0.05 m; what came in single precision is a sum in floats of
                // displacements of 1 mm.
                const double tolerance = precision == PRECISION_SINGLE ? 1e-9 : 1e-16;
                const bool moves = bench.body->tuning.bad_in_a_row == 1;
                for (int i = 0; i < after.places; i++) {
                    if (!after.on[i])
                        continue;
                    Vec3 u = expected(&bench, &before, before.x, i);
                    Vec3 v = expected(&bench, &before, before.v, i);
                    expect_at_most(vec3_length(vec3_sub(after.x[i], u)), tolerance);
                    v = moves ? v : (Vec3){0.0, 0.0, 0.0};
                    expect_at_most(vec3_length(vec3_sub(after.v[i], v)), 10.0 * tolerance);
                }
                bench_expect_sound(&bench);
            }
            forget(&before);
            forget(&after);
        }
        assert_true(both);
        sim_ticks(bench.sim, 100);
        assert_int_equal(sim_guard_counts(bench.sim)->loads, 1);
        assert_int_equal(sim_resets(bench.sim), GUARD_MOST_BLAME);
        bench_expect_sound(&bench);
        assert_true(bench.body->ops->check(bench.model));
    }
}

// What a change of topology has spoilt is no state to go back to.
TEST(a_state_that_was_bad_before_the_tick_is_not_restored)
{
    SCOPED(bench_destroy) DetailBench bench;
    create(&bench, PRECISION_DOUBLE);
    double *row = bench.model->rows[bench.model->current];
    row[(long)bench.model->slot[3] * ROW + 1] = (double)NAN;
    sim_step(bench.sim);
    assert_int_equal(sim_resets(bench.sim), 1);
    assert_int_equal(sim_guard_counts(bench.sim)->rest_shapes, 1);
    assert_true(bench.body->ops->check(bench.model));
    BodyMeasure measure;
    sim_measure(bench.sim, 0, &measure);
    expect_at_most(measure.max_displacement, 0.0);
}
