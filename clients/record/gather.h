// SPDX-License-Identifier: MIT
// Rows of tools: position, orientation and force at the ticks of the frames, from contacts
// (position and force) and poses (orientation). One thread.
#ifndef PLIANT_CLIENTS_RECORD_GATHER_H
#define PLIANT_CLIENTS_RECORD_GATHER_H

#include "survey.h"

enum { GATHER_HISTORY = 256, GATHER_WAITING = 16 };

typedef struct GatherContact {
    int64_t step, pose_utime;
    double time; // [s]
    Vec3 position, force;
} GatherContact;

typedef struct GatherPose {
    int64_t utime;
    Quat orientation;
} GatherPose;

typedef struct GatherTool {
    GatherContact contact[GATHER_HISTORY]; // the newest, in a ring
    GatherPose pose[GATHER_HISTORY];
    int64_t contacts, poses;         // received
    int64_t waiting[GATHER_WAITING]; // ticks of frames whose contact has not arrived
    int waiting_count;
    int64_t row_step; // of the last row; -1: none
    Quat orientation; // of the last row
} GatherTool;

// A complete row.
typedef struct GatherRow {
    double time; // [s]
    RecordingTool sample;
} GatherRow;

void gather_restart(GatherTool *tool);
// Returns false if it is no message of this type.
bool gather_read_contact(const void *data, size_t size, int *id, GatherContact *contact);
bool gather_read_pose(const void *data, size_t size, int *id, GatherPose *pose);
void gather_take_contact(GatherTool *tool, const GatherContact *contact);
void gather_take_pose(GatherTool *tool, const GatherPose *pose);
// Requests the row of a recorded frame's tick.
void gather_want(GatherTool *tool, int64_t step);
// Makes the next complete row, in the order of the ticks. A tool that no client drives has none.
bool gather_next(GatherTool *tool, bool is_static, GatherRow *row);

#endif
