// SPDX-License-Identifier: MIT
// Counts cells, in integers: what is attached, cut off and removed adds up exactly.
#include "voxel/cut/cut_account.h"

#include "base/check.h"
#include "base/sets.h"
#include "geometry/nearest.h"
#include "voxel/model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// Tissue

// True if a piece has more of what is fixed than another, or as much and more cells, or as many and
// begins before it.
static bool is_before(const CutAccount *account, int piece, int other)
{
    const CutPieces *pieces = account->pieces;
    const int a = pieces->first[piece], b = pieces->first[other];
    if (account->sum[piece] != account->sum[other])
        return account->sum[piece] > account->sum[other];
    return pieces->size[piece] != pieces->size[other] ? pieces->size[piece] > pieces->size[other]
                                                      : a < b;
}

// Finds the main piece; -1: nothing is left.
static int find_main(const CutAccount *account)
{
    int best = -1;
    for (int n = 0; n < (int)*account->pieces->count; n++)
        if (account->pieces->first[n] >= 0 && (best < 0 || is_before(account, n, best)))
            best = n;
    return best;
}

static double cell_volume(const CutAccount *account)
{
    return account->size * account->size * account->size;
}

int cut_account_tissues(const CutAccount *account, TissueAccount *to, int capacity)
{
    const double cell = cell_volume(account);
    for (int m = 0; m < account->tissue_count && m < capacity; m++) {
        to[m] = account->tissues[m];
        const int64_t gone = account->gone != NULL ? account->gone[m] : 0;
        to[m].attached = (double)account->attached[m] * cell;
        to[m].cut_off = (double)(account->at_load[m] - account->attached[m] - gone) * cell;
        to[m].removed = (double)gone * cell;
        if (account->coagulated != NULL)
            to[m].coagulated = account->coagulated[m] * cell;
    }
    return account->tissue_count;
}

// Writes what was opened from the counts.
static void publish(CutAccount *account)
{
    const double unit = account->size * account->size / CROSSING_UNIT;
    account->sections.cut = (double)account->section[ACCOUNT_CUT] * unit;
    account->sections.torn = (double)account->section[ACCOUNT_TEAR] * unit;
    account->sections.visits = 0;
    for (int r = 0; r < account->sections.region_count; r++) {
        const CutAccountRegion *from = &account->region[r];
        account->regions[r] =
            (RegionAccount){.distance = from->nearest > 0.0 ? (from->nearest - 1.0) * account->size
                                                            : (double)INFINITY,
                            .cause = (AccountCause)from->cause,
                            .touched = from->touched != 0,
                            .visits = from->visits};
        account->sections.visits += from->visits;
    }
    account->version++;
}

const BodySections *cut_account_sections(CutAccount *account)
{
    // What coagulates is no change that anybody tells.
    uint64_t version = (uint64_t)account->version;
    for (int m = 0; account->coagulated != NULL && m < account->tissue_count; m++)
        version = version * 1000003u + (uint64_t)account->coagulated[m];
    account->sections.version = (int64_t)version;
    return &account->sections;
}

static int tissue_of(const CutAccount *account, int cell)
{
    return account->pieces->lattice->element[cell].material - 1;
}

void cut_account_count(CutAccount *account)
{
    const CutPieces *pieces = account->pieces;
    memset(account->sum, 0, (size_t)*pieces->count * sizeof *account->sum);
    for (int k = 0; k < account->held_count; k++)
        if (!cut_lattice_is_gone(pieces->lattice, account->held[k].cell))
            account->sum[cut_pieces_of(pieces, account->held[k].cell)] += account->held[k].corners;
    account->main_piece = find_main(account);
    memset(account->attached, 0, (size_t)account->tissue_count * sizeof *account->attached);
    for (int c = 0; c < pieces->cell_count; c++)
        if (account->main_piece >= 0 && cut_pieces_of(pieces, c) == account->main_piece)
            account->attached[tissue_of(account, c)]++;
    publish(account);
}

// ---------------------------------------------------------------------------------------------
// Regions

static Vec3 world_of(const CutAccount *account, const double point[3])
{
    Vec3 x = account->origin;
    for (int d = 0; d < 3; d++)
        x = vec3_madd(x, point[d], account->along[d]);
    return x;
}

// Returns how far a point is outside of a box or sphere [m]; 0 inside.
static double outside(const FixedRegion *region, Vec3 x)
{
    if (region->kind == FIXED_SPHERE)
        return fmax(0.0, vec3_length(vec3_sub(x, region->center)) - region->radius);
    const Vec3 low = vec3_sub(region->low, x), high = vec3_sub(x, region->high);
    const Vec3 gap = {fmax(0.0, fmax(low.x, high.x)), fmax(0.0, fmax(low.y, high.y)),
                      fmax(0.0, fmax(low.z, high.z))};
    return vec3_length(gap);
}

static double between(const CutLattice *lattice, const double point[3], int cell)
{
    const short *at = lattice->element[cell].cell;
    double sum = 0.0;
    for (int d = 0; d < 3; d++)
        sum += (point[d] - at[d] - 0.5) * (point[d] - at[d] - 0.5);
    return sqrt(sum);
}

// Returns how far a point of a link is from a region [cells]. The surface of cells is half a cell
// from their centres, within half a cell wherever their tissue ends in truth.
static double distance_of(const CutAccount *account, int r, const double point[3], int cell,
                          int beyond, bool *touched)
{
    const int *nearest = account->nearest[r];
    if (nearest == NULL) {
        const double d = outside(&account->watch[r].region, world_of(account, point));
        *touched = d == 0.0;
        return d / account->size;
    }
    const CutLattice *lattice = account->pieces->lattice;
    const double gap =
        fmin(between(lattice, point, nearest[cell]), between(lattice, point, nearest[beyond])) -
        0.5;
    // Also in the half of a link that is the region's: cells of a thin vessel may share no face.
    *touched = gap < 0.0 || (nearest[cell] == cell && nearest[beyond] == beyond);
    return *touched ? 0.0 : gap;
}

static void note(CutAccountRegion *region, AccountCause cause, double distance, bool touched)
{
    const bool first = touched && region->touched == 0;
    region->touched |= touched;
    if (!first && region->nearest > 0.0 && distance + 1.0 >= region->nearest)
        return;
    region->nearest = distance + 1.0;
    region->cause = cause;
}

static void approach(CutAccount *account, AccountCause cause, const int face[2], double along)
{
    const CutLattice *lattice = account->pieces->lattice;
    const int cell = face[0], axis = face[1];
    const int beyond = cut_lattice_beyond(lattice, cell, axis);
    double point[3];
    for (int d = 0; d < 3; d++)
        point[d] = lattice->element[cell].cell[d] + 0.5 + (d == axis ? along : 0.0);
    for (int r = 0; r < account->sections.region_count; r++) {
        bool touched;
        if (account->watch[r].material < 0)
            continue;
        const double distance = distance_of(account, r, point, cell, beyond, &touched);
        note(&account->region[r], cause, distance, touched);
    }
}

void cut_account_break(CutAccount *account, AccountCause cause, const int (*face)[2],
                       const CutCrossing *crossing, int count)
{
    for (int f = 0; f < count; f++) {
        const CutCrossing *met = crossing != NULL ? &crossing[f] : NULL;
        account->section[cause] += met != NULL ? abs(met->normal[face[f][1]]) : CROSSING_UNIT;
        approach(account, cause, face[f], met != NULL ? (double)met->along / CROSSING_ALONG : 0.5);
    }
    publish(account);
}

// Notes that a cell goes. Its walls are half a cell around its centre.
static void approach_cell(CutAccount *account, int cell)
{
    const CutLattice *lattice = account->pieces->lattice;
    double point[3];
    for (int d = 0; d < 3; d++)
        point[d] = lattice->element[cell].cell[d] + 0.5;
    for (int r = 0; r < account->sections.region_count; r++) {
        bool touched;
        if (account->watch[r].material < 0)
            continue;
        const double distance = distance_of(account, r, point, cell, cell, &touched) - 0.5;
        note(&account->region[r], ACCOUNT_REMOVAL, fmax(0.0, distance), touched);
    }
}

void cut_account_remove(CutAccount *account, const int *cell, int count)
{
    const CutPieces *pieces = account->pieces;
    for (int k = 0; k < count; k++) {
        const int piece = cut_pieces_of(pieces, cell[k]);
        const HeldCell *held = bsearch(&cell[k], account->held, (size_t)account->held_count,
                                       sizeof *held, compare_ints);
        account->sum[piece] -= held != NULL ? held->corners : 0;
        if (piece == account->main_piece)
            account->attached[tissue_of(account, cell[k])]--;
        approach_cell(account, cell[k]);
    }
}

void cut_account_follow(CutAccount *account, bool came)
{
    // Another piece may have more of what is fixed now.
    if (came || find_main(account) != account->main_piece)
        cut_account_count(account);
    else
        publish(account);
}

// Returns the cell at a place at rest, also if it is gone; -1: void.
static int cell_at(const CutAccount *account, Vec3 place)
{
    const CutLattice *lattice = account->pieces->lattice;
    const Vec3 from = vec3_sub(place, account->origin);
    int at[3];
    for (int d = 0; d < 3; d++) {
        const double cells = vec3_dot(from, account->along[d]) / (account->size * account->size);
        if (!(cells >= 0.0 && cells < lattice->count[d]))
            return -1;
        at[d] = (int)cells;
    }
    const int *n = lattice->count;
    return lattice->lut[0][((long)at[2] * n[1] + at[1]) * n[0] + at[0]];
}

// Returns where the tissue at a place is at rest, by the motion of what is at rest there.
static Vec3 rest_of(const CutAccount *account, const Rows *rows, const void *row, Vec3 place)
{
    const CutLattice *lattice = account->pieces->lattice;
    Vec3 rest = place;
    for (int turn = 0; turn < 2; turn++) {
        const int cell = cell_at(account, rest);
        if (cell < 0 || cut_lattice_is_gone(lattice, cell))
            break;
        const int vertex = cut_lattice_nodes(lattice, cut_lattice_leaf_of(lattice, cell))[0];
        Vec3 now, velocity;
        rows_read(rows, row, vertex, &now, &velocity);
        rest = vec3_sub(place, vec3_sub(now, rows_rest(rows, vertex)));
    }
    return rest;
}

void cut_account_visit(CutAccount *account, const Rows *rows, const void *row, Vec3 place)
{
    const Vec3 rest = rest_of(account, rows, row, place);
    const int cell = cell_at(account, rest);
    for (int r = 0; r < account->sections.region_count; r++) {
        const WatchedRegion *watch = &account->watch[r];
        const bool inside = watch->material == 0
                                ? fixed_contains(&watch->region, rest)
                                : cell >= 0 && tissue_of(account, cell) == watch->material - 1;
        account->region[r].visits += inside;
        account->regions[r].visits += inside;
        account->sections.visits += inside;
    }
}

void cut_account_derive(CutAccount *account)
{
    // From any file: numbers that no account has are as good as none.
    for (int c = 0; c < ACCOUNT_CAUSES; c++)
        if (account->section[c] < 0 || account->section[c] > INT64_MAX / 2)
            account->section[c] = 0;
    for (int r = 0; r < account->sections.region_count; r++) {
        CutAccountRegion *region = &account->region[r];
        if (region->visits < 0 || region->visits > INT64_MAX / 256)
            region->visits = 0;
        if (!(region->nearest >= 1.0 && isfinite(region->nearest)) ||
            region->cause <= ACCOUNT_NOTHING || region->cause >= ACCOUNT_CAUSES)
            *region = (CutAccountRegion){.nearest = 0.0, .visits = region->visits};
    }
    cut_account_count(account);
}

// ---------------------------------------------------------------------------------------------
// Creation, at load

static const char *keep_name(const char *tissue, const char *name, Arena *arena)
{
    const size_t size = strlen(tissue) + 1;
    char *copy = ALLOCATE(ARENA_OUTPUT, size, char, "tissue");
    memcpy(copy, tissue, size);
    return copy;
}

static void create_tissues(CutAccount *account, const VoxelMaking *making, const char *name,
                           Arena *arena)
{
    const VoxelOptions *options = making->options;
    const CutPieces *pieces = account->pieces;
    const int count = options->material_count;
    account->at_load = ALLOCATE(ARENA_OUTPUT, count, int64_t, "cells by tissue");
    account->attached = ALLOCATE(ARENA_OUTPUT, count, int64_t, "cells attached");
    for (int c = 0; c < pieces->cell_count; c++)
        account->at_load[tissue_of(account, c)]++;
    account->tissues = ALLOCATE(ARENA_OUTPUT, count, TissueAccount, "tissue accounts");
    for (int m = 0; m < count; m++) {
        const char *tissue = options->tissue != NULL ? options->tissue[m] : name;
        account->tissues[m] =
            (TissueAccount){.name = keep_name(tissue, name, arena),
                            .density = options->material[m].density,
                            .at_load = (double)account->at_load[m] * cell_volume(account)};
    }
    account->tissue_count = count;
}

// Lists the cells that have fixed corners.
static void hold_cells(CutAccount *account, const unsigned char *held, const char *name,
                       Arena *arena)
{
    const CutLattice *lattice = account->pieces->lattice;
    const int *n = lattice->lattice_count, cells = account->pieces->cell_count;
    for (int pass = 0; pass < 2; pass++) { // counts, then lists
        account->held_count = 0;
        for (int c = 0; c < cells; c++) {
            int corners = 0;
            for (int corner = 0; corner < 8; corner++) {
                const short *at = lattice->element[c].cell;
                const long point =
                    ((long)(at[2] + (corner >> 2)) * (n[1] + 1) + at[1] + (corner >> 1 & 1)) *
                        (n[0] + 1) +
                    at[0] + (corner & 1);
                // Seen from the point, the cell is in the opposite slot.
                corners += held[point] >> (7 - corner) & 1;
            }
            if (corners > 0 && pass == 1)
                account->held[account->held_count] = (HeldCell){c, corners};
            account->held_count += corners > 0;
        }
        if (pass == 0)
            account->held = ALLOCATE(ARENA_OUTPUT, account->held_count, HeldCell, "fixed cells");
    }
}

// Finds for each cell the nearest one of a material.
static void find_nearest(const CutAccount *account, int material, int *to)
{
    const CutLattice *lattice = account->pieces->lattice;
    const int *n = lattice->count, *cell = lattice->lut[0];
    const size_t blocks = (size_t)n[0] * (size_t)n[1] * (size_t)n[2];
    bool *marked = malloc(blocks * sizeof *marked);
    int *nearest = malloc(blocks * sizeof *nearest);
    ASSERT(marked != NULL && nearest != NULL);
    for (size_t b = 0; b < blocks; b++)
        marked[b] = cell[b] >= 0 && tissue_of(account, cell[b]) == material;
    nearest_marked(n, marked, nearest);
    for (size_t b = 0; b < blocks; b++)
        if (cell[b] >= 0)
            to[cell[b]] = cell[nearest[b]];
    free(marked);
    free(nearest);
}

static void create_regions(CutAccount *account, const VoxelMaking *making, const char *name,
                           Arena *arena, StateList *state)
{
    const BodyOptions *options = &making->options->body;
    const int count = options->watch_count, cells = account->pieces->cell_count;
    if (count == 0)
        return;
    WatchedRegion *watch = ALLOCATE(ARENA_OUTPUT, count, WatchedRegion, "regions");
    account->nearest = ALLOCATE(ARENA_OUTPUT, count, int *, "nearest cells by region");
    for (int r = 0; r < count; r++) {
        watch[r] = options->watch[r];
        const int material = watch[r].material - 1;
        if (material < 0)
            continue;
        if (material >= account->tissue_count || account->at_load[material] == 0) {
            watch[r].material = -1;
            continue;
        }
        account->nearest[r] = ALLOCATE(ARENA_OUTPUT, cells, int, "nearest cells of a region");
        find_nearest(account, material, account->nearest[r]);
    }
    account->watch = watch;
    account->region = ALLOCATE(ARENA_OUTPUT, count, CutAccountRegion, "distances");
    account->regions = ALLOCATE(ARENA_OUTPUT, count, RegionAccount, "region accounts");
    account->sections.region_count = count;
    account->sections.region = account->regions;
    state_add_shown(state, account->region, (size_t)count * sizeof *account->region, "%s/distances",
                    name);
}

void cut_account_create(CutAccount *account, const CutPieces *pieces, const VoxelMaking *making,
                        const unsigned char *held, Arena *arena, StateList *state)
{
    const char *name = making->options->body.name;
    const Lattice *lattice = making->options->lattice;
    *account = (CutAccount){.pieces = pieces, .size = lattice->size};
    account->origin = lattice_point(lattice, 0.0, 0.0, 0.0);
    for (int d = 0; d < 3; d++)
        account->along[d] =
            vec3_sub(lattice_point(lattice, d == 0, d == 1, d == 2), account->origin);
    create_tissues(account, making, name, arena);
    hold_cells(account, held, name, arena);
    account->sum = ALLOCATE(ARENA_OUTPUT, pieces->most, int, "fixed corners of pieces");
    account->section = ALLOCATE(ARENA_OUTPUT, ACCOUNT_CAUSES, int64_t, "sections");
    state_add_shown(state, account->section, ACCOUNT_CAUSES * sizeof *account->section,
                    "%s/sections", name);
    create_regions(account, making, name, arena, state);
    cut_account_count(account);
}
