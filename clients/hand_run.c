// SPDX-License-Identifier: MIT
#include "hand_run.h"

#include <math.h>
#include <string.h>

static const double REST = 0.4; // pause before each run, in which the body comes to rest [s]

void hand_run_hear(HandRun *run, const PliantContact *contact)
{
    if (!run->active)
        return;
    HandForce force = {.contact = contact->contact, .valid = contact->valid};
    double size = 0.0;
    memcpy(force.position, contact->position, sizeof force.position);
    memcpy(force.force, contact->force, sizeof force.force);
    memcpy(force.normal, contact->normal, sizeof force.normal);
    memcpy(force.stiffness, contact->stiffness, sizeof force.stiffness);
    for (int i = 0; i < 9; i++)
        size += fabs(force.stiffness[i / 3][i % 3]);
    run->forces++;
    run->stiff += size > 0.0;
    hand_hear(&run->hand, (double)(program_now_ns() - run->start_ns) * 1e-9, &force);
}

// Runs ticks for `seconds`; `moves`: the hand moves, else it rests.
static bool run_ticks(HandRun *run, double seconds, bool moves, PliantError *error)
{
    const int64_t period_ns = (int64_t)(1e9 / HAND_RATE);
    const double still[3] = {0.0, 0.0, 0.0};
    // Ticks at absolute deadlines, as in the daemon.
    run->start_ns = program_now_ns();
    for (int64_t tick = 0;; tick++) {
        int64_t behind = (program_now_ns() - run->start_ns) / period_ns - tick;
        if (behind > 1) // the process was stopped: continue from now, without a burst
            tick += behind;
        const double time = (double)tick / HAND_RATE;
        const int64_t now_ns = run->start_ns + tick * period_ns;
        if (time > seconds)
            return true;
        // A hand at rest keeps the tool owned; one that moves sends what its model says.
        HandPose pose;
        if (!moves)
            run->send(run->user, now_ns, run->touch, still, true);
        while (moves && hand_take_pose(&run->hand, time, &pose))
            run->send(run->user, now_ns, pose.position, pose.linear, run->hand.options.twist);
        if (moves)
            hand_feel(&run->hand, time);
        // Forces arrive while it waits for the next tick.
        if (!run->wait(run->user, now_ns + period_ns))
            return program_fail(error, "stopped before the end");
    }
}

bool hand_run(HandRun *run, const HandOptions *options, PliantError *error)
{
    run->active = false;
    // First a rest, in which the tool becomes ours and the body calms down.
    if (!run_ticks(run, REST, false, error))
        return false;
    // Then the motion that counts.
    hand_begin(&run->hand, options, run->touch, run->direction);
    run->active = true;
    run->forces = run->stiff = 0;
    bool ok = run_ticks(run, hand_duration(options, run->cycles), true, error);
    run->active = false;
    return ok;
}

void hand_run_print(const HandRun *run)
{
    const HandOptions *by = &run->hand.options;
    const HandFigures *figures = &run->hand.figures;
    printf("%4.1f Hz %5.1f mm | poses %6.1f Hz %s %4.1f ms %4.1f %% lost %s | put in %8.4f mJ lost "
           "%+7.1f %% | step %.4f N peak %.4f N\n",
           by->frequency, 1e3 * by->depth, by->rate_hz, by->twist ? "by twist" : "        ",
           1e3 * by->latency, 1e2 * by->loss, by->stiffness ? "stiffness" : "         ",
           1e3 * figures->put_in,
           figures->put_in > 0.0 ? 1e2 * figures->lost / figures->put_in : 0.0, figures->step,
           figures->peak);
    if (by->stiffness && run->forces > 0 && run->stiff == 0)
        printf("   (the daemon publishes no stiffness: publish.contact_stiffness)\n");
    fflush(stdout);
}

bool hand_run_table(HandRun *run, const HandOptions *like, PliantError *error)
{
    static const HandOptions STREAMS[] = {
        {.rate_hz = 1000.0},
        {.rate_hz = 60.0},
        {.rate_hz = 60.0, .twist = true},
        {.rate_hz = 60.0, .loss = 0.05},
        {.rate_hz = 60.0, .latency = 0.02},
        {.rate_hz = 60.0, .latency = 0.02, .twist = true},
        {.rate_hz = 60.0, .latency = 0.02, .loss = 0.05},
        {.rate_hz = 60.0, .stiffness = true},
        {.rate_hz = 60.0, .latency = 0.02, .stiffness = true},
        {.rate_hz = 60.0, .latency = 0.02, .loss = 0.05, .stiffness = true},
        {.rate_hz = 1000.0, .latency = 0.02},
        {.rate_hz = 1000.0, .latency = 0.02, .stiffness = true},
        {.rate_hz = 1000.0, .latency = 0.02, .stiffness = true, .twist = true},
    };
    // Each stream at both frequencies.
    for (size_t k = 0; k < 2 * sizeof STREAMS / sizeof *STREAMS; k++) {
        HandOptions options = STREAMS[k / 2];
        options.frequency = k % 2 == 0 ? 2.0 : 6.0;
        // The user's push and device in each of them.
        options.depth = like->depth;
        options.max_force = like->max_force;
        if (!hand_run(run, &options, error))
            return false;
        hand_run_print(run);
    }
    return true;
}
