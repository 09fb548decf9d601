// SPDX-License-Identifier: MIT
// The elements and vertices that a cut body can ever have: creation, look-up, and derivation from
// the bits.
#include "voxel/cut/cut_parts.h"

#include "base/check.h"

#include <limits.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// Elements: all blocks of cells that a leaf covers

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

static int count_elements(const Layout *layout)
{
    long count = 0;
    for (int e = 0; e < layout->leaf_count; e++)
        for (int level = layout->leaf[e].level, blocks = 1; level >= 0; level--, blocks *= 8)
            count += blocks;
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
        // Blocks that no leaf covers entirely have no element.
        int *slot = &lattice->lut[level][((long)k * ny + j) * nx + i];
        *slot = -1;
        const int leaf = covering_leaf(layout, level, i, j, k);
        if (leaf < 0)
            continue;
        // Numbered along the curve.
        *slot = lattice->element_count++;
        lattice->element[*slot] = (CutElement){
            .cell = {i << level, j << level, k << level},
            .parent = -1,
            .child = -1,
            .level = (unsigned char)level,
            .material = layout->leaf[leaf].material,
        };
        lattice->window_of[*slot] = lattice->window_count;
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

static void join_families(CutLattice *lattice)
{
    for (int e = 0; e < lattice->element_count; e++) {
        CutElement *element = &lattice->element[e];
        const int above = element->level + 1;
        if (above > lattice->levels)
            continue;
        element->parent = cut_parts_block(lattice, above, element->cell[0] >> above,
                                          element->cell[1] >> above, element->cell[2] >> above);
        if (element->parent >= 0 && lattice->element[element->parent].child < 0)
            lattice->element[element->parent].child = e; // the first of the eight comes first
    }
}

static void create_elements(CutLattice *lattice, const char *name, const Layout *layout,
                            Arena *arena)
{
    lattice->levels = layout->levels;
    memcpy(lattice->count, layout->count, sizeof lattice->count);
    memcpy(lattice->lattice_count, layout->lattice_count, sizeof lattice->lattice_count);
    // All elements that can ever exist.
    const int elements = count_elements(layout);
    lattice->element = ALLOCATE(ARENA_TOPOLOGY, elements, CutElement, "elements");
    lattice->window_of = ALLOCATE(ARENA_TOPOLOGY, elements, int, "windows of elements");
    // Look-up tables by level, and the most windows there can be.
    long windows = 0;
    for (int level = 0; level <= layout->levels; level++) {
        long blocks = 1, within = 1;
        for (int d = 0; d < 3; d++) {
            blocks *= blocks_along(lattice, level, d);
            within *= windows_along(lattice, level, d);
        }
        lattice->lut[level] = ALLOCATE(ARENA_TOPOLOGY, blocks, int, "element table");
        windows += within;
    }
    lattice->window = ALLOCATE(ARENA_TOPOLOGY, windows, CutWindow, "windows");
    // Numbers first: parents and children follow from them.
    number_elements(lattice, layout);
    ASSERT(lattice->element_count == elements);
    join_families(lattice);
}

// ---------------------------------------------------------------------------------------------
// Everything else

static void create_scratch(CutLattice *lattice, const char *name, Arena *arena)
{
    CutScratch *scratch = ALLOCATE(ARENA_TOPOLOGY, 1, CutScratch, "cut scratch");
    lattice->scratch = scratch;
    // Sizes of the lattice.
    long points = 1;
    for (int d = 0; d < 3; d++)
        points *= scratch->points[d] = lattice->lattice_count[d] + 1;
    const int elements = lattice->element_count, cells = lattice->level_first[1];
    // Where leaves and vertices are.
    scratch->grid = ALLOCATE(
        ARENA_TOPOLOGY,
        cut_parts_grid(lattice, lattice->count[0], lattice->count[1], lattice->count[2]) + 1, int,
        "leaves of cells");
    scratch->point = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)lattice->vertex_capacity,
                                    sizeof *scratch->point, "%s/%s", name, "points of vertices");
    scratch->head = ALLOCATE(ARENA_TOPOLOGY, points, int, "first vertices");
    scratch->next = ALLOCATE(ARENA_TOPOLOGY, lattice->vertex_capacity, int, "next vertices");
    scratch->visited = ALLOCATE(ARENA_TOPOLOGY, points, unsigned char, "visited points");
    if (lattice->removable)
        scratch->is_lost = ALLOCATE(ARENA_TOPOLOGY, lattice->vertex_capacity, bool, "lost");
    // What a change marks.
    scratch->bitten = ALLOCATE(ARENA_TOPOLOGY, elements, unsigned char, "bitten elements");
    scratch->fresh = ALLOCATE(ARENA_TOPOLOGY, elements - cells, int, "fresh wishes");
    scratch->listed_element = ALLOCATE(ARENA_TOPOLOGY, elements, bool, "listed elements");
    scratch->listed_face = ALLOCATE(ARENA_TOPOLOGY, cells, unsigned char, "listed faces");
    // Tables of a divided element.
    for (int at = 0; at < 27; at++)
        scratch->node_at[at] = (signed char)node_at_offset(at % 3, at / 3 % 3, at / 9);
    cut_points_list_parents(scratch);
    // Room for the largest change possible.
    CutChanges *changes = &lattice->changes;
    changes->element = ALLOCATE(ARENA_TOPOLOGY, elements, int, "changed elements");
    changes->birth = ALLOCATE(ARENA_TOPOLOGY, lattice->vertex_capacity, CutBirth, "born vertices");
    if (lattice->removable)
        changes->lost = ALLOCATE(ARENA_TOPOLOGY, lattice->vertex_capacity, int, "lost vertices");
    changes->face = arena_allocate(arena, ARENA_TOPOLOGY, 3 * (size_t)cells, sizeof *changes->face,
                                   "%s/%s", name, "changed faces");
}

static void create_state(CutLattice *lattice, const char *name, Arena *arena, StateList *state)
{
    const size_t elements = (size_t)lattice->element_count, cells = (size_t)lattice->level_first[1];
    const size_t vertices = (size_t)lattice->vertex_capacity;
    lattice->divided = ALLOCATE(ARENA_TOPOLOGY, elements, unsigned char, "divided");
    lattice->broken = ALLOCATE(ARENA_TOPOLOGY, cells, unsigned char, "broken");
    lattice->vertex_id = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "cut vertex ids");
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
    lattice->corner = arena_allocate(arena, ARENA_TOPOLOGY, cells, sizeof *lattice->corner, "%s/%s",
                                     name, "corners");
    lattice->node = arena_allocate(arena, ARENA_TOPOLOGY, elements - cells, sizeof *lattice->node,
                                   "%s/%s", name, "nodes");
    lattice->wanted = ALLOCATE(ARENA_TOPOLOGY, elements - cells, int, "wanted divisions");
}

bool cut_lattice_create(CutLattice *lattice, const VoxelMaking *making, Arena *arena,
                        StateList *state, Status *status)
{
    const char *name = making->options->body.name;
    const LatticeMesh *mesh = &making->mesh;
    const int capacity = making->capacity;
    *lattice = (CutLattice){.vertex_capacity = capacity,
                            .split_budget = making->options->split_budget,
                            .removable = making->options->body.removable};
    if (mesh->vertex_count > capacity)
        return status_fail(status, STATUS_INVALID, "%s: %d vertices do not fit vertex_capacity %d",
                           name, mesh->vertex_count, capacity);
    // Elements, then vertices as in the uncut body.
    create_elements(lattice, name, &making->layout, arena);
    create_scratch(lattice, name, arena);
    create_state(lattice, name, arena, state);
    memset(lattice->vertex_id, -1, (size_t)capacity * sizeof *lattice->vertex_id);
    memcpy(lattice->vertex_id, mesh->id, (size_t)mesh->vertex_count * sizeof *mesh->id);
    *lattice->vertex_count = mesh->vertex_count;
    if (lattice->removable) // nothing is gone: as the ids say
        cut_points_find_anchors(lattice);
    const bool sound = cut_lattice_derive(lattice);
    ASSERT(sound);
    return true;
}

// ---------------------------------------------------------------------------------------------
// Looking up

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

int cut_lattice_leaf_of(const CutLattice *lattice, int cell)
{
    return cut_parts_leaf(lattice, cell);
}

void cut_parts_enter_leaf(CutLattice *lattice, int leaf)
{
    const CutElement *element = &lattice->element[leaf];
    const int edge = 1 << element->level, *at = element->cell;
    for (int k = 0; k < edge; k++)
        for (int j = 0; j < edge; j++) {
            int *row =
                &lattice->scratch->grid[cut_parts_grid(lattice, at[0], at[1] + j, at[2] + k)];
            for (int i = 0; i < edge; i++)
                row[i] = leaf;
        }
}

int cut_lattice_across(const CutLattice *lattice, int cell, int direction)
{
    const int *at = lattice->element[cell].cell;
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
    if (lattice->scratch->listed_element[element])
        return;
    lattice->scratch->listed_element[element] = true;
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
    unsigned char *listed = &lattice->scratch->listed_face[cell];
    if (*listed >> axis & 1)
        return;
    *listed |= (unsigned char)(1 << axis);
    int *face = lattice->changes.face[lattice->changes.face_count++];
    face[0] = cell;
    face[1] = axis;
}

void cut_lattice_forget_changes(CutLattice *lattice)
{
    CutChanges *changes = &lattice->changes;
    for (int i = 0; i < changes->element_count; i++)
        lattice->scratch->listed_element[changes->element[i]] = false;
    for (int i = 0; i < changes->face_count; i++)
        lattice->scratch->listed_face[changes->face[i][0]] = 0;
    for (int i = 0; i < changes->lost_count; i++)
        lattice->scratch->is_lost[changes->lost[i]] = false;
    changes->element_count = changes->birth_count = changes->face_count = changes->lost_count = 0;
}

// ---------------------------------------------------------------------------------------------
// Everything is derived from the bits: at load, and after the state was replaced. Step thread

static int point_count(const CutScratch *scratch)
{
    return scratch->points[0] * scratch->points[1] * scratch->points[2];
}

// True if elements are divided only where they can be, and none borders on a leaf two levels
// larger.
static bool divisions_are_valid(const CutLattice *lattice)
{
    // Only what has children is divided, and only inside of what is divided.
    for (int e = 0; e < lattice->element_count; e++) {
        const CutElement *element = &lattice->element[e];
        const bool may = cut_parts_is_cell(lattice, e) ? lattice->removable : element->child >= 0;
        if (lattice->divided[e] > 1 || (lattice->divided[e] && !may))
            return false;
        if (lattice->divided[e] && element->parent >= 0 && !lattice->divided[element->parent])
            return false;
    }
    // Whatever touches a leaf is at most one level larger.
    for (int e = 0; e < lattice->element_count; e++) {
        const bool gone = cut_parts_is_cell(lattice, e) && cut_lattice_is_gone(lattice, e);
        if (!cut_lattice_is_leaf(lattice, e) && !gone)
            continue;
        const CutElement *element = &lattice->element[e];
        const int level = element->level;
        for (int n = 0; n < 27; n++) {
            const int around =
                cut_parts_block(lattice, level, (element->cell[0] >> level) - 1 + n % 3,
                                (element->cell[1] >> level) - 1 + n / 3 % 3,
                                (element->cell[2] >> level) - 1 + n / 9);
            if (around < 0 || lattice->divided[around])
                continue;
            if (gone && (n == 4 || n == 10 || n == 12 || n == 14 || n == 16 || n == 22) &&
                cut_parts_leaf(lattice, around) != around) // a neighbour across a face
                return false;
            if (lattice->element[cut_parts_leaf(lattice, around)].level > level + 1)
                return false;
        }
    }
    return true;
}

static bool bits_are_valid(const CutLattice *lattice)
{
    for (int cell = 0; cell < lattice->level_first[1]; cell++) {
        if (lattice->broken[cell] > 7)
            return false;
        for (int axis = 0; axis < 3; axis++) {
            const int beyond = cut_lattice_across(lattice, cell, 2 * axis + 1);
            const bool broken = lattice->broken[cell] >> axis & 1;
            // Broken where there is something to break, and around what is gone.
            if (broken ? beyond < 0
                       : beyond >= 0 && (cut_lattice_is_gone(lattice, cell) ||
                                         cut_lattice_is_gone(lattice, beyond)))
                return false;
        }
    }
    return true;
}

static bool ids_are_valid(const CutLattice *lattice)
{
    if (*lattice->vertex_count < 0 || *lattice->vertex_count > lattice->vertex_capacity)
        return false;
    const int most = 8 * point_count(lattice->scratch);
    for (int v = 0; v < lattice->vertex_capacity; v++) {
        const int id = lattice->vertex_id[v];
        if (v < *lattice->vertex_count ? id < 0 || id >= most : id != -1)
            return false;
        if (lattice->removable && (lattice->anchor[v] < -1 || lattice->anchor[v] > 7))
            return false;
    }
    return true;
}

static void enter_leaves(CutLattice *lattice)
{
    const long margin =
        cut_parts_grid(lattice, lattice->count[0], lattice->count[1], lattice->count[2]) + 1;
    // The grid has a margin of void cells.
    memset(lattice->scratch->grid, -1, (size_t)margin * sizeof *lattice->scratch->grid);
    lattice->leaf_count = 0;
    memset(lattice->leaf_at_level, 0, sizeof lattice->leaf_at_level);
    for (int e = 0; e < lattice->element_count; e++)
        if (cut_lattice_is_leaf(lattice, e)) {
            lattice->leaf_count++;
            lattice->leaf_at_level[lattice->element[e].level]++;
            cut_parts_enter_leaf(lattice, e);
        }
}

static void find_wanted(CutLattice *lattice)
{
    CutScratch *scratch = lattice->scratch;
    memset(scratch->bitten, 0, (size_t)lattice->element_count * sizeof *scratch->bitten);
    lattice->wanted_count = 0;
    for (int cell = 0; cell < lattice->level_first[1]; cell++)
        for (int axis = 0; axis < 3; axis++)
            if (lattice->broken[cell] >> axis & 1) {
                cut_split_bite(lattice, cell);
                cut_split_bite(lattice, cut_lattice_across(lattice, cell, 2 * axis + 1));
            }
    cut_split_sort(lattice, 0);
}

static bool find_vertices(CutLattice *lattice)
{
    CutScratch *scratch = lattice->scratch;
    // List the vertices by their points.
    memset(scratch->head, -1, (size_t)point_count(scratch) * sizeof *scratch->head);
    if (!lattice->removable)
        cut_points_find_anchors(lattice);
    int present = 0;
    for (int v = 0; v < cut_lattice_used(lattice); v++) {
        cut_points_add(lattice, v);
        present += lattice->anchor[v] >= 0;
    }
    // Visit all points at which leaves meet; no vertex may be missing.
    int expected = 0, leaf[8];
    for (int z = 0; z < scratch->points[2]; z++)
        for (int y = 0; y < scratch->points[1]; y++)
            for (int x = 0; x < scratch->points[0]; x++) {
                const int point[3] = {x, y, z};
                cut_lattice_around(lattice, point, leaf);
                bool one = true; // a point inside a leaf is not on its border
                for (int s = 1; s < 8; s++)
                    one &= leaf[s] == leaf[0];
                if (one)
                    continue;
                expected += cut_points_wanted(lattice, point, leaf);
                if (!cut_points_visit(lattice, point, leaf, CUT_NO_BIRTHS))
                    return false;
            }
    // Each expected vertex was found: equal counts mean all of them, and none twice.
    return expected == present;
}

bool cut_lattice_derive(CutLattice *lattice)
{
    cut_lattice_forget_changes(lattice);
    // Forget what was derived before.
    const size_t cells = (size_t)lattice->level_first[1];
    memset(lattice->corner, -1, cells * sizeof *lattice->corner);
    memset(lattice->node, -1, ((size_t)lattice->element_count - cells) * sizeof *lattice->node);
    lattice->wanted_count = 0;
    // Bits first; then vertices, which must be those of the ids.
    if (!divisions_are_valid(lattice) || !bits_are_valid(lattice) || !ids_are_valid(lattice))
        return false;
    enter_leaves(lattice);
    find_wanted(lattice);
    const bool sound = find_vertices(lattice);
    cut_lattice_forget_changes(lattice);
    return sound;
}
