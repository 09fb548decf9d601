// SPDX-License-Identifier: MIT
#include "body/cut_exact.h"

#include <math.h>

__extension__ typedef __int128 Wide;

// --- determinants ---

static int sign_of_exact(const int64_t d[3][3])
{
    Wide minor0 = (Wide)d[1][1] * d[2][2] - (Wide)d[1][2] * d[2][1];
    Wide minor1 = (Wide)d[1][2] * d[2][0] - (Wide)d[1][0] * d[2][2];
    Wide minor2 = (Wide)d[1][0] * d[2][1] - (Wide)d[1][1] * d[2][0];
    Wide det = d[0][0] * minor0 + d[0][1] * minor1 + d[0][2] * minor2;
    return (det > 0) - (det < 0);
}

// The rounding of a 3x3 determinant of exact numbers is below 8.9e-16 (eight half units in the last
// place) of its permanent: beyond that the double's sign is certain.
static int sign_of_determinant(const int64_t row[3][3])
{
    double d[3][3];
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < 3; c++)
            d[i][c] = (double)row[i][c];
    double a = d[1][1] * d[2][2], b = d[1][2] * d[2][1];
    double c = d[1][2] * d[2][0], e = d[1][0] * d[2][2];
    double f = d[1][0] * d[2][1], g = d[1][1] * d[2][0];
    double det = d[0][0] * (a - b) + d[0][1] * (c - e) + d[0][2] * (f - g);
    double permanent = fabs(d[0][0]) * (fabs(a) + fabs(b)) + fabs(d[0][1]) * (fabs(c) + fabs(e)) +
                       fabs(d[0][2]) * (fabs(f) + fabs(g));
    if (fabs(det) > 8.9e-16 * permanent)
        return det > 0.0 ? 1 : -1;
    return sign_of_exact(row);
}

// --- two triangles in space and time ---

// A corner of a triangle; late: at the end of the tick.
typedef struct Corner {
    const CutPoint *point;
    bool late;
} Corner;

static void put_difference(int64_t row[3], const CutPoint *to, const CutPoint *from)
{
    for (int c = 0; c < 3; c++)
        row[c] = to->x[c] - from->x[c];
}

// The orientation of the five corners that are left without `omitted`. Subtracting the first early
// corner from the early ones and the first late one from the late ones leaves three rows; the sign
// of the permutation that sorts them is that of the inversions.
static int orientation(const Corner corner[6], int omitted)
{
    const CutPoint *group[2][5];
    int count[2] = {0, 0}, inversions = 0;
    for (int i = 0; i < 6; i++) {
        if (i == omitted)
            continue;
        int late = corner[i].late;
        if (!late)
            inversions += count[1];
        group[late][count[late]++] = corner[i].point;
    }
    int64_t row[3][3];
    int rows = 0;
    for (int late = 0; late < 2; late++)
        for (int i = 1; i < count[late]; i++)
            put_difference(row[rows++], group[late][i], group[late][0]);
    int sign = sign_of_determinant((const int64_t(*)[3])row);
    return (inversions + count[0] + omitted) % 2 == 0 ? sign : -sign;
}

// 1: they meet, 0: they do not, or CUT_DEGENERATE. They meet when each corner of the one lies on
// the side of the other's that the rest of the signs leave.
static int triangles_meet(const Corner corner[6])
{
    int all = 0; // the common sign, of the second three turned round
    bool zero = false;
    for (int o = 0; o < 6; o++) {
        int sign = orientation(corner, o);
        if (o >= 3)
            sign = -sign;
        if (sign == 0)
            zero = true;
        else if (all == 0)
            all = sign;
        else if (sign != all)
            return 0;
    }
    return zero ? CUT_DEGENERATE : 1;
}

// The two triangles of the quadrilateral that a segment sweeps. False: one without area.
static bool take_triangle(const CutPath ends[2], int which, Corner out[3])
{
    if (which == 0) {
        out[0] = (Corner){&ends[0].at[0], false};
        out[1] = (Corner){&ends[1].at[0], false};
        out[2] = (Corner){&ends[0].at[1], true};
        return !cut_points_equal(ends[0].at[0], ends[1].at[0]);
    }
    out[0] = (Corner){&ends[1].at[0], false};
    out[1] = (Corner){&ends[1].at[1], true};
    out[2] = (Corner){&ends[0].at[1], true};
    return !cut_points_equal(ends[0].at[1], ends[1].at[1]);
}

static bool rests(const CutPath ends[2])
{
    return cut_points_equal(ends[0].at[0], ends[0].at[1]) &&
           cut_points_equal(ends[1].at[0], ends[1].at[1]);
}

int cut_count(const CutPath edge[2], const CutPath link[2])
{
    if (rests(edge) && rests(link))
        return 0;
    int count = 0;
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) {
            Corner corner[6];
            if (!take_triangle(edge, i, corner) || !take_triangle(link, j, corner + 3))
                continue;
            int meet = triangles_meet(corner);
            if (meet == CUT_DEGENERATE)
                return CUT_DEGENERATE;
            count += meet;
        }
    return count;
}

// --- what can be seen without it ---

bool cut_boxes_apart(const CutPath edge[2], const CutPath link[2])
{
    for (int c = 0; c < 3; c++) {
        int64_t low[2], high[2];
        const CutPath *pair[2] = {edge, link};
        for (int k = 0; k < 2; k++) {
            low[k] = high[k] = pair[k][0].at[0].x[c];
            for (int i = 1; i < 4; i++) {
                int64_t x = pair[k][i / 2].at[i % 2].x[c];
                low[k] = x < low[k] ? x : low[k];
                high[k] = x > high[k] ? x : high[k];
            }
        }
        if (low[0] > high[1] || low[1] > high[0])
            return true;
    }
    return false;
}

// True if all points of the link, early and late, are strictly on one side of a triangle's plane.
static int side_of_link(const CutPoint *a, const CutPoint *b, const CutPoint *c,
                        const CutPath link[2])
{
    int64_t row[3][3];
    put_difference(row[0], b, a);
    put_difference(row[1], c, a);
    int side = 0;
    for (int i = 0; i < 4; i++) {
        put_difference(row[2], &link[i / 2].at[i % 2], a);
        int sign = sign_of_determinant((const int64_t(*)[3])row);
        if (sign == 0 || (side != 0 && sign != side))
            return 0;
        side = sign;
    }
    return side;
}

bool cut_may_meet(const CutPath edge[2], const CutPath link[2])
{
    if (cut_boxes_apart(edge, link))
        return false;
    const CutPoint *a0 = &edge[0].at[0], *a1 = &edge[0].at[1], *b0 = &edge[1].at[0],
                   *b1 = &edge[1].at[1];
    int first = side_of_link(a0, b0, a1, link);
    return first == 0 || side_of_link(b0, b1, a1, link) == 0;
}
