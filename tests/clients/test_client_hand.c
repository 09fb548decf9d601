// SPDX-License-Identifier: MIT
// The hand of pliant-probe against bodies that answer at once, by closed form: what it shows, when
// things arrive, and the work that it counts.
#include "test.h"
#include "hand.h"

static const double PI = 3.14159265358979323846;
static const double TOUCH[3] = {0.1, 0.2, 0.3}, DOWN[3] = {0.0, 0.0, -1.0};

// A spring of 10 N/m that tells its stiffness.
static HandForce spring_force(const double position[3])
{
    HandForce force = {.contact = position[2] < TOUCH[2], .normal = {0.0, 0.0, 1.0}};
    memcpy(force.position, position, sizeof force.position);
    force.force[2] = 10.0 * fmax(0.0, TOUCH[2] - position[2]);
    force.stiffness[2][2] = 10.0;
    return force;
}

static HandOptions slow_hand(void)
{
    return (HandOptions){.frequency = 2.0, .depth = 0.006, .rate_hz = 1000.0, .max_force = 3.3};
}

// The body takes every pose as it comes and answers each tick.
static HandFigures run_on_spring(const HandOptions *options)
{
    static Hand hand;
    hand_begin(&hand, options, TOUCH, DOWN);
    double at[3] = {TOUCH[0], TOUCH[1], TOUCH[2]};
    int ticks = (int)lround(hand_duration(options, 3) * HAND_RATE);
    for (int i = 0; i <= ticks; i++) {
        double time = i / HAND_RATE;
        HandPose pose;
        while (hand_take_pose(&hand, time, &pose))
            memcpy(at, pose.position, sizeof at);
        HandForce force = spring_force(at);
        hand_hear(&hand, time, &force);
        hand_feel(&hand, time);
    }
    assert_int_equal(hand.figures.ticks, ticks - (int)lround(HAND_RATE / options->frequency));
    return hand.figures;
}

TEST(law_corrects_for_the_way_gone_since)
{
    HandForce last = {.contact = true,
                      .position = {1.0, 2.0, 3.0},
                      .force = {0.0, 0.1, 0.5},
                      .normal = {0.0, 0.0, 1.0},
                      .stiffness = {{4.0, 1.0, 0.0}, {1.0, 5.0, 2.0}, {0.0, 2.0, 6.0}}};
    double position[3] = {1.01, 2.0, 2.98}, force[3];
    hand_show(&last, position, true, 3.3, force);
    // F - K (0.01, 0, -0.02)
    expect_near(force[0], -0.04, 1e-15);
    expect_near(force[1], 0.1 - 0.01 + 0.04, 1e-15);
    expect_near(force[2], 0.5 + 0.12, 1e-15);
    hand_show(&last, position, false, 3.3, force);
    expect_near(force[2], 0.5, 0.0);
}

TEST(law_never_pulls_in_and_never_exceeds_the_device)
{
    HandForce last = spring_force((double[3]){TOUCH[0], TOUCH[1], TOUCH[2] - 0.002});
    double position[3] = {TOUCH[0], TOUCH[1], TOUCH[2] + 0.01}, force[3]; // gone out meanwhile
    hand_show(&last, position, true, 3.3, force);
    expect_near(force[2], 0.0, 1e-15);
    position[2] = TOUCH[2] - 1.0;
    hand_show(&last, position, true, 3.3, force);
    expect_near(force[2], 3.3, 1e-15);
    last.contact = false;
    hand_show(&last, position, true, 3.3, force);
    expect_near(force[2], 0.0, 0.0);
}

// A spring that answers at once gives all of its work back: k d^2 / 2 each cycle, within what the
// device's ticks make of it, (pi f / 1 kHz)^2 of the work and a tick's delay in the first place.
TEST(prompt_spring_gives_all_work_back)
{
    HandOptions options = slow_hand();
    HandFigures figures = run_on_spring(&options);
    double work = 3.0 * 0.5 * 10.0 * 0.006 * 0.006;
    expect_near(figures.put_in, work, 1e-3 * work);
    expect_near(figures.lost, 0.0, 1e-3 * work);
    expect_near(figures.peak, 10.0 * 0.006, 1e-6);
}

// Late by T it is a spring k cos(w T) with a damper -k sin(w T)/w: over a cycle of amplitude d / 2
// the hand gets pi k sin(w T) (d / 2)^2. With the spring's own stiffness, nothing.
TEST(late_spring_gives_work_unless_its_stiffness_is_known)
{
    HandOptions options = slow_hand();
    options.latency = 0.02;
    HandFigures figures = run_on_spring(&options);
    double gift = 3.0 * PI * 10.0 * sin(2.0 * PI * 2.0 * 0.02) * 0.003 * 0.003;
    expect_near(figures.lost, -gift, 0.02 * gift); // it lifts off for a moment each cycle
    options.stiffness = true;
    figures = run_on_spring(&options);
    double work = 3.0 * 0.5 * 10.0 * 0.006 * 0.006;
    expect_near(figures.lost, 0.0, 0.01 * work); // the same moment
}

TEST(poses_leave_at_their_rate_and_arrive_late)
{
    static Hand hand;
    HandOptions options = slow_hand();
    options.rate_hz = 50.0;
    options.latency = 0.03;
    hand_begin(&hand, &options, TOUCH, DOWN);
    int sent = 0;
    for (int i = 0; i < 1000; i++) {
        HandPose pose;
        while (hand_take_pose(&hand, i / HAND_RATE, &pose)) {
            expect_near(pose.time, 0.02 * sent, 1e-9);
            expect_near(i / HAND_RATE - pose.time, 0.015, 1e-9); // half the round trip
            double position[3], linear[3], before[3], after[3], unused[3];
            hand_at(&hand, pose.time, position, linear);
            expect_near(pose.position[2], position[2], 0.0);
            // The velocity is the derivative of the place.
            hand_at(&hand, pose.time - 1e-6, before, unused);
            hand_at(&hand, pose.time + 1e-6, after, unused);
            expect_near(linear[2], (after[2] - before[2]) / 2e-6, 1e-8);
            sent++;
        }
    }
    assert_int_equal(sent, 50); // 0.98 s is the last that is due by 0.999 s
}

TEST(losses_are_of_their_share)
{
    static Hand hand;
    HandOptions options = slow_hand();
    options.loss = 0.2;
    hand_begin(&hand, &options, TOUCH, DOWN);
    int sent = 0;
    for (int i = 0; i < 10000; i++) {
        HandPose pose;
        while (hand_take_pose(&hand, i / HAND_RATE, &pose))
            sent++;
    }
    // Five standard deviations of 10,000 tries: 5 sqrt(10000 0.2 0.8).
    expect_near(sent, 8000.0, 200.0);
}
