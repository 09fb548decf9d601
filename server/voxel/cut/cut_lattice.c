// SPDX-License-Identifier: MIT
// The elements and vertices that a cut body can ever have: creation, look-up, and what changes have
// in common.
#include "voxel/cut/cut_parts.h"

#include "base/bits.h"
#include "base/check.h"

#include <limits.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// Elements: all blocks of cells that a leaf covers, or, in a body that adapts, that hold a solid
// cell

static int blocks_along(const CutLattice *lattice, int level, int axis)
{
    return lattice->count[axis] >> level;
}

// Returns the initial leaf that covers a block entirely; -1: there are smaller ones, or void.
static int covering_leaf(const Layout *layout, int level, int i, int j, int k)
{
    const int leaf = layout_leaf_at(layout, i << level, j << level, k << level);
    return leaf >= 0 && layout->leaf[leaf].level >= level ? leaf : -1;
}

// Returns which children of a block exist: bits. Blocks of the level below are known.
static unsigned children_of(const CutLattice *lattice, int level, int i, int j, int k)
{
    unsigned children = 0;
    for (int c = 0; c < 8 && level > 0; c++)
        children |= (unsigned)(cut_parts_block(lattice, level - 1, 2 * i + (c & 1),
                                               2 * j + (c >> 1 & 1), 2 * k + (c >> 2)) >= 0)
                    << c;
    return children;
}

static bool exists(const CutLattice *lattice, const Layout *layout, int level, int i, int j, int k)
{
    return covering_leaf(layout, level, i, j, k) >= 0 ||
           (lattice->adapts && children_of(lattice, level, i, j, k) != 0);
}

// Marks the blocks that exist, of all levels; returns how many there are.
static int mark_elements(CutLattice *lattice, const Layout *layout)
{
    long count = 0;
    for (int level = 0; level <= lattice->levels; level++) {
        int *slot = lattice->lut[level];
        for (int k = 0; k < blocks_along(lattice, level, 2); k++)
            for (int j = 0; j < blocks_along(lattice, level, 1); j++)
                for (int i = 0; i < blocks_along(lattice, level, 0); i++, slot++) {
                    *slot = exists(lattice, layout, level, i, j, k) ? 0 : -1;
                    count += *slot == 0;
                }
    }
    ASSERT(count < INT_MAX);
    return (int)count;
}

// Returns a coordinate of a position on the Z curve of a window.
static int along_curve(int code, int axis)
{
    return (code >> axis & 1) | (code >> (axis + 3) & 1) << 1;
}

static void number_window(CutLattice *lattice, const Layout *layout, int level, const int window[3])
{
    const int nx = blocks_along(lattice, level, 0), ny = blocks_along(lattice, level, 1);
    const int nz = blocks_along(lattice, level, 2), first = lattice->element_count;
    for (int code = 0; code < WINDOW_ELEMENTS; code++) {
        const int i = WINDOW_EDGE * window[0] + along_curve(code, 0);
        const int j = WINDOW_EDGE * window[1] + along_curve(code, 1);
        const int k = WINDOW_EDGE * window[2] + along_curve(code, 2);
        if (i >= nx || j >= ny || k >= nz)
            continue;
        int *slot = &lattice->lut[level][((long)k * ny + j) * nx + i];
        if (*slot < 0)
            continue;
        // Numbered along the curve.
        const int leaf = covering_leaf(layout, level, i, j, k);
        *slot = lattice->element_count++;
        lattice->element[*slot] = (CutElement){
            .cell = {(short)(i << level), (short)(j << level), (short)(k << level)},
            .level = (unsigned char)level,
            .material = leaf >= 0 ? layout->leaf[leaf].material : 0,
        };
    }
    // Empty windows do not exist.
    if (lattice->element_count > first)
        lattice->window[lattice->window_count++] =
            (CutWindow){first, lattice->element_count, (unsigned char)level};
}

static int windows_along(const CutLattice *lattice, int level, int axis)
{
    return (blocks_along(lattice, level, axis) + WINDOW_EDGE - 1) / WINDOW_EDGE;
}

static void number_elements(CutLattice *lattice, const Layout *layout)
{
    for (int level = 0; level <= lattice->levels; level++) {
        lattice->level_first[level] = lattice->element_count;
        int at[3];
        for (at[2] = 0; at[2] < windows_along(lattice, level, 2); at[2]++)
            for (at[1] = 0; at[1] < windows_along(lattice, level, 1); at[1]++)
                for (at[0] = 0; at[0] < windows_along(lattice, level, 0); at[0]++)
                    number_window(lattice, layout, level, at);
    }
    for (int level = lattice->levels + 1; level < VOXEL_LEVELS_MAX + 2; level++)
        lattice->level_first[level] = lattice->element_count;
}

// Gathers what an element is from its children, which are complete: those of lower levels come
// first.
static void gather_from_children(CutLattice *lattice, int e)
{
    CutElement *element = &lattice->element[e];
    const int level = element->level - 1, at = e - lattice->level_first[1];
    const unsigned children =
        children_of(lattice, level + 1, element->cell[0] >> (level + 1),
                    element->cell[1] >> (level + 1), element->cell[2] >> (level + 1));
    bool first = true;
    lattice->children[at] = (unsigned char)children;
    element->whole = children == 0xff;
    for (int c = 0; c < 8; c++) {
        if (!(children >> c & 1))
            continue;
        const int number = cut_lattice_block(lattice, level, (element->cell[0] >> level) + (c & 1),
                                             (element->cell[1] >> level) + (c >> 1 & 1),
                                             (element->cell[2] >> level) + (c >> 2));
        const CutElement *child = &lattice->element[number];
        if (first) {
            element->material = child->material;
            lattice->child[at] = number;
        }
        first = false;
        element->whole &= child->whole;
        if (child->material != element->material)
            element->material = 0;
        // Of its six faces three are on the border of the element.
        for (int d = 0; d < 3; d++)
            lattice->meets[at] |=
                (unsigned char)(cut_parts_meets(lattice, number, 2 * d + (c >> d & 1))
                                << (2 * d + (c >> d & 1)));
    }
}

static void gather_families(CutLattice *lattice)
{
    for (int e = 0; e < lattice->element_count; e++) {
        CutElement *element = &lattice->element[e];
        if (element->level == 0)
            element->whole = true;
        else
            gather_from_children(lattice, e);
    }
}

// Returns the coarsest level of a body that adapts: no block is far larger than the body.
static int coarsest_level(const Layout *layout, int surface_level)
{
    int least = INT_MAX, most = 0;
    for (int d = 0; d < 3; d++) {
        const int n = layout->lattice_count[d];
        least = n < least ? n : least;
        most = n > most ? n : most;
    }
    while (surface_level > 0 && (1 << surface_level > most || 1 << surface_level > 4 * least))
        surface_level--;
    return surface_level > layout->levels ? surface_level : layout->levels;
}

static void create_elements(CutLattice *lattice, const char *name, const VoxelMaking *making,
                            Arena *arena)
{
    const Layout *layout = &making->layout;
    lattice->levels =
        lattice->adapts ? coarsest_level(layout, making->options->surface_level) : layout->levels;
    memcpy(lattice->lattice_count, layout->lattice_count, sizeof lattice->lattice_count);
    for (int d = 0; d < 3; d++) {
        const int step = 1 << lattice->levels;
        lattice->count[d] = (layout->lattice_count[d] + step - 1) / step * step;
    }
    // Look-up tables by level, and the most windows there can be.
    long windows = 0;
    for (int level = 0; level <= lattice->levels; level++) {
        long blocks = 1, within = 1;
        for (int d = 0; d < 3; d++) {
            blocks *= blocks_along(lattice, level, d);
            within *= windows_along(lattice, level, d);
        }
        lattice->lut[level] = ALLOCATE(ARENA_TOPOLOGY, blocks, int, "element table");
        windows += within;
    }
    lattice->window = ALLOCATE(ARENA_TOPOLOGY, windows, CutWindow, "windows");
    // All elements that can ever exist.
    const int elements = mark_elements(lattice, layout);
    lattice->element = ALLOCATE(ARENA_TOPOLOGY, elements, CutElement, "elements");
    // Numbers first: parents and children follow from them.
    number_elements(lattice, layout);
    ASSERT(lattice->element_count == elements);
    const int larger = elements - lattice->level_first[1];
    lattice->child = ALLOCATE(ARENA_TOPOLOGY, larger, int, "first children");
    lattice->children = ALLOCATE(ARENA_TOPOLOGY, larger, unsigned char, "children");
    lattice->meets = ALLOCATE(ARENA_TOPOLOGY, larger, unsigned char, "faces that meet");
    gather_families(lattice);
}

// ---------------------------------------------------------------------------------------------
// Everything else

static void create_scratch_of_merging(CutLattice *lattice, const char *name, Arena *arena)
{
    CutScratch *scratch = lattice->scratch;
    scratch->is_ended = ALLOCATE(ARENA_TOPOLOGY, lattice->vertex_capacity, bool, "ended vertices");
    scratch->noted =
        ALLOCATE(ARENA_TOPOLOGY, bits_words(lattice->element_count - lattice->level_first[1] + 1),
                 uint64_t, "noted divisions");
    lattice->changes.merged =
        ALLOCATE(ARENA_TOPOLOGY, lattice->most_larger, int, "merged elements");
    lattice->changes.ended = ALLOCATE(ARENA_TOPOLOGY, lattice->vertex_capacity, CutEnd, "ends");
    int words = lattice->vertex_capacity;
    for (int level = 0; level < FREE_LEVELS; level++) {
        words = (words + FREE_WORD - 1) / FREE_WORD;
        scratch->free.words[level] = words;
        scratch->free.bits[level] = ALLOCATE(ARENA_TOPOLOGY, words, uint64_t, "free rows");
    }
}

static void create_scratch(CutLattice *lattice, const char *name, Arena *arena)
{
    CutScratch *scratch = ALLOCATE(ARENA_TOPOLOGY, 1, CutScratch, "cut scratch");
    lattice->scratch = scratch;
    // Sizes of the lattice.
    long points = 1;
    for (int d = 0; d < 3; d++) {
        scratch->id_points[d] = lattice->lattice_count[d] + 1;
        scratch->points[d] = lattice->adapts ? lattice->count[d] + 1 : scratch->id_points[d];
        points *= scratch->points[d];
    }
    const int elements = lattice->element_count, cells = lattice->level_first[1];
    // Where leaves and vertices are.
    scratch->grid_level = lattice->levels > 0;
    scratch->grid = ALLOCATE(
        ARENA_TOPOLOGY,
        cut_parts_grid(lattice, lattice->count[0], lattice->count[1], lattice->count[2]) + 1, int,
        "leaves of blocks");
    scratch->point = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)lattice->vertex_capacity,
                                    sizeof *scratch->point, "%s/%s", name, "points of vertices");
    // At most half of the places are taken.
    while (scratch->head_bits < 31 && 1L << scratch->head_bits < 2L * lattice->vertex_capacity)
        scratch->head_bits++;
    if (1L << scratch->head_bits >= points)
        scratch->head_bits = 0;
    scratch->head_count = scratch->head_bits == 0 ? points : 1L << scratch->head_bits;
    scratch->head = ALLOCATE(ARENA_TOPOLOGY, scratch->head_count, int, "first vertices");
    scratch->next = ALLOCATE(ARENA_TOPOLOGY, lattice->vertex_capacity, int, "next vertices");
    scratch->visited = ALLOCATE(ARENA_TOPOLOGY, bits_words(points), uint64_t, "visited points");
    if (lattice->removable)
        scratch->is_lost = ALLOCATE(ARENA_TOPOLOGY, lattice->vertex_capacity, bool, "lost");
    // What a change marks.
    scratch->fresh = ALLOCATE(ARENA_TOPOLOGY, lattice->adapts ? 0 : elements - cells, int,
                              "newly wanted divisions");
    lattice->mark = ALLOCATE(ARENA_TOPOLOGY, elements, unsigned char, "marks of elements");
    // Tables of a divided element.
    for (int at = 0; at < 27; at++)
        scratch->node_at[at] = (signed char)node_at_offset(at % 3, at / 3 % 3, at / 9);
    cut_points_list_parents(scratch);
    // Room for the largest change possible.
    CutChanges *changes = &lattice->changes;
    // Leaves, now or before; faces that break, and those of new leaves of level 0, of which none is
    // broken in a body that adapts.
    const long leaves = 2L * (lattice->most_cells + (long)lattice->most_larger);
    const long breaking = lattice->vertex_capacity / 4 + 1 + 6 * CUT_REMOVE_MOST;
    const long faces = breaking + (lattice->adapts ? 0 : 6L * lattice->most_cells);
    const long most_faces = faces < 3L * cells ? faces : 3L * cells;
    changes->element =
        ALLOCATE(ARENA_TOPOLOGY, leaves < elements ? leaves : elements, int, "changed elements");
    changes->birth = ALLOCATE(ARENA_TOPOLOGY, lattice->vertex_capacity, CutBirth, "born vertices");
    if (lattice->removable)
        changes->lost = ALLOCATE(ARENA_TOPOLOGY, lattice->vertex_capacity, int, "lost vertices");
    changes->face = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)most_faces, sizeof *changes->face,
                                   "%s/%s", name, "changed faces");
    if (lattice->adapts)
        create_scratch_of_merging(lattice, name, arena);
}

// Sets how many leaves there may be: as many as a pool of vertices is good for. A cell takes about
// one, and more at the surface, where families are not whole; larger ones come with them, most
// around a slanting cut: three with eight cells through the middle of a cube of 64^3.
static void limit_leaves(CutLattice *lattice, const unsigned char *divided, int pool)
{
    enum { LEAST = 32 };
    const int first = lattice->level_first[1], end = lattice->level_first[2];
    int families = 0, larger = 0;
    for (int e = first; e < lattice->element_count; e++) {
        const int parent = cut_lattice_parent(lattice, e);
        families += divided[e] && e < end;
        larger += !divided[e] && (parent < 0 || divided[parent]);
    }
    lattice->rest_families = families;
    const long most = families + pool / 6 + LEAST,
               most_larger = larger + pool / 4 + CUT_FAMILY * LEAST;
    if (end > first)
        lattice->most_cells = CUT_FAMILY * (most < end - first ? (int)most : end - first);
    if (most_larger < lattice->most_larger)
        lattice->most_larger = (int)most_larger;
}

// Creates rows for the nodes of as many leaves as there may be.
static void create_leaf_rows(CutLattice *lattice, const char *name, Arena *arena)
{
    const int first = lattice->level_first[1], end = lattice->level_first[2];
    const int rows[2] = {lattice->most_cells / CUT_FAMILY, lattice->most_larger};
    lattice->leaf_row =
        ALLOCATE(ARENA_TOPOLOGY, lattice->element_count - first, int, "rows of leaves");
    if (end > first)
        lattice->family_row = ALLOCATE(ARENA_TOPOLOGY, end - first, int, "rows of families");
    for (int kind = 0; kind < 2; kind++)
        lattice->scratch->spare_row[kind] = ALLOCATE(ARENA_TOPOLOGY, rows[kind], int, "spare rows");
}

static void create_state(CutLattice *lattice, const char *name, Arena *arena, StateList *state)
{
    const size_t elements = (size_t)lattice->element_count, cells = (size_t)lattice->level_first[1];
    const size_t vertices = (size_t)lattice->vertex_capacity;
    lattice->divided = ALLOCATE(ARENA_TOPOLOGY, elements, unsigned char, "divided");
    lattice->broken = ALLOCATE(ARENA_TOPOLOGY, cells, unsigned char, "broken");
    lattice->vertex_id = ALLOCATE(ARENA_TOPOLOGY, vertices + 1, int, "cut vertex ids");
    lattice->vertex_count = ALLOCATE(ARENA_TOPOLOGY, 1, int64_t, "vertex count");
    lattice->anchor = ALLOCATE(ARENA_TOPOLOGY, vertices, signed char, "anchors");
    // The sets of bits, and the order in which vertices came.
    state_add(state, lattice->divided, elements, "%s/divided", name);
    state_add(state, lattice->broken, cells, "%s/broken", name);
    state_add(state, lattice->vertex_id, vertices * sizeof *lattice->vertex_id, "%s/vertex_ids",
              name);
    state_add(state, lattice->vertex_count, sizeof *lattice->vertex_count, "%s/vertex_count", name);
    if (lattice->removable)
        state_add(state, lattice->anchor, vertices, "%s/anchors", name);
    // Derived from these.
    lattice->corner = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)lattice->most_cells,
                                     sizeof *lattice->corner, "%s/%s", name, "corners");
    lattice->node = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)lattice->most_larger,
                                   sizeof *lattice->node, "%s/%s", name, "nodes");
    lattice->wanted =
        ALLOCATE(ARENA_TOPOLOGY, lattice->adapts ? 0 : elements - cells, int, "wanted divisions");
}

// Marks the vertices that keep their rows for ever: those on outer squares and, for a smooth
// surface, whose offsets are spread over them, the other corners of the cells there.
static void choose_kept(CutLattice *lattice, const char *name, const VoxelMaking *making,
                        Arena *arena)
{
    const LatticeMesh *mesh = &making->mesh;
    const VoxelOptions *options = making->options;
    const bool rests = making->rest_id != NULL;
    lattice->kept_end = rests ? making->kept : mesh->vertex_count;
    lattice->kept_id = ALLOCATE(ARENA_TOPOLOGY, lattice->kept_end, int, "ids of kept vertices");
    lattice->carried = ALLOCATE(ARENA_TOPOLOGY, lattice->kept_end, bool, "carried vertices");
    if (rests) {
        memcpy(lattice->kept_id, mesh->id, (size_t)lattice->kept_end * sizeof *mesh->id);
        return;
    }
    for (int v = 0; v < mesh->vertex_count; v++)
        lattice->kept_id[v] = v < mesh->surface_count || options->publish_all ? mesh->id[v] : -1;
    for (int e = 0; e < mesh->element_count && options->field != NULL; e++) {
        const int *corner = mesh->vertex[e];
        bool outer = false;
        for (int c = 0; c < NODE_CORNERS; c++)
            outer |= making->layout.leaf[e].level == 0 && corner[c] < mesh->surface_count;
        for (int c = 0; c < NODE_CORNERS && outer; c++)
            lattice->kept_id[corner[c]] = mesh->id[corner[c]];
    }
}

// Divides the blocks above the initial leaves.
static void divide_above(CutLattice *lattice, const Layout *layout)
{
    for (int e = lattice->level_first[1]; e < lattice->element_count; e++) {
        const CutElement *element = &lattice->element[e];
        const int level = element->level;
        lattice->divided[e] =
            covering_leaf(layout, level, element->cell[0] >> level, element->cell[1] >> level,
                          element->cell[2] >> level) < 0;
    }
}

// False with a status: more points than ids can express.
static bool check_ids(const CutLattice *lattice, const char *name, Status *status)
{
    double cells = 1.0, all = 1.0;
    for (int d = 0; d < 3; d++) {
        cells *= lattice->scratch->id_points[d];
        all *= lattice->scratch->points[d];
    }
    return !lattice->adapts || 8.0 * (cells + all) <= INT_MAX ||
           status_fail(status, STATUS_INVALID, "%s: more than %d points around its elements", name,
                       INT_MAX / 16);
}

bool cut_lattice_create(CutLattice *lattice, const VoxelMaking *making, Arena *arena,
                        StateList *state, Status *status)
{
    const char *name = making->options->body.name;
    const LatticeMesh *mesh = &making->mesh;
    const bool rests = making->rest_id != NULL;
    const int capacity = making->capacity, count = rests ? making->rest_count : mesh->vertex_count;
    *lattice = (CutLattice){.vertex_capacity = capacity,
                            .split_budget = making->options->split_budget,
                            .removable = making->options->body.removable,
                            .adapts = making->options->surface_level > 0};
    if (count > capacity)
        return status_fail(status, STATUS_INVALID, "%s: %d vertices do not fit vertex_capacity %d",
                           name, count, capacity);
    // Elements, then vertices as in the uncut body.
    create_elements(lattice, name, making, arena);
    lattice->most_cells = lattice->level_first[1];
    lattice->most_larger = lattice->element_count - lattice->most_cells;
    if (rests)
        limit_leaves(lattice, making->divided, capacity - count);
    create_scratch(lattice, name, arena);
    if (rests)
        create_leaf_rows(lattice, name, arena);
    if (!check_ids(lattice, name, status))
        return false;
    create_state(lattice, name, arena, state);
    memset(lattice->vertex_id, -1, (size_t)capacity * sizeof *lattice->vertex_id);
    memcpy(lattice->vertex_id, rests ? making->rest_id : mesh->id,
           (size_t)count * sizeof *mesh->id);
    *lattice->vertex_count = count;
    if (lattice->adapts) {
        divide_above(lattice, &making->layout);
        if (rests)
            memcpy(lattice->divided, making->divided, (size_t)lattice->element_count);
        choose_kept(lattice, name, making, arena);
        cut_merge_allow(lattice, making);
    }
    if (lattice->removable) // nothing is gone: as the ids say
        cut_points_find_anchors(lattice);
    const bool sound = cut_parts_derive(lattice);
    ASSERT(sound);
    if (lattice->adapts) {
        cut_split_divide_others(lattice);
        cut_lattice_forget_changes(lattice);
    }
    return true;
}

// ---------------------------------------------------------------------------------------------
// Looking up

int cut_lattice_window(const CutLattice *lattice, int element)
{
    int low = 0, high = lattice->window_count; // the first one after it
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (lattice->window[middle].end <= element)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

int cut_lattice_cell_at_load(const CutLattice *lattice, int i, int j, int k)
{
    return cut_parts_block(lattice, 0, i, j, k);
}

static int unless_gone(const CutLattice *lattice, int cell)
{
    return cell >= 0 && cut_lattice_is_gone(lattice, cell) ? -1 : cell;
}

int cut_lattice_cell(const CutLattice *lattice, int i, int j, int k)
{
    return unless_gone(lattice, cut_parts_block(lattice, 0, i, j, k));
}

void cut_lattice_cells(const CutLattice *lattice, const int point[3], int cell[8])
{
    const int i = point[0] - 1, j = point[1] - 1, k = point[2] - 1, *n = lattice->count;
    const long row = n[0], layer = row * n[1], at = k * layer + j * row + i;
    // Slots inside of the lattice.
    const unsigned inside = (i < 0 ? 0xaaU : 0xffU) & (i + 1 < n[0] ? 0xffU : 0x55U) &
                            (j < 0 ? 0xccU : 0xffU) & (j + 1 < n[1] ? 0xffU : 0x33U) &
                            (k < 0 ? 0xf0U : 0xffU) & (k + 1 < n[2] ? 0xffU : 0x0fU);
    for (int s = 0; s < 8; s++) {
        const long a = s & 1, b = s >> 1 & 1, c = s >> 2;
        cell[s] = inside >> s & 1 ? lattice->lut[0][at + a + b * row + c * layer] : -1;
        if (lattice->removable)
            cell[s] = unless_gone(lattice, cell[s]);
    }
}

int cut_lattice_leaf_of(const CutLattice *lattice, int cell)
{
    return cut_parts_leaf(lattice, cell);
}

void cut_parts_enter(CutLattice *lattice, const int cell[3], int level, int leaf)
{
    int *grid = lattice->scratch->grid;
    const int by = lattice->scratch->grid_level, step = 1 << by, edge = 1 << level;
    if (level < by) { // bits say which are leaves
        grid[cut_parts_grid(lattice, cell[0], cell[1], cell[2])] = CUT_CELLS;
        return;
    }
    for (int k = 0; k < edge; k += step)
        for (int j = 0; j < edge; j += step) {
            int *row = &grid[cut_parts_grid(lattice, cell[0], cell[1] + j, cell[2] + k)];
            for (int i = 0; i < edge >> by; i++)
                row[i] = leaf;
        }
}

int cut_lattice_across(const CutLattice *lattice, int cell, int direction)
{
    const short *at = lattice->element[cell].cell;
    const int axis = direction / 2, step = direction & 1 ? 1 : -1;
    return cut_parts_block(lattice, 0, at[0] + step * (axis == 0), at[1] + step * (axis == 1),
                           at[2] + step * (axis == 2));
}

int cut_lattice_beyond(const CutLattice *lattice, int cell, int axis)
{
    return unless_gone(lattice, cut_lattice_across(lattice, cell, 2 * axis + 1));
}

// ---------------------------------------------------------------------------------------------
// Changes

void cut_parts_list_element(CutLattice *lattice, int element)
{
    if (lattice->mark[element] & CUT_LISTED)
        return;
    lattice->mark[element] |= CUT_LISTED;
    lattice->changes.element[lattice->changes.element_count++] = element;
}

void cut_parts_list_lost(CutLattice *lattice, int vertex)
{
    if (lattice->scratch->is_lost[vertex])
        return;
    lattice->scratch->is_lost[vertex] = true;
    lattice->changes.lost[lattice->changes.lost_count++] = vertex;
}

void cut_parts_list_face(CutLattice *lattice, int cell, int axis)
{
    unsigned char *mark = &lattice->mark[cell];
    const unsigned char listed = (unsigned char)(CUT_FACE << axis);
    if (*mark & listed)
        return;
    *mark |= listed;
    int *face = lattice->changes.face[lattice->changes.face_count++];
    face[0] = cell;
    face[1] = axis;
}

// Frees the rows of what was a leaf, or had cells as children, before the change.
static void free_rows(CutLattice *lattice, int element)
{
    CutScratch *scratch = lattice->scratch;
    const int at = element - lattice->level_first[1];
    if (at < 0 || lattice->leaf_row == NULL)
        return;
    if (lattice->leaf_row[at] >= 0 && !cut_lattice_is_leaf(lattice, element)) {
        scratch->spare_row[1][scratch->spare_count[1]++] = lattice->leaf_row[at];
        lattice->leaf_row[at] = -1;
    }
    if (element < lattice->level_first[2] && lattice->family_row[at] >= 0 &&
        !lattice->divided[element]) {
        scratch->spare_row[0][scratch->spare_count[0]++] = lattice->family_row[at];
        lattice->family_row[at] = -1;
    }
}

void cut_lattice_forget_changes(CutLattice *lattice)
{
    CutChanges *changes = &lattice->changes;
    for (int i = 0; i < changes->element_count; i++) {
        lattice->mark[changes->element[i]] &= (unsigned char)~(CUT_LISTED | CUT_MERGED);
        free_rows(lattice, changes->element[i]);
    }
    for (int i = 0; i < changes->face_count; i++)
        lattice->mark[changes->face[i][0]] &= (unsigned char)~CUT_FACES;
    for (int i = 0; i < changes->lost_count; i++)
        lattice->scratch->is_lost[changes->lost[i]] = false;
    cut_points_free_ended(lattice);
    changes->element_count = changes->birth_count = changes->face_count = changes->lost_count = 0;
    changes->merged_count = changes->ended_count = 0;
    lattice->scratch->left_larger = 0;
}
