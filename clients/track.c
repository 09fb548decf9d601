// SPDX-License-Identifier: MIT
// A tool's path in time, and the closing of its jaws. One thread.
#include "track.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool append(Track *track, const TrackPose *pose)
{
    if (track->count == track->capacity) {
        int capacity = track->capacity ? 2 * track->capacity : 64;
        TrackPose *grown = realloc(track->pose, sizeof *grown * (size_t)capacity);
        if (!grown)
            return false;
        track->pose = grown;
        track->capacity = capacity;
    }
    track->pose[track->count++] = *pose;
    return true;
}

// Multiplies quaternions w x y z: a b.
static void quat_multiply(const double a[4], const double b[4], double out[4])
{
    out[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
    out[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    out[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
    out[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
}

// Finds the angular velocity [rad/s] that turns `from` into `to` the short way within `dt`.
static void angular_between(const double from[4], const double to[4], double dt, double angular[3])
{
    const double inverse[4] = {from[0], -from[1], -from[2], -from[3]};
    double turn[4];
    quat_multiply(to, inverse, turn);
    double sine = sqrt(turn[1] * turn[1] + turn[2] * turn[2] + turn[3] * turn[3]);
    double sign = turn[0] < 0.0 ? -1.0 : 1.0; // q and -q are the same orientation
    double scale = sine > 1e-12 ? 2.0 * atan2(sine, fabs(turn[0])) / sine : 2.0;
    for (int k = 0; k < 3; k++)
        angular[k] = sign * scale * turn[k + 1] / dt;
}

// Sets the velocities from each pose to the next; the last one rests.
void track_finish(Track *track)
{
    for (int i = 0; i < track->count; i++) {
        TrackPose *pose = &track->pose[i];
        memset(pose->linear, 0, sizeof pose->linear);
        memset(pose->angular, 0, sizeof pose->angular);
        if (i + 1 == track->count)
            break;
        const TrackPose *next = &track->pose[i + 1];
        double dt = next->time - pose->time;
        for (int k = 0; k < 3; k++)
            pose->linear[k] = (next->position[k] - pose->position[k]) / dt;
        angular_between(pose->orientation, next->orientation, dt, pose->angular);
    }
}

static bool read_pose(char *line, double last_time, TrackPose *pose, char why[160])
{
    double number[8];
    line[strcspn(line, "#")] = '\0'; // a comment
    // A time and a position, with or without an orientation.
    int count = program_read_numbers(line, number, 8);
    if (count != 4 && count != 8) {
        snprintf(why, 160, "expected t x y z or t x y z qw qx qy qz, all finite numbers");
        return false;
    }
    *pose = (TrackPose){.time = number[0], .orientation = {1.0, 0.0, 0.0, 0.0}};
    memcpy(pose->position, number + 1, sizeof pose->position);
    // Times ascend from 0.
    if (!(pose->time >= 0.0 && pose->time <= TRACK_TIME)) {
        snprintf(why, 160, "time %g outside [0, %g] s", pose->time, TRACK_TIME);
        return false;
    }
    if (!(pose->time >= last_time + 1e-6)) { // closer poses would give absurd velocities
        snprintf(why, 160, "time %.9g is not at least 1 us after the pose before (%.9g s)",
                 pose->time, last_time);
        return false;
    }
    for (int k = 0; k < 3; k++) {
        if (fabs(pose->position[k]) > TRACK_REACH) {
            snprintf(why, 160, "position %g outside [-%g, %g] m", pose->position[k], TRACK_REACH,
                     TRACK_REACH);
            return false;
        }
    }
    // The default is no turn.
    if (count == 4)
        return true;
    const double *q = number + 4;
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(fabs(length - 1.0) <= 1e-3)) { // the daemon's tolerance
        snprintf(why, 160, "quaternion of length %g, expected 1 within 0.001", length);
        return false;
    }
    for (int k = 0; k < 4; k++)
        pose->orientation[k] = q[k] / length;
    return true;
}

static bool read_lines(Track *track, FILE *file, const char *path, PliantError *error)
{
    char *line = NULL;
    size_t size = 0;
    bool ok = true;
    for (long number = 1; ok && getline(&line, &size, file) >= 0; number++) {
        TrackPose pose;
        char why[160];
        // Poses must ascend, so the last one is compared with.
        double last = track->count ? track->pose[track->count - 1].time : -1.0;
        if (line[strspn(line, " \t\r\n")] == '\0' || line[strspn(line, " \t")] == '#')
            continue;
        // Add it, or say which line is wrong.
        if (!read_pose(line, last, &pose, why))
            ok = program_fail(error, "%s:%ld: %s", path, number, why);
        else if (track->count == TRACK_POSES_MAX || !append(track, &pose))
            ok = program_fail(error, "%s:%ld: more than %d poses", path, number, track->count);
    }
    if (ok && ferror(file))
        ok = program_fail(error, "%s: %s", path, strerror(errno));
    else if (ok && track->count == 0)
        ok = program_fail(error, "%s: no pose in it", path);
    free(line);
    return ok;
}

bool track_read(Track *track, const char *path, PliantError *error)
{
    *track = (Track){0};
    FILE *file = fopen(path, "r");
    if (!file)
        return program_fail(error, "%s: %s", path, strerror(errno));
    bool ok = read_lines(track, file, path, error);
    fclose(file);
    if (!ok) {
        track_destroy(track);
        return false;
    }
    double start = track->pose[0].time;
    for (int i = 0; i < track->count; i++)
        track->pose[i].time -= start;
    track_finish(track);
    return true;
}

// Finds the shortest rotation of the z axis to -direction.
static void orient_shaft(const double direction[3], double q[4])
{
    const double back[3] = {-direction[0], -direction[1], -direction[2]};
    const double w = 1.0 + back[2];
    if (w < 1e-9) { // opposite: half a turn about x
        memcpy(q, (const double[4]){0.0, 1.0, 0.0, 0.0}, 4 * sizeof *q);
        return;
    }
    const double length = sqrt(w * w + back[0] * back[0] + back[1] * back[1]);
    q[0] = w / length;
    q[1] = -back[1] / length; // z cross back = (-y, x, 0)
    q[2] = back[0] / length;
    q[3] = 0.0;
}

void track_press(Track *track, const double start[3], const double direction[3], double depth,
                 double speed, double hold, int repeat)
{
    *track = (Track){0};
    double time = 0.0;
    const double travel = depth / speed;
    // Down, rest, back; each repeat begins where the last one ended.
    for (int n = 0; n < repeat; n++) {
        const double after[4] = {0.0, travel, hold, travel}; // time since the pose before
        for (int k = n > 0; k < 4; k++) {
            TrackPose pose = {0};
            orient_shaft(direction, pose.orientation);
            double along = k == 1 || k == 2 ? depth : 0.0;
            time += after[k];
            pose.time = time;
            for (int axis = 0; axis < 3; axis++)
                pose.position[axis] = start[axis] + along * direction[axis];
            // Poses at the same time (no hold, no depth) are one pose.
            bool same = track->count > 0 && !(time > track->pose[track->count - 1].time);
            if (!same && !append(track, &pose))
                abort(); // a handful of poses: the machine itself is out of memory
        }
    }
    track_finish(track);
}

void track_add(Track *track, double time, const double position[3], const double orientation[4])
{
    TrackPose pose = {.time = time};
    memcpy(pose.position, position, sizeof pose.position);
    memcpy(pose.orientation, orientation, sizeof pose.orientation);
    if (!append(track, &pose))
        abort(); // the machine itself is out of memory
}

double track_duration(const Track *track)
{
    return track->count ? track->pose[track->count - 1].time : 0.0;
}

void track_at(const Track *track, double time, TrackPose *out)
{
    // Find the segment by halving.
    int low = 0, high = track->count; // pose[low].time <= time < pose[high].time
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (track->pose[middle].time <= time)
            low = middle;
        else
            high = middle;
    }
    *out = track->pose[low];
    out->time = time;
    // Before the first and after the last pose it rests.
    double dt = time - track->pose[low].time;
    if (dt < 0.0) { // before the start: rest there
        memset(out->linear, 0, sizeof out->linear);
        memset(out->angular, 0, sizeof out->angular);
        return;
    }
    if (low + 1 == track->count)
        return;
    // Constant velocities within the segment.
    double angle = 0.0;
    for (int k = 0; k < 3; k++) {
        out->position[k] += dt * out->linear[k];
        angle += out->angular[k] * out->angular[k];
    }
    angle = sqrt(angle) * dt;
    // The turn since the segment's beginning.
    if (angle > 1e-12) {
        double s = sin(0.5 * angle) * dt / angle;
        const double turn[4] = {cos(0.5 * angle), s * out->angular[0], s * out->angular[1],
                                s * out->angular[2]};
        quat_multiply(turn, track->pose[low].orientation, out->orientation);
    }
}

void track_destroy(Track *track)
{
    free(track->pose);
    *track = (Track){0};
}

// --- a grasper's jaws ----------------------------------------------------------------------------

// Reads a number at *text and advances past it.
static bool take_number(const char **text, double low, double high, double *number)
{
    char *end;
    *number = strtod(*text, &end);
    bool ok = end != *text && *number >= low && *number <= high;
    *text = end;
    return ok;
}

bool grip_parse(const char *text, Grip *grip)
{
    *grip = (Grip){0};
    double first;
    // One number is a constant grip,
    const char *at = text;
    if (!take_number(&at, -1e5, 1e5, &first))
        return false;
    if (*at == '\0') {
        grip->count = 1;
        grip->value[0] = first;
        return first >= 0.0 && first <= 1.0;
    }
    // else pairs of time and grip.
    for (at = text; grip->count < GRIP_POINTS;) {
        int i = grip->count++;
        if (!take_number(&at, 0.0, 1e5, &grip->time[i]) || *at++ != ':' ||
            !take_number(&at, 0.0, 1.0, &grip->value[i]) ||
            (i > 0 && grip->time[i] < grip->time[i - 1]))
            return false;
        if (*at == '\0')
            return true;
        if (*at++ != ',')
            return false;
    }
    return false;
}

double grip_at(const Grip *grip, double time)
{
    if (grip->count == 0)
        return 0.0;
    int next = 0;
    while (next < grip->count && grip->time[next] <= time)
        next++;
    if (next == 0 || next == grip->count)
        return grip->value[next == 0 ? 0 : next - 1];
    double from = grip->time[next - 1], to = grip->time[next];
    double share = (time - from) / (to - from);
    return grip->value[next - 1] + share * (grip->value[next] - grip->value[next - 1]);
}
