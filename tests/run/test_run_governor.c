// SPDX-License-Identifier: MIT
// The governor of the time budget, as a function of measured times.
#include "test.h"
#include "geometry/levels.h"
#include "run/governor.h"

enum { RATE = 1000, WINDOW = 250 }; // ticks; of 1 ms

static const int64_t FAST = 300000, MIDDLING = 700000, SLOW = 1500000; // [ns]

static const int64_t PERIOD = 1000000000 / RATE;

// The clock of these tests: a tick that takes longer than its period takes whole periods, as in the
// loop.
static int64_t now_ns;

static GovernorAct run_tick(Governor *governor, int64_t ns, int finest)
{
    const int64_t begin = now_ns;
    now_ns += (ns + PERIOD - 1) / PERIOD * PERIOD;
    return governor_tick(governor, begin, ns, finest);
}

// A window of ticks, `slow` of them slow and the others as given; the last act, the only one that
// may not be rest.
static GovernorAct run_window(Governor *governor, int64_t ns, int slow, int finest)
{
    const int64_t end = now_ns + WINDOW * PERIOD;
    GovernorAct act = GOVERNOR_RESTS;
    for (int i = 0; now_ns < end; i++) {
        assert_int_equal(act, GOVERNOR_RESTS);
        act = run_tick(governor, i < slow ? SLOW : ns, finest);
    }
    return act;
}

static Governor governor_at(double rate_hz)
{
    Governor governor;
    governor_init(&governor, rate_hz);
    return governor;
}

static void expect_setting(const Governor *governor, double scale, int level)
{
    GovernorSetting setting = governor_setting(governor);
    expect_near(setting.scale, scale, 0.0);
    assert_int_equal(setting.level, level);
}

TEST(rest_while_ticks_end_in_time)
{
    Governor governor = governor_at(RATE);
    for (int k = 0; k < 50; k++) {
        // One in twenty may be late: 11 of 239, since each of these takes two periods.
        assert_int_equal(run_window(&governor, k % 2 ? FAST : MIDDLING, 11, 3), GOVERNOR_RESTS);
        expect_setting(&governor, 1.0, LEVELS_MAX);
    }
    assert_int_equal(governor.actions, 0);
    assert_int_equal(run_window(&governor, FAST, 12, 3), GOVERNOR_LOWERS);
}

TEST(thresholds_rise_first_then_levels_fall_one_a_window)
{
    Governor governor = governor_at(RATE);
    static const double scale[] = {2.0, 4.0, 8.0, 8.0, 8.0};
    static const int level[] = {LEVELS_MAX, LEVELS_MAX, LEVELS_MAX, 1, 0};
    for (int k = 0; k < 5; k++) {
        assert_int_equal(run_window(&governor, SLOW, 0, 2), GOVERNOR_LOWERS);
        expect_setting(&governor, scale[k], level[k]);
    }
    // The coarsest: it says so once and stays.
    assert_int_equal(run_window(&governor, SLOW, 0, 0), GOVERNOR_SPENT);
    for (int k = 0; k < 3; k++)
        assert_int_equal(run_window(&governor, SLOW, 0, 0), GOVERNOR_RESTS);
    expect_setting(&governor, 8.0, 0);
    // And all the way back.
    for (int k = 4; k >= 0; k--) {
        GovernorAct act = GOVERNOR_RESTS;
        for (int w = 0; w < 8 && act == GOVERNOR_RESTS; w++)
            act = run_window(&governor, FAST, 0, 0);
        assert_int_equal(act, GOVERNOR_RAISES);
        expect_setting(&governor, k == 0 ? 1.0 : scale[k - 1], k == 0 ? LEVELS_MAX : level[k - 1]);
    }
    assert_int_equal(governor.actions, 10);
}

TEST(coarse_body_has_no_level_to_lower)
{
    Governor governor = governor_at(RATE);
    for (int k = 0; k < 3; k++)
        assert_int_equal(run_window(&governor, SLOW, 0, 0), GOVERNOR_LOWERS);
    assert_int_equal(run_window(&governor, SLOW, 0, 0), GOVERNOR_SPENT);
    expect_setting(&governor, 8.0, LEVELS_MAX);
    // Once it has refined there is.
    assert_int_equal(run_window(&governor, SLOW, 0, 1), GOVERNOR_LOWERS);
    expect_setting(&governor, 8.0, 0);
}

// Between the limits nothing happens: what is not late has no time to spare either.
TEST(stage_holds_between_the_limits)
{
    Governor governor = governor_at(RATE);
    assert_int_equal(run_window(&governor, SLOW, 0, 2), GOVERNOR_LOWERS);
    for (int k = 0; k < 100; k++)
        assert_int_equal(run_window(&governor, MIDDLING, 0, 2), GOVERNOR_RESTS);
    for (int k = 0; k < 7; k++)
        assert_int_equal(run_window(&governor, FAST, 0, 2), GOVERNOR_RESTS);
    assert_int_equal(run_window(&governor, MIDDLING, 0, 2), GOVERNOR_RESTS); // counts from scratch
    for (int k = 0; k < 7; k++)
        assert_int_equal(run_window(&governor, FAST, 0, 2), GOVERNOR_RESTS);
    assert_int_equal(run_window(&governor, FAST, 0, 2), GOVERNOR_RAISES);
}

// A load that fits one stage up and not at all below: it tries ever less often, and again sooner
// once a stage back has lasted.
TEST(vain_returns_become_rare)
{
    Governor governor = governor_at(RATE);
    assert_int_equal(run_window(&governor, SLOW, 0, 2), GOVERNOR_LOWERS);
    int waited[7];
    for (int k = 0; k < 7; k++) {
        waited[k] = 1;
        while (run_window(&governor, FAST, 0, 2) == GOVERNOR_RESTS)
            waited[k]++;
        assert_int_equal(governor.reduction, 0);
        assert_int_equal(run_window(&governor, SLOW, 0, 2), GOVERNOR_LOWERS);
    }
    static const int expected[7] = {8, 16, 32, 64, 128, 128, 128}; // windows
    for (int k = 0; k < 7; k++)
        assert_int_equal(waited[k], expected[k]);
    while (run_window(&governor, FAST, 0, 2) == GOVERNOR_RESTS) {
    }
    for (int k = 0; k < 128; k++)
        assert_int_equal(run_window(&governor, FAST, 0, 2), GOVERNOR_RESTS);
    assert_int_equal(run_window(&governor, SLOW, 0, 2), GOVERNOR_LOWERS);
    int again = 1;
    while (run_window(&governor, FAST, 0, 2) == GOVERNOR_RESTS)
        again++;
    assert_int_equal(again, 8);
}

// A model of the thing governed: each stage costs half of the one before. It settles at the first
// stage that ends in time and stays there.
TEST(governed_load_settles)
{
    for (int heavy = 1; heavy <= 5; heavy++) {
        Governor governor = governor_at(RATE);
        int moves = 0;
        for (int w = 0; w < 40; w++) {
            int64_t ns = (int64_t)(0.8e6 * (double)(1 << heavy)) >> governor.reduction;
            moves += run_window(&governor, ns, 0, 2) != GOVERNOR_RESTS;
        }
        assert_int_equal(governor.reduction, heavy); // 0.8 ms: neither late nor with room
        assert_int_equal(moves, heavy);
    }
}

TEST(low_rates_have_windows_of_twenty_ticks)
{
    Governor governor = governor_at(10.0);
    for (int i = 1; i < 20; i++)
        assert_int_equal(governor_tick(&governor, i * 100000000, 95000000, 2), GOVERNOR_RESTS);
    assert_int_equal(governor_tick(&governor, 2000000000, 95000000, 2), GOVERNOR_LOWERS);
}

// A tick of 64 periods took as many windows to be judged, 16 s, where a window was so many ticks.
TEST(a_window_ends_by_the_clock_however_few_its_ticks)
{
    Governor governor = governor_at(RATE);
    const int64_t begin = now_ns;
    int ticks = 1;
    while (run_tick(&governor, 64 * PERIOD, 2) == GOVERNOR_RESTS)
        ticks++;
    assert_int_equal(ticks, 4); // 256 ms
    assert_true(now_ns - begin <= (WINDOW + 64) * PERIOD);
    // One tick alone is no sign, as long as it may be: the machine stood still.
    assert_int_equal(run_tick(&governor, 400 * PERIOD, 2), GOVERNOR_RESTS);
    assert_int_equal(run_tick(&governor, FAST, 2), GOVERNOR_RESTS);
    assert_int_equal(run_tick(&governor, 400 * PERIOD, 2), GOVERNOR_RESTS);
    assert_int_equal(run_tick(&governor, 400 * PERIOD, 2), GOVERNOR_LOWERS);
}

TEST(forgotten_ticks_do_not_count)
{
    Governor governor = governor_at(RATE);
    for (int i = 0; i < WINDOW / 2 - 1; i++) // of two periods each
        run_tick(&governor, SLOW, 2);
    governor_forget(&governor);
    assert_int_equal(run_window(&governor, FAST, 0, 2), GOVERNOR_RESTS);
    assert_int_equal(run_window(&governor, SLOW, 0, 2), GOVERNOR_LOWERS);
    governor_restart(&governor);
    expect_setting(&governor, 1.0, LEVELS_MAX);
}

TEST(says_what_it_did_and_why)
{
    Governor governor = governor_at(RATE);
    char text[192];
    run_window(&governor, SLOW, 0, 1);
    governor_describe(&governor, GOVERNOR_LOWERS, text, sizeof text);
    assert_string_equal(text, "p95 of 125 ticks over 0.9 ms: adapt_scale 2");
    for (int k = 0; k < 3; k++)
        run_window(&governor, SLOW, 0, 1);
    governor_describe(&governor, GOVERNOR_LOWERS, text, sizeof text);
    assert_string_equal(text, "p95 of 125 ticks over 0.9 ms: adapt_level 0");
    governor_describe(&governor, GOVERNOR_SPENT, text, sizeof text);
    assert_string_equal(text, "p95 of 125 ticks over 0.9 ms: nothing is left to lower");
    for (int k = 0; k < 8; k++)
        run_window(&governor, FAST, 0, 0);
    governor_describe(&governor, GOVERNOR_RAISES, text, sizeof text);
    assert_string_equal(text, "p95 of 250 ticks within 0.5 ms: adapt_scale 8");
}
