// SPDX-License-Identifier: MIT
// Builds the batches of a group of windows from its leaves; part of cut_windows.c.
#include "voxel/cut/cut_windows.h"

#include "base/bits.h"
#include "base/check.h"

#include <string.h>

// A leaf as a number to sort by: bits 0 to 31 the element, 32 to 49 its mask, 50 if it is partly
// filled, then its number of vertices; for plain leaves from 32 on its class. So leaves of one kind
// agree from bit 32 on, but partly filled ones are each of their own kind.
enum { PARTIAL_BIT = 50 };

static int element_of(uint64_t key)
{
    return (int)(key & 0x7fffffffu);
}

static unsigned mask_of(uint64_t key)
{
    return (unsigned)(key >> 32) & 0x3ffffu;
}

static bool is_partial(uint64_t key)
{
    return (key >> PARTIAL_BIT & 1) != 0;
}

static TemplateKey shape_of(uint64_t key)
{
    return is_partial(key) ? template_key_of_part(mask_of(key), element_of(key)) : mask_of(key);
}

// Counts bits without the library function that the compiler would call.
static int vertex_count_of(unsigned mask)
{
    mask = mask - (mask >> 1 & 0x55555555u);
    mask = (mask & 0x33333333u) + (mask >> 2 & 0x33333333u);
    mask = (mask + (mask >> 4)) & 0x0f0f0f0fu;
    return NODE_CORNERS + (int)(mask * 0x01010101u >> 24);
}

// ---------------------------------------------------------------------------------------------
// Leaves in order

typedef struct Leaves {
    int count[BATCH_KINDS];
    uint64_t key[BATCH_KINDS][WINDOW_ELEMENTS];
} Leaves;

// Insertion sort: lists are nearly sorted as a rule.
static void insert(uint64_t *list, int count, uint64_t key)
{
    for (; count > 0 && list[count - 1] > key; count--)
        list[count] = list[count - 1];
    list[count] = key;
}

static void list_leaves(const CutWindows *windows, const CutWindow *own, Leaves *to)
{
    const CutLattice *lattice = windows->lattice;
    to->count[BATCH_PLAIN] = to->count[BATCH_HANGING] = 0;
    for (int e = own->first; e < own->end; e++) {
        if (!cut_lattice_is_leaf(lattice, e))
            continue;
        // The key sorts by class, or by number of vertices and shape; then by element.
        const unsigned mask = own->level == 0 ? 0 : template_mask_of(cut_lattice_nodes(lattice, e));
        const bool partial = cut_shape_is_partial(lattice, e);
        const int kind = mask == 0 && !partial ? BATCH_PLAIN : BATCH_HANGING;
        const uint64_t sort = kind == BATCH_PLAIN ? (uint64_t)cut_windows_class(windows, e)
                                                  : (uint64_t)vertex_count_of(mask) << 19 |
                                                        (uint64_t)partial << 18 | mask;
        insert(to->key[kind], to->count[kind]++, sort << 32 | (uint64_t)e);
    }
}

// What is left over, in half of a key's bits: 0 to 5 the element in its window, then its class, or
// its mask and whether it is partly filled. Of finest cells the class follows from the element.
enum { REST_BITS = 6 };
_Static_assert(WINDOW_ELEMENTS == 1 << REST_BITS, "elements of a window");

// Stores what is left over at a place of its window, which begins at element `first`.
static void put_rest(CutWindows *windows, int first, int place, uint64_t key, int kind)
{
    const int cells = windows->lattice->level_first[1], e = element_of(key) - first;
    const uint32_t sort = (uint32_t)(key >> 32) & (kind == BATCH_PLAIN ? ~0u : 0x7ffffu);
    if (first < cells)
        windows->rest_cell[first + place] = (unsigned char)e;
    else
        windows->rest[first - cells + place] = sort << REST_BITS | (uint32_t)e;
}

// Returns which of a window's elements is left over at a place.
static int rest_element(const CutWindows *windows, int first, int place)
{
    const int cells = windows->lattice->level_first[1];
    return first + (int)(first < cells
                             ? windows->rest_cell[first + place]
                             : windows->rest[first - cells + place] & (WINDOW_ELEMENTS - 1));
}

static uint64_t rest_key(const CutWindows *windows, int first, int place, int kind)
{
    const int cells = windows->lattice->level_first[1], e = rest_element(windows, first, place);
    if (first < cells)
        return (uint64_t)cut_windows_class(windows, e) << 32 | (uint64_t)e;
    const uint32_t sort = windows->rest[first - cells + place] >> REST_BITS;
    const uint64_t vertices =
        kind == BATCH_PLAIN ? 0 : (uint64_t)vertex_count_of(sort & 0x3ffffu) << 19;
    return (vertices | sort) << 32 | (uint64_t)e;
}

// Merges what the windows of a group leave over, smallest first.
typedef struct Merge {
    const CutWindows *windows;
    int kind, count;
    int next[GROUP_WINDOWS], end[GROUP_WINDOWS]; // places
    int first[GROUP_WINDOWS];                    // elements of the windows
    uint64_t head[GROUP_WINDOWS];                // keys at `next`
} Merge;

static Merge merge_begin(const CutWindows *windows, int group, int kind)
{
    Merge merge = {.windows = windows, .kind = kind};
    for (int w = windows->group[group].first; w < windows->group[group].end; w++) {
        const int *count = windows->rest_count[w];
        // What each window leaves is sorted already.
        const int first = windows->lattice->window[w].first;
        const int rest = kind == BATCH_PLAIN ? 0 : count[BATCH_PLAIN];
        if (count[kind] == 0)
            continue;
        merge.first[merge.count] = first;
        merge.head[merge.count] = rest_key(windows, first, rest, kind);
        merge.next[merge.count] = rest;
        merge.end[merge.count++] = rest + count[kind];
    }
    return merge;
}

static bool merge_next(Merge *merge, uint64_t *key)
{
    int best = 0;
    if (merge->count == 0)
        return false;
    // The lowest of the heads.
    for (int k = 1; k < merge->count; k++)
        if (merge->head[k] < merge->head[best])
            best = k;
    *key = merge->head[best];
    merge->next[best]++;
    // A list that has ended is taken out.
    if (merge->next[best] == merge->end[best]) {
        merge->count--;
        merge->first[best] = merge->first[merge->count];
        merge->head[best] = merge->head[merge->count];
        merge->next[best] = merge->next[merge->count];
        merge->end[best] = merge->end[merge->count];
    } else {
        merge->head[best] =
            rest_key(merge->windows, merge->first[best], merge->next[best], merge->kind);
    }
    return true;
}

// ---------------------------------------------------------------------------------------------
// Rotations, and the dashpots of branches

typedef struct Turns {
    bool moved;
    int base; // first element of the group
    double turn[GROUP_ELEMENTS][4];
} Turns;

static const double NO_TURN[4] = {1.0, 0.0, 0.0, 0.0}, NO_STRAIN[RELAXATION_NUMBERS];

// A merged element has no rotation, and the mean of its children's strains by their volume.
static void take_mean(const CutWindows *windows, int element, Turns *turns)
{
    const CutLattice *lattice = windows->lattice;
    memcpy(turns->turn[element - turns->base], NO_TURN, sizeof NO_TURN);
    if (windows->strain == NULL)
        return;
    double *mean = windows->strain[element - turns->base], strain[RELAXATION_NUMBERS];
    const double by = 1.0 / cut_shape_cells(lattice, element);
    const int first = cut_lattice_first_child(lattice, element);
    memset(mean, 0, sizeof strain);
    for (int k = 0; k < __builtin_popcount(cut_lattice_children(lattice, element)); k++) {
        memset(strain, 0, sizeof strain);
        relaxation_take(windows->runs.relaxation, cut_windows_lane(windows, first + k), strain);
        for (int n = 0; n < RELAXATION_NUMBERS; n++)
            mean[n] += by * cut_shape_cells(lattice, first + k) * strain[n];
    }
}

// Stores what an element, or the element from which it was divided, remembers.
static void take_turn(const CutWindows *windows, int element, Turns *turns)
{
    int from = element, lane = cut_windows_lane(windows, element);
    if (lane < 0 && windows->lattice->changes.merged_count > 0) {
        take_mean(windows, element, turns);
        return;
    }
    while (lane < 0) {
        from = cut_lattice_parent(windows->lattice, from);
        lane = from < 0 ? 0 : cut_windows_lane(windows, from);
    }
    const double *turn = from < 0 ? NO_TURN : windows->runs.last[lane / LANES][lane % LANES];
    memcpy(turns->turn[element - turns->base], turn, sizeof NO_TURN);
    double *strain = windows->strain != NULL ? windows->strain[element - turns->base] : NULL;
    if (strain != NULL && from >= 0)
        relaxation_take(windows->runs.relaxation, lane, strain);
    else if (strain != NULL)
        memcpy(strain, NO_STRAIN, sizeof NO_STRAIN);
}

static void clear_turns(CutWindows *windows, const BatchRange *range)
{
    for (int kind = 0; kind < BATCH_KINDS; kind++) {
        const int from = kind == BATCH_PLAIN ? 0 : windows->capacity[0];
        for (int k = 0, b = range->first[kind]; k < range->used[kind]; k++) {
            for (int i = 0; i < LANES; i++)
                memcpy(windows->runs.last[from + b][i], NO_TURN, sizeof NO_TURN);
            for (int i = 0; i < LANES && windows->strain != NULL; i++)
                relaxation_put(windows->runs.relaxation, (from + b) * LANES + i, NO_STRAIN);
            b = cut_windows_next(windows, kind, b);
        }
    }
}

static void put_lane(CutWindows *windows, int element, int lane, const Turns *turns)
{
    windows->lane[cut_lattice_place_of_row(windows->lattice, element)] = lane;
    if (turns->moved)
        memcpy(windows->runs.last[lane / LANES][lane % LANES], turns->turn[element - turns->base],
               sizeof NO_TURN);
    if (turns->moved && windows->strain != NULL)
        relaxation_put(windows->runs.relaxation, lane, windows->strain[element - turns->base]);
}

// ---------------------------------------------------------------------------------------------
// Batches that a range takes

// A range that is being filled with batches of a kind.
typedef struct Filling {
    CutWindows *windows;
    BatchRange *range;
    int kind, number; // of the range: windows first, then what groups pool, then what they mix
    int last;         // batch, as the pool numbers it
} Filling;

// Begins an empty range: `first` is where its batches are, unless they come from the pool.
static Filling fill_begin(CutWindows *windows, BatchRange *range, int kind, int number, int first)
{
    range->used[kind] = 0;
    range->first[kind] = first;
    return (Filling){windows, range, kind, number, -1};
}

// Gives the batches of a range back to the pool.
static void give_back(BatchPool *pool, BatchRange *range)
{
    for (int kind = 0; kind < BATCH_KINDS; kind++) {
        const int from = kind == BATCH_PLAIN ? 0 : pool->end[0];
        for (int k = 0, b = from + range->first[kind]; k < range->used[kind]; k++) {
            pool->place[b] = 0;
            bits_add(pool->free, b);
            b = pool->next[b];
        }
        range->used[kind] = 0;
    }
}

// Gives back what a group packs again.
static void give_group_back(CutWindows *windows, int group)
{
    const WindowGroup *own = &windows->group[group];
    for (int w = own->first; w < own->end; w++)
        if (windows->is_changed[w])
            give_back(windows->pool, &windows->full[w]);
    give_back(windows->pool, &windows->pooled[group]);
    give_back(windows->pool, &windows->mixed[group]);
}

void cut_pack_free_held(CutWindows *windows)
{
    BatchPool *pool = windows->pool;
    const int ranges = windows->lattice->window_count + 2 * windows->group_count;
    for (int r = 0; r < BATCH_KINDS * ranges; r++) {
        for (int b = pool->held[r]; b >= 0; b = pool->next[b]) {
            pool->place[b] = 0;
            bits_add(pool->free, b);
        }
        pool->held[r] = -1;
    }
}

// Returns the lowest, or highest, free batch in [begin, end); `end`: none.
static int find_free(const BatchPool *pool, int begin, int end, bool high)
{
    if (high) {
        int word = (end - 1) / 64;
        uint64_t left = pool->free[word] & (~UINT64_C(0) >> (63 - (end - 1) % 64));
        while (left == 0 && 64 * word > begin)
            left = pool->free[--word];
        const int batch = left == 0 ? -1 : 64 * word + 63 - __builtin_clzll(left);
        return batch < begin ? end : batch;
    }
    int word = begin / 64;
    uint64_t left = pool->free[word] & (~UINT64_C(0) << begin % 64);
    while (left == 0 && 64 * (word + 1) < end)
        left = pool->free[++word];
    return left == 0 ? end : bits_take(&left, word);
}

static int take_free(CutWindows *windows, int begin, int end, bool high)
{
    int batch = find_free(windows->pool, begin, end, high);
    // A state from a file may give ranges more than they need, and others nothing.
    if (batch >= end) {
        cut_pack_free_held(windows);
        batch = find_free(windows->pool, begin, end, high);
    }
    ASSERT(batch < end); // the lattice has at most as many leaves as the pool is for
    bits_remove(windows->pool->free, batch);
    return batch;
}

// Returns the next batch of a range: while a state is restored, the one that it had.
static int fill_next(Filling *fill)
{
    BatchRange *range = fill->range;
    BatchPool *pool = fill->windows->pool;
    const int kind = fill->kind, place = range->used[kind]++;
    if (pool == NULL)
        return range->first[kind] + place;
    const int from = kind == BATCH_PLAIN ? 0 : pool->end[0];
    const bool mixes =
        kind == BATCH_HANGING &&
        fill->number >= fill->windows->lattice->window_count + fill->windows->group_count;
    int *held = &pool->held[BATCH_KINDS * fill->number + kind], batch = *held;
    if (batch >= 0)
        *held = pool->next[batch];
    else
        batch = take_free(fill->windows, from, pool->end[kind], mixes);
    // Mixed ones come from the other end, so that tables hardly ever change.
    if (kind == BATCH_HANGING)
        cut_windows_set_stride(fill->windows, batch - from, mixes ? LANES : 1);
    pool->place[batch] = 1 + POOL_PLACES * fill->number + place;
    if (place == 0)
        range->first[kind] = batch - from;
    else
        pool->next[fill->last] = batch;
    fill->last = batch;
    return batch - from;
}

// ---------------------------------------------------------------------------------------------
// Batches

// Writes a lane's corners; key 0: the spare vertex.
static void put_plain(CutWindows *windows, int batch, int lane, const int *node)
{
    for (int n = 0; n < NODE_CORNERS; n++)
        windows->plain_vertex[batch][n][lane] =
            node != NULL ? node[n] : windows->lattice->vertex_capacity;
}

static void pack_plain(CutWindows *windows, int batch, const uint64_t *key, int lanes,
                       const Turns *turns)
{
    windows->plain_class[batch] = (int)(key[0] >> 32);
    for (int lane = 0; lane < lanes; lane++) {
        const int e = element_of(key[lane]);
        put_plain(windows, batch, lane, cut_lattice_nodes(windows->lattice, e));
        put_lane(windows, e, batch * LANES + lane, turns);
    }
    for (int lane = lanes; lane < LANES; lane++)
        put_plain(windows, batch, lane, NULL);
}

// Writes the numbers of a table, every `stride`-th, two at a time: their number is even. Zeros for
// the rest of the `before` numbers that were there.
_Static_assert(TABLE_HEAD % 2 == 0 && TABLE_ROW % 2 == 0, "numbers of a table");
static void put_single(float *to, const float *number, int stride, int count, int before)
{
    for (int i = 0; i < count; i += 2) {
        to[i * stride] = number[i];
        to[(i + 1) * stride] = number[i + 1];
    }
    for (int i = count; i < before; i++)
        to[i * stride] = 0.0f;
}

static void put_double(double *to, const double *number, int stride, int count, int before)
{
    for (int i = 0; i < count; i++)
        to[i * stride] = number[i];
    for (int i = count; i < before; i++)
        to[i * stride] = 0.0;
}

// Writes a lane's table unless it already has it.
static void put_numbers(CutWindows *windows, int batch, int lane, TemplateKey shape)
{
    const int stride = windows->tables[batch].stride;
    TemplateKey *held = &windows->hanging_shape[batch][lane];
    // Most lanes keep their shape from change to change.
    if (*held == shape)
        return;
    const int count = TABLE_HEAD + vertex_count_of(template_key_mask(shape)) * TABLE_ROW;
    const int before = TABLE_HEAD + vertex_count_of(template_key_mask(*held)) * TABLE_ROW;
    const void *number = template_cache_numbers(windows->templates, shape);
    // What a longer shape has left behind it is cleared.
    void *to = (void *)windows->tables[batch].number;
    if (windows->templates->precision == PRECISION_SINGLE)
        put_single((float *)to + lane, number, stride, count, before);
    else
        put_double((double *)to + lane, number, stride, count, before);
    *held = shape;
}

// Returns the class of an element in a hanging batch. That of a partly filled one is set with its
// shape.
static int put_class(CutWindows *windows, uint64_t key)
{
    const int e = element_of(key), own = cut_windows_class(windows, e);
    if (is_partial(key))
        windows->classes[own] =
            template_class(template_cache_shape(windows->templates, shape_of(key)),
                           &windows->classes[cut_windows_class_of_whole(windows, e)]);
    return own;
}

// Writes the present vertices in the order of their nodes, then the spare one.
static void put_vertices(CutWindows *windows, int batch, int lane, const int *node, unsigned mask)
{
    int(*vertex)[LANES] = windows->hanging_vertex[batch];
    int count = 0;
    for (; node != NULL && count < NODE_CORNERS; count++)
        vertex[count][lane] = node[count];
    for (; mask != 0; mask &= mask - 1)
        vertex[count++][lane] = node[NODE_CORNERS + __builtin_ctz(mask)];
    for (; count < windows->tables[batch].count; count++)
        vertex[count][lane] = windows->lattice->vertex_capacity;
}

// A lane without an element in a mixed batch is a plain cube that never deforms.
static void pack_hanging(CutWindows *windows, int batch, const uint64_t *key, int lanes,
                         const Turns *turns)
{
    const CutLattice *lattice = windows->lattice;
    RestTable *table = &windows->tables[batch];
    table->count = vertex_count_of(mask_of(key[lanes - 1]));
    // The elements.
    for (int lane = 0; lane < lanes; lane++) {
        const int e = element_of(key[lane]);
        const unsigned mask = mask_of(key[lane]);
        if (lane == 0 || table->stride > 1)
            put_numbers(windows, batch, lane, shape_of(key[lane]));
        put_vertices(windows, batch, lane, cut_lattice_nodes(lattice, e), mask);
        windows->hanging_class[batch][lane] = put_class(windows, key[lane]);
        put_lane(windows, e, (windows->capacity[0] + batch) * LANES + lane, turns);
    }
    // Lanes without an element hold a plain cube of the spare vertex.
    for (int lane = lanes; lane < LANES; lane++) {
        put_numbers(windows, batch, lane, 0);
        put_vertices(windows, batch, lane, NULL, 0);
        windows->hanging_class[batch][lane] = windows->hanging_class[batch][0];
    }
}

// True if the leaves from `k` on fill a batch of one kind.
static bool fills(const uint64_t *key, int count, int k)
{
    return k + LANES <= count && key[k] >> 32 == key[k + LANES - 1] >> 32 && !is_partial(key[k]);
}

static int count_full(const uint64_t *key, int count)
{
    int full = 0;
    for (int k = 0; k < count;) {
        const bool whole = fills(key, count, k);
        full += whole;
        k += whole ? LANES : 1;
    }
    return full;
}

// Packs a window's own batches, each full of one kind; stores the rest for its group. Every other
// window uses the high end of its range, so that the batches of two windows are consecutive and
// make one run.
static void pack_window(CutWindows *windows, int window, const Leaves *leaves, const Turns *turns)
{
    BatchRange *range = &windows->full[window];
    const bool high = (window - windows->group[windows->group_of[window]].first) % 2 == 0;
    const int first = windows->lattice->window[window].first;
    int rest = 0;
    for (int kind = 0; kind < BATCH_KINDS; kind++) {
        const uint64_t *key = leaves->key[kind];
        const int count = leaves->count[kind];
        // Windows fill their range from below and above in turn, so that runs join.
        Filling fill =
            fill_begin(windows, range, kind, window,
                       high ? range->high[kind] - count_full(key, count) : range->low[kind]);
        int left = 0;
        // Full batches of one key; the group gets the rest.
        for (int k = 0; k < count;) {
            if (fills(key, count, k)) {
                if (kind == BATCH_PLAIN)
                    pack_plain(windows, fill_next(&fill), key + k, LANES, turns);
                else
                    pack_hanging(windows, fill_next(&fill), key + k, LANES, turns);
                k += LANES;
            } else {
                put_rest(windows, first, rest + left++, key[k++], kind);
            }
        }
        rest += left;
        windows->rest_count[window][kind] = left;
    }
}

// Lists what the windows leave over, in order; returns the number.
static int list_rest(const CutWindows *windows, int group, int kind, uint64_t key[GROUP_ELEMENTS])
{
    Merge merge = merge_begin(windows, group, kind);
    int count = 0;
    while (merge_next(&merge, &key[count]))
        count++;
    return count;
}

static int mixed_number(const CutWindows *windows, int group)
{
    return windows->lattice->window_count + windows->group_count + group;
}

// Packs the rest of plain leaves: one class per batch.
static void pack_plain_rest(CutWindows *windows, int group, const Turns *turns)
{
    BatchRange *range = &windows->mixed[group];
    uint64_t key[GROUP_ELEMENTS + 1];
    const int count = list_rest(windows, group, BATCH_PLAIN, key);
    Filling fill = fill_begin(windows, range, BATCH_PLAIN, mixed_number(windows, group),
                              range->low[BATCH_PLAIN]);
    for (int k = 0, end; k < count; k = end) {
        // As many of one class as fit.
        for (end = k + 1; end < count && end < k + LANES && key[end] >> 32 == key[k] >> 32;)
            end++;
        pack_plain(windows, fill_next(&fill), key + k, end - k, turns);
    }
}

static void pack_hanging_rest(CutWindows *windows, int group, const Turns *turns)
{
    BatchRange *pooled = &windows->pooled[group], *mixed = &windows->mixed[group];
    uint64_t key[GROUP_ELEMENTS + 1];
    const int count = list_rest(windows, group, BATCH_HANGING, key);
    Filling fill = fill_begin(windows, pooled, BATCH_HANGING,
                              windows->lattice->window_count + group, pooled->low[BATCH_HANGING]);
    int left = 0;
    // Batches that several windows fill together.
    for (int k = 0; k < count;) {
        if (fills(key, count, k)) {
            pack_hanging(windows, fill_next(&fill), key + k, LANES, turns);
            k += LANES;
        } else {
            key[left++] = key[k++];
        }
    }
    // What is left mixes shapes.
    fill = fill_begin(windows, mixed, BATCH_HANGING, mixed_number(windows, group),
                      mixed->low[BATCH_HANGING]);
    for (int k = 0; k < left; k += LANES)
        pack_hanging(windows, fill_next(&fill), key + k, left - k < LANES ? left - k : LANES,
                     turns);
}

// Stores what all leaves remember that may move to another lane.
static void take_turns(const CutWindows *windows, const WindowGroup *own, const Leaves *leaves,
                       Turns *turns)
{
    for (int w = own->first; w < own->end; w++) {
        // Of an unchanged window only what it leaves to the group may move.
        if (!windows->is_changed[w]) {
            const int first = windows->lattice->window[w].first;
            const int *count = windows->rest_count[w];
            for (int k = 0; k < count[BATCH_PLAIN] + count[BATCH_HANGING]; k++)
                take_turn(windows, rest_element(windows, first, k), turns);
            continue;
        }
        const Leaves *here = &leaves[w - own->first];
        for (int kind = 0; kind < BATCH_KINDS; kind++)
            for (int k = 0; k < here->count[kind]; k++)
                take_turn(windows, element_of(here->key[kind][k]), turns);
    }
}

static void forget_lanes(CutWindows *windows, const CutWindow *own)
{
    if (windows->lattice->leaf_row == NULL) { // every element has a row
        memset(&windows->lane[own->first], -1, (size_t)(own->end - own->first) * sizeof(int));
        return;
    }
    for (int e = own->first; e < own->end; e++) {
        const int place = cut_lattice_place_of_row(windows->lattice, e);
        if (place >= 0)
            windows->lane[place] = -1;
    }
}

void cut_pack(CutWindows *windows, int group, bool moved)
{
    const CutLattice *lattice = windows->lattice;
    const WindowGroup *own = &windows->group[group];
    Leaves leaves[GROUP_WINDOWS];
    Turns turns;
    turns.moved = moved;
    turns.base = lattice->window[own->first].first;
    // List all changed windows first: their leaves' rotations must be read before any batch is
    // rewritten.
    for (int w = own->first; w < own->end; w++)
        if (windows->is_changed[w])
            list_leaves(windows, &lattice->window[w], &leaves[w - own->first]);
    if (moved) {
        take_turns(windows, own, leaves, &turns);
        for (int w = own->first; w < own->end; w++)
            if (windows->is_changed[w])
                clear_turns(windows, &windows->full[w]);
        clear_turns(windows, &windows->pooled[group]);
        clear_turns(windows, &windows->mixed[group]);
    }
    if (windows->pool != NULL)
        give_group_back(windows, group);
    // Pack the windows, then what they leave to the group.
    for (int w = own->first; w < own->end; w++) {
        if (!windows->is_changed[w])
            continue;
        forget_lanes(windows, &lattice->window[w]);
        pack_window(windows, w, &leaves[w - own->first], &turns);
    }
    pack_plain_rest(windows, group, &turns);
    pack_hanging_rest(windows, group, &turns);
}
