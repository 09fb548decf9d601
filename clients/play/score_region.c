// SPDX-License-Identifier: MIT
// How much of what was severed is in a region of the scene.
#include "score_body.h"

typedef struct Span {
    double from, to; // shares of a segment
} Span;

// Returns the part of a segment in a convex region; from >= to: none.
static Span clip(const FixedRegion *region, Vec3 a, Vec3 b)
{
    const Vec3 d = vec3_sub(b, a);
    Span span = {0.0, 1.0};
    if (region->kind == FIXED_SPHERE) {
        const Vec3 c = vec3_sub(a, region->center);
        const double p = vec3_dot(d, d), q = vec3_dot(d, c);
        const double root = q * q - p * (vec3_dot(c, c) - region->radius * region->radius);
        if (!(p > 0.0) || !(root > 0.0))
            return (Span){1.0, 0.0};
        return (Span){fmax(0.0, (-q - sqrt(root)) / p), fmin(1.0, (-q + sqrt(root)) / p)};
    }
    const double start[3] = {a.x, a.y, a.z}, along[3] = {d.x, d.y, d.z};
    const double low[3] = {region->low.x, region->low.y, region->low.z};
    const double high[3] = {region->high.x, region->high.y, region->high.z};
    for (int k = 0; k < 3; k++) {
        if (along[k] == 0.0) {
            if (start[k] < low[k] || start[k] > high[k])
                return (Span){1.0, 0.0};
            continue;
        }
        const double s = (low[k] - start[k]) / along[k], t = (high[k] - start[k]) / along[k];
        span.from = fmax(span.from, fmin(s, t));
        span.to = fmin(span.to, fmax(s, t));
    }
    return span;
}

double score_share_of_segment(const ScoreRules *rules, Vec3 a, Vec3 b)
{
    Span span[SCENE_SCORE_REGIONS];
    double share = 0.0, end = 0.0;
    for (int i = 0; i < rules->scene.region_count; i++)
        span[i] = clip(&rules->scene.region[i].region, a, b);
    // Of spans that overlap, the next one that reaches further.
    for (int n = 0; n < rules->scene.region_count; n++) {
        int next = -1;
        for (int i = 0; i < rules->scene.region_count; i++)
            if (span[i].from < span[i].to && span[i].to > end &&
                (next < 0 || span[i].from < span[next].from))
                next = i;
        if (next < 0)
            break;
        share += span[next].to - fmax(span[next].from, end);
        end = span[next].to;
    }
    return share;
}

static bool is_inside(const ScoreRules *rules, Vec3 x)
{
    for (int i = 0; i < rules->scene.region_count; i++)
        if (fixed_contains(&rules->scene.region[i].region, x))
            return true;
    return false;
}

double score_share_of_triangle(const ScoreRules *rules, const Vec3 corner[3])
{
    enum { ROWS = 8 };
    int inside = 0;
    if (rules->scene.region_count == 0)
        return 0.0;
    const Vec3 u = vec3_scale(1.0 / ROWS, vec3_sub(corner[1], corner[0]));
    const Vec3 v = vec3_scale(1.0 / ROWS, vec3_sub(corner[2], corner[0]));
    for (int i = 0; i < ROWS; i++)
        for (int k = 0; k < ROWS - i; k++)
            for (int down = 0; down < (k < ROWS - i - 1 ? 2 : 1); down++) {
                const double at = (down + 1) / 3.0;
                inside += is_inside(rules, vec3_madd(vec3_madd(corner[0], i + at, u), k + at, v));
            }
    return (double)inside / (ROWS * ROWS);
}
