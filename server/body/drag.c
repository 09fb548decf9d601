// SPDX-License-Identifier: MIT
// Step thread, except drag_create.
#include "body/drag.h"

#include "base/sym3.h"

#include <math.h>
#include <string.h>

enum {
    SHARE = 1024
}; // vertices per thread and piece; another number sums in another order: other bits

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
    const VertexKernels *kernels;
    const SlowPass *pass;
    int count;
} Work;

static int end_of(const Work *work, int last)
{
    return last * SHARE < work->count ? last * SHARE : work->count;
}

static void add_sums(RigidSums *to, const RigidSums *from)
{
    to->mass += from->mass;
    for (int c = 0; c < 3; c++) {
        to->first[c] += from->first[c];
        to->momentum[c] += from->momentum[c];
        to->square[c] += from->square[c];
        to->product[c] += from->product[c];
        to->spin[c] += from->spin[c];
    }
}

// Cuts a run down to the vertices [first, end). False: none of them.
static bool cut_down(const int run[2], int first, int end, int part[2])
{
    part[0] = run[0] > first ? run[0] : first;
    part[1] = run[1] < end ? run[1] : end;
    return part[0] < part[1];
}

static void sum_runs(const Work *work, int first, int end, RigidSums *to)
{
    RigidSums sums;
    int part[2];
    memset(to, 0, sizeof *to);
    for (int r = 0; r < work->by->run_count; r++)
        if (cut_down(work->by->run[r], first, end, part)) {
            work->kernels->sum(work->pass, part[0], part[1], &sums);
            add_sums(to, &sums);
        }
}

static void sum_parts(void *context, int first, int last)
{
    const Work *work = context;
    for (int k = first; k < last; k++)
        if (work->by->run == NULL)
            work->kernels->sum(work->pass, k * SHARE, end_of(work, k + 1), &work->by->part[k]);
        else
            sum_runs(work, k * SHARE, end_of(work, k + 1), &work->by->part[k]);
}

static void slow_parts(void *context, int first, int last)
{
    const Work *work = context;
    const int begin = first * SHARE, end = end_of(work, last);
    int part[2];
    if (work->by->run == NULL)
        work->kernels->slow(work->pass, begin, end);
    for (int r = 0; r < work->by->run_count; r++)
        if (cut_down(work->by->run[r], begin, end, part))
            work->kernels->slow(work->pass, part[0], part[1]);
}

// Finds the rigid motion from the sums; without a unique one (all on a line) that which does not
// turn.
static void find_motion(const Drag *by, int parts, SlowPass *pass)
{
    RigidSums all = {0};
    for (int k = 0; k < parts; k++)
        add_sums(&all, &by->part[k]);
    // About the centre of mass.
    const double weight = all.mass > 0.0 ? 1.0 / all.mass : 0.0;
    double c[3], s[3], p[3], l[3];
    for (int i = 0; i < 3; i++)
        c[i] = weight * all.first[i];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        s[i] = all.square[i] - c[i] * all.first[i];
        p[i] = all.product[i] - c[j] * all.first[k];
        l[i] = all.spin[i] - (c[j] * all.momentum[k] - c[k] * all.momentum[j]);
    }
    // I = tr(S) 1 - S, by the adjugate.
    const Sym3 inertia = {s[1] + s[2], s[2] + s[0], s[0] + s[1], -p[0], -p[1], -p[2]};
    double determinant;
    const Sym3 adjugate = sym3_adjugate(inertia, &determinant);
    const double size = sym3_trace(inertia);
    const double inverse = determinant > 1e-12 * size * size * size ? 1.0 / determinant : 0.0;
    const Vec3 turn = vec3_scale(inverse, sym3_times(adjugate, vec3(l[0], l[1], l[2])));
    double *o = pass->turn;
    o[0] = turn.x, o[1] = turn.y, o[2] = turn.z;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        pass->velocity[i] = weight * all.momentum[i] - (o[j] * c[k] - o[k] * c[j]);
    }
}

void drag_slow(Drag *by, const VertexKernels *kernels, SlowPass *pass, int count, Team *team)
{
    Work work = {by, kernels, pass, count};
    const int parts = (count + SHARE - 1) / SHARE;
    if (team != NULL)
        team_run(team, sum_parts, &work, parts);
    else
        sum_parts(&work, 0, parts);
    find_motion(by, parts, pass);
    if (team != NULL)
        team_run(team, slow_parts, &work, parts);
    else
        slow_parts(&work, 0, parts);
}
