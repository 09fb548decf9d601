// SPDX-License-Identifier: MIT
// Blades in a plane body: the links between neighbouring cells are in the plane, the blade's edge
// moves in space, and they meet where the edge passes through the plane (body/cut_exact.h).
// There are few cells, so that all links are tested. Step thread.
#include "plane/cut.h"

#include <string.h>

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
    return cut_quantise(world, cut->links.origin, cut->links.q, out);
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

// Offers all links (LinkOffer).
static bool offer_links(LinkFinder *links, void *model)
{
    const PlaneCut *cut = model;
    for (int cell = 0; cell < cut->cell_count; cell++)
        for (int bit = PLANE_BROKEN_RIGHT; bit <= PLANE_BROKEN_UP; bit *= 2) {
            const int beyond = neighbor_of(cut, cell, bit);
            if (beyond >= 0 && !link_finder_meet(links, plane_cut_link(cell, bit),
                                                 (CutPath[2]){cut->path[cell], cut->path[beyond]}))
                return false;
        }
    return true;
}

// Finds the links that a sweep breaks.
static CutVerdict find_links(PlaneCut *cut, const CutSweep *sweep)
{
    LinkFinder *links = &cut->links;
    const BladeEdge edge[2] = {sweep->before, sweep->after};
    CutVerdict verdict = link_finder_check(links, edge, 2);
    if (verdict != CUT_DONE)
        return verdict;
    // A command has no trail. That of a stroke ends where the last sweep did, with its shift.
    CutTrail trail = {.fresh = is_first(cut, sweep)};
    CutStroke *stroke = sweep->stroke;
    if (stroke != NULL) {
        trail.tries = stroke->tries;
        cut_quantise_edge(&sweep->before, links->origin, links->q, trail.edge);
        if (!trail.fresh)
            cut_shift_edge(trail.edge, trail.tries);
    }
    verdict = link_finder_sweep(links, edge, 2, stroke != NULL ? &trail : NULL, offer_links, cut);
    if (verdict != CUT_DONE)
        return verdict;
    if (stroke != NULL)
        stroke->tries = trail.tries;
    // Drop those that are broken already.
    const int met = links->met_count;
    links->met_count = 0;
    for (int k = 0; k < met; k++) {
        const int link = links->met[k];
        if (!(cut->broken[link / 2] >> link % 2 & 1))
            links->met[links->met_count++] = link;
    }
    return links->met_count > 0 ? CUT_DONE : met > 0 ? CUT_WAS_CUT : CUT_MET_NOTHING;
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
    if (sweep->phase != CUT_BEGINS)
        outcome->verdict = find_links(cut, sweep);
    if (sweep->blade >= 0)
        keep_centers(cut, sweep);
    if (outcome->verdict != CUT_DONE ||
        !plane_cut_break(body, cut->links.met, cut->links.met_count, outcome, change))
        return false;
    plane_cut_count_pieces(cut, outcome);
    return true;
}
