// A hand on a haptic device, as arithmetic: it moves as a sine, its poses leave a thousand times a
// second or more rarely and late, forces come back late, and between two of them the device shows
//   F = F_msg - K (x - x_msg),
// K the stiffness that the message tells and x_msg the pose that it was computed for: so a force
// that comes late gives the hand no work that the body never had. Only while the message says
// contact, and as long as it is valid; never inwards; never more than the device can. Knows no
// network and no clock: whoever owns it says what time it is. One thread.
#ifndef PLIANT_CLIENTS_HAND_H
#define PLIANT_CLIENTS_HAND_H

#include <stdbool.h>
#include <stdint.h>

enum { HAND_WAITING = 1024 }; // poses or forces on their way, at most; what is more is lost

typedef struct HandOptions {
    double frequency; // [Hz]
    double depth;     // of the push, from the point of touch [m]
    double rate_hz;   // poses a second; the device itself runs at HAND_RATE
    double latency;   // there and back, half of it each way [s]
    double loss;      // share of poses that get lost
    double max_force; // of the device [N]
    bool twist;       // poses tell the hand's velocity
    bool stiffness;   // K is used
} HandOptions;

#define HAND_RATE 1000.0 // of the device [Hz]

// What of contact_t the law needs.
typedef struct HandForce {
    bool contact;
    double position[3];     // x_msg [m]
    double force[3];        // [N] on the tool
    double normal[3];       // unit, out of the body
    double stiffness[3][3]; // [N/m]
    double valid;           // for how long after it came [s]; 0: until the next one
} HandForce;

typedef struct HandPose {
    double time;                   // at which the hand was there [s]
    double position[3], linear[3]; // [m], [m/s]
} HandPose;

// Since counting began: whole cycles after the first one.
typedef struct HandFigures {
    double put_in; // work of the hand on the tool while it pushed [J]
    double lost;   // that less what came back [J]; negative: the loop gave it work
    double step;   // largest change of the force in a tick [N]
    double peak;   // largest force [N]
    int64_t ticks;
} HandFigures;

typedef struct Hand {
    HandOptions options;
    double touch[3], direction[3]; // where the push begins [m], unit, inwards
    HandPose pose[HAND_WAITING];   // a ring
    HandForce heard[HAND_WAITING]; // a ring
    double due[HAND_WAITING];      // when a heard force may be shown [s]
    unsigned pose_first, pose_end, heard_first, heard_end;
    double next_pose; // [s]
    uint64_t random;
    HandForce last; // the newest that is due
    double last_due;
    double position[3], force[3];
    bool counting;
    HandFigures figures;
} Hand;

// The law: the force of `last` for a hand at `position` [N].
void hand_show(const HandForce *last, const double position[3], bool stiffness, double max_force,
               double force[3]);

void hand_begin(Hand *hand, const HandOptions *options, const double touch[3],
                const double direction[3]);
// Where the hand is `time` after hand_begin, and how fast.
void hand_at(const Hand *hand, double time, double position[3], double linear[3]);
// How long a run of so many whole cycles takes, with the first one, which does not count [s].
double hand_duration(const HandOptions *options, int cycles);

// One tick of the device at `time`, in this order:
// the next pose that leaves now, after its latency; call it until it returns false;
bool hand_take_pose(Hand *hand, double time, HandPose *pose);
// forces that have come since the last tick;
void hand_hear(Hand *hand, double time, const HandForce *force);
// what the device shows, and what it means for the figures.
void hand_feel(Hand *hand, double time);

#endif
