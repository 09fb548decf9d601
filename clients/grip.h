// The closing of a grasper's jaws over time.
#ifndef PLIANT_CLIENTS_GRIP_H
#define PLIANT_CLIENTS_GRIP_H

#include <stdbool.h>

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
