// SPDX-License-Identifier: MIT
// One trial of touch: a hand moves a tool of a scene through a device and a network (device.h), and
// feels its force through the network and the client library's haptic loop. All in this process and
// on simulated time, so that a trial repeats bit by bit. One thread.
#ifndef PLIANT_TOUCH_TRIAL_H
#define PLIANT_TOUCH_TRIAL_H

#include "device.h"

#include "scene/build.h"

#include <stdbool.h>

enum { TRIAL_SAMPLES = 1 << 16 };

// Where a tool presses a body, and the world for it. All ways are from `touch`, where the tool is
// first felt.
typedef struct Bench {
    World world;
    void *start;    // the state in which each trial begins
    int tool, body; // indices
    Vec3 touch, inward, sideways;
    Quat orientation;
    double radius, thickness, extent; // of the tip; of the body [m]
    double depth;                     // of the full press [m]
} Bench;

// Builds the world, and comes slowly to the place where pliant-study would press. `tool` < 0: the
// one that it would take. Returns false with `status`.
bool bench_begin(Bench *bench, const Scene *scene, int body, int tool, Status *status);
void bench_end(Bench *bench);
// Returns the world to where each trial begins.
void bench_restart(Bench *bench);

// A part of the hand's way, straight and even.
typedef struct Leg {
    double seconds, depth, side; // its end [s], [m], [m]
    double grip;
} Leg;

typedef struct Trial {
    const Leg *leg; // the first one, of any length, is where the hand begins
    int leg_count;
    double swing, hz; // instead of legs: a sine from 0 to this depth [m], [Hz]
    double push;      // instead of both: a device of DEVICE_MASS is pushed [N]
    double seconds;   // of a swing or a push
    double rate_hz;   // of the client, which samples and renders
    DeviceOptions device;
    bool haptic;  // the client renders; else the hand feels what the server computed last
    bool guard;   // of the client
    double scale; // of force, stiffness and damping on their way to the client
} Trial;

#define DEVICE_MASS    0.1 // [kg]
#define DEVICE_DAMPING 0.2 // [N s/m]

// What the hand did and felt, at the client's rate. `time` is 0 at the end of the first leg.
typedef struct Curve {
    int count;
    bool whole;                                                            // it had room
    double time[TRIAL_SAMPLES], depth[TRIAL_SAMPLES], push[TRIAL_SAMPLES]; // push: against it [N]
    Vec3 hand[TRIAL_SAMPLES], force[TRIAL_SAMPLES];
    double stiffness; // told along the press by the last contact [N/m]
} Curve;

// Runs it, from the bench's start.
void trial_run(Bench *bench, const Trial *trial, Curve *curve);

#endif
