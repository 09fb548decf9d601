// Finds the links that a sweep breaks.
#include "voxel/cut/cut_blade_parts.h"

#include <limits.h>
#include <math.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// One link

static CutPath path_of(const BladeSearch *search, int cell, int part, int parts)
{
    CutPath path;
    for (int c = 0; c < 3; c++) {
        path.at[0].x[c] = search->blades->before[cell][c];
        path.at[1].x[c] = search->memory->centre[cell][c];
    }
    return parts == 1 ? path : cut_part(path, part, parts);
}

// ---------------------------------------------------------------------------------------------
// Links that an edge may meet: like cut_may_meet, but the sides of the edge's box are computed once
// per cell for all its links. One bit of a code per side (low, high by axis).

void cut_sweep_set_edge(BladeSearch *search, const CutPath edge[2])
{
    memcpy(search->edge, edge, sizeof search->edge);
    search->box = box_empty();
    for (int k = 0; k < 4; k++) {
        const int64_t *x = edge[k / 2].at[k % 2].x;
        box_add(&search->box, vec3((double)x[0], (double)x[1], (double)x[2]));
    }
    const CutPoint *corner[2][3] = {{&edge[0].at[0], &edge[1].at[0], &edge[0].at[1]},
                                    {&edge[1].at[0], &edge[1].at[1], &edge[0].at[1]}};
    for (int t = 0; t < 2; t++) {
        double u[3], v[3];
        for (int c = 0; c < 3; c++) {
            search->at[t][c] = (double)corner[t][0]->x[c];
            u[c] = (double)(corner[t][1]->x[c] - corner[t][0]->x[c]);
            v[c] = (double)(corner[t][2]->x[c] - corner[t][0]->x[c]);
        }
        for (int c = 0; c < 3; c++) {
            const int a = (c + 1) % 3, b = (c + 2) % 3;
            search->normal[t][c] = u[a] * v[b] - u[b] * v[a];
            search->normal_size[t][c] = fabs(u[a] * v[b]) + fabs(u[b] * v[a]);
        }
    }
}

// Returns the side of a plane on which a point certainly is: 1, 2, or 0 if undecided.
static unsigned side_of(const BladeSearch *search, int plane, const CutPoint *point)
{
    double sum = 0.0, size = 0.0;
    for (int c = 0; c < 3; c++) {
        const double away = (double)point->x[c] - search->at[plane][c];
        sum += search->normal[plane][c] * away;
        size += search->normal_size[plane][c] * fabs(away);
    }
    const double rounding = 8.9e-16 * size; // of a 3 x 3 determinant, see cut_exact.c
    return sum > rounding ? 1u : sum < -rounding ? 2u : 0u;
}

static unsigned code_of(BladeSearch *search, int cell, int part, int parts)
{
    CutBlades *blades = search->blades;
    if (blades->code_stamp[cell] == search->stamp)
        return blades->code[cell];
    const CutPath path = path_of(search, cell, part, parts);
    unsigned code = 0;
    for (int c = 0; c < 3; c++) {
        const double a = (double)path.at[0].x[c], b = (double)path.at[1].x[c];
        code |= (unsigned)((a < search->box.low[c]) & (b < search->box.low[c])) << 2 * c;
        code |= (unsigned)((a > search->box.high[c]) & (b > search->box.high[c])) << (2 * c + 1);
    }
    blades->code_stamp[cell] = search->stamp;
    blades->code[cell] = (unsigned char)code;
    return code;
}

// True if all points of a link are certainly on one side of both planes.
static bool is_clear(const BladeSearch *search, const CutPath link[2])
{
    for (int t = 0; t < 2; t++) {
        unsigned side = 3;
        for (int k = 0; k < 4; k++)
            side &= side_of(search, t, &link[k / 2].at[k % 2]);
        if (side == 0)
            return false;
    }
    return true;
}

// ---------------------------------------------------------------------------------------------
// Sub-ticks

static void forget_hits(CutBlades *blades, int from)
{
    for (int h = from; h < blades->hit_count; h++)
        blades->hit_bits[blades->hit[h][0]] &= (unsigned char)~(1u << blades->hit[h][1]);
    blades->hit_count = from;
}

static void next_codes(BladeSearch *search)
{
    CutBlades *blades = search->blades;
    if (blades->last_code == INT_MAX) {
        memset(blades->code_stamp, 0, (size_t)blades->cell_count * sizeof *blades->code_stamp);
        blades->last_code = 0;
    }
    search->stamp = ++blades->last_code;
}

// Tests one link: 1 when it was met an odd number of times, 0, or CUT_DEGENERATE.
static int test_link(BladeSearch *search, int cell, int beyond, int part, int parts)
{
    search->blades->looked_at++;
    if ((code_of(search, cell, part, parts) & code_of(search, beyond, part, parts)) != 0)
        return 0;
    const bool ordered = cell < beyond;
    const CutPath link[2] = {path_of(search, ordered ? cell : beyond, part, parts),
                             path_of(search, ordered ? beyond : cell, part, parts)};
    const int count = is_clear(search, link) ? 0 : cut_count(search->edge, link);
    return count == CUT_DEGENERATE ? CUT_DEGENERATE : count % 2;
}

// Tests the links of one cell. False: degenerate.
static bool test_cell(BladeSearch *search, int cell, int part, int parts)
{
    CutBlades *blades = search->blades;
    for (int axis = 0; axis < 3; axis++) {
        const int beyond = blades->beyond[cell][axis];
        const bool broken = blades->lattice->broken[cell] >> axis & 1;
        // Skip links to void, hits, and broken ones unless their meeting must be reported.
        if (beyond < 0 || (blades->hit_bits[cell] >> axis & 1) ||
            (broken && (!search->whole || search->met_broken)))
            continue;
        if (search->coded) {
            if (!cut_near_link_may_meet(search, cell, beyond))
                continue;
            cut_near_look_at(search, cell);
            cut_near_look_at(search, beyond);
        }
        const int odd = test_link(search, cell, beyond, part, parts);
        if (broken) {
            search->met_broken |= odd == 1;
            continue;
        }
        if (odd == CUT_DEGENERATE)
            return false;
        if (odd == 0)
            continue;
        blades->hit_bits[cell] |= (unsigned char)(1u << axis);
        int *hit = blades->hit[blades->hit_count++];
        hit[0] = cell, hit[1] = axis;
    }
    return true;
}

// All links that may be near, in the order of cells and axes. False: degenerate.
static bool test_links(BladeSearch *search, int part, int parts)
{
    CutBlades *blades = search->blades;
    next_codes(search);
    for (int cell = 0; search->coded && cell < blades->cell_count; cell++)
        if (!test_cell(search, cell, part, parts))
            return false;
    for (int k = 0; k < search->brick_count; k++) {
        if (!cut_near_brick_may_meet(search, blades->brick[k]))
            continue;
        if (search->whole) // nothing has to be remembered of other cells
            cut_near_look_at_brick(search, blades->brick[k]);
        const CutWindow *brick = &blades->lattice->window[blades->brick[k]];
        for (int cell = brick->first; cell < brick->end; cell++)
            if (!test_cell(search, cell, part, parts))
                return false;
    }
    return true;
}

bool cut_sweep_parts(BladeSearch *search, const CutPath base[2], CutPoint used[2], bool fresh,
                     int64_t *tries, int parts)
{
    for (int part = 0; part < parts; part++) {
        const int before = search->blades->hit_count;
        bool done = false;
        while (!done) {
            const CutPath way[2] = {cut_part(base[0], part, parts), cut_part(base[1], part, parts)};
            CutPoint from[2] = {way[0].at[0], way[1].at[0]}, to[2] = {way[0].at[1], way[1].at[1]};
            cut_shift_edge(from, *tries);
            cut_shift_edge(to, *tries);
            const bool begins = fresh && part == 0; // else from where the edge was used last
            const CutPath edge[2] = {{{begins ? from[0] : used[0], to[0]}},
                                     {{begins ? from[1] : used[1], to[1]}}};
            cut_sweep_set_edge(search, edge);
            done = test_links(search, part, parts);
            if (done) {
                used[0] = to[0], used[1] = to[1];
                break;
            }
            forget_hits(search->blades, before);
            if (++*tries > CUT_TRIES)
                return false;
        }
    }
    return true;
}
