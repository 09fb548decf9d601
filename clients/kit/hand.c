// SPDX-License-Identifier: MIT
#include "hand.h"

#include <math.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void hand_show(const HandForce *last, const double position[3], bool stiffness, double max_force,
               double force[3])
{
    memset(force, 0, 3 * sizeof *force);
    if (!last->contact)
        return;
    memcpy(force, last->force, 3 * sizeof *force);
    for (int i = 0; i < 3 && stiffness; i++)
        for (int k = 0; k < 3; k++)
            force[i] -= last->stiffness[i][k] * (position[k] - last->position[k]);
    // A body never pulls: an inward force is dropped.
    double out = dot(force, last->normal);
    for (int i = 0; i < 3 && out < 0.0; i++)
        force[i] -= out * last->normal[i];
    double size = sqrt(dot(force, force));
    for (int i = 0; i < 3 && size > max_force; i++)
        force[i] *= max_force / size;
}

void hand_begin(Hand *hand, const HandOptions *options, const double touch[3],
                const double direction[3])
{
    memset(hand, 0, sizeof *hand);
    hand->options = *options;
    memcpy(hand->touch, touch, sizeof hand->touch);
    memcpy(hand->direction, direction, sizeof hand->direction);
    memcpy(hand->position, touch, sizeof hand->position);
    hand->random = 1;
}

void hand_at(const Hand *hand, double time, double position[3], double linear[3])
{
    const double w = 2.0 * PI * hand->options.frequency, half = 0.5 * hand->options.depth;
    for (int k = 0; k < 3; k++) {
        position[k] = hand->touch[k] + half * (1.0 - cos(w * time)) * hand->direction[k];
        linear[k] = half * w * sin(w * time) * hand->direction[k];
    }
}

double hand_duration(const HandOptions *options, int cycles)
{
    return (1 + cycles) / options->frequency;
}

// Returns a random number in [0, 1): the upper bits of Knuth's linear congruential generator.
static double random_share(Hand *hand)
{
    hand->random = hand->random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(hand->random >> 11) * 0x1p-53;
}

// True within a millionth of a tick, since times are multiples of ticks only up to rounding.
static bool is_due(double due, double time)
{
    return due <= time + 1e-6 / HAND_RATE;
}

bool hand_take_pose(Hand *hand, double time, HandPose *pose)
{
    // Poses that fall due are drawn up, and some get lost.
    const HandOptions *options = &hand->options;
    while (is_due(hand->next_pose, time)) {
        HandPose *next = &hand->pose[hand->pose_end % HAND_WAITING];
        next->time = hand->next_pose;
        hand_at(hand, next->time, next->position, next->linear);
        hand->next_pose += 1.0 / options->rate_hz;
        bool lost = random_share(hand) < options->loss;
        if (!lost && hand->pose_end - hand->pose_first < HAND_WAITING)
            hand->pose_end++;
    }
    // The oldest leaves once half of the latency has passed.
    if (hand->pose_first == hand->pose_end)
        return false;
    const HandPose *first = &hand->pose[hand->pose_first % HAND_WAITING];
    if (!is_due(first->time + 0.5 * options->latency, time))
        return false;
    *pose = *first;
    hand->pose_first++;
    return true;
}

void hand_hear(Hand *hand, double time, const HandForce *force)
{
    if (hand->heard_end - hand->heard_first == HAND_WAITING)
        hand->heard_first++; // drop the oldest, which newer ones supersede
    hand->heard[hand->heard_end % HAND_WAITING] = *force;
    hand->due[hand->heard_end % HAND_WAITING] = time + 0.5 * hand->options.latency;
    hand->heard_end++;
}

void hand_feel(Hand *hand, double time)
{
    const HandOptions *options = &hand->options;
    // Take the newest force that has arrived by now.
    for (; hand->heard_first != hand->heard_end; hand->heard_first++) {
        unsigned first = hand->heard_first % HAND_WAITING;
        if (!is_due(hand->due[first], time))
            break;
        hand->last = hand->heard[first];
        hand->last_due = hand->due[first];
    }
    // The force of a daemon that has fallen silent expires.
    if (hand->last.valid > 0.0 && time > hand->last_due + hand->last.valid)
        hand->last.contact = false;
    double position[3], linear[3], force[3], work = 0.0, change = 0.0;
    hand_at(hand, time, position, linear);
    hand_show(&hand->last, position, options->stiffness, options->max_force, force);
    // Trapezoidal work of this tick, and the change of the force.
    for (int k = 0; k < 3; k++) {
        work -= 0.5 * (force[k] + hand->force[k]) * (position[k] - hand->position[k]);
        change += (force[k] - hand->force[k]) * (force[k] - hand->force[k]);
    }
    memcpy(hand->position, position, sizeof position);
    memcpy(hand->force, force, sizeof force);
    if (!hand->counting) { // the first cycle excites all oscillations before counting starts
        hand->counting = time >= 1.0 / options->frequency;
        return;
    }
    HandFigures *figures = &hand->figures;
    figures->ticks++;
    figures->lost += work;
    figures->put_in += fmax(0.0, work);
    figures->step = fmax(figures->step, sqrt(change));
    figures->peak = fmax(figures->peak, sqrt(dot(force, force)));
}
