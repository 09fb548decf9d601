// Step thread, except drag_create.
#include "dynamics/drag.h"

#include <math.h>

enum { SHARE = 1024 }; // vertices per thread and piece

Drag *drag_create(const char *name, int capacity, Arena *arena)
{
    Drag *by = arena_allocate(arena, ARENA_STEP, 1, sizeof *by, "%s/drag", name);
    by->part_count = (capacity + SHARE - 1) / SHARE;
    by->part = arena_allocate(arena, ARENA_STEP, (size_t)by->part_count, sizeof *by->part,
                              "%s/rigid sums", name);
    return by;
}

typedef struct Work {
    Drag *by;
    double drag;
    const Rows *rows;
    const void *row;
    const double *mass;
    int count;
    void *force;
} Work;

static inline int end_of(const Work *work, int last)
{
    return last * SHARE < work->count ? last * SHARE : work->count;
}

// Reads place and velocity of a vertex in the rows' coordinates. `single` is a constant where this
// is inlined.
static inline void read_vertex(const Work *work, bool single, long i, double x[3], double v[3])
{
    for (int c = 0; c < 3; c++) {
        const long at = i * ROW + c;
        x[c] = work->rows->rest[i][c] +
               (single ? (double)((const float *)work->row)[at] : ((const double *)work->row)[at]);
        v[c] = single ? (double)((const float *)work->row)[at + 4]
                      : ((const double *)work->row)[at + 4];
    }
}

static inline void sum_share(const Work *work, bool single, int first, int end, RigidSums *to)
{
    RigidSums sum = {0};
    for (int i = first; i < end; i++) {
        const double m = work->mass[i];
        double x[3], v[3], mx[3];
        read_vertex(work, single, i, x, v);
        sum.mass += m;
        for (int c = 0; c < 3; c++) {
            mx[c] = m * x[c];
            sum.first[c] += mx[c];
            sum.momentum[c] += m * v[c];
            sum.spread[c] += mx[c] * x[c];
        }
        for (int c = 0; c < 3; c++) {
            const int d = (c + 1) % 3, e = (c + 2) % 3;
            sum.spread[3 + c] += mx[d] * x[e];
            sum.spin[c] += mx[d] * v[e] - mx[e] * v[d];
        }
    }
    *to = sum;
}

static void sum_parts(void *context, int first, int last)
{
    const Work *work = context;
    for (int k = first; k < last; k++) {
        RigidSums *to = &work->by->part[k];
        const int end = end_of(work, k + 1);
        if (work->rows->precision == PRECISION_SINGLE)
            sum_share(work, true, k * SHARE, end, to);
        else
            sum_share(work, false, k * SHARE, end, to);
    }
}

static inline void slow_share(const Work *work, bool single, int first, int end)
{
    const double *w = work->by->velocity, *o = work->by->turn;
    for (int i = first; i < end; i++) {
        const double k = -work->drag * work->mass[i];
        double x[3], v[3];
        read_vertex(work, single, i, x, v);
        const double f[3] = {k * (v[0] - w[0] - (o[1] * x[2] - o[2] * x[1])),
                             k * (v[1] - w[1] - (o[2] * x[0] - o[0] * x[2])),
                             k * (v[2] - w[2] - (o[0] * x[1] - o[1] * x[0]))};
        for (int c = 0; c < 3; c++) {
            if (single)
                ((float *)work->force)[4L * i + c] += (float)f[c];
            else
                ((double *)work->force)[4L * i + c] += f[c];
        }
    }
}

static void slow_parts(void *context, int first, int last)
{
    const Work *work = context;
    if (work->rows->precision == PRECISION_SINGLE)
        slow_share(work, true, first * SHARE, end_of(work, last));
    else
        slow_share(work, false, first * SHARE, end_of(work, last));
}

// Finds the rigid motion from the sums; without a unique one (all on a line) that which does not
// turn.
static void find_motion(Drag *by, int parts)
{
    RigidSums all = {0};
    double *sum = (double *)&all;
    for (int k = 0; k < parts; k++)
        for (size_t n = 0; n < sizeof all / sizeof *sum; n++)
            sum[n] += ((const double *)&by->part[k])[n];
    const double weight = all.mass > 0.0 ? 1.0 / all.mass : 0.0;
    double c[3], s[6], l[3];
    for (int i = 0; i < 3; i++)
        c[i] = weight * all.first[i];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        s[i] = all.spread[i] - c[i] * all.first[i];
        s[3 + i] = all.spread[3 + i] - c[j] * all.first[k];
        l[i] = all.spin[i] - (c[j] * all.momentum[k] - c[k] * all.momentum[j]);
    }
    // I = tr(S) 1 - S, by the adjugate.
    const double x = s[1] + s[2], y = s[2] + s[0], z = s[0] + s[1];
    const double xx = y * z - s[3] * s[3], yy = z * x - s[4] * s[4], zz = x * y - s[5] * s[5],
                 yz = s[4] * s[5] + x * s[3], zx = s[5] * s[3] + y * s[4],
                 xy = s[3] * s[4] + z * s[5];
    const double determinant = x * xx - s[5] * xy - s[4] * zx, size = x + y + z;
    const double inverse = determinant > 1e-12 * size * size * size ? 1.0 / determinant : 0.0;
    double *o = by->turn;
    o[0] = (xx * l[0] + xy * l[1] + zx * l[2]) * inverse;
    o[1] = (xy * l[0] + yy * l[1] + yz * l[2]) * inverse;
    o[2] = (zx * l[0] + yz * l[1] + zz * l[2]) * inverse;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        by->velocity[i] = weight * all.momentum[i] - (o[j] * c[k] - o[k] * c[j]);
    }
}

void drag_add_forces(Drag *by, double drag, const Rows *rows, const void *row, const double *mass,
                     int count, void *force, Team *team)
{
    Work work = {by, drag, rows, row, mass, count, force};
    const int parts = (count + SHARE - 1) / SHARE;
    if (team != NULL)
        team_run(team, sum_parts, &work, parts);
    else
        sum_parts(&work, 0, parts);
    find_motion(by, parts);
    if (team != NULL)
        team_run(team, slow_parts, &work, parts);
    else
        slow_parts(&work, 0, parts);
}
