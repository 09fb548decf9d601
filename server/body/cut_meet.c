// SPDX-License-Identifier: MIT
#include "body/cut_meet.h"

#include <math.h>

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

CutMeeting cut_meet(const CutPath edge[2], const CutPath link[2])
{
    double on_edge, on_link;
    Meeting meeting;
    begin(&meeting, edge, link);
    const double t = find_time(&meeting, &on_edge, &on_link);
    const Lines now = lines_at(&meeting, t);
    const Vec3 of_edge = vec3_madd(meeting.edge[0], on_edge, meeting.motion.u);
    const Vec3 of_link = vec3_madd(meeting.link[0], on_link, meeting.motion.v);
    return (CutMeeting){on_link, vec3_unit(vec3_cross(now.u, vec3_sub(of_edge, of_link)))};
}
