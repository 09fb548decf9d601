// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_heat.h"

#include "base/check.h"
#include "voxel/cut/cut_shape.h"

#include <math.h>
#include <string.h>

enum { BITS = 64 };
#define BOILING (HEAT_BOILING - HEAT_BODY) // above the body [K]

static int material_of(const CutHeat *heat, int cell)
{
    return heat->lattice->element[cell].material - 1;
}

static double capacity_of(const CutHeat *heat, int cell)
{
    return heat->capacity[material_of(heat, cell)];
}

// Returns the temperature of a cell above the body [K].
static double excess(const CutHeat *heat, int cell, double capacity)
{
    return fmin(heat->energy[cell] / capacity, BOILING);
}

double cut_heat_temperature(const CutHeat *heat, int cell)
{
    return HEAT_BODY + excess(heat, cell, capacity_of(heat, cell));
}

// Returns the energy with which a cell has boiled away.
static double most_of(double capacity)
{
    return capacity * (BOILING + HEAT_LATENT / HEAT_CAPACITY);
}

// ---------------------------------------------------------------------------------------------
// Books

static void sum_add(HeatSum *to, double part)
{
    const double sum = to->sum + part;
    to->lost += fabs(to->sum) >= fabs(part) ? (to->sum - sum) + part : (part - sum) + to->sum;
    to->sum = sum;
}

double cut_heat_stored(const CutHeat *heat)
{
    HeatSum stored = {0.0, 0.0};
    for (int cell = 0; cell < heat->cell_count; cell++)
        sum_add(&stored, heat->energy[cell]);
    return heat_sum(&stored);
}

static bool bit_of(const uint64_t *bits, int cell)
{
    return bits[cell / BITS] >> cell % BITS & 1;
}

// Notes whether a cell is warm after its energy changed.
static void note_warm(CutHeat *heat, int cell, double capacity)
{
    const bool warm = heat->energy[cell] > HEAT_COOL * capacity;
    if (warm == bit_of(heat->warm, cell))
        return;
    heat->warm[cell / BITS] ^= UINT64_C(1) << cell % BITS;
    heat->warm_count += warm ? 1 : -1;
}

// ---------------------------------------------------------------------------------------------
// Coagulation

// Notes that a cell has coagulated: leaves most of whose cells have become stiff.
static void coagulate(CutHeat *heat, int cell)
{
    const CutLattice *lattice = heat->lattice;
    heat->coagulated[material_of(heat, cell)]++;
    heat->cooked_count++;
    for (int e = cell; e >= 0; e = cut_lattice_parent(lattice, e)) {
        const int cells = cut_shape_cells(lattice, e);
        heat->cooked[e]++;
        if (heat->stiff[e] || 2 * heat->cooked[e] <= cells)
            continue;
        heat->stiff[e] = 1;
        if (cut_lattice_is_leaf(lattice, e))
            heat->changed[heat->changed_count++] = e;
    }
}

// Returns the rate of damage at a temperature, between those of the table.
static double rate_at(const CutHeat *heat, double temperature)
{
    const double at = (temperature - HEAT_HARMLESS) * (HEAT_RATES / (HEAT_BOILING - HEAT_HARMLESS));
    const int k = at < HEAT_RATES - 1 ? (int)at : HEAT_RATES - 1;
    const double low = (double)heat->rate[k], high = (double)heat->rate[k + 1];
    return low + (at - k) * (high - low);
}

static void damage(CutHeat *heat, int cell, double temperature, double span)
{
    const double sum = (double)heat->damage[cell] + span * rate_at(heat, temperature);
    heat->damage[cell] = (float)fmin(sum, 1.0);
    if (cut_heat_is_coagulated(heat, cell))
        coagulate(heat, cell);
}

// ---------------------------------------------------------------------------------------------
// Spreading

// Two cells come nearer to a common temperature, by an implicit step: never beyond it, however long
// the step and however small the cells.
static void exchange(CutHeat *heat, int cell, double capacity, int other, double conductance)
{
    const double to = capacity_of(heat, other);
    const double gap = excess(heat, cell, capacity) - excess(heat, other, to);
    const double energy =
        conductance * gap / (1.0 + conductance * (capacity + to) / (capacity * to));
    heat->energy[cell] -= energy;
    heat->energy[other] += energy;
    note_warm(heat, other, to);
}

// A face is passed once in a round: from its lower cell, unless only the upper one is warm.
static void spread_cell(CutHeat *heat, int cell)
{
    const unsigned char *broken = heat->lattice->broken;
    const double span = heat->books->span, conductance = HEAT_CONDUCTIVITY * heat->size * span;
    const double capacity = capacity_of(heat, cell);
    for (int k = 0; k < 3; k++) {
        const int axis = heat->books->round ? 2 - k : k;
        const int below = heat->beside[cell][2 * axis], above = heat->beside[cell][2 * axis + 1];
        if (below >= 0 && !(broken[below] >> axis & 1) && !bit_of(heat->visit, below))
            exchange(heat, cell, capacity, below, conductance);
        if (above >= 0 && !(broken[cell] >> axis & 1))
            exchange(heat, cell, capacity, above, conductance);
    }
    // Blood cools what is not coagulated, by an implicit step as well.
    if (!cut_heat_is_coagulated(heat, cell)) {
        const double left = heat->energy[cell] / (1.0 + heat->perfusion * span);
        sum_add(&heat->books->perfused, heat->energy[cell] - left);
        heat->energy[cell] = left;
        const double temperature = HEAT_BODY + excess(heat, cell, capacity);
        if (temperature > HEAT_HARMLESS)
            damage(heat, cell, temperature, span);
    }
    note_warm(heat, cell, capacity);
}

// Returns the number of cells.
static int spread_word(CutHeat *heat, int word)
{
    int count = 0;
    for (uint64_t bits = heat->visit[word]; bits != 0; count++) {
        const int bit =
            heat->books->round ? BITS - 1 - __builtin_clzll(bits) : __builtin_ctzll(bits);
        bits ^= UINT64_C(1) << bit;
        spread_cell(heat, BITS * word + bit);
    }
    return count;
}

// Temperatures change slowly, by a thousandth of their differences in a tick with cells of 1 mm. So
// where more cells are warm than a tick has time for, a round over them takes several ticks, and
// makes up for the time that the round before it took. Every other round goes backwards, as what
// comes first would carry heat along.
bool cut_heat_spread(CutHeat *heat, double tick)
{
    HeatBooks *books = heat->books;
    heat->changed_count = 0;
    if (books->next == 0 && heat->warm_count == 0) {
        books->since = 0.0;
        return false;
    }
    books->since += tick;
    if (books->next == 0) {
        books->span = books->since;
        books->since = 0.0;
        books->round = !books->round;
        memcpy(heat->visit, heat->warm, (size_t)heat->word_count * sizeof *heat->visit);
    }
    int done = (int)books->next;
    for (int visits = 0; done < heat->word_count && visits < HEAT_VISITS; done++)
        visits += spread_word(heat, books->round ? heat->word_count - 1 - done : done);
    books->next = done < heat->word_count ? done : 0;
    return heat->changed_count > 0;
}

// ---------------------------------------------------------------------------------------------
// The electrode

// Where a window is: all centres of its cells are within `radius` of `middle`, if it is stretched
// no more than its middle element and a quarter.
typedef struct HeatWindow {
    Vec3 middle;
    double radius;
} HeatWindow;

// False: nothing of it is left.
static bool find_window(const CutHeat *heat, const CellCentres *centres, const CutWindow *window,
                        HeatWindow *out)
{
    const CutLattice *lattice = heat->lattice;
    const bool whole = window->end - window->first == WINDOW_ELEMENTS;
    int cell = window->first + (whole ? 7 : 0); // of a whole one, beside the middle
    if (cut_lattice_is_gone(lattice, cell))
        for (cell = window->first; cut_lattice_is_gone(lattice, cell);)
            if (++cell == window->end)
                return false;
    const int leaf = cut_lattice_leaf_of(lattice, cell);
    const CutElement *e = &lattice->element[leaf];
    const int *node = cut_lattice_nodes(lattice, leaf);
    Vec3 corner[NODE_CORNERS], sum = {0.0, 0.0, 0.0};
    for (int c = 0; c < NODE_CORNERS; c++) {
        corner[c] = cut_centres_vertex(centres, node[c]);
        sum = vec3_add(sum, corner[c]);
    }
    out->middle = vec3_scale(1.0 / NODE_CORNERS, sum);
    // How far it is to the farthest centre at rest, and to the element's corners now and at rest.
    const double half = 0.5 * (1 << e->level);
    double far = 0.0, stretched = 0.0;
    for (int c = 0; c < 3; c++) {
        const int low = lattice->element[cell].cell[c] / WINDOW_EDGE * WINDOW_EDGE;
        const double at = e->cell[c] + half;
        const double most = fmax(at - (low + 0.5), low + WINDOW_EDGE - 0.5 - at);
        far += most * most;
    }
    for (int c = 0; c < NODE_CORNERS; c++)
        stretched = fmax(stretched, vec3_length(vec3_sub(corner[c], out->middle)));
    stretched *= 1.25 / (sqrt(3.0) * half * heat->size);
    out->radius = sqrt(far) * heat->size * fmax(1.0, stretched);
    return true;
}

// Lists windows of cells near the electrode. If there are too many, every second, every fourth, ...
static int find_windows(CutHeat *heat, const CellCentres *centres, const Region *mouth,
                        double reach)
{
    const CutLattice *lattice = heat->lattice;
    int count = 0, step = 1;
    for (int w = 0; w < lattice->window_count && lattice->window[w].level == 0; w += step) {
        HeatWindow at;
        if (!find_window(heat, centres, &lattice->window[w], &at) ||
            !(region_distance(mouth, at.middle) <= reach + at.radius))
            continue;
        if (count == HEAT_WINDOWS) {
            for (int k = 0; k < HEAT_WINDOWS / 2; k++)
                heat->window[k] = heat->window[2 * k];
            count /= 2, step *= 2;
        }
        heat->window[count++] = w;
    }
    return count;
}

// Lists the cells that the electrode heats, and their shares, not normalised. Returns the sum of
// the shares; 0: it touches nothing.
static double find_near(CutHeat *heat, const Rows *rows, const void *row, const Region *mouth)
{
    const CutLattice *lattice = heat->lattice;
    CellCentres centres;
    cut_centres_begin(&centres, lattice, rows, row);
    // A cell is touched if its centre is within half a diagonal of the electrode.
    const double touch = mouth->radius + 0.5 * sqrt(3.0) * heat->size;
    const double reach = fmax(touch, 3.0 * mouth->radius);
    const double least = fmax(mouth->radius, 0.5 * heat->size);
    const int windows = find_windows(heat, &centres, mouth, reach);
    double nearest = (double)INFINITY, sum = 0.0;
    heat->near_count = 0;
    for (int k = 0; k < windows; k++) {
        const CutWindow *window = &lattice->window[heat->window[k]];
        for (int cell = window->first; cell < window->end && heat->near_count < HEAT_NEAR; cell++) {
            if (cut_lattice_is_gone(lattice, cell))
                continue;
            const double r = region_distance(mouth, cut_centre(&centres, cell));
            if (!(r <= reach))
                continue;
            const double part = r > least ? (least / r) * (least / r) : 1.0;
            nearest = fmin(nearest, r);
            heat->near[heat->near_count] = cell;
            heat->near_share[heat->near_count++] = part * part;
            sum += part * part;
        }
    }
    return nearest <= touch ? sum : 0.0;
}

// Shares heat out once: no cell gets more than it needs to boil away. Returns what is left; `sum`:
// of the shares of cells that can take more.
static double share_out(CutHeat *heat, double joules, double *sum)
{
    double left = 0.0, open = 0.0;
    for (int k = 0; k < heat->near_count; k++) {
        const int cell = heat->near[k];
        const double capacity = capacity_of(heat, cell), most = most_of(capacity);
        const double room = most - heat->energy[cell];
        const double part = joules * (heat->near_share[k] / *sum);
        // Full to the last bit, so that it is known to have boiled.
        const bool fills = part >= room;
        left += fills ? part - fmax(0.0, room) : 0.0;
        heat->energy[cell] = fills ? fmax(most, heat->energy[cell]) : heat->energy[cell] + part;
        heat->near_share[k] = fills ? 0.0 : heat->near_share[k];
        open += heat->near_share[k];
        note_warm(heat, cell, capacity);
    }
    *sum = open;
    return left;
}

double cut_heat_give(CutHeat *heat, const Rows *rows, const void *row, const Removal *removal)
{
    enum { ROUNDS = 4 };
    heat->boiled_count = 0;
    double sum = removal->heat > 0.0 ? find_near(heat, rows, row, &removal->mouth) : 0.0;
    double left = removal->heat;
    if (!(sum > 0.0))
        return 0.0;
    // What some cells cannot take goes to the others.
    for (int round = 0; round < ROUNDS && left > 0.0 && sum > 0.0; round++)
        left = share_out(heat, left, &sum);
    for (int k = 0; k < heat->near_count; k++)
        if (heat->energy[heat->near[k]] >= most_of(capacity_of(heat, heat->near[k])))
            heat->boiled[heat->boiled_count++] = heat->near[k];
    const double given = removal->heat - left;
    sum_add(&heat->books->given, given);
    heat->books->refused += left > 0.0;
    return given;
}

double cut_heat_coagulated(const CutHeat *heat)
{
    int cells = 0;
    for (int m = 0; m < heat->material_count; m++)
        cells += heat->coagulated[m];
    return cells * heat->size * heat->size * heat->size;
}

bool cut_heat_shows(CutHeat *heat, double tick)
{
    heat->unshown += tick;
    if (heat->cooked_count == heat->shown_count || heat->unshown < 0.2)
        return false;
    heat->shown_count = heat->cooked_count;
    heat->unshown = 0.0;
    return true;
}

double cut_heat_share(const CutHeat *heat, int vertex)
{
    const CutLattice *lattice = heat->lattice;
    int point[3], cell[8], there = 0, coagulated = 0;
    cut_lattice_point(lattice, vertex, point);
    cut_lattice_cells(lattice, point, cell);
    for (int s = 0; s < 8; s++) {
        there += cell[s] >= 0;
        coagulated += cell[s] >= 0 && cut_heat_is_coagulated(heat, cell[s]);
    }
    return there > 0 ? (double)coagulated / there : 0.0;
}

void cut_heat_remove(CutHeat *heat, const int *cell, int count)
{
    for (int k = 0; k < count; k++) {
        sum_add(&heat->books->removed, heat->energy[cell[k]]);
        heat->energy[cell[k]] = 0.0;
        note_warm(heat, cell[k], capacity_of(heat, cell[k]));
        if (cut_heat_is_coagulated(heat, cell[k]))
            heat->coagulated[material_of(heat, cell[k])]--;
    }
}

// ---------------------------------------------------------------------------------------------
// Restored states, and creation

bool cut_heat_derive(CutHeat *heat)
{
    HeatBooks *books = heat->books;
    bool good = books->next >= 0 && books->round >> 1 == 0 && books->next < heat->word_count &&
                isfinite(books->since) && isfinite(books->span) && books->since >= 0.0 &&
                books->span >= 0.0;
    const int cells = heat->cell_count, elements = heat->lattice->element_count;
    memset(heat->warm, 0, (size_t)heat->word_count * sizeof *heat->warm);
    memset(heat->cooked, 0, (size_t)elements * sizeof *heat->cooked);
    memset(heat->stiff, 0, (size_t)elements * sizeof *heat->stiff);
    memset(heat->coagulated, 0, (size_t)heat->material_count * sizeof *heat->coagulated);
    heat->warm_count = heat->cooked_count = 0;
    for (int cell = 0; cell < cells && good; cell++) {
        good = isfinite(heat->energy[cell]) && heat->damage[cell] >= 0.0f &&
               heat->damage[cell] <= 1.0f;
        heat->changed_count = 0;
        note_warm(heat, cell, capacity_of(heat, cell));
        if (!cut_heat_is_coagulated(heat, cell))
            continue;
        coagulate(heat, cell);
        heat->coagulated[material_of(heat, cell)] -= cut_lattice_is_gone(heat->lattice, cell);
    }
    heat->changed_count = 0;
    heat->shown_count = heat->cooked_count; // a restored state is shown anyway
    // No bits beyond the last cell.
    const int odd = cells % BITS;
    return good && (odd == 0 || heat->visit[heat->word_count - 1] >> odd == 0);
}

static void create_neighbours(CutHeat *heat, const char *name, Arena *arena)
{
    const CutLattice *lattice = heat->lattice;
    heat->beside = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)heat->cell_count,
                                  sizeof *heat->beside, "%s/heated neighbours", name);
    for (int cell = 0; cell < heat->cell_count; cell++)
        for (int side = 0; side < 6; side++) {
            int at[3];
            cut_lattice_place(lattice, cell, at);
            at[side / 2] += side % 2 == 0 ? -1 : 1;
            heat->beside[cell][side] = cut_lattice_cell(lattice, at[0], at[1], at[2]);
        }
}

// Numbers that are rounded to single precision do not depend on the C library's last bit.
static void create_rates(CutHeat *heat)
{
    const double gas = 8.314, kelvin = 273.15;
    for (int k = 0; k <= HEAT_RATES; k++) {
        const double temperature = HEAT_HARMLESS + k * (HEAT_BOILING - HEAT_HARMLESS) / HEAT_RATES;
        heat->rate[k] =
            (float)exp(log(HEAT_FREQUENCY) - HEAT_ACTIVATION / (gas * (kelvin + temperature)));
    }
}

static void create_state(CutHeat *heat, const char *name, Arena *arena, StateList *state)
{
    const size_t cells = (size_t)heat->cell_count, words = (size_t)heat->word_count;
    heat->energy = ALLOCATE(ARENA_STEP, cells, double, "heat");
    heat->damage = ALLOCATE(ARENA_STEP, cells, float, "coagulation");
    heat->visit = ALLOCATE(ARENA_STEP, words, uint64_t, "heated cells");
    heat->books = ALLOCATE(ARENA_STEP, 1, HeatBooks, "heat books");
    state_add(state, heat->energy, cells * sizeof *heat->energy, "%s/heat", name);
    state_add(state, heat->damage, cells * sizeof *heat->damage, "%s/coagulation", name);
    state_add(state, heat->visit, words * sizeof *heat->visit, "%s/heated_cells", name);
    state_add(state, heat->books, sizeof *heat->books, "%s/heat_books", name);
}

void cut_heat_create(CutHeat *heat, const char *name, const CutLattice *lattice,
                     const VoxelMaking *making, Arena *arena, StateList *state)
{
    const VoxelOptions *options = making->options;
    const double volume = pow(options->lattice->size, 3.0);
    heat->lattice = lattice;
    heat->size = options->lattice->size;
    heat->perfusion = HEAT_PERFUSION;
    heat->stiffer = options->coagulated_stiffness;
    heat->cell_count = lattice->level_first[1];
    heat->word_count = (heat->cell_count + BITS - 1) / BITS;
    heat->material_count = options->material_count;
    heat->capacity = ALLOCATE(ARENA_STEP, heat->material_count, double, "heat capacities");
    for (int m = 0; m < heat->material_count; m++)
        heat->capacity[m] = HEAT_CAPACITY * options->material[m].density * volume;
    create_neighbours(heat, name, arena);
    create_rates(heat);
    create_state(heat, name, arena, state);
    // What follows from the state, and scratch.
    heat->warm = ALLOCATE(ARENA_STEP, heat->word_count, uint64_t, "warm cells");
    heat->cooked = ALLOCATE(ARENA_TOPOLOGY, lattice->element_count, int, "coagulated cells");
    heat->stiff = ALLOCATE(ARENA_TOPOLOGY, lattice->element_count, unsigned char, "coagulated");
    heat->coagulated = ALLOCATE(ARENA_TOPOLOGY, heat->material_count, int, "coagulated amounts");
    heat->changed = ALLOCATE(ARENA_TOPOLOGY, heat->cell_count, int, "newly coagulated");
    heat->window = ALLOCATE(ARENA_TOPOLOGY, HEAT_WINDOWS, int, "windows near electrodes");
    heat->near = ALLOCATE(ARENA_TOPOLOGY, HEAT_NEAR, int, "cells near electrodes");
    heat->near_share = ALLOCATE(ARENA_TOPOLOGY, HEAT_NEAR, double, "shares of heat");
    heat->boiled = ALLOCATE(ARENA_TOPOLOGY, HEAT_NEAR, int, "boiled cells");
}
