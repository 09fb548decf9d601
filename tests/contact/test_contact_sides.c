// SPDX-License-Identifier: MIT
// A hollow wall remembers on which side a tool stands (server/sim/README.md, "Sides of hollow
// walls"): random pushes, held and slowly withdrawn, must not leak. Pushes are as fast as 10 m/s
// and go through most of the body.
#include "test.h"
#include "sim_steps.h"
#include "contact_bench.h"
#include "random.h"

// Instrumented builds are many times slower: every third seed there.
#ifndef __has_feature // gcc defines macros instead
#define __has_feature(x) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) ||                               \
    __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
enum { EVERY = 3 };
#else
enum { EVERY = 1 };
#endif

static TriMesh make_mesh(int which)
{
    return which == 0 ? bench_uv_sphere() : bench_ico_sphere(which + 1); // 114, 162, 642 nodes
}

typedef struct Trial {
    double speed, depth, radius, length; // [m/s], [m]; length 0: a ball
    bool lost;                           // no force while the hand was inside
    bool caught;                         // not back at rest after the hand was outside again
} Trial;

// Where the hand is on its way.
typedef struct Way {
    Vec3 start, inwards;
    Quat turn;
} Way;

static void step_to(Bench *bench, const Way *way, double s)
{
    bench_place(bench, 0, vec3_madd(way->start, s, way->inwards), way->turn);
    sim_step(bench->sim);
}

// From outside, anywhere on the part that is free, more or less inwards; a capsule lies any way.
static void choose(Trial *trial, Way *way, uint64_t seed, double length)
{
    static const double radii[] = {0.003, 0.005, 0.010};
    uint64_t random = 1000 * seed + 77;
    for (int i = 0; i < 8; i++) // neighbouring seeds start alike
        random_bits(&random);
    *trial = (Trial){.radius = radii[seed % 3], .length = length};
    trial->speed = 0.1 * pow(100.0, random_between(&random, 0.0, 1.0));
    trial->depth = random_between(&random, 0.015, 0.085);
    double x = random_between(&random, -1.0, 1.0), y = random_between(&random, -1.0, 1.0);
    Vec3 out = vec3_unit(vec3(x, y, random_between(&random, 0.0, 1.0)));
    way->inwards = vec3_unit(vec3_madd(vec3_scale(-1.0, out), 0.4, random_vec3(&random)));
    way->turn = quat_from_rotation(vec3_scale(3.0, random_vec3(&random)));
    Vec3 arm = quat_rotate(way->turn, vec3(0.5 * length, 0.0, 0.0));
    double clear = BENCH_RADIUS + trial->radius + fabs(vec3_dot(arm, out)) + 0.002;
    way->start = vec3_scale(clear, out);
}

static Trial run_trial(int mesh, uint64_t seed, double length)
{
    Trial trial;
    Way way;
    choose(&trial, &way, seed, length);
    BenchOptions options = bench_with_tool(make_mesh(mesh), bench_capsule(length, trial.radius));
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    double end = trial.depth + 0.002, step = trial.speed * sim_tick(bench.sim);
    for (double s = 0.0; s < end; s += step)
        step_to(&bench, &way, s);
    step_to(&bench, &way, end);
    bench_run(&bench, 0.3);
    // Inside: the ball is wholly within the sphere at rest (its facets are up to 2 mm inside it).
    Vec3 goal = vec3_madd(way.start, end, way.inwards);
    if (vec3_length(goal) < BENCH_RADIUS - trial.radius - 0.003)
        trial.lost = vec3_length(sim_wrench(bench.sim, 0)->force) == 0.0;

    // Slowly out again the way it came, and a little farther.
    for (double s = end; s > -0.01; s -= 0.1 * sim_tick(bench.sim))
        step_to(&bench, &way, s);
    bench_run(&bench, 1.0);
    // Energy falls with exp(-30 t) once the tool is off, from below 0.1 J.
    trial.caught = sim_wrench(bench.sim, 0)->contact || !(energy_of(bench.body) < 1e-8) ||
                   sim_resets(bench.sim) > 0;
    return trial;
}

static void count_leaks(int mesh, int seeds, double length, int *all, int *slow)
{
    for (int seed = 0; seed < seeds; seed += EVERY) {
        Trial trial = run_trial(mesh, (uint64_t)seed, length);
        if (!trial.lost && !trial.caught)
            continue;
        print_message("mesh %d seed %d: %s%s, %.2f m/s, %.0f mm, r %.0f mm\n", mesh, seed,
                      trial.lost ? "no force inside " : "", trial.caught ? "caught" : "",
                      trial.speed, 1e3 * trial.depth, 1e3 * trial.radius);
        *all += 1;
        *slow += trial.speed < 1.0;
    }
}

// The prototype by which the rules were chosen knew 2 failures of 144, none slower than 1.1 m/s; of
// 900 we know 2, both on the 114 nodes, where a fold closes over the ball.
TEST(balls_do_not_leak)
{
    int all = 0, slow = 0;
    for (int mesh = 0; mesh < 3; mesh++)
        count_leaks(mesh, 48, 0.0, &all, &slow);
    assert_int_equal(slow, 0);
    assert_true(all <= 1);
}

// Long ones lie across half the body, and deep in it a wall may close around an end: 2 of 450 did.
TEST(capsules_seldom_leak_and_never_when_slow)
{
    int all = 0, slow = 0;
    for (int mesh = 0; mesh < 3; mesh++)
        count_leaks(mesh, 16, 0.04, &all, &slow);
    assert_int_equal(slow, 0);
    assert_true(all <= 1);
}

// A ball pressed into the top of a sphere until the walls fold, rolled round in the dent and over
// its rim: at every tick it feels a push out of the body or nothing, never the pull of a face whose
// side was mistaken.
TEST(tool_is_never_pulled_in_over_a_fold)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(3), bench_ball(0.008));
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    for (int i = 0; i < 3000; i++) {
        double t = i * 1e-3, phase = 5.0 * t;
        double aside = 0.012 * fmin(t, 1.0) + 0.02 * fmax(0.0, t - 1.5);
        Vec3 place = vec3(aside * cos(phase), aside * sin(phase), 0.058 - 0.025 * fmin(1.0, t));
        Vec3 force = bench_touch(&bench, 0, place);
        const ToolWrench *wrench = sim_wrench(bench.sim, 0);
        // The axis stays clear: a tenth of the radius, or what a substep may add before a retreat.
        expect_at_most(wrench->depth, 0.95 * 0.008);
        if (wrench->contact) // from the middle of the body outwards
            expect_at_least(vec3_dot(force, vec3_unit(vec3(place.x, place.y, place.z + 0.03))),
                            0.0);
    }
}
