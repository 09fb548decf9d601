// SPDX-License-Identifier: MIT
// A tool's path in time: read from a text file of poses, or made for a press. Between two poses the
// tool moves and turns uniformly. One thread.
#ifndef PLIANT_CLIENTS_TRACK_H
#define PLIANT_CLIENTS_TRACK_H

#include "program.h"

#include <stdbool.h>

enum { TRACK_POSES_MAX = 10000000 };
#define TRACK_REACH 1000.0 // positions are within this of the origin [m]
#define TRACK_TIME  1e6    // times are within [0, this] [s]

typedef struct TrackPose {
    double time;           // [s] from the start
    double position[3];    // world [m]
    double orientation[4]; // unit quaternion w x y z, tool frame to world frame
    double linear[3];      // [m/s], towards the next pose
    double angular[3];     // [rad/s], world frame
} TrackPose;

typedef struct Track {
    TrackPose *pose; // [count], times ascending, the first at 0; owned
    int count, capacity;
} Track;

// Reads lines "t x y z [qw qx qy qz]": seconds, metres, a unit quaternion (default: identity); '#'
// starts a comment. Times are relative to the first one. Errors name file and line. At least one
// pose.
bool track_read(Track *track, const char *path, PliantError *error);
// Makes a press: from `start` by `depth` [m] along the unit vector `direction` at `speed` [m/s], a
// rest of `hold` [s], and back; `repeat` times. The tool's z axis, the axis of its shaft in scenes,
// points backwards.
void track_press(Track *track, const double start[3], const double direction[3], double depth,
                 double speed, double hold, int repeat);
// Add poses, in ascending times from 0 on, then set the velocities.
void track_add(Track *track, double time, const double position[3], const double orientation[4]);
void track_finish(Track *track);
double track_duration(const Track *track); // [s]
// Returns the pose at `time`, with its velocities (zero outside the track).
void track_at(const Track *track, double time, TrackPose *pose);
void track_destroy(Track *track);

// --- a grasper's jaws ----------------------------------------------------------------------------

// The closing of a grasper's jaws over time.

enum { GRIP_POINTS = 64 };

// Linear between the points, constant before the first and after the last; open without points.
typedef struct Grip {
    int count;
    double time[GRIP_POINTS];  // [s], ascending
    double value[GRIP_POINTS]; // 0 open .. 1 closed
} Grip;

// Parses "G", or "T:G,T:G,..." with ascending times of 0 to 1e5 s. Returns false for other text.
bool grip_parse(const char *text, Grip *grip);
double grip_at(const Grip *grip, double time);

#endif
