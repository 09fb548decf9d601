// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_remove.h"

#include "base/check.h"
#include "voxel/cut/cut_body.h"
#include "voxel/cut/cut_near.h"
#include "voxel/cut/cut_parts.h"
#include "voxel/lattice_faces.h"

#include <math.h>
#include <string.h>

// A burr takes cells that it touches: those whose centre is within half their diagonal, in edges of
// a cell. With less it rests on corners of cells that it does not take, and pushes soft tissue away
// instead: with half a cell it took 79 of the 470 mm3 in its way through a brain's ventricle.
static const double BURR_REACH = 0.87;

// ---------------------------------------------------------------------------------------------
// What is within reach

static void forget(CutReach *reach, int bricks)
{
    *reach->memory.stroke = (BladeStroke){.now = 0};
    for (int b = 0; b < bricks; b++)
        reach->memory.box[b].made = -1.0;
}

void cut_reach_create(CutReach *reach, const char *name, const CutBlades *blades, Arena *arena,
                      StateList *state)
{
    const size_t bricks = (size_t)blades->brick_count, faces = 6 * (size_t)CUT_REMOVE_MOST;
    BladeMemory *memory = &reach->memory;
    memory->stroke = ALLOCATE(ARENA_CONTACT, 1, BladeStroke, "search of removers");
    memory->box = ALLOCATE(ARENA_CONTACT, bricks, BladeBox, "boxes of removers");
    reach->face =
        arena_allocate(arena, ARENA_CONTACT, faces, sizeof *reach->face, "%s/faces that go", name);
    reach->crossing = ALLOCATE(ARENA_CONTACT, faces, CutCrossing, "crossings that go");
    reach->divided = -1;
    forget(reach, (int)bricks);
    state_add(state, memory->stroke, sizeof *memory->stroke, "%s/remover/search", name);
    state_add(state, memory->box, bricks * sizeof *memory->box, "%s/remover/boxes", name);
}

void cut_reach_restored(CutReach *reach)
{
    reach->divided = -1;
    if (!(reach->memory.stroke->travel >= 0.0 && isfinite(reach->memory.stroke->travel)))
        reach->memory.stroke->now = 0; // begins anew
}

// Begins a search at the current rows. Boxes are kept from one tick to the next.
static BladeSearch begin_search(VoxelCuts *cuts, const Body *body, const void *row)
{
    BladeSearch search = {.blades = &cuts->blades, .memory = &cuts->reach->memory};
    BladeStroke *stroke = search.memory->stroke;
    const int64_t now = body->step + 1;
    cut_centres_begin(&search.centres, &cuts->lattice, cuts->blades.rows, row);
    if (stroke->now != now && stroke->now != now - 1)
        forget(cuts->reach, cuts->blades.brick_count);
    if (stroke->now != now)
        cut_near_note_motion(&search, body->h * body->substeps, row);
    stroke->now = now;
    search.travel = stroke->travel;
    search.margin = 0.0;
    return search;
}

// Returns the vector to a point from the nearest one of a capsule's axis.
static Vec3 way_from(const Region *mouth, Vec3 x)
{
    const Vec3 axis = vec3_sub(mouth->to, mouth->from), d = vec3_sub(x, mouth->from);
    const double square = vec3_dot(axis, axis);
    const double t = square > 0.0 ? fmin(fmax(vec3_dot(d, axis) / square, 0.0), 1.0) : 0.0;
    return vec3_madd(d, -t, axis);
}

// Lists a cell by its distance, the first found of equal ones first.
static void list_cell(CutReach *reach, int most, int cell, double distance)
{
    reach->any = true;
    if (most == 0 || (reach->count == most && !(distance < reach->distance[most - 1])))
        return;
    int k = reach->count < most ? reach->count++ : most - 1;
    for (; k > 0 && reach->distance[k - 1] > distance; k--) {
        reach->distance[k] = reach->distance[k - 1];
        reach->cell[k] = reach->cell[k - 1];
    }
    reach->distance[k] = distance;
    reach->cell[k] = cell;
}

// Lists the cells nearest to the axis of a capsule, at most `most`.
static void find_cells(VoxelCuts *cuts, const Body *body, const void *row, const Region *mouth,
                       int most)
{
    CutReach *reach = cuts->reach;
    const CutBlades *blades = &cuts->blades;
    BladeSearch search = begin_search(cuts, body, row);
    reach->count = 0;
    reach->any = false;
    // The bricks that meet the capsule's box.
    const Vec3 r = {mouth->radius, mouth->radius, mouth->radius};
    const LinkFinder *links = &blades->links;
    CutPoint low[2], high[2];
    const BladeEdge below = {{vec3_sub(mouth->from, r), vec3_sub(mouth->to, r)}},
                    above = {{vec3_add(mouth->from, r), vec3_add(mouth->to, r)}};
    if (!cut_quantise_edge(&below, links->origin, links->q, low) ||
        !cut_quantise_edge(&above, links->origin, links->q, high))
        return; // far away
    cut_near_find_bricks(&search, low, high);
    for (int k = 0; k < search.brick_count; k++) {
        const CutWindow *brick = &cuts->lattice.window[blades->brick[k]];
        for (int cell = brick->first; cell < brick->end; cell++) {
            if (cut_lattice_is_gone(&cuts->lattice, cell))
                continue;
            const double distance = vec3_length(way_from(mouth, cut_centre(&search.centres, cell)));
            if (distance <= mouth->radius)
                list_cell(reach, most, cell, distance);
        }
    }
}

// ---------------------------------------------------------------------------------------------
// Taking cells away

// A function of the counts alone, so that it does not depend on the order.
static void weigh(const VoxelCuts *cuts, Body *body)
{
    body->mass = cuts->mass_at_load;
    for (int m = 0; m < cuts->masses.material_count; m++)
        body->mass -= cuts->gone[m] * cuts->masses.mass[m];
}

void cut_body_count_gone(VoxelCuts *cuts, Body *body)
{
    const CutLattice *lattice = &cuts->lattice;
    const CutMasses *masses = &cuts->masses;
    memset(cuts->gone, 0, (size_t)masses->material_count * sizeof *cuts->gone);
    cuts->present = 0;
    for (int cell = 0; cell < lattice->level_first[1]; cell++) {
        const bool gone = cut_lattice_is_gone(lattice, cell);
        cuts->present += !gone;
        cuts->gone[lattice->element[cell].material - 1] += gone;
    }
    weigh(cuts, body);
}

// Adds what leaves with a cell.
static void add_cell(const VoxelCuts *cuts, const void *row, int cell, RemovalOutcome *outcome)
{
    const double mass = cuts->masses.mass[cuts->lattice.element[cell].material - 1];
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int c = 0; c < NODE_CORNERS; c++) {
        Vec3 position, velocity;
        rows_read(cuts->blades.rows, row, cut_lattice_nodes(&cuts->lattice, cell)[c], &position,
                  &velocity);
        sum = vec3_add(sum, velocity);
    }
    outcome->removed++;
    outcome->volume += cuts->blades.size * cuts->blades.size * cuts->blades.size;
    outcome->mass += mass;
    outcome->momentum = vec3_madd(outcome->momentum, 0.125 * mass, sum);
}

// Keeps where the walls of cells that go are: where the mouth crosses the links to what stays.
static void keep_crossings(VoxelCuts *cuts, const void *row, const int *cell, int count,
                           const Region *mouth)
{
    const CutLattice *lattice = &cuts->lattice;
    CutReach *reach = cuts->reach;
    CellCentres centres;
    CrossGradients gradients = {.leaf = {0}};
    int faces = 0;
    cut_centres_begin(&centres, lattice, cuts->blades.rows, row);
    for (int k = 0; k < count; k++)
        for (int d = 0; d < SQUARE_DIRECTIONS; d++) {
            const int across = cut_lattice_across(lattice, cell[k], d), axis = d / 2;
            const int low = d & 1 ? cell[k] : across, high = d & 1 ? across : cell[k];
            if (across < 0 || (lattice->broken[low] >> axis & 1))
                continue;
            reach->face[faces][0] = low, reach->face[faces][1] = axis;
            CutCrossing *crossing = &reach->crossing[faces++];
            *crossing = cut_crossing_middle(axis);
            if (mouth == NULL)
                continue;
            const Vec3 x = cut_centre(&centres, low), y = cut_centre(&centres, high);
            const double from = vec3_length(way_from(mouth, x)) - mouth->radius,
                         to = vec3_length(way_from(mouth, y)) - mouth->radius;
            if ((from > 0.0) == (to > 0.0)) // both go, or it did not reach so far
                continue;
            const double along = from / (from - to);
            const Vec3 n = vec3_unit(way_from(mouth, vec3_madd(x, along, vec3_sub(y, x))));
            *crossing = cut_crossing_at(&centres, &gradients, along, n, low, axis);
        }
    cut_fit_keep(cuts->fit, (const int(*)[2])reach->face, reach->crossing, faces);
}

bool cut_body_take(Body *body, const int *cell, int count, const Region *mouth,
                   RemovalOutcome *outcome, TopologyChange *change)
{
    const VoxelModel *model = body->model;
    VoxelCuts *cuts = model->cuts;
    const void *row = vertices_row(&model->vertices);
    for (int k = 0; k < count; k++) {
        add_cell(cuts, row, cell[k], outcome);
        cuts->gone[cuts->lattice.element[cell[k]].material - 1]++;
    }
    cuts->present -= count;
    if (cuts->heat != NULL)
        cut_heat_remove(cuts->heat, cell, count);
    if (cuts->fit != NULL)
        keep_crossings(cuts, row, cell, count, mouth);
    cut_account_remove(&cuts->account, cell, count);
    cut_pieces_expect(&cuts->pieces, cell, count);
    cut_lattice_remove(&cuts->lattice, cell, count);
    const int added = cuts->lattice.changes.birth_count;
    const bool came = cut_pieces_remove(&cuts->pieces, cell, count);
    cut_account_follow(&cuts->account, came);
    const bool changed = cut_body_follow(cuts, body, false, came, change);
    weigh(cuts, body);
    outcome->verdict = CUT_DONE;
    outcome->nodes_added = added;
    outcome->pieces = cut_pieces_count(&cuts->pieces);
    outcome->small_pieces = cuts->pieces.small_count;
    return changed;
}

// ---------------------------------------------------------------------------------------------
// BodyOps.remove

// Returns how many cells may go: what the volume allows, but not the last one.
static int most_cells(const VoxelCuts *cuts, double volume)
{
    static const double ROUNDING = 1e-9; // of a sum of many ticks
    const double size = cuts->blades.size;
    const double cells = floor(volume / (size * size * size) + ROUNDING);
    const int most = cells < CUT_REMOVE_MOST ? (int)cells : CUT_REMOVE_MOST;
    return most < cuts->present ? most : cuts->present - 1;
}

static bool has_room(const VoxelCuts *cuts, int cells, RemovalOutcome *outcome)
{
    const CutLattice *lattice = &cuts->lattice;
    outcome->verdict = CUT_NO_NODES;
    outcome->needed = 16 * cells;
    outcome->room = cut_parts_room(lattice);
    if (!cut_lattice_has_room_to_remove(lattice, cells) ||
        !cut_pieces_have_room(&cuts->pieces, 6 * cells))
        return false;
    outcome->verdict = CUT_NO_FACES;
    return cut_faces_has_room_to_remove(&cuts->faces, cells, &outcome->needed, &outcome->room);
}

// Gives a tick's heat, the first time in it, and lists the cells that have boiled away.
static void heat_cells(VoxelCuts *cuts, const void *row, const Removal *removal,
                       RemovalOutcome *outcome)
{
    CutHeat *heat = cuts->heat;
    CutReach *reach = cuts->reach;
    if (removal->heat > 0.0)
        outcome->heat = cut_heat_give(heat, cuts->blades.rows, row, removal);
    outcome->coagulated = cut_heat_coagulated(heat);
    const int most = most_cells(cuts, removal->volume);
    reach->count = heat->boiled_count < most ? heat->boiled_count : most;
    memcpy(reach->cell, heat->boiled, (size_t)reach->count * sizeof *reach->cell);
    reach->any = outcome->heat > 0.0 || reach->count > 0;
}

bool cut_body_remove(Body *body, const Removal *removal, RemovalOutcome *outcome,
                     TopologyChange *change)
{
    const VoxelModel *model = body->model;
    VoxelCuts *cuts = model->cuts;
    CutReach *reach = cuts->reach;
    Region mouth = removal->mouth;
    *outcome = (RemovalOutcome){.verdict = CUT_MET_NOTHING};
    if (removal->kind == REMOVER_DRILL)
        mouth.radius += BURR_REACH * cuts->blades.size;
    if (removal->kind == REMOVER_DIATHERMY)
        heat_cells(cuts, vertices_row(&model->vertices), removal, outcome);
    else
        find_cells(cuts, body, vertices_row(&model->vertices), &mouth,
                   most_cells(cuts, removal->volume));
    if (!reach->any)
        return false;
    outcome->verdict = CUT_DONE;
    if (reach->count == 0) // the volume is less than a cell's
        return false;
    // Divisions first, once a tick: they keep momentum, and removals do not.
    const int budget = reach->divided == body->step ? 0 : cuts->lattice.split_budget;
    if (cut_lattice_expose(&cuts->lattice, reach->cell, &reach->count, budget) > 0) {
        reach->divided = body->step;
        const bool changed = cut_body_follow(cuts, body, true, false, change);
        change->again = true;
        return changed;
    }
    // As many as fit. What waits to be divided goes in a later tick, unless it does not fit.
    int count = reach->count;
    while (count > 1 && !has_room(cuts, count, outcome))
        count /= 2;
    if (count == 0 && reach->divided == body->step)
        return false;
    if (!has_room(cuts, count, outcome))
        return false;
    if (count == 0) {
        outcome->verdict = CUT_NO_NODES;
        return false;
    }
    outcome->verdict = CUT_DONE;
    outcome->needed = outcome->room = 0;
    const bool burr = removal->kind == REMOVER_DRILL;
    return cut_body_take(body, reach->cell, count, burr ? &mouth : NULL, outcome, change);
}
