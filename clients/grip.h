// How far a grasper's jaws are closed, as a course over time.
#ifndef PLIANT_CLIENTS_GRIP_H
#define PLIANT_CLIENTS_GRIP_H

#include <stdbool.h>

enum { GRIP_POINTS = 64 };

// Straight lines between the points, constant before the first and after the last; without points
// open.
typedef struct Grip {
    int count;
    double time[GRIP_POINTS];  // [s], never falling
    double value[GRIP_POINTS]; // 0 open .. 1 closed
} Grip;

// "G", or "T:G,T:G,..." with times of 0 to 1e5 s that do not fall. False: what it wants is told.
bool grip_parse(const char *text, Grip *grip);
double grip_at(const Grip *grip, double time);

#endif
