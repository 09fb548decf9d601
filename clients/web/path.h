// SPDX-License-Identifier: MIT
// The path of a tool that a page moves: what a browser sends in bursts, with gaps while it draws,
// as poses in even steps. Pure arithmetic on plain data; of the thread that reads the page.
#ifndef PLIANT_WEB_PATH_H
#define PLIANT_WEB_PATH_H

#include "pliant_tool_pose_t.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    PATH_POINTS = 256, // that wait; further ones replace the newest
    PATH_STEP_MS = 4,  // between two poses of a path, and so the longest time between two turns
    PATH_LONGEST_MS = 1000, // a page that is silent for longer has let go of its tools
};

// Poses that come at least every 60 ms, and not several at once, are published as they come, and
// the daemon smooths them. After a longer gap the tool goes along the poses that came, by the
// page's own times, in the time of the gap; that time shrinks by half of what passes, so that the
// tool catches up at twice the hand's speed (the daemon's own law: server/sim/README.md, "Tools
// between poses"). Meanwhile the last pose is repeated, so that the daemon does not withdraw the
// tool.
typedef struct PathPoint {
    double time; // since the path began, by the page's clock [s]
    pliant_tool_pose_t pose;
} PathPoint;

typedef struct ToolPath {
    pliant_tool_pose_t last;   // published
    int64_t came_ns;           // newest message of the page
    int64_t turn_ns;           // last turn
    int64_t sent_ns, moved_ns; // last published pose, and last one at another place
    double page_time;          // of the newest message, by the page's clock [s]; < 0: not given
    double reach;              // from then until the tool is at the newest pose [s]
    double at, end;            // times of the last published and of the newest pose [s]
    int count;                 // of points that wait, withdrawals among them
    PathPoint point[PATH_POINTS];
} ToolPath;

// Starts a path at an active pose, which the caller publishes. `time` [s]: by the page's clock,
// negative if it gives none.
void path_begin(ToolPath *path, const pliant_tool_pose_t *pose, double time, int64_t now_ns);
// Takes the page's next pose, or its withdrawal, before which the tool goes to the end of its path.
// Returns true if the caller publishes it at once; else path_turn does later.
bool path_take(ToolPath *path, const pliant_tool_pose_t *pose, double time, int64_t now_ns);
// Moves on. Returns true if `pose` is to be published; if it is inactive and nothing waits, the
// path has ended.
bool path_turn(ToolPath *path, int64_t now_ns, pliant_tool_pose_t *pose);

#endif
