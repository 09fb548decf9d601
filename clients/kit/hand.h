// SPDX-License-Identifier: MIT
// A model of a hand on a haptic device. The hand moves as a sine; its poses leave a thousand times
// per second, or more rarely and late; forces come back late. Between two of them the device shows
//   F = F_msg - K (x - x_msg),
// with K the stiffness in the message and x_msg the pose that it was computed for, so that a late
// force does no work on the hand that the body did not do. It does so only while the message
// reports contact and is valid, never inwards, and never beyond the device's limit. Uses no network
// and no clock: the caller passes the time. One thread.
#ifndef PLIANT_CLIENTS_HAND_H
#define PLIANT_CLIENTS_HAND_H

#include <stdbool.h>
#include <stdint.h>

enum { HAND_WAITING = 1024 }; // poses or forces in transit, at most; more are lost

typedef struct HandOptions {
    double frequency; // [Hz]
    double depth;     // of the push, from the point of touch [m]
    double rate_hz;   // poses per second; the device itself runs at HAND_RATE
    double latency;   // round trip, half of it each way [s]
    double loss;      // fraction of poses that get lost
    double max_force; // of the device [N]
    bool twist;       // poses include the hand's velocity
    bool stiffness;   // K is used
} HandOptions;

#define HAND_RATE 1000.0 // of the device [Hz]

// The members of contact_t that the law needs.
typedef struct HandForce {
    bool contact;
    double position[3];     // x_msg [m]
    double force[3];        // [N] on the tool
    double normal[3];       // unit, out of the body
    double stiffness[3][3]; // [N/m]
    double valid;           // validity after arrival [s]; 0: until the next one
} HandForce;

typedef struct HandPose {
    double time;                   // of the position [s]
    double position[3], linear[3]; // [m], [m/s]
} HandPose;

// Figures of the counted cycles: whole ones after the first.
typedef struct HandFigures {
    double put_in; // work of the hand on the tool while it pushed [J]
    double lost;   // put_in minus the work that came back [J]; negative: the loop added energy
    double step;   // largest change of the force per tick [N]
    double peak;   // largest force [N]
    int64_t ticks;
} HandFigures;

typedef struct Hand {
    HandOptions options;
    double touch[3], direction[3]; // start of the push [m]; unit, inwards
    HandPose pose[HAND_WAITING];   // a ring
    HandForce heard[HAND_WAITING]; // a ring
    double due[HAND_WAITING];      // when a received force may be shown [s]
    unsigned pose_first, pose_end, heard_first, heard_end;
    double next_pose; // [s]
    uint64_t random;
    HandForce last; // the newest force that is due
    double last_due;
    double position[3], force[3];
    bool counting;
    HandFigures figures;
} Hand;

// The law: computes the force of `last` on a hand at `position` [N].
void hand_show(const HandForce *last, const double position[3], bool stiffness, double max_force,
               double force[3]);

void hand_begin(Hand *hand, const HandOptions *options, const double touch[3],
                const double direction[3]);
// Returns position and velocity of the hand `time` after hand_begin.
void hand_at(const Hand *hand, double time, double position[3], double linear[3]);
// Returns the duration of a run of so many whole cycles, plus the first one, which does not count
// [s].
double hand_duration(const HandOptions *options, int cycles);

// One tick of the device at `time` calls these in order. Returns the next pose that leaves now,
// after its latency; call it until it returns false.
bool hand_take_pose(Hand *hand, double time, HandPose *pose);
// Takes a force that arrived since the last tick.
void hand_hear(Hand *hand, double time, const HandForce *force);
// Computes the force that the device shows, and adds it to the figures.
void hand_feel(Hand *hand, double time);

#endif
