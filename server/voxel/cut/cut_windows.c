// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_windows.h"

#include "base/bits.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// Load time

// Groups consecutive windows of one level.
static void create_groups(CutWindows *windows, const char *name, Arena *arena)
{
    const CutLattice *lattice = windows->lattice;
    const int count = lattice->window_count;
    windows->group = ALLOCATE(ARENA_STEP, count, WindowGroup, "groups of windows");
    windows->group_of = ALLOCATE(ARENA_TOPOLOGY, count, int, "groups");
    for (int w = 0; w < count; w++) {
        WindowGroup *last = &windows->group[windows->group_count - 1];
        const bool joins = w > 0 && w - last->first < GROUP_WINDOWS &&
                           lattice->window[w].level == lattice->window[w - 1].level;
        if (!joins)
            windows->group[windows->group_count++] = (WindowGroup){w, w};
        windows->group_of[w] = windows->group_count - 1;
        windows->group[windows->group_of[w]].end = w + 1;
    }
}

// Returns the most batches that plain leaves of a window can fill; adds the most that may be left
// over, by material.
static int most_full(const CutLattice *lattice, int window, int rest[256])
{
    const CutWindow *own = &lattice->window[window];
    int count[256] = {0}, batches = 0; // by material
    for (int e = own->first; e < own->end; e++)
        batches += ++count[lattice->element[e].material] % LANES == 0;
    for (int m = 0; m < 256; m++)
        rest[m] += count[m] < LANES ? count[m] : LANES - 1;
    return batches;
}

static int batches_for(int elements)
{
    return (elements + LANES - 1) / LANES;
}

// Assigns consecutive ranges of batches to a group: those of its windows, then its own.
static void create_ranges(CutWindows *windows, const char *name, Arena *arena)
{
    const CutLattice *lattice = windows->lattice;
    int *end = windows->capacity;
    windows->full = ALLOCATE(ARENA_STEP, lattice->window_count, BatchRange, "windows");
    windows->pooled = ALLOCATE(ARENA_STEP, windows->group_count, BatchRange, "pooled windows");
    windows->mixed = ALLOCATE(ARENA_STEP, windows->group_count, BatchRange, "mixed windows");
    // Ranges do not overlap: a window can be packed without moving others.
    for (int g = 0; g < windows->group_count; g++) {
        const WindowGroup *own = &windows->group[g];
        const int elements = lattice->window[own->end - 1].end - lattice->window[own->first].first;
        const bool hangs = lattice->window[own->first].level > 0;
        int rest[256] = {0};
        // Batches of one window each.
        for (int w = own->first; w < own->end; w++) {
            const int count = lattice->window[w].end - lattice->window[w].first;
            BatchRange *range = &windows->full[w];
            memcpy(range->low, end, sizeof range->low);
            end[BATCH_PLAIN] += most_full(lattice, w, rest);
            end[BATCH_HANGING] += hangs ? count / LANES : 0;
            memcpy(range->high, end, sizeof range->high);
        }
        // Batches of the group: full ones of one mask, then plain and mixed remainders.
        BatchRange *range = &windows->pooled[g];
        memcpy(range->low, end, sizeof range->low);
        end[BATCH_HANGING] += hangs ? elements / LANES : 0;
        memcpy(range->high, end, sizeof range->high);
        range = &windows->mixed[g];
        memcpy(range->low, end, sizeof range->low);
        // Of a material some elements may be stiff: as many of each kind may be left over.
        for (int m = 0; m < 256; m++)
            end[BATCH_PLAIN] += batches_for(rest[m]) * (windows->stiff != NULL ? 2 : 1);
        end[BATCH_HANGING] += hangs ? batches_for(elements) : 0;
        memcpy(range->high, end, sizeof range->high);
    }
}

static void create_plain(CutWindows *windows, const char *name, Arena *arena)
{
    const int count = windows->capacity[BATCH_PLAIN];
    windows->plain_vertex = arena_allocate(
        arena, ARENA_STEP, (size_t)count, sizeof *windows->plain_vertex, "%s/plain vertices", name);
    windows->plain_class = ALLOCATE(ARENA_STEP, count, int, "plain classes");
    windows->runs.plain = (PlainBatches){count, windows->plain_vertex[0][0], windows->plain_class};
}

// Returns the most plain batches for the leaves that there may be: full ones, and what each
// material leaves over in each group. Finest cells come eight at a time, so that groups of one
// material leave half a batch over.
static int most_plain(const CutWindows *windows)
{
    const CutLattice *lattice = windows->lattice;
    int batches = batches_for(lattice->most_cells) + batches_for(lattice->most_larger), halves = 0;
    for (int g = 0; g < windows->group_count; g++) {
        const WindowGroup *own = &windows->group[g];
        bool has[256] = {false};
        for (int e = lattice->window[own->first].first; e < lattice->window[own->end - 1].end; e++)
            has[lattice->element[e].material] = true;
        int kinds = 0;
        for (int m = 0; m < 256; m++)
            kinds += has[m] * (windows->stiff != NULL ? 2 : 1);
        if (kinds == 1 && lattice->window[own->first].level == 0 && lattice->family_row != NULL)
            halves++;
        else
            batches += kinds;
    }
    return batches + (halves + 1) / 2;
}

static int count_groups_above(const CutWindows *windows)
{
    int count = 0;
    for (int g = 0; g < windows->group_count; g++)
        count += windows->lattice->window[windows->group[g].first].level > 0;
    return count;
}

// Creates a pool in which all leaves that the lattice allows find room, those that a change has
// taken away included, whose batches are given back after those of others are taken.
static void create_pool(CutWindows *windows, const char *name, Arena *arena, StateList *state)
{
    const CutLattice *lattice = windows->lattice;
    const int larger = lattice->most_larger,
              ranges = lattice->window_count + 2 * windows->group_count;
    windows->full = ALLOCATE(ARENA_STEP, lattice->window_count, BatchRange, "windows");
    windows->pooled = ALLOCATE(ARENA_STEP, windows->group_count, BatchRange, "pooled windows");
    windows->mixed = ALLOCATE(ARENA_STEP, windows->group_count, BatchRange, "mixed windows");
    BatchPool *pool = ALLOCATE(ARENA_TOPOLOGY, 1, BatchPool, "pool of batches");
    windows->pool = pool;
    pool->end[0] = most_plain(windows);
    // A group leaves free lanes in one hanging batch at most.
    pool->end[1] = pool->end[0] + (larger + (LANES - 1) * count_groups_above(windows)) / LANES;
    windows->capacity[BATCH_PLAIN] = pool->end[0];
    windows->capacity[BATCH_HANGING] = pool->end[1] - pool->end[0];
    const int all = pool->end[1];
    pool->free = ALLOCATE(ARENA_TOPOLOGY, bits_words(all), uint64_t, "free batches");
    pool->next = ALLOCATE(ARENA_TOPOLOGY, all, int, "next batches");
    pool->place = ALLOCATE(ARENA_TOPOLOGY, all, int, "places of batches");
    pool->held = ALLOCATE(ARENA_TOPOLOGY, BATCH_KINDS * ranges, int, "batches before");
    state_add(state, pool->place, (size_t)all * sizeof *pool->place, "%s/batch_places", name);
}

// Initializes a table with the numbers of a plain cube, as cut_pack.c expects.
static void *begin_table(const CutWindows *windows, int batch, int stride, void *number)
{
    const bool single = windows->templates->precision == PRECISION_SINGLE;
    const void *from = template_cache_numbers(windows->templates, 0);
    windows->tables[batch] = (RestTable){NODE_CORNERS, stride, number};
    for (int i = 0; i < (TABLE_HEAD + NODE_CORNERS * TABLE_ROW) * stride; i++)
        if (single)
            ((float *)number)[i] = ((const float *)from)[i / stride];
        else
            ((double *)number)[i] = ((const double *)from)[i / stride];
    return (char *)number +
           (size_t)TEMPLATE_NUMBERS * (size_t)stride * (single ? sizeof(float) : sizeof(double));
}

void cut_windows_set_stride(CutWindows *windows, int batch, int stride)
{
    const RestTable *table = &windows->tables[batch];
    if (table->stride == stride)
        return;
    void *number = (void *)table->number;
    const bool single = windows->templates->precision == PRECISION_SINGLE;
    memset(number, 0, (size_t)TEMPLATE_NUMBERS * LANES * (single ? sizeof(float) : sizeof(double)));
    memset(windows->hanging_shape[batch], 0, sizeof windows->hanging_shape[batch]);
    begin_table(windows, batch, stride, number);
}

static void create_tables(CutWindows *windows, const char *name, Arena *arena)
{
    const size_t real =
        windows->templates->precision == PRECISION_SINGLE ? sizeof(float) : sizeof(double);
    const int count = windows->capacity[BATCH_HANGING];
    windows->tables = ALLOCATE(ARENA_STEP, count, RestTable, "rest tables");
    size_t numbers = 0;
    // First pass: sizes. Second pass: tables.
    for (int pass = 0; pass < 2; pass++) {
        void *number =
            pass == 0 ? NULL
                      : arena_allocate(arena, ARENA_STEP, numbers, real, "%s/rest shapes", name);
        for (int b = 0; windows->pool != NULL && b < count; b++) {
            if (pass == 0)
                numbers += (size_t)TEMPLATE_NUMBERS * LANES;
            else
                number = begin_table(windows, b, LANES, number);
        }
        for (int g = 0, batch = 0; windows->pool == NULL && g < windows->group_count; g++) {
            // Mixed batches have numbers for each lane.
            const int mixed = windows->mixed[g].low[BATCH_HANGING];
            const int end = g + 1 < windows->group_count
                                ? windows->full[windows->group[g + 1].first].low[BATCH_HANGING]
                                : count;
            for (; batch < end; batch++) {
                const int stride = batch < mixed ? 1 : LANES;
                if (pass == 0)
                    numbers += (size_t)TEMPLATE_NUMBERS * (size_t)stride;
                else
                    number = begin_table(windows, batch, stride, number);
            }
        }
    }
}

static void create_hanging(CutWindows *windows, const char *name, Arena *arena)
{
    const int count = windows->capacity[BATCH_HANGING];
    windows->hanging_vertex =
        arena_allocate(arena, ARENA_STEP, (size_t)count, sizeof *windows->hanging_vertex,
                       "%s/hanging vertices", name);
    windows->hanging_class =
        arena_allocate(arena, ARENA_STEP, (size_t)count, sizeof *windows->hanging_class,
                       "%s/hanging classes", name);
    windows->hanging_shape =
        arena_allocate(arena, ARENA_TOPOLOGY, (size_t)count, sizeof *windows->hanging_shape,
                       "%s/hanging shapes", name);
    // Every batch has room for all nodes, and a table of its own.
    int *start = ALLOCATE(ARENA_STEP, count + 1, int, "hanging start");
    int *table = ALLOCATE(ARENA_STEP, count, int, "hanging tables");
    for (int b = 0; b < count; b++) {
        start[b + 1] = (b + 1) * NODE_COUNT;
        table[b] = b;
    }
    windows->runs.hanging = (HangingBatches){
        .batch_count = count,
        .start = start,
        .vertex = windows->hanging_vertex[0][0],
        .table = table,
        .element_class = (const int(*)[LANES])windows->hanging_class,
    };
    create_tables(windows, name, arena);
}

// ---------------------------------------------------------------------------------------------
// Which batches are in use

static void add_range(CutWindows *windows, int kind, const BatchRange *range)
{
    if (windows->pool == NULL) {
        batch_runs_add(&windows->runs, kind, (BatchRun){range->first[kind], range->used[kind]});
        return;
    }
    for (int k = 0, batch = range->first[kind]; k < range->used[kind]; k++) {
        batch_runs_add(&windows->runs, kind, (BatchRun){batch, 1});
        batch = cut_windows_next(windows, kind, batch);
    }
}

// Most groups of a body that adapts have no leaf.
static void list_runs(CutWindows *windows)
{
    for (int kind = 0; kind < BATCH_KINDS; kind++) {
        batch_runs_begin(&windows->runs, kind);
        for (int word = 0; word < bits_words(windows->group_count); word++)
            for (uint64_t left = windows->in_use[word]; left != 0;) {
                const int g = bits_take(&left, word);
                for (int w = windows->group[g].first; w < windows->group[g].end; w++)
                    add_range(windows, kind, &windows->full[w]);
                add_range(windows, kind, &windows->pooled[g]);
                add_range(windows, kind, &windows->mixed[g]);
            }
        batch_runs_end(&windows->runs, kind);
    }
}

// Packs a group, and notes whether it has batches.
static void pack(CutWindows *windows, int group, bool turns)
{
    const WindowGroup *own = &windows->group[group];
    int used = 0;
    cut_pack(windows, group, turns);
    for (int kind = 0; kind < BATCH_KINDS; kind++) {
        for (int w = own->first; w < own->end; w++)
            used += windows->full[w].used[kind];
        used += windows->pooled[group].used[kind] + windows->mixed[group].used[kind];
    }
    bits_remove(windows->in_use, group);
    if (used > 0)
        bits_add(windows->in_use, group);
}

// Finds the batches that ranges had, in their order, from the state. What the state does not say is
// free; what it says twice, or of ranges that need fewer, is given back in the end.
static void find_held(CutWindows *windows)
{
    BatchPool *pool = windows->pool;
    const int windows_and_groups = windows->lattice->window_count + 2 * windows->group_count;
    memset(pool->held, -1, (size_t)(BATCH_KINDS * windows_and_groups) * sizeof *pool->held);
    memset(pool->free, 0, (size_t)bits_words(pool->end[1]) * sizeof *pool->free);
    for (int w = 0; w < windows->lattice->window_count; w++)
        memset(windows->full[w].used, 0, sizeof windows->full[w].used);
    for (int g = 0; g < windows->group_count; g++) {
        memset(windows->pooled[g].used, 0, sizeof windows->pooled[g].used);
        memset(windows->mixed[g].used, 0, sizeof windows->mixed[g].used);
    }
    // Lists in ascending order of places: insertion is short, since lists are.
    for (int b = 0; b < pool->end[1]; b++) {
        const int range = pool->place[b] > 0 ? (pool->place[b] - 1) / POOL_PLACES : -1;
        if (range < 0 || range >= windows_and_groups) {
            pool->place[b] = 0;
            bits_add(pool->free, b);
            continue;
        }
        int *at = &pool->held[BATCH_KINDS * range + (b >= pool->end[0])];
        while (*at >= 0 && pool->place[*at] < pool->place[b])
            at = &pool->next[*at];
        // No two are at one place, so that no list is longer than POOL_PLACES whatever a file says.
        if (*at >= 0 && pool->place[*at] == pool->place[b]) {
            pool->place[b] = 0;
            bits_add(pool->free, b);
            continue;
        }
        pool->next[b] = *at;
        *at = b;
    }
}

static void pack_all(CutWindows *windows)
{
    const size_t count = (size_t)windows->lattice->window_count;
    const int lanes = windows->lattice->most_cells + windows->lattice->most_larger;
    memset(windows->lane, -1, (size_t)lanes * sizeof *windows->lane);
    memset(windows->is_changed, 1, count * sizeof *windows->is_changed);
    if (windows->pool != NULL)
        find_held(windows);
    for (int g = 0; g < windows->group_count; g++)
        pack(windows, g, false);
    if (windows->pool != NULL)
        cut_pack_free_held(windows);
    memset(windows->is_changed, 0, count * sizeof *windows->is_changed);
    list_runs(windows);
}

static void create_scratch(CutWindows *windows, const char *name, Arena *arena)
{
    const CutLattice *lattice = windows->lattice;
    const int count = lattice->window_count, cells = lattice->level_first[1];
    windows->lane =
        ALLOCATE(ARENA_TOPOLOGY, lattice->most_cells + lattice->most_larger, int, "element places");
    windows->rest_cell = ALLOCATE(ARENA_TOPOLOGY, cells, unsigned char, "cells left over");
    windows->rest = ALLOCATE(ARENA_TOPOLOGY, lattice->element_count - cells, uint32_t, "left over");
    windows->rest_count = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)count,
                                         sizeof *windows->rest_count, "%s/left over counts", name);
    windows->changed = ALLOCATE(ARENA_TOPOLOGY, count, int, "changed windows");
    windows->is_changed = ALLOCATE(ARENA_TOPOLOGY, count, bool, "windows that changed");
    windows->in_use =
        ALLOCATE(ARENA_TOPOLOGY, bits_words(windows->group_count), uint64_t, "groups in use");
}

// Creates room for a class of each partly filled leaf, behind those of whole ones.
static void create_classes(CutWindows *windows, const WindowOptions *options, Arena *arena)
{
    const CutLattice *lattice = windows->lattice;
    const char *name = options->name;
    const int whole =
        (lattice->levels + 1) * options->material_count * (options->stiff != NULL ? 2 : 1);
    windows->whole_classes = whole;
    windows->runs.classes = options->classes;
    if (!lattice->adapts || cut_shape_count_parts(lattice) == 0)
        return;
    windows->classes =
        ALLOCATE(ARENA_STEP, whole + lattice->most_larger, ElementClass, "element classes");
    memcpy(windows->classes, options->classes, (size_t)whole * sizeof *windows->classes);
    windows->runs.classes = windows->classes;
}

void cut_windows_create(CutWindows *windows, const WindowOptions *options, Arena *arena,
                        StateList *state)
{
    const char *name = options->name;
    *windows = (CutWindows){.lattice = options->lattice,
                            .templates = options->templates,
                            .material_count = options->material_count,
                            .stiff = options->stiff};
    create_groups(windows, name, arena);
    if (options->lattice->adapts)
        create_pool(windows, name, arena, state);
    else
        create_ranges(windows, name, arena);
    create_plain(windows, name, arena);
    create_hanging(windows, name, arena);
    create_scratch(windows, name, arena);
    windows->runs.kernels = options->kernels;
    windows->runs.tables = windows->tables;
    create_classes(windows, options, arena);
    const int ranges = windows->lattice->window_count + 2 * windows->group_count;
    const int runs = windows->pool != NULL ? windows->pool->end[1] : BATCH_KINDS * ranges;
    batch_runs_create(&windows->runs, runs, name, arena, state);
    if (options->branch_count > 0) {
        batch_runs_relax(&windows->runs, options->branch_count, options->branch,
                         options->templates->precision, name, arena, state);
        windows->strain = arena_allocate(arena, ARENA_TOPOLOGY, GROUP_ELEMENTS,
                                         sizeof *windows->strain, "%s/strains that move", name);
    }
    pack_all(windows);
}

// ---------------------------------------------------------------------------------------------
// Step thread

static void mark(CutWindows *windows, int window, int *count)
{
    if (windows->is_changed[window])
        return;
    windows->is_changed[window] = true;
    int k = (*count)++;
    for (; k > 0 && windows->changed[k - 1] > window; k--)
        windows->changed[k] = windows->changed[k - 1];
    windows->changed[k] = window;
}

// Windows are numbered by level. The finer ones are packed first, before the elements that were
// divided lose their lanes; after merges the coarser ones.
void cut_windows_update(CutWindows *windows)
{
    const CutChanges *changes = &windows->lattice->changes;
    int count = 0;
    for (int k = 0; k < changes->element_count; k++)
        mark(windows, cut_lattice_window(windows->lattice, changes->element[k]), &count);
    const bool merged = changes->merged_count > 0;
    for (int k = 0, group = -1; k < count; k++) {
        const int window = windows->changed[merged ? count - 1 - k : k];
        if (windows->group_of[window] == group)
            continue;
        group = windows->group_of[window];
        pack(windows, group, true);
    }
    for (int k = 0; k < count; k++)
        windows->is_changed[windows->changed[k]] = false;
    if (count > 0)
        list_runs(windows);
}

void cut_windows_restored(CutWindows *windows)
{
    pack_all(windows);
}

// ---------------------------------------------------------------------------------------------
// Stress

static bool any_high(const CutWindows *windows, const BatchRange *range, const uint16_t *high)
{
    unsigned any = 0;
    for (int kind = 0; kind < BATCH_KINDS; kind++) {
        const int from = kind == BATCH_PLAIN ? 0 : windows->capacity[0];
        for (int k = 0, b = range->first[kind]; k < range->used[kind]; k++) {
            any |= high[from + b];
            b = cut_windows_next(windows, kind, b);
        }
    }
    return any != 0;
}

int cut_windows_stressed(const CutWindows *windows, const uint16_t *high, int *element)
{
    int count = 0;
    for (int g = 0; g < windows->group_count; g++) {
        const WindowGroup *own = &windows->group[g];
        if (!bits_has(windows->in_use, g)) // as most of a body that adapts
            continue;
        const bool rest = any_high(windows, &windows->mixed[g], high) ||
                          any_high(windows, &windows->pooled[g], high);
        for (int w = own->first; w < own->end; w++) {
            if (!rest && !any_high(windows, &windows->full[w], high))
                continue;
            const CutWindow *window = &windows->lattice->window[w];
            for (int e = window->first; e < window->end; e++) {
                const int lane = cut_windows_lane(windows, e);
                if (lane >= 0 && (high[lane / LANES] >> lane % LANES & 1))
                    element[count++] = e;
            }
        }
    }
    return count;
}
