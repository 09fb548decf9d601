// SPDX-License-Identifier: MIT
// The path of a page's tool: whatever the browser's gaps and bursts, the daemon gets all of it in
// small steps, and no withdrawal too early or too late. Time is simulated.
#include "path.h"
#include "random.h"
#include "test.h"

#include <math.h>

static const int64_t MS = 1000000;

// The hand: 7 cm/s along x, then along y.
static const double SPEED = 0.07, CORNER = 1.0, WHOLE = 2.0; // [m/s], [s]

static pliant_tool_pose_t pose_at(double time, bool active)
{
    pliant_tool_pose_t pose = {.tool = 2, .orientation = {1.0, 0.0, 0.0, 0.0}, .active = active};
    pose.position[0] = SPEED * fmin(time, CORNER);
    pose.position[1] = SPEED * fmax(time - CORNER, 0.0);
    return pose;
}

// What the daemon gets.
typedef struct Published {
    pliant_tool_pose_t last;
    int64_t at_ns;
    double gap, off, step, way; // most between two [s]; most off the hand's way [m]; longest step
    int withdrawals, backward;
} Published;

static double way_of(const pliant_tool_pose_t *pose)
{
    return pose->position[0] + pose->position[1];
}

static void publish(Published *published, const pliant_tool_pose_t *pose, int64_t now)
{
    if (published->last.active) {
        published->gap = fmax(published->gap, 1e-9 * (double)(now - published->at_ns));
        const double x = pose->position[0] - published->last.position[0],
                     y = pose->position[1] - published->last.position[1];
        published->step = fmax(published->step, hypot(x, y));
        published->backward += way_of(pose) < published->way - 1e-12;
    }
    // The distance from the two legs.
    published->off =
        fmax(published->off, fmin(fabs(pose->position[1]), SPEED * CORNER - pose->position[0]));
    published->withdrawals += !pose->active;
    published->way = way_of(pose);
    published->last = *pose;
    published->at_ns = now;
}

// A path, what comes of it, and the time now.
typedef struct Trial {
    ToolPath path;
    Published published;
    uint64_t chance;
    int64_t now;
} Trial;

// A hand begins to move at `place` [s of its way], at the page's `time` [s].
static void begin(Trial *trial, double place, double time)
{
    const pliant_tool_pose_t pose = pose_at(place, true);
    path_begin(&trial->path, &pose, time, trial->now);
    publish(&trial->published, &pose, trial->now);
}

static void take(Trial *trial, double place, bool active, double time)
{
    const pliant_tool_pose_t pose = pose_at(place, active);
    if (path_take(&trial->path, &pose, time, trial->now))
        publish(&trial->published, &pose, trial->now);
}

// Turns in time, or late by up to `late` ms, until the time `to`.
static void turn(Trial *trial, int64_t to, int late)
{
    while (trial->now + PATH_STEP_MS * MS <= to) {
        pliant_tool_pose_t pose;
        trial->now += (PATH_STEP_MS + (late > 0 ? random_below(&trial->chance, late) : 0)) * MS;
        if (path_turn(&trial->path, trial->now, &pose))
            publish(&trial->published, &pose, trial->now);
    }
    trial->now = trial->now > to ? trial->now : to;
}

// A browser that draws for 50 to 600 ms at a time, and then sends what the pointer did meanwhile.
static Published stroke(uint64_t seed, int late)
{
    Trial trial = {.chance = seed, .now = 5000 * MS};
    const int64_t began = trial.now;
    double sent = 0.0;
    begin(&trial, 0.0, 100.0);
    while (sent < WHOLE) {
        turn(&trial, trial.now + (50 + random_below(&trial.chance, 551)) * MS, late);
        const double moved = 1e-9 * (double)(trial.now - began);
        while (sent < WHOLE && sent + 0.008 <= moved) {
            sent = fmin(sent + 0.008, WHOLE);
            take(&trial, sent, true, 100.0 + sent);
        }
    }
    take(&trial, WHOLE, false, 100.05 + WHOLE); // the button is released while the mouse rests
    turn(&trial, trial.now + 3000 * MS, late);
    return trial.published;
}

TEST(gaps_and_bursts_of_a_browser_become_one_even_path)
{
    for (uint64_t seed = 1; seed <= 200; seed++) {
        const int late = seed % 2 ? 0 : 60;
        const Published p = stroke(seed, late);
        // No longer silent than a turn and the 60 ms after which repeats begin.
        expect_at_most(p.gap, 0.0701 + 2e-3 * late);
        // Corners are cut by half a step of 40 ms of the hand's way at most, and by its 8 ms.
        expect_at_most(p.off, 0.5 * 0.048 * SPEED);
        expect_at_most(p.step, 0.0481 * SPEED);
        assert_int_equal(p.backward, 0);
        assert_int_equal(p.withdrawals, 1);
        assert_false(p.last.active);
        expect_near(p.way, SPEED * WHOLE, 1e-12); // rounding of sums below 1 m
    }
}

TEST(poses_that_come_evenly_are_published_as_they_come)
{
    static ToolPath path;
    pliant_tool_pose_t pose = pose_at(0.0, true), other;
    path_begin(&path, &pose, -1.0, 0);
    for (int k = 1; k < 100; k++) {
        pose = pose_at(0.05 * k, true);
        assert_true(path_take(&path, &pose, -1.0, 50 * k * MS));
        assert_false(path_turn(&path, (50 * k + 10) * MS, &other));
    }
}

TEST(a_page_that_stays_silent_lets_go_after_a_second)
{
    Trial trial = {.chance = 1};
    begin(&trial, 0.5, 0.0);
    turn(&trial, 10000 * MS, 0);
    expect_near(1e-9 * (double)trial.published.at_ns, 1.0, 0.021); // the last of the repeats
    // It begins again where the page says, at once: what was between is not known.
    const pliant_tool_pose_t pose = pose_at(1.5, true);
    assert_true(path_take(&trial.path, &pose, 10.0, trial.now));
}

TEST(after_a_longer_stall_a_known_way_begins_again_where_it_was)
{
    Trial trial = {.chance = 1};
    begin(&trial, 0.0, 0.0);
    // 1.8 s of the hand's way in one burst, each with its time.
    turn(&trial, 1800 * MS, 0);
    for (int k = 1; k <= 225; k++)
        take(&trial, 0.008 * k, true, 0.008 * k);
    turn(&trial, trial.now + PATH_STEP_MS * MS, 0);
    expect_near(trial.published.way, 0.0, 0.0);
    turn(&trial, trial.now + 3000 * MS, 0);
    expect_at_most(trial.published.step, 0.0481 * SPEED); // as above
    expect_near(trial.published.way, 1.8 * SPEED, 1e-12);
}

TEST(a_second_stroke_does_not_begin_where_the_first_one_ended)
{
    Trial trial = {.chance = 1};
    begin(&trial, 0.0, 0.0);
    // All in one burst: there, up, down elsewhere, up.
    turn(&trial, 400 * MS, 0);
    const double place[] = {0.1, 0.2, 1.8, 1.9};
    for (int k = 0; k < 4; k++) {
        take(&trial, place[k], true, 0.1 * k);
        if (k % 2)
            take(&trial, place[k], false, 0.1 * k);
    }
    turn(&trial, 3000 * MS, 0);
    assert_int_equal(trial.published.withdrawals, 2);
    expect_at_most(trial.published.step, 0.2 * SPEED); // the way between the strokes is 1.6
    expect_near(trial.published.way, 1.9 * SPEED, 1e-12);
}

TEST(a_flood_of_poses_loses_no_withdrawal)
{
    Trial trial = {.chance = 1};
    begin(&trial, 0.0, 0.0);
    turn(&trial, 400 * MS, 0);
    for (int k = 0; k < 10 * PATH_POINTS; k++)
        take(&trial, 1e-4 * k, k % 300 != 299, 1e-3 * k);
    assert_int_equal(trial.path.count, PATH_POINTS);
    take(&trial, 0.5, false, 2.0);
    turn(&trial, 20000 * MS, 0);
    assert_false(trial.published.last.active);
    assert_int_equal(trial.path.count, 0);
}
