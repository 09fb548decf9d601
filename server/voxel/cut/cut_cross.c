// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_cross.h"

#include <math.h>
#include <string.h>

enum { PARTS = 4, STEPS = 6 }; // of the time of a sub-tick that are searched; steps in one

// Edge and link at one time, or their motion: directions, and from the link's begin to the edge's.
typedef struct Lines {
    Vec3 u, v, w;
} Lines;

// Both in a sub-tick: where they begin, and how they move until its end.
typedef struct Meeting {
    Lines begin, motion;
    Vec3 edge[2], link[2]; // motions of the ends
} Meeting;

static Vec3 place_of(const CutPoint *point)
{
    return vec3((double)point->x[0], (double)point->x[1], (double)point->x[2]);
}

static Lines lines_between(const Vec3 edge[2], const Vec3 link[2])
{
    return (Lines){vec3_sub(edge[1], edge[0]), vec3_sub(link[1], link[0]),
                   vec3_sub(edge[0], link[0])};
}

static void begin(Meeting *meeting, const CutPath edge[2], const CutPath link[2])
{
    Vec3 from[2][2];
    for (int k = 0; k < 2; k++) {
        from[0][k] = place_of(&edge[k].at[0]);
        from[1][k] = place_of(&link[k].at[0]);
        meeting->edge[k] = vec3_sub(place_of(&edge[k].at[1]), from[0][k]);
        meeting->link[k] = vec3_sub(place_of(&link[k].at[1]), from[1][k]);
    }
    meeting->begin = lines_between(from[0], from[1]);
    meeting->motion = lines_between(meeting->edge, meeting->link);
}

static Lines lines_at(const Meeting *meeting, double t)
{
    const Lines *a = &meeting->begin, *b = &meeting->motion;
    return (Lines){vec3_madd(a->u, t, b->u), vec3_madd(a->v, t, b->v), vec3_madd(a->w, t, b->w)};
}

// Zero when the lines are in one plane.
static double apart(const Meeting *meeting, double t)
{
    const Lines now = lines_at(meeting, t);
    return vec3_dot(vec3_cross(now.u, now.v), now.w);
}

// Returns the time within [from, to] when the lines meet; the signs there differ.
static double meet_between(const Meeting *meeting, double from, double to, double before,
                           double after)
{
    double t = from;
    for (int step = 0; step < STEPS; step++) {
        t = from + (to - from) * before / (before - after);
        const double here = apart(meeting, t);
        if (fabs(here) <= 1e-6 * (fabs(before) + fabs(after)))
            break;
        // Regula falsi; the end that stays counts half (Illinois).
        if ((here > 0.0) == (before > 0.0)) {
            from = t, before = here, after *= 0.5;
        } else {
            to = t, after = here, before *= 0.5;
        }
    }
    return t;
}

// Returns how far along edge and link their lines meet.
static void find_along(const Lines *now, double *on_edge, double *on_link)
{
    const Vec3 n = vec3_cross(now->v, now->u);
    const double square = vec3_dot(n, n);
    *on_edge = *on_link = 0.5;
    if (!(square > 0.0))
        return;
    *on_link = vec3_dot(vec3_cross(now->w, now->u), n) / square;
    *on_edge = vec3_dot(vec3_cross(now->w, now->v), n) / square;
}

// Finds the time, and where on the edge and the link; of several the one well within both.
static double find_time(const Meeting *meeting, double *on_edge, double *on_link)
{
    double best = (double)INFINITY, time = 0.5;
    double before = apart(meeting, 0.0);
    *on_edge = *on_link = 0.5;
    for (int part = 0; part < PARTS && best > 0.0; part++) {
        const double from = (double)part / PARTS, to = (double)(part + 1) / PARTS;
        const double after = apart(meeting, to);
        if ((before > 0.0) != (after > 0.0)) {
            const double t = meet_between(meeting, from, to, before, after);
            const Lines now = lines_at(meeting, t);
            double e, l;
            find_along(&now, &e, &l);
            const double out = fmax(0.0, fabs(e - 0.5) - 0.5) + fmax(0.0, fabs(l - 0.5) - 0.5);
            if (out < best)
                best = out, time = t, *on_edge = e, *on_link = l;
        }
        before = after;
    }
    return time;
}

static const double (*gradient_of(const CellCentres *centres, CrossGradients *gradients,
                                  int leaf))[3]
{
    const int at = leaf % CROSS_GRADIENTS;
    double(*column)[3] = gradients->column[at];
    if (gradients->leaf[at] == leaf + 1)
        return (const double(*)[3])column;
    gradients->leaf[at] = leaf + 1;
    memset(column, 0, sizeof *gradients->column);
    const int *node = cut_lattice_nodes(centres->lattice, leaf);
    const double part = 1.0 / (double)(1 << centres->lattice->element[leaf].level);
    for (int k = 0; k < NODE_CORNERS; k++) {
        const Vec3 x = rows_local(centres->rows, centres->row, node[k]);
        for (int axis = 0; axis < 3; axis++) {
            const double sign = k >> axis & 1 ? part : -part;
            column[axis][0] += sign * x.x;
            column[axis][1] += sign * x.y;
            column[axis][2] += sign * x.z;
        }
    }
    return (const double(*)[3])column;
}

// Adds F^T n of the leaf that covers a cell, up to a factor; n in the rows' axes.
static void add_normal(const CellCentres *centres, CrossGradients *gradients, int cell, Vec3 n,
                       double sum[3])
{
    const int leaf = cut_lattice_leaf_of(centres->lattice, cell);
    const double(*column)[3] = gradient_of(centres, gradients, leaf);
    for (int axis = 0; axis < 3; axis++)
        sum[axis] += column[axis][0] * n.x + column[axis][1] * n.y + column[axis][2] * n.z;
}

static CutCrossing crossing_of(double along, const double normal[3], int axis)
{
    CutCrossing crossing = cut_crossing_middle(axis);
    const double length =
        sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    crossing.along = (uint16_t)fmin(fmax(along * CROSSING_ALONG, 0.0), CROSSING_ALONG - 1.0);
    for (int c = 0; c < 3 && length > 0.0 && isfinite(length); c++)
        crossing.normal[c] = (int16_t)lrint(normal[c] / length * CROSSING_UNIT);
    return crossing;
}

CutCrossing cut_crossing_middle(int axis)
{
    CutCrossing crossing = {.along = CROSSING_ALONG / 2};
    crossing.normal[axis] = CROSSING_UNIT;
    return crossing;
}

CutCrossing cut_crossing_find(const CellCentres *centres, CrossGradients *gradients,
                              const CutPath edge[2], const CutPath link[2], int cell, int axis)
{
    double on_edge, on_link;
    Meeting meeting;
    begin(&meeting, edge, link);
    const double t = find_time(&meeting, &on_edge, &on_link);
    const Lines now = lines_at(&meeting, t);
    const Vec3 of_edge = vec3_madd(meeting.edge[0], on_edge, meeting.motion.u);
    const Vec3 of_link = vec3_madd(meeting.link[0], on_link, meeting.motion.v);
    const Vec3 n = vec3_unit(vec3_cross(now.u, vec3_sub(of_edge, of_link)));
    return cut_crossing_at(centres, gradients, on_link, n, cell, axis);
}

CutCrossing cut_crossing_at(const CellCentres *centres, CrossGradients *gradients, double along,
                            Vec3 n, int cell, int axis)
{
    double normal[3] = {0.0};
    const double(*m)[3] = centres->turn;
    const Vec3 local = vec3(m[0][0] * n.x + m[1][0] * n.y + m[2][0] * n.z,
                            m[0][1] * n.x + m[1][1] * n.y + m[2][1] * n.z,
                            m[0][2] * n.x + m[1][2] * n.y + m[2][2] * n.z);
    add_normal(centres, gradients, cell, local, normal);
    add_normal(centres, gradients, cut_lattice_beyond(centres->lattice, cell, axis), local, normal);
    return crossing_of(along, normal, axis);
}
