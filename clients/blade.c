// SPDX-License-Identifier: MIT
// The path of a blade's edge. One thread.
#include "blade.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool blade_add(BladePath *path, const double end[2][3], bool lifted)
{
    if (path->count == BLADE_EDGES_MAX)
        return false;
    // Memory doubles, so that a long path is read in time.
    if (path->count == path->capacity) {
        int capacity = path->capacity ? 2 * path->capacity : 64;
        BladePosition *grown = realloc(path->position, sizeof *grown * (size_t)capacity);
        if (!grown)
            return false;
        path->position = grown;
        path->capacity = capacity;
    }
    BladePosition *position = &path->position[path->count++];
    memcpy(position->end, end, sizeof position->end);
    position->lifted = lifted;
    return true;
}

void blade_destroy(BladePath *path)
{
    free(path->position);
    *path = (BladePath){0};
}

int blade_next_sweep(const BladePath *path, int at)
{
    for (int i = at + 1; i + 1 < path->count; i++)
        if (!path->position[i + 1].lifted)
            return i;
    return -1;
}

int blade_sweeps(const BladePath *path)
{
    int count = 0;
    for (int i = blade_next_sweep(path, -1); i >= 0; i = blade_next_sweep(path, i))
        count++;
    return count;
}

// --- files ---

static bool is_word(const char *line, const char *word)
{
    line += strspn(line, " \t");
    size_t length = strlen(word);
    return strncmp(line, word, length) == 0 && line[length + strspn(line + length, " \t\r\n")] == 0;
}

static bool read_place(char *line, bool lifted, BladePath *path, char why[160])
{
    // Six numbers within reach, and nothing else.
    double number[6];
    if (program_read_numbers(line, number, 6) != 6) {
        snprintf(why, 160, "expected x y z x y z, the two ends of the edge, or \"lift\"");
        return false;
    }
    for (int k = 0; k < 6; k++) {
        if (fabs(number[k]) > TRACK_REACH) {
            snprintf(why, 160, "position %g outside [-%g, %g] m", number[k], TRACK_REACH,
                     TRACK_REACH);
            return false;
        }
    }
    // It is the next position of the path.
    double end[2][3];
    memcpy(end, number, sizeof end);
    if (blade_add(path, (const double(*)[3])end, lifted))
        return true;
    snprintf(why, 160, "more than %d positions", path->count);
    return false;
}

static bool read_lines(BladePath *path, FILE *file, const char *name, PliantError *error)
{
    char *line = NULL;
    size_t size = 0;
    bool ok = true, lifted = true; // the first position begins a stroke
    for (long number = 1; ok && getline(&line, &size, file) >= 0; number++) {
        char why[160];
        // Comments and empty lines say nothing; "lift" ends a stroke.
        line[strcspn(line, "#")] = '\0';
        if (line[strspn(line, " \t\r\n")] == '\0')
            continue;
        if (is_word(line, "lift")) {
            lifted = true;
            continue;
        }
        if (!read_place(line, lifted, path, why))
            ok = program_fail(error, "%s:%ld: %s", name, number, why);
        lifted = false;
    }
    if (ok && ferror(file))
        ok = program_fail(error, "%s: %s", name, strerror(errno));
    free(line);
    return ok;
}

bool blade_read(BladePath *path, const char *name, PliantError *error)
{
    FILE *file = fopen(name, "r");
    if (!file)
        return program_fail(error, "%s: %s", name, strerror(errno));
    int before = blade_sweeps(path);
    bool ok = read_lines(path, file, name, error);
    fclose(file);
    // A single position cuts nothing.
    if (ok && blade_sweeps(path) == before)
        ok = program_fail(error, "%s: no sweep in it: give two successive positions of the blade",
                          name);
    return ok;
}

// --- forms ---

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static double length_of(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static bool make_unit(double v[3])
{
    double length = length_of(v);
    for (int k = 0; k < 3 && length > 0.0; k++)
        v[k] /= length;
    return length > 0.0;
}

void blade_plane(BladePath *path, const double point[3], const double normal[3], double size)
{
    // The world axis most perpendicular to the normal defines the first side of the square.
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(normal[k]) < fabs(normal[axis]))
            axis = k;
    double u[3] = {0.0, 0.0, 0.0}, v[3];
    u[axis] = 1.0;
    // Two sides perpendicular to it and to each other.
    cross(normal, u, v);
    make_unit(v);
    cross(v, normal, u);
    make_unit(u);
    // The edge lies along one of them and moves along the other.
    for (int side = -1; side <= 1; side += 2) {
        double end[2][3];
        for (int k = 0; k < 3; k++) {
            end[0][k] = point[k] + 0.5 * size * (side * u[k] - v[k]);
            end[1][k] = point[k] + 0.5 * size * (side * u[k] + v[k]);
        }
        blade_add(path, (const double(*)[3])end, side < 0);
    }
}

// --- tracks ---

// Applies the shortest rotation of the unit vector `from` to `to` after q.
static void turn_to(const double from[3], const double to[3], double q[4])
{
    double axis[3], old[4], turn[4];
    memcpy(old, q, sizeof old);
    // The turn between two unit vectors: half the angle about their common normal.
    cross(from, to, axis);
    double w = 1.0 + from[0] * to[0] + from[1] * to[1] + from[2] * to[2];
    if (w < 1e-9) { // opposite: half a turn about any perpendicular axis
        int least = fabs(from[0]) < fabs(from[1]) ? 0 : 1;
        double side[3] = {least == 0, least == 1, 0.0};
        cross(from, side, axis);
        w = 0.0;
    }
    // As a unit quaternion, applied behind the old one.
    double length = sqrt(w * w + axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    turn[0] = w / length;
    for (int k = 0; k < 3; k++)
        turn[k + 1] = axis[k] / length;
    q[0] = turn[0] * old[0] - turn[1] * old[1] - turn[2] * old[2] - turn[3] * old[3];
    for (int k = 0; k < 3; k++) {
        int i = 1 + (k + 1) % 3, j = 1 + (k + 2) % 3;
        q[k + 1] =
            turn[0] * old[k + 1] + turn[k + 1] * old[0] + turn[i] * old[j] - turn[j] * old[i];
    }
}

int blade_track(const BladePath *path, int first, double speed, Track *track)
{
    double q[4] = {1.0, 0.0, 0.0, 0.0}, along[3] = {0.0, 0.0, 1.0}, time = 0.0;
    *track = (Track){0};
    int i = first;
    for (; i < path->count && (i == first || !path->position[i].lifted); i++) {
        const BladePosition *position = &path->position[i];
        // Turn the tool so that its z axis lies along the edge.
        double now[3], way = 0.0;
        for (int k = 0; k < 3; k++)
            now[k] = position->end[1][k] - position->end[0][k];
        if (make_unit(now)) {
            turn_to(along, now, q);
            memcpy(along, now, sizeof along);
        }
        // The faster end decides how long the way takes.
        for (int end = 0; end < 2 && i > first; end++) {
            double d[3];
            for (int k = 0; k < 3; k++)
                d[k] = position->end[end][k] - position[-1].end[end][k];
            way = fmax(way, length_of(d));
        }
        // Poses less than a microsecond apart are one (track_add).
        time += i > first ? fmax(way / speed, 2e-6) : 0.0;
        track_add(track, time, position->end[0], q);
    }
    track_finish(track);
    return i;
}
