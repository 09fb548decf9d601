#include "voxel/cut/cut_cross.h"

#include <math.h>

enum { PARTS = 4, STEPS = 6 }; // of the time of a sub-tick that are searched; steps in one

static Vec3 at_time(const CutPath *path, double t)
{
    double x[3];
    for (int c = 0; c < 3; c++)
        x[c] = (double)path->at[0].x[c] + t * (double)(path->at[1].x[c] - path->at[0].x[c]);
    return vec3(x[0], x[1], x[2]);
}

static Vec3 motion_of(const CutPath *path)
{
    return vec3((double)(path->at[1].x[0] - path->at[0].x[0]),
                (double)(path->at[1].x[1] - path->at[0].x[1]),
                (double)(path->at[1].x[2] - path->at[0].x[2]));
}

// Edge and link at one time.
typedef struct Lines {
    Vec3 u, v, w; // directions of edge and link; from the link's begin to the edge's
} Lines;

static Lines lines_at(const CutPath edge[2], const CutPath link[2], double t)
{
    const Vec3 e = at_time(&edge[0], t), l = at_time(&link[0], t);
    return (Lines){vec3_sub(at_time(&edge[1], t), e), vec3_sub(at_time(&link[1], t), l),
                   vec3_sub(e, l)};
}

// Zero when the lines are in one plane.
static double apart(const CutPath edge[2], const CutPath link[2], double t)
{
    const Lines now = lines_at(edge, link, t);
    return vec3_dot(vec3_cross(now.u, now.v), now.w);
}

// Returns the time within [from, to] when the lines meet; the signs there differ.
static double meet_between(const CutPath edge[2], const CutPath link[2], double from, double to,
                           double before, double after)
{
    double t = from;
    for (int step = 0; step < STEPS; step++) {
        t = from + (to - from) * before / (before - after);
        const double here = apart(edge, link, t);
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
static double find_time(const CutPath edge[2], const CutPath link[2], double *on_edge,
                        double *on_link)
{
    double best = (double)INFINITY, time = 0.5;
    double before = apart(edge, link, 0.0);
    *on_edge = *on_link = 0.5;
    for (int part = 0; part < PARTS && best > 0.0; part++) {
        const double from = (double)part / PARTS, to = (double)(part + 1) / PARTS;
        const double after = apart(edge, link, to);
        if ((before > 0.0) != (after > 0.0)) {
            const double t = meet_between(edge, link, from, to, before, after);
            const Lines now = lines_at(edge, link, t);
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

// Adds F^T n of the leaf that covers a cell, up to a factor.
static void add_normal(const CellCentres *centres, int cell, Vec3 n, double sum[3])
{
    const int leaf = cut_lattice_leaf_of(centres->lattice, cell);
    const int *node = cut_lattice_nodes(centres->lattice, leaf);
    const double edge = (double)(1 << centres->lattice->element[leaf].level);
    for (int k = 0; k < NODE_CORNERS; k++) {
        const double along = vec3_dot(cut_centres_vertex(centres, node[k]), n) / edge;
        for (int axis = 0; axis < 3; axis++)
            sum[axis] += k >> axis & 1 ? along : -along;
    }
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

CutCrossing cut_crossing_find(const CellCentres *centres, const CutPath edge[2],
                              const CutPath link[2], int cell, int axis)
{
    double on_edge, on_link, normal[3] = {0.0};
    const double t = find_time(edge, link, &on_edge, &on_link);
    const Lines now = lines_at(edge, link, t);
    const Vec3 of_edge = vec3_add(vec3_scale(1.0 - on_edge, motion_of(&edge[0])),
                                  vec3_scale(on_edge, motion_of(&edge[1])));
    const Vec3 of_link = vec3_add(vec3_scale(1.0 - on_link, motion_of(&link[0])),
                                  vec3_scale(on_link, motion_of(&link[1])));
    const Vec3 n = vec3_unit(vec3_cross(now.u, vec3_sub(of_edge, of_link)));
    add_normal(centres, cell, n, normal);
    add_normal(centres, cut_lattice_beyond(centres->lattice, cell, axis), n, normal);
    return crossing_of(on_link, normal, axis);
}
