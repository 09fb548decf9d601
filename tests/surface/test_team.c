// SPDX-License-Identifier: MIT
// Threads that share a step: every item is done once, whoever comes late, and a scene gives the
// same bits with any number of them.
#include "base/team.h"
#include "base/clock.h"
#include "test.h"
#include "effort.h"
#include "sim_steps.h"
#include "fixture.h"
#include "geometry/generator.h"

#include <stdatomic.h>
#include <time.h>

enum { ITEMS = 1000 };

typedef struct Count {
    atomic_int done[ITEMS];
    pthread_t caller;
    atomic_int by_workers;
    // A worker holds the first piece that it gets of a loop until the caller has lost patience.
    Team *team;
    bool holds;
    atomic_bool held;
    int64_t late; // as counted before the loop
} Count;

static void sleep_ms(int ms)
{
    nanosleep(&(struct timespec){.tv_nsec = 1000000L * ms}, NULL);
}

static void count_items(void *context, int first, int last)
{
    Count *count = context;
    bool called = pthread_equal(pthread_self(), count->caller);
    for (int i = first; i < last; i++)
        atomic_fetch_add(&count->done[i], 1);
    if (!called)
        atomic_fetch_add(&count->by_workers, 1);
    if (!count->holds)
        return;
    // Bounded: a machine without a processor to spare fails the test in 20 s.
    if (called)
        for (int i = 0; i < 2000 && !atomic_load(&count->held); i++)
            sleep_ms(1);
    else if (!atomic_exchange(&count->held, true))
        for (int i = 0; i < 20000 && team_late(count->team) == count->late; i++)
            sleep_ms(1);
}

static Team *make_team(int threads)
{
    Team *team = team_create(threads);
    assert_non_null(team);
    assert_true(team_start(team, threads, NULL, &(Status){0}));
    return team;
}

static void expect_each_item(Count *count, int items, int times)
{
    for (int i = 0; i < ITEMS; i++)
        assert_int_equal(atomic_load(&count->done[i]), i < items ? times : 0);
}

TEST(every_item_is_done_once_a_loop)
{
    static const int items[] = {0, 1, 7, 16, 333, ITEMS};
    for (int threads = 1; threads <= TEAM_THREADS_MOST; threads++) {
        Team *team = make_team(threads);
        assert_int_equal(team_threads(team), threads);
        for (size_t k = 0; k < sizeof items / sizeof *items; k++) {
            static Count count;
            memset(&count, 0, sizeof count);
            count.caller = pthread_self();
            for (int loop = 0; loop < 300; loop++) {
                team_run(team, count_items, &count, items[k]);
                if (loop % 100 == 99)
                    sleep_ms(2); // workers fall asleep
            }
            expect_each_item(&count, items[k], 300);
        }
        team_destroy(team);
    }
}

TEST(team_without_workers_is_its_caller)
{
    static Count count;
    memset(&count, 0, sizeof count);
    count.caller = pthread_self();
    Team *team = team_create(4);
    team_run(team, count_items, &count, ITEMS);
    expect_each_item(&count, ITEMS, 1);
    assert_int_equal(atomic_load(&count.by_workers), 0);
    team_destroy(team);
    team_destroy(NULL);
}

// Runs a loop in which a worker is late.
static void be_late(Count *count)
{
    count->holds = true;
    atomic_store(&count->held, false);
    count->late = team_late(count->team);
    team_run(count->team, count_items, count, ITEMS);
    count->holds = false;
    assert_true(atomic_load(&count->held));
    assert_int_equal(team_late(count->team), count->late + 1);
}

// A worker that is late now and then is missed for one loop, one that is late again and again for
// twice as many loops each time, up to TEAM_ALONE_MOST.
TEST(late_worker_is_waited_for_once_and_then_left_out)
{
    static Count count;
    memset(&count, 0, sizeof count);
    count.caller = pthread_self();
    count.team = make_team(2);
    be_late(&count);
    expect_each_item(&count, ITEMS, 1);
    int expected = 1;
    for (int again = 0; again < 14; again++) {
        const int before = atomic_load(&count.by_workers);
        for (int loop = 0; loop < expected; loop++)
            team_run(count.team, count_items, &count, 1);
        assert_int_equal(atomic_load(&count.by_workers), before);
        be_late(&count);
        expected = 2 * expected < TEAM_ALONE_MOST ? 2 * expected : TEAM_ALONE_MOST;
    }
    assert_int_equal(expected, TEAM_ALONE_MOST);
    // After so many loops in time, once is once again.
    for (int loop = 0; loop < expected + TEAM_SOON_LOOPS; loop++)
        team_run(count.team, count_items, &count, 1);
    be_late(&count);
    team_run(count.team, count_items, &count, 1);
    be_late(&count);
    team_destroy(count.team);
}

// --- scenes ---

// A sphere of 2562 nodes falls on the table below it, with a load on all of it.
static uint64_t hash_of_run(IntegratorKind integrator, Precision precision, Team *team)
{
    static const ToolOptions table = {.id = 1,
                                      .kind = TOOL_STATIC,
                                      .has_plane = true,
                                      .plane = {{0.0, 0.0, -0.2}, {0.0, 0.0, 1.0}}};
    FixtureOptions options = {.material = fixture_material(2e-4),
                              .shape = fixture_shape(SHAPE_BODY),
                              .integrator = integrator,
                              .precision = precision,
                              .gravity = {0.0, 0.0, -9.81},
                              .may_load = true,
                              .tool_count = 1,
                              .tool = &table,
                              .team = team};
    TriMesh mesh;
    SCOPED(fixture_destroy) Fixture fixture;
    assert_true(generate_ico_sphere(&mesh, 4, 0.2, &(Status){0}));
    fixture_create(&fixture, &mesh, &options);
    LoadOptions load = fixture_everywhere;
    load.radius = 1.0;
    load.duration = 1.0;
    apply_well(sim_apply_load, fixture.sim, &load);
    fixture_run(&fixture, EFFORT(30));
    assert_true(sim_wrench(fixture.sim, 0)->contact);
    uint64_t hash = state_hash(&fixture.state);
    return hash;
}

TEST(any_number_of_threads_gives_the_same_bits)
{
    Team *two = make_team(2), *three = make_team(3);
    static const IntegratorKind kinds[] = {INTEGRATOR_RK4, INTEGRATOR_LEAPFROG,
                                           INTEGRATOR_IMPLICIT};
    for (int k = 0; k < 6; k++) {
        IntegratorKind integrator = kinds[k % 3];
        Precision precision = k / 3 == 0 ? PRECISION_SINGLE : PRECISION_DOUBLE;
        uint64_t one = hash_of_run(integrator, precision, NULL);
        assert_true(hash_of_run(integrator, precision, two) == one);
        assert_true(hash_of_run(integrator, precision, three) == one);
    }
    team_destroy(two);
    team_destroy(three);
}
