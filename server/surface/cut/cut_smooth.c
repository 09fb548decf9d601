// SPDX-License-Identifier: MIT
#include "surface/cut/cut_smooth.h"

#include "geometry/distance.h"

#include <math.h>

double cut_sweep_distance(const BladeEdge *edge, int edges, Vec3 point)
{
    double nearest = HUGE_VAL;
    for (int k = 0; k + 1 < edges; k++) {
        const Vec3 *a = edge[k].end, *b = edge[k + 1].end;
        const Vec3 first[3] = {a[0], a[1], b[0]}, second[3] = {a[1], b[1], b[0]};
        ClosestPair pair;
        distance_point_triangle(point, first, &pair);
        nearest = pair.distance < nearest ? pair.distance : nearest;
        distance_point_triangle(point, second, &pair);
        nearest = pair.distance < nearest ? pair.distance : nearest;
    }
    return nearest;
}

// Computes what the sides of a face cost as parts of the path.
static void weigh_sides(const CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge,
                        int edges, int face, double cost[3])
{
    Vec3 x[3];
    double d[3];
    for (int k = 0; k < 3; k++) {
        x[k] = tissue->position[tissue->corner[face][k]];
        d[k] = cut_sweep_distance(edge, edges, x[k]) / finder->h;
    }
    for (int k = 0; k < 3; k++) {
        int next = (k + 1) % 3;
        double away = d[k] + d[next];
        cost[k] = vec3_length(vec3_sub(x[k], x[next])) * (1.0 + CUT_SMOOTH_WEIGHT * away * away);
    }
}

// True if the path improves when the face changes sides; `freely`: without any new broken link.
static bool gains(const CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge,
                  int edges, int face, bool freely)
{
    const Level *level = finder->level;
    // What the face has of the path now, and what it would have.
    bool on[3], costs[3]; // on the path; not on it, and would have to break
    int count = 0, fresh = 0, to_break = 0;
    for (int k = 0; k < 3; k++) {
        int e = level->face_edge[face][k], beyond = levels_beyond(level, e, face);
        if (beyond >= 0 && !finder->listed[beyond])
            return false;
        bool broken = tissue->broken[face] >> k & 1;
        on[k] = beyond >= 0 && link_finder_is_odd(&finder->links, e);
        costs[k] = beyond >= 0 && !on[k] && !broken;
        count += on[k];
        fresh += on[k] && !broken;
        to_break += costs[k];
    }
    if (count < 2 || fresh == 0 || (freely && to_break > 0))
        return false;
    // Free improvements need no weighing.
    if (to_break == 0)
        return true;
    double cost[3], now = 0.0, then = 0.0;
    weigh_sides(finder, tissue, edge, edges, face, cost);
    for (int k = 0; k < 3; k++) {
        now += on[k] ? cost[k] : 0.0;
        then += costs[k] ? cost[k] : 0.0;
    }
    return then < now;
}

static void change_sides(CutFinder *finder, int face)
{
    const Level *level = finder->level;
    for (int k = 0; k < 3; k++) {
        int e = level->face_edge[face][k];
        if (levels_beyond(level, e, face) >= 0)
            link_finder_add(&finder->links, e, 1);
    }
}

static void smooth_all(CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge, int edges,
                       bool freely)
{
    bool changed = true;
    for (int pass = 0; changed && pass < CUT_SMOOTH_PASSES; pass++) {
        changed = false;
        for (int at = 0; at < finder->near_count; at++) {
            if (!gains(finder, tissue, edge, edges, finder->near[at], freely))
                continue;
            change_sides(finder, finder->near[at]);
            changed = true;
        }
    }
}

CutVerdict cut_smooth(CutFinder *finder, const CutTissue *tissue, const BladeEdge *edge, int edges)
{
    for (int i = 0; i < tissue->face_count; i++)
        finder->listed[tissue->face[i]] = 1;
    link_finder_mark_met(&finder->links);
    // Along older cuts first: so a repeated command finds its own path again.
    smooth_all(finder, tissue, edge, edges, true);
    smooth_all(finder, tissue, edge, edges, false);
    for (int i = 0; i < tissue->face_count; i++)
        finder->listed[tissue->face[i]] = 0;
    link_finder_keep_odd(&finder->links);
    return cut_find_unbroken(finder, tissue);
}
