// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_adapt.h"

#include "base/bits.h"

#include <math.h>
#include <string.h>

static const double REACHES = 1.5;    // radii of a path within which elements are finest
static const double NEAR_CELLS = 4.0; // at least
// At least, beyond a tool's surface. Of a ball of r 5 mm dragged over cells of 1.56 mm with 1.6 of
// them the force changed by up to 0.39 % a tick, with 3 by 0.29 %, where all cells are elements by
// 0.23 %.
static const double SKIN_CELLS = 3.0;
static const double LEAVES = 0.5; // radii beyond, and cells at least, from which on they merge
// The same of a place, in cells: those at rest tremble only, and elements beside them shall be as
// at load when a tool has left.
static const double LEAVES_PLACE = 0.1;
static const double FINE = 8.0;   // cells of this part of a radius are fine enough
static const double MOVED = 0.5;  // motion of a path after which it is looked at again [cells]
static const double STALE = 0.25; // part of a brick by which its box may be too small
static const double URGENT_TIME = 5e-3; // in which a tool is where it is about to touch [s]
enum {
    SWEEP_TICKS = 20,  // at the longest, between sweeps
    SPREAD_TICKS = 16, // in which what waits is to be divided
    BOX_TICKS = 64,    // at the longest, between two boxes of a brick
    MERGE_BUDGET = 3,  // merges in a tick
    LOOKS = 16,        // elements that are looked at for merges in a tick
    LOOK_WORDS = 1024, // words of 64 elements, likewise
};

// Returns the words of a set of elements above level 0; a body of one cell has none of these.
static int words_of(const CutLattice *lattice)
{
    const int larger = lattice->element_count - lattice->level_first[1];
    return bits_words(larger > 0 ? larger : 1);
}

// ---------------------------------------------------------------------------------------------
// Where elements are

// Returns the vertex at corner c of an element: that of the leaf there; -1: void.
static int corner_of(const CutLattice *lattice, int element, int c)
{
    const int cells = lattice->level_first[1];
    int parent = -1;
    while (element >= 0 && lattice->divided[element]) {
        parent = element;
        element = element < cells ? -1 : cut_lattice_child(lattice, element, c);
    }
    if (element < 0)
        return -1;
    if (element < cells && parent >= 0 && lattice->family_row != NULL) // its row, but faster
        return lattice->corner[lattice->family_row[parent - cells] + c][c];
    return cut_lattice_nodes(lattice, element)[c];
}

// Adds vertices: rows_local without its decisions for each, since most of a sweep is this.
static inline __attribute__((always_inline)) void add_of(Box *box, const Rows *rows, bool single,
                                                         bool displaced, const void *row,
                                                         const int *vertex, int count)
{
    Box own = *box;
    for (int c = 0; c < count; c++) {
        const long at = (long)vertex[c] * ROW;
        const float *u = (const float *)row + at;
        const double *x = (const double *)row + at, *rest = rows->rest[vertex[c]];
        Vec3 place =
            single ? vec3((double)u[0], (double)u[1], (double)u[2]) : vec3(x[0], x[1], x[2]);
        if (displaced)
            place = vec3_add(vec3(rest[0], rest[1], rest[2]), place);
        box_add(&own, place);
    }
    *box = own;
}

static void add_vertices(Box *box, const Rows *rows, const void *row, const int *vertex, int count)
{
    if (rows->precision == PRECISION_SINGLE)
        add_of(box, rows, true, true, row, vertex, count);
    else
        add_of(box, rows, false, rows->displaced, row, vertex, count);
}

static void add_corners(Box *box, const CutAdapt *adapt, const void *row, int element)
{
    if (cut_lattice_is_leaf(adapt->lattice, element)) { // most are, and have all
        add_vertices(box, adapt->rows, row, cut_lattice_nodes(adapt->lattice, element),
                     NODE_CORNERS);
        return;
    }
    int vertex[NODE_CORNERS], count = 0;
    for (int c = 0; c < NODE_CORNERS; c++) {
        vertex[count] = corner_of(adapt->lattice, element, c);
        count += vertex[count] >= 0;
    }
    add_vertices(box, adapt->rows, row, vertex, count);
    // Of what is divided and partly filled the children tell how far it reaches.
    const int first = cut_lattice_first_child(adapt->lattice, element);
    const unsigned children = cut_lattice_children(adapt->lattice, element);
    for (int k = 0; count < NODE_CORNERS && k < __builtin_popcount(children); k++)
        add_corners(box, adapt, row, first + k);
}

// Returns the box around the corners of an element, in the rows' coordinates.
static Box box_around(const CutAdapt *adapt, const void *row, int element)
{
    Box box = box_empty();
    add_corners(&box, adapt, row, element);
    return box;
}

// Returns the distance of a box from the axis of a path, about: from that point of the axis which
// is nearest to the box's middle. `along`: where that is, from 0 to 1.
static double distance_of(const Box *box, const Approach *path, double *along)
{
    const Vec3 axis = vec3_sub(path->to, path->from), middle = box_middle(box);
    const double length2 = vec3_dot(axis, axis);
    *along = length2 > 0.0
                 ? fmin(1.0, fmax(0.0, vec3_dot(vec3_sub(middle, path->from), axis) / length2))
                 : 0.0;
    const Vec3 point = vec3_madd(path->from, *along, axis);
    const double at[3] = {point.x, point.y, point.z};
    double square = 0.0;
    for (int d = 0; d < 3; d++) {
        const double off = fmax(0.0, fmax(box->low[d] - at[d], at[d] - box->high[d]));
        square += off * off;
    }
    const double distance = sqrt(square);
    if (!(path->thick > 0.0))
        return distance;
    // Beyond a flat place it is out of reach by as much as it is beyond.
    const Vec3 half = vec3_scale(0.5, box_size(box)), across = path->across;
    const double beyond = fabs(vec3_dot(across, vec3_sub(middle, path->from))) -
                          fabs(across.x) * half.x - fabs(across.y) * half.y -
                          fabs(across.z) * half.z - path->thick;
    return fmax(distance, path->reach + beyond);
}

// Returns how far a path reaches from its axis [m]: less where time is short, but what the tool
// touches is fine at any scale.
static double reach_of(const CutAdapt *adapt, const Approach *path)
{
    if (path->reach > 0.0)
        return path->reach;
    const double least = fmax(NEAR_CELLS * adapt->size, path->radius + SKIN_CELLS * adapt->size),
                 whole = adapt->state->fineness * fmax(REACHES * path->radius, least),
                 touched = fmin(whole, path->radius + adapt->size);
    return fmax(touched, whole / adapt->state->scale);
}

// True for what a tool touches, or is next to that.
static bool is_touched(const CutAdapt *adapt, const Approach *path, double distance)
{
    return distance < path->radius + adapt->size;
}

// Returns the level that is fine enough at a distance from a path: coarser where time is short, but
// not where the tool touches, since contact with large elements locks.
static int level_of(const CutAdapt *adapt, const Approach *path, double distance)
{
    const int levels = adapt->lattice->levels;
    int level = is_touched(adapt, path, distance) ? 0 : levels - (int)adapt->state->finest;
    level = level > 0 ? level : 0;
    for (double edge = 2.0 * FINE * adapt->size * (double)(1 << level);
         edge <= path->radius && level < levels; edge *= 2.0)
        level++;
    return level;
}

// ---------------------------------------------------------------------------------------------
// Paths

void cut_adapt_approach(CutAdapt *adapt, const Approach *approach, int count)
{
    const Rows *rows = adapt->rows;
    adapt->approach_count = 0;
    for (int i = 0; i < count && i < APPROACH_MOST; i++) {
        const Region there = {.kind = REGION_CAPSULE,
                              .from = approach[i].from,
                              .to = approach[i].to,
                              .radius = approach[i].radius};
        const Region here = rows_region(rows, &there);
        Approach *own = &adapt->approach[adapt->approach_count++];
        *own = approach[i];
        own->from = here.from;
        own->to = here.to;
        own->across = rows_turn_in(rows, approach[i].across);
    }
}

static double motion_of(const Approach *a, const Approach *b)
{
    return fmax(vec3_length(vec3_sub(a->from, b->from)), vec3_length(vec3_sub(a->to, b->to)));
}

// True if a sweep is due: something waits, a path has moved, or it is long since the last one.
static bool is_due(const CutAdapt *adapt)
{
    const AdaptState *state = adapt->state;
    bool moved = state->count != adapt->approach_count;
    for (int i = 0; i < adapt->approach_count && !moved; i++)
        moved = motion_of(&adapt->approach[i], &state->swept[i]) > MOVED * adapt->size ||
                fabs(adapt->approach[i].reach - state->swept[i].reach) > MOVED * adapt->size ||
                adapt->approach[i].radius != state->swept[i].radius;
    return moved || state->waits || state->age >= SWEEP_TICKS;
}

// ---------------------------------------------------------------------------------------------
// Wishes

static bool presses_more(const AdaptWish *a, const AdaptWish *b)
{
    if (a->urgent != b->urgent)
        return a->urgent;
    return a->distance != b->distance ? a->distance < b->distance : a->element < b->element;
}

static void add_wish(CutAdapt *adapt, const AdaptWish *wish)
{
    adapt->wished++;
    int at = adapt->wish_count;
    if (at == ADAPT_WISHES && !presses_more(wish, &adapt->wish[at - 1]))
        return;
    adapt->wish_count += at < ADAPT_WISHES;
    at = adapt->wish_count - 1;
    for (; at > 0 && presses_more(wish, &adapt->wish[at - 1]); at--)
        adapt->wish[at] = adapt->wish[at - 1];
    adapt->wish[at] = *wish;
}

// True if a tool is about to touch what is this far from the axis of its path, at `along`.
static bool is_urgent(const CutAdapt *adapt, const Approach *path, double distance, double along)
{
    return is_touched(adapt, path, distance) && approach_time(path, along) < URGENT_TIME;
}

// Wishes that a leaf is divided if one of these paths (a bit each) needs it.
static void look_at_leaf(CutAdapt *adapt, const void *row, int leaf, unsigned paths)
{
    const int level = adapt->lattice->element[leaf].level;
    const Box box = box_around(adapt, row, leaf);
    AdaptWish wish = {.element = leaf, .free = true, .distance = (double)INFINITY};
    for (; paths != 0; paths &= paths - 1) {
        const Approach *path = &adapt->approach[__builtin_ctz(paths)];
        double along;
        const double distance = distance_of(&box, path, &along);
        if (level <= level_of(adapt, path, distance) || distance >= reach_of(adapt, path))
            continue;
        wish.free &= path->reach == 0.0 && !is_touched(adapt, path, distance);
        wish.urgent |= is_urgent(adapt, path, distance, along);
        wish.distance = fmin(wish.distance, distance - path->radius);
    }
    if (wish.distance < (double)INFINITY)
        add_wish(adapt, &wish);
}

static void look_at(CutAdapt *adapt, const void *row, int element, unsigned paths)
{
    const CutLattice *lattice = adapt->lattice;
    const CutElement *of = &lattice->element[element];
    if (of->level == 0)
        return;
    if (!lattice->divided[element]) {
        look_at_leaf(adapt, row, element, paths);
        return;
    }
    const int count = __builtin_popcount(cut_lattice_children(lattice, element));
    const int child = cut_lattice_first_child(lattice, element);
    for (int k = 0; k < count && of->level > 1; k++)
        look_at(adapt, row, child + k, paths);
}

// Finds how far each path reaches, and the boxes around their axes.
static void bound_paths(CutAdapt *adapt)
{
    for (int i = 0; i < adapt->approach_count; i++) {
        const Approach *path = &adapt->approach[i];
        adapt->reach[i] = reach_of(adapt, path);
        adapt->axis[i] = box_empty();
        box_add(&adapt->axis[i], path->from);
        box_add(&adapt->axis[i], path->to);
    }
}

// Returns bits of the paths that reach a box grown by a margin [m].
static unsigned paths_near(const CutAdapt *adapt, const Box *box, double margin)
{
    unsigned paths = 0;
    for (int i = 0; i < adapt->approach_count; i++) {
        const Box *axis = &adapt->axis[i];
        const double reach = adapt->reach[i] + margin;
        bool apart = false;
        for (int d = 0; d < 3; d++)
            apart |= axis->low[d] - reach > box->high[d] || axis->high[d] + reach < box->low[d];
        paths |= (unsigned)!apart << i;
    }
    return paths;
}

// Makes the box of a brick, and looks at those of its elements that these paths reach.
static void look_at_brick(CutAdapt *adapt, const void *row, int brick, unsigned paths)
{
    const CutWindow *window = &adapt->lattice->window[adapt->brick_first + brick];
    Box all = box_empty();
    for (int e = window->first; e < window->end; e++) {
        const Box box = box_around(adapt, row, e);
        for (int d = 0; d < 3; d++) {
            all.low[d] = box.low[d] < all.low[d] ? box.low[d] : all.low[d];
            all.high[d] = box.high[d] > all.high[d] ? box.high[d] : all.high[d];
        }
        const unsigned near = paths == 0 ? 0 : paths & paths_near(adapt, &box, 0.0);
        if (near != 0)
            look_at(adapt, row, e, near);
    }
    for (int d = 0; d < 3; d++) {
        adapt->box[brick].low[d] = (float)all.low[d];
        adapt->box[brick].high[d] = (float)all.high[d];
    }
}

// Finds the leaves that should be divided.
static void sweep(CutAdapt *adapt, const void *row)
{
    const double brick_edge = adapt->size * (double)(WINDOW_EDGE << adapt->lattice->levels);
    bound_paths(adapt);
    for (int b = 0; b < adapt->brick_count; b++) {
        const AdaptBox *kept = &adapt->box[b];
        Box box;
        for (int d = 0; d < 3; d++) {
            box.low[d] = (double)kept->low[d];
            box.high[d] = (double)kept->high[d];
        }
        const unsigned paths = paths_near(adapt, &box, STALE * brick_edge);
        if (paths != 0)
            look_at_brick(adapt, row, b, paths);
    }
    adapt->state->age = 0;
    adapt->state->count = adapt->approach_count;
    // Paths that are no more leave no trace in the state.
    memset(adapt->state->swept, 0, sizeof adapt->state->swept);
    memcpy(adapt->state->swept, adapt->approach,
           (size_t)adapt->approach_count * sizeof *adapt->approach);
}

// Makes the boxes whose turn it is.
static void make_boxes(CutAdapt *adapt, const void *row)
{
    int64_t *next = &adapt->state->brick;
    for (int k = 0; k < (adapt->brick_count + BOX_TICKS - 1) / BOX_TICKS; k++) {
        *next = *next + 1 < adapt->brick_count ? *next + 1 : 0;
        look_at_brick(adapt, row, (int)*next, 0);
    }
}

// Wishes that leaves under stress are divided; those of the finest level keep what is above them
// from merging.
static void look_at_stressed(CutAdapt *adapt)
{
    const CutLattice *lattice = adapt->lattice;
    for (int k = 0; k < adapt->stressed_count; k++) {
        const int leaf = adapt->stressed[k];
        // The tick's cuts may have divided it.
        if (!cut_lattice_is_leaf(lattice, leaf))
            continue;
        const int parent = cut_lattice_parent(lattice, leaf);
        if (parent >= 0)
            bits_add(adapt->is_stressed, parent - lattice->level_first[1]);
        if (lattice->element[leaf].level > 0)
            add_wish(adapt, &(AdaptWish){.element = leaf});
    }
}

static void forget_stressed(CutAdapt *adapt)
{
    const CutLattice *lattice = adapt->lattice;
    for (int k = 0; k < adapt->stressed_count; k++) {
        const int parent = cut_lattice_parent(lattice, adapt->stressed[k]);
        if (parent >= 0)
            bits_remove(adapt->is_stressed, parent - lattice->level_first[1]);
    }
    adapt->stressed_count = 0;
}

// Divides what presses most. Returns how many.
static int divide(CutAdapt *adapt)
{
    // What waits is done in some ticks, what a tool is about to touch now.
    const int even = (adapt->wished + SPREAD_TICKS - 1) / SPREAD_TICKS + 2;
    const int budget = even < ADAPT_BUDGET ? even : ADAPT_BUDGET;
    int element[ADAPT_WISHES] = {0}, count = 0;
    adapt->free = true;
    for (int w = 0; w < adapt->wish_count; w++)
        if (adapt->wish[w].urgent || w < budget) {
            adapt->free &= adapt->wish[w].free;
            element[count++] = adapt->wish[w].element;
        }
    const int divided = cut_lattice_divide(adapt->lattice, element, count);
    adapt->state->waits = divided > 0;
    adapt->divided += divided;
    // Those for which there is no room wait for the next sweep, and keep nothing else waiting.
    for (int k = 0; k < count; k++)
        adapt->refused += cut_lattice_is_leaf(adapt->lattice, element[k]);
    return divided;
}

// ---------------------------------------------------------------------------------------------
// Merges

// True if no path needs the children of an element, nor will soon.
static bool is_left(const CutAdapt *adapt, const void *row, int element)
{
    const Box box = box_around(adapt, row, element);
    for (int i = 0; i < adapt->approach_count; i++) {
        const Approach *path = &adapt->approach[i];
        double along;
        const double beyond = path->reach > 0.0 ? LEAVES_PLACE * adapt->size
                                                : LEAVES * fmax(path->radius, 2.0 * adapt->size),
                     distance = distance_of(&box, path, &along) - beyond;
        if (adapt->lattice->element[element].level > level_of(adapt, path, distance) &&
            distance < reach_of(adapt, path))
            return false;
    }
    return true;
}

// Finds elements whose children may merge, from where the last search ended on.
static void find_merges(CutAdapt *adapt, const void *row)
{
    const int cells = adapt->lattice->level_first[1], words = words_of(adapt->lattice);
    int64_t *next = &adapt->state->next;
    int looks = 0, word = (int)(*next / 64);
    uint64_t left = adapt->family[word] & (~UINT64_C(0) << (*next % 64));
    adapt->merge_count = 0;
    for (int w = 0; w < words && w < LOOK_WORDS; w++) {
        while (left != 0) {
            const int at = bits_take(&left, word), element = cells + at;
            *next = at;
            if (looks++ == LOOKS || adapt->merge_count == MERGE_BUDGET)
                return;
            if (!bits_has(adapt->is_stressed, at) && is_left(adapt, row, element) &&
                cut_lattice_can_merge(adapt->lattice, element) &&
                cut_masses_residual(adapt->masses, element) < CUT_MERGE_RESIDUAL)
                adapt->merge[adapt->merge_count++] = element;
        }
        word = word + 1 < words ? word + 1 : 0;
        left = adapt->family[word];
        *next = 64 * (int64_t)word;
    }
}

static int merge(CutAdapt *adapt)
{
    int merged = 0;
    for (int m = 0; m < adapt->merge_count; m++) {
        if (!cut_lattice_can_merge(adapt->lattice, adapt->merge[m]))
            continue;
        cut_lattice_merge(adapt->lattice, adapt->merge[m]);
        merged++;
    }
    adapt->merged += merged;
    return merged;
}

int cut_adapt_step(CutAdapt *adapt, const void *row, bool *merged)
{
    adapt->state->age++;
    adapt->wish_count = adapt->wished = 0;
    make_boxes(adapt, row);
    look_at_stressed(adapt);
    if (is_due(adapt))
        sweep(adapt, row);
    // Nothing merges while something is divided.
    adapt->free = false;
    int changed = adapt->wished > 0 ? divide(adapt) : 0;
    *merged = changed == 0;
    if (*merged) {
        adapt->state->waits = 0;
        find_merges(adapt, row);
        changed = merge(adapt);
    }
    forget_stressed(adapt);
    return changed;
}

// ---------------------------------------------------------------------------------------------
// The time budget

enum { LEVEL_MOST = 8 }; // of BODY_ADAPT_LEVEL
static const double SCALE_LEAST = 1e-3;
static const double FINENESS_LEAST = 0.1, FINENESS_MOST = 10.0; // far beyond what drives it

bool cut_adapt_set(CutAdapt *adapt, BodyParameter parameter, double value)
{
    if (parameter == BODY_ADAPT_SCALE)
        adapt->state->scale = fmax(value, SCALE_LEAST);
    else if (parameter == BODY_ADAPT_LEVEL)
        adapt->state->finest = (int64_t)value;
    else if (parameter == BODY_ADAPT_ERROR && adapt->state->error > 0.0)
        adapt->state->error = value;
    else if (parameter == BODY_ADAPT_FINENESS)
        adapt->state->fineness = value;
    else
        return false;
    adapt->state->age = SWEEP_TICKS; // what was found holds no more
    return true;
}

bool cut_adapt_get(const CutAdapt *adapt, BodyParameter parameter, double *value)
{
    const AdaptState *state = adapt->state;
    switch (parameter) {
    case BODY_ADAPT_SCALE:
        *value = state->scale;
        return true;
    case BODY_ADAPT_LEVEL:
        *value = (double)state->finest;
        return true;
    case BODY_ADAPT_ERROR:
        *value = state->error;
        return state->error > 0.0;
    case BODY_ADAPT_FINENESS:
        *value = state->fineness;
        return true;
    default:
        return false;
    }
}

int cut_adapt_finest(const CutAdapt *adapt)
{
    int level = 0;
    while (level < adapt->lattice->levels && adapt->lattice->leaf_at_level[level] == 0)
        level++;
    return adapt->lattice->levels - level;
}

// ---------------------------------------------------------------------------------------------
// What follows from the lattice

static void find_family(CutAdapt *adapt, int element)
{
    const CutLattice *lattice = adapt->lattice;
    if (element < lattice->level_first[1])
        return;
    const CutElement *of = &lattice->element[element];
    bool could = lattice->divided[element] && of->mergeable;
    const int child = cut_lattice_first_child(lattice, element);
    const int count = __builtin_popcount(cut_lattice_children(lattice, element));
    for (int k = 0; k < count && could; k++)
        could = !lattice->divided[child + k];
    if (could)
        bits_add(adapt->family, element - lattice->level_first[1]);
    else
        bits_remove(adapt->family, element - lattice->level_first[1]);
}

void cut_adapt_follow(CutAdapt *adapt)
{
    const CutLattice *lattice = adapt->lattice;
    for (int i = 0; i < lattice->changes.element_count; i++) {
        const int element = lattice->changes.element[i];
        find_family(adapt, element);
        const int parent = cut_lattice_parent(lattice, element);
        if (parent >= 0)
            find_family(adapt, parent);
    }
}

bool cut_adapt_derive(CutAdapt *adapt)
{
    const AdaptState *state = adapt->state;
    const CutLattice *lattice = adapt->lattice;
    const int words = words_of(lattice);
    memset(adapt->family, 0, (size_t)words * sizeof *adapt->family);
    for (int e = lattice->level_first[1]; e < lattice->element_count; e++)
        find_family(adapt, e);
    return state->age >= 0 && state->age <= SWEEP_TICKS && state->next >= 0 &&
           state->next < 64 * (int64_t)words && state->brick >= 0 &&
           state->brick < adapt->brick_count && state->count >= 0 &&
           state->count <= APPROACH_MOST && state->scale >= SCALE_LEAST && state->scale <= 1e9 &&
           state->finest >= 0 && state->finest <= LEVEL_MOST && state->error >= 0.0 &&
           state->error <= 1.0 && (state->error > 0.0) == adapt->driven &&
           state->fineness >= FINENESS_LEAST && state->fineness <= FINENESS_MOST;
}

// ---------------------------------------------------------------------------------------------

void cut_adapt_create(CutAdapt *adapt, CutLattice *lattice, const CutMasses *masses, double error,
                      const char *name, Arena *arena, StateList *state)
{
    *adapt = (CutAdapt){.lattice = lattice,
                        .masses = masses,
                        .rows = &masses->vertices->rows,
                        .size = masses->size,
                        .driven = error > 0.0};
    while (lattice->window[adapt->brick_first].level < lattice->levels)
        adapt->brick_first++;
    adapt->brick_count = lattice->window_count - adapt->brick_first;
    const int words = words_of(lattice);
    adapt->family = ALLOCATE(ARENA_TOPOLOGY, words, uint64_t, "elements that may merge");
    adapt->is_stressed = ALLOCATE(ARENA_TOPOLOGY, words, uint64_t, "elements above stressed ones");
    adapt->state = ALLOCATE(ARENA_TOPOLOGY, 1, AdaptState, "adaptation");
    adapt->box = ALLOCATE(ARENA_TOPOLOGY, adapt->brick_count, AdaptBox, "boxes of bricks");
    adapt->state->scale = 1.0;
    adapt->state->finest = LEVEL_MOST;
    adapt->state->error = error;
    adapt->state->fineness = 1.0;
    state_add(state, adapt->state, sizeof *adapt->state, "%s/adaptation", name);
    state_add(state, adapt->box, (size_t)adapt->brick_count * sizeof *adapt->box,
              "%s/adaptation_boxes", name);
    for (int b = 0; b < adapt->brick_count; b++)
        look_at_brick(adapt, vertices_row(masses->vertices), b, 0);
    cut_adapt_derive(adapt);
}
