// Finds the faces that a blade's motion breaks.
#include "base/check.h"
#include "voxel/cut/cut_blade_parts.h"

#include <limits.h>
#include <math.h>
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

// Clears the marks; the list stays.
static void clear_marks(CutBlades *blades)
{
    for (int h = 0; h < blades->hit_count; h++)
        blades->hit_bits[blades->hit[h][0]] = 0;
}

static bool answer(CutBlades *blades, CutVerdict verdict, CutOutcome *outcome)
{
    clear_marks(blades);
    if (verdict != CUT_DONE)
        blades->hit_count = 0;
    outcome->verdict = verdict;
    outcome->separated = blades->hit_count;
    return verdict == CUT_DONE;
}

static void forget_boxes(const CutBlades *blades, BladeMemory *memory)
{
    for (int b = 0; b < blades->brick_count; b++)
        memory->box[b].made = -1.0;
}

static bool sweep_whole(CutBlades *blades, const void *row, const CutSweep *sweep,
                        CutOutcome *outcome)
{
    BladeSearch search = {.blades = blades, .memory = &blades->whole, .whole = true};
    const int parts = cut_subticks(sweep, TWIST_TOLERANCE * blades->size);
    CutPoint from[2], to[2];
    if (!cut_quantise_edge(&sweep->before, blades->rows->rest_origin, blades->q, from) ||
        !cut_quantise_edge(&sweep->after, blades->rows->rest_origin, blades->q, to))
        return answer(blades, CUT_TOO_LARGE, outcome);
    if (parts == 0)
        return answer(blades, CUT_TOO_TWISTED, outcome);
    // A command knows nothing of earlier positions: every cell is new.
    memset(blades->whole.stamp, 0, (size_t)blades->cell_count * sizeof *blades->whole.stamp);
    search.now = 1, search.was = -1;
    cut_centres_begin(&search.centres, blades->lattice, blades->rows, row);
    const CutPath base[2] = {{{from[0], to[0]}}, {{from[1], to[1]}}};
    // A flat sweep is tested by codes of all cells, a twisted one by boxes of bricks.
    search.coded = parts == 1;
    if (search.coded) {
        cut_sweep_set_edge(&search, base);
        cut_near_find_codes(&search);
    } else {
        forget_boxes(blades, &blades->whole);
        cut_near_find_bricks(&search, from, to);
    }
    int64_t tries = 0;
    if (!cut_sweep_parts(&search, base, from, true, &tries, parts))
        return answer(blades, CUT_UNRESOLVED, outcome);
    if (search.lost)
        return answer(blades, CUT_TOO_LARGE, outcome);
    const bool any = blades->hit_count > 0;
    return answer(blades,
                  any                 ? CUT_DONE
                  : search.met_broken ? CUT_WAS_CUT
                                      : CUT_MET_NOTHING,
                  outcome);
}

// Begins the stroke at the current edge. False: the edge or a cell is out of range.
static bool begin_stroke(CutBlades *blades, const void *row, BladeMemory *memory,
                         const BladeEdge *edge)
{
    BladeStroke *stroke = memory->stroke;
    CutPoint ends[2];
    *stroke = (BladeStroke){.under_way = 0};
    if (!cut_quantise_edge(edge, blades->rows->rest_origin, blades->q, ends))
        return false;
    memcpy(stroke->edge, ends, sizeof stroke->edge);
    memset(memory->stamp, 0, (size_t)blades->cell_count * sizeof *memory->stamp);
    stroke->under_way = stroke->fresh = stroke->now = 1;
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

static bool go_on(CutBlades *blades, const void *row, double tick, const CutSweep *sweep,
                  BladeMemory *memory, CutOutcome *outcome)
{
    BladeStroke *stroke = memory->stroke;
    const int parts = cut_subticks(sweep, TWIST_TOLERANCE * blades->size);
    CutPoint to[2];
    CutVerdict verdict = CUT_MET_NOTHING;
    if (parts == 0)
        verdict = CUT_TOO_TWISTED;
    else if (!cut_quantise_edge(&sweep->after, blades->rows->rest_origin, blades->q, to))
        verdict = CUT_TOO_LARGE;
    // Find the bricks near the sweep, then the cells there, before any link is tested.
    if (verdict == CUT_MET_NOTHING) {
        BladeSearch search = {.blades = blades, .memory = memory};
        search.was = (int)stroke->now;
        search.now = (int)++stroke->now;
        cut_centres_begin(&search.centres, blades->lattice, blades->rows, row);
        cut_near_note_motion(&search, tick, row);
        cut_near_find_bricks(&search, stroke->edge, to);
        look_at_bricks(&search);
        int64_t *tries = &sweep->stroke->tries;
        CutPath base[2];
        // The edge continues from where it was used last, so its shift there is already included.
        for (int e = 0; e < 2; e++) {
            const CutPoint shift = cut_shift(*tries, e);
            base[e] = (CutPath){{stroke->edge[e], to[e]}};
            for (int c = 0; c < 3 && !stroke->fresh; c++)
                base[e].at[0].x[c] -= shift.x[c];
        }
        if (search.lost)
            verdict = CUT_TOO_LARGE;
        else if (!cut_sweep_parts(&search, base, stroke->edge, stroke->fresh != 0, tries, parts))
            verdict = CUT_UNRESOLVED;
        else if (blades->hit_count > 0)
            verdict = CUT_DONE;
        stroke->fresh = 0;
    }
    // After a failure the stroke begins again at the current edge.
    if (verdict != CUT_DONE && verdict != CUT_MET_NOTHING)
        begin_stroke(blades, row, memory, &sweep->after);
    return answer(blades, verdict, outcome);
}

bool cut_blades_find(CutBlades *blades, const void *row, double tick, const CutSweep *sweep,
                     CutOutcome *outcome)
{
    blades->hit_count = 0;
    if (sweep->phase == CUT_WHOLE)
        return sweep_whole(blades, row, sweep, outcome);
    ASSERT(sweep->blade >= 0 && sweep->blade < blades->blade_count);
    BladeMemory *memory = &blades->blade[sweep->blade];
    bool within = true;
    if (sweep->phase == CUT_ENDS)
        *memory->stroke = (BladeStroke){.under_way = 0};
    else if (sweep->phase == CUT_BEGINS)
        within = begin_stroke(blades, row, memory, &sweep->after);
    else if (memory->stroke->under_way || begin_stroke(blades, row, memory, &sweep->before))
        return go_on(blades, row, tick, sweep, memory, outcome);
    else
        within = false;
    return answer(blades, within ? CUT_MET_NOTHING : CUT_TOO_LARGE, outcome);
}

void cut_blades_refused(CutBlades *blades, const void *row, const CutSweep *sweep)
{
    blades->hit_count = 0;
    if (sweep->phase == CUT_GOES_ON)
        begin_stroke(blades, row, &blades->blade[sweep->blade], &sweep->after);
}

// ---------------------------------------------------------------------------------------------
// Load time

void cut_blades_create(CutBlades *blades, const char *name, const CutLattice *lattice,
                       const Rows *rows, double size, Arena *arena)
{
    const int cells = lattice->level_first[1];
    *blades = (CutBlades){.lattice = lattice, .rows = rows, .size = size, .cell_count = cells};
    blades->q = size / PARTS_OF_CELL;
    while (blades->brick_count < lattice->window_count &&
           lattice->window[blades->brick_count].level == 0)
        blades->brick_count++;
    blades->hit = arena_allocate(arena, ARENA_CONTACT, 3 * (size_t)cells, sizeof *blades->hit,
                                 "%s/hits", name);
    blades->beyond = arena_allocate(arena, ARENA_CONTACT, (size_t)cells, sizeof *blades->beyond,
                                    "%s/cells beyond", name);
    for (int cell = 0; cell < cells; cell++)
        for (int axis = 0; axis < 3; axis++)
            blades->beyond[cell][axis] = cut_lattice_beyond(lattice, cell, axis);
    blades->hit_bits = ALLOCATE(ARENA_CONTACT, cells, unsigned char, "hit faces");
    blades->whole.centre = arena_allocate(arena, ARENA_CONTACT, (size_t)cells,
                                          sizeof *blades->whole.centre, "%s/centres", name);
    blades->whole.stamp = ALLOCATE(ARENA_CONTACT, cells, int, "stamps of centres");
    blades->whole.box = ALLOCATE(ARENA_CONTACT, blades->brick_count, BladeBox, "boxes of bricks");
    blades->before = arena_allocate(arena, ARENA_CONTACT, (size_t)cells, sizeof *blades->before,
                                    "%s/centres before", name);
    blades->code_stamp = ALLOCATE(ARENA_CONTACT, cells, int, "stamps of codes");
    blades->code = ALLOCATE(ARENA_CONTACT, cells, unsigned char, "codes");
    blades->vertex_code =
        ALLOCATE(ARENA_CONTACT, lattice->vertex_capacity, unsigned short, "codes of vertices");
    blades->near_code = ALLOCATE(ARENA_CONTACT, cells, unsigned short, "codes of elements");
    blades->brick = ALLOCATE(ARENA_CONTACT, blades->brick_count, int, "bricks near");
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
