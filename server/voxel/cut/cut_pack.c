// One window's batches from its leaves; part of cut_windows.c.
#include "voxel/cut/cut_pack.h"

#include <string.h>

// A leaf of a window.
typedef struct PackedLeaf {
    uint64_t key; // ascending
    int element;
    unsigned mask;
} PackedLeaf;

typedef struct Packing {
    int plain, hanging;                                                    // how many
    PackedLeaf plain_leaf[WINDOW_ELEMENTS], hanging_leaf[WINDOW_ELEMENTS]; // in order
} Packing;

static int vertex_count_of(unsigned mask)
{
    return NODE_CORNERS + __builtin_popcount(mask);
}

// Nearly in order as a rule.
static void insert(PackedLeaf *list, int count, PackedLeaf leaf)
{
    while (count > 0 && list[count - 1].key > leaf.key) {
        list[count] = list[count - 1];
        count--;
    }
    list[count] = leaf;
}

static const double NO_TURN[4] = {1.0, 0.0, 0.0, 0.0};

// The rotation that an element has, or the one that it came of.
static const double *turn_of(const CutWindows *windows, int element)
{
    while (element >= 0 && windows->place[element] < 0)
        element = windows->lattice->element[element].parent;
    if (element < 0)
        return NO_TURN;
    const int place = windows->place[element];
    return windows->last[place / LANES][place % LANES];
}

// Sorts the window's leaves.
static void list_leaves(const CutWindows *windows, int window, Packing *to)
{
    const CutLattice *lattice = windows->lattice;
    const CutWindow *own = &lattice->window[window];
    to->plain = to->hanging = 0;
    for (int e = own->first; e < own->end; e++) {
        if (!cut_lattice_is_leaf(lattice, e))
            continue;
        const uint64_t number = (uint64_t)(e - own->first);
        const unsigned mask = own->level == 0 ? 0 : template_mask_of(cut_lattice_nodes(lattice, e));
        PackedLeaf leaf = {.element = e, .mask = mask};
        if (mask == 0) {
            leaf.key = (uint64_t)lattice->element[e].material << 32 | number;
            insert(to->plain_leaf, to->plain++, leaf);
        } else {
            leaf.key = (uint64_t)vertex_count_of(mask) << 48 | (uint64_t)mask << 16 | number;
            insert(to->hanging_leaf, to->hanging++, leaf);
        }
    }
}

static int class_of(const CutWindows *windows, int element)
{
    const CutElement *e = &windows->lattice->element[element];
    return e->level * windows->material_count + e->material - 1;
}

// Returns how many batches there are now.
static int pack_plain(CutWindows *windows, int window, const Packing *from)
{
    const CutLattice *lattice = windows->lattice;
    const int first = windows->first_plain[window];
    int batch = first - 1, lane = LANES, element_class = -1;
    for (int k = 0; k < from->plain; k++) {
        const int e = from->plain_leaf[k].element;
        const int own_class = class_of(windows, e);
        if (lane == LANES || own_class != element_class) {
            batch++, lane = 0, element_class = own_class;
            windows->plain_class[batch] = own_class;
            for (int i = 0; i < NODE_CORNERS * LANES; i++)
                windows->plain_vertex[batch][i / LANES][i % LANES] = lattice->vertex_capacity;
        }
        const int *node = cut_lattice_nodes(lattice, e);
        for (int n = 0; n < NODE_CORNERS; n++)
            windows->plain_vertex[batch][n][lane] = node[n];
        windows->place[e] = batch * LANES + lane++;
    }
    return batch + 1 - first;
}

// Numbers that are already there stay; those beyond the shape's vertices are zero.
static void put_numbers(CutWindows *windows, int batch, int lane, unsigned mask)
{
    unsigned *held = &windows->hanging_mask[batch][lane];
    if (*held == mask)
        return;
    const int count = TABLE_HEAD + vertex_count_of(mask) * TABLE_ROW;
    const int before = TABLE_HEAD + vertex_count_of(*held) * TABLE_ROW;
    const void *number = template_cache_numbers(windows->templates, mask);
    if (windows->templates->precision == PRECISION_SINGLE) {
        float *to = (float *)windows->tables[batch].number + lane;
        for (int i = 0; i < count; i++)
            to[i * LANES] = ((const float *)number)[i];
        for (int i = count; i < before; i++)
            to[i * LANES] = 0.0f;
    } else {
        double *to = (double *)windows->tables[batch].number + lane;
        for (int i = 0; i < count; i++)
            to[i * LANES] = ((const double *)number)[i];
        for (int i = count; i < before; i++)
            to[i * LANES] = 0.0;
    }
    *held = mask;
}

// The vertices that are there in the order of their nodes, then the spare one.
static void put_vertices(CutWindows *windows, int batch, int lane, const int *node, unsigned mask)
{
    int(*vertex)[LANES] = windows->hanging_vertex[batch];
    int count = 0;
    for (; count < NODE_CORNERS; count++)
        vertex[count][lane] = node[count];
    for (; mask != 0; mask &= mask - 1)
        vertex[count++][lane] = node[NODE_CORNERS + __builtin_ctz(mask)];
    for (; count < windows->tables[batch].count; count++)
        vertex[count][lane] = windows->lattice->vertex_capacity;
}

// A lane without an element is a plain cube that never deforms.
static void put_nothing(CutWindows *windows, int batch, int lane)
{
    put_numbers(windows, batch, lane, 0);
    windows->hanging_class[batch][lane] = windows->hanging_class[batch][0];
    for (int i = 0; i < windows->tables[batch].count; i++)
        windows->hanging_vertex[batch][i][lane] = windows->lattice->vertex_capacity;
}

static int pack_hanging(CutWindows *windows, int window, const Packing *from)
{
    const CutLattice *lattice = windows->lattice;
    const int batches = (from->hanging + LANES - 1) / LANES;
    for (int b = 0; b < batches; b++) {
        const int batch = windows->first_hanging[window] + b;
        const PackedLeaf *leaf = from->hanging_leaf + (long)b * LANES;
        const int lanes = from->hanging - b * LANES < LANES ? from->hanging - b * LANES : LANES;
        windows->tables[batch].count = vertex_count_of(leaf[lanes - 1].mask);
        for (int lane = 0; lane < lanes; lane++) {
            const int e = leaf[lane].element;
            put_numbers(windows, batch, lane, leaf[lane].mask);
            put_vertices(windows, batch, lane, cut_lattice_nodes(lattice, e), leaf[lane].mask);
            windows->hanging_class[batch][lane] = class_of(windows, e);
            windows->place[e] = (windows->plain_capacity + batch) * LANES + lane;
        }
        for (int lane = lanes; lane < LANES; lane++)
            put_nothing(windows, batch, lane);
    }
    return batches;
}

// Rotations by the places of before: those of coarser windows, of which leaves may have come, must
// still be theirs.
static void take_turns(const CutWindows *windows, const Packing *packing,
                       double turn[WINDOW_ELEMENTS][4])
{
    for (int k = 0; k < packing->plain; k++)
        memcpy(turn[k], turn_of(windows, packing->plain_leaf[k].element), sizeof turn[k]);
    for (int k = 0; k < packing->hanging; k++)
        memcpy(turn[packing->plain + k], turn_of(windows, packing->hanging_leaf[k].element),
               sizeof turn[0]);
}

static void clear_turns(CutWindows *windows, int window)
{
    const int first[2] = {windows->first_plain[window],
                          windows->plain_capacity + windows->first_hanging[window]};
    const int used[2] = {windows->plain_used[window], windows->hanging_used[window]};
    for (int kind = 0; kind < 2; kind++)
        for (int i = 0; i < used[kind] * LANES; i++)
            memcpy(windows->last[first[kind] + i / LANES][i % LANES], NO_TURN, sizeof NO_TURN);
}

static void put_turns(CutWindows *windows, const Packing *packing, double turn[WINDOW_ELEMENTS][4])
{
    for (int k = 0; k < packing->plain + packing->hanging; k++) {
        const int element = k < packing->plain ? packing->plain_leaf[k].element
                                               : packing->hanging_leaf[k - packing->plain].element;
        const int place = windows->place[element];
        memcpy(windows->last[place / LANES][place % LANES], turn[k], sizeof turn[k]);
    }
}

void cut_pack(CutWindows *windows, int window, bool turns)
{
    const CutWindow *own = &windows->lattice->window[window];
    double turn[WINDOW_ELEMENTS][4];
    Packing packing;
    list_leaves(windows, window, &packing);
    if (turns) {
        take_turns(windows, &packing, turn);
        clear_turns(windows, window);
    }
    for (int e = own->first; e < own->end; e++)
        windows->place[e] = -1;
    windows->plain_used[window] = (unsigned char)pack_plain(windows, window, &packing);
    windows->hanging_used[window] = (unsigned char)pack_hanging(windows, window, &packing);
    if (turns)
        put_turns(windows, &packing, turn);
}
