// SPDX-License-Identifier: MIT
// A model of what real devices and networks make of an ideal motion: noise, steps of an encoder,
// rates, gaps, losses, delays, and poses that overtake each other. Takes the ideal poses, keeps
// what is in transit in the order of its arrival, and gives back what has arrived. Uses no network
// and no clock: the caller passes the time. One thread.
//
// What is random follows from the seed, the item and the time of the sample [us] alone: neither an
// item more nor a tick that was missed changes any other.
#ifndef PLIANT_CLIENTS_DEVICE_H
#define PLIANT_CLIENTS_DEVICE_H

#include "base/check.h"

#include <pliant/client.h>

#include <stdbool.h>
#include <stdint.h>

enum { DEVICE_WAITING = 8192 }; // messages in transit, at most; more are lost

// All zero: what arrives is what was sent.
typedef struct DeviceOptions {
    double noise;                 // standard deviation of each coordinate [m]
    double quantum;               // step of the encoder [m]
    double rate_hz;               // samples per second; 0: each ideal pose is one
    double gap_length, gap_every; // no poses during the first `length` of every `every` [s]
    double wrong, wrong_every;    // one sample is off by `wrong` [m], every `every` [s]
    double late;                  // delay of all [s]
    double jitter;                // and |normal| of this standard deviation [s]
    double reorder;               // and uniform in [0, this) [s]
    double loss;                  // fraction of the messages
    bool duplicate;               // each message comes again 0.3 ms later
    double seed;                  // an integer
} DeviceOptions;

typedef struct DevicePose {
    double time, arrives; // of the sample, of its message [s]
    int32_t number;       // of the sample, from 0; what comes again has the same one
    PliantPose pose;
} DevicePose;

typedef struct Device {
    DeviceOptions options;
    DevicePose waiting[DEVICE_WAITING]; // a ring, in the order of arrival
    unsigned first, end;
    // the newest ideal pose, and at a rate the number of the first sample behind it
    bool begun;
    double time; // [s]
    PliantPose ideal;
    double due;
    double wrongs; // `wrong_every` that have passed
    // for the caller
    int32_t samples, silent;          // `silent`: in gaps
    int32_t newest;                   // number of the newest sample that has arrived
    int64_t lost, arrived, overtaken; // messages
} Device;

// Reads "noise=20e-6,gap=0.06/0.25,duplicate". Returns false with `why`: the words that follow the
// quoted text, with the wrong item.
bool device_parse(const char *text, DeviceOptions *options, Status *why);

void device_begin(Device *device, const DeviceOptions *options);
// Takes the ideal pose at `time`, from 0 on and not before the one taken last. Samples lie between
// the two, on the straight way. Velocities are the ideal ones.
void device_send(Device *device, double time, const PliantPose *ideal);
// Returns when the next message arrives [s]; infinite: none is in transit.
double device_next(const Device *device);
// Takes the next message that has arrived by `time`; call it until it returns false.
bool device_take(Device *device, double time, DevicePose *pose);

#endif
