// Blades in a plane body: the links between neighbouring cells are in the plane, the blade's edge
// moves in space, and they meet where the edge passes through the plane (dynamics/cut_exact.h).
// There are few cells, so that all links are tested. Step thread.
#include "plane/cut.h"

#include <string.h>

static const double TWIST =
    0.05; // of a cell: tolerated difference of a sub-tick's sweep from a twisted patch

void plane_cut_reserve_blades(void *self, int blades, Arena *arena, StateList *state)
{
    PlaneModel *model = self;
    PlaneCut *cut = model->cut;
    const size_t count = (size_t)blades * (size_t)cut->cell_count;
    cut->blades = blades;
    cut->center = arena_allocate(arena, ARENA_TOPOLOGY, count, sizeof *cut->center, "%s/%s",
                                 cut->name, "cells near blades");
    state_add(state, cut->center, count * sizeof *cut->center, "%s/cells_near_blades", cut->name);
}

// ---------------------------------------------------------------------------------------------
// Positions of cells

// Computes the nine places of a square in the rows' coordinates; without a vertex, the mean that a
// new one would get.
static void places_of(const PlaneModel *model, int element, double at[PLANE_PLACES][2])
{
    const PlaneCut *cut = model->cut;
    const Rows *rows = &model->vertices.rows;
    const unsigned quarters = cut->layout.element[element].quarters;
    int outline[PLANE_PLACES];
    const int count = plane_outline(quarters, outline);
    for (int p = 0; p < PLANE_PLACES; p++)
        for (int d = 0; d < 2 && cut->vertex[element][p] >= 0; d++) {
            const int row = cut->vertex[element][p];
            at[p][d] =
                rows->rest[row][d] + rows_get(rows, model->vertices.present, (long)row * ROW + d);
        }
    for (int k = 0; k < count; k++)
        if (cut->vertex[element][outline[k]] < 0)
            for (int d = 0; d < 2; d++)
                at[outline[k]][d] = 0.5 * (at[outline[(k + count - 1) % count]][d] +
                                           at[outline[(k + 1) % count]][d]);
    for (int d = 0; d < 2 && quarters == PLANE_WHOLE; d++)
        at[PLANE_CENTER][d] = 0.25 * (at[0][d] + at[2][d] + at[6][d] + at[8][d]);
}

// Computes a cell's centre. Inside a quarter, whose corners are places of its square, carving
// interpolates with means of means: bilinear.
static bool centre_of(const PlaneModel *model, int i, int j, CutPoint *out)
{
    const PlaneCut *cut = model->cut;
    const int element = plane_layout_at(&cut->layout, i, j);
    const PlaneElement *own = &cut->layout.element[element];
    double at[PLANE_PLACES][2], x[2] = {0.0, 0.0};
    places_of(model, element, at);
    const double size = (double)(1 << own->level);
    const double s = (i + 0.5 - own->cell[0]) / size * 2.0;
    const double t = (j + 0.5 - own->cell[1]) / size * 2.0;
    if (own->level == 0)
        for (int d = 0; d < 2; d++)
            x[d] = 0.25 * (at[0][d] + at[2][d] + at[6][d] + at[8][d]);
    else {
        const int qx = s >= 1.0, qy = t >= 1.0, low = qx + 3 * qy;
        const double u = s - qx, v = t - qy;
        for (int d = 0; d < 2; d++)
            x[d] = (1.0 - v) * ((1.0 - u) * at[low][d] + u * at[low + 1][d]) +
                   v * ((1.0 - u) * at[low + 3][d] + u * at[low + 4][d]);
    }
    const BaseFrame *frame = model->vertices.rows.frame;
    Vec3 world = vec3_add(frame->origin, quat_rotate(frame->turn, (Vec3){x[0], x[1], 0.0}));
    return cut_quantise(world, cut->origin, cut->quantum, out);
}

// Computes the paths of all cells since the last tick of a stroke, or at rest. False: too far away.
static bool take_paths(PlaneModel *model, const CutSweep *sweep)
{
    PlaneCut *cut = model->cut;
    for (int cell = 0; cell < cut->cell_count; cell++) {
        if (!cut->is_solid[cell])
            continue;
        CutPoint now;
        if (!centre_of(model, cell % cut->layout.count[0], cell / cut->layout.count[0], &now))
            return false;
        const PlaneCenter *known =
            sweep->blade < 0 ? NULL : &cut->center[(long)sweep->blade * cut->cell_count + cell];
        const bool moved = known != NULL && sweep->phase == CUT_GOES_ON && known->known;
        cut->path[cell] = (CutPath){{moved ? known->point : now, now}};
    }
    return true;
}

static void keep_centers(PlaneCut *cut, const CutSweep *sweep)
{
    PlaneCenter *center = &cut->center[(long)sweep->blade * cut->cell_count];
    for (int cell = 0; cell < cut->cell_count; cell++)
        if (cut->is_solid[cell])
            center[cell] = (PlaneCenter){sweep->phase == CUT_BEGINS ? CENTER_BEGAN : CENTER_KNOWN,
                                         cut->path[cell].at[1]};
}

// True if no sweep of this stroke has ended where this one begins.
static bool is_first(const PlaneCut *cut, const CutSweep *sweep)
{
    if (sweep->blade < 0)
        return true;
    const PlaneCenter *center = &cut->center[(long)sweep->blade * cut->cell_count];
    for (int cell = 0; cell < cut->cell_count; cell++)
        if (cut->is_solid[cell])
            return center[cell].known != CENTER_KNOWN;
    return true;
}

// ---------------------------------------------------------------------------------------------
// Met links

static int neighbor_of(const PlaneCut *cut, int cell, int bit)
{
    const int wide = cut->layout.count[0];
    const int beyond = bit == PLANE_BROKEN_RIGHT ? cell + 1 : cell + wide;
    if (bit == PLANE_BROKEN_RIGHT ? (cell + 1) % wide == 0 : beyond >= cut->cell_count)
        return -1;
    return cut->is_solid[cell] && cut->is_solid[beyond] ? beyond : -1;
}

// Marks the links that a part of the sweep breaks; `*met` counts the links met, broken ones
// included. False: degenerate.
static bool mark_links(PlaneCut *cut, const CutPath edge[2], int k, int m, int *met)
{
    const CutPath part[2] = {cut_part(edge[0], k, m), cut_part(edge[1], k, m)};
    for (int cell = 0; cell < cut->cell_count; cell++)
        for (int bit = PLANE_BROKEN_RIGHT; bit <= PLANE_BROKEN_UP; bit *= 2) {
            const int beyond = neighbor_of(cut, cell, bit);
            if (beyond < 0)
                continue;
            const CutPath link[2] = {cut_part(cut->path[cell], k, m),
                                     cut_part(cut->path[beyond], k, m)};
            if (!cut_may_meet(part, link))
                continue;
            const int count = cut_count(part, link);
            if (count == CUT_DEGENERATE)
                return false;
            if (count % 2 == 0)
                continue;
            ++*met;
            cut->marked[cell] ^= (unsigned char)bit;
        }
    return true;
}

static bool shift_edge(const PlaneCut *cut, const CutSweep *sweep, int64_t attempt, CutPath edge[2])
{
    CutPoint from[2], to[2];
    if (!cut_quantise_edge(&sweep->before, cut->origin, cut->quantum, from) ||
        !cut_quantise_edge(&sweep->after, cut->origin, cut->quantum, to))
        return false;
    cut_shift_edge(from, attempt);
    cut_shift_edge(to, attempt);
    for (int end = 0; end < 2; end++)
        edge[end] = (CutPath){{from[end], to[end]}};
    return true;
}

static CutVerdict find_links(PlaneCut *cut, const CutSweep *sweep, int *met)
{
    const int m = cut_subticks(sweep, TWIST * cut->forms.size);
    if (m == 0)
        return CUT_TOO_TWISTED;
    int64_t first = sweep->stroke == NULL ? 0 : sweep->stroke->tries;
    // A degenerate case is resolved by another shift.
    for (int64_t attempt = first; attempt < first + CUT_TRIES; attempt++) {
        CutPath edge[2];
        if (!shift_edge(cut, sweep, attempt, edge))
            return CUT_TOO_LARGE;
        // A new shift must not move the start of the edge: the last tick's sweep ended there.
        for (int end = 0; end < 2 && attempt > first && !is_first(cut, sweep); end++) {
            const CutPoint old = cut_shift(first, end), now = cut_shift(attempt, end);
            for (int c = 0; c < 3; c++)
                edge[end].at[0].x[c] += old.x[c] - now.x[c];
        }
        bool resolved = true;
        *met = 0;
        for (int k = 0; k < m && resolved; k++)
            resolved = mark_links(cut, (const CutPath *)edge, k, m, met);
        if (resolved) {
            if (sweep->stroke != NULL)
                sweep->stroke->tries = attempt;
            return CUT_DONE;
        }
        memset(cut->marked, 0, (size_t)cut->cell_count);
    }
    return CUT_UNRESOLVED;
}

// Lists the marked edges that are not broken yet; clears the marks.
static void list_marked(PlaneCut *cut)
{
    cut->edge_count = 0;
    for (int cell = 0; cell < cut->cell_count; cell++) {
        const unsigned fresh = cut->marked[cell] & ~(unsigned)cut->broken[cell];
        cut->marked[cell] = 0;
        for (int bit = PLANE_BROKEN_RIGHT; bit <= PLANE_BROKEN_UP; bit *= 2)
            if (fresh & (unsigned)bit) {
                cut->edge[cut->edge_count][0] = cell;
                cut->edge[cut->edge_count++][1] = bit;
            }
    }
}

bool plane_cut_along(Body *body, const CutSweep *sweep, CutOutcome *outcome, TopologyChange *change)
{
    PlaneModel *model = body->model;
    PlaneCut *cut = model->cut;
    *outcome = (CutOutcome){.verdict = CUT_MET_NOTHING};
    plane_cut_count_pieces(cut, outcome);
    if (sweep->phase == CUT_ENDS) {
        memset(&cut->center[(long)sweep->blade * cut->cell_count], 0,
               (size_t)cut->cell_count * sizeof *cut->center);
        return false;
    }
    if (!take_paths(model, sweep)) {
        outcome->verdict = CUT_TOO_LARGE;
        return false;
    }
    // A stroke that begins only stores the centres.
    int met = 0;
    CutVerdict verdict = CUT_DONE;
    if (sweep->phase != CUT_BEGINS)
        verdict = find_links(cut, sweep, &met);
    if (sweep->blade >= 0)
        keep_centers(cut, sweep);
    if (verdict != CUT_DONE) {
        outcome->verdict = verdict;
        return false;
    }
    list_marked(cut);
    if (cut->edge_count == 0) {
        outcome->verdict = met > 0 ? CUT_WAS_CUT : CUT_MET_NOTHING;
        return false;
    }
    if (!plane_cut_break(body, (const int(*)[2])cut->edge, cut->edge_count, outcome, change))
        return false;
    outcome->verdict = CUT_DONE;
    plane_cut_count_pieces(cut, outcome);
    return true;
}
