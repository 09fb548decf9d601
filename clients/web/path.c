// SPDX-License-Identifier: MIT
#include "path.h"

#include <math.h>
#include <string.h>

static const double STEADY = 0.06; // longest time between poses that are published as they come [s]
// Shortest time [s] between such ones: the ends of a burst are farther apart than the daemon
// believes of a hand (`fastest`), and what it does not believe lifts a blade.
static const double BURST = 1e-3;
static const double SHRINKS = 0.5; // as in the daemon
// Between two of a page's poses by its own clock [s]: a tool that was withdrawn meanwhile, since
// the page was silent for too long, begins again where it was.
static const double LATE = 0.2;
static const double REPEAT = 0.02; // between repeats of a pose [s]
// From the last pose until the tool is there: the daemon follows in a measured period and by a
// filter (`lag`). A blade that is withdrawn earlier cuts short.
static const double ARRIVES = 0.06; // [s]
// Between two points of a path [s]: a path is no finer than its steps; a browser that waited may
// give one time to all of a burst.
static const double FINE = 1e-3 * PATH_STEP_MS, SHORTEST = 2e-3;
// Between two poses of a path: a thread that wakes late must not leave out corners.
static const double LONGEST_STEP = 0.04; // [s]

static double seconds(int64_t from_ns, int64_t to_ns)
{
    return 1e-9 * (double)(to_ns - from_ns);
}

static bool is_elsewhere(const pliant_tool_pose_t *a, const pliant_tool_pose_t *b)
{
    return memcmp(a->position, b->position, sizeof a->position) != 0 ||
           memcmp(a->orientation, b->orientation, sizeof a->orientation) != 0;
}

static bool publish(ToolPath *path, const pliant_tool_pose_t *pose, int64_t now_ns)
{
    if (is_elsewhere(pose, &path->last))
        path->moved_ns = now_ns;
    path->last = *pose;
    path->sent_ns = now_ns;
    return true;
}

void path_begin(ToolPath *path, const pliant_tool_pose_t *pose, double time, int64_t now_ns)
{
    *path = (ToolPath){.last = *pose,
                       .came_ns = now_ns,
                       .turn_ns = now_ns,
                       .sent_ns = now_ns,
                       .moved_ns = now_ns,
                       .page_time = time};
}

// True if the newest point may be replaced by a pose: the path needs no finer ones.
static bool is_dense(const ToolPath *path, const pliant_tool_pose_t *pose)
{
    if (path->count < 2)
        return false;
    const PathPoint *newest = &path->point[path->count - 1];
    return pose->active && newest->pose.active && newest[-1].pose.active &&
           pose->grip == newest->pose.grip && newest->time - newest[-1].time < FINE;
}

// When there is no room the path gets coarser at its end, but no withdrawal is lost.
static void append(ToolPath *path, const pliant_tool_pose_t *pose)
{
    const pliant_tool_pose_t *newest =
        path->count > 0 ? &path->point[path->count - 1].pose : &path->last;
    if (!pose->active && !newest->active)
        return;
    if (path->count < PATH_POINTS)
        path->count += !is_dense(path, pose);
    else if (!newest->active)
        path->point[path->count - 2] = path->point[path->count - 1];
    else if (!pose->active && !path->point[path->count - 2].pose.active)
        path->count--; // nothing is left of that stroke
    path->point[path->count - 1] = (PathPoint){path->end, *pose};
}

bool path_take(ToolPath *path, const pliant_tool_pose_t *pose, double time, int64_t now_ns)
{
    const double longest = 1e-3 * PATH_LONGEST_MS, gap = seconds(path->came_ns, now_ns);
    // The page's clock may be set, or missing.
    const bool timed = time >= 0.0 && path->page_time >= 0.0;
    const double passed = timed ? time - path->page_time : gap;
    const bool late = timed && passed <= LATE; // its way is known, however long it took to come
    if (gap > longest && path->count == 0 && pose->active && !late) {
        path_begin(path, pose, time, now_ns);
        return true;
    }
    path->end += fmin(fmax(passed, path->count > 0 ? SHORTEST : 0.0), longest);
    path->page_time = time;
    path->reach = fmin(fmax(gap, path->reach - SHRINKS * gap), longest);
    path->came_ns = now_ns;
    if (pose->active && path->last.active && path->count == 0 && path->reach <= STEADY &&
        gap >= BURST) {
        path->at = path->end;
        return publish(path, pose, now_ns);
    }
    append(path, pose);
    return false;
}

// Returns the pose at a fraction of the way between two; the grip changes at its end.
static pliant_tool_pose_t between(const pliant_tool_pose_t *from, const pliant_tool_pose_t *to,
                                  double s)
{
    pliant_tool_pose_t pose = *to;
    if (s >= 1.0)
        return pose;
    pose.grip = from->grip;
    for (int k = 0; k < 3; k++)
        pose.position[k] = (1.0 - s) * from->position[k] + s * to->position[k];
    // The shorter way round; steps are small.
    double dot = 0.0, square = 0.0;
    for (int k = 0; k < 4; k++)
        dot += from->orientation[k] * to->orientation[k];
    for (int k = 0; k < 4; k++) {
        pose.orientation[k] =
            (1.0 - s) * (dot < 0.0 ? -1.0 : 1.0) * from->orientation[k] + s * to->orientation[k];
        square += pose.orientation[k] * pose.orientation[k];
    }
    if (square < 1e-6) // opposite turns
        memcpy(pose.orientation, to->orientation, sizeof pose.orientation);
    else
        for (int k = 0; k < 4; k++)
            pose.orientation[k] /= sqrt(square);
    return pose;
}

// Goes along the points until the time `to`, or to where the tool is withdrawn, changes its grip or
// begins elsewhere: none of these is passed over.
static pliant_tool_pose_t advance(ToolPath *path, double to)
{
    pliant_tool_pose_t pose = path->last;
    int passed = 0;
    while (passed < path->count) {
        const PathPoint *next = &path->point[passed];
        const pliant_tool_pose_t before = pose;
        const bool jumps = next->pose.active != before.active; // down or up
        if (!next->pose.active && passed > 0)
            break; // it waits at the last place
        const double s =
            !jumps && next->time > to ? (to - path->at) / (next->time - path->at) : 1.0;
        pose = between(&before, &next->pose, s);
        path->at = s < 1.0 ? to : fmax(path->at, next->time);
        if (s < 1.0)
            break;
        passed++;
        if (jumps || next->pose.grip != before.grip)
            break;
    }
    path->count -= passed;
    memmove(path->point, path->point + passed, (size_t)path->count * sizeof *path->point);
    return pose;
}

bool path_turn(ToolPath *path, int64_t now_ns, pliant_tool_pose_t *pose)
{
    const double silent = seconds(path->came_ns, now_ns);
    const double passed = seconds(path->turn_ns, now_ns), left = path->reach - silent;
    if (passed < 0.5e-3 * PATH_STEP_MS) // between the messages of a burst
        return false;
    path->turn_ns = now_ns;
    *pose = path->last;
    const bool leaves = path->count > 0 && !path->point[0].pose.active;
    if (path->count > 0 && !(leaves && seconds(path->moved_ns, now_ns) < ARRIVES)) {
        if (path->last.active && seconds(path->sent_ns, now_ns) > LATE)
            return publish(path, pose, now_ns);
        const double rest = path->end - path->at;
        const double step = left > 0.0 ? rest * passed / (left + passed) : rest;
        *pose = advance(path, leaves ? path->at : path->at + fmin(step, LONGEST_STEP));
        return publish(path, pose, now_ns);
    }
    return path->last.active && silent > STEADY && silent <= 1e-3 * PATH_LONGEST_MS &&
           seconds(path->sent_ns, now_ns) >= REPEAT && publish(path, pose, now_ns);
}
