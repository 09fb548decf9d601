// SPDX-License-Identifier: MIT
// Finds the faces that a blade's motion breaks.
#include "base/check.h"
#include "voxel/cut/cut_near.h"

#include <limits.h>
#include <string.h>

enum { PARTS_OF_CELL = 1024 }; // q is a cell's edge divided by this
#define TWIST_TOLERANCE 0.05   // of a sub-tick, in cells

// ---------------------------------------------------------------------------------------------
// Sweeps

static void look_at_bricks(BladeSearch *search)
{
    for (int k = 0; k < search->brick_count; k++)
        cut_near_look_at_brick(search, search->blades->brick[k]);
}

static void forget_boxes(const CutBlades *blades, BladeMemory *memory)
{
    for (int b = 0; b < blades->brick_count; b++)
        memory->box[b].made = -1.0;
}

// Returns where the sweep met a link.
static CutCrossing crossing_of(const BladeSearch *search, CrossGradients *gradients, int cell,
                               int axis)
{
    const CutBlades *blades = search->blades;
    const CutPath link[2] = {cut_near_path(search, cell),
                             cut_near_path(search, cut_near_beyond(blades, cell, axis))};
    return cut_crossing_find(&search->centres, gradients, blades->links.edge, link, cell, axis);
}

// Tests the links near a sweep and lists in `hit` those that break.
static CutVerdict find_hits(BladeSearch *search, const CutSweep *sweep, CutTrail *trail)
{
    CutBlades *blades = search->blades;
    LinkFinder *links = &blades->links;
    const BladeEdge edge[2] = {sweep->before, sweep->after};
    if (search->lost)
        return CUT_TOO_LARGE;
    const CutVerdict verdict = link_finder_sweep(links, edge, 2, trail, cut_near_offer, search);
    if (verdict != CUT_DONE || search->lost)
        return search->lost ? CUT_TOO_LARGE : verdict;
    if (links->full) { // with more than there can be vertices for
        blades->hit_count = links->met_count;
        return CUT_DONE;
    }
    // Of those met, list the ones that are not broken yet.
    CrossGradients gradients;
    memset(gradients.leaf, 0, sizeof gradients.leaf);
    for (int k = 0; k < links->met_count; k++) {
        const int cell = links->met[k] / 3, axis = links->met[k] % 3;
        if (blades->lattice->broken[cell] >> axis & 1)
            continue;
        const int hit = blades->hit_count++;
        if (hit >= blades->hit_most)
            continue;
        if (blades->crossing != NULL)
            blades->crossing[hit] = crossing_of(search, &gradients, cell, axis);
        blades->hit[hit][0] = cell, blades->hit[hit][1] = axis;
    }
    return blades->hit_count > 0 ? CUT_DONE : links->met_count > 0 ? CUT_WAS_CUT : CUT_MET_NOTHING;
}

static BladeSearch begin_whole(CutBlades *blades, const void *row, const CutSweep *sweep)
{
    BladeSearch search = {
        .blades = blades, .memory = &blades->whole, .whole = true, .now = 1, .was = -1};
    const LinkFinder *links = &blades->links;
    CutPoint from[2], to[2];
    cut_quantise_edge(&sweep->before, links->origin, links->q, from);
    cut_quantise_edge(&sweep->after, links->origin, links->q, to);
    cut_centres_begin(&search.centres, blades->lattice, blades->rows, row);
    cut_near_set_edge(&search, (CutPath[2]){{{from[0], to[0]}}, {{from[1], to[1]}}});
    return search;
}

int cut_blades_find_larger(CutBlades *blades, const void *row, const CutSweep *sweep, int level)
{
    const BladeEdge edge[2] = {sweep->before, sweep->after};
    if (link_finder_check(&blades->links, edge, 2) != CUT_DONE) // cut_blades_find says so
        return 0;
    BladeSearch search = begin_whole(blades, row, sweep);
    return cut_near_find_larger(&search, level, blades->larger);
}

static CutVerdict sweep_whole(CutBlades *blades, const void *row, const CutSweep *sweep)
{
    BladeSearch search = begin_whole(blades, row, sweep);
    // A command knows nothing of earlier positions: every cell is new.
    memset(blades->whole.stamp, 0, (size_t)blades->place_most * sizeof *blades->whole.stamp);
    cut_near_find_codes(&search);
    return find_hits(&search, sweep, NULL);
}

// Begins the stroke at this edge. False: a cell is out of range.
static bool begin_stroke(CutBlades *blades, const void *row, BladeMemory *memory,
                         const BladeEdge *edge)
{
    BladeStroke *stroke = memory->stroke;
    *stroke = (BladeStroke){.under_way = 1, .fresh = 1, .now = 1};
    cut_quantise_edge(edge, blades->links.origin, blades->links.q, stroke->edge);
    memset(memory->stamp, 0, (size_t)blades->cell_count * sizeof *memory->stamp);
    BladeSearch search = {.blades = blades, .memory = memory, .now = 1, .was = -1};
    cut_centres_begin(&search.centres, blades->lattice, blades->rows, row);
    forget_boxes(blades, memory);
    cut_near_note_motion(&search, 0.0, row);
    cut_near_find_bricks(&search, stroke->edge, stroke->edge);
    look_at_bricks(&search);
    if (search.lost)
        *stroke = (BladeStroke){.under_way = 0};
    return !search.lost;
}

static CutVerdict go_on(CutBlades *blades, const void *row, double tick, const CutSweep *sweep,
                        BladeMemory *memory)
{
    BladeStroke *stroke = memory->stroke;
    BladeSearch search = {.blades = blades, .memory = memory};
    CutPoint to[2];
    cut_quantise_edge(&sweep->after, blades->links.origin, blades->links.q, to);
    // Find the bricks near the sweep, then the cells there, before any link is tested.
    search.was = (int)stroke->now;
    search.now = (int)++stroke->now;
    cut_centres_begin(&search.centres, blades->lattice, blades->rows, row);
    cut_near_note_motion(&search, tick, row);
    cut_near_find_bricks(&search, stroke->edge, to);
    look_at_bricks(&search);
    // The stroke goes on from its trail, which moves on unless the sweep is refused.
    CutTrail trail = {{stroke->edge[0], stroke->edge[1]}, sweep->stroke->tries, stroke->fresh != 0};
    const CutVerdict verdict = find_hits(&search, sweep, &trail);
    memcpy(stroke->edge, trail.edge, sizeof stroke->edge);
    stroke->fresh = trail.fresh;
    sweep->stroke->tries = trail.tries;
    return verdict;
}

static CutVerdict find(CutBlades *blades, const void *row, double tick, const CutSweep *sweep)
{
    const bool whole = sweep->phase == CUT_WHOLE, begins = sweep->phase == CUT_BEGINS;
    ASSERT(whole || (sweep->blade >= 0 && sweep->blade < blades->blade_count));
    BladeMemory *memory = whole ? NULL : &blades->blade[sweep->blade];
    if (begins || sweep->phase == CUT_ENDS)
        *memory->stroke = (BladeStroke){.under_way = 0};
    if (sweep->phase == CUT_ENDS)
        return CUT_MET_NOTHING;
    // A stroke begins, and without memory goes on, at the first of these edges.
    const BladeEdge edge[2] = {begins ? sweep->after : sweep->before, sweep->after};
    cut_near_forget_places(blades);
    const CutVerdict verdict = link_finder_check(&blades->links, edge, 2);
    if (verdict != CUT_DONE)
        return verdict;
    if (whole)
        return sweep_whole(blades, row, sweep);
    if (!memory->stroke->under_way && !begin_stroke(blades, row, memory, &edge[0]))
        return CUT_TOO_LARGE;
    return begins ? CUT_MET_NOTHING : go_on(blades, row, tick, sweep, memory);
}

bool cut_blades_find(CutBlades *blades, const void *row, double tick, const CutSweep *sweep,
                     CutOutcome *outcome)
{
    blades->hit_count = 0;
    outcome->verdict = find(blades, row, tick, sweep);
    outcome->separated = blades->hit_count;
    return outcome->verdict == CUT_DONE;
}

// ---------------------------------------------------------------------------------------------
// Load time

// Centres for commands, centres before, and codes. In a solid that adapts a sweep looks at no more
// cells than the solid has vertices.
static void create_scratch(CutBlades *blades, const char *name, bool sparse, Arena *arena)
{
    const size_t places = (size_t)blades->place_most;
    blades->before = arena_allocate(arena, ARENA_CONTACT, places, sizeof *blades->before,
                                    "%s/centres before", name);
    blades->whole.centre = blades->before; // a command knows of no motion
    blades->whole.stamp = ALLOCATE(ARENA_CONTACT, places, int, "stamps of centres");
    blades->code_stamp = ALLOCATE(ARENA_CONTACT, places, int, "stamps of codes");
    blades->code = ALLOCATE(ARENA_CONTACT, places, unsigned char, "codes");
    if (!sparse)
        return;
    while (1L << blades->place_bits < 2L * blades->place_most)
        blades->place_bits++;
    blades->place_at = ALLOCATE(ARENA_CONTACT, 1L << blades->place_bits, int, "places of cells");
    memset(blades->place_at, -1, sizeof(int) << blades->place_bits);
    blades->cell_at = ALLOCATE(ARENA_CONTACT, places, int, "cells looked at");
}

void cut_blades_create(CutBlades *blades, const char *name, const CutLattice *lattice,
                       const Rows *rows, double size, Arena *arena)
{
    const int cells = lattice->level_first[1];
    *blades = (CutBlades){.lattice = lattice,
                          .rows = rows,
                          .size = size,
                          .cell_count = cells,
                          .links = {.origin = rows->rest_origin,
                                    .q = size / PARTS_OF_CELL,
                                    .tolerance = TWIST_TOLERANCE * size}};
    // More faces than these, at four vertices each, cannot be broken.
    const int most = lattice->vertex_capacity / 4 + 1;
    const bool sparse = lattice->leaf_row != NULL && lattice->vertex_capacity < cells;
    blades->hit_most = most < 3 * cells ? most : 3 * cells;
    blades->place_most = sparse ? lattice->vertex_capacity : cells;
    const int most_met = sparse && 2 * lattice->vertex_capacity < 3 * cells
                             ? 2 * lattice->vertex_capacity
                             : 3 * cells;
    link_finder_create(&blades->links, 3 * cells, most_met, name, arena);
    // Bricks are the windows of level 0, which come first.
    while (blades->brick_count < lattice->window_count &&
           lattice->window[blades->brick_count].level == 0)
        blades->brick_count++;
    blades->hit = arena_allocate(arena, ARENA_CONTACT, (size_t)blades->hit_most,
                                 sizeof *blades->hit, "%s/hits", name);
    if (!sparse)
        blades->beyond = arena_allocate(arena, ARENA_CONTACT, (size_t)cells, sizeof *blades->beyond,
                                        "%s/cells beyond", name);
    for (int cell = 0; cell < cells && !sparse; cell++)
        for (int axis = 0; axis < 3; axis++)
            blades->beyond[cell][axis] = cut_lattice_beyond(lattice, cell, axis);
    create_scratch(blades, name, sparse, arena);
    const int larger = lattice->element_count - cells;
    if (lattice->adapts && larger > 0)
        blades->larger =
            ALLOCATE(ARENA_CONTACT, larger < lattice->most_larger ? larger : lattice->most_larger,
                     int, "larger elements met");
    blades->vertex_code =
        ALLOCATE(ARENA_CONTACT, lattice->vertex_capacity, unsigned short, "codes of vertices");
    if (!sparse)
        blades->near_code = ALLOCATE(ARENA_CONTACT, cells, unsigned short, "codes of elements");
    blades->brick = ALLOCATE(ARENA_CONTACT, blades->brick_count, int, "bricks near");
}

void cut_blades_want_crossings(CutBlades *blades, const char *name, Arena *arena)
{
    blades->crossing = ALLOCATE(ARENA_CONTACT, blades->hit_most, CutCrossing, "crossings of hits");
}

void cut_blades_reserve(CutBlades *blades, const char *name, int count, Arena *arena,
                        StateList *state)
{
    const size_t cells = (size_t)blades->cell_count, bricks = (size_t)blades->brick_count;
    blades->blade_count = count;
    blades->blade = ALLOCATE(ARENA_CONTACT, count, BladeMemory, "blades");
    for (int k = 0; k < count; k++) {
        BladeMemory *memory = &blades->blade[k];
        memory->stroke = ALLOCATE(ARENA_CONTACT, 1, BladeStroke, "stroke");
        memory->centre = arena_allocate(arena, ARENA_CONTACT, cells, sizeof *memory->centre,
                                        "%s/centres by blade", name);
        memory->stamp = ALLOCATE(ARENA_CONTACT, cells, int, "stamps by blade");
        memory->box = ALLOCATE(ARENA_CONTACT, bricks, BladeBox, "boxes by blade");
        state_add(state, memory->stroke, sizeof *memory->stroke, "%s/blade%d/stroke", name, k);
        state_add(state, memory->centre, cells * sizeof *memory->centre, "%s/blade%d/centres", name,
                  k);
        state_add(state, memory->stamp, cells * sizeof *memory->stamp, "%s/blade%d/stamps", name,
                  k);
        state_add(state, memory->box, bricks * sizeof *memory->box, "%s/blade%d/boxes", name, k);
    }
}

void cut_blades_follow(CutBlades *blades)
{
    if (blades->lattice->changes.merged_count == 0)
        return;
    for (int k = 0; k < blades->blade_count; k++)
        if (blades->blade[k].stroke->under_way)
            blades->blade[k].stroke->travel += CUT_MERGE_RESIDUAL * blades->size;
}

void cut_blades_forget(CutBlades *blades)
{
    for (int k = 0; k < blades->blade_count; k++)
        *blades->blade[k].stroke = (BladeStroke){.under_way = 0};
}

void cut_blades_restored(CutBlades *blades)
{
    for (int k = 0; k < blades->blade_count; k++) {
        BladeStroke *stroke = blades->blade[k].stroke;
        bool good = stroke->under_way == 1 && stroke->now > 0 && stroke->now < INT_MAX / 2 &&
                    (stroke->fresh == 0 || stroke->fresh == 1);
        for (int i = 0; i < 6; i++) {
            const int64_t x = stroke->edge[i / 3].x[i % 3];
            good &= x < CUT_REACH / 2 && x > -CUT_REACH / 2;
        }
        if (!good)
            *stroke = (BladeStroke){.under_way = 0};
        for (int c = 0; c < blades->cell_count; c++)
            for (int d = 0; d < 3; d++) {
                int *x = &blades->blade[k].centre[c][d];
                *x = *x > 1 << 30 ? 1 << 30 : *x < -(1 << 30) ? -(1 << 30) : *x;
            }
    }
}
